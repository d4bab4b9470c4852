//! Fingers that begin anywhere about a closed form: every algorithm, every radius, no force beyond overlap and way.

use std::slice::from_ref;

use crate::common::*;
use crate::solids;
use haptics::{Algorithm, Entity, Form, Friction, Surface};
use nalgebra::Vector3;

/// Of a form that a ball feels in triangles: how far these lie from it.
const IN_TRIANGLES_M: f64 = 4e-4 * 0.2;

type Distance<'s> = &'s dyn Fn(&Vector3<f64>) -> f64;

/// `distance` is that from the form, negative inside.
fn begin_all_over(distance: Distance<'_>, entity: &Entity, radius_m: f64, starts: usize, seed: u64) {
    let mut noise = Noise(seed);
    let slack_m = if entity.for_balls.is_some() { IN_TRIANGLES_M } else { 1e-9 };
    for start in 0..starts {
        let mut hip = Vector3::from_fn(|_, _| noise.between(-0.15, 0.15));
        let start_at = hip;
        // Looked for where a force has to be explained.
        let mut overlap_m = None;
        let mut finger = finger(radius_m);
        let mut way_m = 0.0;
        for tick in 0..12 {
            let force_n = finger.step(from_ref(entity), &hip, DT).force_on_user_W.norm();
            let explained_m = if force_n > K * (way_m + slack_m) {
                *overlap_m.get_or_insert_with(|| (radius_m - distance(&start_at)).max(0.0))
            } else {
                0.0
            };
            let most_n = K * (explained_m + way_m + slack_m);
            assert!(
                force_n <= most_n * (1.0 + 1e-9),
                "{:?}, {:?}, {radius_m} m, start {start}, tick {tick} at {hip:?}: {force_n} N, explained {most_n} N",
                entity.shape,
                entity.algorithm
            );
            let step = noise.vector(1e-4);
            way_m += step.norm();
            hip += step;
        }
    }
}

fn begin_on(form: &Form, distance: Distance<'_>, starts: usize, seed: u64) {
    for radius_m in [0.0, 1e-3, 0.01, 0.06] {
        for friction in [Friction::None, stiction()] {
            for algorithm in [Algorithm::FrictionCone, Algorithm::VectorField, Algorithm::ClassicGodObject] {
                let entity = entity(*form, friction.clone()).with_algorithm(algorithm).prepared_for(radius_m);
                if entity.is_felt_by(radius_m) {
                    begin_all_over(distance, &entity, radius_m, starts, seed);
                }
            }
        }
    }
}

fn begin_on_all_forms(starts: usize, seed: u64) {
    for solid in solids::all() {
        let grid = solid.grid();
        let distance = |p: &Vector3<f64>| {
            // Which is exact, but of scaled forms (`oracle.rs`); a walk from a grid ends up to 0.1 mm beside an edge.
            if solid.factors == Vector3::repeat(1.0) {
                return solid.form.signed_distance(p);
            }
            let away_m = solid.distance(&grid, p) - 1e-4;
            if (solid.contains)(p) { -away_m - 2e-4 } else { away_m }
        };
        let is_quick = solid.factors == Vector3::repeat(1.0);
        begin_on(&solid.form, &distance, if is_quick { starts } else { starts / 12 }, seed);
    }
    let plane = solids::plane();
    begin_on(&plane, &|p| plane.signed_distance(p), starts, seed);
}

#[test]
fn no_finger_that_begins_inside_a_form_is_flung() {
    begin_on_all_forms(20, 1);
}

/// Ten million starts.
#[test]
#[ignore = "three minutes"]
fn no_finger_that_begins_anywhere_of_ten_million_is_flung() {
    begin_on_all_forms(30_000, 2);
}
