//! The contact as the god-object's tangent plane shows it: depth, load and gap.
//!
//! Model: the plane through the god-object G with its normal n cuts the HIP's offset in two. Along
//! n lies the depth d, along the plane the lag `G - S`, where `S = H + d n` is the surface point.
//! The load is the normal force as a spring length, `N / k = max(0, d + (b / k) approach speed)`.
//!
//! Why not simply `G - H`: G is a rounded point of the surface, the depth of a 5 mm contact taken
//! through it carries that rounding, and so would the normal force. Taken from the tangent plane's
//! own offset, the normal force is `k d` to one rounding.
//!
//! Invariants: `load >= 0`, hence contacts never pull; a contact exactly on the surface has no load
//! even with damping, so that touching without pressing is without force.

use nalgebra::Vector3;

use crate::friction_cone::ConeInput;
use crate::surface::{SMALLEST_LENGTH_M, Surface, SurfacePoint};

/// One look at the HIP from the god-object.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TangentView {
    pub(crate) normal_B: Vector3<f64>,
    pub(crate) depth_m: f64,
    pub(crate) load_m: f64,
    /// S, below which the HIP lies.
    pub(crate) surface_point_B: Vector3<f64>,
    /// G - S, in the tangent plane.
    pub(crate) lag_B: Vector3<f64>,
    pub(crate) gap_m: f64,
    /// Below this, a remaining slide is rest.
    pub(crate) rest_m: f64,
}

impl TangentView {
    #[inline]
    pub(crate) fn of<S: Surface + ?Sized>(surface: &S, god_object: &SurfacePoint, input: &ConeInput) -> Self {
        Self::new(&god_object.point_B, god_object.normal_B, surface.tangent_offset(god_object), input)
    }

    /// From a god-object on the plane `normal . x = offset`.
    #[inline]
    pub(crate) fn new(
        god_object_B: &Vector3<f64>,
        normal_B: Vector3<f64>,
        offset_m: f64,
        input: &ConeInput,
    ) -> Self {
        // Corrected: with an outward normal the printed (H - G).n is negative inside.
        //= melder#4.3
        let depth_m = offset_m - normal_B.dot(&input.hip_B);
        let load_m = load(depth_m, &normal_B, input);
        //= melder#4.4
        let surface_point_B = input.hip_B + normal_B * depth_m;
        let lag_B = tangential(&(god_object_B - input.hip_B), &normal_B);
        //= melder#4.5
        let gap_m = lag_B.norm();
        let rest_m = REST_PER_LOAD * load_m + REST_ULPS * f64::EPSILON * god_object_B.amax();
        Self { normal_B, depth_m, load_m, surface_point_B, lag_B, gap_m, rest_m }
    }

    /// Unit direction against the motion, and the gap signed along it.
    ///
    /// Having passed S, the lag points the other way; judged against the direction before, the gap
    /// is negative instead, which lets the slide take the overshoot back. Without that, friction
    /// would settle on the far rim and push along with the motion.
    #[inline]
    pub(crate) fn signed_gap(&self, direction_before_B: &Vector3<f64>) -> (Vector3<f64>, f64) {
        if self.gap_m <= SMALLEST_LENGTH_M {
            let direction_B = tangential(direction_before_B, &self.normal_B);
            let length = direction_B.norm();
            return if length > 0.0 { (direction_B / length, 0.0) } else { (Vector3::zeros(), 0.0) };
        }
        // Twice: a gap far below the depth is mostly rounding along the normal, which a force along
        // this direction must not have.
        let direction_B = tangential(&(self.lag_B / self.gap_m), &self.normal_B);
        if direction_B.dot(direction_before_B) < 0.0 {
            (-direction_B, -self.gap_m)
        } else {
            (direction_B, self.gap_m)
        }
    }
}

/// The part of `v` across the unit vector `normal`.
#[inline]
pub(crate) fn tangential(v: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    v - normal * normal.dot(v)
}

#[inline]
fn load(depth_m: f64, normal_B: &Vector3<f64>, input: &ConeInput) -> f64 {
    if depth_m.is_nan() || depth_m <= 0.0 {
        return 0.0;
    }
    if input.damping_n_s_per_m == 0.0 {
        return depth_m;
    }
    let approach_m_s = -normal_B.dot(&input.hip_velocity_B);
    //= melder#6.2
    (depth_m + input.damping_s() * approach_m_s).max(0.0)
}

/// A slide this small against the load is rest: a force ratio to 12 digits, 1000 times finer than
/// the 9 digits promised, and still 4 digits above rounding.
const REST_PER_LOAD: f64 = 1e-12;
/// Finer than this the position itself cannot resolve: some roundings of the largest coordinate.
const REST_ULPS: f64 = 4.0;
