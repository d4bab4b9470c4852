//! A foot of a ball on a solid, and how it goes along as the ball rolls.
//!
//! Model: the nearest point of what it lies on is sought again. Where that is no boundary any more the patch has ended on the
//! way: at the edge with one of the patches that were crossed. Where another feature is nearer, it goes on there.
//!
//! On a rim around the ball's axis, or in a hollow of its own radius, all points are about as near: several feet hold a ball
//! between them, and would come together at the first small step aside. There a foot that is not alone stays where it is.
//!
//! Invariant: a foot is a point of the solid: a ball that stays clear of it does no wrong, wherever its feet are.
//! Cost: a few searches of [`nearest_on`], each with a look at what is there; bounded by [`MOST_STEPS`].

use nalgebra::Vector3;

use super::CsgGround;
use super::nearest::nearest_on;
use super::on::On;
use super::place::{Place, free_side, place};
use crate::csg::near::Neighbourhood;
use crate::csg::patch::Patch;
use crate::rolling::Plane;
use crate::surface::Feature;

/// A point of a solid, as seen from a ball's centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(super) on: On,
    pub(super) feature: Feature,
    pub(super) point_B: Vector3<f64>,
    /// Out of the material, on a single patch; on others the way to the centre tells.
    pub(super) normal_B: Vector3<f64>,
}

impl Foot {
    /// At a point of these patches, which is known to be boundary.
    pub(super) fn at(
        ground: &CsgGround<'_>,
        near: &Neighbourhood,
        on: On,
        point_B: Vector3<f64>,
        centre_B: &Vector3<f64>,
    ) -> Self {
        let way_B = centre_B - point_B;
        let way_m = way_B.norm();
        let towards_B = if way_m > 0.0 { way_B / way_m } else { Vector3::y() };
        let (feature, normal_B) = match on.numbers() {
            &[number] => match ground.csg.patches.get(usize::from(number)) {
                Some(patch) => single(ground, near, (number, patch), &point_B, &towards_B, centre_B),
                None => (Feature::None, towards_B),
            },
            [_, _] => (Feature::Edge, towards_B),
            _ => (Feature::Vertex, towards_B),
        };
        Self { on, feature, point_B, normal_B }
    }

    pub(super) fn plane(&self, ground: &CsgGround<'_>, centre_B: &Vector3<f64>, radius_m: f64) -> Plane {
        let way_B = centre_B - self.point_B;
        let way_m = way_B.norm();
        let has_way = way_m > LEAST_WAY * radius_m;
        let is_beside = way_B.dot(&self.normal_B) < (1.0 - BESIDE) * way_m;
        let is_left_behind = is_beside && way_m > radius_m;
        if !is_left_behind
            && let (Feature::Face, [number]) = (self.feature, self.on.numbers())
            && let Some(Patch::Plane { normal_B, offset_m }) = ground.csg.patches.get(usize::from(*number))
        {
            // Known better than through the foot.
            let turned = self.normal_B.dot(normal_B).signum();
            return (self.normal_B, turned * offset_m + radius_m);
        }
        let is_patch = matches!(self.feature, Feature::Face | Feature::Surface) && !is_left_behind;
        let normal_B = if is_patch || !has_way { self.normal_B } else { way_B / way_m };
        (normal_B, normal_B.dot(&self.point_B) + radius_m)
    }

    /// Where it is when the ball's centre is at `centre_B`.
    pub(super) fn walked(
        &self,
        ground: &CsgGround<'_>,
        centre_B: &Vector3<f64>,
        radius_m: f64,
        is_alone: bool,
    ) -> Self {
        let Some(there) = self.followed(ground, centre_B) else { return *self };
        let moved_m = (there.point_B - self.point_B).norm();
        let nearer_m = (centre_B - self.point_B).norm() - (centre_B - there.point_B).norm();
        if !is_alone && self.on == there.on && 2.0 * radius_m * nearer_m < CLEAR * moved_m * moved_m {
            return *self;
        }
        there
    }

    /// The foot of a point that one comes to from here.
    pub(super) fn followed(&self, ground: &CsgGround<'_>, centre_B: &Vector3<f64>) -> Option<Self> {
        let (mut on, mut from_B) = (self.on, self.point_B);
        for _ in 0..MOST_STEPS {
            let point_B = nearest_on(ground.csg, &on, &from_B, centre_B)?;
            let near = ground.around(&point_B);
            match place(ground.csg, &near, &point_B, centre_B) {
                Place::Along(next) if next != on => (on, from_B) = (next, point_B),
                Place::Foot | Place::Along(_) => return Some(Self::at(ground, &near, on, point_B, centre_B)),
                Place::Nothing => (on, from_B) = ended(ground, on, &from_B, &point_B, centre_B)?,
            }
        }
        None
    }
}

/// Which kind of place on a patch, and which way is out.
fn single(
    ground: &CsgGround<'_>,
    near: &Neighbourhood,
    (number, patch): (u16, &Patch),
    point_B: &Vector3<f64>,
    towards_B: &Vector3<f64>,
    centre_B: &Vector3<f64>,
) -> (Feature, Vector3<f64>) {
    let normal_B = patch.look(point_B, centre_B).normal_B;
    let out = free_side(ground.csg, near, number, point_B);
    let normal_B = normal_B * out.unwrap_or_else(|| normal_B.dot(towards_B).signum());
    match patch {
        Patch::Plane { .. } => (Feature::Face, normal_B),
        Patch::Curved(_) if patch.tip_between(point_B, point_B).is_some() => (Feature::Vertex, *towards_B),
        Patch::Curved(_) => (Feature::Surface, normal_B),
    }
}

/// Where a patch or an edge, followed from one point to another one that is no boundary, has ended: on another patch that is
/// crossed between them.
#[inline(never)]
fn ended(
    ground: &CsgGround<'_>,
    on: On,
    from_B: &Vector3<f64>,
    to_B: &Vector3<f64>,
    centre_B: &Vector3<f64>,
) -> Option<(On, Vector3<f64>)> {
    let csg = ground.csg;
    let mut best: Option<(f64, On, Vector3<f64>)> = None;
    for &number in ground.listed(from_B, to_B).numbers().iter().filter(|&&number| !on.has(number)) {
        let patch = csg.patches.get(usize::from(number))?;
        let [before, after] = [patch.level(from_B), patch.level(to_B)];
        let was_on_it = before.abs() <= csg.tolerance_m();
        if (before <= 0.0) == (after <= 0.0) && !was_on_it {
            continue;
        }
        let share = (before / (before - after)).clamp(0.0, 1.0);
        let start_B = from_B + (to_B - from_B) * if share.is_nan() { 0.0 } else { share };
        let Some(edge) = on.and(number) else { continue };
        let Some(point_B) = nearest_on(csg, &edge, &start_B, centre_B) else { continue };
        let distance_m = (point_B - centre_B).norm();
        if best.as_ref().is_some_and(|(least_m, ..)| distance_m >= *least_m) {
            continue;
        }
        if place(csg, &ground.around(&point_B), &point_B, centre_B) != Place::Nothing {
            best = Some((distance_m, edge, point_B));
        }
    }
    best.map(|(_, edge, point_B)| (edge, point_B))
}

const MOST_STEPS: u32 = 6;
/// One less the cosine between normal and way: of a foot that was left behind, the patch says nothing any more.
const BESIDE: f64 = 1e-12;
/// Shorter than this share of the radius, the way to the foot has no direction.
const LEAST_WAY: f64 = 1e-9;
/// Where the distance falls by less than this share of what it does on a plane, all around is about as near.
const CLEAR: f64 = 0.2;
