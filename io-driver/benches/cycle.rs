//! What a tick costs the driver besides waiting and the devices' own input and output.
//!
//! Run `cargo bench -p io-driver`. `driver cycle` is one whole tick under a lease: read all devices,
//! publish the frame, examine the commander's reply, limit, write all motors. The commander's part, also
//! timed alone as `command publish`, is inside it: a tick without it would measure another path.

use criterion::{Criterion, criterion_group, criterion_main};
use io_driver::config::DriverConfig;
use io_driver::cycle::Cycle;
use io_driver::driver::{describe, make_cycle};
use io_driver::open::open_devices;
use shm_abi::doorbell::WaitMode;
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverView, Frame};
use std::hint::black_box;
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::Arc;

const LEASE: u64 = 1;
const IDEAL: &str = "[[device]]\nbackend = \"ideal\"\npeak_force_n = 8.5\n";
const PREMIUM: &str =
    "[[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"traces/circle.csv\"\n";

/// A driver and its commander in one process, as under the virtual clock.
struct Pair {
    cycle: Cycle,
    driver: DriverView,
    commander: CommanderMemory,
    command: Command,
    tick: u64,
}

impl Pair {
    fn new(device: &str, count: usize) -> Self {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/driver/bench.toml"));
        let config = DriverConfig::parse(&device.repeat(count), file).expect("a configuration");
        let devices = open_devices(&config).expect("devices");
        let info = describe(&config, &devices, WaitMode::Spin);
        let memory = Arc::new(DriverMemory::create(&info).expect("memory"));
        let driver = DriverView::map(memory.fd()).expect("a view");
        let (view, fd) = CommanderView::create(LEASE).expect("a lease");
        let commander = CommanderMemory::map(fd.as_fd()).expect("its memory");
        let mut cycle = make_cycle(&config, memory, devices);
        cycle.grant(view);
        cycle.change_lease();
        let mut command = Command::zero(0, LEASE, count as u64);
        // Above the peak for a Premium and an ideal device here: the limit is part of the work.
        command.devices[..count].iter_mut().for_each(|device| device.force_on_user_n = [6.0, -6.0, 3.0]);
        let mut pair = Self { cycle, driver, commander, command, tick: 0 };
        // Past the ramp of 200 ticks, and round the ring of frames once, so that every page is warm.
        (0..5000).for_each(|_| pair.tick());
        assert_eq!(pair.cycle.safety().authority(), 1.0);
        pair
    }

    fn tick(&mut self) {
        self.tick += 1;
        self.cycle.sense(self.tick, 0);
        self.command.tick = self.tick;
        self.commander.publish(&self.command, &self.driver);
        assert!(self.cycle.take_reply());
        self.cycle.actuate();
    }
}

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

criterion_group!(benches, cycles, memory);
criterion_main!(benches);
