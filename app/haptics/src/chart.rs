//! Coordinates along a surface, in metres: where a picture lies on it.
//!
//! Problem: a picture of heights has two coordinates, a surface of any shape needs two of its own, and the slope of the
//! heights is wanted in metres per metre along the surface.
//!
//! Model: a [`Chart`] tells for a point of a surface two coordinates `u`, `v` and their gradients along the surface. The
//! gradients, not the tangents: what is `h(u, v)` then has the surface gradient `h_u grad u + h_v grad v`, also where a
//! coordinate does not change along the surface at all.
//!
//! Where they are: seen from outside with y up, `u` runs to the right and `v` up.
//! - flat pieces (planes, boxes, caps): `v` along the direction that is most upward, on level pieces along -z above and +z
//!   below, `u` along `v x n`, which is +x on both; from the middle of the piece, on a plane from the foot of B's origin;
//! - around an axis (spheres, cylinders, cones, capsules, ellipsoids): `u` is the longitude, eastward from +z, times the
//!   largest radius; the seam is at -z, where pictures that are repeated a whole number of times meet without a step. `v` is
//!   the length along the profile, from the equator of round shapes, from the middle of straight ones;
//! - tori: `u` around the ring, `v` around the tube, 0 outside, upward;
//! - scaled shapes and ellipsoids: those of the shape before, in metres along the mean radius;
//! - meshes: what the file says, in pictures instead of metres.
//!
//! Poles: towards them all longitudes meet, and a picture would be squeezed to a point. Nearer to the axis than
//! [`POLE_SHARE`] of the largest radius, what lies on the surface is to fade, as [`Chart::weight`] tells.
//!
//! Frames: B. Cost: an arc tangent or two, and square roots.

use nalgebra::Vector3;

use crate::convex::{around_y, direction_or};
use crate::surface::SurfacePoint;

/// Where a point of a surface is in coordinates along that surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chart {
    /// To the right, seen from outside.
    pub u: Coordinate,
    /// Up.
    pub v: Coordinate,
    /// How much of a picture is left here: 1, falling to 0 towards poles.
    pub weight: f64,
    /// Its gradient along the surface \[1/m\].
    pub weight_gradient_B: Vector3<f64>,
}

/// One of two coordinates along a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// From the middle of the surface \[m\]; on meshes in pictures.
    pub at_m: f64,
    /// From one end to the other \[m\]; infinite on a plane, 1 on meshes.
    pub length_m: f64,
    /// Whether the ends are the same place.
    pub closes: bool,
    /// Gradient along the surface, 1 where a metre of the coordinate is a metre of the surface.
    pub gradient_B: Vector3<f64>,
}

/// A picture fades nearer to the axis than this share of the largest radius: at its rim a picture is squeezed tenfold.
pub const POLE_SHARE: f64 = 0.1;

impl Coordinate {
    fn stretched(self, factor: f64, gradient_B: Vector3<f64>) -> Self {
        let (at_m, length_m) = (self.at_m * factor, self.length_m * factor);
        Self { at_m, length_m, gradient_B: gradient_B * factor, ..self }
    }
}

impl Chart {
    /// Of a flat piece with this outward normal: `at_B` from the piece's middle, `lengths_m` along u and v.
    pub fn flat(at_B: &Vector3<f64>, normal_B: &Vector3<f64>, lengths_m: [f64; 2]) -> Self {
        let axes_B = flat_axes(normal_B);
        let [u, v] = [0, 1].map(|i| Coordinate {
            at_m: axes_B[i].dot(at_B),
            length_m: lengths_m[i],
            closes: false,
            gradient_B: axes_B[i],
        });
        Self { u, v, weight: 1.0, weight_gradient_B: Vector3::zeros() }
    }

    /// Of a surface around the y axis: `u` is the longitude times `radius_m`; along the profile (m) `v_at_m` of
    /// `v_length_m`.
    pub fn revolved(at: &SurfacePoint, radius_m: f64, v_at_m: f64, v_length_m: f64, v_closes: bool) -> Self {
        let (rho_m, outward_B) = around_y(&at.point_B);
        let (normal_rho, normal_y) = (at.normal_B.dot(&outward_B), at.normal_B.y);
        let up_B = direction_or(&(Vector3::y() * normal_rho - outward_B * normal_y), Vector3::y());
        let east_B = Vector3::new(outward_B.z, 0.0, -outward_B.x);
        let gradient_B = if rho_m > 0.0 { east_B * (radius_m / rho_m) } else { Vector3::zeros() };
        let u = Coordinate {
            at_m: radius_m * outward_B.x.atan2(outward_B.z),
            length_m: std::f64::consts::TAU * radius_m,
            closes: true,
            gradient_B,
        };
        let v = Coordinate { at_m: v_at_m, length_m: v_length_m, closes: v_closes, gradient_B: up_B };
        let (weight, slope) = faded(rho_m / (POLE_SHARE * radius_m));
        let weight_gradient_B = up_B * (up_B.dot(&outward_B) * slope / (POLE_SHARE * radius_m));
        if weight == 0.0 {
            // Nothing is left that could have a slope, and the longitude's gradient may be of any size.
            let u = Coordinate { gradient_B: Vector3::zeros(), ..u };
            return Self { u, v, weight, weight_gradient_B: Vector3::zeros() };
        }
        Self { u, v, weight, weight_gradient_B }
    }

    /// Of a ball around the origin.
    pub(crate) fn of_ball(at: &SurfacePoint, radius_m: f64) -> Self {
        let latitude = at.normal_B.y.atan2(at.normal_B.x.hypot(at.normal_B.z));
        Self::revolved(at, radius_m, radius_m * latitude, std::f64::consts::PI * radius_m, false)
    }

    /// That of the same point when the surface is stretched along the axes of B; `along` are the stretches along u and v
    /// that make metres again, `normal_B` is the stretched surface's.
    pub(crate) fn stretched(self, factors: &Vector3<f64>, along: [f64; 2], normal_B: &Vector3<f64>) -> Self {
        // A gradient goes with the inverse of what places go with; only its part along the surface is one.
        let stretch = |gradient_B: Vector3<f64>| along_surface(&gradient_B.component_div(factors), normal_B);
        Self {
            u: self.u.stretched(along[0], stretch(self.u.gradient_B)),
            v: self.v.stretched(along[1], stretch(self.v.gradient_B)),
            weight: self.weight,
            weight_gradient_B: stretch(self.weight_gradient_B),
        }
    }
}

/// The part of a vector along a surface.
pub(crate) fn along_surface(v_B: &Vector3<f64>, normal_B: &Vector3<f64>) -> Vector3<f64> {
    v_B - normal_B * normal_B.dot(v_B)
}

/// Right and up on a flat piece seen from outside.
fn flat_axes(normal_B: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let is_level = normal_B.y.abs() > LEVEL;
    let upward_B = if is_level { Vector3::z() * -normal_B.y.signum() } else { Vector3::y() };
    let v_B = direction_or(&along_surface(&upward_B, normal_B), Vector3::y());
    [v_B.cross(normal_B), v_B]
}

/// Flatter than this (2.6 degrees), a piece has no upward direction to speak of.
const LEVEL: f64 = 0.999;

/// From 0 at 0 to 1 at 1 and beyond without a step in the slope; and its slope. Over `t` it stays finite at 0.
fn faded(t: f64) -> (f64, f64) {
    let t = t.clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t))
}
