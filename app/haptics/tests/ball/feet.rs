//! Where a ball on a tree presses it touches: each foot that carries a load is at the radius, in every tick.

use crate::common::*;
use crate::trees::{bored_box, thin_plate, touchable, v};
use haptics::{Entity, Finger, Friction};
use nalgebra::Vector3;

/// One tick; whether it touched.
fn touches_at_the_radius(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>, radius_m: f64) -> bool {
    finger.step(std::slice::from_ref(entity), hip, DT);
    let points = finger.touch_points(std::slice::from_ref(entity), 0);
    let Some(contact) = finger.contact(0) else { return false };
    for point in points.as_slice() {
        let gap = (point.point_W - contact.god_object_W).norm() / radius_m - 1.0;
        // What is farther by 1e-7 is dropped; the rest is rounding.
        assert!(gap.abs() <= 1e-6, "{gap:e} at {hip:?}: {point:?}");
    }
    !points.as_slice().is_empty()
}

/// Above the corner the plane of the upper face goes on where the face has ended.
#[test]
fn a_ball_that_flies_past_an_edge_touches_the_edge() {
    for friction in [Friction::None, Friction::coulomb(2.0).unwrap()] {
        let (entity, radius_m) = (touchable(&thin_plate().tree, friction), 4e-3);
        let mut touched = 0;
        for i in 0..40 {
            let mut finger = finger(radius_m);
            let beyond_m = 1e-4 * f64::from(i);
            let from = v(0.0505 + beyond_m, 0.012, 0.01);
            step_free(&mut finger, &entity, &from);
            let to = v(0.049, 1e-3, 0.013);
            touched += u32::from(touches_at_the_radius(&mut finger, &entity, &to, radius_m));
        }
        assert_eq!(touched, 40, "none flies by");
    }
}

fn step_free(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) {
    finger.step(std::slice::from_ref(entity), hip, DT);
    assert!(finger.contact(0).is_none());
}

/// A little wider than the slot, it comes from one edge onto both, and at the slot's end onto a third.
#[test]
fn a_ball_that_is_drawn_into_a_slot_presses_on_no_edge_that_it_has_not_come_to() {
    for (seed, friction) in [Friction::None, Friction::coulomb(0.3).unwrap()].into_iter().enumerate() {
        let entity = touchable(&thin_plate().tree, friction);
        let mut noise = Noise(seed as u64 + 1);
        let mut touched = 0;
        for _ in 0..100 {
            let radius_m = noise.between(5.0e-3, 5.5e-3);
            let mut finger = finger(radius_m);
            let mut from = v(0.03, 0.02, 0.0);
            for _ in 0..6 {
                let to =
                    v(noise.between(0.01, 0.03), noise.between(-4e-3, 4e-3), noise.between(-0.035, 0.035));
                for i in 1..=15 {
                    let hip = from + (to - from) * (f64::from(i) / 15.0);
                    touched += u32::from(touches_at_the_radius(&mut finger, &entity, &hip, radius_m));
                }
                from = to;
            }
        }
        assert!(touched > 4000, "{touched}");
    }
}

/// Across the mouth of a bore a foot on the face has nowhere to go; left behind, it is a point like any other.
#[test]
fn a_ball_that_leaves_a_face_for_a_bore_leaves_no_load_on_the_face() {
    let entity = touchable(&bored_box().tree, Friction::coulomb(1.0).unwrap());
    let mut noise = Noise(3);
    let mut touched = 0;
    for _ in 0..2000 {
        let radius_m = noise.between(1.5e-3, 8e-3);
        let mut finger = finger(radius_m);
        let mut from = v(0.04, 0.04, 0.0);
        for _ in 0..8 {
            let to =
                v(noise.between(-0.055, 0.055), noise.between(-0.055, 0.055), noise.between(-0.055, 0.055));
            for i in 1..=25 {
                let hip = from + (to - from) * (f64::from(i) / 25.0);
                touched += u32::from(touches_at_the_radius(&mut finger, &entity, &hip, radius_m));
            }
            from = to;
        }
    }
    assert!(touched > 5000, "{touched}");
}
