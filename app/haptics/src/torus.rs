//! A torus: a tube bent to a ring around the y axis (Melder ch. 7.4.4).
//!
//! Model: the nearest surface point lies where the tube's circle in the half-plane through the axis and the finger is
//! nearest. The text of the thesis is right, its symbols are mixed up: the circle has the tube's radius and lies at the
//! ring's.
//!
//! Frames and signs: object frame B, ring in the plane y = 0. On the axis the circle towards +x is used, on the tube's
//! middle line the normal is +y. Signed distances are exact everywhere.
//! Invariants: the ring is wider than the tube is thick, so that there is a hole: otherwise the surface would meet
//! itself in a dimple where no single normal exists. That holds for grown tori, too: a ball that does not fit through
//! the hole feels this shape in triangles ([`crate::Entity::prepared_for`]).
//! Cost: two square roots per question; an entry near enough to be possible solves a quartic.

use nalgebra::Vector3;
use std::f64::consts::TAU;

use crate::chart::Chart;
use crate::convex::around_y;
use crate::error::{ParameterError, above_zero};
use crate::quartic::first_fall_below_zero;
use crate::surface::{Feature, Surface, SurfacePoint, direction_or_up};

/// A ring around the y axis of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus {
    ring_radius_m: f64,
    tube_radius_m: f64,
}

impl Torus {
    /// A tube of radius `tube_radius_m` whose middle line is a circle of radius `ring_radius_m`.
    ///
    /// Errors: a radius not finite or not positive, a ring not larger than the tube.
    pub fn new(ring_radius_m: f64, tube_radius_m: f64) -> Result<Self, ParameterError> {
        above_zero("ring_radius_m", ring_radius_m)?;
        above_zero("tube_radius_m", tube_radius_m)?;
        if ring_radius_m <= tube_radius_m {
            return Err(ParameterError::OutOfRange {
                parameter: "ring_radius_m",
                value: ring_radius_m,
                allowed: "a finite number > tube_radius_m, so that the ring has a hole",
            });
        }
        Ok(Self { ring_radius_m, tube_radius_m })
    }

    /// Radius of the tube's middle line \[m\].
    pub fn ring_radius_m(&self) -> f64 {
        self.ring_radius_m
    }

    /// Radius of the tube \[m\].
    pub fn tube_radius_m(&self) -> f64 {
        self.tube_radius_m
    }

    /// Point of the tube's middle line nearest to `point_B`.
    fn middle(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        // Corrected: on the axis the printed quotient is 0/0, here it is +x; and the distance is the ring's radius.
        //= melder#7.17
        //= melder#7.18
        around_y(point_B).1 * self.ring_radius_m
    }

    /// Where on the path `signed_distance` first falls to zero, by the quartic
    /// `(|p|^2 + R^2 - r^2)^2 - 4 R^2 rho^2`, which has its sign.
    fn crossing(&self, from_B: &Vector3<f64>, path_B: &Vector3<f64>) -> Option<f64> {
        let (p, v) = (from_B / self.ring_radius_m, path_B / self.ring_radius_m);
        let tube = self.tube_radius_m / self.ring_radius_m;
        let flat = |a: &Vector3<f64>, b: &Vector3<f64>| a.x * b.x + a.z * b.z;
        let (a, b, u) = (v.norm_squared(), 2.0 * p.dot(&v), p.norm_squared() + 1.0 - tube * tube);
        // As a product of distances, which near the surface has the digits that the difference loses.
        let near = self.signed_distance(from_B) / self.ring_radius_m;
        let rho = flat(&p, &p).sqrt();
        let at_start = near * (near + 2.0 * tube) * ((rho + 1.0).powi(2) + p.y * p.y - tube * tube);
        first_fall_below_zero(&[
            at_start,
            2.0 * b * u - 8.0 * flat(&p, &v),
            b * b + 2.0 * a * u - 4.0 * flat(&v, &v),
            2.0 * a * b,
            a * a,
        ])
    }

    /// The crossing to the last digit, from one that carries the quartic's rounding.
    fn polished(&self, from_B: &Vector3<f64>, path_B: &Vector3<f64>, mut fraction: f64) -> f64 {
        let mut distance_m = self.signed_distance(&(from_B + path_B * fraction));
        for _ in 0..3 {
            let slope = self.nearest(&(from_B + path_B * fraction)).normal_B.dot(path_B);
            let next = (fraction - distance_m / slope).clamp(0.0, 1.0);
            let next_m = self.signed_distance(&(from_B + path_B * next));
            if next_m.is_nan() || next_m.abs() >= distance_m.abs() {
                break;
            }
            (fraction, distance_m) = (next, next_m);
        }
        fraction
    }
}

impl Surface for Torus {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        // Corrected: the printed test compares with the ring's radius what the text compares with the tube's.
        //= melder#7.16
        (point_B - self.middle(point_B)).norm() - self.tube_radius_m
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let middle_B = self.middle(point_B);
        let normal_B = direction_or_up(&(point_B - middle_B));
        let point_B = middle_B + normal_B * self.tube_radius_m;
        SurfacePoint { point_B, normal_B, feature: Feature::Surface, piece: 0 }
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let (before, after) = (self.signed_distance(from_B), self.signed_distance(to_B));
        let path_B = to_B - from_B;
        if before.is_nan() || before <= 0.0 || before > path_B.norm() {
            return None;
        }
        let ends_inside = (after <= 0.0).then_some(1.0);
        let fraction = self.crossing(from_B, &path_B).or(ends_inside)?;
        Some(self.nearest(&(from_B + path_B * self.polished(from_B, &path_B, fraction))))
    }

    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.nearest(on_tangent_plane_B)
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        at.normal_B.dot(&self.middle(&at.point_B)) + self.tube_radius_m
    }

    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let out = at.normal_B.dot(&around_y(&at.point_B).1);
        let along_m = self.tube_radius_m * at.normal_B.y.atan2(out);
        Some(Chart::revolved(at, self.ring_radius_m, along_m, TAU * self.tube_radius_m, true))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Self::new(self.ring_radius_m, self.tube_radius_m + radius_m).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring() -> Torus {
        Torus::new(0.05, 0.01).unwrap()
    }

    #[test]
    fn a_ring_without_a_hole_is_refused_with_the_reason() {
        for tube in [0.05, 0.06] {
            let message = Torus::new(0.05, tube).unwrap_err().to_string();
            assert!(message.contains("ring_radius_m is 0.05") && message.contains("hole"), "{message}");
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Torus::new(bad, 0.01).is_err() && Torus::new(0.05, bad).is_err());
        }
    }

    #[test]
    //= melder#7.16 type=test
    //= melder#7.17 type=test
    //= melder#7.18 type=test
    fn the_tube_has_the_tubes_radius_and_lies_at_the_rings() {
        let inside = |x, y, z| ring().signed_distance(&Vector3::new(x, y, z)) < 0.0;
        // As printed the sphere would have the ring's radius: the hole would be filled.
        assert!(!inside(0.0, 0.0, 0.0) && !inside(0.0, 0.0, 0.0399) && inside(0.0, 0.0, 0.0401));
        assert!(inside(0.0599, 0.0, 0.0) && !inside(0.0601, 0.0, 0.0));
        assert!(inside(0.03, 0.0099, 0.04) && !inside(0.03, 0.0101, 0.04));
        // The quarter up: 3-4-5 around the middle line at (0.03, 0, 0.04).
        let at = ring().nearest(&(Vector3::new(0.03, 0.0, 0.04) * 1.06 + Vector3::y() * 0.004));
        let normal_B = Vector3::new(0.36, 0.8, 0.48);
        assert!((at.normal_B - normal_B).norm() < 1e-14, "heights of 4 mm rounded against 50");
        assert!((at.point_B - (Vector3::new(0.03, 0.0, 0.04) + normal_B * 0.01)).norm() < 1e-15);
    }

    #[test]
    fn where_no_direction_exists_there_is_a_fixed_one() {
        // On the axis: as if towards +x, and from there inward. On the middle line: up.
        let axis = ring().nearest(&Vector3::zeros());
        assert_eq!((axis.point_B, axis.normal_B), (Vector3::new(0.04, 0.0, 0.0), -Vector3::x()));
        let middle = ring().nearest(&Vector3::new(0.0, 0.0, 0.05));
        assert_eq!((middle.point_B, middle.normal_B), (Vector3::new(0.0, 0.01, 0.05), Vector3::y()));
    }

    #[test]
    fn a_path_across_the_ring_enters_the_near_side_and_from_the_hole_the_far_one() {
        let (left, right) = (Vector3::new(-0.1, 0.0, 0.0), Vector3::new(0.1, 0.0, 0.0));
        assert!((ring().entry(&left, &right).unwrap().point_B.x + 0.06).abs() < 1e-16);
        let far = ring().entry(&Vector3::zeros(), &right).unwrap();
        assert!((far.point_B.x - 0.04).abs() < 1e-16 && far.normal_B.x < -0.999);
        assert!(ring().entry(&(Vector3::y() * 0.1), &(Vector3::y() * -0.1)).is_none(), "through the hole");
        let grazing = Vector3::y() * (0.01 - 1e-9);
        assert!(ring().entry(&(left + grazing), &(right + grazing)).is_some(), "a nanometre deep");
    }

    #[test]
    fn a_ball_that_fits_the_hole_feels_a_thicker_tube_and_another_none() {
        assert_eq!(ring().grown(0.02), Some(Torus::new(0.05, 0.03).unwrap()));
        assert_eq!(ring().grown(0.04), None);
    }
}
