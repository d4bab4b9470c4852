//! A shape scaled by different factors along the axes of its frame (Melder ch. 7.4.7).
//!
//! Model: what a scaled point is inside of, an unscaled point of the unscaled shape is inside of, too: inside, outside
//! and the crossing of a path are exact by the inverse map, which keeps straight lines straight. So are tangent planes;
//! normals map by the inverse transpose.
//! Corrected: depths and nearest points do not map (the thesis uses all tests without modification). Depth is that
//! below the tangent plane in the world's metric, and the nearest point is searched for in that metric.
//!
//! Where a shape stays what it is, [`Scaled::new`] answers with that exact shape instead: a ball becomes an ellipsoid, a
//! box a box, and everything keeps its form under one factor for all axes.
//!
//! Frames and signs: B is the scaled shape's frame, U that of the unscaled one, `p_B = factors * p_U`. The signed
//! distance is exact in sign and zero, and below the true one otherwise.
//! Cost: that of the unscaled shape plus a few products; `nearest` tries [`STARTS`] slides of at most
//! [`crate::MAX_SLIDE_ROUNDS`] rounds, and only a contact that begins inside asks for it.

use nalgebra::Vector3;

use crate::capsule::Capsule;
use crate::chart::Chart;
use crate::cone::Cone;
use crate::convex::direction_or;
use crate::cuboid::Cuboid;
use crate::cylinder::Cylinder;
use crate::ellipsoid::Ellipsoid;
use crate::error::{ParameterError, above_zero};
use crate::friction_cone::{ConeInput, slide_without_friction};
use crate::plane::Plane;
use crate::shape::Form;
use crate::sphere::Sphere;
use crate::surface::{Feature, Surface, SurfacePoint};
use crate::torus::Torus;

/// A shape that scaling turned into something without a closed form of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaled {
    unscaled: Unscaled,
    factors: Vector3<f64>,
}

/// What scaling does not turn into another closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Unscaled {
    Cylinder(Cylinder),
    Cone(Cone),
    Torus(Torus),
    Capsule(Capsule),
}

impl Unscaled {
    /// No point of the shape is farther from the origin \[m\].
    fn reach_m(&self) -> f64 {
        match self {
            Self::Cylinder(c) => c.radius_m() + c.length_m(),
            Self::Cone(c) => c.radius_bottom_m().max(c.radius_top_m()) + c.length_m(),
            Self::Torus(t) => t.ring_radius_m() + t.tube_radius_m(),
            Self::Capsule(c) => c.radius_m() + c.length_m(),
        }
    }
}

/// Slides that the search for the nearest point begins.
const STARTS: usize = 7;

impl Scaled {
    /// `form` scaled by these factors along x, y and z; a form of its own kind where there is one.
    ///
    /// Errors: a factor not finite or not positive, a result out of the range of its kind.
    #[expect(clippy::new_ret_no_self, reason = "most scaled forms are forms of another kind")]
    pub fn new(form: Form, factors: [f64; 3]) -> Result<Form, ParameterError> {
        for factor in factors {
            above_zero("factors", factor)?;
        }
        let [x, y, z] = factors;
        let (is_round, is_uniform) = (x == z, x == y && y == z);
        let scaled = |lengths: [f64; 3]| std::array::from_fn(|i| lengths[i] * factors[i]);
        Ok(match form {
            Form::Plane(plane) => {
                let normal_B = plane.normal_B().component_div(&Vector3::from(factors));
                Plane::new(normal_B, plane.offset_m())?.into()
            }
            Form::Sphere(ball) if is_uniform => Sphere::new(ball.radius_m() * x)?.into(),
            Form::Sphere(ball) => Ellipsoid::new(scaled([ball.radius_m(); 3]))?.into(),
            Form::Ellipsoid(ellipsoid) => Ellipsoid::new(scaled(ellipsoid.radii_m()))?.into(),
            Form::Cuboid(cuboid) => Cuboid::new(scaled(cuboid.size_m()))?.into(),
            Form::Cylinder(c) if is_round => Cylinder::new(c.radius_m() * x, c.length_m() * y)?.into(),
            Form::Cone(c) if is_round => {
                Cone::new(c.radius_bottom_m() * x, c.radius_top_m() * x, c.length_m() * y)?.into()
            }
            Form::Capsule(c) if is_uniform => Capsule::new(c.radius_m() * x, c.length_m() * x)?.into(),
            Form::Torus(t) if is_uniform => Torus::new(t.ring_radius_m() * x, t.tube_radius_m() * x)?.into(),
            Form::Cylinder(cylinder) => Self::of(Unscaled::Cylinder(cylinder), factors),
            Form::Cone(cone) => Self::of(Unscaled::Cone(cone), factors),
            Form::Capsule(capsule) => Self::of(Unscaled::Capsule(capsule), factors),
            Form::Torus(torus) => Self::of(Unscaled::Torus(torus), factors),
            Form::Scaled(inner) => return Self::new(inner.unscaled(), scaled(inner.factors.into())),
        })
    }

    fn of(unscaled: Unscaled, factors: [f64; 3]) -> Form {
        Form::Scaled(Self { unscaled, factors: factors.into() })
    }

    /// The shape before scaling.
    pub fn unscaled(&self) -> Form {
        match self.unscaled {
            Unscaled::Cylinder(cylinder) => cylinder.into(),
            Unscaled::Cone(cone) => cone.into(),
            Unscaled::Torus(torus) => torus.into(),
            Unscaled::Capsule(capsule) => capsule.into(),
        }
    }

    /// Factors along x, y and z.
    pub fn factors(&self) -> [f64; 3] {
        self.factors.into()
    }

    fn surface(&self) -> &dyn Surface {
        match &self.unscaled {
            Unscaled::Cylinder(cylinder) => cylinder,
            Unscaled::Cone(cone) => cone,
            Unscaled::Torus(torus) => torus,
            Unscaled::Capsule(capsule) => capsule,
        }
    }

    fn without_scale(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        point_B.component_div(&self.factors)
    }

    fn unscaled_point(&self, at: &SurfacePoint) -> SurfacePoint {
        let normal_B = direction_or(&at.normal_B.component_mul(&self.factors), at.normal_B);
        SurfacePoint { point_B: self.without_scale(&at.point_B), normal_B, ..*at }
    }

    fn scaled_point(&self, at: &SurfacePoint) -> SurfacePoint {
        // Divided by the smallest factor first, since a normal is a direction only.
        let inverse = self.factors / self.factors.min();
        let normal_B = direction_or(&at.normal_B.component_div(&inverse), at.normal_B);
        SurfacePoint { point_B: at.point_B.component_mul(&self.factors), normal_B, ..*at }
    }

    /// Where a frictionless god-object that begins at `start` comes to rest, if it is finite, and how far away.
    fn rest(&self, start: SurfacePoint, point_B: &Vector3<f64>) -> (f64, SurfacePoint) {
        let input = ConeInput {
            hip_B: *point_B,
            hip_velocity_B: Vector3::zeros(),
            stiffness_n_per_m: 1.0,
            damping_n_s_per_m: 0.0,
            dt_s: 0.0,
        };
        let (rest, _) = slide_without_friction(self, start, &input);
        let distance_m = (rest.point_B - point_B).norm();
        if distance_m.is_finite() { (distance_m, rest) } else { (f64::INFINITY, start) }
    }

    /// Along each axis from outside towards the point, where that path enters.
    fn seen_from(&self, side: usize, point_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let mut away_B = Vector3::zeros();
        // Outside, even if the point lies at the far end.
        let reach_m = 2.0 * (self.unscaled.reach_m() * self.factors.max() + point_B.norm());
        away_B[side / 2] = if side.is_multiple_of(2) { reach_m } else { -reach_m };
        self.entry(&(point_B + away_B), point_B)
    }

    fn nearest_unscaled(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.scaled_point(&self.surface().nearest(&self.without_scale(point_B)))
    }

    /// How the squared distance from the HIP bends along a tangent, by how it changes to either side; 2 for a plane.
    fn bend(&self, at: &SurfacePoint, hip_B: &Vector3<f64>, tangent_B: &Vector3<f64>) -> f64 {
        let squared = |step_B: Vector3<f64>| {
            let probe = self.settle(at, &(at.point_B + step_B));
            // The difference of squares as a product, which keeps its digits.
            let moved_B = probe.point_B - at.point_B;
            moved_B.dot(&(moved_B + (at.point_B - hip_B) * 2.0))
        };
        (squared(*tangent_B) + squared(-tangent_B)) / tangent_B.norm_squared()
    }
}

impl Surface for Scaled {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.surface().signed_distance(&self.without_scale(point_B)) * self.factors.min()
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let mut best = self.rest(self.nearest_unscaled(point_B), point_B);
        for side in 0..STARTS - 1 {
            let Some(start) = self.seen_from(side, point_B) else { continue };
            let found = self.rest(start, point_B);
            if found.0 < best.0 {
                best = found;
            }
        }
        best.1
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let at = self.surface().entry(&self.without_scale(from_B), &self.without_scale(to_B))?;
        Some(self.scaled_point(&at))
    }

    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        let target_U = self.without_scale(on_tangent_plane_B);
        self.scaled_point(&self.surface().settle(&self.unscaled_point(from), &target_U))
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        let lengthened = at.normal_B.component_mul(&self.factors).norm();
        self.surface().tangent_offset(&self.unscaled_point(at)) * lengthened
    }

    /// Flat pieces stay flat. On curved ones the squared distance from the HIP must bend upward in every direction,
    /// which three of them tell.
    fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
        if at.feature == Feature::Face {
            return true;
        }
        let hip_B = at.point_B - at.normal_B * depth_m;
        let step_m = PROBE_PER_DEPTH * depth_m;
        let one = any_tangent(&at.normal_B) * step_m;
        let other = at.normal_B.cross(&one);
        let bend = |tangent_B| self.bend(at, &hip_B, &tangent_B);
        let (a, b, diagonal) = (bend(one), bend(other), bend(one + other));
        let mixed = diagonal - 0.5 * (a + b);
        a > 0.0 && b > 0.0 && a * b > mixed * mixed
    }

    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let chart = self.surface().chart(&self.unscaled_point(at))?;
        let level = 0.5 * (self.factors.x + self.factors.z);
        let upward = match self.unscaled {
            Unscaled::Cylinder(_) | Unscaled::Cone(_) => self.factors.y,
            Unscaled::Torus(_) | Unscaled::Capsule(_) => 0.5 * (level + self.factors.y),
        };
        Some(chart.stretched(&self.factors, [level, upward], &at.normal_B))
    }

    fn grown(&self, _radius_m: f64) -> Option<Self> {
        None
    }
}

/// Far enough to show above rounding (1e-16 of the depth squared), near enough to be local.
const PROBE_PER_DEPTH: f64 = 1e-4;

fn any_tangent(normal_B: &Vector3<f64>) -> Vector3<f64> {
    let axis = normal_B.iamin();
    direction_or(&normal_B.cross(&Vector3::ith(axis, 1.0)), Vector3::x())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_a_closed_form_becomes_that_form() {
        let scaled = |form: Form, factors| Scaled::new(form, factors).unwrap();
        let ball = Form::from(Sphere::new(0.1).unwrap());
        assert_eq!(scaled(ball, [2.0; 3]), Sphere::new(0.2).unwrap().into());
        assert_eq!(scaled(ball, [2.0, 1.0, 0.5]), Ellipsoid::new([0.2, 0.1, 0.05]).unwrap().into());
        let cuboid = Cuboid::new([0.1, 0.2, 0.3]).unwrap().into();
        assert_eq!(scaled(cuboid, [2.0, 1.0, 0.5]), Cuboid::new([0.2, 0.2, 0.15]).unwrap().into());
        let can = Cylinder::new(0.1, 0.2).unwrap().into();
        assert_eq!(scaled(can, [2.0, 3.0, 2.0]), Cylinder::new(0.2, 0.6000000000000001).unwrap().into());
        let ring = Torus::new(0.1, 0.02).unwrap().into();
        assert_eq!(scaled(ring, [2.0; 3]), Torus::new(0.2, 0.04).unwrap().into());
        assert!(matches!(scaled(ring, [2.0, 1.0, 2.0]), Form::Scaled(_)));
        // Twice scaled is scaled once, by the products, and back again it is what it was.
        assert_eq!(scaled(scaled(ring, [2.0, 1.0, 2.0]), [0.5, 1.0, 0.5]), ring);
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Scaled::new(ring, [1.0, bad, 1.0]).is_err());
        }
    }

    #[test]
    fn a_scaled_plane_goes_through_the_scaled_points() {
        let plane = Plane::new(Vector3::new(0.6, 0.8, 0.0), 0.05).unwrap();
        let scaled = Scaled::new(plane.into(), [1.5, 0.5, 2.0]).unwrap();
        for p in [Vector3::new(0.03, 0.04, 1.0), Vector3::new(-0.05, 0.1, 0.0)] {
            // Products and sums of numbers of 0.1.
            assert!(scaled.signed_distance(&p.component_mul(&Vector3::new(1.5, 0.5, 2.0))).abs() < 1e-16);
        }
    }

    /// A cylinder of radius 30 mm, 1.5 times as wide along x and half as wide along z: an ellipse of 45 by 15 mm.
    fn oval() -> Form {
        Scaled::new(Cylinder::new(0.03, 0.1).unwrap().into(), [1.5, 1.0, 0.5]).unwrap()
    }

    #[test]
    fn depth_is_measured_in_the_world_not_in_the_unscaled_frame() {
        // Printed, the unscaled test's own point would do: the foot on the circle, carried back.
        let hip = Vector3::new(0.027, 0.0, 0.007);
        let at = oval().nearest(&hip);
        let printed = Cylinder::new(0.03, 0.1).unwrap().nearest(&Vector3::new(0.018, 0.0, 0.014)).point_B;
        let printed = printed.component_mul(&Vector3::new(1.5, 1.0, 0.5));
        // The ellipse's own nearest point lies along its normal from the finger.
        assert!((at.point_B - hip).cross(&at.normal_B).norm() < 1e-14);
        assert!(((at.point_B.x / 0.045).powi(2) + (at.point_B.z / 0.015).powi(2) - 1.0).abs() < 1e-15);
        assert!((printed - hip).norm() > 1.2 * (at.point_B - hip).norm(), "{printed} {at:?}");
    }

    #[test]
    fn a_point_inside_is_seen_from_all_six_sides_and_from_metres_or_millimetres_alike() {
        // Slender, small and large ones; a length that is 1 only if lengths are metres would show.
        type FormOfSize = fn(f64) -> Form;
        let forms: [(FormOfSize, [f64; 3]); 4] = [
            (|s| Cylinder::new(0.002 * s, 0.5 * s).unwrap().into(), [0.0, 0.2, 0.0]),
            (|s| Cone::new(0.01 * s, 0.002 * s, 0.4 * s).unwrap().into(), [0.0, 0.1, 0.0]),
            (|s| Capsule::new(0.002 * s, 0.5 * s).unwrap().into(), [0.001, -0.2, 0.0]),
            (|s| Torus::new(0.3 * s, 0.01 * s).unwrap().into(), [-0.3, 0.002, 0.0]),
        ];
        for (form, inside) in forms {
            let at = |s: f64| match Scaled::new(form(s), [1.5 / s, 1.0 / s, 0.5 / s]).unwrap() {
                Form::Scaled(scaled) => {
                    let inside = Vector3::from(inside).component_mul(&Vector3::new(1.5, 1.0, 0.5));
                    (0..6).map(|side| scaled.seen_from(side, &inside).expect("inside").point_B).collect()
                }
                other => panic!("{other:?}"),
            };
            let metres: Vec<Vector3<f64>> = at(1.0);
            // In units a thousandth as long, with factors of 1e-3; powers of two, so that no bit changes.
            assert_eq!(metres, at(1024.0), "{metres:?}");
            assert_eq!(metres, at(1.0 / 1024.0), "{metres:?}");
        }
    }

    #[test]
    fn normals_map_by_the_inverse_transpose() {
        let at = oval().nearest(&Vector3::new(0.1, 0.0, 0.03));
        let normal = Vector3::new(at.point_B.x / 0.045f64.powi(2), 0.0, at.point_B.z / 0.015f64.powi(2));
        assert!((at.normal_B - normal.normalize()).norm() < 1e-15, "{at:?}");
        // Mapped as a vector it would lean the other way.
        assert!(at.normal_B.z / at.normal_B.x > at.point_B.z / at.point_B.x);
    }

    #[test]
    fn it_holds_who_is_pressed_through_its_caps_and_not_through_its_side() {
        let coin = Scaled::new(Cylinder::new(0.03, 1e-3).unwrap().into(), [1.5, 1.0, 0.5]).unwrap();
        let cap = coin.nearest(&Vector3::new(0.01, 4e-4, 0.0));
        assert!(coin.holds_outside(&cap, 1.0));
        let flat_side = oval().nearest(&Vector3::new(0.0, 0.0, 0.014));
        // Radius of curvature of the ellipse there: a^2 / c = 0.135.
        assert!(oval().holds_outside(&flat_side, 0.134) && !oval().holds_outside(&flat_side, 0.136));
        let sharp_side = oval().nearest(&Vector3::new(0.044, 0.0, 0.0));
        // c^2 / a = 0.005.
        assert!(oval().holds_outside(&sharp_side, 4.9e-3) && !oval().holds_outside(&sharp_side, 5.1e-3));
    }
}
