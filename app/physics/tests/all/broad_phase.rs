//! Boxes around entities, and what they tell.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Sphere};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use physics::{Aabb, BroadPhase};

#[test]
fn boxes_overlap_where_they_have_a_point_in_common_along_all_three_axes() {
    let one = Aabb::of_ball(&Vector3::zeros(), 1.0);
    for axis in 0..3 {
        let mut way = Vector3::zeros();
        way[axis] = 1.0;
        for sign in [1.0, -1.0] {
            let at = |distance: f64| Aabb::of_ball(&(way * (sign * distance)), 1.0);
            assert!(one.overlaps(&at(1.5)) && one.overlaps(&at(2.0)), "touching, too: {axis}");
            assert!(!one.overlaps(&at(2.5)), "{axis}");
        }
    }
}

#[test]
fn a_box_has_all_corners_of_what_is_turned_in_it_and_room_for_where_that_goes() {
    let size = [0.1, 0.02, 0.04];
    let pose = |turn: f64| {
        let axis_W = Vector3::new(0.3, 0.8, 0.5) * turn;
        Isometry3::from_parts(Vector3::new(0.5, 0.0, 0.0).into(), UnitQuaternion::from_scaled_axis(axis_W))
    };
    for turn in [0.0, 0.7, 1.5, 2.9] {
        let mut entity = object(Cuboid::new(size).unwrap(), pose(turn), 1000.0, 0.5);
        let tight = Aabb::of_entity(&entity).unwrap();
        for corner in 0..8 {
            let sign = |axis: usize| if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
            let at_B = Point3::new(size[0] * sign(0), size[1] * sign(1), size[2] * sign(2));
            let point = Aabb::of_ball(&(entity.X_WB * at_B).coords, 0.0);
            // Roundings of where it is.
            assert!(tight.grown(1e-15).contains(&point), "{turn}, {corner}");
        }
        let mut broad_phase = BroadPhase::new(std::slice::from_ref(&entity));
        assert!(broad_phase.around(0).unwrap().contains(&tight.grown(4.9e-3)));
        let ahead_W = Vector3::new(0.1, -0.2, 0.05);
        entity.move_to(Isometry3::translation(0.02, 0.0, 0.0) * entity.X_WB);
        assert!(broad_phase.was_put(0, &entity, &ahead_W));
        let now = Aabb::of_entity(&entity).unwrap();
        assert!(broad_phase.around(0).unwrap().contains(&now.swept(&ahead_W).grown(4.9e-3)));
        // It stays in there, and nothing has to be done.
        entity.move_to(Isometry3::translation(0.09, -0.19, 0.04) * entity.X_WB);
        assert!(!broad_phase.was_put(0, &entity, &ahead_W));
    }
}

#[test]
fn what_moves_is_in_its_box_in_the_next_tick_too() {
    for speed_m_s in [0.01, 0.3, 2.0, 20.0, 200.0] {
        let mut entity = object(Sphere::new(0.01).unwrap(), Isometry3::identity(), 1000.0, 0.5);
        let mut broad_phase = BroadPhase::new(std::slice::from_ref(&entity));
        let way_W = Vector3::new(0.6, -0.8, 0.0) * (speed_m_s * 1e-3);
        let mut changes = 0;
        for _ in 0..1000 {
            entity.move_to(Isometry3::from(nalgebra::Translation3::from(way_W)) * entity.X_WB);
            changes += i32::from(broad_phase.moved(0, &entity, &way_W));
            let next = Aabb::of_entity(&entity).unwrap().swept(&way_W);
            assert!(broad_phase.around(0).unwrap().contains(&next), "{speed_m_s} m/s");
        }
        // 5 mm around it, along the faster axis, and at least three ticks.
        let most = (0.8 * speed_m_s / 5e-3).min(1000.0 / 2.0) + 2.0;
        assert!(f64::from(changes) <= most, "{changes} changes at {speed_m_s} m/s");
        let around = broad_phase.around(0).unwrap();
        let longest_m = (around.high_W - around.low_W).max();
        assert!(longest_m < 0.03 + 0.01_f64.max(3.1e-3 * speed_m_s), "{longest_m} m at {speed_m_s} m/s");
    }
}
