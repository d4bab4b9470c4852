//! What the integration tests share: a deterministic noise source and ways to read an output.
#![allow(dead_code, non_snake_case)]

pub(crate) mod laws;

pub(crate) mod flawed;
pub(crate) mod meshes;
pub(crate) mod models;
pub(crate) mod path;
pub(crate) mod pictures;
pub(crate) mod ugly;

use haptics::{Entity, Finger, FingerOutput, Form, Friction, Plane, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};

/// Ticks at 1 kHz, as in the thesis.
pub(crate) const DT: f64 = 1e-3;
/// Melder ch. 8.1: 500 N/m (printed as "500Nm"), 5 mm deep, mu_s = 0.7, mu_d = 0.3.
pub(crate) const K: f64 = 500.0;
pub(crate) const DEPTH: f64 = 5e-3;
pub(crate) const MU_S: f64 = 0.7;
pub(crate) const MU_D: f64 = 0.3;

pub(crate) fn stiction() -> Friction {
    Friction::stiction(MU_S, MU_D).unwrap()
}

pub(crate) fn table(friction: Friction) -> Entity {
    entity(Plane::new(Vector3::y(), 0.0).unwrap(), friction)
}

pub(crate) fn ball(radius_m: f64, friction: Friction) -> Entity {
    entity(Sphere::new(radius_m).unwrap(), friction)
}

pub(crate) fn entity(shape: impl Into<Shape>, friction: Friction) -> Entity {
    Entity::new(shape, Isometry3::identity(), K).unwrap().with_friction(friction).unwrap()
}

pub(crate) fn point_finger() -> Finger {
    finger(0.0)
}

/// A finger that feels the whole force at once, also where it starts inside.
pub(crate) fn finger(radius_m: f64) -> Finger {
    Finger::new(radius_m, 4).unwrap().with_ramp_in(0.0).unwrap()
}

/// |F_t| / F_n for a contact with this outward normal.
pub(crate) fn ratio(out: &FingerOutput, normal: &Vector3<f64>) -> f64 {
    let normal_force = out.force_on_user_W.dot(normal);
    (out.force_on_user_W - normal * normal_force).norm() / normal_force
}

/// A point of a great circle of radius `rho`, `phi` from the top.
pub(crate) fn on_circle(rho: f64, phi: f64) -> Vector3<f64> {
    Vector3::new(rho * phi.sin(), rho * phi.cos(), 0.0)
}

/// Angle of the god-object behind the HIP that just satisfies `mu` on a sphere of radius r with the
/// HIP at rho: sine rule in the triangle centre, god-object, HIP, whose angle at the god-object is
/// atan(mu). `None` where the cone at the HIP holds every point of the sphere.
pub(crate) fn sphere_lag(mu: f64, r: f64, rho: f64) -> Option<f64> {
    let sine = mu * r / (rho * (1.0 + mu * mu).sqrt());
    (sine <= 1.0).then(|| sine.asin() - mu.atan())
}

/// Where the frictionless god-object of a plane or a ball is, from the shape's equation alone; `None` outside.
///
/// The surface point nearest to the HIP. At a ball's centre it is the topmost point (+y).
pub(crate) fn closed_form_god_object(shape: &Shape, hip_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    match shape {
        Shape::Form(Form::Plane(plane)) => {
            let (normal_B, offset_m) = (plane.normal_B(), plane.offset_m());
            let depth_m = offset_m - normal_B.dot(hip_B);
            (depth_m >= 0.0).then(|| hip_B + normal_B * depth_m)
        }
        Shape::Form(Form::Sphere(sphere)) => {
            let (r, rho) = (sphere.radius_m(), hip_B.norm());
            let at = if rho > 0.0 { hip_B * (r / rho) } else { Vector3::y() * r };
            (rho <= r).then_some(at)
        }
        _ => panic!("no closed form for {shape:?}"),
    }
}

/// SplitMix64 with Box and Muller's transform: small, seeded, the same everywhere.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub(crate) fn gaussian(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    pub(crate) fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.gaussian(), self.gaussian(), self.gaussian()) * sigma
    }
}

/// A cone that opens upward, of as many flat triangles, the fourth edge of each of which has shrunk to its tip.
pub(crate) fn pit(patches: u32) -> Vec<haptics::NurbsPatch> {
    let rim = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k % patches) / f64::from(patches);
        [0.05 * angle.cos(), 0.03, 0.05 * angle.sin(), 1.0]
    };
    let tip = [0.0, 0.0, 0.0, 1.0];
    let patch = |k| haptics::NurbsPatch {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: vec![rim(k + 1), rim(k), tip, tip],
    };
    (0..patches).map(patch).collect()
}
