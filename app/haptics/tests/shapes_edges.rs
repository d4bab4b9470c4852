//! Where the pieces of a shape meet: slides go over edges, fingers leave round them, thin parts hold.
#![allow(non_snake_case)]

mod common;
#[path = "common/solids.rs"]
mod solids;

use common::*;
use haptics::{
    Cone, ConeInput, Cuboid, Cylinder, Ellipsoid, Entity, Finger, FingerOutput, Form, Friction, FrictionCone,
    FrictionState, MAX_SLIDE_ROUNDS, Surface,
};
use nalgebra::{Isometry3, Vector3};

fn laws() -> [Friction; 4] {
    [Friction::None, Friction::coulomb(0.4).unwrap(), stiction(), Friction::coulomb(1.5).unwrap()]
}

fn step(finger: &mut Finger, entity: &Entity, hip: Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), &hip, DT)
}

fn still(hip_B: Vector3<f64>) -> ConeInput {
    let hip_velocity_B = Vector3::zeros();
    ConeInput { hip_B, hip_velocity_B, stiffness_n_per_m: K, damping_n_s_per_m: 0.0, dt_s: DT }
}

fn inside(solid: &solids::Solid, noise: &mut Noise) -> Vector3<f64> {
    loop {
        let p = Vector3::from_fn(|_, _| noise.between(-1.0, 1.0)) * solid.size_m;
        if (solid.contains)(&p) {
            return p;
        }
    }
}

/// From anywhere on the surface to any HIP inside: whatever edges and corners lie between.
#[test]
fn a_slide_over_edges_ends_at_rest_within_its_bound_and_in_its_cone() {
    for solid in solids::all() {
        for law in laws() {
            let mut noise = Noise(21);
            let (mut crossed, mut most, mut unfinished) = (0, 0, 0);
            for _ in 0..5000 {
                let start = solid.form.nearest(&solid.point(noise.uniform(), noise.uniform()));
                let hip = inside(&solid, &mut noise);
                let mut cone = FrictionCone::new(start);
                let force = cone.update(&solid.form, &law, &still(hip));
                let at = cone.god_object();
                crossed += u32::from(at.piece != start.piece);
                most = most.max(force.rounds);
                unfinished += u32::from(force.rounds >= MAX_SLIDE_ROUNDS);
                assert!(solid.form.signed_distance(&at.point_B).abs() < 1e-15, "{}", solid.name);
                assert!(
                    force.force_on_user_B.dot(&at.normal_B) >= 0.0,
                    "{}: out of the material",
                    solid.name
                );
                let normal = force.normal_force_n;
                let tangential = (force.force_on_user_B - at.normal_B * normal).norm();
                let mu = match law {
                    Friction::None => 0.0,
                    Friction::Coulomb { mu } => mu,
                    _ => MU_S,
                };
                // Rounded against the force's own size.
                assert!(
                    tangential <= mu * normal + 1e-14 * K * 0.1,
                    "{} {law:?} {tangential} {normal}",
                    solid.name
                );
            }
            println!("{:20} {law:?}: crossed {crossed}, rounds {most}, unfinished {unfinished}", solid.name);
        }
    }
}
