//! What a tick costs on trees of 2, 20 and 100 closed forms.
//!
//! `cargo bench -p haptics --bench csg -- table` prints median, p99.9 and worst of single ticks, and which that was; without
//! `table`, Criterion measures whole rounds. The solid is a plate of 0.1 m with knobs, dimples, bores and bricks, every fourth
//! of a kind; the finger, a point or a ball, walks over all of it, 1 mm below the plate's top, or in the open. The ways over it are
//! 0.2 mm a tick and cross edges of all kinds.
//!
//! The longest ticks: with friction the one god-object slides around a rim while the other, which knows whether the finger is
//! still held back, comes from an edge over a corner onto a face (1 us); what friction held on a bore's rim gives way and goes
//! around it in six rounds (2 us, once in 10,000 ticks); a finger that is lifted from the wall of one bore flies across the
//! plate through the neighbourhoods of a dozen other forms (3 us on 100 leaves).
//!
//! How single ticks are timed: the clock's own time is measured and taken off; the same tick is timed in [`RUNS`]
//! runs of the same path, and its best time is its cost: what only some runs show is the machine's. The worst of these costs
//! is that of a tick that takes as long every time. A tick is all of `Finger::step` with one entity.
#![allow(non_snake_case, missing_docs, unused_crate_dependencies)]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use criterion::{Criterion, Throughput};
use haptics::{Csg, CsgPart, CsgTree, Cuboid, Cylinder, Entity, Finger, Friction, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};

const DT: f64 = 1e-3;
const TICKS: usize = 10_000;
/// Runs of which each tick's best counts.
const RUNS: usize = 50;

fn main() {
    if std::env::args().any(|argument| argument == "table") {
        return print_table();
    }
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    for leaves in [2, 20, 100] {
        let mut group = criterion.benchmark_group(format!("{leaves} leaves"));
        group.throughput(Throughput::Elements(TICKS as u64));
        for (name, friction, height_m) in works() {
            let (entity, path) = (plate(leaves, friction), path(height_m));
            let mut finger = Finger::new(0.0, 1).expect("a finger");
            group.bench_function(name, |bencher| {
                bencher.iter(|| {
                    for hip in &path {
                        black_box(finger.step(std::slice::from_ref(&entity), black_box(hip), DT));
                    }
                });
            });
        }
    }
    criterion.final_summary();
}

fn works() -> [(&'static str, Friction, f64); 5] {
    [
        ("slide", Friction::None, -1e-3),
        ("coulomb", Friction::coulomb(0.3).expect("friction"), -1e-3),
        ("stiction", Friction::stiction(0.7, 0.3).expect("friction"), -1e-3),
        ("free, near", Friction::None, 4e-3),
        ("free, far", Friction::None, 5e-2),
    ]
}

/// A plate and `leaves - 1` forms on a grid.
fn plate(leaves: usize, friction: Friction) -> Entity {
    let mut solid = CsgPart::from(Cuboid::new([0.1, 0.01, 0.1]).expect("a box"));
    let across = (leaves as f64).sqrt().ceil() as usize;
    let pitch_m = 0.1 / across as f64;
    for i in 1..leaves {
        let place = |n: usize| (n as f64 + 0.5) * pitch_m - 0.05;
        let at = Vector3::new(place(i % across), 5e-3, place(i / across));
        let size_m = 0.3 * pitch_m.min(0.01);
        let tree = match i % 4 {
            0 => CsgTree::union([solid, CsgPart::at(Sphere::new(size_m).expect("a ball"), at)]),
            1 => CsgTree::difference([solid, CsgPart::at(Sphere::new(size_m).expect("a ball"), at)]),
            2 => CsgTree::difference([solid, CsgPart::at(Cylinder::new(size_m, 0.03).expect("a bore"), at)]),
            _ => CsgTree::union([solid, CsgPart::at(Cuboid::new([size_m; 3]).expect("a brick"), at)]),
        };
        solid = tree.into();
        if i % 12 == 0 {
            // Trees in trees have a bound.
            solid = CsgTree::union([solid]).into();
        }
    }
    let csg = Csg::build(&flat(solid)).expect("a solid");
    Entity::new(Shape::from(Arc::new(csg)), Isometry3::identity(), 500.0)
        .and_then(|entity| entity.with_friction(friction))
        .expect("an entity")
}

/// First all that is united, then all that is taken away: two levels, whatever the number of leaves.
fn flat(part: CsgPart) -> CsgTree {
    let (mut united, mut taken) = (Vec::new(), Vec::new());
    collect(part, &mut united, &mut taken);
    CsgTree::difference(std::iter::once(CsgPart::from(CsgTree::union(united))).chain(taken))
}

fn collect(part: CsgPart, united: &mut Vec<CsgPart>, taken: &mut Vec<CsgPart>) {
    match part.shape {
        haptics::PartShape::Tree(tree) => {
            let mut parts = tree.parts.into_iter();
            if let Some(first) = parts.next() {
                collect(first, united, taken);
            }
            if tree.op == haptics::CsgOp::Difference { taken.extend(parts) } else { united.extend(parts) }
        }
        haptics::PartShape::Form(_) => united.push(part),
    }
}

/// Back and forth over the plate.
fn path(height_m: f64) -> Vec<Vector3<f64>> {
    let at = |i: usize| {
        let t = i as f64 * 2e-4 / 0.045;
        // Lifted every 40 mm: a finger that fell into a bore would stay there with its HIP far beyond the wall.
        let lift_m = 8e-3 * (std::f64::consts::PI * (i % 200) as f64 / 20.0).sin().max(0.0);
        let lift_m = if i % 200 < 20 { lift_m } else { 0.0 };
        Vector3::new(0.045 * t.sin(), 5e-3 + height_m + lift_m, 0.045 * (0.618 * t).cos())
    };
    // From above, and up again.
    let down = (0..100).map(|i| at(0) + Vector3::y() * (1e-3 * f64::from(100 - i)));
    down.chain((0..TICKS).map(at)).collect()
}

fn print_table() {
    let clock = median(&mut (0..10_001).map(|_| time(|| ())).collect::<Vec<_>>());
    println!(
        "{:>7} {:>14} {:>10} {:>10} {:>10} {:>8} {:>9}",
        "leaves", "", "median ns", "p99.9 ns", "worst ns", "at tick", "touching"
    );
    for leaves in [2, 20, 100] {
        for (name, friction, height_m) in works() {
            print_row(leaves, name, 0.0, (friction, height_m), clock);
        }
    }
    println!("balls, 1 mm deep");
    for radius_m in [1e-3, 2e-3, 5e-3] {
        for (name, friction, height_m) in works().into_iter().take(2) {
            let name = format!("{name}, {:.0} mm", 1e3 * radius_m);
            print_row(20, &name, radius_m, (friction, height_m + radius_m), clock);
        }
    }
}

fn print_row(leaves: usize, name: &str, radius_m: f64, (friction, height_m): (Friction, f64), clock: f64) {
    let (entity, path) = (plate(leaves, friction), path(height_m));
    let mut best = vec![f64::INFINITY; path.len()];
    let mut touching = 0;
    for _ in 0..RUNS {
        let mut finger = Finger::new(radius_m, 1).expect("a finger");
        touching = 0;
        for (hip, best) in path.iter().zip(&mut best) {
            let mut out = None;
            let taken = time(|| out = Some(finger.step(std::slice::from_ref(&entity), black_box(hip), DT)));
            *best = best.min(taken - clock);
            touching += usize::from(out.is_some_and(|out| out.entity.is_some()));
        }
    }
    let touching = 100 * touching / path.len();
    let worst_at = (0..best.len()).max_by(|&i, &j| best[i].total_cmp(&best[j])).unwrap_or(0);
    let median = median(&mut best);
    let [high, worst] = [best[best.len() * 999 / 1000], best[best.len() - 1]];
    println!("{leaves:>7} {name:>14} {median:>10.0} {high:>10.0} {worst:>10.0} {worst_at:>8} {touching:>8}%");
}

fn time(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_nanos() as f64
}

/// Sorts them.
fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
