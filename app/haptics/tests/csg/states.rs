//! The god-object's states on a tree of shapes and every transition between them (Melder fig. 9.4).
//!
//! FS free space, P patch (the thesis' primitive), E edge, C corner.

use crate::common::*;
use crate::trees::{self, cuboid, touchable, v};
use haptics::{CsgPart, CsgTree, Entity, Feature, Finger, FingerOutput, Friction, Plane};
use nalgebra::Vector3;

fn step(finger: &mut Finger, entity: &Entity, hip: Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), &hip, DT)
}

/// Three walls: free where x, y and z are positive.
fn room(friction: Friction) -> Entity {
    let wall = |normal| CsgPart::from(Plane::new(normal, 0.0).unwrap());
    touchable(&CsgTree::union([Vector3::x(), Vector3::y(), Vector3::z()].map(wall)), friction)
}

const FREE: [f64; 3] = [0.01, 0.01, 0.01];
const ON_FLOOR: [f64; 3] = [0.01, -0.002, 0.01];
const ON_EDGE: [f64; 3] = [-0.003, -0.002, 0.01];
const IN_CORNER: [f64; 3] = [-0.003, -0.002, -0.001];

fn feature(out: &FingerOutput) -> Feature {
    out.feature
}

/// Where the god-object must be, and what it rests on: the HIP without its negative coordinates.
fn check(out: &FingerOutput, hip: [f64; 3]) {
    let expected = Vector3::from(hip).map(|x| x.max(0.0));
    // Planes through the origin: nothing to round but the way along them.
    assert!((out.god_object_W - expected).norm() < 1e-17, "{hip:?} {out:?}");
    let force = (expected - Vector3::from(hip)) * K;
    assert!((out.force_on_user_W - force).norm() < 1e-14, "{hip:?} {out:?}");
    let walls = hip.iter().filter(|x| **x < 0.0).count();
    assert_eq!(
        feature(out),
        [Feature::None, Feature::Face, Feature::Edge, Feature::Vertex][walls],
        "{hip:?}"
    );
}

#[test]
fn every_transition_of_a_concave_corner_takes_one_tick() {
    let entity = room(Friction::None);
    let all = [FREE, ON_FLOOR, ON_EDGE, IN_CORNER];
    for from in all {
        for to in all {
            let mut finger = point_finger();
            step(&mut finger, &entity, Vector3::from(FREE));
            check(&step(&mut finger, &entity, Vector3::from(from)), from);
            check(&step(&mut finger, &entity, Vector3::from(to)), to);
            check(&step(&mut finger, &entity, Vector3::from(from)), from);
        }
    }
}

#[test]
fn every_order_of_walls_makes_the_same_corner() {
    let walls = [Vector3::x(), Vector3::y(), Vector3::z()];
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let parts = order.map(|i: usize| CsgPart::from(Plane::new(walls[i], 0.0).unwrap()));
        let entity = touchable(&CsgTree::union(parts), Friction::None);
        let mut finger = point_finger();
        for hip in [FREE, ON_FLOOR, IN_CORNER, ON_EDGE, FREE] {
            check(&step(&mut finger, &entity, Vector3::from(hip)), hip);
        }
    }
}

/// Stuck on the floor the god-object lags; drawn to the wall it stops there and goes on along the edge, in one tick.
#[test]
fn friction_drags_along_a_concave_edge_and_holds_in_the_corner() {
    let mu = 0.3;
    let entity = room(Friction::coulomb(mu).unwrap());
    let mut finger = point_finger();
    step(&mut finger, &entity, Vector3::from(FREE));
    step(&mut finger, &entity, Vector3::from(ON_FLOOR));
    for i in 1..=2000 {
        let t = f64::from(i) / 2000.0;
        let hip = Vector3::from(ON_FLOOR).lerp(&Vector3::new(-0.003, -0.002, 0.05), t);
        let out = step(&mut finger, &entity, hip);
        let god = out.god_object_W;
        if god.x > 0.0 {
            continue;
        }
        // On an edge the depth is that below the edge, and the circle is mu times as large.
        let depth = hip.x.hypot(hip.y);
        let lag = (god.z - hip.z).abs();
        assert!(lag <= mu * depth * (1.0 + 1e-9), "{lag} {depth} {out:?}");
        if t > 0.9 {
            assert!((lag - mu * depth).abs() < 1e-9 * depth, "{lag} {depth} {out:?}");
            assert_eq!(feature(&out), Feature::Edge);
        }
    }
    // So far behind the corner that the circle does not reach back out of it.
    let out = step(&mut finger, &entity, v(-0.003, -0.002, -0.005));
    assert_eq!(feature(&out), Feature::Vertex);
    assert_eq!(out.god_object_W, Vector3::zeros());
}

/// P to E to P in one tick, without a stop: pressed through a thin plate and out over its rim.
#[test]
fn over_a_convex_edge_the_next_patch_takes_over_and_lets_go() {
    let plate = touchable(&CsgTree::intersection([cuboid([0.1, 2e-3, 0.1])]), Friction::None);
    let mut finger = point_finger();
    step(&mut finger, &plate, v(0.0, 0.01, 0.0));
    // Pressed right through it still holds.
    let out = step(&mut finger, &plate, v(0.0, -0.01, 0.0));
    assert!((out.god_object_W - v(0.0, 1e-3, 0.0)).norm() < 1e-17 && feature(&out) == Feature::Face);
    let out = step(&mut finger, &plate, v(0.049, -0.01, 0.0));
    assert!((out.force_on_user_W.y - K * 0.011).abs() < 1e-12, "{out:?}");
    // Beyond the rim nothing is in the way any more.
    assert_eq!(step(&mut finger, &plate, v(0.051, -0.01, 0.0)).entity, None);
}

/// E to FS at an acute convex edge: in front of one of its planes is enough (Melder fig. 9.7).
#[test]
fn at_an_acute_edge_the_finger_is_free_in_front_of_either_plane() {
    // Below both planes; they meet in the z axis under 40 degrees.
    let half = 20f64.to_radians();
    let flank = |side: f64| Plane::new(v(side * half.cos(), half.sin(), 0.0), 0.0).unwrap();
    let wedge = touchable(&CsgTree::intersection([flank(1.0), flank(-1.0)]), Friction::None);
    // Beyond the edge as the flank that holds sees it; beside it below the edge the finger is pressed right through.
    for hip in [v(1e-3, -1e-4, 0.0), v(-1e-3, -1e-4, 0.0), v(0.0, 1e-3, 0.0)] {
        let mut finger = point_finger();
        step(&mut finger, &wedge, v(0.002, 0.004, 0.0));
        let out = step(&mut finger, &wedge, v(0.0, -1e-3, 1e-3));
        assert!(out.entity.is_some(), "{out:?}");
        assert_eq!(step(&mut finger, &wedge, hip).entity, None, "{hip:?}");
    }
}

/// The wall of a bore pushes to its axis: the normal of what is taken away is turned.
#[test]
fn a_difference_turns_the_normals_of_what_it_takes_away() {
    let entity = touchable(&trees::bored_box().tree, Friction::None);
    let mut finger = point_finger();
    step(&mut finger, &entity, v(0.01, 0.0, 0.0));
    let out = step(&mut finger, &entity, v(0.012, 0.003, 0.0182));
    let rho = 0.012f64.hypot(0.0182);
    let expected = -v(0.012, 0.0, 0.0182) / rho * (rho - 0.02) * K;
    assert!((out.force_on_user_W - expected).norm() < 1e-12, "{out:?}");
    assert_eq!(feature(&out), Feature::Surface);
    // From the wall over the rim to the top, in one tick each: E to P on a curved convex edge.
    let mut finger = point_finger();
    step(&mut finger, &entity, v(0.01, 0.0, 0.0));
    step(&mut finger, &entity, v(0.021, 0.015, 0.0));
    let out = step(&mut finger, &entity, v(0.022, 0.0205, 0.0));
    assert_eq!(out.entity, None, "above the top it is free: {out:?}");
}

/// Two walls that are round: the crease between two balls is a circle, and the god-object is on both.
#[test]
fn on_a_crease_of_two_balls_the_god_object_lies_on_both() {
    let entity = touchable(&trees::two_balls().tree, Friction::None);
    // 0.05^2 - (x + 0.03)^2 = 0.04^2 - (x - 0.03)^2.
    let x = (0.05f64.powi(2) - 0.04f64.powi(2)) / 0.12;
    let radius = (0.05f64.powi(2) - (x + 0.03f64).powi(2)).sqrt();
    let mut finger = point_finger();
    step(&mut finger, &entity, v(x, 0.06, 0.0));
    for i in 0..=1000 {
        let phi = 4.0 * f64::from(i) / 1000.0;
        let out = step(&mut finger, &entity, v(x, (radius - 3e-3) * phi.cos(), (radius - 3e-3) * phi.sin()));
        let expected = v(x, radius * phi.cos(), radius * phi.sin());
        // Slides on circles end where what is left is 1e-12 of the depth.
        assert!((out.god_object_W - expected).norm() < 1e-13, "{i} {out:?} {expected:?}");
        assert_eq!(feature(&out), Feature::Edge);
        assert!((out.force_on_user_W.norm() - K * 3e-3).abs() < 1e-11);
    }
}

/// Four bricks around an edge, two of them missing crosswise: each of the two wedges of air is a room of its own.
#[test]
fn two_wedges_that_touch_in_an_edge_leave_no_way_between_them() {
    let brick = |x, y| CsgPart::at(cuboid([0.02, 0.02, 0.02]), v(x, y, 0.0));
    let entity = touchable(&CsgTree::union([brick(0.01, 0.01), brick(-0.01, -0.01)]), Friction::None);
    let mut finger = point_finger();
    step(&mut finger, &entity, v(0.005, -0.005, 0.0));
    for (hip, god) in [
        (v(0.005, 0.001, 0.0), v(0.005, 0.0, 0.0)),
        (v(0.001, 0.002, 0.0), v(0.001, 0.0, 0.0)),
        // Behind the edge, in the other room: held by the edge.
        (v(-0.002, 0.002, 0.0), v(0.0, 0.0, 0.0)),
        (v(-0.001, -0.004, 0.0), v(0.0, -0.004, 0.0)),
    ] {
        let out = step(&mut finger, &entity, hip);
        assert!((out.god_object_W - god).norm() < 1e-16, "{hip:?} {out:?}");
    }
}
