//! Fingers that begin anywhere about solids joined of others: no force beyond what the overlap and the hand's way explain.

use std::slice::from_ref;

use crate::common::*;
use crate::trees::{Inside, random_tree, touchable};
use haptics::Friction;
use nalgebra::Vector3;

/// Directions all over a ball, evenly (Fibonacci's spiral).
fn directions(rays: u32) -> Vec<Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let at = |i: u32| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(rays);
        let rho = (1.0 - y * y).sqrt();
        let angle = golden * f64::from(i);
        Vector3::new(rho * angle.cos(), y, rho * angle.sin())
    };
    (0..rays).map(at).collect()
}

/// How far it is from a point to the other side of the surface, along the shortest of many rays: at most `most_m`.
fn to_the_other_side(contains: &Inside<'_>, p: &Vector3<f64>, rays: &[Vector3<f64>], most_m: f64) -> f64 {
    let here = contains(p);
    let mut best_m = most_m;
    for ray in rays {
        let mut at_m = STEP_M;
        while at_m < best_m && contains(&(p + ray * at_m)) == here {
            at_m += STEP_M;
        }
        best_m = best_m.min(at_m);
    }
    best_m
}

/// An estimate from above of how far a finger would have to go to touch nothing; more rays find thinner corners.
fn overlap_m(contains: &Inside<'_>, hip: &Vector3<f64>, rays: &[Vector3<f64>], radius_m: f64) -> f64 {
    if contains(hip) {
        radius_m + to_the_other_side(contains, hip, rays, 0.1)
    } else {
        radius_m - to_the_other_side(contains, hip, rays, radius_m) + STEP_M
    }
}

fn begin_on_random_trees(seeds: std::ops::Range<u64>, starts: usize) {
    let (few, many) = (directions(600), directions(60_000));
    for seed in seeds {
        let (tree, contains) = random_tree(seed);
        let mut noise = Noise(seed ^ 77);
        for friction in [Friction::None, stiction()] {
            let entity = touchable(&tree, friction);
            for radius_m in [0.0, 1e-3, 5e-3, 0.02] {
                for start in 0..starts {
                    let mut hip = Vector3::from_fn(|_, _| noise.between(-0.03, 0.03));
                    let start_at = hip;
                    let mut finger = finger(radius_m);
                    let (mut explained_m, mut way_m) = (0.0, 0.0);
                    for tick in 0..12 {
                        let force_n = finger.step(from_ref(&entity), &hip, DT).force_on_user_W.norm();
                        // Rays miss the nearest place by a few hundredths of its distance.
                        let most_n = |explained_m| K * (1.05 * explained_m + 2e-4 + way_m);
                        // Looked for where it has to explain something: with few rays, then with many.
                        for rays in [&few, &many] {
                            if force_n > most_n(explained_m) {
                                explained_m = overlap_m(&*contains, &start_at, rays, radius_m);
                            }
                        }
                        let most_n = most_n(explained_m);
                        assert!(
                            force_n <= most_n,
                            "tree {seed}, {radius_m} m, start {start}, tick {tick} at {hip:?}: {force_n} N, explained {most_n} N"
                        );
                        let step = noise.vector(1e-4);
                        way_m += step.norm();
                        hip += step;
                    }
                }
            }
        }
    }
}

#[test]
fn no_finger_that_begins_inside_a_tree_of_solids_is_flung() {
    begin_on_random_trees(1..13, 12);
}

/// Ten million starts.
#[test]
#[ignore = "hours"]
fn no_finger_that_begins_anywhere_about_twenty_thousand_trees_is_flung() {
    begin_on_random_trees(13..20_013, 63);
}

const STEP_M: f64 = 2e-4;
