//! Cost of a tick by friction model: one finger on a plane, sliding and sticking by turns.
//!
//! `cargo bench -p haptics --bench friction`; quote medians against the one without friction.
#![allow(missing_docs, reason = "the macros of criterion")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use haptics::{Entity, Finger, Friction, Plane};
use nalgebra::{Isometry3, Vector3};

/// A second at 1 kHz, to and fro over 60 mm at up to 0.19 m/s, 5 mm deep.
fn path() -> Vec<Vector3<f64>> {
    let angle = |i: i32| std::f64::consts::TAU * f64::from(i) * 1e-3;
    (0..1000).map(|i| Vector3::new(0.03 * angle(i).sin(), -5e-3, 1e-3 * angle(3 * i).cos())).collect()
}

fn models() -> Vec<(&'static str, Friction)> {
    let curve = [(0.0, 0.7), (0.02, 0.5), (0.05, 0.35), (0.1, 0.3), (0.5, 0.34), (1.0, 0.4)];
    let models = [
        ("none", Ok(Friction::None)),
        ("coulomb", Friction::coulomb(0.3)),
        ("stiction", Friction::stiction(0.7, 0.3)),
        ("coulomb-viscous", Friction::coulomb_viscous(0.3, 0.1)),
        ("stribeck", Friction::stribeck(0.7, 0.3, 0.05, 0.1)),
        ("curve of 6 points", Friction::curve(0.7, &curve)),
        ("karnopp", Friction::karnopp(0.7, 0.3, 0.02, 0.1)),
        ("dahl", Friction::dahl(0.3)),
        ("hayward-armstrong", Friction::hayward_armstrong(0.3, 0.6)),
        ("lugre", Friction::lugre(0.7, 0.3, 0.05, 0.1, 0.5)),
        ("20 bristles", Friction::bristle(0.3, 20, 1)),
        ("reset integrator", Friction::reset_integrator(0.7, 0.3, 0.5)),
        ("fixed cone", Friction::fixed_cone(0.75, Some(1.75))),
    ];
    models.into_iter().map(|(name, model)| (name, model.expect("in range"))).collect()
}

fn ticks(criterion: &mut Criterion) {
    let path = path();
    let mut group = criterion.benchmark_group("friction tick");
    for (name, friction) in models() {
        let plane = Plane::new(Vector3::y(), 0.0).expect("a direction");
        let entity = Entity::new(plane, Isometry3::identity(), 500.0).expect("above zero");
        let entity = [entity.with_friction(friction).expect("in range")];
        let mut finger = Finger::new(0.0, 1).expect("a radius");
        let mut tick = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                tick = (tick + 1) % path.len();
                black_box(finger.step(&entity, black_box(&path[tick]), 1e-3))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, ticks);
criterion_main!(benches);
