//! An ellipsoid with its axes along those of its frame: the lozenges and pebbles of Melder ch. 7.4.7.
//!
//! Model: inside and outside are told exactly by the gauge `q = |p / radii|`, that is by the inverse of the map that
//! scaled a ball. The nearest point is none of that map's business. It solves `x_i = a_i^2 p_i / (t + a_i^2)` with `x`
//! on the surface for the largest root t (D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a
//! Hyperellipsoid*). Here `u = (t + c^2) / c^2` is sought, c being the smallest radius, by Newton's method on a convex
//! falling function from where no term exceeds one: it approaches from one side, cannot leave the interval, and meets
//! neither the poles nor the digits that `t` loses next to `-c^2`.
//!
//! Frames and signs: object frame B. Where the nearest point is not unique (the middle plane across the smallest
//! radius, near the centre) it is the one on the positive side, of equal radii the first in the order y, x, z: at the
//! centre of a ball +y. The signed distance is exact in sign and zero and first order between.
//! Invariant: radii differ by at most [`LARGEST_RATIO`]. Cost: at most [`MAX_NEAREST_ROUNDS`] rounds, mostly two
//! or three.

use nalgebra::Vector3;

use crate::chart::Chart;
use crate::convex::{Level, direction_or, first_entry};
use crate::error::{ParameterError, above_zero};
use crate::surface::{Feature, Surface, SurfacePoint};

/// An ellipsoid around the origin of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    radii_m: Vector3<f64>,
    /// Axis of the smallest radius.
    shortest: usize,
    /// Thickness of the layer around it, for fingers with a radius \[m\].
    layer_m: f64,
}

/// The largest radius of an ellipsoid over its smallest one.
pub const LARGEST_RATIO: f64 = 1e6;

/// Bound on Newton's method for the nearest point; of 10 million random points in and around ellipsoids with radii up to
/// a million times apart half took at most three rounds, and the worst 21.
pub(crate) const MAX_NEAREST_ROUNDS: u32 = 32;

impl Ellipsoid {
    /// An ellipsoid with these radii along x, y, z.
    ///
    /// Errors: a radius not finite or not positive, radii further apart than [`LARGEST_RATIO`].
    pub fn new(radii_m: [f64; 3]) -> Result<Self, ParameterError> {
        for radius_m in radii_m {
            above_zero("radii_m", radius_m)?;
        }
        let radii_m = Vector3::from(radii_m);
        if radii_m.max() > LARGEST_RATIO * radii_m.min() {
            let allowed = "at most a million times the smallest radius";
            return Err(ParameterError::OutOfRange { parameter: "radii_m", value: radii_m.max(), allowed });
        }
        let shortest = [1, 0, 2].into_iter().find(|&axis| radii_m[axis] == radii_m.min()).unwrap_or(1);
        Ok(Self { radii_m, shortest, layer_m: 0.0 })
    }

    /// Radii along x, y, z \[m\], of a grown one those of the ellipsoid within.
    pub fn radii_m(&self) -> [f64; 3] {
        self.radii_m.into()
    }

    /// 1 on the surface.
    fn gauge(&self, point_B: &Vector3<f64>) -> f64 {
        point_B.component_div(&self.radii_m).norm()
    }

    fn normal(&self, on_surface_B: &Vector3<f64>) -> Vector3<f64> {
        let shortest_m = self.radii_m[self.shortest];
        let ratios = self.radii_m / shortest_m;
        let gradient = on_surface_B.component_div(&self.radii_m).component_div(&ratios);
        direction_or(&gradient, Vector3::y())
    }

    /// Over the smallest radius: the point, and the squared ratio of the radii.
    fn nearest_over_shortest(&self, p: &Vector3<f64>, ratios: &Vector3<f64>) -> Vector3<f64> {
        let excess = ratios.map(|r| (r - 1.0) * (r + 1.0));
        let numerators = p.component_mul(ratios).abs();
        // The larger of what makes each term one; there the sum is between one and three.
        let mut u = (numerators - excess).max().max(0.0);
        if u == 0.0 && numerators[self.shortest] == 0.0 {
            let x = p.component_mul(ratios).component_mul(ratios).zip_map(&excess, quotient);
            let rest = 1.0 - x.component_div(ratios).norm_squared();
            if rest >= 0.0 {
                let mut x = x;
                x[self.shortest] = rest.sqrt();
                return x;
            }
        }
        for _ in 0..MAX_NEAREST_ROUNDS {
            let terms = numerators.zip_map(&excess, |n, e| quotient(n, u + e));
            let sum = terms.norm_squared();
            let slope = terms.zip_fold(&excess, 0.0, |slope, term, e| slope + quotient(term * term, u + e));
            // Newton on 1 / sqrt(sum), which is nearly straight.
            let step = (sum.sqrt() - 1.0) * sum / slope;
            if step.is_nan() || step <= f64::EPSILON * u {
                break;
            }
            u += step;
        }
        p.component_mul(ratios).component_mul(ratios).zip_map(&excess, |n, e| quotient(n, u + e))
    }

    /// Of the ellipsoid without the layer.
    fn nearest_within(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let shortest_m = self.radii_m[self.shortest];
        let x = self.nearest_over_shortest(&(point_B / shortest_m), &(self.radii_m / shortest_m));
        let gauge = self.gauge(&(x * shortest_m));
        let up_B = Vector3::y() * self.radii_m.y;
        self.at(if gauge > 0.0 && gauge.is_finite() { x * (shortest_m / gauge) } else { up_B })
    }

    /// Signed distance to the ellipsoid without the layer, first order.
    fn height(&self, point_B: &Vector3<f64>) -> f64 {
        let scaled = point_B.component_div(&self.radii_m);
        let gauge = scaled.norm();
        let shortest_m = self.radii_m[self.shortest];
        let height_m = (gauge - 1.0) * shortest_m;
        // How many times less steep the gauge is here than along the smallest radius.
        let stretch = gauge / scaled.component_div(&(self.radii_m / shortest_m)).norm();
        if stretch > 1.0 && stretch.is_finite() { height_m * stretch } else { height_m }
    }

    fn gauge_level(&self, point_B: &Vector3<f64>) -> Level {
        let shortest_m = self.radii_m[self.shortest];
        let scaled = point_B.component_div(&self.radii_m);
        let gauge = scaled.norm();
        let gradient_B = scaled.component_div(&self.radii_m) * (shortest_m / gauge);
        Level { height_m: (gauge - 1.0) * shortest_m, gradient_B, piece: 0 }
    }

    /// Before the layer: exact everywhere.
    fn layer_level(&self, point_B: &Vector3<f64>) -> Level {
        let within = self.nearest_within(point_B);
        let height_m = within.normal_B.dot(&(point_B - within.point_B)) - self.layer_m;
        Level { height_m, gradient_B: within.normal_B, piece: 0 }
    }

    fn at(&self, point_B: Vector3<f64>) -> SurfacePoint {
        let normal_B = self.normal(&point_B);
        SurfacePoint { point_B, normal_B, feature: Feature::Surface, piece: 0 }
    }
}

/// `a / b`, where 0/0 is 0.
fn quotient(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

impl Surface for Ellipsoid {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        if self.layer_m > 0.0 { self.layer_level(point_B).height_m } else { self.height(point_B) }
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let within = self.nearest_within(point_B);
        SurfacePoint { point_B: within.point_B + within.normal_B * self.layer_m, ..within }
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        if self.layer_m > 0.0 {
            let (point_B, _) = first_entry(from_B, to_B, |point_B| self.layer_level(point_B))?;
            return Some(self.nearest(&point_B));
        }
        let (point_B, _) = first_entry(from_B, to_B, |point_B| self.gauge_level(point_B))?;
        Some(self.at(point_B / self.gauge(&point_B)))
    }

    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.nearest(on_tangent_plane_B)
    }

    /// The support function of an ellipsoid.
    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        self.radii_m.component_mul(&at.normal_B).norm() + self.layer_m
    }

    /// The smaller principal radius of curvature, from Gaussian and mean curvature.
    fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
        let h = self.radii_m.component_mul(&at.normal_B).norm();
        let within_B = at.point_B - at.normal_B * self.layer_m;
        let squares = self.radii_m.component_mul(&self.radii_m);
        let volume = self.radii_m.product();
        let gauss = (h * h / volume).powi(2);
        let mean = h.powi(3) * (squares.sum() - within_B.norm_squared()) / (2.0 * volume * volume);
        let sharpest = mean + (mean * mean - gauss).max(0.0).sqrt();
        (depth_m - self.layer_m) * sharpest < 1.0
    }

    /// Those of the ball that it is stretched from, along radii of mean length.
    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let direction = direction_or(&at.point_B.component_div(&self.radii_m), Vector3::y());
        let on_ball = SurfacePoint { point_B: direction, normal_B: direction, ..*at };
        let level_m = 0.5 * (self.radii_m.x + self.radii_m.z);
        let along_m = [level_m, 0.5 * (level_m + self.radii_m.y)];
        Some(Chart::of_ball(&on_ball, 1.0).stretched(&self.radii_m, along_m, &at.normal_B))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { layer_m: self.layer_m + radius_m, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lozenge() -> Ellipsoid {
        Ellipsoid::new([0.05, 0.02, 0.03]).unwrap()
    }

    #[test]
    fn radii_must_be_positive_and_not_too_different() {
        for bad in [0.0, -0.1, f64::NAN, f64::INFINITY, 0.1e-7] {
            assert!(Ellipsoid::new([0.05, bad, 0.05]).is_err(), "{bad}");
        }
    }

    #[test]
    fn of_equal_radii_it_is_a_ball() {
        let ball = Ellipsoid::new([0.1; 3]).unwrap();
        let at = ball.nearest(&Vector3::new(0.03, 0.0, -0.04));
        assert!((at.point_B - Vector3::new(0.06, 0.0, -0.08)).norm() < 1e-16);
        assert!((at.normal_B - Vector3::new(0.6, 0.0, -0.8)).norm() < 1e-15);
        assert_eq!(ball.nearest(&Vector3::zeros()).normal_B, Vector3::y());
    }

    #[test]
    fn on_an_axis_the_nearest_point_is_the_end_beyond_the_centre_of_curvature_and_beside_it_before() {
        // The centre of curvature of the end of the longest axis lies at a - c^2 / a = 0.042.
        let end = lozenge().nearest(&Vector3::new(0.043, 0.0, 0.0));
        assert_eq!(end.point_B, Vector3::new(0.05, 0.0, 0.0));
        // Nearer to the middle: x = a^2 p / (a^2 - c^2), on the positive side.
        let side = lozenge().nearest(&Vector3::new(0.021, 0.0, 0.0));
        let x = 0.0025 * 0.021 / 0.0021;
        let expected = Vector3::new(x, 0.02 * (1.0 - (x / 0.05f64).powi(2)).sqrt(), 0.0);
        assert!((side.point_B - expected).norm() < 1e-16, "{side:?}");
        assert_eq!(lozenge().nearest(&Vector3::zeros()).point_B, Vector3::new(0.0, 0.02, 0.0));
    }

    #[test]
    fn what_lies_on_a_normal_has_its_foot_as_nearest_point() {
        for (a, b) in [(0.3f64, 0.7f64), (1.2, 2.0), (-2.0, 4.0), (1e-9, 1e-9)] {
            let on = Vector3::new(0.05 * a.cos() * b.cos(), 0.02 * a.sin(), 0.03 * a.cos() * b.sin());
            let normal = Vector3::new(on.x / 0.0025, on.y / 0.0004, on.z / 0.0009).normalize();
            // Inside less than the smallest radius of curvature, c^2 / a = 8 mm.
            for height in [-7e-3, -1e-6, 0.0, 1e-3, 10.0] {
                let at = lozenge().nearest(&(on + normal * height));
                assert!((at.point_B - on).norm() < 2e-15 * (1.0 + height), "{height} {at:?}");
                assert!((at.normal_B - normal).norm() < 2e-13, "{height}");
            }
        }
    }

    #[test]
    fn it_holds_who_is_pressed_through_its_flat_side_only() {
        let flat = Ellipsoid::new([0.05, 1e-3, 0.05]).unwrap();
        let (top, rim) = (flat.nearest(&(Vector3::y() * 2e-3)), flat.nearest(&(Vector3::x() * 0.1)));
        // Radii of curvature: a^2 / c on top, c^2 / a at the rim.
        assert!(flat.holds_outside(&top, 2.49) && !flat.holds_outside(&top, 2.51));
        assert!(flat.holds_outside(&rim, 1.9e-5) && !flat.holds_outside(&rim, 2.1e-5));
    }

    #[test]
    fn a_path_straight_through_enters_on_the_near_side() {
        let at = lozenge().entry(&Vector3::new(0.03, 0.1, 0.0), &Vector3::new(0.03, -0.1, 0.0)).unwrap();
        assert!((at.point_B - Vector3::new(0.03, 0.016, 0.0)).norm() < 1e-16);
        assert!(lozenge().entry(&Vector3::new(0.0501, 0.1, 0.0), &Vector3::new(0.0501, -0.1, 0.0)).is_none());
    }
}
