//! A bare waiting loop in a process of its own: the hybrid wait, or the plain sleep it is compared with.
//!
//! Model: the loop's thread sets itself up, waits on the grid of deadlines and pushes how late it woke into a
//! bounded queue; this process's main thread writes the queue to standard output, twenty times a second. The
//! first line is a [`Hello`] in JSON, then records of three little-endian words: tick, deadline, lateness.
//! Lateness counts from the *first* deadline that was missed: a stall of ten periods is ten periods late, as
//! cyclictest counts it, and not nine skips and a trifle.
//! Invariants: the loop neither allocates nor writes; a full queue loses samples, which are counted and told in
//! a last record with [`LOST`] for its tick.

use rt_core::calibrate;
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use rt_core::periodic::{Periodic, PeriodicConfig};
use rt_core::setup::{SetupReport, SetupRequest};
use rtrb::{Consumer, Producer, RingBuffer};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::Duration;

/// The loop's thread, for whoever looks for it in /proc.
pub const THREAD: &str = "jitter-loop";
/// Instead of a tick: the lateness is the number of samples lost.
pub const LOST: u64 = u64::MAX;
/// Bytes of a record.
pub const RECORD: usize = 24;
/// Four seconds at 16 kHz; 1.5 MiB.
const QUEUE: usize = 1 << 16;
const PAUSE: Duration = Duration::from_millis(50);
const STACK_BYTES: usize = 128 * 1024;

/// How to wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wait {
    /// `rt_core::periodic`: sleep, then spin.
    Hybrid,
    /// clock_nanosleep(2) to the absolute deadline.
    Sleep,
}

/// How long before a deadline the hybrid wait stops sleeping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Margin {
    /// So long (ns).
    Fixed(u64),
    /// As the driver measures and learns it, at most so long (ns).
    Calibrated(u64),
}

/// What the loop is to do; its one argument, in JSON.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Order {
    /// How to wait.
    pub wait: Wait,
    /// Time between deadlines.
    pub period_ns: u64,
    /// Of the deadlines against whole periods of the clock.
    pub phase_offset_ns: u64,
    /// Whether the hybrid wait may change that phase.
    pub phase_steps_aside: bool,
    /// Of the hybrid wait.
    pub spin_margin: Margin,
    /// SCHED_FIFO priority.
    pub priority: Option<u8>,
    /// CPU.
    pub cpu: Option<usize>,
    /// Whether to lock memory.
    pub lock_memory: bool,
    /// Ticks that are not told, at the beginning.
    pub warm_up_ticks: u64,
    /// Ticks after those.
    pub ticks: u64,
}

/// The first line.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Hello {
    /// Thread id of the loop.
    pub tid: u32,
    /// What was asked of the operating system and obtained, a line each.
    pub guarantees: Vec<String>,
    /// Everything that was asked for was obtained, whatever the circumstances.
    pub obtained: bool,
}

/// One tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Woke {
    /// Number of the tick.
    pub tick: u64,
    /// The first deadline that this waking serves or missed.
    pub deadline_ns: u64,
    /// How long after it.
    pub late_ns: u64,
}

impl Woke {
    /// As it goes through the pipe.
    pub fn to_bytes(self) -> [u8; RECORD] {
        let mut bytes = [0; RECORD];
        for (chunk, word) in bytes.chunks_mut(8).zip([self.tick, self.deadline_ns, self.late_ns]) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// As it comes out.
    pub fn from_bytes(bytes: &[u8; RECORD]) -> Self {
        let word = |index: usize| {
            let mut word = [0; 8];
            word.copy_from_slice(&bytes[8 * index..8 * index + 8]);
            u64::from_le_bytes(word)
        };
        Self { tick: word(0), deadline_ns: word(1), late_ns: word(2) }
    }
}

/// The role's program.
pub fn main() -> ExitCode {
    let order = std::env::args().nth(1).and_then(|text| serde_json::from_str::<Order>(&text).ok());
    let Some(order) = order else {
        eprintln!("jitter: a waiting loop needs an order in JSON");
        return ExitCode::from(2);
    };
    match serve(&order) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("jitter: the waiting loop cannot go on: {error}");
            ExitCode::from(3)
        }
    }
}

#[derive(Default)]
struct Shared {
    lost: AtomicU64,
    over: AtomicBool,
}

fn serve(order: &Order) -> std::io::Result<()> {
    let (producer, mut consumer) = RingBuffer::new(QUEUE);
    let shared = Shared::default();
    let (send, receive) = mpsc::sync_channel(1);
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name(THREAD.into())
            .spawn_scoped(scope, || run(order, producer, &send, &shared))?;
        let hello: Hello = receive.recv().map_err(std::io::Error::other)?;
        let mut out = std::io::stdout().lock();
        writeln!(out, "{}", serde_json::to_string(&hello)?)?;
        while !shared.over.load(Ordering::Acquire) {
            std::thread::sleep(PAUSE);
            write_all(&mut consumer, &mut out)?;
        }
        write_all(&mut consumer, &mut out)?;
        let lost = shared.lost.load(Ordering::Relaxed);
        out.write_all(&Woke { tick: LOST, deadline_ns: 0, late_ns: lost }.to_bytes())?;
        out.flush()
    })
}

fn write_all(consumer: &mut Consumer<Woke>, out: &mut impl Write) -> std::io::Result<()> {
    let mut bytes = Vec::with_capacity(consumer.slots() * RECORD);
    while let Ok(woke) = consumer.pop() {
        bytes.extend(woke.to_bytes());
    }
    out.write_all(&bytes)?;
    out.flush()
}

fn run(order: &Order, mut queue: Producer<Woke>, tell: &mpsc::SyncSender<Hello>, shared: &Shared) {
    let (report, _guards) = rt_core::setup::apply(&request(order));
    let _ = tell.send(hello(&report));
    let mut waiter = Waiter::new(order);
    let mut done = 0;
    while done < order.warm_up_ticks + order.ticks {
        let Some((woke, skipped)) = waiter.wait() else { continue };
        done += 1 + skipped;
        if done > order.warm_up_ticks && queue.push(woke).is_err() {
            shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
    shared.over.store(true, Ordering::Release);
}

fn request(order: &Order) -> SetupRequest {
    SetupRequest {
        fifo_priority: order.priority,
        cpu: order.cpu,
        lock_memory: order.lock_memory,
        prefault_stack_bytes: STACK_BYTES,
        prefault_heap_bytes: 0,
        timer_slack_ns: Some(1),
        dma_latency_us: Some(0),
    }
}

fn hello(report: &SetupReport) -> Hello {
    Hello {
        tid: rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs(),
        guarantees: report.to_string().lines().map(|line| line.trim().to_owned()).collect(),
        obtained: report.all_requests_obtained(),
    }
}

enum Waiter {
    Hybrid(Periodic),
    Sleep { deadline_ns: u64, period_ns: u64, tick: u64 },
}

impl Waiter {
    fn new(order: &Order) -> Self {
        let (period_ns, phase_ns) = (order.period_ns, order.phase_offset_ns);
        match order.wait {
            Wait::Hybrid => Self::Hybrid(hybrid(order)),
            Wait::Sleep => {
                let deadline_ns = (monotonic_ns() / period_ns + 2) * period_ns + phase_ns % period_ns;
                Self::Sleep { deadline_ns, period_ns, tick: 0 }
            }
        }
    }

    /// The waking and the deadlines that were skipped; `None` if a signal came.
    fn wait(&mut self) -> Option<(Woke, u64)> {
        match self {
            Self::Hybrid(periodic) => {
                let wake = periodic.wait();
                let woke = Woke { tick: wake.tick, deadline_ns: wake.awaited_ns, late_ns: wake.latency_ns() };
                (!wake.interrupted).then_some((woke, wake.skipped))
            }
            // Written anew and not with `Periodic`, whose mistakes it must not share.
            Self::Sleep { deadline_ns, period_ns, tick } => {
                if !sleep_until_ns(*deadline_ns) {
                    return None;
                }
                let late_ns = monotonic_ns().saturating_sub(*deadline_ns);
                let skipped = late_ns / *period_ns;
                *tick += 1 + skipped;
                let woke = Woke { tick: *tick, deadline_ns: *deadline_ns, late_ns };
                *deadline_ns += (1 + skipped) * *period_ns;
                Some((woke, skipped))
            }
        }
    }
}

/// As the driver waits.
fn hybrid(order: &Order) -> Periodic {
    let (period_ns, phase_offset_ns) = (order.period_ns, order.phase_offset_ns);
    let with_margin =
        |spin_margin_ns| Periodic::new(PeriodicConfig { period_ns, phase_offset_ns, spin_margin_ns });
    let periodic = match order.spin_margin {
        Margin::Fixed(ns) => with_margin(ns),
        Margin::Calibrated(at_most_ns) => {
            let lateness = calibrate::sleep_lateness(calibrate::SLEEPS);
            with_margin(calibrate::spin_margin_ns(&lateness, at_most_ns)).learning(at_most_ns)
        }
    };
    if order.phase_steps_aside { periodic.stepping_aside() } else { periodic }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;

    fn order(wait: Wait) -> Order {
        Order {
            wait,
            period_ns: 1_000_000,
            phase_offset_ns: 370_000,
            phase_steps_aside: false,
            spin_margin: Margin::Fixed(150_000),
            priority: None,
            cpu: None,
            lock_memory: false,
            warm_up_ticks: 5,
            ticks: 50,
        }
    }

    #[test]
    fn a_record_survives_the_pipe() {
        let woke = Woke { tick: 1, deadline_ns: u64::MAX - 7, late_ns: 1 << 40 };
        assert_eq!(Woke::from_bytes(&woke.to_bytes()), woke);
    }

    #[test]
    fn both_styles_wake_on_the_grid_and_a_stall_counts_from_the_first_missed_deadline() {
        for wait in [Wait::Hybrid, Wait::Sleep] {
            let mut waiter = Waiter::new(&order(wait));
            let (first, missed) = waiter.wait().unwrap();
            assert_eq!(first.deadline_ns % 1_000_000, 370_000);
            // A busy machine may have kept us from the first one already.
            let served_ns = first.deadline_ns + missed * 1_000_000;
            sleep_until_ns(served_ns + 10_300_000);
            let (late, skipped) = waiter.wait().unwrap();
            assert_eq!(late.deadline_ns, served_ns + 1_000_000, "{wait:?}");
            // The stall ends 9.3 periods after that deadline; a busy machine ends it later.
            assert!(skipped >= 9 && late.late_ns >= 9_300_000, "{late:?}");
            assert_eq!(late.tick, first.tick + 1 + skipped);
        }
    }

    #[test]
    fn ticks_and_skips_add_up_to_the_order() {
        let (producer, mut consumer) = RingBuffer::new(QUEUE);
        let (send, receive) = mpsc::sync_channel(1);
        let shared = Shared::default();
        run(&order(Wait::Hybrid), producer, &send, &shared);
        assert!(receive.bounded_recv().unwrap().tid > 0);
        let woke: Vec<Woke> = std::iter::from_fn(|| consumer.pop().ok()).collect();
        let last = woke.last().unwrap().tick;
        // Tick numbers count what was skipped; a stall across the end overshoots.
        assert!(last >= 55 && woke.len() as u64 <= 50 + last - 55, "{last} {}", woke.len());
        assert!(
            woke.windows(2)
                .all(|pair| pair[0].tick < pair[1].tick && pair[0].deadline_ns < pair[1].deadline_ns)
        );
    }
}
