//! One step of a god-object towards a place on its tangent plane, or on its edge's tangent.
//!
//! Model: straight there and back onto all patches that hold it. If on the way a patch is crossed such that the way is
//! barred, or what it goes along is no boundary any longer, it stops there: the degenerate transitions of Melder fig. 9.4, from
//! patch to edge to corner. In its clearing nothing is crossed: it [glides](glide), and the looks with which it came back
//! onto its patches are what it sees there. On bent patches the straight way is a chord: what the chord crosses twice and the way
//! on the patches does not is not crossed.
//!
//! Frames: object frame B. Cost: gliding, two or three looks at what holds it; else a level or two for each patch nearby, too.

use nalgebra::Vector3;

use super::Csg;
use super::god::God;
use super::hit::Events;
use super::patch::{Look, Patch};
use super::settle::{is_on, settle, settle_on};
use super::stand::{on_edge, on_patch};
use crate::friction_cone::ConeInput;
use crate::tangent_view::TangentView;

/// How far a way led.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moved {
    /// To the target.
    There,
    /// Not all the way: only as far as the neighbourhood is known, or to where other patches matter.
    Partly,
    /// To where another patch matters that is all but parallel to one that holds: tangent planes do not tell them apart.
    Grazing,
    /// Nowhere: the target would stretch the spring, or where patches meet on the way there cannot be told from here.
    TooFar,
}

/// Where to go, and what is known of the place.
pub(super) struct Target {
    pub(super) point_B: Vector3<f64>,
    /// What the two patches of an edge show there.
    pub(super) looks: Option<[Look; 2]>,
}

/// How a glide went.
pub(super) enum Glided {
    /// To the target, held by the same patches.
    There(TangentView),
    /// Nowhere: the target would stretch the spring.
    TooFar,
    /// Nowhere: other patches may matter.
    Not,
}

/// Goes there within the clearing.
#[inline(always)]
pub(super) fn glide(csg: &Csg, god: &mut God, target: &Target, longest: f64, input: &ConeInput) -> Glided {
    let target_B = &target.point_B;
    if !god.clearing.holds(target_B) {
        return Glided::Not;
    }
    let hip_B = &input.hip_B;
    let (moved_B, view) = if let Some(patch) = god.only_patch(csg) {
        let (moved_B, [look]) = match patch {
            Patch::Plane { .. } => (*target_B, [patch.look(target_B, hip_B)]),
            Patch::Curved(_) => settle_on([patch], target_B, hip_B),
        };
        if !patch.is_plane() && (moved_B - hip_B).norm_squared() > longest {
            return Glided::TooFar;
        }
        (moved_B, on_patch(csg, god, patch, &moved_B, &look, input))
    } else if let Some(patches) = god.both_patches(csg) {
        let (moved_B, looks) = match target.looks {
            Some(looks) if is_on(&looks, target_B) => (*target_B, looks),
            _ => settle_on(patches, target_B, hip_B),
        };
        if (moved_B - hip_B).norm_squared() > longest {
            return Glided::TooFar;
        }
        (moved_B, on_edge(csg, god, &moved_B, &looks, input))
    } else {
        return Glided::Not;
    };
    match view {
        Some(view) if god.clearing.holds(&moved_B) => {
            god.point_B = moved_B;
            Glided::There(view)
        }
        _ => Glided::Not,
    }
}

/// Goes there, whatever is in the way.
#[inline(never)]
pub(super) fn advance(
    csg: &Csg,
    god: &mut God,
    target_B: &Vector3<f64>,
    longest: f64,
    hip_B: &Vector3<f64>,
) -> Moved {
    let way_B = target_B - god.point_B;
    let length_m = way_B.norm();
    if !god.near.holds(&god.point_B, length_m) {
        god.look_around(csg, length_m);
    }
    let room_m = god.near.room_m(&god.point_B);
    let mut share = if length_m > room_m { room_m / length_m } else { 1.0 };
    let is_flat = god.active.count_ones() == 1 && god.is_on_planes(csg);
    let mut moved_B = *target_B;
    for _ in 0..MAX_SHORTENED {
        let aim_B = if share == 1.0 { *target_B } else { god.point_B + way_B * share };
        moved_B = if is_flat { aim_B } else { settle(csg, god, god.active, &aim_B, hip_B) };
        if god.near.holds(&moved_B, 0.0) {
            break;
        }
        share *= 0.5;
    }
    if !is_flat && (moved_B - hip_B).norm_squared() > longest {
        return Moved::TooFar;
    }
    let before = *god;
    if let Some(stop) = stop_where_it_ends(csg, god, &moved_B, hip_B) {
        // Patches that hardly meet may meet elsewhere: from nearer by it is told where.
        if (god.point_B - hip_B).norm_squared() > longest || !is_where_it_was_going(csg, god) {
            *god = before;
            if length_m > csg.tight_m() {
                return Moved::TooFar;
            }
        }
        return stop;
    }
    god.point_B = moved_B;
    if share == 1.0 { Moved::There } else { Moved::Partly }
}

/// Follows the way to where something bars it, or where it is no boundary any longer, if there is such a place.
fn stop_where_it_ends(csg: &Csg, god: &mut God, to_B: &Vector3<f64>, hip_B: &Vector3<f64>) -> Option<Moved> {
    let from_B = god.point_B;
    let events = Events::along(csg, &god.near, god.sides, god.active, &from_B, to_B);
    let mut passed_over = 0;
    for (crossed_at, index) in events.iter() {
        if passed_over >> index & 1 == 1 {
            continue;
        }
        if events.left_again(index).is_some_and(|left_at| {
            let amid_B = from_B + (to_B - from_B) * (0.5 * (crossed_at + left_at));
            passes_over(csg, god, index, &amid_B, hip_B)
        }) {
            passed_over |= 1 << index;
            continue;
        }
        let beyond = god.sides ^ 1 << index;
        let goes_on =
            !god.near.is_solid(beyond) && god.held_by().all(|held| god.near.is_solid(beyond ^ 1 << held));
        if !goes_on {
            let met_B = from_B + (to_B - from_B) * crossed_at;
            let edge_B = settle(csg, god, god.active | 1 << index, &met_B, hip_B);
            let off_m = (edge_B - met_B).norm();
            let hardly_meet = off_m.is_nan() || off_m > (to_B - from_B).norm();
            god.point_B = if hardly_meet { settle(csg, god, god.active, &met_B, hip_B) } else { edge_B };
            return Some(if is_grazing(csg, god, index, hip_B) { Moved::Grazing } else { Moved::Partly });
        }
        god.sides = beyond;
    }
    None
}

/// Whether a god-object is on the sides that its way led to, of all patches that it is not on.
fn is_where_it_was_going(csg: &Csg, god: &God) -> bool {
    let levels_m = god.near.levels_m(csg, &god.point_B);
    (0..god.near.count()).all(|index| {
        let is_inside = levels_m[index] <= 0.0;
        levels_m[index].abs() <= 4.0 * csg.tolerance_m() || is_inside == (god.sides >> index & 1 == 1)
    })
}

/// Whether it is only the chord that crosses a patch twice, between two places of bent patches, and not the way on them.
fn passes_over(csg: &Csg, god: &God, index: usize, amid_B: &Vector3<f64>, hip_B: &Vector3<f64>) -> bool {
    if god.is_on_planes(csg) {
        return false;
    }
    let on_way_B = settle(csg, god, god.active, amid_B, hip_B);
    let is_inside = god.near.patch(csg, index).level(&on_way_B) <= 0.0;
    is_inside == (god.sides >> index & 1 == 1)
}

/// Whether a patch is all but parallel to one that holds the god-object.
pub(super) fn is_grazing(csg: &Csg, god: &God, index: usize, hip_B: &Vector3<f64>) -> bool {
    let normal_B = |index: usize| god.near.patch(csg, index).look(&god.point_B, hip_B).normal_B;
    let met_B = normal_B(index);
    god.held_by()
        .any(|held| held != index && normal_B(held).cross(&met_B).norm_squared() < PARALLEL * PARALLEL)
}

/// Patches that meet under less (rad) graze each other: within what counts as one place they may bend by as much.
const PARALLEL: f64 = 1e-3;
/// Bound on the attempts to come back onto bent patches within the neighbourhood.
const MAX_SHORTENED: u32 = 8;
