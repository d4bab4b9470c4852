//! What a tick costs the driver besides waiting and the devices' own input and output.
//!
//! Run `cargo bench -p io-driver`. `driver cycle` is one whole tick under a lease: read all devices,
//! publish the frame, examine the commander's reply, limit, write all motors. The commander's part, also
//! timed alone as `command publish`, is inside it: a tick without it would measure another path.

mod pair;

use criterion::{Criterion, criterion_group, criterion_main};
use pair::{IDEAL, PREMIUM, Pair, SIMULATED};
use shm_abi::Frame;
use std::hint::black_box;

fn cycles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("driver cycle");
    for (name, device, count) in [
        ("1 ideal", IDEAL, 1),
        ("3 ideal", IDEAL, 3),
        ("8 ideal", IDEAL, 8),
        ("3 replayed Premium", PREMIUM, 3),
    ] {
        let mut pair = Pair::new(device, count);
        group.bench_function(name, |bencher| bencher.iter(|| pair.tick()));
    }
}

/// With the mechanics of the ticks' time in it: sixteen steps of each arm in a millisecond.
fn simulated(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("driver cycle, simulated Premium in a pen grip");
    for (rate_hz, count) in [(1000, 1), (1000, 3), (4000, 1), (4000, 3)] {
        let mut pair = Pair::at_rate(rate_hz, SIMULATED, count);
        group.bench_function(format!("{count} at {rate_hz} Hz"), |bencher| bencher.iter(|| pair.tick()));
    }
}

fn memory(criterion: &mut Criterion) {
    let mut pair = Pair::new(IDEAL, 3);
    let mut tick = pair.tick;
    criterion.bench_function("frame publish", |bencher| {
        let mut frame = pair.driver.read_latest().expect("a frame");
        bencher.iter(|| {
            tick += 1;
            frame.tick = tick;
            pair.cycle.memory().write_frame(black_box(&frame));
            pair.cycle.memory().ring(tick, pair.cycle.lease());
        });
    });
    criterion.bench_function("frame publish and read", |bencher| {
        let mut frame = pair.driver.read_latest().expect("a frame");
        let mut read: Frame = frame;
        bencher.iter(|| {
            tick += 1;
            frame.tick = tick;
            pair.cycle.memory().write_frame(black_box(&frame));
            pair.cycle.memory().ring(tick, pair.cycle.lease());
            pair.driver.read_frame(tick, &mut read).expect("nobody else writes");
            black_box(&read);
        });
    });
    criterion.bench_function("command publish", |bencher| {
        bencher.iter(|| {
            tick += 1;
            pair.command.tick = tick;
            pair.commander.publish(black_box(&pair.command), &pair.driver);
        });
    });
}

criterion_group!(benches, cycles, simulated, memory);
criterion_main!(benches);
