//! The fast thread: waits for the driver's frames and answers each in the same tick.
//!
//! Model: time-triggered. The frame says when it was due, so the thread sleeps until shortly before the
//! next is due and only then spins on the doorbell; where it has no CPU of its own it sleeps on the
//! doorbell itself. With rights it runs under SCHED_FIFO on a CPU that is not the driver's.
//!
//! Invariants: it never spins for longer than two ticks on end, so that a driver that stopped does not
//! leave a CPU burning. Nobody else has to act for the force to go: a signal ends it at once, and the end of the run within
//! [`FastShared::outlasts`], whatever the thread that ends the lease waits for.
//! Cost: between frames one or two system calls; in the step none.

use crate::fast_loop::{FastLoop, Turn};
use crate::plausible::{Implausible, Plausibility, judge_devices};
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use rt_core::histogram::Histogram;
use rt_core::setup::{SetupReport, SetupRequest};
use rt_core::signals::StopSignals;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DriverInfo};
use shm_abi::{CommanderMemory, DriverView};
use std::hint::spin_loop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Below the driver's priority: it must be able to run whatever happens here.
pub const FIFO_PRIORITY: u8 = 70;
/// Above the usual lateness of a sleep.
const SPIN_MARGIN_NS: u64 = 100_000;
/// How long a sleep on the doorbell lasts without a look at requests to stop.
const NAP: Duration = Duration::from_millis(20);
/// A world takes no longer to be made, and is looked for so often.
const WORLD_NS: u64 = 30_000_000_000;
const WORLD_LOOK: Duration = Duration::from_millis(1);
/// A driver that publishes nothing for so long is stopped or gone.
const SILENCE_NS: u64 = 5_000_000_000;
/// A look at the doorbell takes no longer where this process runs at all: some naps, and the stalls of a busy machine.
const LONGEST_LOOK_NS: u64 = 500_000_000;
const STACK_BYTES: usize = 256 * 1024;

/// What the fast thread and the slow one share.
#[derive(Debug, Clone, Default)]
pub struct FastShared {
    /// Somebody asked the fast thread to end.
    pub stop: Arc<AtomicBool>,
    /// Ticks of the run so far.
    pub run_ticks: Arc<AtomicU64>,
    /// The run's last row is out.
    pub is_over: Arc<AtomicBool>,
    /// Whoever watches ends the lease then; until that is done, replies go on, but no longer than this.
    pub outlasts: Duration,
    /// End it, too.
    pub signals: StopSignals,
}

/// Why the fast thread ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FastEnd {
    /// The run is over.
    Finished,
    /// It was asked to.
    Stopped,
    /// The process was asked to, by this signal.
    Signal(i32),
    /// The driver is in its fault state, for this reason.
    Fault(u64),
    /// The driver publishes nothing any more.
    Silent,
    /// The driver tells what cannot be.
    Implausible(Implausible),
}

/// What is left when it has ended.
pub struct FastRemains {
    /// The loop's state.
    pub fast: FastLoop,
    /// The driver's memory.
    pub driver: DriverView,
    /// How long the fast step took.
    pub step_ns: Histogram,
    /// Why it ended.
    pub end: FastEnd,
}

/// How long before the frame is due sleeping turns into spinning: at most half a tick.
pub fn spin_margin_ns(period_ns: u64) -> u64 {
    SPIN_MARGIN_NS.min(period_ns / 2)
}

/// Starts it. Returns what of its set-up was obtained.
///
/// # Errors
/// If the thread cannot be started.
pub fn start(
    fast: FastLoop,
    driver: DriverView,
    commander: CommanderMemory,
    shared: FastShared,
) -> std::io::Result<(SetupReport, JoinHandle<FastRemains>)> {
    let info = driver.info();
    let (send, receive) = mpsc::sync_channel(1);
    let thread = std::thread::Builder::new().name("fast".into()).spawn(move || {
        let (report, _guards) = rt_core::setup::apply(&setup_request(&info));
        let wait = choose_wait_mode(&info, &report);
        let _ = send.send(report);
        FastThread::new(fast, driver, commander, shared, &info, wait).run()
    })?;
    let report =
        receive.recv().map_err(|_| std::io::Error::other("the fast thread panicked in its set-up"))?;
    Ok((report, thread))
}

/// What to say if the driver spins on the only CPU that is left to us: we run only once it has given up, as it
/// does for a second at a time.
pub fn shares_a_spinning_cpu(info: &DriverInfo) -> Option<String> {
    let spins = info.clock_mode == ClockMode::Real && info.wait_mode == WaitMode::Spin;
    let cpu = info.cpu.filter(|_| spins && own_cpu(info).is_none())?;
    Some(format!(
        "the driver spins on CPU {cpu}, the only one open to this program: some replies in each second will be late; \
         remedy: open another CPU to it (taskset, cpuset), or set wait = \"futex\" in the driver's [real_time]"
    ))
}

/// A CPU that is not the driver's, if there is one; an isolated one if there is another.
fn own_cpu(info: &DriverInfo) -> Option<usize> {
    rt_core::cpu::loop_cpus().into_iter().rev().find(|cpu| Some(*cpu) != info.cpu)
}

fn setup_request(info: &DriverInfo) -> SetupRequest {
    if info.clock_mode != ClockMode::Real {
        return SetupRequest::default();
    }
    SetupRequest {
        fifo_priority: Some(FIFO_PRIORITY),
        cpu: own_cpu(info),
        lock_memory: true,
        prefault_stack_bytes: STACK_BYTES,
        prefault_heap_bytes: 0,
        timer_slack_ns: Some(1),
        dma_latency_us: None,
    }
}

/// Spinning is right only where it cannot starve the driver: on another CPU, with real-time rights.
fn choose_wait_mode(info: &DriverInfo, report: &SetupReport) -> WaitMode {
    let obtained =
        ["scheduling", "cpu"].iter().all(|name| report.find(name).is_some_and(|item| item.obtained));
    let apart = info.cpu.is_some() && own_cpu(info).is_some();
    if info.clock_mode == ClockMode::Real && obtained && apart { WaitMode::Spin } else { WaitMode::Futex }
}

struct FastThread {
    fast: FastLoop,
    driver: DriverView,
    commander: CommanderMemory,
    shared: FastShared,
    wait: WaitMode,
    period_ns: u64,
    margin_ns: u64,
    step_ns: Histogram,
    is_real: bool,
    seen: Option<u64>,
    /// When the next frame is due, if that is known.
    due_ns: Option<u64>,
    plausibility: Plausibility,
}

impl FastThread {
    fn new(
        fast: FastLoop,
        driver: DriverView,
        commander: CommanderMemory,
        shared: FastShared,
        info: &DriverInfo,
        wait: WaitMode,
    ) -> Self {
        let period_ns = info.period_ns;
        let margin_ns = spin_margin_ns(period_ns);
        let step_ns = Histogram::new();
        Self {
            fast,
            driver,
            commander,
            shared,
            wait,
            period_ns,
            margin_ns,
            step_ns,
            is_real: info.clock_mode == ClockMode::Real,
            seen: None,
            due_ns: None,
            plausibility: Plausibility::new(period_ns, info.clock_mode),
        }
    }

    fn run(mut self) -> FastRemains {
        let end = loop {
            match self.wait_for_frame() {
                Ok(tick) => {
                    if let Some(end) = self.turn(tick) {
                        break end;
                    }
                }
                Err(end) => break end,
            }
        };
        if end == FastEnd::Finished && !self.shared.outlasts.is_zero() {
            self.outlast_lease();
        }
        // Where the clock waits, waiting is part of a turn.
        let step_ns = if self.is_real { self.step_ns } else { self.fast.step_ns.clone() };
        FastRemains { fast: self.fast, driver: self.driver, step_ns, end }
    }

    /// Whoever ends the lease takes some milliseconds to see that the run is over: ticks that the driver would count as
    /// missed replies, and would bridge with the last force. Whoever takes longer waits for something else.
    fn outlast_lease(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        let begun = Instant::now();
        while begun.elapsed() < self.shared.outlasts
            && let Ok(tick) = self.wait_for_frame()
        {
            self.seen = Some(tick);
            if !self.fast.answer_on(tick, &self.driver, &self.commander) {
                return;
            }
            self.due_ns = Some(self.fast.frame().deadline_ns.saturating_add(self.period_ns));
        }
    }

    fn turn(&mut self, tick: u64) -> Option<FastEnd> {
        let begun = monotonic_ns();
        self.seen = Some(tick);
        let is_read = self.fast.read(tick, &self.driver);
        if let Err(lie) = self.judge(tick, is_read, begun) {
            return Some(FastEnd::Implausible(lie));
        }
        if !self.is_real {
            self.wait_for_world();
        }
        let turn = if is_read { self.fast.answer_read(&self.driver, &self.commander) } else { Turn::Unread };
        self.due_ns = Some(self.fast.frame().deadline_ns.saturating_add(self.period_ns));
        match turn {
            Turn::Answered => {
                self.step_ns.record(monotonic_ns() - begun);
                self.shared.run_ticks.store(self.fast.run_ticks(), Ordering::Relaxed);
                None
            }
            Turn::Skipped | Turn::Unread => None,
            Turn::Finished => Some(FastEnd::Finished),
            Turn::Fault(reason) => Some(FastEnd::Fault(reason)),
        }
    }

    /// Wait for a script's world that is due, on a clock that waits; one that cannot be made never comes.
    fn wait_for_world(&self) {
        let begin_ns = monotonic_ns();
        let is_over =
            || self.shared.stop.load(Ordering::Relaxed) || self.shared.signals.requested().is_some();
        while self.fast.wants_world() && !is_over() && monotonic_ns() - begin_ns < WORLD_NS {
            std::thread::sleep(WORLD_LOOK);
        }
    }

    /// Before anything is done with what was read.
    fn judge(&mut self, tick: u64, is_read: bool, now_ns: u64) -> Result<(), Implausible> {
        self.plausibility.judge_tick(tick, now_ns)?;
        let frame = self.fast.frame();
        match is_read {
            true => {
                let is_for_us = frame.lease == self.commander.lease();
                let used = if is_for_us { self.fast.devices() } else { 0 };
                self.plausibility.judge_frame(tick, frame, is_for_us, now_ns)?;
                judge_devices(frame, used)
            }
            false => self.plausibility.note_answer(false, now_ns),
        }
    }

    fn wait_for_frame(&mut self) -> Result<u64, FastEnd> {
        // Time in which this process did not run says nothing of the driver.
        let (mut silent_ns, mut looked_ns) = (0, monotonic_ns());
        if self.wait == WaitMode::Spin {
            self.spin_for_frame();
        }
        loop {
            // First of all: while frames come in time, there is always one to go on with.
            if self.shared.stop.load(Ordering::Relaxed) {
                return Err(FastEnd::Stopped);
            }
            if let Some(signal) = self.shared.signals.requested() {
                return Err(FastEnd::Signal(signal));
            }
            match self.driver.latest_tick() {
                latest if latest == self.seen => {}
                Some(tick) => return Ok(tick),
                None => {}
            }
            let now_ns = monotonic_ns();
            silent_ns += (now_ns - looked_ns).min(LONGEST_LOOK_NS);
            looked_ns = now_ns;
            if silent_ns > SILENCE_NS {
                return Err(FastEnd::Silent);
            }
            self.driver.sleep_for_frame(self.seen, &self.commander, NAP);
        }
    }

    /// Returns with the next frame, or when it is long overdue.
    fn spin_for_frame(&self) {
        let Some(due_ns) = self.due_ns else { return };
        let now = monotonic_ns();
        // The driver says when; a wrong word of its must not put this thread to sleep for ever.
        let due_ns = due_ns.min(now + self.period_ns);
        let until_ns = due_ns + 2 * self.period_ns;
        let sleep_until = due_ns.saturating_sub(self.margin_ns);
        if now < sleep_until {
            sleep_until_ns(sleep_until);
        }
        while self.driver.latest_tick() == self.seen && monotonic_ns() < until_ns {
            spin_loop();
        }
    }
}
