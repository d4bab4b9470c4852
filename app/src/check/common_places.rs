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

/// Places where as many as can be found meet of those constant fields whose force has a part along that of one of them: in what
/// pulls the other way, and beside that.
pub(super) fn forceful_places(pulls: &[(&Field, Vector3<f64>)]) -> Vec<Vector3<f64>> {
    let mut places = Vec::new();
    for (at, (_, along_W)) in pulls.iter().enumerate() {
        let is_with = |pull_W: &Vector3<f64>| pull_W.dot(along_W) > 0.0;
        let (with, against): (Vec<_>, Vec<_>) = pulls.iter().partition(|(_, pull_W)| is_with(pull_W));
        // If all are with it, it is a group as others.
        if with.len() < 2 || against.is_empty() {
            continue;
        }
        let with: Vec<Effect<'_>> = with.iter().map(|(field, _)| Effect::Field(field)).collect();
        let first = pulls[..at].iter().filter(|(_, pull_W)| is_with(pull_W)).count();
        let Some((group, place_W)) = group_from(&with, vec![first]) else { continue };
        places.push(place_W);
        let against: Vec<&Field> = against.iter().map(|(field, _)| *field).collect();
        places.extend(ways_out(&against, &place_W).filter_map(|out_W| meeting(&with, &group, out_W)));
    }
    places
}

/// Places about where none of these is felt any more, on ways in all directions; none where they are not felt at all.
fn ways_out(fields: &[&Field], from_W: &Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
    let is_free = |p_W: &Vector3<f64>| fields.iter().all(|field| field.region().weight(p_W) == 0.0);
    let out = move |along: Vector3<f64>| {
        let lengths = (0..DOUBLINGS).map(|doubling| BELOW_M * f64::from(1 << doubling));
        lengths.map(|length_m| from_W + along * length_m).find(is_free)
    };
    let all = (!is_free(from_W)).then(directions);
    all.into_iter().flatten().filter_map(out)
}

/// To the corners, edges and faces of a cube.
pub(super) fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let signs = [-1.0, 0.0, 1.0];
    let all = signs.into_iter().flat_map(move |x| {
        signs.into_iter().flat_map(move |y| signs.into_iter().map(move |z| Vector3::new(x, y, z)))
    });
    all.filter(|d| *d != Vector3::zeros()).map(|d| d.normalize())
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
        let place = |begin| Some(group_from(effects, begin)?.1);
        places.extend(begins.into_iter().filter_map(place));
        places.extend(entities.iter().filter_map(|entity| place_in(first, entity)));
    }
    places
}

/// These and as many others as can be found that are felt at one place, and the place; `None`: these have none in common.
fn group_from(effects: &[Effect<'_>], mut group: Vec<usize>) -> Option<(Vec<usize>, Vector3<f64>)> {
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
    Some((group, place_W))
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
/// Of a way out of fields: up to 130 m.
const DOUBLINGS: u32 = 18;
/// With less a field is hardly felt.
const LEAST_WEIGHT: f64 = 0.25;
/// As deep as a finger presses.
const BELOW_M: f64 = 1e-3;
