//! Contact damping: along the normal always, along the tangent while it sticks, never in slip.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{ContactState, Entity, Friction, Hip};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

const B: f64 = 2.0;

fn damped(friction: Friction) -> Entity {
    table(friction).with_damping(B).unwrap()
}

#[test]
//= melder#6.2 type=test
fn approaching_presses_harder_and_leaving_never_pulls() {
    let mut finger = point_finger();
    let entity = damped(Friction::None);
    let mut step =
        |y: f64| finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, y, 0.0), DT).force_on_user_W.y;
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
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, y, 0.0), DT);
    for i in 1..200 {
        y -= 1e-5 * f64::from(i % 5 - 2);
        let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(1e-4 * f64::from(i), y, 0.0), DT);
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
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(1e-5, -DEPTH, 0.0), DT);
    assert_eq!(out.friction, ContactState::Stick);
    assert!((out.force_on_user_W.x + K * 1e-5 + B * 0.01).abs() < 1e-14);
    // 3 m/s within the static circle: the damper alone would exceed the cone.
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(3e-3, -DEPTH, 0.0), DT);
    assert_eq!(out.friction, ContactState::Stick);
    assert!((ratio(&out, &Vector3::y()) - MU_S).abs() < 1e-14);
}

#[test]
fn riding_along_on_a_moving_entity_is_not_damped() {
    let mut entity = damped(stiction());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    for i in 1..1000 {
        let shift = Vector3::new(0.3, 0.4, -0.1) * (f64::from(i) * DT);
        entity.move_to(Isometry3::translation(shift.x, shift.y, shift.z));
        let out = finger.step(std::slice::from_ref(&entity), &(shift + Vector3::new(0.0, -DEPTH, 0.0)), DT);
        // Positions of up to 0.5 m are rounded to 5.6e-17, differences over dt to 2e-13.
        assert!((out.force_on_user_W - Vector3::new(0.0, K * DEPTH, 0.0)).norm() < 2e-12);
    }
}

/// A HIP at `y` that moves with this velocity along y, as far as anybody knows.
fn known(y: f64, velocity: f64) -> Hip {
    Hip { position_W: Vector3::new(0.0, y, 0.0), velocity_W: Some(Vector3::y() * velocity) }
}

#[test]
fn a_velocity_that_is_known_takes_the_place_of_the_difference() {
    let entity = damped(Friction::None);
    let mut finger = point_finger();
    let mut force = |hip: Hip| finger.step(std::slice::from_ref(&entity), hip, DT).force_on_user_W.y;
    assert_eq!(force(known(-5.00e-3, -0.3)), 2.5, "a first tick has no speed, whatever is said");
    // Sums of numbers below 3: some ulps, and a difference of positions over dt that cancels to 1e-18 / 1e-3 times b.
    assert!((force(known(-5.01e-3, -0.3)) - (2.505 + B * 0.3)).abs() < 1e-14);
    assert!((force(known(-5.01e-3, 0.0)) - 2.505).abs() < 1e-14);
    let unknown = Hip { velocity_W: None, ..known(-5.00e-3, 0.0) };
    assert!((force(unknown) - (2.5 - B * 0.01)).abs() < 1e-14, "the difference");
    let nonsense = Hip { velocity_W: Some(Vector3::repeat(f64::NAN)), ..known(-5.01e-3, 0.0) };
    assert!((force(nonsense) - (2.505 + B * 0.01)).abs() < 1e-14, "the difference");
}

#[test]
fn a_velocity_that_is_the_difference_changes_no_bit() {
    let entity = damped(stiction());
    let (mut told, mut alone) = (point_finger(), point_finger());
    let mut noise = Noise(5);
    let mut previous: Option<Vector3<f64>> = None;
    for _ in 0..2000 {
        let hip = Vector3::new(0.0, -DEPTH, 0.0) + noise.vector(1e-3);
        let velocity_W = previous.replace(hip).map(|previous| (hip - previous) / DT);
        let with =
            told.step(std::slice::from_ref(&entity), Hip { position_W: hip, velocity_W }, DT).force_on_user_W;
        let without = alone.step(std::slice::from_ref(&entity), &hip, DT).force_on_user_W;
        assert_eq!(with.map(f64::to_bits), without.map(f64::to_bits));
    }
}

#[test]
fn a_known_velocity_is_taken_against_the_entitys_own_motion_and_turn() {
    let velocity = Vector3::new(0.3, 0.4, -0.1);
    let turn = |tick: i32| UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 0.1, -0.3) * f64::from(tick));
    let mut entity =
        Entity { X_WB: Isometry3::from_parts(Default::default(), turn(0)), ..damped(stiction()) };
    let mut finger = point_finger();
    // Below the table's surface, which turns with it.
    let hip_at = |tick: i32| {
        let shift = velocity * (f64::from(tick) * DT);
        shift + turn(tick) * Vector3::new(0.0, -DEPTH, 0.0)
    };
    let difference = |tick: i32| (hip_at(tick) - hip_at(tick - 1)) / DT;
    finger.step(std::slice::from_ref(&entity), &hip_at(0), DT);
    for tick in 1..200 {
        let shift = velocity * (f64::from(tick) * DT);
        entity.move_to(Isometry3::from_parts(shift.into(), turn(tick)));
        let along =
            finger.clone().step(std::slice::from_ref(&entity), known_in(hip_at(tick), difference(tick)), DT);
        let normal = turn(tick) * Vector3::y();
        // Positions of up to 0.1 m are rounded to 1.4e-17, differences over dt and turned to some 1e-13.
        assert!((along.force_on_user_W - normal * (K * DEPTH)).norm() < 1e-12, "rides along");
        let pressing = difference(tick) - normal * 0.1;
        let pressed = finger.step(std::slice::from_ref(&entity), known_in(hip_at(tick), pressing), DT);
        assert!((pressed.force_on_user_W.dot(&normal) - (K * DEPTH + B * 0.1)).abs() < 1e-12);
    }
}

fn known_in(position_W: Vector3<f64>, velocity_W: Vector3<f64>) -> Hip {
    Hip { position_W, velocity_W: Some(velocity_W) }
}
