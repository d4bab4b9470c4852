//! Fingers that begin anywhere about solids joined of others: no force beyond what the overlap and the hand's way explain.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::slice::from_ref;

use crate::common::*;
use crate::trees::{Level, random_solid, touchable};
use haptics::{
    Algorithm, ContactAlgorithm, ContactMemory, Entity, Feature, Friction, SurfacePoint, Touch, TouchInput,
};
use nalgebra::Vector3;

/// A cube in which boundary may be.
#[derive(PartialEq)]
struct Cube {
    /// From the point that the nearest boundary is sought of (m).
    distance_m: f64,
    centre: Vector3<f64>,
    half_m: f64,
}

impl Cube {
    fn new(from: &Vector3<f64>, centre: Vector3<f64>, half_m: f64) -> Self {
        let beyond = (from - centre).abs().map(|x| (x - half_m).max(0.0));
        Self { distance_m: beyond.norm(), centre, half_m }
    }
}

impl Eq for Cube {}

/// The nearest is the greatest, of equally near ones the smallest.
impl Ord for Cube {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance_m.total_cmp(&self.distance_m).then(other.half_m.total_cmp(&self.half_m))
    }
}

impl PartialOrd for Cube {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The distance of the boundary from a point, from below and from above.
///
/// A cube is cut into eight until the level of its middle says that there is no boundary in it: rays miss thin corners, by
/// more than a tolerance makes good.
fn distance_m(level: &Level<'_>, from: &Vector3<f64>) -> [f64; 2] {
    let is_inside = level(from) <= 0.0;
    let mut cubes = BinaryHeap::from([Cube::new(from, Vector3::zeros(), 0.1)]);
    let mut across_m = f64::INFINITY;
    // Where all is about as near, as from the middle of a ball, it is less exact.
    for _ in 0..MOST_LOOKS {
        let Some(cube) = cubes.pop() else { break };
        if across_m - cube.distance_m <= RESOLUTION_M {
            return [cube.distance_m, across_m];
        }
        let half_m = 0.5 * cube.half_m;
        for corner in 0..8 {
            let side = |axis: usize| if corner >> axis & 1 == 1 { half_m } else { -half_m };
            let centre = cube.centre + Vector3::from_fn(|axis, _| side(axis));
            let level_m = level(&centre);
            if (level_m <= 0.0) != is_inside {
                across_m = across_m.min((centre - from).norm());
            }
            if level_m.abs() <= 3f64.sqrt() * half_m {
                cubes.push(Cube::new(from, centre, half_m));
            }
        }
    }
    [cubes.pop().map_or(across_m, |cube| cube.distance_m), across_m]
}

/// Way of a finger until it is clear of the nearest boundary, from above.
fn overlap_m(level: &Level<'_>, hip: &Vector3<f64>, radius_m: f64) -> f64 {
    let [least_m, most_m] = distance_m(level, hip);
    (radius_m + if level(hip) <= 0.0 { most_m } else { -least_m }).max(0.0)
}

/// The same from below, at a low price: most forces are explained by less than they might be.
fn least_overlap_m(level: &Level<'_>, hip: &Vector3<f64>, radius_m: f64) -> f64 {
    let height_m = level(hip);
    if height_m <= 0.0 {
        return radius_m - height_m;
    }
    let mut foot = *hip;
    for _ in 0..4 {
        let slope = |axis: usize| {
            level(&(foot + Vector3::ith(axis, PROBE_M))) - level(&(foot - Vector3::ith(axis, PROBE_M)))
        };
        let gradient = Vector3::from_fn(|axis, _| slope(axis) / (2.0 * PROBE_M));
        foot -= gradient * (level(&foot) + PROBE_M);
    }
    if level(&foot) <= 0.0 { (radius_m - (foot - hip).norm()).max(0.0) } else { 0.0 }
}

/// A finger that begins here and goes some way, beside what the overlap and that way explain.
fn begin(
    level: &Level<'_>,
    entity: &Entity,
    radius_m: f64,
    start: &Vector3<f64>,
    noise: &mut Noise,
) -> Result<(), String> {
    let mut hip = *start;
    let mut finger = finger(radius_m);
    let (mut explained_m, mut way_m) = (0.0, 0.0);
    // Looked for where it has to explain something.
    let mut looks = [least_overlap_m, overlap_m].iter();
    for tick in 0..12 {
        let force_n = finger.step(from_ref(entity), &hip, DT).force_on_user_W.norm();
        let most_n = |explained_m| K * (explained_m + way_m + RESOLUTION_M);
        while force_n > most_n(explained_m) {
            let Some(look) = looks.next() else {
                let most_n = most_n(explained_m);
                return Err(format!(
                    "{radius_m} m at {start:?}, tick {tick} at {hip:?}: {force_n} N, explained {most_n} N"
                ));
            };
            explained_m = look(level, start, radius_m);
        }
        let step = noise.vector(1e-4);
        way_m += step.norm();
        hip += step;
    }
    Ok(())
}

/// Pushes a thousand times harder than it should, wherever the finger is.
#[derive(Debug)]
struct Flings;

impl ContactAlgorithm for Flings {
    fn touch(&self, input: &TouchInput<'_>, _memory: &mut ContactMemory) -> Option<Touch> {
        let point_B = input.cone.hip_B + Vector3::y();
        let god_object =
            SurfacePoint { point_B, normal_B: Vector3::y(), feature: Feature::Surface, piece: 0 };
        Some(Touch::frictionless(god_object, 1.0, &input.cone))
    }
}

fn begin_on_random_trees(seeds: std::ops::Range<u64>, starts: usize) {
    for seed in seeds {
        let (tree, level) = random_solid(seed);
        let mut noise = Noise(seed ^ 77);
        let flinging = touchable(&tree, Friction::None).with_algorithm(Algorithm::own(Flings));
        for entity in [touchable(&tree, Friction::None), touchable(&tree, stiction()), flinging] {
            for radius_m in RADII_M {
                for start in 0..starts {
                    let hip = Vector3::from_fn(|_, _| noise.between(-0.03, 0.03));
                    let begun = begin(&*level, &entity, radius_m, &hip, &mut noise);
                    begun.unwrap_or_else(|found| panic!("tree {seed}, start {start}: {found}"));
                }
            }
        }
    }
}

#[test]
fn no_finger_that_begins_inside_a_tree_of_solids_is_flung() {
    begin_on_random_trees(1..13, 12);
}

/// Of a ball whose nearest boundary is a thin corner, beside which rays pass, the force is what the overlap makes; an algorithm
/// that wants more gets no more.
#[test]
fn a_ball_that_begins_at_a_thin_corner_feels_the_overlap_and_no_more() {
    const RADIUS_M: f64 = 0.02;
    let (tree, level) = random_solid(310);
    let start = Vector3::new(0.008_737_506_710_273_86, 0.014_679_435_113_392_078, 0.006_413_105_444_819_864);
    let overlap_m = overlap_m(&*level, &start, RADIUS_M);
    let of_a_corner = touchable(&tree, Friction::None);
    let flinging = touchable(&tree, Friction::None).with_algorithm(Algorithm::own(Flings));
    for entity in [of_a_corner, flinging] {
        let force_n = finger(RADIUS_M).step(from_ref(&entity), &start, DT).force_on_user_W.norm();
        let expected_n = K * overlap_m;
        assert!(
            (force_n - expected_n).abs() < K * RESOLUTION_M,
            "{:?}: {force_n} N, {expected_n} N",
            entity.algorithm
        );
    }
}

/// Between two walls that nearly face each other a ball is drawn along, and its force is that of its god-object.
#[test]
fn a_ball_between_walls_that_nearly_face_each_other_has_the_force_of_its_god_object() {
    let (tree, level) = random_solid(960);
    let mut noise = Noise(960 ^ 77);
    for radius_m in RADII_M {
        for start in 0..63 {
            let hip = Vector3::from_fn(|_, _| noise.between(-0.03, 0.03));
            let begun = begin(&*level, &touchable(&tree, Friction::None), radius_m, &hip, &mut noise);
            begun.unwrap_or_else(|found| panic!("start {start}: {found}"));
        }
    }
}

/// Fifteen million starts.
#[test]
#[ignore = "hours"]
fn no_finger_that_begins_anywhere_about_twenty_thousand_trees_is_flung() {
    begin_on_random_trees(13..20_013, 63);
}

const RADII_M: [f64; 4] = [0.0, 1e-3, 5e-3, 0.02];
/// Half of the width that slopes are found over.
const PROBE_M: f64 = 1e-7;
/// Width that the search for the nearest boundary may leave open.
const RESOLUTION_M: f64 = 2e-5;
const MOST_LOOKS: u32 = 30_000;
