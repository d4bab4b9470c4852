//! What a frame costs by the number of devices that exist.
//!
//! Run `cargo bench -p shm-abi`. A frame of eight devices is all 335 words, which every frame once was. The
//! counts take turns within one run; only their ratios are worth quoting. `one thread` writes and reads in the
//! same cache; `ping` writes a frame on one CPU, reads it on another and comes back with a command.

use bytemuck::Zeroable;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DeviceInfo, DriverInfo};
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverView, Frame};
use std::hint::{black_box, spin_loop};
use std::os::fd::AsFd;
use std::time::Instant;

const COUNTS: [usize; 3] = [1, 3, 8];
const ROUNDS: usize = 300;
/// Frames in a block of one count.
const BLOCK: u64 = 500;

struct Pair {
    memory: DriverMemory,
    driver: DriverView,
    commander: CommanderMemory,
    view: CommanderView,
    tick: u64,
}

impl Pair {
    fn new(devices: usize) -> Self {
        let memory = DriverMemory::create(&info(devices)).expect("memory");
        let driver = DriverView::map(memory.fd()).expect("a view");
        let (view, fd) = CommanderView::create(1).expect("a lease");
        let commander = CommanderMemory::map(fd.as_fd()).expect("its memory");
        Self { memory, driver, commander, view, tick: 0 }
    }

    fn write(&mut self, frame: &mut Frame) {
        self.tick += 1;
        frame.tick = self.tick;
        self.memory.write_frame(black_box(frame));
        self.memory.ring(self.tick, None);
    }

    /// Nanoseconds a frame, written and read by one thread.
    fn one_thread(&mut self) -> f64 {
        let (mut frame, mut read) = (Frame::zeroed(), Frame::zeroed());
        let begun = Instant::now();
        for _ in 0..BLOCK {
            self.write(&mut frame);
            self.driver.read_frame(self.tick, &mut read).expect("nobody else writes");
            black_box(&read);
        }
        begun.elapsed().as_nanos() as f64 / BLOCK as f64
    }

    /// Nanoseconds from a frame to its answer, each side spinning on a CPU of its own.
    fn ping(&mut self, cpus: &[CpuSet; 2]) -> f64 {
        let (first, last) = (self.tick + 1, self.tick + BLOCK);
        let begun = std::thread::scope(|scope| {
            let (driver, commander) = (&self.driver, &self.commander);
            scope.spawn(move || {
                sched_setaffinity(None, &cpus[1]).expect("the other CPU");
                let (mut read, mut command) = (Frame::zeroed(), Command::zeroed());
                for tick in first..=last {
                    while driver.latest_tick() != Some(tick) {
                        spin_loop();
                    }
                    driver.read_frame(tick, &mut read).expect("nobody writes before the answer");
                    command.tick = black_box(&read).tick;
                    commander.publish(&command, driver);
                }
            });
            sched_setaffinity(None, &cpus[0]).expect("a CPU");
            let mut frame = Frame::zeroed();
            let mut begun = Instant::now();
            for round in 0..BLOCK {
                self.tick += 1;
                frame.tick = self.tick;
                self.memory.write_frame(black_box(&frame));
                self.memory.ring(self.tick, Some(&self.view));
                while self.view.latest_tick() != Some(self.tick) {
                    spin_loop();
                }
                if round == 0 {
                    // The other thread has started.
                    begun = Instant::now();
                }
            }
            begun.elapsed()
        });
        begun.as_nanos() as f64 / (BLOCK - 1) as f64
    }
}

fn info(devices: usize) -> DriverInfo {
    let device = DeviceInfo {
        name: "device".into(),
        kind: "ideal".into(),
        peak_force_n: 8.5,
        continuous_force_n: 1.4,
        workspace_min_m: [-0.1; 3],
        workspace_max_m: [0.1; 3],
        slew_n_per_s: f64::INFINITY,
        speed_limit_m_per_s: f64::INFINITY,
    };
    DriverInfo {
        period_ns: 1_000_000,
        reply_budget_ns: 300_000,
        max_command_age_ticks: 5,
        ramp_in_ticks: 200,
        ramp_out_ticks: 50,
        is_commissioning: false,
        clock_mode: ClockMode::Virtual,
        wait_mode: WaitMode::Spin,
        cpu: None,
        devices: vec![device; devices],
        setup_report: String::new(),
    }
}

fn two_cpus() -> Option<[CpuSet; 2]> {
    let all = sched_getaffinity(None).ok()?;
    let mut singles = (0..CpuSet::MAX_CPU).filter(|cpu| all.is_set(*cpu)).map(|cpu| {
        let mut single = CpuSet::new();
        single.set(cpu);
        single
    });
    Some([singles.next()?, singles.next()?])
}

fn compare(what: &str, mut measure: impl FnMut(&mut Pair) -> f64) {
    let mut pairs = COUNTS.map(Pair::new);
    let mut times: [Vec<f64>; COUNTS.len()] = Default::default();
    for _ in 0..ROUNDS {
        for (pair, times) in pairs.iter_mut().zip(&mut times) {
            times.push(measure(pair));
        }
    }
    let medians = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    for (count, median) in COUNTS.iter().zip(medians) {
        println!("{what}, {count} devices: median {median:.0} ns, {:.2} of 8 devices", median / medians[2]);
    }
}

fn main() {
    compare("one thread", Pair::one_thread);
    match two_cpus() {
        Some(cpus) => compare("ping", |pair| pair.ping(&cpus)),
        None => println!("ping: skipped, it needs two CPUs"),
    }
}
