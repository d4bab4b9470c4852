//! What a simulated hand costs: a sub-step of its plant, and what comes with each tick.
//!
//! Run `cargo bench -p io-driver --bench hand`. `sub-step` is the force on the tip and the mass's motion, which a
//! simulated device does 8 to 32 times a tick; `tick` the intention, the tremor and the grip, once.

use criterion::{Criterion, criterion_group, criterion_main};
use io_driver::sim::hand::model_file::{Firmness, builtin, parse};
use io_driver::sim::hand::{Felt, HandModel, ImpedanceHand};
use nalgebra::Vector3;
use std::hint::black_box;
use std::path::Path;

fn pen(minds_slip: bool) -> HandModel {
    let text = builtin("pen-grip").expect("it comes with the program");
    let model = parse(text, Path::new("pen-grip"), Firmness::Usual).expect("it is tested");
    HandModel { minds_slip, ..model }
}

fn hand(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("hand");
    let (tip, velocity) = (Vector3::new(1e-3, 2e-3, -1e-3), Vector3::new(0.01, -0.02, 0.03));
    let mut moved = ImpedanceHand::new(&pen(false), Vector3::zeros(), 1);
    group.bench_function("sub-step", |bencher| {
        bencher.iter(|| {
            let force = moved.force_on_tip(black_box(tip), black_box(velocity));
            moved.advance(black_box(tip), black_box(velocity), 62.5e-6);
            black_box(force)
        });
    });
    for (name, minds_slip) in [("tick", false), ("tick, minding slip", true)] {
        let mut hand = ImpedanceHand::new(&pen(minds_slip), Vector3::zeros(), 1);
        let felt = Felt {
            force_on_user_D: Vector3::new(-1.0, 0.3, 0.0),
            partners_centroid_D: Some(Vector3::new(0.04, 0.0, 0.0)),
        };
        group.bench_function(name, |bencher| {
            bencher.iter(|| hand.intend(black_box(tip), black_box(felt), 1e-3));
        });
    }
}

criterion_group!(benches, hand);
criterion_main!(benches);
