//! A cylinder with caps, its axis along y (Melder ch. 7.4.3).
//!
//! Frames, pieces and fixed directions: see `frustum.rs`, which does the work.

use nalgebra::Vector3;

use crate::error::{ParameterError, above_zero};
use crate::frustum::{Frustum, is_a_frustum};
use crate::surface::{Surface, SurfacePoint};

/// A cylinder around the y axis of its frame, centred, with caps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder(Frustum);

is_a_frustum!(Cylinder);

impl Cylinder {
    /// Errors: a radius or length that is not finite or not positive.
    pub fn new(radius_m: f64, length_m: f64) -> Result<Self, ParameterError> {
        above_zero("radius_m", radius_m)?;
        Ok(Self(Frustum::new(radius_m, radius_m, length_m)?))
    }

    /// Radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.0.radius_top_m
    }

    /// Length along y \[m\].
    pub fn length_m(&self) -> f64 {
        2.0 * self.0.half_length_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Feature;

    fn can() -> Cylinder {
        Cylinder::new(0.03, 0.08).unwrap()
    }

    #[test]
    fn sizes_must_be_positive() {
        for bad in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            assert!(Cylinder::new(bad, 0.1).is_err());
            let message = Cylinder::new(0.1, bad).unwrap_err().to_string();
            assert!(message.starts_with(&format!("length_m is {bad};")), "as it was given: {message}");
        }
        assert_eq!((can().radius_m(), can().length_m()), (0.03, 0.08));
    }

    #[test]
    //= melder#7.8 type=test
    //= melder#7.12 type=test
    //= melder#7.13 type=test
    fn inside_is_between_the_caps_and_within_the_radius() {
        let inside = |x, y, z| can().signed_distance(&Vector3::new(x, y, z)) < 0.0;
        assert!(inside(0.018, 0.039, 0.0239) && !inside(0.018, 0.039, 0.0241));
        assert!(inside(0.0, -0.0399, 0.0) && !inside(0.0, -0.0401, 0.0));
        assert_eq!(can().signed_distance(&Vector3::new(0.0, 0.04, 0.0)), 0.0, "on the cap is contact");
    }

    #[test]
    //= melder#7.14 type=test
    //= melder#7.15 type=test
    fn the_nearest_point_of_the_side_is_level_with_the_finger_and_on_the_axis_at_plus_x() {
        let at = can().nearest(&Vector3::new(0.012, 0.01, 0.016));
        // Quotients of numbers of 0.03.
        assert!((at.point_B - Vector3::new(0.018, 0.01, 0.024)).norm() < 1e-17);
        assert!((at.normal_B - Vector3::new(0.6, 0.0, 0.8)).norm() < 3e-16);
        assert_eq!(at.feature, Feature::Surface);
        let centre = can().nearest(&Vector3::zeros());
        assert_eq!((centre.point_B, centre.normal_B), (Vector3::new(0.03, 0.0, 0.0), Vector3::x()));
        let cap = can().nearest(&Vector3::new(0.01, -0.035, 0.0));
        assert_eq!((cap.point_B, cap.normal_B), (Vector3::new(0.01, -0.04, 0.0), -Vector3::y()));
        assert_eq!(cap.feature, Feature::Face);
    }

    #[test]
    fn a_path_straight_through_enters_where_it_first_meets_side_or_cap() {
        let (left, right) = (Vector3::new(-0.1, 0.0, 0.018), Vector3::new(0.1, 0.0, 0.018));
        let side = can().entry(&left, &right).unwrap();
        // x = -sqrt(0.03^2 - 0.018^2).
        assert!((side.point_B - Vector3::new(-0.024, 0.0, 0.018)).norm() < 1e-16);
        let cap = can().entry(&Vector3::new(0.01, 0.1, 0.0), &Vector3::new(0.01, -0.1, 0.0)).unwrap();
        assert_eq!((cap.point_B, cap.normal_B), (Vector3::new(0.01, 0.04, 0.0), Vector3::y()));
        let aside = Vector3::new(0.0, 0.0, 0.0121);
        assert!(can().entry(&(left + aside), &(right + aside)).is_none());
        assert!(can().entry(&Vector3::zeros(), &right).is_none(), "it leads out");
    }

    #[test]
    fn over_the_rim_the_side_takes_over_and_back() {
        let cap = can().nearest(&Vector3::new(0.02, 0.039, 0.0));
        let side = can().settle(&cap, &Vector3::new(0.05, 0.04, 0.0));
        assert_eq!((side.point_B, side.normal_B), (Vector3::new(0.03, 0.04, 0.0), Vector3::x()));
        let back = can().settle(&side, &Vector3::new(0.03, 0.06, 0.0));
        assert_eq!((back.point_B, back.normal_B), (Vector3::new(0.03, 0.04, 0.0), Vector3::y()));
    }
}
