//! Balls that roam about meshes of every kind: they never come nearer than their radius, never through, never stick.

use std::sync::Arc;

use crate::common::meshes::{
    Roaming, built, bumpy_sphere, cube, plate, star, step, touchable, unit_vector, wedge,
};
use crate::common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, make};
use nalgebra::Vector3;

fn meshes() -> Vec<(&'static str, Arc<Mesh>)> {
    vec![
        ("cube", cube()),
        ("plate", plate()),
        ("star", star()),
        ("sharp wedge", built(wedge(20.0))),
        ("groove", built(wedge(300.0))),
        ("fold", built(wedge(181.0))),
        ("bumpy ball", bumpy_sphere(100)),
        ("torus", built(make::torus(60, 30, 0.05, 0.02))),
        ("Klein bottle", built(make::klein_bottle(60, 30, 0.1))),
        ("Moebius strip", built(make::mobius_strip(60, 4, 0.08, 0.04))),
    ]
}

#[test]
fn a_ball_is_never_nearer_to_a_mesh_than_its_radius() {
    for (name, mesh) in meshes() {
        for radius_m in [1e-3, 4e-3, 0.015] {
            for (friction, step_m) in
                [(Friction::None, 5e-4), (Friction::coulomb(0.6).unwrap(), 5e-4), (stiction(), 4e-3)]
            {
                let entity = touchable(&mesh, friction);
                let mut finger = finger(radius_m);
                let mut roaming = Roaming::new(7, 0.13, step_m);
                let (mut touched, mut free) = (0, 0);
                for tick in 0..8000 {
                    let hip = roaming.next();
                    let out = step(&mut finger, &entity, &hip);
                    assert!(out.force_on_user_W.iter().all(|f| f.is_finite()));
                    let gap_m = mesh.nearest(&out.god_object_W).distance_m - radius_m;
                    // Ten times what the ball itself takes for touching.
                    assert!(gap_m > -1e-8 * radius_m - 1e-11, "{name} {radius_m} {tick}: {gap_m:e}");
                    assert!(!mesh.is_inside(&out.god_object_W), "{name} {radius_m} {tick}");
                    if out.entity.is_some() { touched += 1 } else { free += 1 }
                }
                assert!(touched > 300 && free > 300, "{name} {radius_m} {step_m}: {touched} {free}");
            }
        }
    }
}

/// The oracle tries many places near the ball, all triangles looked at: none that has room may be nearer to the HIP.
#[test]
fn a_ball_without_friction_comes_to_rest_where_no_place_nearby_is_nearer_to_the_hip() {
    for (name, mesh) in meshes() {
        for radius_m in [1e-3, 4e-3, 0.015] {
            let entity = touchable(&mesh, Friction::None);
            let mut finger = finger(radius_m);
            let mut roaming = Roaming::new(11, 0.11, 1e-3);
            let mut noise = Noise(3);
            let mut tried = 0;
            for tick in 0..4000 {
                let hip = roaming.next();
                let mut out = step(&mut finger, &entity, &hip);
                if tick % 20 != 0 || out.entity.is_none() {
                    continue;
                }
                for _ in 0..10 {
                    out = step(&mut finger, &entity, &hip);
                }
                let centre = out.god_object_W;
                let reach = (centre - hip).norm();
                tried += 1;
                for _ in 0..200 {
                    let there = centre + unit_vector(&mut noise) * (1e-3 * radius_m);
                    let has_room = mesh.nearest(&there).distance_m >= radius_m;
                    // A step of 1e-3 r along a surface curved by 1/r gains up to half of its square over r.
                    let nearer = reach - (there - hip).norm();
                    assert!(
                        !(has_room && nearer > 2e-5 * radius_m),
                        "{name} {radius_m} {tick}: {nearer:e} at {centre:?} for {hip:?} {out:?}"
                    );
                }
            }
            assert!(tried > 10, "{name} {radius_m}: {tried}");
        }
    }
}

#[test]
fn a_ball_as_large_as_a_fine_mesh_stays_outside_of_it() {
    let mesh = bumpy_sphere(500);
    for radius_m in [0.03, 0.1, 1.0] {
        let entity = touchable(&mesh, Friction::None);
        let mut finger = finger(radius_m);
        let mut touched = 0;
        for tick in 0..300 {
            let t = f64::from(tick) * 0.02;
            let way = Vector3::new(t.cos(), 0.3 * t.sin(), t.sin()).normalize();
            let out = step(&mut finger, &entity, &(way * (radius_m + 0.11 - 2e-4 * f64::from(tick.min(75)))));
            if out.entity.is_some() {
                let gap_m = mesh.nearest_unbounded(&out.god_object_W).distance_m - radius_m;
                // As above.
                assert!(gap_m > -1e-8 * radius_m - 1e-11, "{radius_m} {tick}: {gap_m:e}");
                touched += 1;
            }
        }
        assert!(touched > 50, "{radius_m}: {touched}");
    }
}
