//! Places that fields, guides and entities have in common.
//!
//! Model: a place is led to where each of a group is felt, in turn and over again; if they overlap, it ends where all of
//! them are felt (of convex ones always, by alternating projections). A group is made greedily: from one effect, or from each
//! pair of a few, it takes every other one that is felt there with the rest.
//! Cost: effects times effects times the size of a group; entities are asked once for each effect, and led to where that one
//! reaches them.

#![allow(non_snake_case)] // Frames are capital letters.

use haptics::{Entity, Field, Gains, Guide, Shape, Surface};
use nalgebra::Vector3;
use physics::collide::bounding_ball;

/// A thing of the world that fingers feel.
#[derive(Debug, Clone, Copy)]
pub(super) enum Effect<'a> {
    Field(&'a Field),
    Guide(&'a Guide),
}

impl Effect<'_> {
    fn led(&self, place_W: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Field(field) => field.region().felt_near(place_W),
            Self::Guide(guide) => guide.felt_near(place_W),
        }
    }

    fn is_felt_at(&self, place_W: &Vector3<f64>) -> bool {
        match self {
            Self::Field(field) => field.region().weight(place_W) > LEAST_WEIGHT,
            Self::Guide(guide) => guide.gains_at(place_W) != Gains::default(),
        }
    }
}

/// Places of groups of effects, and of effects with entities.
pub(super) fn common_places(effects: &[Effect<'_>], entities: &[Entity]) -> Vec<Vector3<f64>> {
    let mut places = Vec::new();
    for (at, first) in effects.iter().enumerate() {
        let alone = vec![at];
        let begins: Vec<Vec<usize>> = if effects.len() > FEW {
            vec![alone]
        } else {
            (at + 1..effects.len()).map(|other| vec![at, other]).chain([alone]).collect()
        };
        places.extend(begins.into_iter().filter_map(|begin| place_of_group(effects, begin)));
        places.extend(entities.iter().filter_map(|entity| place_in(first, entity)));
    }
    places
}

/// A place where these are felt, and as many others as can be found; `None`: they have no place in common.
fn place_of_group(effects: &[Effect<'_>], mut group: Vec<usize>) -> Option<Vector3<f64>> {
    let mut place_W = meeting(effects, &group, Vector3::zeros())?;
    for other in 0..effects.len() {
        if group.contains(&other) {
            continue;
        }
        group.push(other);
        match meeting(effects, &group, place_W) {
            Some(at_W) => place_W = at_W,
            None => drop(group.pop()),
        }
    }
    Some(place_W)
}

fn meeting(effects: &[Effect<'_>], group: &[usize], from_W: Vector3<f64>) -> Option<Vector3<f64>> {
    let mut place_W = from_W;
    for _ in 0..ROUNDS {
        let before_W = place_W;
        place_W = group.iter().fold(place_W, |place_W, &at| effects[at].led(&place_W));
        if (place_W - before_W).norm() < ARRIVED_M {
            break;
        }
    }
    group.iter().all(|&at| effects[at].is_felt_at(&place_W)).then_some(place_W)
}

/// In an entity, just below its surface, where an effect is felt.
fn place_in(effect: &Effect<'_>, entity: &Entity) -> Option<Vector3<f64>> {
    let Shape::Form(form) = &entity.shape else { return None };
    let (centre_B, radius_m) = bounding_ball(&entity.shape).unwrap_or((Vector3::zeros(), f64::INFINITY));
    let centre_W = entity.X_WB.transform_point(&centre_B.into()).coords;
    if !entity.is_haptic || (effect.led(&centre_W) - centre_W).norm() > radius_m {
        return None;
    }
    let below = |p_W: &Vector3<f64>| {
        let at = form.nearest(&entity.X_WB.inverse_transform_point(&(*p_W).into()).coords);
        entity.X_WB.transform_point(&(at.point_B - at.normal_B * BELOW_M).into()).coords
    };
    let mut place_W = centre_W;
    for _ in 0..ROUNDS {
        place_W = below(&effect.led(&place_W));
    }
    effect.is_felt_at(&place_W).then_some(place_W)
}

/// Each pair of so many effects begins a group.
const FEW: usize = 16;
/// Of leading a place.
const ROUNDS: usize = 20;
const ARRIVED_M: f64 = 1e-6;
/// With less a field is hardly felt.
const LEAST_WEIGHT: f64 = 0.25;
/// As deep as a finger presses.
const BELOW_M: f64 = 1e-3;
