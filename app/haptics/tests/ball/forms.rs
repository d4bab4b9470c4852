//! Balls against forms that a ball feels in triangles only: rings that it does not fit through, and scaled forms.

use crate::common::meshes::step;
use crate::common::*;
use haptics::{Capsule, Cuboid, Ellipsoid, Sphere};
use haptics::{Cone, Cylinder, Entity, Form, Friction, Plane, Scaled, Shape, Torus};
use nalgebra::Vector3;
use std::slice::from_ref;

fn all() -> Vec<Form> {
    let scaled = |form: Form| Scaled::new(form, [1.0, 0.8, 2.0]).unwrap();
    let (cylinder, cone): (Form, Form) =
        (Cylinder::new(0.05, 0.04).unwrap().into(), Cone::new(0.05, 0.0, 0.04).unwrap().into());
    let (ring, pill): (Form, Form) =
        (Torus::new(0.05, 0.02).unwrap().into(), Capsule::new(0.03, 0.04).unwrap().into());
    vec![
        Plane::new(Vector3::y(), 0.0).unwrap().into(),
        Sphere::new(0.05).unwrap().into(),
        Cuboid::new([0.1; 3]).unwrap().into(),
        Ellipsoid::new([0.05, 0.02, 0.03]).unwrap().into(),
        scaled(cylinder),
        scaled(cone),
        scaled(ring),
        scaled(pill),
        cylinder,
        cone,
        ring,
        pill,
    ]
}

#[test]
fn every_form_is_felt_by_every_ball() {
    for form in all() {
        for radius_m in [1e-4, 0.01, 0.031, 0.5] {
            let entity = entity(form, Friction::None).prepared_for(radius_m);
            assert!(entity.is_felt_by(radius_m), "{form:?} {radius_m}");
            assert!(entity.is_felt_by(0.0));
            let mut finger = finger(radius_m);
            // Down over the tube of a ring, then down the axis.
            let touched = (0..400).any(|i| {
                let y = (1.0 + radius_m) * (1.0 - f64::from(i % 200) / 199.0) - 0.02;
                let x = if i < 200 { 0.045 } else { 0.0 };
                step(&mut finger, &entity, &Vector3::new(x, y, 0.0)).entity.is_some()
            });
            assert!(touched, "{form:?} {radius_m}");
        }
    }
}

#[test]
fn a_point_feels_the_form_itself_also_beside_triangles() {
    let form = Torus::new(0.05, 0.02).unwrap();
    let (plain, prepared) = (entity(form, stiction()), entity(form, stiction()).prepared_for(0.04));
    let mut fingers = [finger(0.0), finger(0.0)];
    for i in 0..500 {
        let t = f64::from(i) * 0.01;
        let hip = Vector3::new(0.05 * t.cos(), 0.019 + 2e-3 * (3.0 * t).sin(), 0.05 * t.sin());
        let [a, b] = [step(&mut fingers[0], &plain, &hip), step(&mut fingers[1], &prepared, &hip)];
        assert_eq!(a, b);
    }
}

/// A ball of 31 mm cannot go through a hole of 30.
#[test]
fn a_ball_that_is_too_large_for_a_hole_rests_on_its_rim_all_around() {
    let radius_m = 0.031;
    let ring = Torus::new(0.05, 0.02).unwrap();
    assert!(!Shape::from(ring).is_felt_by(radius_m));
    let entity: Entity = entity(ring, Friction::None).prepared_for(radius_m);
    let mut finger = finger(radius_m);
    // Where the tube's middle line and the ball's centre are 51 mm apart.
    let height = (0.051_f64.powi(2) - 0.05_f64.powi(2)).sqrt();
    let lowered = |i: u32, to: Vector3<f64>| {
        let share = f64::from(i) / 200.0;
        Vector3::new(0.004, 0.06, 0.003) * (1.0 - share) + to * share
    };
    for aside in [Vector3::zeros(), Vector3::new(2e-3, 0.0, 1e-3)] {
        let hip = Vector3::new(0.0, height - 4e-3, 0.0) + aside;
        let mut out = None;
        for i in 0..=200 {
            out = Some(step(&mut finger, &entity, &lowered(i, hip)));
        }
        for _ in 0..50 {
            out = Some(step(&mut finger, &entity, &hip));
        }
        let out = out.unwrap();
        // Chords of the tube are up to 1.4 um inside of it and lift less: at the slope of 50 / 10, seven times that.
        assert!((out.god_object_W - Vector3::new(0.0, height, 0.0)).norm() < 2e-5, "{}", out.god_object_W);
        let expected = (Vector3::new(0.0, height, 0.0) - hip) * K;
        assert!((out.force_on_user_W - expected).norm() < 2e-5 * K, "{} {expected}", out.force_on_user_W);
        let points = finger.touch_points(from_ref(&entity), 0);
        assert!(points.as_slice().len() >= 2, "{points:?}");
    }
}

#[test]
fn a_ball_on_a_scaled_cylinder_touches_cap_and_side_where_they_are() {
    let form = Scaled::new(Cylinder::new(0.05, 0.04).unwrap().into(), [1.0, 1.5, 2.0]).unwrap();
    let radius_m = 8e-3;
    let entity = entity(form, stiction()).prepared_for(radius_m);
    for (way, surface_m) in [(Vector3::y(), 0.03), (Vector3::x(), 0.05), (-Vector3::z(), 0.1)] {
        let mut finger = finger(radius_m);
        for i in 0..200 {
            let height_m = surface_m + radius_m + 0.01 - 7e-5 * f64::from(i);
            let out = step(&mut finger, &entity, &(way * height_m));
            let depth_m = surface_m + radius_m - height_m;
            // Chords of 1/384 of a turn: 3.4e-5 of up to 0.1 m.
            let expected = way * (K * depth_m.max(0.0));
            assert!((out.force_on_user_W - expected).norm() < 4e-6 * K, "{way} {i}: {}", out.force_on_user_W);
        }
    }
}
