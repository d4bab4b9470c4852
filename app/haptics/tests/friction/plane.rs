//! The Friction Cone Algorithm on a plane (Melder ch. 4.1, 4.1.1).

use crate::common::*;
use haptics::{ContactState, Entity, Feature, FingerOutput, Friction, Plane};
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

/// Ramps the HIP sideways by one micrometre a tick, first straight down at the origin.
fn ramp(entity: &Entity, ticks: usize) -> Vec<(f64, FingerOutput)> {
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(entity), &Vector3::new(0.0, 1e-3, 0.0), DT);
    let mut step = |i: usize| {
        let x = i as f64 * 1e-6;
        (x, finger.step(std::slice::from_ref(entity), &Vector3::new(x, -DEPTH, 0.0), DT))
    };
    (0..ticks).map(&mut step).collect()
}

#[test]
//= melder#4.3 type=test
//= melder#4.7 type=test
fn the_normal_force_on_the_user_is_stiffness_times_depth_exactly() {
    let mut noise = Noise(1);
    let shifted = entity(Plane::new(Vector3::y(), 0.1).unwrap(), stiction());
    for _ in 0..10_000 {
        let hip = Vector3::new(noise.gaussian(), -noise.uniform(), noise.gaussian());
        let out = point_finger().step(&[table(stiction())], &hip, DT);
        assert_eq!(out.force_on_user_W.y, K * -hip.y, "positive, out of the material");
        let out = point_finger().step(std::slice::from_ref(&shifted), &hip, DT);
        assert_eq!(out.force_on_user_W.y, K * (0.1 - hip.y));
    }
}

#[test]
//= melder#4.2 type=test
//= melder#4.5 type=test
fn it_breaks_away_within_one_tick_of_the_static_limit() {
    let outputs = ramp(&table(stiction()), 5000);
    let limit = MU_S * DEPTH;
    let first_slip = outputs.iter().position(|(_, out)| out.friction == ContactState::Slip).unwrap();
    for (x, out) in &outputs[..first_slip] {
        assert_eq!(out.friction, ContactState::Stick);
        assert_eq!(out.god_object_W, Vector3::zeros(), "stuck at x = {x}");
        assert!(*x <= limit * (1.0 + 1e-11), "limit forgives 1e-12 of the depth, 1.4e-12 of itself");
    }
    assert!(outputs[first_slip].0 > limit);
    assert!(outputs[first_slip - 1].0 <= limit * (1.0 + 1e-11));
}

#[test]
//= melder#4.6 type=test
fn breaking_away_and_sliding_it_bears_the_dynamic_coefficient() {
    let outputs = ramp(&table(stiction()), 10_000);
    let sliding: Vec<_> = outputs.iter().filter(|(_, out)| out.friction == ContactState::Slip).collect();
    assert!(sliding.len() > 6000);
    for (x, out) in sliding {
        // Promised are 1e-9; the rim is one step away, so only the rounding of positions near
        // 10 mm against a depth of 5 mm is left, a few 1e-16.
        assert!((ratio(out, &Vector3::y()) - MU_D).abs() < 4e-15, "x = {x}");
        assert!(out.force_on_user_W.x < 0.0, "friction on the user opposes the motion");
        let spring = (out.god_object_W - Vector3::new(*x, -DEPTH, 0.0)) * K;
        assert!((out.force_on_user_W - spring).norm() < 1e-14 * K, "it is the spring to the god-object");
    }
}

#[test]
//= melder#7.36 type=test
fn backing_off_it_first_stays_in_slip_unmoved_and_then_sticks() {
    let entity = table(stiction());
    let mut finger = point_finger();
    for i in 0..=5000 {
        finger.step(std::slice::from_ref(&entity), &Vector3::new(i as f64 * 1e-6, -DEPTH, 0.0), DT);
    }
    let at_rest = finger.contact(0).unwrap().god_object_W;
    let rim = MU_D * DEPTH;
    for back in [0.005, 0.01, 0.015, 0.019, 0.021, 0.03, 0.5] {
        let hip = Vector3::new(at_rest.x + rim * (1.0 - back), -DEPTH, 0.0);
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        let expected = if back < 0.02 { ContactState::Slip } else { ContactState::Stick };
        assert_eq!(out.friction, expected, "{back} inside the rim");
        assert_eq!(out.god_object_W, at_rest);
    }
    // Stuck again, it bears the static coefficient: half way between the two it still holds.
    let hip = Vector3::new(at_rest.x + 0.5 * DEPTH, -DEPTH, 0.0);
    assert_eq!(finger.step(std::slice::from_ref(&entity), &hip, DT).god_object_W, at_rest);
}

#[test]
fn a_finger_that_slid_and_rests_sticks_whatever_the_rounding() {
    let mut noise = Noise(4);
    for _ in 0..1000 {
        let mut vector = || Vector3::new(noise.gaussian(), noise.gaussian(), noise.gaussian());
        let (normal, along) = (vector().normalize(), vector());
        let along = (along - normal * along.dot(&normal)).normalize();
        let entity = entity(Plane::new(normal, 0.1).unwrap(), Friction::coulomb(0.5).unwrap());
        let mut finger = point_finger();
        let mut step = |height_m: f64, way_m: f64| {
            let hip = normal * (0.1 + height_m) + along * way_m;
            finger.step(std::slice::from_ref(&entity), &hip, DT).friction
        };
        step(1e-3, 0.0);
        (0..5).for_each(|tick| _ = step(-DEPTH, 1e-3 * f64::from(tick)));
        assert_eq!(step(-DEPTH, 5e-3), ContactState::Slip);
        assert_eq!([(); 3].map(|()| step(-DEPTH, 5e-3)), [ContactState::Stick; 3]);
    }
}

#[test]
fn a_tick_that_lands_exactly_on_the_surface_is_contact_without_force() {
    let entity = table(stiction()).with_damping(5.0).unwrap();
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, 0.01, 0.0), DT);
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::zeros(), DT);
    assert_eq!((out.entity, out.feature), (Some(0), Feature::Surface));
    assert_eq!(out.force_on_user_W, Vector3::zeros());
}

#[test]
fn the_first_point_touched_is_where_the_path_entered() {
    let mut finger = point_finger();
    let entity = table(Friction::coulomb(1.0).unwrap());
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, 0.003, 0.0), DT);
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(0.004, -0.005, 0.0), DT);
    // 3/8 of the way; one rounding of the fraction and one of the product.
    assert!((out.god_object_W - Vector3::new(0.0015, 0.0, 0.0)).norm() < 1e-18);
    assert_eq!(out.friction, ContactState::Stick);
}

#[test]
fn started_inside_it_is_pushed_out_along_the_normal() {
    let out = point_finger().step(&[table(stiction())], &Vector3::new(0.3, -0.002, 0.1), DT);
    assert_eq!(out.god_object_W, Vector3::new(0.3, 0.0, 0.1));
    assert_eq!(out.force_on_user_W, Vector3::new(0.0, K * 0.002, 0.0));
}

#[test]
fn in_free_space_the_god_object_is_the_hip() {
    let hip = Vector3::new(0.1, 1.0 / 3.0, -0.0);
    let out = point_finger().step(&[table(stiction())], &hip, DT);
    assert_eq!(out.god_object_W, hip);
    assert_eq!((out.entity, out.feature, out.friction), (None, Feature::None, ContactState::Free));
    assert_eq!(out.force_on_user_W, Vector3::zeros());
}

#[test]
fn a_spherical_finger_touches_one_radius_earlier() {
    let mut finger = finger(0.01);
    let out = finger.step(&[table(stiction())], &Vector3::new(0.0, 0.008, 0.0), DT);
    assert!((out.force_on_user_W.y - K * 0.002).abs() < 1e-15, "one rounding of r - y");
    let contact = finger.contact(0).unwrap();
    assert_eq!(contact.touch_point_W(finger.radius_m()), Vector3::zeros());
    assert_eq!(contact.force_on_object_W(), -out.force_on_user_W);
}

#[test]
fn a_finger_in_a_corner_feels_both_walls_and_names_the_stronger() {
    let wall = entity(Plane::new(Vector3::x(), 0.0).unwrap(), stiction());
    let entities = [table(stiction()), wall];
    let mut finger = point_finger();
    let out = finger.step(&entities, &Vector3::new(-0.002, -0.001, 0.0), DT);
    assert_eq!(out.force_on_user_W, Vector3::new(K * 0.002, K * 0.001, 0.0));
    assert_eq!(out.entity, Some(1));
    assert_eq!(finger.contacts().count(), 2);
    let out = point_finger().step(&entities, &Vector3::new(-0.002, -0.002, 0.0), DT);
    assert_eq!(out.entity, Some(0), "the lowest index among equals");
    finger.step(&entities[..1], &Vector3::new(-0.002, -0.001, 0.0), DT);
    assert_eq!(finger.contacts().count(), 1, "the second wall is gone");
}

proptest! {
    /// Rotating and shifting the whole world rotates and shifts the answer.
    #[test]
    fn any_orientation_gives_the_same_answer(
        turn in prop::array::uniform3(-3.0..3.0f64), shift in prop::array::uniform3(-1.0..1.0f64), seed: u64,
    ) {
        let X = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        let here = table(stiction());
        let there = Entity { X_WB: X, previous_X_WB: X, ..here.clone() };
        let normal = X * Vector3::y();
        let plane = Plane::new(normal, normal.dot(&Vector3::from(shift))).unwrap();
        let oblique = entity(plane, stiction());
        let mut fingers = [point_finger(), point_finger(), point_finger()];
        let mut noise = Noise(seed);
        let mut hip = Vector3::new(0.0, 0.002, 0.0);
        for _ in 0..200 {
            let hip_there = X.rotation * hip + X.translation.vector;
            let a = fingers[0].step(std::slice::from_ref(&here), &hip, DT);
            for out in [fingers[1].step(std::slice::from_ref(&there), &hip_there, DT), fingers[2].step(std::slice::from_ref(&oblique), &hip_there, DT)] {
                prop_assert_eq!(out.friction, a.friction);
                // Rounding of positions of size 3 is 4e-16 and enters a few times; the god-object
                // inherits it from its entry on. Times K in the force.
                let tolerance = 1e-14;
                let god_object = X.rotation * a.god_object_W + X.translation.vector;
                prop_assert!((out.god_object_W - god_object).norm() < tolerance);
                prop_assert!((out.force_on_user_W - X.rotation * a.force_on_user_W).norm() < K * tolerance);
            }
            hip += noise.vector(5e-4) - Vector3::new(0.0, 2e-5, 0.0);
        }
    }
}
