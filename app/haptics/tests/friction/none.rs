//! With both coefficients zero the algorithm is the classic god-object (Melder ch. 8.1).

use crate::common::*;
use haptics::{ContactState, Friction, Plane, Shape, Sphere};
use nalgebra::Vector3;

const LAWS: [Friction; 4] = [
    Friction::None,
    Friction::Coulomb { mu: 0.0 },
    Friction::Stiction { mu_s: 0.0, mu_d: 0.0 },
    Friction::Viscous { mu_v_s_per_m: 0.0 },
];

fn bits(v: &Vector3<f64>) -> [u64; 3] {
    [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()]
}

/// A noisy walk that enters, stays and leaves.
fn walk(seed: u64, size: f64) -> impl Iterator<Item = Vector3<f64>> {
    let mut noise = Noise(seed);
    let mut hip = Vector3::zeros();
    (0..50_000).map(move |i| {
        hip = hip * 0.999 + noise.vector(0.02 * size);
        // Some ticks only go deeper, some do not move at all.
        if i % 7 == 0 { hip } else { hip + Vector3::y() * (1e-3 * size * f64::from(i % 3)) }
    })
}

#[test]
fn on_planes_it_is_the_classic_god_object_bit_for_bit() {
    let mut noise = Noise(5);
    for i in 0..8 {
        let (normal, offset) =
            if i == 0 { (Vector3::y(), 0.0) } else { (noise.vector(1.0), 0.02 * noise.gaussian()) };
        let shape = Shape::from(Plane::new(normal, offset).unwrap());
        for law in LAWS {
            let mut finger = point_finger();
            let mut touched = 0;
            for hip in walk(i, 0.1) {
                let out = finger.step(&[entity(shape.clone(), law.clone())], &hip, DT);
                let classic = closed_form_god_object(&shape, &hip);
                assert_eq!(out.entity.is_some(), classic.is_some());
                assert_eq!(bits(&out.god_object_W), bits(&classic.unwrap_or(hip)));
                assert_ne!(out.friction, ContactState::Stick);
                touched += u32::from(classic.is_some());
            }
            assert!(touched > 1000, "{touched}");
        }
    }
}

#[test]
fn on_a_sphere_it_is_the_classic_god_object_to_the_tolerance_of_the_slide() {
    let r = 0.1;
    let shape = Shape::from(Sphere::new(r).unwrap());
    for law in LAWS {
        let mut finger = point_finger();
        let mut compared = 0;
        for hip in walk(6, 0.1) {
            let out = finger.step(&[entity(shape.clone(), law.clone())], &hip, DT);
            let classic = closed_form_god_object(&shape, &hip);
            assert_eq!(out.entity.is_some(), classic.is_some());
            let Some(classic) = classic else { continue };
            compared += 1;
            // Rest is a gap rho sin(phi) below 1e-12 d + 4 ulp of r, and d < r here.
            let (rho, d) = (hip.norm(), r - hip.norm());
            let tolerance = (1e-12 * d + 4.0 * f64::EPSILON * r) * r / rho + 1e-16;
            let off = (out.god_object_W - classic).norm();
            assert!(off <= tolerance, "rho {rho}: off by {off}");
        }
        assert!(compared > 10_000);
    }
}

#[test]
fn pressing_straight_down_it_is_the_classic_god_object_bit_for_bit_too() {
    // The gap stays exactly zero, but the foot of the perpendicular is rounded anew each tick.
    let shape = Shape::from(Plane::new(Vector3::y(), 0.1).unwrap());
    let mut finger = point_finger();
    for i in 0..1000 {
        let hip = Vector3::new(0.3, -1e-3 * f64::from(i), 0.2);
        let out = finger.step(&[entity(shape.clone(), Friction::None)], &hip, DT);
        assert_eq!(bits(&out.god_object_W), bits(&closed_form_god_object(&shape, &hip).unwrap()));
    }
}
