//! A capsule: a cylinder with half balls on its ends, its axis along y.
//!
//! Frames and signs: object frame B, centred; the length is that of the straight part. On the axis, where every
//! direction is as good, the normal is +x. Signed distances are exact everywhere.
//! Invariant: points it returns lie at the radius from the axis to rounding. Cost: a square root per question.

use nalgebra::Vector3;
use std::f64::consts::PI;

use crate::chart::Chart;
use crate::convex::{Level, direction_or, first_entry};
use crate::error::{ParameterError, above_zero, at_least_zero};
use crate::surface::{Feature, Surface, SurfacePoint};

/// All points within a radius of a piece of the y axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    radius_m: f64,
    half_length_m: f64,
}

impl Capsule {
    /// A capsule whose straight part is `length_m` long.
    ///
    /// Errors: a radius not finite or not positive, a length not finite or negative.
    pub fn new(radius_m: f64, length_m: f64) -> Result<Self, ParameterError> {
        let half_length_m = at_least_zero("length_m", length_m)? * 0.5;
        Ok(Self { radius_m: above_zero("radius_m", radius_m)?, half_length_m })
    }

    /// Radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Length of the straight part along y \[m\].
    pub fn length_m(&self) -> f64 {
        2.0 * self.half_length_m
    }

    fn core(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        Vector3::y() * point_B.y.clamp(-self.half_length_m, self.half_length_m)
    }
}

impl Surface for Capsule {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        (point_B - self.core(point_B)).norm() - self.radius_m
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let core_B = self.core(point_B);
        let normal_B = direction_or(&(point_B - core_B), Vector3::x());
        let point_B = core_B + normal_B * self.radius_m;
        SurfacePoint { point_B, normal_B, feature: Feature::Surface, piece: 0 }
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let level = |point_B: &Vector3<f64>| Level {
            height_m: self.signed_distance(point_B),
            gradient_B: direction_or(&(point_B - self.core(point_B)), Vector3::x()),
            piece: 0,
        };
        let (point_B, _) = first_entry(from_B, to_B, level)?;
        Some(self.nearest(&point_B))
    }

    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.nearest(on_tangent_plane_B)
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        self.half_length_m * at.normal_B.y.abs() + self.radius_m
    }

    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let latitude = at.normal_B.y.atan2(at.normal_B.x.hypot(at.normal_B.z));
        let along_m = at.point_B.y.clamp(-self.half_length_m, self.half_length_m) + self.radius_m * latitude;
        let length_m = self.length_m() + PI * self.radius_m;
        Some(Chart::revolved(at, self.radius_m, along_m, length_m, false))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { radius_m: self.radius_m + radius_m, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pill() -> Capsule {
        Capsule::new(0.01, 0.04).unwrap()
    }

    #[test]
    fn the_radius_must_be_positive_and_the_length_may_be_zero() {
        assert!(Capsule::new(0.0, 0.1).is_err() && Capsule::new(f64::NAN, 0.1).is_err());
        assert!(Capsule::new(0.1, -0.1).is_err() && Capsule::new(0.1, f64::INFINITY).is_err());
        let ball = Capsule::new(0.1, 0.0).unwrap();
        assert_eq!(ball.signed_distance(&Vector3::new(0.0, 0.3, 0.4)), 0.4);
    }

    #[test]
    fn distances_are_those_to_the_straight_part() {
        assert_eq!(pill().signed_distance(&Vector3::new(0.03, 0.05, 0.04)), 0.03f64.hypot(0.05) - 0.01);
        // One subtraction of numbers of 0.01.
        assert!((pill().signed_distance(&Vector3::new(0.0, 0.01, 0.008)) + 0.002).abs() < 1e-17);
        let at = pill().nearest(&Vector3::new(0.0, 0.01, 0.008));
        assert_eq!((at.point_B, at.normal_B), (Vector3::new(0.0, 0.01, 0.01), Vector3::z()));
        assert_eq!(pill().nearest(&Vector3::zeros()).normal_B, Vector3::x(), "on the axis");
    }

    #[test]
    fn paths_enter_the_round_ends_too() {
        let at = pill().entry(&Vector3::new(0.006, 0.1, 0.0), &Vector3::new(0.006, -0.1, 0.0)).unwrap();
        assert!((at.point_B - Vector3::new(0.006, 0.028, 0.0)).norm() < 1e-16);
        assert!(pill().entry(&Vector3::new(0.0101, 0.1, 0.0), &Vector3::new(0.0101, -0.1, 0.0)).is_none());
    }

    #[test]
    fn a_ball_touches_it_as_its_centre_touches_a_thicker_one() {
        assert_eq!(pill().grown(0.005), Some(Capsule::new(0.015, 0.04).unwrap()));
    }
}
