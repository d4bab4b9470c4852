//! Solids as ground for balls: exactly, by the equations of their patches, edges and corners (Melder ch. 6.3.1 and 9.3).
//!
//! Model: a ball's centre keeps the distance r from the solid. What it touches are feet, points where the distance from
//! the centre is least: inside of a patch, on an edge that is convex, on a corner that is. Which these are the [`vicinity`]
//! tells; whether one is boundary, and seen from the centre, its [`place`]; how it goes along as the ball rolls, [`foot`].
//!
//! Frames: the solid's own, B. Limits: of more than eight patches that meet in one point, and of more than 24 within the
//! ball's reach, the nearest count.
//! Cost: in a common tick a few Newton steps on what it rests on and a look at each feature within r.

mod foot;
mod nearest;
mod on;
mod place;
mod vicinity;

use nalgebra::Vector3;

use self::foot::Foot;
use self::nearest::nearest_on;
use self::on::On;
use self::place::{Place, place};
use self::vicinity::{Patches, Vicinity};
use super::Csg;
use super::near::Neighbourhood;
use super::way_out::way_out;
use crate::algorithm::{Touch, TouchInput};
use crate::mesh::{Beginning, TooMany};
use crate::rolling::{Ground, Plane, RollingCone, Share};
use crate::surface::Feature;
use crate::tangent_view::tangential;

/// State of one spherical finger towards one solid.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BallOnCsg {
    rolling: RollingCone<Foot, ()>,
    vicinity: Vicinity,
    /// Which solid the vicinity is of.
    csg: Option<u64>,
}

/// A solid, and what is known to be near.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CsgGround<'c> {
    csg: &'c Csg,
    vicinity: &'c Vicinity,
}

impl BallOnCsg {
    /// One tick; `None` while the finger is free.
    pub(crate) fn update(&mut self, csg: &Csg, input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        if self.csg != Some(csg.identity) {
            *self = Self { csg: Some(csg.identity), ..Self::default() };
        }
        if let Some(centre_B) = self.rolling.centre_B() {
            let radius_m = input.finger_radius_m;
            if !self.vicinity.holds(&centre_B, (1.0 + LEAST_MARGIN) * radius_m) {
                self.vicinity = Vicinity::around(csg, &centre_B, (1.0 + MARGIN) * radius_m);
            }
        }
        self.rolling.update(&CsgGround { csg, vicinity: &self.vicinity }, input)
    }

    pub(crate) fn is_touching(&self) -> bool {
        self.rolling.is_touching()
    }

    pub(crate) fn shares(&self) -> impl Iterator<Item = Share> {
        self.rolling.shares()
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        self.rolling.let_go();
    }
}

impl Csg {
    /// Shortest way of a ball to where it touches nothing, or less; 0 if it is free \[m\].
    ///
    /// Outside a bound of the distance from below would make it longer than it is: there it is measured from a foot.
    pub(crate) fn overlap_m(&self, centre_B: &Vector3<f64>, radius_m: f64) -> f64 {
        let clear_m = self.signed_distance(centre_B);
        if clear_m <= 0.0 {
            return radius_m - clear_m;
        }
        let ground = CsgGround { csg: self, vicinity: &Vicinity::default() };
        match ground.nearest_within(centre_B, radius_m) {
            Ok(Some((_, distance_m))) => radius_m - distance_m,
            _ => 0.0,
        }
    }
}

impl CsgGround<'_> {
    /// The solid around a point.
    #[inline]
    fn around(&self, point_B: &Vector3<f64>) -> Neighbourhood {
        self.vicinity.near(self.csg, point_B)
    }

    /// The patches that a way may cross.
    fn listed(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Patches {
        if self.vicinity.holds(from_B, 0.0) && self.vicinity.holds(to_B, 0.0) {
            return *self.vicinity.patches();
        }
        let middle_B = 0.5 * (from_B + to_B);
        Patches::around(self.csg, &middle_B, (to_B - middle_B).norm() + self.csg.tolerance_m())
    }

    /// The foot of a ball that is drawn to a HIP below a patch: on the line through it across that patch. From an edge or
    /// a corner it is drawn to the patch on the HIP's side: there is no rest on the way.
    fn below(
        &self,
        foot: &Foot,
        normal_B: &Vector3<f64>,
        hip_B: &Vector3<f64>,
        radius_m: f64,
    ) -> Option<Foot> {
        if matches!(foot.feature, Feature::Face | Feature::Surface) {
            let there = self.below_patch(foot, hip_B, radius_m)?;
            return (there.normal_B.dot(normal_B) > SAME_SIDE).then_some(there);
        }
        let to_hip_B = tangential(&(hip_B - foot.point_B), normal_B);
        let near = self.around(&foot.point_B);
        let centre_B = foot.point_B + normal_B;
        let patches = foot.on.numbers().iter().map(|&number| {
            let beside = Foot::at(self, &near, On::of([number]), foot.point_B, &centre_B);
            (beside.normal_B.dot(&to_hip_B), beside)
        });
        let (_, beside) = patches.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        self.below_patch(&beside, hip_B, radius_m)
    }

    fn below_patch(&self, foot: &Foot, hip_B: &Vector3<f64>, radius_m: f64) -> Option<Foot> {
        let point_B = nearest_on(self.csg, &foot.on, &foot.point_B, hip_B)?;
        let near = self.around(&point_B);
        let there = Foot::at(self, &near, foot.on, point_B, hip_B);
        // In a hollow that it does not fit into, a ball would have another point nearer.
        let centre_B = point_B + there.normal_B * radius_m;
        let its_foot_B = nearest_on(self.csg, &foot.on, &point_B, &centre_B)?;
        let is_its_foot = (its_foot_B - point_B).norm() <= SAME_FOOT * radius_m;
        let is_boundary = place(self.csg, &near, &point_B, &centre_B) == Place::Foot;
        (is_its_foot && is_boundary && there.feature == foot.feature).then_some(there)
    }

    fn nearest_in(
        &self,
        vicinity: &Vicinity,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Option<(Foot, f64)> {
        let mut best: Option<(Foot, f64)> = None;
        for feature in vicinity.features(centre_B, at_most_m) {
            let Some(point_B) = nearest_on(self.csg, &feature.on, &feature.point_B, centre_B) else {
                continue;
            };
            let distance_m = (point_B - centre_B).norm();
            let least_m = best.as_ref().map_or(at_most_m, |(_, least_m)| *least_m);
            if distance_m.is_nan() || distance_m >= least_m {
                continue;
            }
            let near = vicinity.near(self.csg, &point_B);
            if place(self.csg, &near, &point_B, centre_B) != Place::Foot {
                continue;
            }
            let foot = Foot::at(self, &near, feature.on, point_B, centre_B);
            // The far side of a wall is not in the way.
            if foot.normal_B.dot(&(centre_B - point_B)) >= 0.0 {
                best = Some((foot, distance_m));
            }
        }
        best
    }
}

impl Ground for CsgGround<'_> {
    type Foot = Foot;
    type Vicinity = ();
    const IS_BENT: bool = true;

    fn identity(&self) -> u64 {
        self.csg.identity
    }

    #[inline]
    fn extent_m(&self) -> f64 {
        self.csg.extent_m
    }

    fn clearance_m(&self, point_B: &Vector3<f64>, _at_most_m: f64) -> f64 {
        self.csg.signed_distance(point_B).abs()
    }

    fn seen_m(&self, _radius_m: f64) -> f64 {
        // Of what lies around a place inside of the material nothing is told.
        0.0
    }

    fn is_inside(&self, point_B: &Vector3<f64>) -> bool {
        self.csg.is_inside(point_B)
    }

    fn way_out(&self, point_B: &Vector3<f64>) -> Option<Foot> {
        if !self.csg.is_inside(point_B) {
            return None;
        }
        let god = way_out(self.csg, point_B)?;
        let number = u16::try_from(god.piece()).ok()?;
        Some(Foot::at(self, &god.near, On::of([number]), god.point_B, &god.point_B))
    }

    fn normal_B(&self, foot: &Foot) -> Vector3<f64> {
        foot.normal_B
    }

    #[inline]
    fn walked(&self, foot: &Foot, centre_B: &Vector3<f64>, radius_m: f64, is_alone: bool) -> Foot {
        foot.walked(self, centre_B, radius_m, is_alone)
    }

    fn distance_m(&self, foot: &Foot, centre_B: &Vector3<f64>, is_alone: bool) -> f64 {
        if !is_alone {
            return (foot.point_B - centre_B).norm();
        }
        let nearest_B = nearest_on(self.csg, &foot.on, &foot.point_B, centre_B);
        (nearest_B.unwrap_or(foot.point_B) - centre_B).norm()
    }

    fn followed(&self, foot: &Foot, centre_B: &Vector3<f64>) -> Foot {
        foot.followed(self, centre_B).unwrap_or(*foot)
    }

    #[inline]
    fn plane(&self, foot: &Foot, centre_B: &Vector3<f64>, radius_m: f64) -> Plane {
        foot.plane(self, centre_B, radius_m)
    }

    fn nearest_within(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Result<Option<(Foot, f64)>, TooMany> {
        if self.vicinity.holds(centre_B, at_most_m) {
            return Ok(self.nearest_in(self.vicinity, centre_B, at_most_m));
        }
        let clear_m = self.csg.signed_distance(centre_B);
        if clear_m.is_nan() || clear_m <= 0.0 || clear_m >= at_most_m {
            return Ok(None);
        }
        let vicinity = Vicinity::around(self.csg, centre_B, at_most_m);
        Ok(self.nearest_in(&vicinity, centre_B, at_most_m))
    }

    fn nearest_above(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
        _plane: (&Vector3<f64>, f64),
    ) -> Result<Option<Foot>, TooMany> {
        Ok(self.nearest_within(centre_B, at_most_m)?.map(|(foot, _)| foot))
    }

    fn is_clear(
        &self,
        _vicinity: &mut (),
        _centre_B: &Vector3<f64>,
        _normal_B: &Vector3<f64>,
        _near_m: f64,
        _moved_m: f64,
    ) -> bool {
        false
    }

    /// Pieces are bent: nobody goes far on them.
    fn crossed_at(&self, _way_B: [&Vector3<f64>; 2]) -> Option<f64> {
        Some(0.0)
    }

    fn room_m(&self, centre_B: &Vector3<f64>, radius_m: f64, ahead_m: f64) -> Option<f64> {
        let known_m = self.csg.signed_distance(centre_B) - radius_m;
        let ahead_m = ahead_m.min(LOOK_AHEAD * radius_m);
        if known_m >= ahead_m {
            return Some(known_m);
        }
        // What is listed already costs least.
        let listed_m = self.vicinity.known_m(centre_B) - radius_m;
        let ahead_m = if listed_m > LEAST_MARGIN * radius_m { ahead_m.min(listed_m) } else { ahead_m };
        let near = self.nearest_within(centre_B, radius_m + ahead_m).ok()?;
        Some(near.map_or(ahead_m, |(_, distance_m)| distance_m - radius_m))
    }

    fn seat(
        &self,
        foot: &Foot,
        normal_B: &Vector3<f64>,
        hip_B: &Vector3<f64>,
        radius_m: f64,
    ) -> Option<(Foot, Plane)> {
        let (there, is_seen) = if normal_B.dot(&(hip_B - foot.point_B)) > LEAST_HEIGHT * radius_m {
            // Straight away from the nearest point.
            (foot.followed(self, hip_B)?, true)
        } else {
            (self.below(foot, normal_B, hip_B, radius_m)?, false)
        };
        let plane = there.plane(self, hip_B, radius_m);
        let depth_m = plane.1 - plane.0.dot(hip_B);
        let is_there = depth_m >= 0.0 && (!is_seen || depth_m < (1.0 - LEAST_HEIGHT) * radius_m);
        is_there.then_some((there, plane))
    }
}

impl crate::rolling::Foot for Foot {
    const NOWHERE: Self = Self {
        on: On::NOTHING,
        feature: Feature::None,
        point_B: Vector3::new(0.0, 0.0, 0.0),
        normal_B: Vector3::new(0.0, 1.0, 0.0),
    };

    #[inline]
    fn point_B(&self) -> Vector3<f64> {
        self.point_B
    }

    fn feature(&self) -> Feature {
        self.feature
    }

    fn piece(&self) -> u32 {
        self.on.numbers().first().map_or(0, |&number| u32::from(number))
    }

    fn is_on_same_piece(&self, other: &Self) -> bool {
        self.on == other.on
    }

    fn is_beside(&self, other: &Self) -> bool {
        self.on.is_part_of(&other.on) || other.on.is_part_of(&self.on)
    }
}

/// How far beyond the ball its vicinity reaches, in radii, and how far at least.
const MARGIN: f64 = 0.7;
const LEAST_MARGIN: f64 = 0.2;
/// A leap through free space is looked ahead for by as much, in radii.
const LOOK_AHEAD: f64 = 1.0;
/// In radii: feet that are as near to each other are one.
const SAME_FOOT: f64 = 1e-6;
/// Cosine between the normals of two places that are surely not on opposite sides of what is round.
const SAME_SIDE: f64 = 0.5;
/// Heights below this share of the radius have no direction worth going by.
const LEAST_HEIGHT: f64 = 1e-3;
