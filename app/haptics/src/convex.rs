//! Where a path first enters a convex solid.
//!
//! Problem: a fast finger may pass right through a thin part in one tick; whoever looks at the ends of the path only, or
//! samples it, misses that.
//!
//! Model: a convex solid is where a convex function, its level, is not positive. Newton's method on the level, started
//! outside, runs along tangents that lie below the function: it can neither pass the first crossing nor miss one, and
//! where there is none it either runs past the path's end or meets a rising level. Crossings of flat pieces are exact
//! after one step each; curved ones converge quadratically.
//!
//! Cost: one level where the path is too short to reach the solid, at most [`MAX_ENTRY_ROUNDS`]: paths that graze a curved
//! piece take the most.

use nalgebra::Vector3;

use crate::surface::SMALLEST_LENGTH_M;

/// How far a point lies before a convex solid, in the measure of one of its pieces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level {
    /// Positive outside, zero on the surface \[m\].
    pub(crate) height_m: f64,
    /// Its gradient.
    pub(crate) gradient_B: Vector3<f64>,
    /// The piece that decides here.
    pub(crate) piece: u32,
}

/// Point and piece where `from_B -> to_B` enters the solid; always some if it leads from outside to inside.
pub(crate) fn first_entry(
    from_B: &Vector3<f64>,
    to_B: &Vector3<f64>,
    level: impl Fn(&Vector3<f64>) -> Level,
) -> Option<(Vector3<f64>, u32)> {
    let mut here = level(from_B);
    if here.height_m.is_nan() || here.height_m <= 0.0 {
        return None;
    }
    let path_B = to_B - from_B;
    let ends_inside = || level(to_B).height_m <= 0.0;
    // Nearer than this the coordinates themselves are rounded.
    let resolution_m = 4.0 * f64::EPSILON * from_B.amax().max(to_B.amax());
    let (mut point_B, mut fraction) = (*from_B, 0.0);
    for _ in 0..MAX_ENTRY_ROUNDS {
        let descent = -here.gradient_B.dot(&path_B);
        if descent.is_nan() || descent <= 0.0 {
            return ends_inside().then_some((point_B, here.piece));
        }
        if here.height_m <= resolution_m {
            break;
        }
        fraction += here.height_m / descent;
        if fraction >= 1.0 {
            return ends_inside().then_some((*to_B, here.piece));
        }
        let piece_before = here.piece;
        point_B = from_B + path_B * fraction;
        here = level(&point_B);
        if here.height_m <= 0.0 {
            here.piece = piece_before;
            break;
        }
    }
    Some((point_B, here.piece))
}

/// Bound on Newton's method; a path that touches in one point only halves its distance each round.
pub(crate) const MAX_ENTRY_ROUNDS: u32 = 64;

/// `v` at unit length, or `otherwise` where it has none.
pub(crate) fn direction_or(v: &Vector3<f64>, otherwise: Vector3<f64>) -> Vector3<f64> {
    let length = v.norm();
    if length > SMALLEST_LENGTH_M && length.is_finite() { v / length } else { otherwise }
}

/// Distance of a point from the y axis \[m\], and the direction that leads there; +x on the axis itself.
pub(crate) fn around_y(point_B: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let across_B = Vector3::new(point_B.x, 0.0, point_B.z);
    (across_B.norm(), direction_or(&across_B, Vector3::x()))
}
