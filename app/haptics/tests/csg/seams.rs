//! Seams where solids are joined: smoothly, as caps and fillets are, and across each other.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::common::*;

use crate::trees::{ball, touchable, v};
use haptics::{Capsule, CsgPart, CsgTree, Cylinder, Entity, Finger, FingerOutput, Friction};
use nalgebra::Vector3;

const RADIUS_M: f64 = 0.03;
const HALF_M: f64 = 0.04;

fn step(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

/// A cylinder with two balls for caps.
fn capped(larger: f64) -> CsgTree {
    CsgTree::union([
        CsgPart::from(Cylinder::new(RADIUS_M, 2.0 * HALF_M).unwrap()),
        CsgPart::at(ball(RADIUS_M * (1.0 + larger)), v(0.0, HALF_M, 0.0)),
        CsgPart::at(ball(RADIUS_M * (1.0 + larger)), v(0.0, -HALF_M, 0.0)),
    ])
}

/// Down to a depth at the side, obliquely over the seam to the pole, and back another way.
fn oblique(angle: f64, depth_m: f64, turns: f64, ticks: u32) -> impl Iterator<Item = Vector3<f64>> {
    let inner_m = RADIUS_M - depth_m;
    (0..ticks).map(move |tick| {
        let t = f64::from(tick) / f64::from(ticks);
        let around = angle + turns * t;
        let press_m = 2e-3 * (1.0 - 40.0 * t).max(-0.05).max(-depth_m);
        let up = 0.04 * (TAU * t).sin().powi(3) + (HALF_M - 0.003) * (1.0 - (-20.0 * t).exp());
        let beyond = (up - HALF_M).max(0.0) / inner_m;
        let tilt = beyond.min(FRAC_PI_2);
        let rho = (inner_m + press_m.max(0.0)) * tilt.cos();
        v(rho * around.cos(), up.min(HALF_M) + inner_m * tilt.sin(), rho * around.sin())
    })
}

/// How many of the paths end up elsewhere than on the capsule, and the largest difference of forces (N).
fn differing(friction: &Friction, larger: f64, tolerance_n: f64) -> (u32, f64) {
    let joined = touchable(&capped(larger), friction.clone());
    let closed = entity(Capsule::new(RADIUS_M, 2.0 * HALF_M).unwrap(), friction.clone());
    let (mut differing, mut worst_n) = (0, 0.0f64);
    for i in 0..108 {
        let (angle, depth_m) = (0.37 * f64::from(i), [1e-3, 3e-3, 8e-3][i as usize % 3]);
        let turns = [0.3, -0.8, 2.0, 0.0][i as usize / 3 % 4];
        let (mut a, mut b) = (point_finger(), point_finger());
        let mut off_n = 0.0f64;
        for hip in oblique(angle, depth_m, turns, 700) {
            let (here, there) = (step(&mut a, &joined, &hip), step(&mut b, &closed, &hip));
            off_n = off_n.max((here.force_on_user_W - there.force_on_user_W).norm());
        }
        worst_n = worst_n.max(off_n);
        differing += u32::from(off_n > tolerance_n);
    }
    (differing, worst_n)
}

#[test]
fn a_cylinder_with_two_caps_feels_as_a_capsule() {
    // Without friction slides end within 1e-12 of the load. With it the god-object stops at the seam and looks anew which way
    // it is drawn: to second order of a tick's 0.4 mm, over the radius, times K.
    let second_order_n = K * (4e-4_f64).powi(2) / RADIUS_M;
    for (friction, tolerance_n) in [
        (Friction::None, 1e-9),
        (Friction::coulomb(0.3).unwrap(), second_order_n),
        (stiction(), second_order_n),
    ] {
        let (count, worst_n) = differing(&friction, 0.0, tolerance_n);
        println!("{friction:?}: {count} of 108 differ, {worst_n} N");
        assert_eq!(count, 0, "{friction:?} {worst_n}");
    }
}

/// Balls that are a little larger or smaller than the cylinder: a crease or a ledge that nobody can feel, and forces that differ by
/// no more than the radius does.
#[test]
fn caps_that_fit_all_but_exactly_feel_as_a_capsule() {
    for exponent in [-16, -14, -13, -12, -11, -10, -9, -8] {
        for sign in [1.0, -1.0] {
            let larger = sign * 10f64.powi(exponent);
            let (count, worst_n) =
                differing(&Friction::None, larger, 1e-9 + 2.0 * K * larger.abs() * RADIUS_M);
            println!("{larger}: {count} of 108 differ, {worst_n} N");
            assert_eq!(count, 0, "{larger} {worst_n}");
        }
    }
}
