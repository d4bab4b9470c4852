//! The experiments of Melder ch. 8.1: 500 N/m, 5 mm deep, mu_s = 0.7, mu_d = 0.3.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{ContactState, Finger};
use nalgebra::Vector3;
use std::f64::consts::TAU;

fn under(x: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, -DEPTH, z)
}

/// Moves the HIP from `from` to `to` in `ticks` ticks and returns the last god-object.
fn drag(finger: &mut Finger, from: Vector3<f64>, to: Vector3<f64>, ticks: i32) -> Vector3<f64> {
    let entity = table(stiction());
    let mut god_object = Vector3::zeros();
    for i in 1..=ticks {
        let hip = from + (to - from) * (f64::from(i) / f64::from(ticks));
        god_object = finger.step(std::slice::from_ref(&entity), &hip, DT).god_object_W;
    }
    god_object
}

#[test]
//= melder#4.4 type=test
fn test_1_a_full_turn_of_the_hand_during_stick_leaves_the_god_object_fixed() {
    let entity = table(stiction());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &under(0.0, 0.0), DT);
    for direction in [1.0, -1.0] {
        let start = *finger.contact(0).map(|c| &c.god_object_W).unwrap();
        let end = start + Vector3::new(0.03, -DEPTH, 0.0);
        let fixed = drag(&mut finger, start + Vector3::new(0.0, -DEPTH, 0.0), end, 300);
        assert!((end.x - fixed.x - MU_D * DEPTH).abs() < 1e-16, "slid, it lags by mu_d d");
        // Relax to a circle of 0.8 mu_d d around the god-object: stuck; then once around it, out to
        // a circle between the two coefficients, and around again.
        drag(&mut finger, end, under(fixed.x + 0.8 * MU_D * DEPTH, fixed.z), 50);
        for radius in [0.8 * MU_D * DEPTH, 0.5 * DEPTH] {
            for i in 0..=360 {
                let angle = direction * TAU * f64::from(i) / 360.0;
                let hip = under(fixed.x + radius * angle.cos(), fixed.z + radius * angle.sin());
                let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
                assert_eq!((out.god_object_W, out.friction), (fixed, ContactState::Stick));
                let towards = (fixed - hip) * K;
                // The lag is a difference of positions of up to 30 mm, each rounded to 3.5e-18.
                assert!((out.force_on_user_W - towards).norm() < K * 1e-17);
            }
        }
        let moved = drag(&mut finger, under(fixed.x, fixed.z), under(fixed.x, fixed.z + 0.01), 200);
        assert!(moved.z > fixed.z + 0.008, "and then slides on in another direction");
    }
}

/// Retarding ratio against speed of the god-object, on the ticks in contact with one before.
fn friction_curve(sigma: f64, mut visit: impl FnMut(f64, f64, ContactState)) -> usize {
    let entity = table(stiction());
    let mut finger = point_finger();
    let mut noise = Noise(81);
    let (mut before, mut touched) = (None, 0);
    for i in 0..60_000 {
        // Back and forth: speeds from zero to 0.19 m/s.
        let x = 0.03 * (TAU * f64::from(i) * DT).sin();
        let hip = under(x, 0.0) + noise.vector(sigma);
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        if out.entity.is_none() {
            before = None;
            continue;
        }
        touched += 1;
        if let Some(god_before) = before.replace(out.god_object_W) {
            let god_before: Vector3<f64> = god_before;
            visit((out.god_object_W - god_before).norm() / DT, ratio(&out, &Vector3::y()), out.friction);
        }
    }
    touched
}

#[test]
fn test_2_friction_against_speed_is_the_stiction_curve_with_and_without_noise() {
    for sigma in [0.0, 2e-3] {
        let (mut stuck, mut slid, mut above_dynamic) = (0, 0, 0);
        let touched = friction_curve(sigma, |speed, ratio, state| {
            if speed > 0.0 {
                slid += 1;
                assert_eq!(state, ContactState::Slip);
                // Rounding of positions of 30 mm (3.5e-18) over the depth; noise can leave only
                // micrometres of depth.
                assert!((ratio - MU_D).abs() < 1e-11, "sigma {sigma}: {ratio} at {speed} m/s");
            } else {
                stuck += 1;
                above_dynamic += u32::from(ratio > MU_D + 1e-9);
                let limit = if state == ContactState::Stick { MU_S } else { MU_D };
                assert!(ratio <= limit * (1.0 + 1e-11), "sigma {sigma}: {ratio} at rest");
            }
        });
        assert!(stuck > 100 && slid > 10_000 && above_dynamic > 100, "{stuck} {slid} {above_dynamic}");
        // Sigma of 2 mm at 5 mm leaves the surface when it exceeds 2.5 sigma: 0.62 %, +- 0.03 %.
        let lost = 1.0 - touched as f64 / 60_000.0;
        let expected = if sigma > 0.0 { 0.0062 } else { 0.0 };
        assert!((lost - expected).abs() < 0.0015, "{lost}");
    }
}

#[test]
fn test_3_the_god_object_does_not_drift_in_three_minutes_of_noise() {
    let entity = table(stiction());
    let mut finger = point_finger();
    let mut noise = Noise(83);
    // Slid into place and left: it starts in slip, on the dynamic circle.
    let rest = under(0.02, 0.0);
    finger.step(std::slice::from_ref(&entity), &under(0.0, 0.0), DT);
    drag(&mut finger, under(0.0, 0.0), rest, 200);
    for _ in 0..100 {
        finger.step(std::slice::from_ref(&entity), &(rest + noise.vector(2e-4)), DT);
    }
    let settled = finger.contact(0).unwrap().god_object_W;
    for _ in 0..180_000 {
        let out = finger.step(std::slice::from_ref(&entity), &(rest + noise.vector(2e-4)), DT);
        // Zero means zero. Breaking away takes 2 mm, ten sigma.
        assert_eq!((out.god_object_W, out.friction), (settled, ContactState::Stick));
    }
}

#[test]
fn test_3_holds_on_a_sphere_too() {
    let (r, rest) = (0.1, on_circle(0.095, 0.3));
    let entity = ball(r, stiction());
    let mut finger = point_finger();
    let mut noise = Noise(84);
    for i in 0..=300 {
        finger.step(std::slice::from_ref(&entity), &on_circle(0.095, f64::from(i) * 1e-3), DT);
    }
    for _ in 0..100 {
        finger.step(std::slice::from_ref(&entity), &(rest + noise.vector(2e-4)), DT);
    }
    let settled = finger.contact(0).unwrap().god_object_W;
    for _ in 0..180_000 {
        assert_eq!(
            finger.step(std::slice::from_ref(&entity), &(rest + noise.vector(2e-4)), DT).god_object_W,
            settled
        );
    }
}
