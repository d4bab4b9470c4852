//! Contact damping: along the normal always, along the tangent while it sticks, never in slip.
#![allow(non_snake_case)]

mod common;

use common::*;
use haptics::{ContactState, Entity, Friction};
use nalgebra::{Isometry3, Vector3};

const B: f64 = 2.0;

fn damped(friction: Friction) -> Entity {
    table(friction).with_damping(B).unwrap()
}

#[test]
//= melder#6.2 type=test
fn approaching_presses_harder_and_leaving_never_pulls() {
    let mut finger = point_finger();
    let entity = damped(Friction::None);
    let mut step = |y: f64| finger.step(&[entity], &Vector3::new(0.0, y, 0.0), DT).force_on_user_W.y;
    // A difference of 1e-5 of numbers near 5e-3 (rounded to 9e-19) over dt: 1e-13 of a newton.
    let near = |force: f64, expected: f64| (force - expected).abs() < 1e-14;
    assert!(near(step(-5.00e-3), 2.5), "a first tick has no speed");
    assert!(near(step(-5.01e-3), 2.505 + B * 0.01));
    assert!(near(step(-5.00e-3), 2.5 - B * 0.01));
    assert_eq!(step(-1.0e-3), 0.0, "4 m/s away: the damper would pull with 8 N");
}

#[test]
fn the_friction_circle_follows_the_damped_normal_force() {
    let mut finger = point_finger();
    let entity = damped(Friction::coulomb(0.5).unwrap());
    let mut y = -DEPTH;
    finger.step(&[entity], &Vector3::new(0.0, y, 0.0), DT);
    for i in 1..200 {
        y -= 1e-5 * f64::from(i % 5 - 2);
        let out = finger.step(&[entity], &Vector3::new(1e-4 * f64::from(i), y, 0.0), DT);
        if out.friction == ContactState::Slip {
            // Tangential damping would show here: 2 N s/m at 0.1 m/s is 8 % of the normal force.
            assert!((ratio(&out, &Vector3::y()) - 0.5).abs() < 1e-13);
        }
    }
    assert_eq!(finger.contact(0).map(|c| c.friction.into()), Some(ContactState::Slip));
}

#[test]
//= melder#4.1 type=test
fn a_held_contact_is_damped_along_the_tangent_within_the_cone() {
    let entity = damped(stiction());
    let mut finger = point_finger();
    finger.step(&[entity], &Vector3::new(0.0, -DEPTH, 0.0), DT);
    let out = finger.step(&[entity], &Vector3::new(1e-5, -DEPTH, 0.0), DT);
    assert_eq!(out.friction, ContactState::Stick);
    assert!((out.force_on_user_W.x + K * 1e-5 + B * 0.01).abs() < 1e-14);
    // 3 m/s within the static circle: the damper alone would exceed the cone.
    let out = finger.step(&[entity], &Vector3::new(3e-3, -DEPTH, 0.0), DT);
    assert_eq!(out.friction, ContactState::Stick);
    assert!((ratio(&out, &Vector3::y()) - MU_S).abs() < 1e-14);
}

#[test]
fn riding_along_on_a_moving_entity_is_not_damped() {
    let mut entity = damped(stiction());
    let mut finger = point_finger();
    finger.step(&[entity], &Vector3::new(0.0, -DEPTH, 0.0), DT);
    for i in 1..1000 {
        let shift = Vector3::new(0.3, 0.4, -0.1) * (f64::from(i) * DT);
        entity.move_to(Isometry3::translation(shift.x, shift.y, shift.z));
        let out = finger.step(&[entity], &(shift + Vector3::new(0.0, -DEPTH, 0.0)), DT);
        // Positions of up to 0.5 m are rounded to 5.6e-17, differences over dt to 2e-13.
        assert!((out.force_on_user_W - Vector3::new(0.0, K * DEPTH, 0.0)).norm() < 2e-12);
    }
}
