//! Balls that touch at several points: grooves, corners, edges; forces and friction by hand, and the torque.

use crate::common::meshes::{built, cube, step, touchable, wedge};
use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{ContactState, Entity, Feature, Friction};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::slice::from_ref;
use std::sync::Arc;

const R: f64 = 0.01;

/// The inside of a cube of 0.1 m: three walls that meet in the origin and lie along the axes, as a sheet.
fn corner() -> Arc<Mesh> {
    let [o, x, y, z] = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    let [xy, yz, zx] = [[0.1, 0.1, 0.0], [0.0, 0.1, 0.1], [0.1, 0.0, 0.1]];
    let vertices = [o, x, y, z, xy, yz, zx].map(Vector3::from).to_vec();
    let faces = vec![[0, 1, 4], [0, 4, 2], [0, 2, 5], [0, 5, 3], [0, 3, 6], [0, 6, 1]];
    built(TriangleSoup { vertices, faces })
}

/// Lowers a ball from 0.05 m above to a place, and holds it there.
fn lowered(entity: &Entity, hip: Vector3<f64>) -> (haptics::Finger, haptics::FingerOutput) {
    let mut finger = finger(R);
    let mut out = None;
    for i in 0..=100 {
        let above = Vector3::new(0.02, 0.05, 0.02) * (1.0 - f64::from(i) / 100.0);
        out = Some(step(&mut finger, entity, &(hip + above)));
    }
    (finger, out.unwrap())
}

#[test]
fn in_a_corner_a_ball_touches_three_walls_and_each_pushes_by_its_own_depth() {
    let entity = touchable(&corner(), Friction::None);
    let hip = Vector3::new(0.004, 0.006, 0.007);
    let (finger, out) = lowered(&entity, hip);
    // Each wall holds the centre at r from it: roundings of 0.01 m at 500 N/m.
    assert!((out.god_object_W - Vector3::repeat(R)).norm() < 1e-15);
    assert!((out.force_on_user_W - (Vector3::repeat(R) - hip) * K).norm() < 1e-12);
    let points = finger.touch_points(from_ref(&entity), 0);
    assert_eq!(points.as_slice().len(), 3);
    for point in points.as_slice() {
        let axis = point.normal_W.iamax();
        assert!((point.normal_W - Vector3::ith(axis, 1.0)).norm() < 1e-15);
        assert!((point.point_W - (Vector3::repeat(R) - Vector3::ith(axis, R))).norm() < 1e-15);
        assert!((point.force_on_user_W - Vector3::ith(axis, (R - hip[axis]) * K)).norm() < 1e-12);
    }
    let sum: Vector3<f64> = points.as_slice().iter().map(|point| point.force_on_user_W).sum();
    assert!((sum - out.force_on_user_W).norm() < 1e-12);
    assert!(out.torque_on_user_W.norm() < 1e-14, "no friction, no torque: {}", out.torque_on_user_W);
}

/// A groove of 60 degrees along z, its walls rising to both sides.
fn groove() -> Arc<Mesh> {
    built(wedge(300.0))
}

#[test]
fn in_a_groove_a_ball_touches_two_walls_and_their_loads_follow_from_the_triangle_of_forces() {
    let entity = touchable(&groove(), Friction::None);
    let hip = Vector3::new(0.001, 0.012, 0.004);
    let (finger, out) = lowered(&entity, hip);
    // The centre of a ball between walls that make 30 degrees with the vertical: r / sin 30 above the edge.
    let centre = Vector3::new(0.0, 2.0 * R, hip.z);
    assert!((out.god_object_W - centre).norm() < 1e-14, "{}", out.god_object_W);
    // Normals (-+cos 30, sin 30): sum of the loads = height / sin 30, difference = aside / cos 30.
    let (sum, difference) = ((2.0 * R - hip.y) / 0.5, hip.x / 0.75_f64.sqrt());
    let points = finger.touch_points(from_ref(&entity), 0);
    assert_eq!(points.as_slice().len(), 2);
    for point in points.as_slice() {
        let load = 0.5 * (sum - point.normal_W.x.signum() * difference);
        assert!((point.force_on_user_W.norm() - K * load).abs() < 1e-11);
        assert!((point.force_on_user_W.norm() - K * load).abs() < 1e-11);
    }
    assert!((out.force_on_user_W - (centre - hip) * K).norm() < 1e-11);
}

#[test]
fn in_a_groove_friction_acts_on_both_loads() {
    let mu = 0.2;
    let entity = touchable(&groove(), Friction::coulomb(mu).unwrap());
    let deep = 0.005;
    let (mut finger, _) = lowered(&entity, Vector3::new(0.0, 2.0 * R - deep, 0.0));
    let mut out = None;
    for i in 1..=200 {
        let hip = Vector3::new(0.0, 2.0 * R - deep, 1e-4 * f64::from(i));
        out = Some(step(&mut finger, &entity, &hip));
    }
    let out = out.unwrap();
    assert_eq!(out.friction, ContactState::Slip);
    // Each wall bears half of deep / sin 30; on a plane it would be mu k deep, half of this.
    let expected = mu * K * deep / 0.5;
    assert!((out.force_on_user_W.z + expected).abs() < 1e-9, "{} {expected}", out.force_on_user_W);
    assert!((out.force_on_user_W.y - K * deep).abs() < 1e-9);
    // Both points are r sin 30 below the centre, and the torque about it is their height times the friction.
    let points = finger.touch_points(from_ref(&entity), 0);
    assert_eq!(points.as_slice().len(), 2);
    let torque = Vector3::new(0.5 * R * expected, 0.0, 0.0);
    assert!((out.torque_on_user_W - torque).norm() < 1e-10, "{} {torque}", out.torque_on_user_W);
}

#[test]
fn a_nearly_flat_fold_does_not_double_the_force() {
    // Concave by a hundredth of a degree each side.
    let (deep, mu): (f64, f64) = (0.002, 0.3);
    for friction in [Friction::None, Friction::coulomb(mu).unwrap()] {
        let entity = touchable(&built(wedge(180.02)), friction.clone());
        let mut finger = finger(R);
        let mut hip: Vector3<f64> = Vector3::new(-0.01, 0.03, 0.0);
        let (mut both, mut slid) = (0, 0);
        for i in 0..400 {
            hip.y = (hip.y - 1e-3).max(R - deep);
            if i > 50 {
                hip.x += 1e-4;
            }
            let out = step(&mut finger, &entity, &hip);
            if hip.y > R - deep {
                continue;
            }
            both += u32::from(finger.touch_points(from_ref(&entity), 0).as_slice().len() == 2);
            // The fold raises the surface by 1.7e-4 per metre, hence by 5e-6 m over 0.03 m: 2.5e-3 N; tilts no more.
            assert!((out.force_on_user_W.y - K * deep).abs() < 3e-3, "{i}: {}", out.force_on_user_W);
            let along = out.force_on_user_W.x.abs();
            assert!(along < mu * K * deep + 5e-3, "{i}: {}", out.force_on_user_W);
            slid += u32::from(out.friction == ContactState::Slip && along > 0.9 * mu * K * deep);
        }
        assert!(both > 0 || friction != Friction::None, "the HIP was right under the fold once");
        assert!(friction == Friction::None || slid > 100, "{slid}");
    }
}

#[test]
fn round_an_edge_the_force_follows_the_rolling_arc() {
    // Light touches: the HIP stays within r of the edge, on an arc round it.
    let entity = touchable(&cube(), Friction::None);
    let edge = Vector3::new(0.05, 0.05, 0.0);
    let depth = 0.003;
    let mut finger = finger(R);
    let at = |degrees: f64| Vector3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0);
    step(&mut finger, &entity, &(edge + at(0.0) * 0.02));
    let mut last = Vector3::y();
    let tick_degrees: f64 = 0.25;
    for i in 0..=360 {
        let out_of_edge = at(f64::from(i) * tick_degrees);
        let out = step(&mut finger, &entity, &(edge + out_of_edge * (R - depth)));
        // Roundings of 0.06 m at 500 N/m, and the arc's end where the walk goes over to a face.
        let expected = out_of_edge * (depth * K);
        assert!((out.force_on_user_W - expected).norm() < 1e-9, "{i}: {} {expected}", out.force_on_user_W);
        if i > 0 && i < 360 {
            assert_eq!(out.feature, Feature::Edge);
        }
        let direction = out.force_on_user_W.normalize();
        assert!(direction.angle(&last) < tick_degrees.to_radians() * 1.01);
        last = direction;
    }
    assert!((last - Vector3::x()).norm() < 1e-9);
}

#[test]
fn the_torque_of_a_sliding_ball_is_that_of_friction_at_its_lowest_point() {
    let mu = 0.4;
    for entity in [
        touchable(&cube(), Friction::coulomb(mu).unwrap()),
        entity(haptics::Cuboid::new([0.1; 3]).unwrap(), Friction::coulomb(mu).unwrap()),
    ] {
        let mut finger = finger(R);
        let (deep, top) = (0.002, 0.05 + R);
        step(&mut finger, &entity, &Vector3::new(0.0, top + 0.01, 0.0));
        let mut out = None;
        for i in 0..100 {
            out = Some(step(&mut finger, &entity, &Vector3::new(1e-4 * f64::from(i), top - deep, 0.0)));
        }
        let out = out.unwrap();
        let drag = mu * K * deep;
        assert!((out.force_on_user_W - Vector3::new(-drag, K * deep, 0.0)).norm() < 1e-11);
        // (0, -r, 0) x (-drag, N, 0) = (0, 0, -r drag): it is rolled backwards.
        assert!((out.torque_on_user_W - Vector3::new(0.0, 0.0, -R * drag)).norm() < 1e-13);
        let points = finger.touch_points(from_ref(&entity), 0);
        assert!((points.as_slice()[0].point_W.y - 0.05).abs() < 1e-15);
    }
}

/// A finger has no orientation: one that sticks goes along as if it were glued to what turns.
#[test]
fn a_ball_that_sticks_goes_along_with_what_turns_and_does_not_roll_on_it() {
    let plane = haptics::Plane::new(Vector3::y(), 0.0).unwrap();
    let mut entity = Entity::new(plane, Isometry3::identity(), K).unwrap();
    entity = entity.with_friction(Friction::coulomb(1.0).unwrap()).unwrap();
    let mut finger = finger(R);
    step(&mut finger, &entity, &Vector3::new(0.0, 0.05, 0.0));
    let hip = Vector3::new(0.0, R - 2e-3, 0.0);
    step(&mut finger, &entity, &hip);
    let angle = 0.05;
    let mut out = None;
    for i in 0..=100 {
        let turn = Vector3::z() * (angle * f64::from(i) / 100.0);
        entity.X_WB.rotation = UnitQuaternion::from_scaled_axis(turn);
        out = Some(step(&mut finger, &entity, &hip));
    }
    // As long as r k angle is below mu k d. Roundings of 0.01 m in a hundred turns.
    let led = Vector3::new(-angle.sin(), angle.cos(), 0.0) * R;
    let out = out.unwrap();
    assert!((out.god_object_W - led).norm() < 1e-14, "{:?}", out.god_object_W);
    assert!((out.force_on_user_W - (led - hip) * K).norm() < 1e-11, "{:?}", out.force_on_user_W);
}
