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

/// Plane, ball, box and mesh, felt by a point and by a ball from above: where the surface is (m).
fn below() -> Vec<(haptics::Entity, f64)> {
    let plate = haptics::mesh::make::cuboid([0.1; 3]);
    let mesh = std::sync::Arc::new(haptics::mesh::Mesh::build(plate).unwrap().0);
    let of = |shape: haptics::Shape| haptics::Entity::new(shape, Isometry3::identity(), K).unwrap();
    vec![
        (table(Friction::None), 0.0),
        (of(haptics::Sphere::new(0.05).unwrap().into()), 0.05),
        (of(haptics::Cuboid::new([0.1; 3]).unwrap().into()), 0.05),
        (of(mesh.into()), 0.05),
    ]
}

#[test]
fn a_contact_that_is_shortened_goes_on_from_there_and_gives_back_what_it_took_from_there() {
    for (entity, top) in below() {
        for radius in [0.0, 2e-3] {
            let mut finger = Finger::new(radius, 1).unwrap();
            let force_at = |finger: &mut Finger, depth: f64| {
                let hip = Vector3::new(0.0, top + radius - depth, 0.0);
                finger.step(std::slice::from_ref(&entity), &hip, DT).force_on_user_W.y
            };
            force_at(&mut finger, -1e-3);
            let full = force_at(&mut finger, DEPTH);
            assert!((full - K * DEPTH).abs() < 1e-6 * full, "{full}");
            // More than there is changes nothing.
            finger.shorten(0, 2.0 * full);
            assert_eq!(force_at(&mut finger, DEPTH), full);
            finger.shorten(0, 0.25 * full);
            for (depth, share) in
                [(1.0, 0.25), (1.1, 0.35), (0.9, 0.15), (0.7, 0.0), (0.5, 0.0), (0.6, 0.1), (0.2, 0.0)]
            {
                let force = force_at(&mut finger, depth * DEPTH);
                // What balls on meshes and forms resolve.
                assert!((force - share * full).abs() < 1e-5 * full, "{depth}: {force} of {full}, {radius}");
            }
            // Outside all is forgotten.
            assert_eq!(force_at(&mut finger, -1e-3), 0.0);
            assert!((force_at(&mut finger, DEPTH) - full).abs() < 1e-6 * full);
        }
    }
}
