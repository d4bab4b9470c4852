//! What contact points of two closed forms cost, while they move on each other.
//!
//! `cargo bench -p physics --bench collide -- table` prints the median and p99.9 of single calls for every pair of kinds:
//! 2,000 poses along a way of 1 mm and 0.05 rad that begins 0.3 mm deep, as a held object feels another one.
//! Without `table`, Criterion measures things at rest on each other, the same pose in every tick.
//!
//! How single calls are timed: the clock's own time is measured and taken off; the same way is gone several times, and the
//! best time of each call is its cost.
#![allow(non_snake_case, missing_docs, unused_crate_dependencies)]

#[path = "../tests/common/solids.rs"]
mod solids;

use std::hint::black_box;
use std::time::Instant;

use criterion::Criterion;
use haptics::{Cuboid, Cylinder, Form, Plane, Shape};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points, is_collidable};
use solids::*;

const REACH_M: f64 = 1e-3;
const POSES: usize = 2000;
/// Runs of which each call's best counts.
const RUNS: usize = 5;
const TRIALS: u64 = 5;

fn main() {
    if std::env::args().any(|argument| argument == "table") {
        return print_table();
    }
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    let slab: Form = Cuboid::new([0.2, 0.1, 0.2]).expect("a box").into();
    let ground: Form = Plane::new(Vector3::y(), 0.05).expect("a plane").into();
    for (below, b) in [("plane", ground), ("box", slab)] {
        let mut group = criterion.benchmark_group(format!("at rest on a {below}"));
        for (name, a) in all() {
            let X_WA = Isometry3::identity();
            let low =
                deepest(&points(&a, &X_WA, &b, &Isometry3::identity(), 1.0, &mut PairMemory::default()));
            let X_WA = Isometry3::translation(0.0, -low - 1e-4, 0.0);
            let lying = lying_on(&a, &X_WA, &b);
            group.bench_function(name, |bencher| {
                let (a, b) = (Shape::Form(a), Shape::Form(b));
                let mut memory = PairMemory::default();
                bencher.iter(|| call(&a, black_box(&lying), &b, &Isometry3::identity(), &mut memory));
            });
        }
    }
    let cylinder: Form = Cylinder::new(0.02, 0.05).expect("a cylinder").into();
    criterion.bench_function("a cylinder at rest on another", |bencher| {
        let (a, b) = (Shape::Form(cylinder), Shape::Form(cylinder));
        let X_WA = Isometry3::translation(0.003, 0.0499, 0.0);
        let mut memory = PairMemory::default();
        bencher.iter(|| call(&a, black_box(&X_WA), &b, &Isometry3::identity(), &mut memory));
    });
}

/// Just below the top of what is at the origin.
fn lying_on(a: &Form, X_WA: &Isometry3<f64>, b: &Form) -> Isometry3<f64> {
    let mut X = *X_WA;
    for _ in 0..50 {
        X.translation.y = X.translation.y.max(0.05);
        let gap = deepest(&points(a, &X, b, &Isometry3::identity(), 1.0, &mut PairMemory::default()));
        X.translation.y -= gap + 1e-4;
    }
    X
}

fn call(
    a: &Shape,
    X_WA: &Isometry3<f64>,
    b: &Shape,
    X_WB: &Isometry3<f64>,
    memory: &mut PairMemory,
) -> ContactPoints {
    let mut found = ContactPoints::default();
    contact_points(Solid { shape: a, X_W: X_WA }, Solid { shape: b, X_W: X_WB }, REACH_M, memory, &mut found);
    found
}

fn print_table() {
    let clock_ns = clock_ns();
    println!("ns per call while they move on each other, clock ({clock_ns:.0} ns) taken off");
    println!("{:16} {:16} {:>8} {:>8} {:>7}", "moving", "on", "median", "p99.9", "points");
    let mut on: Vec<(&str, Form)> = vec![("plane", Plane::new(Vector3::y(), 0.0).expect("a plane").into())];
    on.extend(all());
    for (name_a, a) in all().into_iter().chain(scaled()) {
        for (name_b, b) in &on {
            if !is_collidable(&a.into(), &(*b).into()) {
                continue;
            }
            let (mut times, mut count) = (Vec::new(), 0);
            for seed in 0..TRIALS {
                let (best, points) = timed(&a, b, seed + 1, clock_ns);
                times.extend(best);
                count += points;
            }
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
            let mean = count as f64 / times.len() as f64;
            println!("{name_a:16} {name_b:16} {:8.0} {:8.0} {mean:7.1}", at(0.5), at(0.999));
        }
    }
}

/// The best times of all calls along a way, and how many points were found.
fn timed(a: &Form, b: &Form, seed: u64, clock_ns: f64) -> (Vec<f64>, usize) {
    let mut noise = Noise(seed);
    let X_WB = Isometry3::identity();
    let turn = noise.turn();
    let away = if let Form::Plane(_) = b { Vector3::y() } else { noise.direction() };
    let (along, axis) = (noise.direction() * 1e-3, noise.direction() * 0.05);
    let mut distance = 0.15;
    let mut start = PairMemory::default();
    while distance > 0.0 {
        let found = points(a, &pose(turn, away * distance), b, &X_WB, 1.0, &mut start);
        let gap = deepest(&found);
        if gap < -3e-4 {
            break;
        }
        distance -= (0.5 * (gap + 3e-4)).clamp(2e-6, 1e-3);
    }
    let (shape_a, shape_b) = (Shape::Form(*a), Shape::Form(*b));
    let (mut best, mut count) = (vec![f64::INFINITY; POSES], 0);
    for _ in 0..RUNS {
        let mut memory = start.clone();
        count = 0;
        for (step, best) in best.iter_mut().enumerate() {
            let part = step as f64 / POSES as f64;
            let turned = UnitQuaternion::from_scaled_axis(axis * part) * turn;
            let X_WA = pose(turned, away * distance + along * part);
            let begin = Instant::now();
            let found = call(&shape_a, black_box(&X_WA), &shape_b, &X_WB, &mut memory);
            let took = begin.elapsed().as_nanos() as f64 - clock_ns;
            count += black_box(found).as_slice().len();
            *best = best.min(took.max(0.0));
        }
    }
    (best, count)
}

/// The best of what two readings of the clock are apart.
fn clock_ns() -> f64 {
    let apart = |_| {
        let begin = Instant::now();
        begin.elapsed().as_nanos() as f64
    };
    (0..10_000).map(apart).fold(f64::INFINITY, f64::min)
}
