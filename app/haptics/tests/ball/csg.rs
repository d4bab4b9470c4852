//! Balls on solids joined of closed forms, against closed forms: patches, rounded edges, grooves, corners, bores and rims.

use crate::common::*;
use crate::trees::{self, touchable, v};
use haptics::{CsgPart, CsgTree, Cuboid, Entity, Finger, FingerOutput, Friction, Plane};
use nalgebra::Vector3;

/// Along straight pieces through these places, in steps of this length.
fn way(places: &[Vector3<f64>], step_m: f64) -> Vec<Vector3<f64>> {
    let piece = |pair: &[Vector3<f64>]| {
        let (from, to) = (pair[0], pair[1]);
        let ticks = ((to - from).norm() / step_m).ceil().max(1.0) as usize;
        (0..ticks).map(move |i| from + (to - from) * (i as f64 / ticks as f64)).collect::<Vec<_>>()
    };
    let last = places.last().copied();
    places.windows(2).flat_map(piece).chain(last).collect()
}

fn felt(finger: &mut Finger, entity: &Entity, places: &[Vector3<f64>], step_m: f64) -> FingerOutput {
    let mut out = None;
    for hip in way(places, step_m) {
        out = Some(step(finger, entity, &hip));
    }
    out.unwrap()
}

fn step(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

fn half_space(normal: Vector3<f64>, offset_m: f64) -> CsgPart {
    Plane::new(normal.normalize(), offset_m).unwrap().into()
}

/// A box as one leaf, and as six half-spaces.
fn boxes() -> [CsgTree; 2] {
    let size = [0.1, 0.06, 0.08];
    let leaf = CsgTree::union([CsgPart::from(Cuboid::new(size).unwrap())]);
    let faces =
        (0..6).map(|i| half_space(Vector3::ith(i % 3, if i < 3 { 1.0 } else { -1.0 }), 0.5 * size[i % 3]));
    [leaf, CsgTree::intersection(faces)]
}

#[test]
fn a_box_in_a_tree_is_felt_as_a_box() {
    let form = entity(Cuboid::new([0.1, 0.06, 0.08]).unwrap(), Friction::None);
    for tree in boxes() {
        let tree = touchable(&tree, Friction::None);
        let mut noise = Noise(7);
        let mut fingers = [finger(5e-3), finger(5e-3)];
        let mut touched = 0;
        // Over the faces, round the edges and the corners, always from outside.
        for i in 0..40_000 {
            let t = f64::from(i) * 1e-3;
            let direction = v((1.3 * t).sin(), (0.9 * t + 1.0).sin(), (0.7 * t + 2.0).sin()).normalize();
            let far = [0.05, 0.03, 0.04]
                .iter()
                .zip(&direction)
                .map(|(h, d)| h / f64::abs(*d))
                .fold(f64::INFINITY, f64::min);
            let hip = direction * (far + 4e-3 * (5.0 * t).sin() + 1e-3 * noise.uniform());
            let [a, b] = [step(&mut fingers[0], &form, &hip), step(&mut fingers[1], &tree, &hip)];
            assert_eq!(a.entity, b.entity, "{i} {hip}");
            assert!((a.force_on_user_W - b.force_on_user_W).norm() < 1e-9, "{i} {hip}: {a:?} {b:?}");
            touched += u32::from(a.entity.is_some());
        }
        assert!(touched > 20_000, "{touched}");
    }
}

#[test]
fn a_ball_in_a_bore_touches_its_wall_from_inside() {
    let tree = touchable(&trees::bored_box().tree, Friction::None);
    let (bore_m, radius_m) = (0.02, 5e-3);
    let mut finger = finger(radius_m);
    felt(&mut finger, &tree, &[v(0.0, 0.06, 0.0), v(0.0, 0.0, 0.0)], 2e-4);
    for i in 0..5000 {
        let t = f64::from(i) * 2e-3;
        let rho = 0.015 + 3e-3 * (1.3 * t).sin();
        let hip = v(rho * t.cos(), 5e-3 * (0.5 * t).sin(), rho * t.sin());
        let out = step(&mut finger, &tree, &hip);
        let depth = rho - (bore_m - radius_m);
        let expected = if depth > 0.0 { -v(t.cos(), 0.0, t.sin()) * (K * depth) } else { Vector3::zeros() };
        assert!((out.force_on_user_W - expected).norm() < 1e-9, "{i}: {} {expected}", out.force_on_user_W);
    }
}

#[test]
fn a_ball_larger_than_the_bore_rests_on_its_rim() {
    let tree = touchable(&trees::bored_box().tree, Friction::None);
    let (bore_m, radius_m) = (0.02_f64, 0.025_f64);
    let height = 0.02 + (radius_m * radius_m - bore_m * bore_m).sqrt();
    for start in [v(0.0, 0.06, 0.0), v(1e-3, 0.06, -2e-3), v(-7e-3, 0.06, 1e-3)] {
        let mut finger = finger(radius_m);
        let rest = v(0.0, height - 3e-3, 0.0);
        felt(&mut finger, &tree, &[start, rest], 2e-4);
        let mut last = None;
        for _ in 0..200 {
            last = Some(step(&mut finger, &tree, &rest));
        }
        let out = last.unwrap();
        assert!((out.god_object_W - v(0.0, height, 0.0)).norm() < 1e-8, "{start} {}", out.god_object_W);
        assert!((out.force_on_user_W - v(0.0, K * 3e-3, 0.0)).norm() < 1e-5, "{}", out.force_on_user_W);
        for i in 0..2000 {
            let t = f64::from(i) * 1e-2;
            let hip = rest + v(5e-4 * t.cos(), 1e-4 * t.sin(), 8e-4 * (1.7 * t).sin());
            let out = step(&mut finger, &tree, &hip);
            assert!((out.god_object_W - v(0.0, height, 0.0)).norm() < 1e-8, "{i} {}", out.god_object_W);
        }
    }
}

#[test]
fn between_two_walls_a_ball_touches_both() {
    let v_groove = CsgTree::union([half_space(v(1.0, 1.0, 0.0), 0.0), half_space(v(-1.0, 1.0, 0.0), 0.0)]);
    let tree = touchable(&v_groove, Friction::None);
    let mut finger = finger(4e-3);
    let out = felt(&mut finger, &tree, &[v(1e-3, 0.03, 0.0), v(5e-4, 3e-3, 0.01)], 2e-4);
    let height = 4e-3 * 2f64.sqrt();
    assert!((out.god_object_W - v(0.0, height, 0.01)).norm() < 1e-12, "{}", out.god_object_W);
}

#[test]
fn in_a_corner_a_ball_touches_three_walls() {
    let walls = [Vector3::x(), Vector3::y(), Vector3::z()].map(|normal| half_space(normal, 0.0));
    let tree = touchable(&CsgTree::union(walls), Friction::None);
    let mut finger = finger(4e-3);
    let out = felt(&mut finger, &tree, &[v(0.02, 0.03, 0.02), v(1e-3, 2e-3, 3e-3)], 2e-4);
    assert!((out.god_object_W - v(4e-3, 4e-3, 4e-3)).norm() < 1e-12, "{}", out.god_object_W);
}

#[test]
fn two_united_balls_are_felt_as_two_grown_ones() {
    let tree = touchable(&trees::two_balls().tree, Friction::None);
    let radius_m = 6e-3;
    let (a, b) = ((v(-0.03, 0.0, 0.0), 0.05 + radius_m), (v(0.03, 0.0, 0.0), 0.04 + radius_m));
    let mut finger = finger(radius_m);
    let mut deepest = 0.0_f64;
    for i in 0..20_000 {
        let t = f64::from(i) * 2e-3;
        let direction = v((1.3 * t).sin(), (0.9 * t + 1.0).sin(), (0.7 * t + 2.0).sin()).normalize();
        let hip = direction * (0.06 + 0.01 * t.sin());
        let out = step(&mut finger, &tree, &hip);
        let gap = |p: &Vector3<f64>| ((p - a.0).norm() - a.1).min((p - b.0).norm() - b.1);
        let inside = gap(&hip) < 0.0;
        if !inside {
            assert_eq!(out.force_on_user_W, Vector3::zeros(), "{i}");
            continue;
        }
        assert!(out.entity.is_some(), "{i}");
        assert!(gap(&out.god_object_W).abs() < 2e-11, "{i} {}", gap(&out.god_object_W));
        deepest = deepest.max(-gap(&hip));
    }
    assert!(deepest > 2e-3, "{deepest}");
}
