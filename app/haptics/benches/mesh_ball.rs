//! What a tick of a spherical finger of 1 mm costs on meshes of 1000 to 1,000,000 triangles.
//!
//! Along the standard path (`tests/common/path.rs`), 5 mm under the surface on which the finger's centre rolls; and
//! lightly, 0.3 mm under it. `cargo bench -p haptics --bench mesh_ball -- table` prints median, p99, p99.9 and maximum of
//! single ticks per phase; the clock's own time is taken off, and each tick's best of several runs counts, as in
//! `mesh_slide`. With `bumpy` behind it, on the bumpy ball alone. Without `table`, Criterion measures whole slides.
#![allow(non_snake_case)]

#[path = "../tests/common/path.rs"]
mod path;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, Throughput};
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Entity, Finger, Friction, Shape};
use nalgebra::{Isometry3, Vector3};
use path::{FINGER_M, PHASES, Phase, R, TICK_S};

const SIZES: [(usize, &str); 4] = [(32, "ball 1k"), (100, "ball 10k"), (316, "ball 100k"), (1000, "ball 1M")];
/// Runs of which the best counts.
const RUNS: usize = 7;
/// How deep a light touch is \[m\].
const LIGHT_M: f64 = 3e-4;

fn main() {
    if std::env::args().any(|argument| argument == "table") {
        return table();
    }
    let mut criterion =
        Criterion::default().sample_size(20).measurement_time(Duration::from_secs(2)).configure_from_args();
    for (meridians, name) in [SIZES[0], SIZES[3]] {
        let shape = shape_of(make::uv_sphere(meridians, path::rings(meridians), R));
        for (friction_name, friction) in frictions() {
            slide(&mut criterion, &format!("{name}, {friction_name}"), &entity(&shape, friction));
        }
    }
    criterion.final_summary();
}

fn slide(criterion: &mut Criterion, name: &str, entity: &Entity) {
    let path = path::standard_path(path::smooth_for_a_ball);
    let mut finger = finger();
    let (before, during): (Vec<_>, Vec<_>) =
        path.iter().filter(|(of, _)| *of != Phase::Exit).partition(|(of, _)| *of != Phase::Slide);
    let run = |finger: &mut Finger, hips: &[(Phase, Vector3<f64>)]| {
        for (_, hip) in hips {
            black_box(finger.step(std::slice::from_ref(entity), hip, TICK_S));
        }
    };
    run(&mut finger, &before);
    let mut group = criterion.benchmark_group("slide");
    group.throughput(Throughput::Elements(during.len() as u64));
    group.bench_function(name, |bencher| {
        bencher.iter_batched_ref(|| finger.clone(), |finger| run(finger, &during), BatchSize::LargeInput);
    });
}

fn table() {
    let clock_ns = clock_ns();
    println!(
        "one tick of one ball of 1 mm in ns; the clock's {clock_ns} ns are taken off; best of {RUNS} runs"
    );
    println!(
        "{:<16} {:<12} {:<9} {:>7} {:>7} {:>7} {:>8}",
        "mesh", "friction", "phase", "median", "p99", "p99.9", "max"
    );
    if std::env::args().any(|argument| argument == "bumpy") {
        return bumpy(clock_ns);
    }
    for (meridians, name) in SIZES {
        let shape = shape_of(make::uv_sphere(meridians, path::rings(meridians), R));
        rows(name, &shape, &path::standard_path(path::smooth_for_a_ball), clock_ns);
    }
    let million = shape_of(make::uv_sphere(1000, 501, R));
    rows("lightly 1M", &million, &lightly(), clock_ns);
    let shuffled = shape_of(make::shuffled(&make::uv_sphere(1000, 501, R), 7));
    rows("shuffled 1M", &shuffled, &path::standard_path(path::smooth_for_a_ball), clock_ns);
    bumpy(clock_ns);
}

fn bumpy(clock_ns: u64) {
    let bumpy = shape_of(make::bumpy_sphere(1000, 501, R));
    rows("bumpy 1M", &bumpy, &path::standard_path(path::bumpy_for_a_ball), clock_ns);
}

/// The standard path, but barely touching.
fn lightly() -> Vec<(Phase, Vector3<f64>)> {
    let raised = |hip: &Vector3<f64>| {
        let r = hip.norm();
        hip * ((r + (path::DEPTH_M - LIGHT_M)) / r)
    };
    path::standard_path(path::smooth_for_a_ball).iter().map(|(phase, hip)| (*phase, raised(hip))).collect()
}

fn rows(name: &str, shape: &Shape, path: &[(Phase, Vector3<f64>)], clock_ns: u64) {
    for (friction_name, friction) in frictions() {
        let entity = entity(shape, friction);
        let runs: Vec<_> = (0..RUNS).map(|_| tick_times(&entity, path, clock_ns)).collect();
        let best = |tick: usize| runs.iter().map(|run| run[tick]).min().unwrap_or(0);
        for (phase, _) in PHASES {
            let mut times: Vec<_> = (0..path.len()).filter(|&tick| path[tick].0 == phase).map(best).collect();
            times.sort_unstable();
            let [median, p99, p999, max] = [0.5, 0.99, 0.999, 1.0].map(|q| quantile(&times, q));
            println!(
                "{name:<16} {friction_name:<12} {:<9} {median:>7} {p99:>7} {p999:>7} {max:>8}",
                format!("{phase:?}")
            );
        }
    }
}

fn tick_times(entity: &Entity, path: &[(Phase, Vector3<f64>)], clock_ns: u64) -> Vec<u64> {
    let mut finger = finger();
    path.iter()
        .map(|(_, hip)| {
            let start = Instant::now();
            black_box(finger.step(std::slice::from_ref(entity), black_box(hip), TICK_S));
            (start.elapsed().as_nanos() as u64).saturating_sub(clock_ns)
        })
        .collect()
}

fn finger() -> Finger {
    Finger::new(FINGER_M, 1).expect("a finger")
}

fn frictions() -> [(&'static str, Friction); 2] {
    [("no friction", Friction::None), ("mu = 0.5", Friction::Coulomb { mu: 0.5 })]
}

fn shape_of(soup: TriangleSoup) -> Shape {
    std::sync::Arc::new(Mesh::build(soup).expect("a mesh").0).into()
}

fn entity(shape: &Shape, friction: Friction) -> Entity {
    let entity = Entity::new(shape.clone(), Isometry3::identity(), path::K_N_PER_M).expect("an entity");
    entity.with_friction(friction).expect("a friction")
}

/// Median of what two readings of the clock measure when nothing is between them.
fn clock_ns() -> u64 {
    let mut empty: Vec<_> = (0..100_000).map(|_| Instant::now().elapsed().as_nanos() as u64).collect();
    empty.sort_unstable();
    quantile(&empty, 0.5)
}

fn quantile(sorted: &[u64], q: f64) -> u64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((q * last as f64).round() as usize).copied().unwrap_or(0)
}
