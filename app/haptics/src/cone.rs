//! A cone, whole or cut off, with caps, its axis along y: the conic cylinder of Melder ch. 7.4.3.
//!
//! The printed radius (eq. 7.9-7.11) starts from half the *difference* of the radii and slopes the wrong way; here it
//! is the mean radius, y points up and the base is at -length/2. The printed point of intersection (7.15) is level with
//! the finger; depth and force need the slanted normal.
//! Frames, pieces and fixed directions: see `frustum.rs`, which does the work. A radius of zero makes an apex, which
//! acts as a cap without area.

use nalgebra::Vector3;

use crate::error::ParameterError;
use crate::frustum::{Frustum, is_a_frustum};
use crate::surface::{Surface, SurfacePoint};

/// A cone around the y axis of its frame, centred, with caps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone(Frustum);

is_a_frustum!(Cone);

impl Cone {
    /// A cone whose radius goes from `radius_bottom_m` at the lower end to `radius_top_m` at the upper one.
    ///
    /// Errors: a radius not finite or negative, both zero, a length not finite or not positive.
    pub fn new(radius_bottom_m: f64, radius_top_m: f64, length_m: f64) -> Result<Self, ParameterError> {
        Ok(Self(Frustum::new(radius_bottom_m, radius_top_m, length_m)?))
    }

    /// Radius at the lower end \[m\].
    pub fn radius_bottom_m(&self) -> f64 {
        self.0.radius_bottom_m
    }

    /// Radius at the upper end \[m\].
    pub fn radius_top_m(&self) -> f64 {
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

    /// Radius 0.05 below, 0.02 above, 0.04 high: a side of 3 across to 4 up.
    fn bucket() -> Cone {
        Cone::new(0.05, 0.02, 0.04).unwrap()
    }

    #[test]
    fn one_radius_may_be_zero_but_not_both() {
        assert!(Cone::new(0.0, 0.1, 0.1).is_ok() && Cone::new(0.1, 0.0, 0.1).is_ok());
        assert!(Cone::new(0.0, 0.0, 0.1).is_err());
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(Cone::new(bad, 0.1, 0.1).is_err() && Cone::new(0.1, bad, 0.1).is_err());
            assert!(Cone::new(0.1, 0.1, bad).is_err());
        }
    }

    #[test]
    //= melder#7.9 type=test
    //= melder#7.10 type=test
    //= melder#7.11 type=test
    fn the_radius_is_that_of_the_base_below_of_the_top_above_and_their_mean_between() {
        for (y, radius) in [(-0.02, 0.05), (0.0, 0.035), (0.01, 0.0275), (0.02, 0.02)] {
            assert!((bucket().0.radius_at(y) - radius).abs() < 1e-17);
            // As printed: (r_b - r_t) / 2 + y (r_b - r_t) / l.
            let printed: f64 = 0.03 / 2.0 + y * 0.03 / 0.04;
            assert!((printed - radius).abs() > 5e-3 || y == 0.02);
            let just = Vector3::new(radius, y * 0.999, 0.0);
            assert!(bucket().signed_distance(&(just * 0.99)) < 0.0);
            assert!(bucket().signed_distance(&(just + Vector3::x() * 1e-3)) > 0.0);
        }
    }

    #[test]
    fn depth_and_nearest_point_follow_the_slanted_normal() {
        let normal_B = Vector3::new(0.8, 0.6, 0.0);
        let on = Vector3::new(0.035, 0.0, 0.0);
        let inside = on - normal_B * 0.005;
        assert!((bucket().signed_distance(&inside) + 0.005).abs() < 1e-17);
        let at = bucket().nearest(&inside);
        assert!((at.point_B - on).norm() < 1e-17 && (at.normal_B - normal_B).norm() < 2e-16, "{at:?}");
        // The printed point is level with the finger, and 25 % farther away.
        let printed = Vector3::new(bucket().0.radius_at(inside.y), inside.y, 0.0);
        assert!(((printed - inside).norm() / 0.005 - 1.25).abs() < 1e-12);
    }

    #[test]
    fn a_path_that_passes_the_apex_meets_nothing_and_one_below_it_both_sides() {
        let spike = Cone::new(0.02, 0.0, 0.04).unwrap();
        let (left, right) = (Vector3::new(-0.1, 0.0, 0.0), Vector3::new(0.1, 0.0, 0.0));
        let at = spike.entry(&left, &right).unwrap();
        assert!((at.point_B - Vector3::new(-0.01, 0.0, 0.0)).norm() < 1e-16);
        let above = Vector3::y() * 0.0201;
        assert!(spike.entry(&(left + above), &(right + above)).is_none());
        let down = spike.entry(&(Vector3::y() * 0.1), &(Vector3::y() * -0.1)).unwrap();
        assert!((down.point_B - Vector3::y() * 0.02).norm() < 1e-16);
        assert!((down.normal_B.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn over_an_apex_the_other_side_takes_over() {
        let spike = Cone::new(0.02, 0.0, 0.04).unwrap();
        let left = spike.nearest(&Vector3::new(-0.005, 0.009, 0.0));
        let apex = spike.settle(&left, &(left.point_B + Vector3::new(0.02, 0.04, 0.0)));
        assert!((apex.point_B - Vector3::y() * 0.02).norm() < 1e-16);
        let right = spike.settle(&apex, &Vector3::new(0.01, 0.02, 0.0));
        assert!(right.normal_B.x > 0.5 && (right.point_B - apex.point_B).norm() < 1e-16, "{right:?}");
    }
}
