//! A finger at rest on a mesh feels rest: nothing chatters, nothing jumps, nothing drifts.
//!
//! A day of noise, 86.4 million ticks, takes half a minute to some minutes:
//! `cargo test --release -p haptics --test all mesh_rest:: -- --ignored`.
#![allow(non_snake_case)]

use crate::common;

use common::laws::drift_free;
use common::meshes::*;
use common::*;
use haptics::mesh::{Mesh, make};
use haptics::{Feature, Friction};
use nalgebra::Vector3;
use std::sync::Arc;

/// A step of a desktop device's encoder at the finger \[m\].
const ENCODER_STEP_M: f64 = 3e-5;

fn every_law() -> Vec<(&'static str, Friction)> {
    let mut laws = vec![("none", Friction::None), ("viscous", Friction::viscous(0.2).unwrap())];
    laws.extend(drift_free());
    laws
}

/// Laws that know neither speed nor the past: at rest from the first tick on. The others' slides shrink tick by tick,
/// viscous ones' by c / (1 + c) with c = mu_v d / dt = 50 at a depth of 0.1 m.
fn rests_at_once(name: &str) -> bool {
    ["none", "coulomb", "stiction", "fixed cone"].contains(&name)
}

fn meshes() -> Vec<(&'static str, Arc<Mesh>)> {
    let bottle = built(make::klein_bottle(64, 32, 0.1));
    vec![("cube", cube()), ("star", star()), ("bumpy", bumpy_sphere(100)), ("bottle", bottle)]
}

#[test]
fn a_finger_that_stays_feels_the_very_same_from_the_second_tick_on() {
    for (name, mesh) in meshes() {
        for (law, friction) in every_law() {
            let entity = touchable(&mesh, friction);
            let mut roaming = Roaming::new(5, 0.08, 1e-3);
            let mut finger = point_finger();
            let mut stays = 0;
            for tick in 0..20_000 {
                let hip = roaming.next();
                let mut before = step(&mut finger, &entity, &hip);
                if before.entity.is_none() || tick % if rests_at_once(law) { 10 } else { 400 } != 0 {
                    continue;
                }
                stays += 1;
                let settling = if rests_at_once(law) { 1 } else { 3000 };
                for _ in 0..settling {
                    before = step(&mut finger, &entity, &hip);
                }
                for _ in 0..3 {
                    let out = step(&mut finger, &entity, &hip);
                    // Some roundings of 0.1 m, times 500 N/m, and what is left of a viscous slide.
                    let moved = (out.god_object_W - before.god_object_W).norm();
                    let turned = (out.force_on_user_W - before.force_on_user_W).norm();
                    assert!(moved < 1e-12 && turned < 1e-9, "{name}, {law}: {hip:?}, {before:?}, {out:?}");
                    assert_eq!(out.entity, before.entity);
                }
            }
            assert!(stays > 5, "{name}, {law}: {stays}");
        }
    }
}

#[test]
fn encoder_noise_beside_an_edge_does_not_make_the_god_object_jump() {
    // Under a convex edge the foot leaves its face only where the HIP leaves the material; under a concave edge and
    // on flat sides the nearest point moves no further than the HIP does.
    let mut noise = Noise(6);
    for (name, mesh, at, feature) in [
        ("diagonal of a cube's side", cube(), Vector3::new(0.02, 0.045, 0.02), Feature::Face),
        ("convex edge", cube(), Vector3::new(0.0496, 0.045, 0.01), Feature::Face),
        ("under the bisector", cube(), Vector3::new(0.045, 0.045, 0.01), Feature::Face),
        ("concave edge", built(wedge(270.0)), Vector3::new(0.0, -0.005, 0.01), Feature::Edge),
        ("beside a concave edge", built(wedge(270.0)), Vector3::new(0.005, 0.0049, 0.01), Feature::Face),
    ] {
        let entity = touchable(&mesh, Friction::None);
        let mut finger = point_finger();
        // In through the top.
        let mut last_hip = at + Vector3::y() * 0.2;
        step(&mut finger, &entity, &last_hip);
        let mut last = step(&mut finger, &entity, &at);
        let mut largest = 0.0_f64;
        for tick in 0..20_000 {
            let count = |x: f64| (x * 3.0 - 1.5).round() * ENCODER_STEP_M;
            let hip = at + Vector3::from_fn(|_, _| count(noise.uniform()));
            let out = step(&mut finger, &entity, &hip);
            assert_eq!((out.entity, out.feature), (Some(0), feature), "{name}, tick {tick}: {hip:?}");
            let (moved, by) = ((out.god_object_W - last.god_object_W).norm(), (hip - last_hip).norm());
            if tick > 0 {
                assert!(
                    moved <= by + 1e-15,
                    "{name}, tick {tick}: {hip:?} moved it by {moved}, itself by {by}"
                );
                largest = largest.max(moved);
            }
            (last, last_hip) = (out, hip);
        }
        assert!(largest > ENCODER_STEP_M / 2.0, "{name}: it does follow, {largest}");
    }
}

/// How far a held god-object has gone from where it was first held, in so many ticks of noise \[m\].
fn drift_m(mesh: &Arc<Mesh>, friction: Friction, ticks: u64) -> f64 {
    let entity = touchable(mesh, friction);
    let mut finger = point_finger();
    let mut noise = Noise(7);
    // 5 mm deep, and noise of 0.2 mm, as in chapter 8.1: the cone of 0.7 is 3.5 mm wide.
    let middle = Vector3::new(0.3, 1.0, 0.2).normalize() * 0.093;
    let mut finger_at = |hip: &Vector3<f64>| step(&mut finger, &entity, hip).god_object_W;
    finger_at(&(middle * 1.5));
    let held = finger_at(&middle);
    let mut last = held;
    for _ in 0..ticks {
        last = finger_at(&(middle + noise.vector(2e-4)));
    }
    (last - held).norm()
}

#[test]
fn under_noise_for_three_minutes_a_held_god_object_does_not_drift() {
    for mesh in [uv_sphere(100), bumpy_sphere(316)] {
        assert_eq!(drift_m(&mesh, stiction(), 180_000), 0.0, "held is held");
    }
}

#[test]
fn under_noise_no_law_that_holds_lets_its_god_object_drift_on_a_mesh() {
    let mesh = bumpy_sphere(316);
    for (law, friction) in drift_free() {
        assert_eq!(drift_m(&mesh, friction, 20_000), 0.0, "{law}");
    }
}

#[test]
#[ignore = "a simulated day"]
fn under_noise_for_a_day_a_held_god_object_does_not_drift() {
    let start = std::time::Instant::now();
    assert_eq!(drift_m(&bumpy_sphere(316), stiction(), 86_400_000), 0.0, "held is held");
    println!("a day in {:.0} s", start.elapsed().as_secs_f64());
}
