//! Whether a HIP beyond the material is still held back by where it was pressed in.
//!
//! Problem: a thin plate must not be pushed through, while a finger that was pressed through a ball has left it.
//!
//! Model: it is, while the god-object is the nearest place around: on flat parts and in hollows always, on round ones while
//! the HIP is nearer than the sharpest bend, else as steps to the side tell.

use nalgebra::Vector3;

use super::Csg;
use super::god::God;
use super::settle::settle;
use crate::friction_cone::ConeInput;
use crate::surface::direction_or_up;
use crate::tangent_view::TangentView;

/// Whether a god-object at rest is a minimum of the distance to a HIP that is outside: pressed through a flat part it
/// is, pressed through a ball it is not, and the finger is let go as from a ball alone.
pub(super) fn holds_outside(csg: &Csg, god: &God, view: &TangentView, input: &ConeInput) -> bool {
    // A hollow holds like a plane.
    if god.is_on_planes(csg) || god.active.count_ones() > 2 || god.is_in_hollow(csg) {
        return true;
    }
    let sharpest_m = god
        .held_by()
        .map(|index| god.near.patch(csg, index).smallest_radius_m(&god.point_B))
        .fold(f64::INFINITY, f64::min);
    if view.depth_m < sharpest_m || csg.is_inside(&input.hip_B) {
        return true;
    }
    let distance_m = |point_B: &Vector3<f64>| (point_B - input.hip_B).norm();
    let here_m = distance_m(&god.point_B);
    let aside_B = direction_or_up(&view.normal_B.cross(&Vector3::ith(view.normal_B.iamin(), 1.0)));
    let other_B = view.normal_B.cross(&aside_B);
    let step_m = PROBE * view.depth_m;
    let is_nearer = |direction_B: Vector3<f64>| {
        let probe_B = settle(csg, god, god.active, &(god.point_B + direction_B * step_m), &input.hip_B);
        distance_m(&probe_B) < here_m
    };
    let directions = [aside_B, other_B, aside_B + other_B, aside_B - other_B];
    // Off its place by the rest of its slide, one way is nearer to first order: both must be.
    !directions.iter().any(|&direction_B| is_nearer(direction_B) && is_nearer(-direction_B))
}

/// Size of a step to the side that tells a minimum from a maximum, in terms of the depth.
const PROBE: f64 = 1e-3;
