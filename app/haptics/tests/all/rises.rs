//! Fingers that roam in and about every surface: no tick's force rises by more than the hand's way explains.
//!
//! A spring's force is the stiffness times the god-object's lag, and a god-object only ever shortens that. To the hand's way
//! come the ramps: of a contact that began inside, and of a god-object that came to rest later than in its own tick.
#![allow(non_snake_case)]

use std::slice::from_ref;

use crate::common::*;
use crate::relative_motion::surfaces;
use haptics::{Entity, Finger, Friction, RAMP_IN_S};
use meshes::Roaming;

/// Resolution of walks over surfaces: less is not counted as a leap.
const SLACK_M: f64 = 1e-6;

/// Ticks with a force.
fn roam(name: &str, entity: &Entity, radius_m: f64, mut roaming: Roaming, ticks: u32) -> u32 {
    let mut finger = Finger::new(radius_m, 4).unwrap();
    let (mut last_hip, mut last_n, mut touched) = (roaming.hip, 0.0, 0);
    for tick in 0..ticks {
        let hip = roaming.next();
        let out = finger.step(from_ref(entity), &hip, DT);
        let force_n = out.force_on_user_W.norm();
        let (way_m, lag_m) = ((hip - last_hip).norm(), (out.god_object_W - hip).norm());
        let most_n = last_n + K * (way_m + 2.0 * lag_m * DT / RAMP_IN_S);
        assert!(
            force_n <= most_n * (1.0 + 1e-9) + K * SLACK_M,
            "{name}, {radius_m} m, {:?}, tick {tick}, {hip:?}: {force_n} N, explained {most_n} N",
            entity.friction
        );
        touched += u32::from(force_n > 0.0);
        (last_hip, last_n) = (hip, force_n);
    }
    touched
}

/// Small and large balls, slow and fast hands.
fn roam_all_surfaces(ticks: u32) {
    for (number, (name, plain, half_width_m)) in surfaces().into_iter().enumerate() {
        for radius_m in [0.0, 0.01, 0.05, 0.3].map(|part| part * half_width_m) {
            for friction in [Friction::None, stiction()] {
                let entity = plain.clone().with_friction(friction).unwrap().prepared_for(radius_m);
                if !entity.is_felt_by(radius_m) {
                    continue;
                }
                for pace in [0.002, 0.02, 0.1] {
                    let roaming = Roaming::new(number as u64, half_width_m, pace * half_width_m);
                    let touched = roam(&name, &entity, radius_m, roaming, ticks);
                    assert!(touched > 0 || pace < 0.01, "{name}, {radius_m} m");
                }
            }
        }
    }
}

#[test]
fn no_tick_in_any_surface_adds_more_force_than_the_hands_way() {
    roam_all_surfaces(500);
}

/// A hundred million ticks.
#[test]
#[ignore = "a quarter of an hour"]
fn no_tick_of_a_hundred_million_adds_more_force_than_the_hands_way() {
    roam_all_surfaces(150_000);
}
