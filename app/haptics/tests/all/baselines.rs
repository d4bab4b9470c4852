//! The baselines that the Friction Cone Algorithm is compared with: what they do, and where they fail.
#![allow(non_snake_case)]

use crate::common;

use std::sync::Arc;

use common::*;
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Algorithm, Entity, Friction, Plane, Shape, Sphere};
use nalgebra::Vector3;

fn shape_of(soup: TriangleSoup) -> Shape {
    Arc::new(Mesh::build(soup).unwrap().0).into()
}

fn rendered_by(algorithm: Algorithm, shape: impl Into<Shape>) -> Entity {
    entity(shape, Friction::None).with_algorithm(algorithm)
}

/// Forces along a straight path of 0.1 mm steps.
fn forces(entity: &Entity, from: Vector3<f64>, to: Vector3<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let mut finger = point_finger();
    let steps = ((to - from).norm() / 1e-4).ceil();
    let along = |i: f64| from + (to - from) * (i / steps);
    let hips = (0..=steps as u32).map(|i| along(f64::from(i)));
    hips.map(|hip| (hip, finger.step(std::slice::from_ref(entity), &hip, DT).force_on_user_W)).collect()
}

#[test]
fn a_vector_field_pushes_a_ball_s_finger_away_from_its_centre_by_depth() {
    // Figure 3.1.
    let ball = rendered_by(Algorithm::VectorField, Sphere::new(0.1).unwrap());
    let mut noise = Noise(1);
    for _ in 0..10_000 {
        let hip = noise.vector(0.06);
        let mut finger = point_finger();
        let out = finger.step(std::slice::from_ref(&ball), &hip, DT);
        let depth = 0.1 - hip.norm();
        assert_eq!(out.entity.is_some(), depth >= 0.0);
        let expected = if depth >= 0.0 { hip.normalize() * (K * depth) } else { Vector3::zeros() };
        // Some roundings of 50 N.
        assert!((out.force_on_user_W - expected).norm() < 1e-13, "{hip}");
    }
}

#[test]
fn a_vector_field_s_force_jumps_where_another_face_of_a_cube_becomes_the_nearest() {
    // Figure 3.2: along a path 20 mm below the top of a cube of 100 mm, from the top's sector into the right one.
    let cube = rendered_by(Algorithm::VectorField, shape_of(make::cuboid([0.1; 3])));
    let path = forces(&cube, Vector3::new(0.0, 0.03, 0.004), Vector3::new(0.045, 0.03, 0.004));
    let turns = |pair: &&[(Vector3<f64>, Vector3<f64>)]| (pair[1].1 - pair[0].1).norm() > 1.0;
    let jumps: Vec<_> = path.windows(2).filter(turns).collect();
    assert_eq!(jumps.len(), 1, "one border between sectors");
    let [(_, before), (hip, after)] = jumps[0] else { panic!() };
    assert!((hip.x - 0.03).abs() <= 1e-4, "where both faces are equally near: {hip}");
    assert!((before - Vector3::new(0.0, K * 0.02, 0.0)).norm() < 1e-12, "{before}");
    // Up to one step of 0.1 mm less deep.
    assert!((after - Vector3::new(K * 0.02, 0.0, 0.0)).norm() <= K * 1e-4, "{after}");
}

#[test]
fn a_vector_field_is_pushed_through_where_a_god_object_holds() {
    // A plate of 10 mm, pressed from above right through.
    let (above, below) = (Vector3::new(0.003, 0.01, 0.002), Vector3::new(0.003, -0.004, 0.002));
    let plate = || shape_of(make::cuboid([0.1, 0.01, 0.1]));
    let last = |algorithm| forces(&rendered_by(algorithm, plate()), above, below).last().unwrap().1;
    assert!(last(Algorithm::VectorField).y < 0.0, "out at the far side");
    let held = last(Algorithm::ClassicGodObject);
    // A rounding of positions of 0.01 m, times 500 N/m.
    assert!((held - Vector3::new(0.0, K * 0.009, 0.0)).norm() < 1e-14, "back up: {held}");
}

#[test]
fn a_vector_field_cannot_render_what_has_no_inside() {
    let bottle = rendered_by(Algorithm::VectorField, shape_of(make::klein_bottle(32, 16, 0.1)));
    for (_, force) in forces(&bottle, Vector3::new(-0.2, 0.01, 0.0), Vector3::new(0.2, 0.01, 0.0)) {
        assert_eq!(force, Vector3::zeros());
    }
}

#[test]
fn the_classic_god_object_is_the_closed_form_on_planes_and_balls() {
    let plane = Shape::from(Plane::new(Vector3::new(1.0, 2.0, -0.5), 0.01).unwrap());
    for shape in [plane, Sphere::new(0.1).unwrap().into()] {
        let classic = rendered_by(Algorithm::ClassicGodObject, shape.clone());
        let (mut finger, mut noise, mut hip) = (point_finger(), Noise(2), Vector3::new(0.3, 0.3, 0.3));
        let mut touched = 0;
        for _ in 0..50_000 {
            hip = hip * 0.999 + noise.vector(2e-3);
            let out = finger.step(std::slice::from_ref(&classic), &hip, DT);
            let expected = closed_form_god_object(&shape, &hip);
            assert_eq!(out.entity.is_some(), expected.is_some());
            let Some(expected) = expected else { continue };
            // Rounds shrink the error by 1 - rho / r each: 256 of them leave nothing above three tenths of the radius.
            if hip.norm() > 0.03 {
                touched += 1;
                assert!((out.god_object_W - expected).norm() < 1e-15, "{hip}");
            }
        }
        assert!(touched > 5000, "{touched}");
    }
}

#[test]
fn the_classic_god_object_slides_off_a_cube_s_edge_onto_the_next_face() {
    let cube = rendered_by(Algorithm::ClassicGodObject, shape_of(make::cuboid([0.1; 3])));
    let mut finger = point_finger();
    let mut at = |x: f64, y: f64| {
        let out = finger.step(std::slice::from_ref(&cube), &Vector3::new(x, y, 0.007), DT);
        (out.god_object_W, out.entity)
    };
    at(0.03, 0.06);
    assert_eq!(at(0.03, 0.045), (Vector3::new(0.03, 0.05, 0.007), Some(0)));
    assert_eq!(
        at(0.049, 0.045),
        (Vector3::new(0.049, 0.05, 0.007), Some(0)),
        "still on top, 1 mm from the edge"
    );
    assert_eq!(at(0.051, 0.045), (Vector3::new(0.051, 0.045, 0.007), None), "past the edge it is free");
    assert_eq!(at(0.048, 0.044), (Vector3::new(0.05, 0.044, 0.007), Some(0)), "and comes in from the side");
}

#[test]
fn the_classic_god_object_rests_in_a_concave_edge_and_in_a_corner() {
    // Between two rays of a star, 30 mm from its axis along this direction, there is a concave edge along y.
    let star = rendered_by(Algorithm::ClassicGodObject, shape_of(make::star(5, 0.1, 0.03, 0.04)));
    let (sin, cos) = (std::f64::consts::PI / 5.0).sin_cos();
    let towards = Vector3::new(cos, 0.0, sin);
    let mut outward = towards;
    outward.z = -outward.z;
    // The generator turns z into -y and back: whichever way round, one of the two is met.
    let held = [towards, outward].map(|towards| {
        let path = forces(&star, towards * 0.05, towards * 0.025);
        (path.last().unwrap().1, towards)
    });
    for (force, towards) in held {
        // 5 mm behind the edge; a rounding of positions times 500 N/m.
        assert!((force - towards * (K * 5e-3)).norm() < 1e-13, "{force}");
    }
}

#[test]
fn a_baseline_that_begins_inside_comes_on_slowly_too() {
    let mut finger = haptics::Finger::new(0.0, 1).unwrap();
    let hip = Vector3::new(0.0, 0.09, 0.0);
    for algorithm in [Algorithm::VectorField, Algorithm::ClassicGodObject] {
        finger.reset();
        let ball = rendered_by(algorithm, Sphere::new(0.1).unwrap());
        let mut force = || finger.step(std::slice::from_ref(&ball), &hip, DT).force_on_user_W.y;
        let first = force();
        // A hundredth of 5 N in the first tick of 0.1 s.
        assert!((first - 0.05).abs() < 1e-12, "{first}");
        assert!((0..99).map(|_| force()).last().unwrap() > 4.99);
    }
}
