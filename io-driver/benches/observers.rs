//! What observers cost the driver's loop.
//!
//! Run `cargo bench -p io-driver --bench observers`. The driver ticks at 1 kHz on a CPU of its own, spinning
//! between its ticks; up to 60 processes on the other CPUs read every frame. Only ratios within one run are
//! worth quoting: blocks without, with one, with 20 and with 60 observers take turns.
//!
//! What it must be: a reader writes nothing into the driver's memory (it is mapped read-only), so that nobody
//! ever waits for it. All that it does to the driver is to hold copies of cache lines, which the driver must
//! take back before its next store: the line of the bell each tick, and those of the slot, which were read
//! 4096 ticks ago and are mostly gone from the readers' caches. Taking a line back costs one transfer, however
//! many hold it, and waits in the store buffer; only the fence in `doorbell::ring` is seen to wait for it.
//! Hence at most some 100 ns from none to one observer on another core, and nothing from 1 to 60.
//!
//! On two CPUs all observers share one: 60 of them keep it half busy, and what they take from the common
//! cache and from the memory's bandwidth is in the figures, too. Ratios below one are possible: a CPU that is
//! busy keeps the common cache and its clock awake, and what observers read stays in it.

mod pair;

use pair::{IDEAL, Pair};
use rustix::process::{Pid, Signal, kill_process};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use shm_abi::server::Server;
use shm_abi::{Frame, client};
use std::hint::spin_loop;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How many observers the blocks have.
const LEVELS: [usize; 4] = [0, 1, 20, 60];
const ROUNDS: usize = 20;
/// A block: ticks to get used to it, and ticks that count.
const WARM_UP: usize = 30;
const TICKS: usize = 250;
const PERIOD: Duration = Duration::from_millis(1);
/// An observer that is farther behind was stopped on purpose.
const STOPPED_TICKS: u64 = 20;
/// The places that an observer's process reads its work from.
const SOCKET: &str = "PHANTOM3_BENCH_SOCKET";

fn main() {
    if let Some(socket) = std::env::var_os(SOCKET) {
        return observe(&PathBuf::from(socket));
    }
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("driver.sock");
    let cpus = Cpus::split();
    let mut pair = Pair::new(IDEAL, 3);
    let stop = Arc::new(AtomicBool::new(false));
    let serving = serve(&pair, &socket, Arc::clone(&stop));
    let observers = Observers::start(&socket, LEVELS[LEVELS.len() - 1]);
    cpus.take_own();
    let times = measure(&mut pair, &observers);
    let (read, missed) = observers.end(&stop);
    serving.join().expect("the socket works");
    report(&cpus, &times, read, missed);
}

/// The driver's CPU, and everybody else's; the same where there is but one.
struct Cpus {
    own: CpuSet,
    count: usize,
}

impl Cpus {
    /// Leaves this process, and what it starts, on the others.
    fn split() -> Self {
        let all = sched_getaffinity(None).expect("CPUs");
        let first = (0..CpuSet::MAX_CPU).find(|cpu| all.is_set(*cpu)).expect("a CPU");
        let (mut own, mut others) = (CpuSet::new(), all);
        own.set(first);
        if all.count() > 1 {
            others.unset(first);
        }
        sched_setaffinity(None, &others).expect("the other CPUs");
        Self { own, count: all.count() as usize }
    }

    fn take_own(&self) {
        sched_setaffinity(None, &self.own).expect("the driver's CPU");
    }
}

fn serve(pair: &Pair, socket: &Path, stop: Arc<AtomicBool>) -> std::thread::JoinHandle<()> {
    let mut server = Server::bind(socket).expect("a socket");
    let memory = Arc::clone(&pair.memory);
    std::thread::spawn(move || {
        let mut events = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            server.poll(&memory, Duration::from_millis(20), &mut events).expect("the socket works");
        }
    })
}

/// Processes that read every frame, unless they are stopped.
struct Observers(Vec<Child>);

impl Observers {
    fn start(socket: &Path, count: usize) -> Self {
        let own = std::env::current_exe().expect("this program");
        let start =
            |_| Command::new(&own).env(SOCKET, socket).stdout(Stdio::piped()).spawn().expect("a process");
        let observers = Self((0..count).map(start).collect());
        // Attached and asleep before the first block.
        std::thread::sleep(Duration::from_secs(1));
        observers
    }

    fn let_run(&self, count: usize) {
        for (index, child) in self.0.iter().enumerate() {
            let signal = if index < count { Signal::CONT } else { Signal::STOP };
            kill_process(Pid::from_child(child), signal).expect("it lives");
        }
    }

    /// Ends them by ending the driver. Returns how many frames they read, and how many they missed.
    fn end(self, stop: &AtomicBool) -> (u64, u64) {
        self.let_run(self.0.len());
        stop.store(true, Ordering::Relaxed);
        let mut sum = (0, 0);
        for mut child in self.0 {
            let mut text = String::new();
            child.stdout.take().expect("a pipe").read_to_string(&mut text).expect("text");
            child.wait().expect("it ends");
            let mut numbers = text.split_whitespace().filter_map(|word| word.parse::<u64>().ok());
            sum = (sum.0 + numbers.next().unwrap_or(0), sum.1 + numbers.next().unwrap_or(0));
        }
        sum
    }
}

/// An observer's process: sleeps by the clock, as one should, and reads what is new.
fn observe(socket: &Path) {
    let attached = client::observe(socket, "bench").expect("an observer's place");
    let mut frame: Frame = bytemuck::Zeroable::zeroed();
    let (mut read, mut missed) = (0_u64, 0_u64);
    let mut next = attached.driver.latest_tick().unwrap_or(0) + 1;
    while attached.connection.is_open() {
        std::thread::sleep(PERIOD);
        let newest = attached.driver.latest_tick().unwrap_or(0);
        if newest > next + STOPPED_TICKS {
            next = newest;
        }
        while next <= newest {
            match attached.driver.read_frame(next, &mut frame) {
                Ok(()) => read += 1,
                Err(_) => missed += 1,
            }
            next += 1;
        }
    }
    println!("{read} {missed}");
}

/// Durations of the driver's cycle (ns) for each level.
fn measure(pair: &mut Pair, observers: &Observers) -> [Vec<u64>; LEVELS.len()] {
    let mut times: [Vec<u64>; LEVELS.len()] = Default::default();
    for _ in 0..ROUNDS {
        for (level, times) in LEVELS.iter().zip(&mut times) {
            observers.let_run(*level);
            let mut deadline = Instant::now();
            for tick in 0..WARM_UP + TICKS {
                deadline += PERIOD;
                while Instant::now() < deadline {
                    spin_loop();
                }
                let begun = Instant::now();
                pair.tick();
                if tick >= WARM_UP {
                    times.push(begun.elapsed().as_nanos() as u64);
                }
            }
        }
    }
    times
}

fn report(cpus: &Cpus, times: &[Vec<u64>; LEVELS.len()], read: u64, missed: u64) {
    let quantile = |times: &[u64], part: f64| {
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        sorted[(part * (sorted.len() - 1) as f64) as usize] as f64
    };
    let alone = quantile(&times[0], 0.5);
    println!("driver cycle, 3 ideal devices, {} CPUs, {} ticks each", cpus.count, times[0].len());
    println!("observers   median ns   ratio   p99 ns");
    for (level, times) in LEVELS.iter().zip(times) {
        let median = quantile(times, 0.5);
        println!("{level:9} {median:11} {:7.2} {:8}", median / alone, quantile(times, 0.99));
    }
    println!("the observers read {read} frames and missed {missed}");
}
