//! A contact that begins inside, and one that the HIP was pressed right through.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Finger, Friction, RAMP_IN_S};
use nalgebra::{Isometry3, Vector3};

#[test]
fn a_finger_that_starts_inside_is_pushed_out_by_a_force_that_ramps_in() {
    let floor = [table(Friction::None)];
    let mut finger = Finger::new(0.0, 1).unwrap();
    let hip = Vector3::new(0.0, -DEPTH, 0.0);
    let ticks = (RAMP_IN_S / DT).round() as u32;
    for tick in 1..=ticks + 10 {
        let force = finger.step(&floor, &hip, DT).force_on_user_W.y;
        let strength = (f64::from(tick) * DT / RAMP_IN_S).min(1.0);
        // A sum of a hundred steps of 0.01, each rounded.
        assert!((force - strength * K * DEPTH).abs() < 1e-13, "tick {tick}: {force}");
    }
}

#[test]
fn a_finger_that_comes_in_from_outside_feels_all_of_it_at_once() {
    let floor = [table(Friction::None)];
    let mut finger = Finger::new(0.0, 1).unwrap();
    finger.step(&floor, &Vector3::new(0.0, 1e-3, 0.0), DT);
    assert_eq!(finger.step(&floor, &Vector3::new(0.0, -DEPTH, 0.0), DT).force_on_user_W.y, K * DEPTH);
}

#[test]
fn an_entity_placed_over_a_finger_ramps_in_and_its_next_visit_does_not() {
    let mut floor = table(Friction::None);
    let mut finger = Finger::new(0.0, 1).unwrap();
    let hip = Vector3::new(0.0, -DEPTH, 0.0);
    // Below the finger, then put over it: both poses change, as for an entity that appears.
    let below = Isometry3::translation(0.0, -1.0, 0.0);
    (floor.X_WB, floor.previous_X_WB) = (below, below);
    assert_eq!(finger.step(std::slice::from_ref(&floor), &hip, DT).entity, None);
    (floor.X_WB, floor.previous_X_WB) = (Isometry3::identity(), Isometry3::identity());
    assert!(finger.step(std::slice::from_ref(&floor), &hip, DT).force_on_user_W.y < 0.02 * K * DEPTH);
    finger.step(std::slice::from_ref(&floor), &Vector3::new(0.0, 1e-3, 0.0), DT);
    assert_eq!(finger.step(&[floor], &hip, DT).force_on_user_W.y, K * DEPTH);
}
