//! Balls, rings and cylinders as NURBS against their closed forms, where those are exact.

use crate::common::*;
use haptics::mesh::Sides;
use haptics::nurbs::make;
use haptics::{Cylinder, Finger, Form, Friction, Nurbs, NurbsPatch, Sphere, Surface, Torus};
use nalgebra::Vector3;
use std::sync::Arc;

fn built(patches: &[NurbsPatch]) -> Arc<Nurbs> {
    Arc::new(Nurbs::build(patches).unwrap().0)
}

/// Each form, as patches, and as itself.
fn pairs() -> Vec<(&'static str, Arc<Nurbs>, Form)> {
    vec![
        ("ball", built(&make::sphere(0.05)), Sphere::new(0.05).unwrap().into()),
        ("ring", built(&make::torus(0.05, 0.015)), Torus::new(0.05, 0.015).unwrap().into()),
        ("cylinder", built(&make::cylinder(0.03, 0.08)), Cylinder::new(0.03, 0.08).unwrap().into()),
    ]
}

#[test]
fn exact_forms_are_closed_and_where_they_should_be() {
    for (name, nurbs, form) in pairs() {
        assert_eq!(nurbs.sides(), Sides::Solid, "{name}");
        for part in 0..nurbs.parts() {
            for (i, j) in (0..=20).flat_map(|j| (0..=20).map(move |i| (i, j))) {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let (point, normal) = nurbs.at(part, u, v);
                // Roundings of coordinates up to 0.065.
                assert!(form.signed_distance(&point).abs() < 1e-16, "{name} {part} {u} {v}");
                // Outward by a little, the form's own normal; on creases the patch's side counts.
                let expected = form.nearest(&(point + normal * 1e-3)).normal_B;
                assert!((normal - expected).norm() < 1e-12, "{name} {part} {u} {v} {normal} {expected}");
            }
        }
    }
}

#[test]
fn the_nearest_point_is_the_closed_forms() {
    for (name, nurbs, form) in pairs() {
        let surface = nurbs.surface(0.0);
        let mut noise = Noise(1);
        for i in 0..20_000 {
            let p = noise.vector(0.04);
            let (here, there) = (surface.nearest(&p), form.nearest(&p));
            let (a, b) = ((here.point_B - p).norm(), (there.point_B - p).norm());
            assert!((a - b).abs() < 1e-13, "{name} {i}: {p:?} {a} {b}");
            assert!((surface.signed_distance(&p) < 0.0) == (form.signed_distance(&p) < 0.0), "{name} {i}");
        }
    }
}

/// All of the ball is almost equally far from there, and Newton's matrix almost nothing.
#[test]
fn near_the_middle_of_a_ball_the_nearest_point_is_the_closed_forms() {
    let [(_, nurbs, form), ..] = &pairs()[..] else { panic!("a ball") };
    let surface = nurbs.surface(0.0);
    let mut noise = Noise(3);
    for i in 0..200 {
        let p = noise.vector(1.0).normalize() * noise.between(1e-4, 2e-3);
        let (here, there) = (surface.nearest(&p), form.nearest(&p));
        let (a, b) = ((here.point_B - p).norm(), (there.point_B - p).norm());
        assert!((a - b).abs() < 1e-13, "{i}: {p:?} {a} {b}");
    }
}

/// Round the form, over poles and seams, between 2 mm off it and 4 mm deep: less than any radius of curvature, since
/// deeper a god-object may choose its way out.
fn path(i: u32, form: &Form, radius_m: f64) -> Vector3<f64> {
    let t = f64::from(i) * DT;
    let far = Vector3::new((1.1 * t).sin(), 0.9 * (1.7 * t).cos(), (0.9 * t).cos()) * 0.5;
    let at = form.nearest(&far);
    // Not along the very edge of a cylinder, where two sides are equally near.
    let aside = Vector3::new(3.1e-4, 2.3e-4, -1.7e-4);
    aside + at.point_B + at.normal_B * (radius_m - 0.001 + 0.003 * (2.3 * t).sin())
}

#[test]
fn along_the_standard_path_forces_are_those_of_the_closed_form() {
    for (name, nurbs, form) in pairs() {
        for friction in [Friction::None, Friction::coulomb(0.3).unwrap(), stiction()] {
            let (a, b) = ([entity(nurbs.clone(), friction.clone())], [entity(form, friction.clone())]);
            let (mut one, mut other) = (point_finger(), point_finger());
            let mut touched = 0;
            for i in 0..20_000 {
                let hip = path(i, &form, 0.0);
                let (here, there) = (one.step(&a, &hip, DT), other.step(&b, &hip, DT));
                assert_eq!(here.entity, there.entity, "{name} {friction:?} {i}");
                let off = (here.force_on_user_W - there.force_on_user_W).norm();
                // 1e-9 of the force as promised; a force that has just begun is rounding of positions, K * 1e-15 m.
                let allowed = 1e-9 * there.force_on_user_W.norm() + K * 1e-13;
                assert!(off <= allowed, "{name} {friction:?} {i}: {off} {here:?} {there:?}");
                touched += u32::from(here.entity.is_some());
            }
            assert!(touched > 5000, "{name}: {touched}");
        }
    }
}

#[test]
fn spherical_fingers_feel_what_the_closed_form_gives_them() {
    for (name, nurbs, form) in pairs() {
        // Around an edge the closed form slides piece by piece, which turns a slide's direction a little.
        let friction = if name == "cylinder" { Friction::None } else { Friction::coulomb(0.3).unwrap() };
        let (a, b) = ([entity(nurbs.clone(), friction.clone())], [entity(form, friction)]);
        let (mut one, mut other) = (finger(0.006), finger(0.006));
        let mut touched = 0;
        for i in 0..20_000 {
            let hip = path(i, &form, 0.006);
            let (here, there) = (one.step(&a, &hip, DT), other.step(&b, &hip, DT));
            assert_eq!(here.entity, there.entity, "{name} {i} {hip:?}");
            let off = (here.force_on_user_W - there.force_on_user_W).norm();
            let allowed = 1e-9 * there.force_on_user_W.norm() + K * 1e-13;
            assert!(off <= allowed, "{name} {i}: {off} {here:?} {there:?}");
            touched += u32::from(here.entity.is_some());
        }
        assert!(touched > 5000, "{name}: {touched}");
    }
}

#[test]
fn a_finger_that_begins_inside_is_pushed_out_slowly() {
    let nurbs = built(&make::sphere(0.05));
    let entities = [entity(nurbs, Friction::None)];
    let mut finger = Finger::new(0.0, 1).unwrap();
    let hip = Vector3::new(0.03, 0.0, 0.02);
    let depth = 0.05 - hip.norm();
    for tick in 1..=200 {
        let out = finger.step(&entities, &hip, DT);
        // 100 ms until all of it is felt.
        let share = (f64::from(tick) / 100.0).min(1.0);
        let off = out.force_on_user_W - hip.normalize() * (K * depth * share);
        assert!(off.norm() < 1e-11, "{tick} {out:?}");
    }
}

#[test]
fn crept_along_the_surface_does_not_fade() {
    let radius = 0.05;
    let entities = [entity(built(&make::sphere(radius)), Friction::None)];
    let mut finger = point_finger();
    let at = |i: u32| {
        // Steps of half a micron: short enough to be made without a look at the surface.
        let angle = 0.3 + f64::from(i) * 5e-7 / radius;
        Vector3::new(angle.cos() * 0.8, angle.sin(), angle.cos() * 0.6)
    };
    finger.step(&entities, &(at(0) * 0.06), DT);
    for i in 0..40_000 {
        let out = finger.step(&entities, &(at(i) * 0.048), DT);
        // 1e-9 of the force.
        assert!((out.force_on_user_W - at(i) * (K * 0.002)).norm() < 1e-9, "{i} {out:?}");
    }
}
