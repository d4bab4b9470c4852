//! What keeping a finger passive costs a tick: while the force passes, and while it is changed.
//!
//! `cargo bench -p haptics --bench passivity`
#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use haptics::passivity::{Passivity, PassivitySpec, Port};
use nalgebra::Vector3;
use std::hint::black_box;

const DT: f64 = 1e-3;

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("passivity");
    // A finger that goes to and fro, one tick each way, so that energy neither comes nor goes.
    for (name, force_n, moved_m) in [("passes", 1.0, 1e-5), ("is changed", 50.0, 1e-5)] {
        let mut passivity = Passivity::new(PassivitySpec::usual(DT), DT).expect("in range");
        let ports = [0.0, 1.0].map(|side| {
            let force = Vector3::new(0.3, 1.0, -0.2) * force_n;
            Port::new(Vector3::new(side * moved_m, 0.0, 0.0), force, DT).storing(1.0)
        });
        let mut side = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                side = 1 - side;
                black_box(passivity.step(black_box(&ports[side])))
            });
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
