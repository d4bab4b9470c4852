//! The features near a ball: patches, edges and corners that its feet may be on.
//!
//! Problem: of eight patches there are 28 pairs and 56 triples; to look at all of them each tick would take too long.
//!
//! Model: all that comes as near to an anchor as some reach is listed once, with its distance. While the ball is in that
//! reach, a feature whose distance from the anchor exceeds the ball's by more than the way from there need not be looked at.
//! Corners stand still, so that those which are no boundary are left out.
//!
//! Limits: of more than [`MOST_PATCHES`] patches within reach the nearest count; of more than [`MOST_FEATURES`] places to
//! start from, those on the nearest patches.
//! Cost: a level for each patch nearby, a few Newton steps for each pair and triple of them, every few ticks.

use nalgebra::Vector3;

use super::nearest::nearest_on;
use super::on::On;
use super::place::is_boundary;
use crate::csg::near::Neighbourhood;
use crate::csg::patch::Patch;
use crate::csg::{Csg, Step};

/// What is near an anchor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vicinity {
    anchor_B: Vector3<f64>,
    /// All that comes as near to the anchor is listed (m).
    reach_m: f64,
    /// The solid in terms of sides, unless too many patches are near.
    near: Option<Neighbourhood>,
    patches: Patches,
    features: [Feature; MOST_FEATURES],
    count: usize,
}

/// Patches in order of their distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patches {
    numbers: [u16; MOST_PATCHES],
    levels_m: [f64; MOST_PATCHES],
    count: usize,
}

/// Where a foot may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feature {
    pub(super) on: On,
    /// Where to start from.
    pub(super) point_B: Vector3<f64>,
    /// From the anchor to the nearest point of all (m).
    distance_m: f64,
}

impl Default for Vicinity {
    fn default() -> Self {
        let nowhere = Feature { on: On::NOTHING, point_B: Vector3::zeros(), distance_m: f64::INFINITY };
        Self {
            anchor_B: Vector3::zeros(),
            reach_m: -1.0,
            near: None,
            patches: Patches::NONE,
            features: [nowhere; MOST_FEATURES],
            count: 0,
        }
    }
}

impl Vicinity {
    /// Of all within `reach_m`.
    #[inline(never)]
    pub(super) fn around(csg: &Csg, anchor_B: &Vector3<f64>, reach_m: f64) -> Self {
        let mut here = Self {
            anchor_B: *anchor_B,
            reach_m,
            near: Neighbourhood::exactly(csg, anchor_B, reach_m),
            patches: Patches::around(csg, anchor_B, reach_m),
            ..Self::default()
        };
        let patches = here.patches;
        let numbers = patches.numbers();
        for (i, &a) in numbers.iter().enumerate() {
            here.add_patch(csg, a);
            for (j, &b) in numbers.iter().enumerate().take(i) {
                let before = here.count;
                here.add_edge(csg, [a, b]);
                if here.count == before {
                    continue;
                }
                for &c in numbers.iter().take(j) {
                    here.add_corner(csg, [a, b, c]);
                }
            }
        }
        here
    }

    /// How far around a point all is listed (m).
    pub(super) fn known_m(&self, point_B: &Vector3<f64>) -> f64 {
        self.reach_m - (point_B - self.anchor_B).norm()
    }

    /// Whether all that is as near to a point as `reach_m` is listed.
    #[inline]
    pub(super) fn holds(&self, point_B: &Vector3<f64>, reach_m: f64) -> bool {
        (point_B - self.anchor_B).norm() + reach_m <= self.reach_m
    }

    /// The solid around a point.
    #[inline]
    pub(super) fn near(&self, csg: &Csg, point_B: &Vector3<f64>) -> Neighbourhood {
        match &self.near {
            Some(near) if near.holds(point_B, 0.0) => *near,
            _ => Neighbourhood::around(csg, point_B, 0.0),
        }
    }

    /// Features that may be nearer to a point than `at_most_m`.
    #[inline]
    pub(super) fn features(&self, point_B: &Vector3<f64>, at_most_m: f64) -> impl Iterator<Item = &Feature> {
        let farthest_m = (point_B - self.anchor_B).norm() + at_most_m;
        let features = self.features.get(..self.count).unwrap_or_default();
        features.iter().filter(move |feature| feature.distance_m <= farthest_m)
    }

    pub(super) fn patches(&self) -> &Patches {
        &self.patches
    }

    fn add_patch(&mut self, csg: &Csg, number: u16) {
        let on = On::of([number]);
        let Some(patch) = csg.patches.get(usize::from(number)) else { return };
        if patch.is_round() || patch.level(&self.anchor_B) > 0.0 {
            // One point of it is nearest, wherever one starts.
            self.add(csg, on, self.anchor_B);
        } else {
            self.add_all_over(csg, on);
        }
    }

    fn add_edge(&mut self, csg: &Csg, [a, b]: [u16; 2]) {
        let on = On::of([a, b]);
        let patch = |number: u16| csg.patches.get(usize::from(number));
        let (Some(a), Some(b)) = (patch(a), patch(b)) else { return };
        if a.meets_in_one_circle(b) {
            // Right above the middle of a circle both normals are the same, and there is no way to it.
            let mut starts = std::iter::once(self.anchor_B).chain(self.starts());
            starts.any(|start_B| self.add(csg, on, start_B));
        } else {
            self.add_all_over(csg, on);
        }
    }

    /// Of what is bent more than one point may be near, and others where the ball has moved: from all over.
    fn add_all_over(&mut self, csg: &Csg, on: On) {
        let first = self.count;
        let mut least_m = f64::INFINITY;
        let [up_B, .., down_B] = self.starts();
        let meets = [self.anchor_B, up_B, down_B]
            .iter()
            .any(|start_B| nearest_on(csg, &on, start_B, start_B).is_some());
        if !meets {
            // Most patches that are met from none of these do not meet.
            return;
        }
        for start_B in std::iter::once(self.anchor_B).chain(self.starts()) {
            let Some(here_B) = nearest_on(csg, &on, &start_B, &start_B) else { continue };
            let Some(nearest_B) = nearest_on(csg, &on, &here_B, &self.anchor_B) else { continue };
            least_m = least_m.min((nearest_B - self.anchor_B).norm());
            self.note(on, nearest_B, APART);
            self.note(on, here_B, APART);
        }
        if least_m <= self.reach_m {
            let added = self.features.get_mut(first..self.count).unwrap_or_default();
            added.iter_mut().for_each(|feature| feature.distance_m = least_m);
        } else {
            self.count = first;
        }
    }

    fn add_corner(&mut self, csg: &Csg, [a, b, c]: [u16; 3]) {
        let on = On::of([a, b, c]);
        self.add_corner_from(csg, on, self.anchor_B);
        if !is_flat(csg, &[a, b, c]) {
            for start_B in self.starts() {
                self.add_corner_from(csg, on, start_B);
            }
        }
    }

    fn add_corner_from(&mut self, csg: &Csg, on: On, start_B: Vector3<f64>) {
        let Some(point_B) = nearest_on(csg, &on, &start_B, &self.anchor_B) else { return };
        if (point_B - self.anchor_B).norm() <= self.reach_m
            && is_boundary(csg, &self.near(csg, &point_B), &point_B)
        {
            self.note(on, point_B, SAME);
        }
    }

    /// Where else to start from than the anchor.
    fn starts(&self) -> [Vector3<f64>; 6] {
        let way_m = AWAY * self.reach_m;
        std::array::from_fn(|i| self.anchor_B + Vector3::ith(i % 3, if i < 3 { way_m } else { -way_m }))
    }

    /// Adds the nearest point that one comes to from a start, if it is within reach; whether one comes to any.
    fn add(&mut self, csg: &Csg, on: On, start_B: Vector3<f64>) -> bool {
        let Some(point_B) = nearest_on(csg, &on, &start_B, &self.anchor_B) else { return false };
        if (point_B - self.anchor_B).norm() <= self.reach_m {
            self.note(on, point_B, SAME);
        }
        true
    }

    /// Takes note of a point, if there is room, and none as near as this share of the reach is known.
    fn note(&mut self, on: On, point_B: Vector3<f64>, same: f64) {
        let same_m = same * self.reach_m;
        let known = self.features.get(..self.count).unwrap_or_default();
        if known.iter().any(|feature| feature.on == on && (feature.point_B - point_B).amax() <= same_m) {
            return;
        }
        if let Some(place) = self.features.get_mut(self.count) {
            *place = Feature { on, point_B, distance_m: (point_B - self.anchor_B).norm() };
            self.count += 1;
        }
    }
}

impl Patches {
    const NONE: Self = Self { numbers: [0; MOST_PATCHES], levels_m: [f64::INFINITY; MOST_PATCHES], count: 0 };

    /// Those of which a leaf may have boundary within the reach.
    pub(super) fn around(csg: &Csg, anchor_B: &Vector3<f64>, reach_m: f64) -> Self {
        let mut here = Self::NONE;
        for step in &csg.steps {
            let Step::Leaf { centre_B, radius_m, first, count } = *step else { continue };
            let to_leaf_m = radius_m + reach_m;
            if (anchor_B - centre_B).norm_squared() > to_leaf_m * to_leaf_m {
                continue;
            }
            let items = csg.items.get(first as usize..(first + count) as usize).unwrap_or_default();
            let before = here;
            for item in items {
                let level =
                    csg.patches.get(usize::from(item.patch)).map_or(f64::INFINITY, |p| p.level(anchor_B));
                if level.abs() <= reach_m {
                    here.add(item.patch, level.abs());
                } else if (level <= 0.0) == item.is_flipped {
                    // Nothing of this leaf is within reach.
                    here = before;
                    break;
                }
            }
        }
        here
    }

    pub(super) fn numbers(&self) -> &[u16] {
        self.numbers.get(..self.count).unwrap_or_default()
    }

    fn add(&mut self, number: u16, level_m: f64) {
        if self.numbers().contains(&number) {
            return;
        }
        let mut newcomer = (number, level_m);
        for i in 0..self.count {
            if newcomer.1 < self.levels_m[i] {
                newcomer = (
                    std::mem::replace(&mut self.numbers[i], newcomer.0),
                    std::mem::replace(&mut self.levels_m[i], newcomer.1),
                );
            }
        }
        if self.count < MOST_PATCHES {
            (self.numbers[self.count], self.levels_m[self.count]) = newcomer;
            self.count += 1;
        }
    }
}

fn is_flat(csg: &Csg, numbers: &[u16]) -> bool {
    numbers.iter().all(|&number| csg.patches.get(usize::from(number)).is_some_and(Patch::is_plane))
}

const MOST_PATCHES: usize = 24;
const MOST_FEATURES: usize = 128;
/// Of the reach: where starts beside the anchor lie.
const AWAY: f64 = 0.6;
/// Of the reach: points that are as near to each other are one.
const SAME: f64 = 1e-9;
/// Of the reach: from points that are as near to each other one comes to the same nearest one.
const APART: f64 = 0.2;
