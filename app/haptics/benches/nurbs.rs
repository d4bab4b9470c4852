//! What a tick of contact costs on rational patches.
//!
//! Run `cargo bench -p haptics --bench nurbs`. One point finger on a bicubic sheet of 20 x 20 polynomials, on a ball and
//! a vase: sliding (0.2 mm a tick, 2 mm deep) without friction and with Coulomb's, held, near the surface without
//! touching it, coming into contact, and far away. `nearest` is one question for the nearest point, asked again near
//! where it was asked last. `tip` is a finger that is pressed into the tip of a pit in which so many patches meet, their
//! edges shrunk to it.
#![allow(non_snake_case, unused_crate_dependencies, missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{DT, entity, pit, point_finger};
use criterion::{Criterion, criterion_group, criterion_main};
use haptics::nurbs::make;
use haptics::{Friction, Nurbs, NurbsPatch, Surface};
use nalgebra::Vector3;
use std::hint::black_box;
use std::sync::Arc;

const ROUND: usize = 1024;

fn all() -> Vec<(&'static str, Arc<Nurbs>)> {
    let built = |patches: &[NurbsPatch]| Arc::new(Nurbs::build(patches).unwrap().0);
    vec![
        ("sheet 20x20", built(&make::sheet(20, 0.1, 0.004))),
        ("ball", built(&make::sphere(0.05))),
        ("vase", built(&make::vase(0.1))),
    ]
}

/// Round a circle on one side of the surface, off it by `height_m`.
fn walk(nurbs: &Nurbs, height_m: f64) -> Vec<Vector3<f64>> {
    let surface = nurbs.surface(0.0);
    (0..ROUND)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / ROUND as f64;
            let aside = Vector3::new(angle.cos(), 0.0, angle.sin()) * 0.033;
            let at = match nurbs.sides() {
                haptics::mesh::Sides::Sheet => {
                    surface.entry(&(aside + Vector3::y()), &(aside - Vector3::y())).unwrap()
                }
                _ => surface.nearest(&(aside * 3.0 + Vector3::y() * 0.05)),
            };
            at.point_B + at.normal_B * height_m
        })
        .collect()
}

fn ticks(criterion: &mut Criterion) {
    for (work, friction, height_m) in [
        ("slide", Friction::None, -2e-3),
        ("coulomb", Friction::coulomb(0.3).unwrap(), -2e-3),
        ("held", Friction::coulomb(1e6).unwrap(), -2e-3),
        ("near", Friction::None, 1e-3),
        ("far", Friction::None, 0.3),
    ] {
        let mut group = criterion.benchmark_group(work);
        for (name, nurbs) in all() {
            let entities = [entity(nurbs.clone(), friction.clone())];
            let mut path = walk(&nurbs, height_m);
            let start = walk(&nurbs, 1e-3)[0];
            let mut finger = point_finger();
            finger.step(&entities, &start, DT);
            if work == "held" {
                path.truncate(1);
            }
            let touched = path.iter().filter(|hip| finger.step(&entities, *hip, DT).entity.is_some()).count();
            assert!((touched > path.len() * 9 / 10) == (height_m < 0.0), "{name} {work}: {touched}");
            let mut tick = 0;
            group.bench_function(name, |bencher| {
                bencher.iter(|| {
                    tick = (tick + 1) % path.len();
                    finger.step(black_box(&entities), black_box(&path[tick]), DT)
                });
            });
        }
    }
    let mut group = criterion.benchmark_group("first contact");
    for (name, nurbs) in all() {
        let entities = [entity(nurbs.clone(), Friction::None)];
        let (above, below) = (walk(&nurbs, 1e-3), walk(&nurbs, -1e-3));
        let mut finger = point_finger();
        let mut tick = 0;
        // Two ticks: in, and out again.
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                tick = (tick + 1) % ROUND;
                finger.step(black_box(&entities), black_box(&above[tick]), DT);
                finger.step(black_box(&entities), black_box(&below[tick]), DT)
            });
        });
    }
    group.finish();
}

fn nearest(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("nearest, warm");
    for (name, nurbs) in all() {
        let surface = nurbs.surface(0.0);
        let path = walk(&nurbs, -2e-3);
        let mut at = surface.nearest(&path[0]);
        let mut tick = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                tick = (tick + 1) % ROUND;
                at = surface.settle(black_box(&at), black_box(&path[tick]));
                at
            });
        });
    }
    group.finish();
}

fn tip(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tip");
    for patches in [8, 64, 512, 4096] {
        let entities = [entity(Arc::new(Nurbs::build(&pit(patches)).unwrap().0), Friction::None)];
        let mut finger = point_finger();
        finger.step(&entities, &(Vector3::y() * 0.01), DT);
        let hip = |tick: usize| {
            let angle = tick as f64 * 0.1;
            Vector3::new(5e-4 * angle.cos(), -2e-3, 5e-4 * angle.sin())
        };
        let touched =
            (0..ROUND).filter(|tick| finger.step(&entities, &hip(*tick), DT).entity.is_some()).count();
        assert_eq!(touched, ROUND);
        let mut tick = 0;
        group.bench_function(patches.to_string(), |bencher| {
            bencher.iter(|| {
                tick = (tick + 1) % ROUND;
                finger.step(black_box(&entities), black_box(&hip(tick)), DT)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, ticks, nearest, tip);
criterion_main!(benches);
