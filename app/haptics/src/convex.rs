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

use crate::surface::{SMALLEST_LENGTH_M, SurfacePoint};

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

/// A convex solid with sharp edges, which round off as it grows by a ball's radius.
pub(crate) trait Edged {
    /// Whether it has grown.
    fn is_round(&self) -> bool;

    /// How far a point lies before the solid with sharp edges.
    fn sharp_level(&self, point_B: &Vector3<f64>) -> Level;

    /// How far a point lies before the round surface: exact everywhere.
    fn round_level(&self, point_B: &Vector3<f64>) -> Level;

    /// The point of a piece nearest to `point_B`.
    fn on(&self, piece: u32, point_B: &Vector3<f64>) -> SurfacePoint;

    /// The point of the round surface nearest to `point_B`.
    fn on_round(&self, point_B: &Vector3<f64>) -> SurfacePoint;

    fn height_m(&self, point_B: &Vector3<f64>) -> f64 {
        if self.is_round() { self.round_level(point_B) } else { self.sharp_level(point_B) }.height_m
    }

    fn nearest_point(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        if self.is_round() {
            return self.on_round(point_B);
        }
        self.on(self.sharp_level(point_B).piece, point_B)
    }

    fn entered(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        if self.is_round() {
            let (point_B, _) = first_entry(from_B, to_B, |point_B| self.round_level(point_B))?;
            return Some(self.on_round(&point_B));
        }
        let (point_B, piece) = first_entry(from_B, to_B, |point_B| self.sharp_level(point_B))?;
        Some(self.on(piece, &point_B))
    }
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
