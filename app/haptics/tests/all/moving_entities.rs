//! Entities that move: contact begins by the sweep relative to the entity.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{ContactState, Entity, Finger, Friction, Plane};
use nalgebra::{Isometry3, Vector3};

/// A wall that faces +x and moves from -x over a finger resting at the origin.
fn sweep(finger: &mut Finger, law: Friction) -> Option<haptics::FingerOutput> {
    let mut wall = entity(Plane::new(Vector3::x(), 0.0).unwrap(), law);
    wall.move_to(Isometry3::translation(-0.02, 0.0, 0.0));
    wall.move_to(wall.X_WB);
    let mut first = None;
    for i in -19..=3 {
        // 5 m/s, with a slip along the wall's plane of 1 m/s.
        wall.move_to(Isometry3::translation(f64::from(i) * 5e-3 + 2e-3, f64::from(i) * 1e-3, 0.0));
        let out = finger.step(std::slice::from_ref(&wall), &Vector3::zeros(), DT);
        if out.entity.is_some() {
            first = first.or(Some(out));
        }
    }
    first
}

#[test]
fn a_wall_that_sweeps_over_a_resting_finger_is_felt_from_where_it_met_it() {
    let first = sweep(&mut point_finger(), Friction::coulomb(2.0).unwrap()).unwrap();
    assert!((first.force_on_user_W.x - K * 2e-3).abs() < 1e-12, "2 mm past the finger");
    // It came 5 mm in the tick and met the finger after 3: since then the wall carried the
    // god-object 2/5 of its 1 mm sideways motion along. Through the current pose alone the finger
    // would seem to have been inside already, and the god-object would lie straight above it.
    let expected = Vector3::new(2e-3, 0.4e-3, 0.0);
    // Positions of 0.1 m rounded twice.
    assert!((first.god_object_W - expected).norm() < 1e-16, "{}", first.god_object_W);
    assert_eq!(first.friction, ContactState::Stick);
}

#[test]
fn a_ball_that_lands_on_a_resting_finger_is_felt_at_its_near_side() {
    let mut ball = ball(0.02, Friction::coulomb(1.0).unwrap());
    ball.move_to(Isometry3::translation(0.0, 0.05, 0.0));
    ball.move_to(ball.X_WB);
    let mut finger = point_finger();
    let mut out = finger.step(std::slice::from_ref(&ball), &Vector3::zeros(), DT);
    assert_eq!(out.entity, None);
    // One tick moves it beyond the finger's middle: the nearest point would be its far side.
    ball.move_to(Isometry3::translation(0.0, -0.005, 0.0));
    out = finger.step(std::slice::from_ref(&ball), &Vector3::zeros(), DT);
    assert!((out.god_object_W - Vector3::new(0.0, -0.025, 0.0)).norm() < 1e-17);
    assert!(out.force_on_user_W.y < 0.0, "it pushes the finger ahead, downward");
}

#[test]
fn a_held_god_object_travels_with_its_entity() {
    let mut table = table(stiction());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&table), &Vector3::new(0.01, -DEPTH, 0.0), DT);
    let on_table = Vector3::new(0.01, 0.0, 0.0);
    for i in 1..1000 {
        let angle = f64::from(i) * 1e-3;
        table.move_to(Isometry3::new(Vector3::new(0.0, 0.1 * angle, 0.0), Vector3::z() * angle));
        let hip = table.X_WB * nalgebra::Point3::new(0.01, -DEPTH, 0.0);
        let out = finger.step(std::slice::from_ref(&table), &hip.coords, DT);
        let expected = table.X_WB * nalgebra::Point3::from(on_table);
        // A rotation there and back of positions of 0.1 m.
        assert!((out.god_object_W - expected.coords).norm() < 1e-16);
        assert_eq!(out.friction, ContactState::Stick);
    }
}

#[test]
fn an_entity_placed_over_the_finger_pushes_it_to_the_nearest_surface() {
    let mut finger = point_finger();
    let law = Friction::coulomb(1.0).unwrap();
    finger.step(&[], &Vector3::new(0.0, -0.001, 0.0), DT);
    let out = finger.step(&[table(law)], &Vector3::new(0.0, -0.001, 0.0), DT);
    assert_eq!(out.god_object_W, Vector3::zeros());
}

#[test]
fn forgetting_and_resetting_begin_contact_anew() {
    let law = Friction::coulomb(1.0).unwrap();
    let place = |x: f64| Vector3::new(x, -DEPTH, 0.0);
    let entities: [Entity; 1] = [table(law)];
    for forget in [Finger::reset as fn(&mut Finger), |finger| finger.forget(0)] {
        let mut finger = point_finger();
        finger.step(&entities, &place(0.0), DT);
        assert_eq!(finger.step(&entities, &place(1e-3), DT).god_object_W.x, 0.0);
        forget(&mut finger);
        assert_eq!(finger.step(&entities, &place(1e-3), DT).god_object_W.x, 1e-3);
    }
}
