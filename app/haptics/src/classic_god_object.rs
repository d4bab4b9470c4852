//! A baseline with memory, without friction: the god-object of Zilles and Salisbury (1995; Melder ch. 3.1.2.2).
//!
//! Problem: the Friction Cone Algorithm must reduce to it when all coefficients are zero (Melder ch. 8.1). To be a
//! yardstick it is written on its own: it shares neither the slide over closed forms nor the walk over meshes.
//!
//! Model: the god-object seeks the place on its side of the surface that is nearest to the HIP, starting where it was.
//! On closed forms: foot of the perpendicular on the tangent plane, back onto the surface, again until it rests. On
//! meshes: see [`on_mesh`].
//!
//! Frames: object frame B. Invariant: the force is `k |G - H|` along `G - H`; contacts never pull.
//! Cost: at most [`MAX_ROUNDS`] rounds. The error of a round on a sphere of radius r is `1 - rho / r` times the last, so
//! that 5 mm below a ball of 0.1 m take about a dozen, and HIPs near the centre do not come to rest in one tick.

mod on_mesh;

use crate::algorithm::{ContactAlgorithm, ContactMemory, Touch, TouchInput};
use crate::shape::Shape;
use crate::surface::{Feature, Surface, SurfacePoint};

/// The classic god-object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClassicGodObject;

/// Bound on the moves of the god-object on a closed form in one tick.
const MAX_ROUNDS: u32 = 256;

impl ContactAlgorithm for ClassicGodObject {
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
        match input.shape {
            Shape::Mesh(mesh) if input.finger_radius_m == 0.0 => on_mesh::touch(mesh, input, memory),
            _ => input.of_surface(|surface| on_surface(surface, input, memory))?,
        }
    }
}

fn on_surface(surface: &dyn Surface, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
    let hip_B = &input.cone.hip_B;
    let is_inside = surface.signed_distance(hip_B) <= 0.0;
    let start = recall(memory)
        .or_else(|| input.previous_hip_B.and_then(|from_B| surface.entry(&from_B, hip_B)))
        .or_else(|| is_inside.then(|| surface.nearest(hip_B)))?;
    let at = seek(surface, start, input);
    let depth_m = surface.tangent_offset(&at) - at.normal_B.dot(hip_B);
    let is_pressed_through = depth_m > 0.0 && surface.holds_outside(&at, depth_m);
    if !is_inside && !is_pressed_through {
        return None;
    }
    remember(memory, &at);
    Some(Touch::frictionless(at, depth_m, &input.cone))
}

/// Foot of the perpendicular and back onto the surface, until it rests.
fn seek(surface: &dyn Surface, start: SurfacePoint, input: &TouchInput<'_>) -> SurfacePoint {
    let hip_B = &input.cone.hip_B;
    let mut at = start;
    for _ in 0..MAX_ROUNDS {
        let foot_B = hip_B + at.normal_B * (surface.tangent_offset(&at) - at.normal_B.dot(hip_B));
        let next = surface.settle(&at, &foot_B);
        let is_at_rest =
            next.piece == at.piece && (next.point_B - at.point_B).amax() <= f64::EPSILON * at.point_B.amax();
        at = next;
        if is_at_rest {
            break;
        }
    }
    at
}

fn recall(memory: &ContactMemory) -> Option<SurfacePoint> {
    (memory.words[IS_TOUCHING] != 0.0).then(|| SurfacePoint {
        point_B: memory.vector(POINT),
        normal_B: memory.vector(NORMAL),
        // No surface asks for it.
        feature: Feature::Surface,
        piece: memory.words[PIECE] as u32,
    })
}

fn remember(memory: &mut ContactMemory, at: &SurfacePoint) {
    memory.set_vector(POINT, &at.point_B);
    memory.set_vector(NORMAL, &at.normal_B);
    memory.words[PIECE] = f64::from(at.piece);
    memory.words[IS_TOUCHING] = 1.0;
}

/// Where things are in the contact's memory.
const POINT: usize = 0;
const NORMAL: usize = 3;
const PIECE: usize = 6;
const IS_TOUCHING: usize = 7;
