//! Fingers that begin anywhere about patches: no force beyond what the overlap and the hand's way explain.

use std::slice::from_ref;
use std::sync::Arc;

use crate::common::*;
use haptics::mesh::Sides;
use haptics::nurbs::make;
use haptics::{Friction, Nurbs, Surface};
use nalgebra::Vector3;

/// Points all over the surface.
fn grid(nurbs: &Nurbs) -> Vec<Vector3<f64>> {
    let share = |i: u32| f64::from(i) / f64::from(GRID - 1);
    let of_part = |part| (0..GRID * GRID).map(move |i| nurbs.at(part, share(i % GRID), share(i / GRID)).0);
    (0..nurbs.parts()).flat_map(of_part).collect()
}

/// How far a finger would have to go to touch nothing, estimated from above.
fn overlap_m(nurbs: &Nurbs, grid: &[Vector3<f64>], hip: &Vector3<f64>, radius_m: f64) -> f64 {
    let away_m = grid.iter().map(|point| (point - hip).norm()).fold(f64::INFINITY, f64::min);
    let is_inside = nurbs.sides() == Sides::Solid && nurbs.surface(0.0).signed_distance(hip) < 0.0;
    if is_inside { radius_m + away_m } else { (radius_m - away_m + SPACING_M).max(0.0) }
}

fn begin_all_over(
    name: &str,
    nurbs: &Arc<Nurbs>,
    friction: Friction,
    radius_m: f64,
    starts: usize,
    seed: u64,
) {
    let (entity, grid) = (entity(Arc::clone(nurbs), friction), grid(nurbs));
    let mut noise = Noise(seed);
    for start in 0..starts {
        let mut hip = Vector3::from_fn(|_, _| noise.between(-0.07, 0.07));
        let start_at = hip;
        let mut finger = finger(radius_m);
        let (mut explained_m, mut way_m) = (0.0, 0.0);
        for tick in 0..12 {
            let force_n = finger.step(from_ref(&entity), &hip, DT).force_on_user_W.norm();
            let most_n = |explained_m| K * (explained_m + way_m) + 1e-6;
            // Looked for where it has to explain something.
            if force_n > most_n(explained_m) {
                explained_m = overlap_m(nurbs, &grid, &start_at, radius_m);
            }
            let most_n = most_n(explained_m);
            assert!(
                force_n <= most_n,
                "{name}, {radius_m} m, start {start}, tick {tick} at {hip:?}: {force_n} N, explained {most_n} N"
            );
            let step = noise.vector(1e-4);
            way_m += step.norm();
            hip += step;
        }
    }
}

fn begin_on_all_patches(starts: usize, seed: u64) {
    let all = [
        ("ball", make::sphere(0.05)),
        ("ring", make::torus(0.05, 0.02)),
        ("cylinder", make::cylinder(0.03, 0.08)),
        ("vase", make::vase(0.1)),
        ("mouse", make::mouse(0.1)),
    ];
    for (name, patches) in all {
        let nurbs = Arc::new(Nurbs::build(&patches).unwrap().0);
        for friction in [Friction::None, stiction()] {
            for radius_m in [0.0, 1e-3, 5e-3, 0.03] {
                begin_all_over(name, &nurbs, friction.clone(), radius_m, starts, seed);
            }
        }
    }
}

#[test]
fn no_finger_that_begins_inside_patches_is_flung() {
    begin_on_all_patches(60, 1);
}

/// Ten million starts.
#[test]
#[ignore = "four minutes"]
fn no_finger_that_begins_anywhere_of_ten_million_is_flung_by_patches() {
    begin_on_all_patches(250_000, 2);
}

const GRID: u32 = 40;
/// Half a diagonal between points of the grid, of the largest patch.
const SPACING_M: f64 = 4e-3;
