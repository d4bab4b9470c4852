//! What force shading adds to a tick of contact, and how long it takes to be ready.
//!
//! `cargo bench -p haptics --bench shading -- table` prints one table in half a minute: the slide of the standard path
//! (`tests/common/path.rs`) on balls of 1000 and 1,000,000 triangles, without shading and with it in one run, and how
//! long the shading of a million triangles takes to make. Without `table`, Criterion measures the slides.
#![allow(non_snake_case)]

#[path = "../tests/common/path.rs"]
mod path;

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, Throughput};
use haptics::mesh::{Mesh, make};
use haptics::{Entity, Finger, Friction, Shading, ShadingForm, Shape};
use nalgebra::{Isometry3, Vector3};
use path::{Phase, TICK_S};
use std::f64::consts::PI;

/// Rounds of the table, each of all entities in turn, of which each entity's best counts.
const ROUNDS: usize = 15;

fn main() {
    let cases: Vec<(String, Entity)> = [32, 1000].into_iter().flat_map(cases).collect();
    let slide = slide();
    if std::env::args().any(|argument| argument == "table") {
        return table(&cases, &slide);
    }
    let mut criterion =
        Criterion::default().sample_size(20).measurement_time(Duration::from_secs(2)).configure_from_args();
    let mut group = criterion.benchmark_group("slide");
    group.throughput(Throughput::Elements(slide.len() as u64 - 1));
    for (name, entity) in &cases {
        let touching = touching(entity, &slide);
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                || touching.clone(),
                |finger| run(finger, entity, &slide[1..]),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
    criterion.final_summary();
}

fn table(cases: &[(String, Entity)], slide: &[Vector3<f64>]) {
    println!("one tick of a slide in ns: mean over the path, best of {ROUNDS} rounds\n");
    let mut best = vec![f64::INFINITY; cases.len()];
    for _ in 0..ROUNDS {
        for (best, (_, entity)) in best.iter_mut().zip(cases) {
            let mut finger = touching(entity, slide);
            let start = Instant::now();
            run(&mut finger, entity, &slide[1..]);
            *best = best.min(start.elapsed().as_nanos() as f64 / (slide.len() - 1) as f64);
        }
    }
    let mut without = 0.0;
    for ((name, entity), best) in cases.iter().zip(best) {
        if entity.shading == Shading::None {
            without = best;
        }
        println!("{name:<44} {best:>7.1}   {:>+6.1}", best - without);
    }
    println!();
    build_times();
}

/// The same slide on a ball, unshaded first, then shaded.
fn cases(meridians: usize) -> Vec<(String, Entity)> {
    let mesh = mesh(meridians);
    let shape = Shape::from(Arc::clone(&mesh));
    let mut cases = Vec::new();
    for (friction_name, friction) in
        [("no friction", Friction::None), ("mu = 0.5", Friction::Coulomb { mu: 0.5 })]
    {
        let plain = Entity::new(shape.clone(), Isometry3::identity(), path::K_N_PER_M).expect("an entity");
        let plain = plain.with_friction(friction).expect("a friction");
        for (how, shading) in shadings(&mesh) {
            let name = format!("{} triangles, {friction_name}, {how}", mesh.faces().len());
            cases.push((name, plain.clone().with_shading(shading)));
        }
    }
    cases
}

fn shadings(mesh: &Mesh) -> [(&'static str, Shading); 4] {
    let form = ShadingForm::Rotate;
    [
        ("unshaded", Shading::None),
        ("interpolated", Shading::interpolated(mesh, PI, form).expect("a shading")),
        ("regions of 2 mm", Shading::regions(mesh, 2e-3, PI, form).expect("a shading")),
        ("regions of 1 um", Shading::regions(mesh, 1e-6, PI, form).expect("a shading")),
    ]
}

fn mesh(meridians: usize) -> Arc<Mesh> {
    let soup = make::uv_sphere(meridians, path::rings(meridians), path::R);
    Arc::new(Mesh::build(soup).expect("a mesh").0)
}

/// One HIP outside, then those of the slide.
fn slide() -> Vec<Vector3<f64>> {
    let slide: Vec<_> = path::standard_path(path::smooth)
        .into_iter()
        .filter(|(phase, _)| *phase == Phase::Slide)
        .map(|(_, hip)| hip)
        .collect();
    let outside = slide[0] * (path::FREE_M / slide[0].norm());
    std::iter::once(outside).chain(slide).collect()
}

/// A finger that touches where the slide begins.
fn touching(entity: &Entity, slide: &[Vector3<f64>]) -> Finger {
    let mut finger = Finger::new(0.0, 1).expect("a finger");
    run(&mut finger, entity, &slide[..2]);
    finger
}

fn run(finger: &mut Finger, entity: &Entity, hips: &[Vector3<f64>]) {
    for hip in hips {
        black_box(finger.step(std::slice::from_ref(entity), hip, TICK_S));
    }
}

fn build_times() {
    let ball = mesh(1000);
    let boxes = Arc::new(Mesh::build(many_cubes(83_333)).expect("a mesh").0);
    for (name, mesh) in [("a ball", &ball), ("cubes, all creases", &boxes)] {
        let form = ShadingForm::Rotate;
        time(name, mesh, "interpolated", || Shading::interpolated(mesh, 0.7, form).expect("a shading"));
        time(name, mesh, "regions", || Shading::regions(mesh, 2e-3, 0.7, form).expect("a shading"));
    }
}

fn time(name: &str, mesh: &Mesh, how: &str, make: impl Fn() -> Shading) {
    let times = (0..5).map(|_| {
        let start = Instant::now();
        let bytes = black_box(make()).bytes();
        (start.elapsed().as_secs_f64(), bytes)
    });
    let (seconds, bytes) =
        times.fold((f64::INFINITY, 0), |(best, _), (seconds, bytes)| (best.min(seconds), bytes));
    let faces = mesh.faces().len();
    println!("{how} of {faces} triangles ({name}): {seconds:.3} s, {:.1} MB", bytes as f64 / 1e6);
}

/// Cubes side by side.
fn many_cubes(count: usize) -> haptics::mesh::TriangleSoup {
    let cube = make::cuboid([0.01; 3]);
    let mut soup = haptics::mesh::TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    for i in 0..count {
        let first = soup.vertices.len() as u32;
        let place = Vector3::new((i % 300) as f64, 0.0, (i / 300) as f64) * 0.02;
        soup.vertices.extend(cube.vertices.iter().map(|v| v + place));
        soup.faces.extend(cube.faces.iter().map(|face| face.map(|v| v + first)));
    }
    soup
}
