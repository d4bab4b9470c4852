//! The laws of friction know no direction, no handedness and no size.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{
    Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Entity, FingerOutput, Form, Friction, Plane, Scaled, Sphere,
    Torus,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Every model for lengths and speeds `s` times as large; forces grow by the same factor.
fn laws(s: f64) -> Vec<(&'static str, Friction)> {
    let curve = [(0.0, MU_S), (0.02 * s, 0.4), (0.1 * s, MU_D), (1.0 * s, 0.5)];
    vec![
        ("none", Friction::None),
        ("coulomb", Friction::coulomb(MU_S).unwrap()),
        ("stiction", Friction::stiction(MU_S, MU_D).unwrap()),
        ("viscous", Friction::viscous(0.5 / s).unwrap()),
        ("coulomb-viscous", Friction::coulomb_viscous(MU_S, 0.5 / s).unwrap()),
        ("stribeck", Friction::stribeck(MU_S, MU_D, 0.05 * s, 0.125 / s).unwrap()),
        ("curve", Friction::curve(MU_S, &curve).unwrap()),
        ("karnopp", Friction::karnopp(MU_S, MU_D, 0.02 * s, 0.125 / s).unwrap()),
        ("dahl", Friction::dahl(MU_S).unwrap()),
        ("hayward-armstrong", Friction::hayward_armstrong(MU_S / 0.9, 0.9).unwrap()),
        ("lugre", Friction::lugre(MU_S, MU_D, 0.05 * s, 0.125 / s, 0.5).unwrap()),
        ("bristle", Friction::bristle(MU_S, 20, 1).unwrap()),
        ("reset integrator", Friction::reset_integrator(MU_S, MU_D, 1.0).unwrap()),
        ("fixed cone", Friction::fixed_cone(0.75 * s, Some(1.75 * s)).unwrap()),
    ]
}

fn forms(s: f64) -> Vec<(&'static str, Form)> {
    vec![
        ("plane", Plane::new(Vector3::y(), 0.03 * s).unwrap().into()),
        ("sphere", Sphere::new(0.05 * s).unwrap().into()),
        ("box", Cuboid::new([0.1 * s, 0.04 * s, 0.06 * s]).unwrap().into()),
        ("cylinder", Cylinder::new(0.03 * s, 0.08 * s).unwrap().into()),
        ("cone", Cone::new(0.04 * s, 0.015 * s, 0.07 * s).unwrap().into()),
        ("capsule", Capsule::new(0.02 * s, 0.05 * s).unwrap().into()),
        ("torus", Torus::new(0.05 * s, 0.015 * s).unwrap().into()),
        ("ellipsoid", Ellipsoid::new([0.06 * s, 0.03 * s, 0.02 * s]).unwrap().into()),
        (
            "elliptic cylinder",
            Scaled::new(Cylinder::new(0.03 * s, 0.08 * s).unwrap().into(), [1.4, 1.0, 0.7]).unwrap(),
        ),
        (
            "scaled torus",
            Scaled::new(Torus::new(0.05 * s, 0.015 * s).unwrap().into(), [1.2, 1.5, 0.9]).unwrap(),
        ),
    ]
}

/// From place to place about the origin, now inside a form, now outside.
fn path(seed: u64) -> Vec<Vector3<f64>> {
    let mut noise = Noise(seed);
    let (mut hip, mut target) = (Vector3::new(0.0, 0.1, 0.0), Vector3::zeros());
    (0..4000)
        .map(|tick| {
            if tick % 50 == 0 {
                target = noise.vector(0.03);
            }
            hip += (target - hip) * 0.05;
            hip
        })
        .collect()
}

fn run(entity: Entity, radius_m: f64, hips: impl Iterator<Item = Vector3<f64>>) -> Vec<FingerOutput> {
    let mut finger = finger(radius_m);
    let entity = [entity.with_damping(0.5).unwrap()];
    hips.map(|hip| finger.step(&entity, &hip, DT)).collect()
}

/// What every model makes of a walk on every form, as a point and as a ball, next to what it makes of another walk.
fn each_pair(
    s: f64,
    other: impl Fn(Form, Friction, &[Vector3<f64>], f64) -> Option<Vec<FingerOutput>>,
    mut look: impl FnMut(&str, &FingerOutput, &FingerOutput),
) {
    let hips = path(3);
    for ((name, law), (_, like)) in laws(1.0).into_iter().zip(laws(s)) {
        for ((shape, form), (_, likewise)) in forms(1.0).into_iter().zip(forms(s)) {
            for radius_m in [0.0, 0.004] {
                let Some(others) = other(likewise, like.clone(), &hips, radius_m) else { continue };
                let ones = run(entity(form, law.clone()), radius_m, hips.iter().copied());
                for (one, other) in ones.iter().zip(&others) {
                    look(&format!("{name} on {shape}, radius {radius_m}"), one, other);
                }
            }
        }
    }
}

#[test]
fn twice_as_large_and_as_fast_every_force_is_twice_as_large_to_the_last_bit() {
    // Powers of two only change exponents: any length hidden in the code would show.
    for s in [0.25, 1024.0] {
        each_pair(
            s,
            |form, law, hips, radius_m| {
                Some(run(entity(form, law), radius_m * s, hips.iter().map(|hip| hip * s)))
            },
            |case, one, other| {
                assert_eq!(one.force_on_user_W * s, other.force_on_user_W, "{case}, {s}");
                assert_eq!(one.friction, other.friction, "{case}, {s}");
            },
        );
    }
}

#[test]
fn seen_in_a_mirror_every_force_is_mirrored_to_the_last_bit() {
    for axis in 0..3 {
        let mirrored = |mut v: Vector3<f64>| {
            v[axis] = -v[axis];
            v
        };
        each_pair(
            1.0,
            |form, law, hips, radius_m| {
                let has_no_mirror = axis == 1 && matches!(form, Form::Plane(_) | Form::Cone(_));
                let run = || run(entity(form, law), radius_m, hips.iter().copied().map(mirrored));
                (!has_no_mirror).then(run)
            },
            |case, one, other| {
                assert_eq!(mirrored(one.force_on_user_W), other.force_on_user_W, "{case}, axis {axis}");
            },
        );
    }
}

#[test]
fn with_the_whole_scene_turned_every_force_is_turned() {
    let rotation = UnitQuaternion::from_euler_angles(0.3, 1.1, -2.0);
    let pose = Isometry3::from_parts(Vector3::new(0.3, -0.2, 0.5).into(), rotation);
    each_pair(
        1.0,
        |form, law, hips, radius_m| {
            let turned = Entity::new(form, pose, K).unwrap().with_friction(law).unwrap();
            Some(run(turned, radius_m, hips.iter().map(|hip| pose.transform_point(&(*hip).into()).coords)))
        },
        |case, one, other| {
            // Positions of 0.6 m are rounded by 1e-16 m; the damper divides that by the tick, and what has slid over
            // edges remembers it some thousand times as large.
            let difference_n = (rotation * one.force_on_user_W - other.force_on_user_W).norm();
            assert!(difference_n <= 1e-7, "{case}: {difference_n} N");
        },
    );
}
