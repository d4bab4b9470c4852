//! A god-object that leaps: the force follows what the finger has moved, and the leap is told.
#![allow(non_snake_case)]

use std::slice::from_ref;

use crate::common::*;
use haptics::{
    Algorithm, ContactAlgorithm, ContactMemory, Cuboid, Finger, Friction, LuGre, Stribeck, SurfacePoint,
    Touch, TouchInput,
};
use nalgebra::Vector3;

/// The frictionless god-object, but that right of x = 0 it is far above the surface.
#[derive(Debug)]
struct Leaping;

const FAR_M: f64 = 0.3;

impl ContactAlgorithm for Leaping {
    fn touch(&self, input: &TouchInput<'_>, _memory: &mut ContactMemory) -> Option<Touch> {
        if !input.is_inside() {
            return None;
        }
        let at = input.nearest()?;
        let above_m = if input.cone.hip_B.x > 0.0 { FAR_M } else { 0.0 };
        let god_object = SurfacePoint { point_B: at.point_B + at.normal_B * above_m, ..at };
        Some(Touch::frictionless(god_object, above_m - input.cone.hip_B.y, &input.cone))
    }
}

#[test]
fn the_force_of_a_god_object_that_leaps_follows_the_way_of_the_hand_and_the_leap_is_told_once() {
    const STEP_M: f64 = 1e-4;
    const DEPTH_M: f64 = 2e-3;
    let leaping = table(Friction::None).with_algorithm(Algorithm::own(Leaping));
    let mut finger = Finger::new(0.0, 1).unwrap();
    // Down, to the right and back, and up.
    let down = (0..40).map(|i| (-0.01, 2e-3 - f64::from(i) * STEP_M));
    let there = (0..200).map(|i| (-0.01 + f64::from(i) * STEP_M, -DEPTH_M));
    let back = (0..200).map(|i| (0.01 - f64::from(i) * STEP_M, -DEPTH_M));
    let (mut last_n, mut last, mut leaps, mut most_n) = (0.0, Vector3::new(-0.01, 3e-3, 0.0), 0, 0.0f64);
    for (tick, (x, y)) in down.chain(there).chain(back).enumerate() {
        let hip = Vector3::new(x, y, 0.0);
        let force_n = finger.step(from_ref(&leaping), &hip, DT).force_on_user_W.norm();
        let rise_n = force_n - last_n;
        assert!(rise_n <= K * (hip - last).norm() + 1e-9, "tick {tick}: {rise_n} N");
        leaps += u32::from(finger.contact(0).is_some_and(|contact| contact.leapt));
        // Where it does not leap, all of it is felt.
        if x < -STEP_M {
            assert!((force_n - K * (-y).max(0.0)).abs() < 1e-9, "tick {tick}: {force_n} N");
        }
        (last_n, last, most_n) = (force_n, hip, most_n.max(force_n));
    }
    // What the hand moved on the right: 0.02 m there and back. The leap itself would be 150 N.
    assert!(most_n > K * DEPTH_M && most_n <= K * (DEPTH_M + 0.0203), "{most_n} N");
    assert_eq!(leaps, 1);
}

/// Laws that drag explain what they drag, along the surface and where friction is rendered; no flip of a baseline.
#[test]
fn friction_that_drags_explains_no_leap_of_a_baseline_without_friction() {
    let lugre = LuGre::new(Stribeck::new(0.7, 0.3, 0.01, 0.0).unwrap(), 1.0).unwrap();
    let body = entity(Cuboid::new([0.1, 0.05, 0.1]).unwrap(), Friction::LuGre(lugre))
        .with_algorithm(Algorithm::VectorField);
    let mut finger = point_finger();
    let mut flips = 0;
    let mut last = Vector3::zeros();
    for tick in 0..1400 {
        let hip = Vector3::new(0.011, 0.03 - 5e-5 * f64::from(tick), 0.003);
        let force = finger.step(from_ref(&body), &hip, DT).force_on_user_W;
        if let Some(contact) = finger.contact(0).filter(|_| force.dot(&last) < 0.0) {
            assert!(contact.explained_n < 1.0, "{contact:?}");
            flips += 1;
        }
        last = force;
    }
    assert_eq!(flips, 1);
}
