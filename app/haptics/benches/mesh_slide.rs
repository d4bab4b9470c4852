//! What a tick costs on meshes of 1000 to 1,000,000 triangles, along the standard path (`tests/common/path.rs`).
//!
//! `cargo bench -p haptics --bench mesh_slide -- table` prints one table of all of it in about two minutes: median,
//! p99, p99.9 and maximum of single ticks per phase, for the Friction Cone Algorithm without and with friction, for a
//! shuffled input, for the bumpy ball, for cold caches, and for the baselines. Without `table`, Criterion measures
//! whole phases.
//!
//! How single ticks are timed: the system's clock costs tens of nanoseconds per reading, its median is measured and
//! taken off. The path is the same each time, so the same tick is timed in several runs and its best time is its cost;
//! what the machine did meanwhile shows in the last two columns, which are of one run as it was. A tick here is all
//! of `Finger::step` with one entity.
#![allow(non_snake_case)]

#[path = "../tests/common/path.rs"]
mod path;
#[path = "mesh_slide/table.rs"]
mod table;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{BatchSize, Criterion, Throughput};
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Algorithm, Entity, Finger, Friction, Shape};
use nalgebra::{Isometry3, Vector3};
use path::{PHASES, Phase, RadiusAt, TICK_S};

/// Meridians of the balls, for about 1e3, 1e4, 1e5 and 1e6 triangles.
pub(crate) const SIZES: [usize; 4] = [32, 100, 316, 1000];

fn main() {
    if std::env::args().any(|argument| argument == "table") {
        return table::print();
    }
    let mut criterion =
        Criterion::default().sample_size(20).measurement_time(Duration::from_secs(2)).configure_from_args();
    for meridians in [SIZES[0], SIZES[3]] {
        let shape = shape_of(make::uv_sphere(meridians, path::rings(meridians), path::R));
        for (name, friction) in frictions() {
            let entity = entity(&shape, friction, Algorithm::FrictionCone);
            phases(&mut criterion, &format!("{meridians} meridians, {name}"), &entity, path::smooth);
        }
    }
    criterion.final_summary();
}

/// Each phase as a whole, from the state in which the one before ended.
fn phases(criterion: &mut Criterion, name: &str, entity: &Entity, radius_at: RadiusAt) {
    let path = path::standard_path(radius_at);
    let mut finger = Finger::new(0.0, 1).expect("a finger");
    let mut group = criterion.benchmark_group(name);
    for (phase, ticks) in PHASES {
        let hips: Vec<_> = path.iter().filter(|(of, _)| *of == phase).map(|(_, hip)| *hip).collect();
        group.throughput(Throughput::Elements(ticks as u64));
        group.bench_function(format!("{phase:?}"), |bencher| {
            bencher.iter_batched_ref(
                || finger.clone(),
                |finger| run(finger, entity, &hips),
                BatchSize::LargeInput,
            );
        });
        run(&mut finger, entity, &hips);
    }
}

pub(crate) fn run(finger: &mut Finger, entity: &Entity, hips: &[Vector3<f64>]) {
    for hip in hips {
        black_box(finger.step(std::slice::from_ref(entity), hip, TICK_S));
    }
}

pub(crate) fn frictions() -> [(&'static str, Friction); 2] {
    [("no friction", Friction::None), ("mu = 0.5", Friction::Coulomb { mu: 0.5 })]
}

pub(crate) fn shape_of(soup: TriangleSoup) -> Shape {
    Arc::new(Mesh::build(soup).expect("a mesh").0).into()
}

pub(crate) fn entity(shape: &Shape, friction: Friction, algorithm: Algorithm) -> Entity {
    let entity = Entity::new(shape.clone(), Isometry3::identity(), path::K_N_PER_M).expect("an entity");
    entity.with_friction(friction).expect("a friction").with_algorithm(algorithm)
}

/// Which phase a tick belongs to.
pub(crate) fn phases_of(path: &[(Phase, Vector3<f64>)]) -> Vec<Phase> {
    path.iter().map(|(phase, _)| *phase).collect()
}
