//! Loads: all that stands on something else, or will come down on it.
//!
//! Model: a thing is pressed into what it touches below it by its own weight and by what stands on it, in equal shares; what
//! touches nothing will come down on what is the first below it: of all whose boxes it would meet, it is let down by steps on
//! the shape itself, so it falls through a ring's hole and past a wall that it touches.
//! Limits: it falls as it is turned, and straight down; what is thinner than a step (a hundredth of the way past it) may be missed.

#![allow(non_snake_case)] // Frames are capital letters.

use super::near::{Pair, TOUCH_M, nearest};
use haptics::{Entity, Form, Plane, Shape};
use nalgebra::Vector3;
use physics::collide::is_collidable;
use physics::{Aabb, BroadPhase};

/// A thing that stands or will fall on something else.
pub(super) struct Stand {
    pub(super) upper: usize,
    pub(super) lower: usize,
    pub(super) load_n: f64,
}

/// All that stands on something, from above to below, with the load there; and things that fall for ever.
pub(super) fn all(
    (entities, boxes): (&[Entity], &BroadPhase),
    pairs: &[Pair],
    weights_n: &[f64],
    up_W: &Vector3<f64>,
) -> (Vec<Stand>, Vec<usize>) {
    let height = |index: usize| {
        let around = Aabb::of_entity(&entities[index]);
        around.map_or(f64::NEG_INFINITY, |around| around.middle_W().dot(up_W))
    };
    let heights: Vec<f64> = (0..entities.len()).map(height).collect();
    let (is_body, under) = (|index: usize| weights_n[index] > 0.0, Under::of(entities, boxes));
    let mut below: Vec<Vec<(f64, usize)>> = vec![Vec::new(); entities.len()];
    for pair in pairs {
        let is_above = pair.normal_W.dot(up_W);
        let (upper, lower) = if is_above >= 0.0 { (pair.one, pair.other) } else { (pair.other, pair.one) };
        if is_body(upper) && is_above.abs() > BESIDE {
            // Overlaps of whatever depth carry at once.
            below[upper].push((pair.gap_m.max(0.0), lower));
        }
    }
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| is_body(index)).collect();
    order.sort_by(|&a, &b| heights[b].total_cmp(&heights[a]));
    let (mut loads_n, mut stands, mut falls) = (weights_n.to_vec(), Vec::new(), Vec::new());
    for upper in order {
        // Of what is not quite touched, what is reached first carries it.
        let least_m = below[upper].iter().map(|(gap_m, _)| *gap_m).fold(f64::INFINITY, f64::min);
        let mut carries: Vec<usize> =
            below[upper].iter().filter(|(gap_m, _)| *gap_m < least_m + AT_ONCE_M).map(|one| one.1).collect();
        if carries.is_empty() {
            match under.first(upper, up_W) {
                Some(lower) => carries.push(lower),
                None => falls.push(upper),
            }
        }
        let load_n = loads_n[upper] / carries.len() as f64;
        for lower in carries {
            loads_n[lower] += load_n;
            stands.push(Stand { upper, lower, load_n });
        }
    }
    (stands, falls)
}

/// Search for what things come down on.
struct Under<'e> {
    entities: &'e [Entity],
    boxes: &'e BroadPhase,
    /// No way down is longer (m).
    most_m: f64,
}

impl<'e> Under<'e> {
    fn of(entities: &'e [Entity], boxes: &'e BroadPhase) -> Self {
        let all = entities.iter().filter_map(Aabb::of_entity).reduce(|all, one| all.with(&one));
        // Along one axis it goes at least half of its way.
        let most_m = all.map_or(0.0, |all| 2.0 * (all.high_W - all.low_W).norm());
        Self { entities, boxes, most_m }
    }

    /// The entity that one would come down on from its place.
    fn first(&self, upper: usize, up_W: &Vector3<f64>) -> Option<usize> {
        let around = Aabb::of_entity(&self.entities[upper])?;
        let mut below = Vec::new();
        self.boxes.near(&around.swept(&(up_W * -self.most_m)), |other| below.push(other));
        self.first_of(&below, upper, up_W)
    }

    /// The same among these.
    fn first_of(&self, below: &[usize], upper: usize, up_W: &Vector3<f64>) -> Option<usize> {
        let entities = self.entities;
        let (entity, around) = (&entities[upper], Aabb::of_entity(&entities[upper])?);
        let falls_m = |other: usize| {
            let b = &entities[other];
            let meets = other != upper && b.is_collidable && b.space == entity.space;
            if !meets || !(is_collidable(&entity.shape, &b.shape) || is_collidable(&b.shape, &entity.shape)) {
                return None;
            }
            match &b.shape {
                Shape::Form(Form::Plane(plane)) => {
                    falls_on_plane(&around, b, plane, up_W).map(|way_m| [way_m; 2])
                }
                _ => falls_on_box(&around, &Aabb::of_entity(b)?, up_W),
            }
        };
        let falls = below.iter().filter_map(|&other| Some((falls_m(other)?, other)));
        let mut all: Vec<_> = falls.collect();
        all.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]).then(a.1.cmp(&b.1)));
        let mut first: Option<(f64, usize)> = None;
        for (ways_m, other) in all {
            if first.is_some_and(|(way_m, _)| way_m <= ways_m[0]) {
                break;
            }
            let lands_m = match &entities[other].shape {
                Shape::Form(Form::Plane(_)) => Some(ways_m[0]),
                _ => lands_m(entity, &entities[other], ways_m, up_W),
            };
            if let Some(way_m) = lands_m.filter(|way_m| first.is_none_or(|(first_m, _)| *way_m < first_m)) {
                first = Some((way_m, other));
            }
        }
        first.map(|(_, other)| other)
    }
}

/// Way straight down until one lies on the other one, if that is between these two (m).
fn lands_m(entity: &Entity, other: &Entity, [first_m, last_m]: [f64; 2], up_W: &Vector3<f64>) -> Option<f64> {
    let step_m = (last_m - first_m) / STEPS as f64;
    (0..=STEPS).map(|step| first_m + step as f64 * step_m).find_map(|way_m| {
        let mut lowered = entity.clone();
        lowered.X_WB.translation.vector -= up_W * way_m;
        let (gap_m, normal_W) = nearest(&lowered, other, step_m.max(TOUCH_M));
        (gap_m.is_finite() && normal_W.dot(up_W) > BESIDE).then_some(way_m + gap_m.max(0.0))
    })
}

/// Way of a box until it is on a half-space (m); `None`: it never is.
fn falls_on_plane(around: &Aabb, entity: &Entity, plane: &Plane, up_W: &Vector3<f64>) -> Option<f64> {
    let normal_W = entity.X_WB.rotation * plane.normal_B();
    let half_m = (around.high_W - around.low_W).abs() * 0.5;
    let from_W = around.middle_W() - entity.X_WB.translation.vector;
    let above_m = normal_W.dot(&from_W) - plane.offset_m() - normal_W.abs().dot(&half_m);
    let down = normal_W.dot(up_W);
    (down > BESIDE).then_some((above_m / down).max(0.0))
}

/// Ways of a box until it is on another one, and past it (m); `None`: it never is.
fn falls_on_box(around: &Aabb, other: &Aabb, up_W: &Vector3<f64>) -> Option<[f64; 2]> {
    let (mut first_m, mut last_m) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let [near_m, far_m] =
            [other.low_W[axis] - around.high_W[axis], other.high_W[axis] - around.low_W[axis]];
        let down = -up_W[axis];
        if down.abs() < 1e-9 {
            // Side by side is not above each other.
            if near_m > -AT_ONCE_M || far_m < AT_ONCE_M {
                return None;
            }
            continue;
        }
        let ends_m = [near_m / down, far_m / down];
        first_m = first_m.max(ends_m[0].min(ends_m[1]));
        last_m = last_m.min(ends_m[0].max(ends_m[1]));
    }
    // What it is in already it does not fall on.
    (first_m <= last_m && last_m > 0.0).then_some([first_m, last_m])
}

/// Things that are farther by less are reached at once \[m\].
const AT_ONCE_M: f64 = 1e-5;
/// By so many what falls is let down.
const STEPS: usize = 100;
/// Cosine between a normal and what is up where nothing is carried.
const BESIDE: f64 = 0.2;

#[cfg(test)]
mod tests {
    use super::super::near::tests::heap;
    use super::*;

    #[test]
    fn the_first_below_is_the_same_as_if_all_were_looked_at() {
        let (_, entities) = heap();
        let (boxes, everything) = (BroadPhase::new(&entities), (0..entities.len()).collect::<Vec<_>>());
        let under = Under::of(&entities, &boxes);
        let ups = [Vector3::y(), Vector3::new(0.3, 1.0, -0.2).normalize(), -Vector3::x()];
        for up_W in ups {
            let (mut fall, mut land) = (0, 0);
            for (upper, entity) in entities.iter().enumerate() {
                let first = under.first(upper, &up_W);
                let expected = under.first_of(&everything, upper, &up_W);
                assert_eq!(first, expected.filter(|_| Aabb::of_entity(entity).is_some()), "{upper} {up_W}");
                *(if first.is_some() { &mut land } else { &mut fall }) += 1;
            }
            assert!(land > 20 && fall > 0, "{land} {fall}");
        }
    }
}
