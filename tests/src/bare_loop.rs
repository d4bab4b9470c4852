//! The least that a driver and an application can do together: what is left is the machine's.
//!
//! Problem: missed replies and late wake-ups say little by themselves on a machine that is shared or
//! virtual. Compared with a loop that does nothing but wait and answer, on the same CPUs, in turns, they
//! say what our own code costs.
//! Model: a leader on the driver's CPU wakes on the driver's grid of deadlines, publishes the tick's number
//! and waits for its echo until the driver's budget ends. A responder on the fast thread's CPU sleeps until
//! shortly before the next tick, spins and echoes. Set-up, priorities, phase and margins are the
//! programs' own; the loops are written here anew, so that a mistake in theirs is not repeated.
//! Two threads instead of two processes: on two CPUs the kernel treats both alike, and if it made a
//! difference the reference would be the better one for it.
//! Invariant: nothing is counted in the warm-up.

use io_driver::config::DriverConfig;
use phantom3::fast_thread;
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use rt_core::histogram::{BUCKETS, Histogram};
use rt_core::setup::{SetupReport, SetupRequest};
use serde_json::{Value, json};
use std::hint::spin_loop;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::Thread;
use std::time::Duration;

/// What was counted and measured, over one slice or several.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Ticks served.
    pub ticks: u64,
    /// Of these, not answered within the budget.
    pub missed: u64,
    /// Deadlines that passed unserved.
    pub overruns: u64,
    /// How late the leader woke.
    pub wake_error: Histogram,
    /// From publishing to the echo, where it came in time.
    pub round_trip: Histogram,
}

impl Outcome {
    /// Nothing yet.
    pub fn none() -> Self {
        Self { ticks: 0, missed: 0, overruns: 0, wake_error: Histogram::new(), round_trip: Histogram::new() }
    }

    /// Adds another slice's.
    pub fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.missed += other.missed;
        self.overruns += other.overruns;
        self.wake_error.merge(&other.wake_error);
        self.round_trip.merge(&other.round_trip);
    }

    fn to_json(&self) -> Value {
        let histogram = |h: &Histogram| json!({ "counts": h.counts().to_vec(), "max": h.max() });
        json!({
            "ticks": self.ticks, "missed": self.missed, "overruns": self.overruns,
            "wake_error": histogram(&self.wake_error), "round_trip": histogram(&self.round_trip),
        })
    }

    /// Reads what the program printed.
    pub fn parse(text: &str) -> Option<Self> {
        let value: Value = serde_json::from_str(text).ok()?;
        let histogram = |name: &str| {
            let read: Option<Vec<u64>> =
                value[name]["counts"].as_array()?.iter().map(Value::as_u64).collect();
            let counts: [u64; BUCKETS] = read?.try_into().ok()?;
            Some(Histogram::from_counts(&counts, value[name]["max"].as_u64()?))
        };
        Some(Self {
            ticks: value["ticks"].as_u64()?,
            missed: value["missed"].as_u64()?,
            overruns: value["overruns"].as_u64()?,
            wake_error: histogram("wake_error")?,
            round_trip: histogram("round_trip")?,
        })
    }
}

/// `bare-loop SECONDS < DRIVER_CONFIGURATION`: prints an [`Outcome`] as JSON.
pub fn main() -> ExitCode {
    let seconds = std::env::args().nth(1).and_then(|text| text.parse::<f64>().ok());
    let config =
        std::io::read_to_string(std::io::stdin()).map(|text| DriverConfig::parse(&text, Path::new("-")));
    let (Some(seconds), Ok(Ok(config))) = (seconds, config) else {
        eprintln!("usage: bare-loop SECONDS < DRIVER_CONFIGURATION");
        return ExitCode::from(2);
    };
    println!("{}", run(&config, seconds).to_json());
    ExitCode::SUCCESS
}

/// What a calibration of the driver gives on such machines, a little more.
const SPIN_MARGIN_NS: u64 = 150_000;
/// Not measured: the caches, the clock's frequency and the kernel's balancing settle.
pub const WARM_UP: Duration = Duration::from_millis(500);

/// What leader and responder share; a cache line for each direction, as in the segments.
#[derive(Default)]
struct Shared {
    tick: Line,
    echo: Line,
    /// When the tick was due.
    deadline_ns: AtomicU64,
    over: AtomicBool,
}

#[derive(Default)]
#[repr(align(64))]
struct Line(AtomicU64);

/// Runs for so long, after the warm-up, with the driver's period, budget, phase, margin and rights.
fn run(config: &DriverConfig, seconds: f64) -> Outcome {
    let shared = Shared::default();
    // Each must know what both obtained, as the programs do, before it decides how to wait.
    let (ready, spins) = (Barrier::new(2), AtomicU64::new(0));
    let leader_thread = std::thread::current();
    let cpus = rt_core::cpu::online_cpus();
    let leader_cpu = config.real_time.cpu.or_else(|| cpus.last().copied().filter(|_| cpus.len() > 1));
    let responder_cpu = cpus.iter().rev().copied().find(|cpu| Some(*cpu) != leader_cpu);
    let apart = leader_cpu.is_some() && responder_cpu.is_some();
    std::thread::scope(|scope| {
        let responder = scope.spawn(|| {
            let request = SetupRequest {
                fifo_priority: config.real_time.priority.map(|_| fast_thread::FIFO_PRIORITY),
                cpu: responder_cpu,
                dma_latency_us: None,
                ..request(config, None)
            };
            let (report, _guards) = rt_core::setup::apply(&request);
            spins.fetch_add(u64::from(apart && may_spin(&report)), Ordering::SeqCst);
            ready.wait();
            respond(&shared, config, spins.load(Ordering::SeqCst) == 2, &leader_thread);
        });
        let (report, _guards) = rt_core::setup::apply(&request(config, leader_cpu));
        spins.fetch_add(u64::from(apart && may_spin(&report)), Ordering::SeqCst);
        ready.wait();
        let outcome = lead(&shared, config, seconds, spins.load(Ordering::SeqCst) == 2, responder.thread());
        shared.over.store(true, Ordering::Relaxed);
        responder.thread().unpark();
        outcome
    })
}

fn request(config: &DriverConfig, cpu: Option<usize>) -> SetupRequest {
    SetupRequest {
        fifo_priority: config.real_time.priority,
        cpu,
        lock_memory: config.real_time.lock_memory,
        prefault_stack_bytes: 256 * 1024,
        prefault_heap_bytes: 0,
        timer_slack_ns: Some(1),
        dma_latency_us: Some(0),
    }
}

fn may_spin(report: &SetupReport) -> bool {
    ["scheduling", "cpu"].iter().all(|name| report.find(name).is_some_and(|item| item.obtained))
}

fn lead(shared: &Shared, config: &DriverConfig, seconds: f64, spin: bool, responder: &Thread) -> Outcome {
    let period_ns = config.period_ns;
    let ticks_of = |duration: f64| (duration * 1e9 / period_ns as f64) as u64;
    let warm_up = ticks_of(WARM_UP.as_secs_f64());
    let last = warm_up + ticks_of(seconds);
    let mut outcome = Outcome::none();
    let mut deadline_ns = first_deadline(config);
    let mut tick = 0;
    while tick < last {
        let woke_ns = wait_until(deadline_ns, SPIN_MARGIN_NS);
        // From the first deadline that nobody served, as the driver and cyclictest count.
        let late_ns = woke_ns - deadline_ns;
        let skipped = late_ns / period_ns;
        deadline_ns += skipped * period_ns;
        tick += 1 + skipped;
        shared.deadline_ns.store(deadline_ns, Ordering::Relaxed);
        let told_ns = monotonic_ns();
        shared.tick.0.store(tick, Ordering::Release);
        responder.unpark();
        let in_time = wait_for_echo(shared, tick, deadline_ns + config.reply.budget_ns, spin);
        if tick > warm_up {
            outcome.ticks += 1;
            outcome.overruns += skipped;
            outcome.wake_error.record(late_ns);
            match in_time {
                true => outcome.round_trip.record(monotonic_ns() - told_ns),
                false => outcome.missed += 1,
            }
        }
        deadline_ns += period_ns;
    }
    outcome
}

fn first_deadline(config: &DriverConfig) -> u64 {
    (monotonic_ns() / config.period_ns + 2) * config.period_ns + config.real_time.phase_offset_ns
}

/// Sleeps, then spins; returns when that ended.
fn wait_until(deadline_ns: u64, margin_ns: u64) -> u64 {
    let sleep_until = deadline_ns.saturating_sub(margin_ns);
    while monotonic_ns() < sleep_until {
        sleep_until_ns(sleep_until);
    }
    loop {
        let now = monotonic_ns();
        if now >= deadline_ns {
            return now;
        }
        spin_loop();
    }
}

fn wait_for_echo(shared: &Shared, tick: u64, until_ns: u64, spin: bool) -> bool {
    while shared.echo.0.load(Ordering::Acquire) != tick {
        let now = monotonic_ns();
        if now >= until_ns {
            return false;
        }
        if spin {
            spin_loop();
        } else {
            std::thread::park_timeout(Duration::from_nanos(until_ns - now));
        }
    }
    true
}

fn respond(shared: &Shared, config: &DriverConfig, spin: bool, leader: &Thread) {
    let period_ns = config.period_ns;
    let margin_ns = fast_thread::spin_margin_ns(period_ns);
    let mut seen = 0;
    while !shared.over.load(Ordering::Relaxed) {
        let tick = shared.tick.0.load(Ordering::Acquire);
        if tick == seen {
            // The leader is long overdue, or this thread has no CPU of its own.
            std::thread::park_timeout(Duration::from_millis(20));
            continue;
        }
        seen = tick;
        shared.echo.0.store(tick, Ordering::Release);
        if !spin {
            leader.unpark();
            continue;
        }
        let due_ns = shared.deadline_ns.load(Ordering::Relaxed) + period_ns;
        sleep_until_ns(due_ns.saturating_sub(margin_ns));
        while shared.tick.0.load(Ordering::Acquire) == seen && monotonic_ns() < due_ns + 2 * period_ns {
            spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without rights, so that it may run beside anything.
    const CONFIG: &str = "[real_time]\npriority = 0\nlock_memory = false\n[[device]]\nbackend = \"ideal\"\n";

    #[test]
    fn what_it_counted_survives_being_printed() {
        let config = DriverConfig::parse(CONFIG, Path::new("-")).unwrap();
        let outcome = run(&config, 0.1);
        // A busy machine skips some of the hundred, and each is either served or skipped; the skip that
        // spans the end of the warm-up, or of the run, may count ticks outside.
        assert!(outcome.ticks + outcome.overruns >= 100, "{outcome:?}");
        assert_eq!(outcome.ticks, outcome.wake_error.count());
        assert_eq!(outcome.ticks, outcome.missed + outcome.round_trip.count());
        let read = Outcome::parse(&outcome.to_json().to_string()).unwrap();
        assert_eq!(
            (read.ticks, read.missed, read.overruns),
            (outcome.ticks, outcome.missed, outcome.overruns)
        );
        assert_eq!(read.wake_error.counts(), outcome.wake_error.counts());
        assert_eq!(read.round_trip.summary(), outcome.round_trip.summary());
    }
}
