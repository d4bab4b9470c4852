//! A ball with its centre at the origin of its frame.
//!
//! Frames and signs: object frame B; the outward normal at G is `G / |G|`. The printed
//! eq. 4.9-4.10 give the inward one and 4.14 forgets the centre; here the centre is B's origin and
//! the pose carries it.
//! Invariant: points it returns lie at the radius to rounding. At the centre, where every direction
//! is as good, the normal is +y.
//! Cost: one square root per question, two for an entry.

use nalgebra::Vector3;

use crate::chart::Chart;
use crate::error::{ParameterError, above_zero};
use crate::surface::{Feature, Surface, SurfacePoint, direction_or_up};

/// A ball around the origin of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    radius_m: f64,
}

impl Sphere {
    /// Errors: a radius that is not finite or not positive.
    pub fn new(radius_m: f64) -> Result<Self, ParameterError> {
        Ok(Self { radius_m: above_zero("radius_m", radius_m)? })
    }

    /// Radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }
}

impl Surface for Sphere {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        //= melder#7.4
        //= melder#7.5
        point_B.norm() - self.radius_m
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        //= melder#4.9
        //= melder#4.10
        //= melder#4.13
        //= melder#7.6
        let normal_B = direction_or_up(point_B);
        //= melder#4.14
        //= melder#7.7
        SurfacePoint { point_B: normal_B * self.radius_m, normal_B, feature: Feature::Surface, piece: 0 }
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let (before, after) = (self.signed_distance(from_B), self.signed_distance(to_B));
        let path = to_B - from_B;
        // |from + u path|^2 = r^2 for the nearer root, in the form that cancels least: the cross
        // product is the path's distance from the centre, times its length.
        let half_b = -from_B.dot(&path);
        let c = before * (from_B.norm() + self.radius_m);
        let reach_squared = path.norm_squared() * (self.radius_m * self.radius_m);
        let discriminant = reach_squared - from_B.cross(&path).norm_squared();
        let fraction = c / (half_b + discriminant.max(0.0).sqrt());
        let passes_through = discriminant > 0.0 && (0.0..=1.0).contains(&fraction);
        if !(before > 0.0 && (after <= 0.0 || passes_through)) {
            return None;
        }
        Some(self.nearest(&(from_B + path * fraction.min(1.0))))
    }

    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        //= melder#4.12
        self.nearest(on_tangent_plane_B)
    }

    /// `n . c + r` with the centre at the origin.
    fn tangent_offset(&self, _at: &SurfacePoint) -> f64 {
        //= melder#4.11
        self.radius_m
    }

    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        Some(Chart::of_ball(at, self.radius_m))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { radius_m: self.radius_m + radius_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ball() -> Sphere {
        Sphere::new(0.1).unwrap()
    }

    #[test]
    fn a_radius_must_be_positive() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Sphere::new(bad).is_err());
        }
    }

    #[test]
    //= melder#4.9 type=test
    //= melder#4.10 type=test
    //= melder#4.13 type=test
    //= melder#4.14 type=test
    //= melder#7.6 type=test
    //= melder#7.7 type=test
    fn the_nearest_point_lies_outward_at_the_radius() {
        let at = ball().nearest(&Vector3::new(0.0, 0.0, -0.05));
        assert_eq!(at.point_B, Vector3::new(0.0, 0.0, -0.1));
        assert_eq!(at.normal_B, Vector3::new(0.0, 0.0, -1.0));
    }

    #[test]
    fn at_the_centre_the_normal_is_up() {
        for almost_nothing in [0.0, 1e-300, 1e-160] {
            assert_eq!(ball().nearest(&Vector3::new(almost_nothing, 0.0, 0.0)).normal_B, Vector3::y());
        }
    }

    #[test]
    //= melder#4.11 type=test
    fn the_tangent_plane_lies_one_radius_from_the_centre() {
        let at = ball().nearest(&Vector3::new(0.3, -0.2, 0.6));
        // Three products of a unit vector and a vector of length 0.1.
        assert!((ball().tangent_offset(&at) - at.normal_B.dot(&at.point_B)).abs() < 5e-17);
    }

    #[test]
    fn a_path_straight_through_enters_on_the_near_side_and_one_beside_it_does_not() {
        let (from, to) = (Vector3::new(-0.2, 0.0, 0.0), Vector3::new(0.2, 0.0, 0.0));
        let entry = ball().entry(&from, &to).unwrap();
        assert_eq!((entry.point_B, entry.normal_B), (Vector3::new(-0.1, 0.0, 0.0), -Vector3::x()));
        let aside = Vector3::new(0.0, 0.1001, 0.0);
        assert!(ball().entry(&(from + aside), &(to + aside)).is_none());
        assert!(ball().entry(&to, &(to + to)).is_none(), "it leads away");
    }

    #[test]
    //= melder#7.4 type=test
    //= melder#7.5 type=test
    fn landing_exactly_on_the_ball_is_an_entry() {
        let on = Vector3::new(0.0, 0.1, 0.0);
        assert_eq!(ball().entry(&Vector3::new(0.0, 0.2, 0.0), &on).unwrap().point_B, on);
    }

    proptest! {
        /// The oracle bisects on the signed distance.
        #[test]
        fn the_entry_lies_on_the_path_and_on_the_ball(
            out in prop::array::uniform3(-1.0..1.0f64), into in prop::array::uniform3(-0.05..0.05f64),
        ) {
            let (out, into) = (Vector3::from(out), Vector3::from(into));
            prop_assume!(out.norm() > 0.1001);
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let outside = ball().signed_distance(&(out + (into - out) * middle)) > 0.0;
                if outside { low = middle } else { high = middle }
            }
            let expected = out + (into - out) * high;
            let entry = ball().entry(&out, &into).unwrap();
            // The path passes the centre at 0.087 or less, so half its chord is at least 0.05:
            // roundings of coordinates of size 1.7 (2e-16) act 0.1 / 0.05 times as strongly along
            // the path, and both sides make several.
            prop_assert!((entry.point_B - expected).norm() < 1e-14);
        }
    }
}
