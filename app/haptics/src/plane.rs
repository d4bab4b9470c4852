//! A half-space: everything at or below a plane.
//!
//! Frames and signs: object frame B; inside is `normal . x <= offset`; signed distance
//! `s = normal . x - offset` (Melder eq. 7.1-7.3, corrected to one sign convention).
//! Invariant: the normal has unit length. Cost: one dot product per question.

use nalgebra::Vector3;

use crate::chart::Chart;
use crate::error::{ParameterError, finite};
use crate::surface::{Feature, Surface, SurfacePoint};

/// A half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    normal_B: Vector3<f64>,
    offset_m: f64,
}

impl Plane {
    /// The half-space `normal . x <= offset`, for a normal of any length; both are divided by it.
    ///
    /// Errors: a normal without direction, an offset that is not finite.
    pub fn new(normal_B: Vector3<f64>, offset_m: f64) -> Result<Self, ParameterError> {
        let length = normal_B.norm();
        if !length.is_normal() {
            return Err(ParameterError::NoDirection { parameter: "normal", value: normal_B.into() });
        }
        let offset_m = finite("offset_m", offset_m / length)?;
        Ok(Self { normal_B: normal_B / length, offset_m })
    }

    /// Outward unit normal.
    pub fn normal_B(&self) -> Vector3<f64> {
        self.normal_B
    }

    /// Distance of the plane from the origin along the normal \[m\].
    pub fn offset_m(&self) -> f64 {
        self.offset_m
    }

    fn at(&self, point_B: Vector3<f64>) -> SurfacePoint {
        SurfacePoint { point_B, normal_B: self.normal_B, feature: Feature::Surface, piece: 0 }
    }
}

impl Surface for Plane {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        //= melder#7.1
        self.normal_B.dot(point_B) - self.offset_m
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        //= melder#7.2
        //= melder#7.3
        self.at(point_B - self.normal_B * self.signed_distance(point_B))
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        //= melder#7.19
        //= melder#7.20
        let (before, after) = (self.signed_distance(from_B), self.signed_distance(to_B));
        // Corrected: the printed strict product misses a tick that lands exactly on the plane.
        //= melder#7.21
        if before > 0.0 && after <= 0.0 {
            // Corrected: the printed intersection formula does not lie on the plane.
            //= melder#7.22
            //= melder#7.23
            return Some(self.at(from_B + (to_B - from_B) * (before / (before - after))));
        }
        None
    }

    /// The tangent plane is the plane itself; projecting once more would only add rounding.
    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.at(*on_tangent_plane_B)
    }

    fn tangent_offset(&self, _at: &SurfacePoint) -> f64 {
        self.offset_m
    }

    /// From the foot of B's origin.
    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        Some(Chart::flat(&at.point_B, &self.normal_B, [f64::INFINITY; 2]))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { offset_m: self.offset_m + radius_m, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Plane {
        Plane::new(Vector3::y(), 0.1).unwrap()
    }

    #[test]
    fn a_normal_of_any_length_means_the_same_half_space() {
        let plane = Plane::new(Vector3::new(0.0, 4.0, 0.0), 0.4).unwrap();
        assert_eq!(plane, table());
        assert!(Plane::new(Vector3::zeros(), 0.0).is_err());
        assert!(Plane::new(Vector3::new(f64::NAN, 1.0, 0.0), 0.0).is_err());
        assert!(Plane::new(Vector3::y(), f64::INFINITY).is_err());
    }

    #[test]
    //= melder#7.1 type=test
    fn depth_is_negative_signed_distance() {
        assert_eq!(table().signed_distance(&Vector3::new(7.0, 0.35, -3.0)), 0.35 - 0.1);
        assert!(table().signed_distance(&Vector3::new(7.0, 0.0, -3.0)) < 0.0);
    }

    #[test]
    //= melder#7.2 type=test
    //= melder#7.3 type=test
    fn the_nearest_point_is_the_foot_of_the_perpendicular() {
        let foot = Vector3::new(7.0, 0.1, -3.0);
        for y in [-0.1, 0.1, 0.2] {
            assert_eq!(table().nearest(&Vector3::new(7.0, y, -3.0)).point_B, foot);
        }
    }

    #[test]
    //= melder#7.19 type=test
    //= melder#7.20 type=test
    //= melder#7.22 type=test
    //= melder#7.23 type=test
    fn a_finger_enters_where_its_path_meets_the_plane() {
        let entry = table().entry(&Vector3::new(0.0, 0.3, 0.0), &Vector3::new(4.0, -0.1, 8.0)).unwrap();
        // Half way down; each coordinate carries two roundings of numbers up to 8.
        assert!((entry.point_B - Vector3::new(2.0, 0.1, 4.0)).norm() < 4e-15);
        assert_eq!(entry.normal_B, Vector3::y());
    }

    #[test]
    //= melder#7.21 type=test
    fn landing_exactly_on_the_plane_is_an_entry_and_leaving_is_not() {
        let (above, on) = (Vector3::new(0.0, 0.2, 0.0), Vector3::new(0.0, 0.1, 0.0));
        assert_eq!(table().entry(&above, &on).unwrap().point_B, on);
        assert!(table().entry(&on, &above).is_none());
        assert!(table().entry(&on, &Vector3::zeros()).is_none(), "it was in contact already");
    }

    #[test]
    fn a_ball_touches_a_plane_one_radius_earlier() {
        assert_eq!(table().grown(0.01).unwrap().signed_distance(&Vector3::new(0.0, 0.11, 0.0)), 0.0);
    }
}
