//! What the Friction Cone Algorithm asks of a surface.
//!
//! Problem: the algorithm needs to know when a finger is inside, where it came in, and how to bring
//! a god-object that moved along its tangent plane back onto a curved surface (Melder ch. 4.2.1).
//!
//! Frames and signs: everything in the object's own frame B; normals leave the material; signed
//! distances are negative inside and zero on the surface, and zero counts as contact.
//!
//! Invariants an implementation keeps: normals have unit length for every input, also at points
//! where no normal exists (a documented, fixed direction); no allocation, no panic, bounded time.

use nalgebra::Vector3;

use crate::chart::Chart;

/// What kind of surface piece a god-object rests on; of a finger with a radius, what the finger touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Feature {
    /// No contact.
    #[default]
    None,
    /// A smooth surface.
    Surface,
    /// A flat piece of a surface that has edges.
    Face,
    /// Where two pieces meet.
    Edge,
    /// Where edges meet.
    Vertex,
}

/// A point of a surface and the outward unit normal there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position in the object's frame \[m\].
    pub point_B: Vector3<f64>,
    /// Outward unit normal in the object's frame.
    pub normal_B: Vector3<f64>,
    /// What kind of piece it lies on.
    pub feature: Feature,
    /// Which of the surface's smooth pieces: 0 where there is only one.
    pub piece: u32,
}

/// A surface that fingers can touch: implement it to plug in your own.
pub trait Surface {
    /// Distance to the surface \[m\], negative inside. Only sign and zero must be exact.
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64;

    /// The surface point nearest to a point on either side.
    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint;

    /// Where the segment `from_B -> to_B` first enters the material.
    ///
    /// Entering means from `d > 0` to `d <= 0`: a segment that ends exactly on the surface counts
    /// (the printed strict product of Melder eq. 7.21 misses it), and so does one that passes right
    /// through. Whether the contact outlives such a tick is what [`Self::holds_outside`] tells.
    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint>;

    /// Brings a god-object that left `from` along its tangent plane back onto the surface.
    ///
    /// `from` lets surfaces of many pieces start their walk where the god-object was. A god-object
    /// that went over an edge comes to lie *on* the edge, with the normal and the `piece` of the
    /// one beyond: from there its slide starts anew.
    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint;

    /// Offset of the tangent plane at a surface point, `normal . x <= offset` being inside \[m\].
    ///
    /// Shapes that know it better than through the rounded point override it; the normal force is
    /// only as exact as this number.
    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        at.normal_B.dot(&at.point_B)
    }

    /// Whether a frictionless god-object that came to rest `at` stays there although the HIP,
    /// `depth_m` below its tangent plane, is outside the material: pressed right through.
    ///
    /// True where `at` is a local minimum of the distance to the HIP: on flat pieces always, so that
    /// nobody is pushed through a thin plate; on a ball never, since a HIP beyond it lies deeper
    /// than the centre. What answers `false` lets go of every HIP that is outside.
    fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
        let _ = (at, depth_m);
        false
    }

    /// Coordinates along the surface at one of its points; `None` if it has none, and no picture can lie on it.
    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let _ = at;
        None
    }

    /// The surface on which the centre of a ball of radius `radius_m` rolls: a spherical finger
    /// touches this shape as its centre touches the grown one. `None` where that is not available.
    fn grown(&self, radius_m: f64) -> Option<Self>
    where
        Self: Sized;
}

/// `v` at unit length, or +y where it has none.
///
/// Below `SMALLEST_LENGTH_M` squares underflow and the quotient would not be a unit vector.
pub(crate) fn direction_or_up(v: &Vector3<f64>) -> Vector3<f64> {
    let length = v.norm();
    if length > SMALLEST_LENGTH_M && length.is_finite() { v / length } else { Vector3::y() }
}

/// Shorter vectors have no direction: their squared length loses digits to underflow.
pub(crate) const SMALLEST_LENGTH_M: f64 = 1e-140;
