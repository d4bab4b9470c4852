//! The classic god-object on a mesh, by constraint planes.
//!
//! Model (Zilles & Salisbury 1995): the god-object sets off for the HIP. Where a face is in its way, that face's plane
//! becomes a constraint, and the new goal is the point nearest to the HIP in front of all constraints; again, until
//! nothing is in the way. Planes are endless, faces are not: having slid over the end of a face the god-object starts
//! anew without constraints, until it stays where it is. If nothing is in the way to the HIP itself, it is free.
//!
//! The god-object hovers a little above the surface while it moves, so that no rounding can decide on which side of a
//! face it is; the answer is taken from the planes themselves.
//!
//! Cost: at most [`MAX_DESCENTS`] times [`MAX_STEPS`] segments against the mesh; on a smooth one, three to six. In free
//! space one segment. Only a finger's first tick asks whether it is inside: a mesh that is placed over a finger later
//! is met when the finger has left it.

use nalgebra::Vector3;

use crate::algorithm::{ContactMemory, Touch, TouchInput};
use crate::constraints::{Constraints, Plane, Target};
use crate::mesh::Mesh;
use crate::surface::{Feature, SurfacePoint};

/// Bound on starts without constraints.
const MAX_DESCENTS: u32 = 32;
/// Bound on goals of one descent: each adds a constraint.
const MAX_STEPS: u32 = 6;
/// Height at which the god-object moves over a mesh, in terms of the mesh's extent: well above rounding, and far below
/// anything that can be felt.
const HOVER: f64 = 1e-9;

pub(super) fn touch(mesh: &Mesh, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
    let hip_B = &input.cone.hip_B;
    let hover_m = HOVER * mesh.extent_m();
    let is_touching = memory.words[IS_TOUCHING] != 0.0;
    let start_B = if is_touching { memory.vector(POINT) } else { begin(mesh, input, hover_m)? };
    let rest = seek(mesh, start_B, hip_B, hover_m)?;
    memory.set_vector(POINT, &rest.hovering_B);
    memory.words[IS_TOUCHING] = 1.0;
    let way_B = rest.at.point_B - hip_B;
    Some(Touch::frictionless(rest.at, way_B.norm(), &input.cone))
}

/// Where the HIP was when its last step met the mesh; out of the mesh, if it is inside in its first tick.
fn begin(mesh: &Mesh, input: &TouchInput<'_>, hover_m: f64) -> Option<Vector3<f64>> {
    if let Some(from_B) = input.previous_hip_B {
        let hit = mesh.first_hit(&from_B, &input.cone.hip_B)?;
        let path_B = input.cone.hip_B - from_B;
        let gone_m = path_B.norm() * hit.fraction;
        // A HIP that stopped on the surface may be behind it by rounding: it came from further away.
        let back_m = (hover_m - gone_m).max(0.0);
        return Some(from_B - path_B * (back_m / path_B.norm()));
    }
    let at = input.is_inside().then(|| input.nearest())??;
    Some(at.point_B + at.normal_B * hover_m)
}

/// Where the god-object has come to rest.
struct Rest {
    hovering_B: Vector3<f64>,
    at: SurfacePoint,
}

/// `None` if nothing is between the god-object and the HIP.
fn seek(mesh: &Mesh, start_B: Vector3<f64>, hip_B: &Vector3<f64>, hover_m: f64) -> Option<Rest> {
    let mut god_object_B = start_B;
    let mut constraints = Constraints::default();
    let mut piece = 0;
    for _ in 0..MAX_DESCENTS {
        let before_B = god_object_B;
        constraints = Constraints::default();
        (god_object_B, piece) = descend(mesh, god_object_B, hip_B, hover_m, &mut constraints);
        if (god_object_B - before_B).amax() <= REST * hover_m {
            break;
        }
    }
    if constraints.is_empty() {
        return None;
    }
    // Where planes are almost parallel rounding may leave no room: it has found a place all the same.
    let target = constraints
        .nearest_to(hip_B, 0.0, SLACK * hover_m)
        .unwrap_or(Target { point_B: god_object_B, active: 3 });
    Some(Rest { hovering_B: god_object_B, at: surface_point(mesh, &target, hip_B, piece) })
}

/// Moves until nothing is in the way, or no room is left; answers with the last face met, too.
fn descend(
    mesh: &Mesh,
    start_B: Vector3<f64>,
    hip_B: &Vector3<f64>,
    hover_m: f64,
    constraints: &mut Constraints,
) -> (Vector3<f64>, u32) {
    let (mut god_object_B, mut piece) = (start_B, 0);
    for _ in 0..=MAX_STEPS {
        let Some(Target { point_B: goal_B, .. }) = constraints.nearest_to(hip_B, hover_m, SLACK * hover_m)
        else {
            break;
        };
        let Some(hit) = mesh.first_hit(&god_object_B, &goal_B) else { return (goal_B, piece) };
        piece = hit.face;
        let face = &mesh.faces()[hit.face as usize];
        let side = if hit.is_front { 1.0 } else { -1.0 };
        let plane = Plane { normal_B: face.normal_B * side, offset_m: face.offset_m * side };
        god_object_B = stop_above(&plane, &god_object_B, &goal_B, hover_m);
        if !constraints.add(plane) {
            break;
        }
    }
    (god_object_B, piece)
}

/// As far towards the goal as the plane allows.
fn stop_above(plane: &Plane, from_B: &Vector3<f64>, goal_B: &Vector3<f64>, hover_m: f64) -> Vector3<f64> {
    let (before_m, after_m) = (plane.distance(from_B), plane.distance(goal_B));
    let fraction = (before_m - hover_m) / (before_m - after_m);
    if fraction > 0.0 { from_B + (goal_B - from_B) * fraction.min(1.0) } else { *from_B }
}

/// A HIP right on the surface has a god-object, but no depth.
fn surface_point(mesh: &Mesh, target: &Target, hip_B: &Vector3<f64>, piece: u32) -> SurfacePoint {
    let feature = match target.active {
        0 | 1 => Feature::Face,
        2 => Feature::Edge,
        _ => Feature::Vertex,
    };
    let way_B = target.point_B - hip_B;
    let depth_m = way_B.norm();
    let normal_B = if depth_m > 0.0 { way_B / depth_m } else { mesh.faces()[piece as usize].normal_B };
    SurfacePoint { point_B: target.point_B, normal_B, feature, piece }
}

/// It rests when it moves less, in terms of the height at which it hovers.
const REST: f64 = 1e-4;
/// A constraint may be missed by this much, in the same terms: rounding of positions is 1e-7 of the height, and up to
/// 1e5 times as much where two planes meet that are almost parallel.
const SLACK: f64 = 1e-2;
/// Where things are in the contact's memory.
const POINT: usize = 0;
const IS_TOUCHING: usize = 7;
