//! What a simulated device costs: one tick, from reading to writing, of a Premium in a pen grip.
//!
//! Run `cargo bench -p io-driver --bench simulated`. In `held` the hand trembles about a place and the motors push with
//! one newton: friction, motors, encoders and hand all work. `free` is the same with nobody at the tip.

use criterion::{Criterion, criterion_group, criterion_main};
use io_driver::config::DriverConfig;
use io_driver::device::{Device, Effort, TickTime};
use io_driver::open::open_devices;
use nalgebra::Vector3;
use std::hint::black_box;
use std::path::Path;

fn device(rate_hz: u32, hand: &str) -> Box<dyn Device> {
    let text = format!(
        "rate_hz = {rate_hz}\n[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\n\
         start_m = [0.0, 0.05, 0.0]\nhand_model = \"{hand}\"\n"
    );
    let config = DriverConfig::parse(&text, Path::new("bench")).expect("a configuration");
    open_devices(&config).expect("devices").remove(0)
}

fn tick(device: &mut dyn Device, tick: u64, rate_hz: u32) {
    let time = TickTime::counted(tick, 1_000_000_000 / u64::from(rate_hz), tick.cast_signed());
    black_box(device.read(time).expect("it is in order"));
    let effort = Effort { force_on_user_n: Vector3::new(0.3, 0.9, -0.3), gravity_share: 1.0 };
    black_box(device.write(black_box(effort)).expect("it is in order"));
}

fn simulated(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulated device, tick");
    for rate_hz in [1000, 4000] {
        for (name, hand) in [("held", "pen-grip"), ("free", "nobody")] {
            let mut device = device(rate_hz, hand);
            let mut now = 0;
            group.bench_function(format!("{name}, {rate_hz} Hz"), |bencher| {
                bencher.iter(|| {
                    now += 1;
                    tick(device.as_mut(), now, rate_hz);
                });
            });
        }
    }
}

criterion_group!(benches, simulated);
criterion_main!(benches);
