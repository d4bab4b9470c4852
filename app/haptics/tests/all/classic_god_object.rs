//! Without friction the Friction Cone Algorithm is the classic god-object, tick by tick (Melder ch. 8.1).
//!
//! The classic one is written on its own (`classic_god_object.rs`), so that the two agree only if both are right.
#![allow(non_snake_case)]

use crate::common;

use common::meshes::*;
use common::path::{self, Phase};
use common::*;
use haptics::mesh::Mesh;
use haptics::{
    Algorithm, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Friction, Plane, Scaled, Shape, Sphere,
    Surface, Torus,
};
use nalgebra::Vector3;
use std::sync::Arc;

/// Coefficients of zero in every way of saying so.
const LAWS: [Friction; 3] =
    [Friction::None, Friction::Coulomb { mu: 0.0 }, Friction::Stiction { mu_s: 0.0, mu_d: 0.0 }];

/// What came of rendering the same HIPs twice.
#[derive(Debug, Default)]
struct Compared {
    touching: usize,
    /// Ticks that only one of them felt.
    alone: usize,
    largest_difference_n: f64,
    sum_of_squares_n2: f64,
}

/// Forces above `most_n` are not compared.
fn compare(shape: &Shape, law: &Friction, hips: impl Iterator<Item = Vector3<f64>>, most_n: f64) -> Compared {
    let cone = entity(shape.clone(), law.clone());
    let classic = cone.clone().with_algorithm(Algorithm::ClassicGodObject);
    let (mut one, mut other) = (point_finger(), point_finger());
    let mut compared = Compared::default();
    for hip in hips {
        let (one, other) = (step(&mut one, &cone, &hip), step(&mut other, &classic, &hip));
        if one.entity != other.entity {
            compared.alone += 1;
            continue;
        }
        compared.touching += usize::from(one.entity.is_some());
        if one.force_on_user_W.norm() > most_n {
            continue;
        }
        let difference_n = (one.force_on_user_W - other.force_on_user_W).norm();
        compared.largest_difference_n = compared.largest_difference_n.max(difference_n);
        compared.sum_of_squares_n2 += difference_n * difference_n;
    }
    compared
}

fn roaming(seed: u64, half_width_m: f64, step_m: f64) -> impl Iterator<Item = Vector3<f64>> {
    let mut roaming = Roaming::new(seed, half_width_m, step_m);
    (0..50_000).map(move |_| roaming.next())
}

#[test]
fn on_closed_forms_it_is_the_classic_god_object() {
    let plane = Shape::from(Plane::new(Vector3::new(0.2, 1.0, 0.4), 0.01).unwrap());
    // Of the ball, only its outer half: near the centre the classic one needs more rounds than a tick has.
    for (shape, is_compared) in [
        (plane, (|_| true) as fn(&Vector3<f64>) -> bool),
        (Sphere::new(0.1).unwrap().into(), |hip| hip.norm() > 0.05),
    ] {
        for law in &LAWS {
            let hips = roaming(1, 0.1, 5e-4).filter(is_compared);
            let compared = compare(&shape, law, hips, f64::INFINITY);
            assert!(compared.touching > 10_000, "{compared:?}");
            assert_eq!(compared.alone, 0);
            // The slide rests within 1e-12 of the depth; depths are below 0.2 m, 500 N/m.
            assert!(compared.largest_difference_n < 4e-10, "{shape:?}: {compared:?}");
        }
    }
}

#[test]
fn on_every_closed_form_it_is_the_classic_god_object() {
    let round = Form::from(Cylinder::new(0.04, 0.1).unwrap());
    let forms = [
        Form::from(Cuboid::new([0.1, 0.06, 0.08]).unwrap()),
        round,
        Cone::new(0.05, 0.02, 0.1).unwrap().into(),
        Torus::new(0.06, 0.03).unwrap().into(),
        Capsule::new(0.03, 0.06).unwrap().into(),
        Ellipsoid::new([0.08, 0.06, 0.05]).unwrap().into(),
        Scaled::new(round, [1.0, 1.0, 1.5]).unwrap(),
    ];
    for (form, law) in forms.into_iter().zip(LAWS.iter().cycle()) {
        // No deeper than 10 mm below the nearest piece, and 20 mm below the one they are on: the classic one goes down
        // in plain rounds, of which a tick has enough there.
        let most_n = K * 0.02;
        let is_shallow = |hip: &Vector3<f64>| {
            form.signed_distance(hip) > 0.0 || (form.nearest(hip).point_B - hip).norm() < 0.01
        };
        let compared = compare(&form.into(), law, roaming(3, 0.09, 3e-4).filter(is_shallow), most_n);
        assert!(compared.touching > 1000, "{form:?}: {compared:?}");
        assert_eq!(compared.alone, 0, "{form:?}: {compared:?}");
        assert!(compared.largest_difference_n < 4e-10, "{form:?}: {compared:?}");
    }
}

#[test]
fn on_coarse_meshes_with_flat_sides_it_is_the_classic_god_object() {
    let blade = built(wedge(10.0));
    for (name, mesh, step_m) in [("cube", cube(), 5e-4), ("wedge", blade, 2e-4), ("star", star(), 5e-4)] {
        for law in &LAWS {
            let compared = compare(&Arc::clone(&mesh).into(), law, roaming(2, 0.06, step_m), f64::INFINITY);
            assert!(compared.touching > 3000, "{name}: {compared:?}");
            // The classic one hovers 1e-10 m above the surface: it feels a touch that much later or earlier.
            assert!(compared.alone <= 1, "{name}: {compared:?}");
            // Both project on the same planes; the rest is rounding of positions, times 500 N/m.
            assert!(compared.largest_difference_n < 1e-10, "{name}: {compared:?}");
        }
    }
}

#[test]
fn on_fine_meshes_it_is_the_classic_god_object_but_for_steps_across_edges() {
    for (name, mesh, radius_at) in [
        ("ball", uv_sphere(316), path::smooth as path::RadiusAt),
        ("bumpy ball", bumpy_sphere(316), path::bumpy),
    ] {
        let path = path::standard_path(radius_at);
        let slides = path.iter().filter(|(phase, _)| *phase != Phase::Free).map(|(_, hip)| *hip);
        let mesh: Arc<Mesh> = mesh;
        let compared = compare(&mesh.into(), &Friction::None, slides, f64::INFINITY);
        let rms_n = (compared.sum_of_squares_n2 / compared.touching as f64).sqrt();
        assert!(compared.touching > 10_000 && compared.alone <= 1, "{name}: {compared:?}");
        // Over a convex edge either may rest on either side of it: a face turns by 0.02 rad, the force is 2.5 N.
        assert!(compared.largest_difference_n < 0.07 && rms_n < 1e-3, "{name}: {compared:?}, rms {rms_n}");
    }
}
