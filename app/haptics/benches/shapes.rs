//! What a tick of contact costs on each closed form.
//!
//! Run `cargo bench -p haptics --bench shapes`. One point finger 2 mm below the surface walks over it by 0.2 mm a tick:
//! sliding without friction, sliding with stiction, and in free space a millimetre above. A plane and a ball stand
//! beside them to compare with.
#![allow(non_snake_case, unused_crate_dependencies, missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/solids.rs"]
mod solids;

use common::{DT, entity, point_finger, stiction};
use criterion::{Criterion, criterion_group, criterion_main};
use haptics::{Form, Friction, Surface};
use nalgebra::Vector3;
use std::hint::black_box;

/// Ticks of one round of the walk, which then repeats.
const ROUND: usize = 1024;

/// Back and forth over the upper side, off the surface by `height_m`.
fn walk(form: &Form, size_m: f64, height_m: f64) -> Vec<Vector3<f64>> {
    (0..ROUND)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / ROUND as f64;
            let aside = Vector3::new(angle.cos(), 0.0, angle.sin()) * 0.033;
            let above =
                form.entry(&(aside + Vector3::y() * 2.0 * size_m), &(aside - Vector3::y() * 2.0 * size_m));
            let at = above.unwrap_or_else(|| form.nearest(&aside));
            at.point_B + at.normal_B * height_m
        })
        .collect()
}

fn contact_update(criterion: &mut Criterion) {
    let mut all: Vec<(&str, Form, f64)> = solids::all().iter().map(|s| (s.name, s.form, s.size_m)).collect();
    all.insert(0, ("plane", solids::plane(), 0.1));
    for (work, friction, height_m) in
        [("slide", Friction::None, -2e-3), ("stiction", stiction(), -2e-3), ("free", Friction::None, 1e-3)]
    {
        let mut group = criterion.benchmark_group(work);
        for (name, form, size_m) in &all {
            let entities = [entity(*form, friction.clone())];
            let path = walk(form, *size_m, height_m);
            let mut finger = point_finger();
            let touched = path.iter().filter(|hip| finger.step(&entities, *hip, DT).entity.is_some()).count();
            assert!((touched > ROUND * 9 / 10) == (height_m < 0.0), "{name} {work}: {touched} of {ROUND}");
            let mut tick = 0;
            group.bench_function(*name, |bencher| {
                bencher.iter(|| {
                    tick = (tick + 1) % ROUND;
                    finger.step(black_box(&entities), black_box(&path[tick]), DT)
                });
            });
        }
    }
}

criterion_group!(benches, contact_update);
criterion_main!(benches);
