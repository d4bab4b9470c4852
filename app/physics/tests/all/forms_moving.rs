//! Contact points while forms move through each other: the same seen from either side, continuous, and finite.
#![allow(non_snake_case)]

use crate::solids;

use haptics::Form;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoint, PairMemory, is_collidable};
use solids::*;

const REACH: f64 = 1e-3;

/// Force (N) and torque (N m) about B's origin, of springs of 1000 N/m.
fn wrench(points: &[ContactPoint], about: &Vector3<f64>) -> [Vector3<f64>; 2] {
    points.iter().fold([Vector3::zeros(); 2], |[force, torque], point| {
        let f = point.normal_W * (1000.0 * (-point.gap_m).max(0.0));
        [force + f, torque + (point.point_W - about).cross(&f)]
    })
}

/// Two forms, as deep in each other as wanted, and what the pair remembers of how they came there.
fn overlapping(
    a: &Form,
    b: &Form,
    depth: f64,
    noise: &mut Noise,
) -> (Isometry3<f64>, Isometry3<f64>, PairMemory) {
    let X_WB = pose(noise.turn(), Vector3::new(0.03, -0.02, 0.01));
    let (turn, away) = (noise.turn(), noise.direction());
    let aside = noise.direction() * 0.01;
    let at = |distance: f64| pose(turn, X_WB.translation.vector + aside + away * distance);
    let mut memory = PairMemory::default();
    let mut distance = 0.15;
    loop {
        let found = points(a, &at(distance), b, &X_WB, 1.0, &mut memory);
        let gap = deepest(&found);
        if gap < -depth {
            return (at(distance), X_WB, memory);
        }
        // Never farther in a step than there is room.
        distance -= (0.5 * (gap + depth)).clamp(2e-6, 1e-3);
        if distance < -0.15 {
            // It went past.
            return overlapping(a, b, depth, noise);
        }
    }
}

fn pairs() -> Vec<(String, Form, Form)> {
    let forms: Vec<_> = all().into_iter().chain(scaled()).collect();
    let mut pairs = Vec::new();
    for (name_a, a) in &forms {
        for (name_b, b) in &forms {
            if is_collidable(&(*a).into(), &(*b).into()) {
                pairs.push((format!("{name_a} on {name_b}"), *a, *b));
            }
        }
    }
    pairs
}

/// The largest change of the springs' force in a step along a way of 1 mm and 0.05 rad.
fn largest_jump(
    (a, b): (&Form, &Form),
    (X_WA, X_WB, memory): &(Isometry3<f64>, Isometry3<f64>, PairMemory),
    (along, axis): (Vector3<f64>, Vector3<f64>),
    steps: usize,
) -> f64 {
    let mut memory = memory.clone();
    let mut last: Option<[Vector3<f64>; 2]> = None;
    let mut most = 0.0_f64;
    for step in 0..steps {
        let part = step as f64 / steps as f64;
        let turn = UnitQuaternion::from_scaled_axis(axis * (0.05 * part));
        let X = pose(turn * X_WA.rotation, X_WA.translation.vector + along * (1e-3 * part));
        let found = points(a, &X, b, X_WB, REACH, &mut memory);
        if deepest(&found) < -1.5e-3 {
            break;
        }
        let now = wrench(&found, &X.translation.vector);
        if let Some(last) = last {
            // A torque counts as the force that makes it at 2 cm.
            most = most.max((now[0] - last[0]).norm()).max((now[1] - last[1]).norm() / 0.02);
        }
        last = Some(now);
    }
    most
}

#[test]
fn forces_change_as_little_as_the_poses_do() {
    let (mut tried, mut jumped) = (0, Vec::new());
    for (name, a, b) in pairs() {
        let mut noise = Noise(5);
        for _ in 0..3 {
            let start = overlapping(&a, &b, 3e-4, &mut noise);
            let way = (noise.direction(), noise.direction());
            let [coarse, fine] = [300, 3000].map(|steps| largest_jump((&a, &b), &start, way, steps));
            // A step of 3e-6 m and 2e-4 rad, which moves points by 1e-5 m: eight springs of 1000 N/m that move, turn and
            // fade over 1 mm.
            assert!(coarse < 0.08 || fine > 0.3 * coarse, "{name}: {coarse}");
            tried += 1;
            // Steps a tenth as long: changes a tenth as large, where there is no jump.
            if fine > 0.3 * coarse {
                jumped.push((name.clone(), coarse, fine));
            }
        }
    }
    // Where a rim lies deeper than a tip is round, the way out that it came by ends somewhere: it takes another. That turns
    // the force, which does not grow.
    assert!(jumped.len() * 150 <= tried, "{} of {tried}: {jumped:?}", jumped.len());
    assert!(jumped.iter().all(|(_, coarse, fine)| coarse.max(*fine) < 1.0), "{jumped:?}");
}

#[test]
fn moved_out_along_the_normal_by_the_depth_they_are_as_far_apart_as_that_is_more() {
    for (name, a, b) in pairs() {
        if let (Form::Scaled(_), Form::Scaled(_)) = (a, b) {
            continue;
        }
        let mut noise = Noise(7);
        for _ in 0..4 {
            let (X_WA, X_WB, mut memory) = overlapping(&a, &b, 3e-4, &mut noise);
            let found = points(&a, &X_WA, &b, &X_WB, REACH, &mut memory);
            let deepest = found.iter().min_by(|p, q| p.gap_m.total_cmp(&q.gap_m)).unwrap();
            // A ring may come nearer to something else on its way out.
            if found.len() > 1 && name.contains("torus") {
                continue;
            }
            let out = deepest.normal_W * (1e-3 - deepest.gap_m);
            let gap = distance(&a, &pose(X_WA.rotation, X_WA.translation.vector + out), &b, &X_WB);
            // The oracle's 1e-7 m; and a normal that is wrong by 1e-4 leaves (1e-4)^2 of the way.
            assert!((gap - 1e-3).abs() < 2e-7, "{name}: {gap} {found:?}");
            // The point is one of A's surface.
            let on_a = X_WA.inverse_transform_point(&nalgebra::Point3::from(deepest.point_W)).coords;
            if !matches!(a, Form::Scaled(_)) {
                assert!(distance_outside(&a, &on_a).abs() < 1e-6, "{name}: {deepest:?}");
            }
        }
    }
}

#[test]
fn what_has_gone_over_an_edge_is_free() {
    let slab: Form = haptics::Cuboid::new([0.2, 0.1, 0.2]).unwrap().into();
    for (name, a) in all().into_iter().chain(scaled()) {
        let radius = physics::collide::bounding_ball(&a.into()).unwrap().1;
        let X_WB = Isometry3::translation(0.0, -0.05, 0.0);
        let turn = Noise(3).turn();
        let at = |x: f64, y: f64| pose(turn, Vector3::new(x, y, 0.0));
        let high = at(0.05, 0.2);
        let gap = deepest(&points(&a, &high, &slab, &X_WB, 1.0, &mut PairMemory::default()));
        let y = 0.2 - gap - 5e-4;
        let mut memory = PairMemory::default();
        let mut was_in_contact = 0;
        for step in 0..200 {
            let x = 0.05 + f64::from(step) * 1e-3;
            let found = points(&a, &at(x, y), &slab, &X_WB, REACH, &mut memory);
            let touches = deepest(&found) < 0.0;
            was_in_contact += i32::from(touches);
            assert!(!touches || x < 0.1 + radius, "{name} at {x}: {found:?}");
            assert!(touches || x > 0.1 - radius, "{name} at {x}");
        }
        assert!(was_in_contact > 20, "{name}");
    }
}

#[test]
fn whichever_is_called_a_the_forces_are_equal_and_opposite() {
    let (mut tried, mut others) = (0, Vec::new());
    for (name, a, b) in pairs() {
        let mut noise = Noise(6);
        if !is_collidable(&b.into(), &a.into()) {
            continue;
        }
        for _ in 0..6 {
            let (X_WA, X_WB, mut memory) = overlapping(&a, &b, 2e-4, &mut noise);
            let about = X_WB.translation.vector;
            let [force, torque] = wrench(&points(&a, &X_WA, &b, &X_WB, REACH, &mut memory), &about);
            // It came the same way.
            let mut memory = PairMemory::default();
            for step in (0..200).rev() {
                let n = force.normalize();
                let X = pose(X_WA.rotation, X_WA.translation.vector + n * (1e-5 * f64::from(step)));
                points(&b, &X_WB, &a, &X, REACH, &mut memory);
            }
            let swapped = points(&b, &X_WB, &a, &X_WA, REACH, &mut memory);
            let [opposite, turned] = wrench(&swapped, &about);
            tried += 1;
            // What a search leaves open of a normal is 1e-4 on curved pieces, and of two points that lie together
            // the one that counts less is another one.
            let off = (force + opposite).norm() / force.norm();
            // A's and B's point lie a depth apart, 2e-4 m.
            let apart = (torque + turned).norm() / force.norm();
            if off > 1e-2 || apart > 5e-4 {
                others.push((name.clone(), off, apart, deepest(&swapped)));
            }
        }
    }
    // Where two ways out are as long, one may come by either.
    assert!(others.len() * 100 <= tried, "{} of {tried}: {others:?}", others.len());
    assert!(others.iter().all(|(_, _, _, gap)| *gap > -2.2e-4), "{others:?}");
}

#[test]
fn pushed_in_to_half_its_thickness_nothing_is_turned_round() {
    for (name, a, b) in pairs() {
        let mut noise = Noise(8);
        for _ in 0..4 {
            let (X_WA, X_WB, mut memory) = overlapping(&a, &b, 1e-4, &mut noise);
            let start = points(&a, &X_WA, &b, &X_WB, REACH, &mut memory);
            let n = wrench(&start, &Vector3::zeros())[0].normalize();
            // The thinnest is a tube of 2 cm.
            for step in 0..40 {
                let X = pose(X_WA.rotation, X_WA.translation.vector - n * (2.5e-4 * f64::from(step)));
                let found = points(&a, &X, &b, &X_WB, REACH, &mut memory);
                let force = wrench(&found, &Vector3::zeros())[0];
                assert!(force.dot(&n) > 0.0, "{name} {step}: {n} {found:?}");
            }
        }
    }
}

#[test]
fn every_number_is_finite_and_every_point_has_a_name_of_its_own() {
    for (name, a, b) in pairs() {
        let mut noise = Noise(9);
        let mut memory = PairMemory::default();
        for trial in 0..300 {
            let size = [0.0, 1e-12, 0.01, 0.05, 1e3, 1e150][trial % 6];
            let mut X_WA = pose(noise.turn(), noise.direction() * size);
            let X_WB = pose(noise.turn(), Vector3::zeros());
            if trial % 50 == 49 {
                X_WA.translation.x = [f64::NAN, f64::INFINITY][trial / 50 % 2];
            }
            let found = points(&a, &X_WA, &b, &X_WB, [1e-3, 1.0][trial % 2], &mut memory);
            for (at, point) in found.iter().enumerate() {
                assert!(point.gap_m.is_finite() && point.point_W.iter().all(|x| x.is_finite()), "{name}");
                assert!((point.normal_W.norm() - 1.0).abs() < 1e-9, "{name} {point:?}");
                assert!(found[..at].iter().all(|other| other.id != point.id), "{name}: {found:?}");
            }
        }
    }
}
