//! Fingers that begin anywhere on ugly meshes: no force is larger than what the overlap and the hand's way explain.

use std::slice::from_ref;
use std::sync::Arc;

use crate::common::meshes::{touchable, unit_vector};
use crate::common::models::models;
use crate::common::ugly;
use crate::common::*;
use crate::mesh_oracle::{closest, corners, distance, winding_number};
use haptics::Friction;
use haptics::mesh::Mesh;
use nalgebra::Vector3;

/// Way that a finger would have to go to touch nothing, at least \[m\]: outside of the mesh that is all.
fn least_overlap_m(mesh: &Mesh, hip: &Vector3<f64>, radius_m: f64) -> f64 {
    let nearest_m = distance(mesh, hip);
    if is_inside(mesh, hip) { radius_m + nearest_m } else { (radius_m - nearest_m).max(0.0) }
}

/// The same at most: the nearest way that leads out, of those to all faces.
fn most_overlap_m(mesh: &Mesh, hip: &Vector3<f64>, radius_m: f64) -> f64 {
    if !is_inside(mesh, hip) {
        return least_overlap_m(mesh, hip, radius_m);
    }
    let feet = (0..mesh.faces().len()).map(|face| closest(&corners(mesh, face), hip));
    let mut ways: Vec<Vector3<f64>> = feet.map(|foot| foot - hip).collect();
    ways.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let leads_out =
        |way: &&Vector3<f64>| !is_inside(mesh, &(hip + *way * (1.0 + 1e-9) + way.normalize() * 1e-9));
    ways.iter().find(leads_out).map_or(f64::INFINITY, Vector3::norm) + radius_m
}

fn is_inside(mesh: &Mesh, p: &Vector3<f64>) -> bool {
    winding_number(mesh, p) > 0.5
}

/// A point of a face, most faces being small, and one near it.
fn near_a_face(mesh: &Mesh, noise: &mut Noise, within_m: f64) -> [Vector3<f64>; 2] {
    let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
    let [a, b, c] = corners(mesh, face);
    let (u, v) = (noise.uniform().sqrt(), noise.uniform());
    let on_it = a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v);
    [on_it, on_it + unit_vector(noise) * (within_m * noise.uniform())]
}

/// Starts all over a mesh, and a few steps of the hand after each.
fn begin_all_over(name: &str, mesh: &Arc<Mesh>, friction: Friction, radius_m: f64, starts: usize, seed: u64) {
    let entity = touchable(mesh, friction);
    let mut noise = Noise(seed);
    for start in 0..starts {
        let [on_it, mut hip] = near_a_face(mesh, &mut noise, 0.8e-3);
        let start_at = hip;
        let mut explained_m = (radius_m - (hip - on_it).norm()).max(0.0);
        // Looked for where it has to explain more: what takes longer comes last.
        let mut looks = [least_overlap_m, most_overlap_m].iter();
        let mut finger = finger(radius_m);
        let mut way_m = 0.0;
        for tick in 0..12 {
            let force_n = finger.step(from_ref(&entity), &hip, DT).force_on_user_W.norm();
            // What a ball takes for touching, many times over.
            let most_n = |overlap_m| K * (overlap_m + way_m) * (1.0 + 1e-9) + 1e-6;
            while force_n > most_n(explained_m)
                && let Some(look) = looks.next()
            {
                explained_m = look(mesh, &start_at, radius_m);
            }
            let most_n = most_n(explained_m);
            assert!(
                force_n <= most_n,
                "{name} of {seed}, {radius_m} m, start {start}, tick {tick} at {hip:?}: {force_n} N, explained {most_n} N"
            );
            let step = unit_vector(&mut noise) * (2e-4 * noise.uniform());
            way_m += step.norm();
            hip += step;
        }
    }
}

fn begin_on_ugly_meshes(seeds: std::ops::Range<u64>, starts: usize) {
    for seed in seeds {
        for (name, soup) in ugly::all(seed) {
            let mesh = Arc::new(Mesh::build(soup).unwrap().0);
            begin_all_kinds_over(name, &mesh, starts, seed);
        }
    }
}

/// Points and balls, with and without friction.
fn begin_all_kinds_over(name: &str, mesh: &Arc<Mesh>, starts: usize, seed: u64) {
    for friction in [Friction::None, stiction()] {
        for radius_m in [0.0, 2e-4, 1e-3, 5e-3, 0.02] {
            begin_all_over(name, mesh, friction.clone(), radius_m, starts, seed);
        }
    }
}

#[test]
fn no_ball_that_begins_overlapping_is_flung() {
    begin_on_ugly_meshes(1..3, 40);
}

/// Starts deep between parts that pass through each other: a ball that was put outside flies on, and comes to rest on a wall
/// that is nearer.
#[test]
fn no_ball_that_flies_on_from_where_it_was_put_is_flung_when_it_lands() {
    for (seed, boxes, starts) in [(5, "heap of boxes", 1444), (6, "crossed boxes", 1218)] {
        let (name, soup) = ugly::all(seed).into_iter().find(|(name, _)| *name == boxes).unwrap();
        let mesh = Arc::new(Mesh::build(soup).unwrap().0);
        begin_all_over(name, &mesh, Friction::None, 2e-4, starts, seed);
    }
}

/// Ten million starts.
#[test]
#[ignore = "a quarter of an hour"]
fn no_ball_that_begins_anywhere_of_ten_million_is_flung() {
    begin_on_ugly_meshes(3..40, 3400);
}

/// A thousand starts of each kind on each model, and ten thousand on small ones.
#[test]
#[ignore = "of other people's models: MODELS=DIRECTORY"]
fn no_ball_that_begins_on_models_is_flung() {
    for (name, soup) in models() {
        let mesh = Arc::new(Mesh::build(soup).unwrap().0);
        let starts = (100_000_000 / mesh.faces().len()).clamp(1000, 10_000);
        println!("{name}, {} faces: {starts} starts of each kind", mesh.faces().len());
        begin_all_kinds_over(&name, &mesh, starts, 1);
    }
}
