//! The driver's loop in its own process: in real time, or in lockstep with the application.
//!
//! Model: wait for the tick, collect mail, read and tell, wait for the reply within its budget, write. In
//! lockstep the budget is unlimited while somebody commands, and a tick begins as soon as the former is
//! done; with nobody commanding, time goes on at the devices' rate.
//!
//! A loop that spins for replies and gets none for a while sleeps for them instead, for a second: a stopped
//! application leaves no CPU burning, and one that cannot run because of the spinning gets to run.
//!
//! It depends on no other thread: it reads the flag of signals and the word of emergency stops itself, and a thread that
//! serves the socket no more ([`heartbeat`](crate::heartbeat)) is a fault as long as a force might be let through.
//!
//! Invariant: whatever ends the loop (a request, a panic), the motors are written zero before anything else.
//! Cost: in spin mode the timed wait is the only system call, while replies come.

use crate::config::{DriverConfig, OverrunPolicy, ReplyMode, SpinMargin};
use crate::cycle::Cycle;
use crate::heartbeat::{Heartbeat, Watch};
use crate::mail::Inbox;
use crate::meter::{add, record};
use crate::state_log::StateLog;
use crate::zeroing::DeviceSet;
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use rt_core::log::{LogLevel, RtLog};
use rt_core::periodic::{Periodic, PeriodicConfig};
use rt_core::signals::StopSignals;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::ClockMode;
use shm_abi::{CommanderView, FaultReason, MAX_DEVICES};
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// How long a sleeping loop goes without looking at its mail and at requests to stop.
const NAP: Duration = Duration::from_millis(10);
/// At least so long is slept before a reply is looked for again (ns).
const LOOK_NS: u64 = 20_000;

/// Spinning without any reply for so long does no good: many times what a reply takes, and rare even among stalls of a
/// virtual machine.
const PATIENCE_NS: u64 = 5_000_000;
/// How long it sleeps for replies after that before it tries spinning again.
const RETREAT_NS: u64 = 1_000_000_000;

/// What the loop and the rest of the process share.
#[derive(Debug, Clone, Default)]
pub struct Shared {
    /// Somebody asked the loop to end.
    pub stop: Arc<AtomicBool>,
    /// The loop has ended.
    pub ended: Arc<AtomicBool>,
    /// Read by the loop itself, so that no other thread can keep a signal from it.
    pub signals: Option<StopSignals>,
    /// Of the thread that serves the socket; `None`: there is none to be watched.
    pub heartbeat: Option<Heartbeat>,
}

/// How the loop waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Waiting {
    /// For replies.
    pub reply: WaitMode,
    /// How long before a deadline it stops sleeping (ns).
    pub spin_margin_ns: u64,
}

/// How the loop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It was asked to.
    Stopped,
    /// It panicked; the motors are off.
    Panicked,
}

/// The loop and what it needs.
pub struct RealLoop {
    cycle: Cycle,
    inbox: Inbox,
    log: RtLog,
    shared: Shared,
    /// The current tick, for the epitaph.
    tick: &'static AtomicU64,
    clock: ClockMode,
    wait_mode: WaitMode,
    mode: ReplyMode,
    budget_ns: u64,
    period_ns: u64,
    overrun: OverrunPolicy,
    /// When the current tick was due.
    deadline_ns: u64,
    /// Ticks on end that a commander which had begun left unanswered, and how many of them are enough.
    unanswered_ticks: u64,
    patience_ticks: u64,
    /// Until then replies are slept for, whatever the wait mode.
    retreat_until_ns: u64,
    periodic: Periodic,
    lockstep_tick: u64,
    watch: Option<Watch>,
    state_log: StateLog,
    logged_not_zeroed: DeviceSet,
    logged_phase_steps: u64,
}

/// The beginning of a tick.
struct Begin {
    tick: u64,
    deadline_ns: u64,
    /// When a reply is too late; for a tick that is made up for, at once.
    reply_until_ns: u64,
}

impl RealLoop {
    /// A loop that has not begun.
    pub fn new(
        config: &DriverConfig,
        waiting: Waiting,
        cycle: Cycle,
        inbox: Inbox,
        log: RtLog,
        shared: Shared,
        tick: &'static AtomicU64,
    ) -> Self {
        let periodic = Periodic::new(PeriodicConfig {
            period_ns: config.period_ns,
            phase_offset_ns: config.real_time.phase_offset_ns,
            spin_margin_ns: waiting.spin_margin_ns,
        });
        let periodic = match config.real_time.spin_margin {
            SpinMargin::Calibrated { at_most_ns } => periodic.learning(at_most_ns),
            SpinMargin::Fixed(_) => periodic,
        };
        let steps_aside = config.real_time.phase_steps_aside && config.clock == ClockMode::Real;
        let periodic = if steps_aside { periodic.stepping_aside() } else { periodic };
        let periodic = match config.real_time.overrun {
            OverrunPolicy::CatchUp(ticks) => periodic.catching_up(ticks),
            OverrunPolicy::Skip | OverrunPolicy::Fault(_) => periodic,
        };
        let limit_ns = config.process.service_silence_ns;
        let watch =
            shared.heartbeat.clone().map(|heartbeat| Watch::new(heartbeat, limit_ns, config.period_ns));
        let cycle = if config.clock == ClockMode::Real { cycle.in_real_time() } else { cycle };
        Self {
            watch,
            cycle,
            inbox,
            log,
            shared,
            tick,
            clock: config.clock,
            wait_mode: waiting.reply,
            mode: config.reply.mode,
            budget_ns: config.reply.budget_ns,
            period_ns: config.period_ns,
            overrun: config.real_time.overrun,
            deadline_ns: 0,
            unanswered_ticks: 0,
            patience_ticks: PATIENCE_NS.div_ceil(config.period_ns),
            retreat_until_ns: 0,
            periodic,
            lockstep_tick: 0,
            state_log: StateLog::new(config.period_ns),
            logged_not_zeroed: DeviceSet(0),
            logged_phase_steps: 0,
        }
    }

    /// Runs until somebody asks it to end.
    pub fn run(mut self) -> Ended {
        let ended = match catch_unwind(AssertUnwindSafe(|| self.ticks())) {
            Ok(()) => {
                self.cycle.release();
                Ended::Stopped
            }
            Err(_) => {
                self.cycle.fault(FaultReason::Panic);
                Ended::Panicked
            }
        };
        self.shared.ended.store(true, Ordering::Release);
        ended
    }

    fn ticks(&mut self) {
        while let Some(begin) = self.wait_for_tick() {
            self.collect_mail(begin.tick);
            if self.takes_former_reply() {
                // Before the new tick is told: its own reply, however quick, drives the next one's motors, so
                // that the delay is one tick always.
                self.cycle.take_reply();
            }
            self.cycle.sense(begin.tick, begin.deadline_ns);
            self.wait_for_reply(begin.reply_until_ns);
            self.cycle.actuate();
            if self.takes_former_reply() && self.clock == ClockMode::Lockstep {
                self.wait_until_answered(begin.tick);
            }
            self.log_state(begin.tick);
            self.log_zeros(begin.tick);
        }
    }

    /// `None`: somebody asked the loop to end.
    fn wait_for_tick(&mut self) -> Option<Begin> {
        let begin = match self.clock {
            ClockMode::Lockstep => self.wait_in_lockstep(),
            ClockMode::Real | ClockMode::Virtual => self.wait_in_real_time()?,
        };
        self.tick.store(begin.tick, Ordering::Relaxed);
        (!self.is_stopping()).then_some(begin)
    }

    fn wait_in_real_time(&mut self) -> Option<Begin> {
        let mut wake = self.periodic.wait();
        while wake.interrupted {
            if self.is_stopping() {
                return None;
            }
            wake = self.periodic.wait();
        }
        let memory = self.cycle.memory();
        record(&memory.wake_error_ns, wake.latency_ns());
        add(&memory.counters.overruns, wake.skipped);
        if matches!(self.overrun, OverrunPolicy::Fault(most) if wake.skipped > most) {
            self.cycle.fault(FaultReason::Overrun);
        }
        self.deadline_ns = wake.deadline_ns;
        self.log_phase(wake.tick);
        let is_made_up_for = wake.into_period_ns() >= self.period_ns;
        let reply_until_ns = wake.deadline_ns + if is_made_up_for { 0 } else { self.budget_ns };
        Some(Begin { tick: wake.tick, deadline_ns: wake.deadline_ns, reply_until_ns })
    }

    fn wait_in_lockstep(&mut self) -> Begin {
        self.lockstep_tick += 1;
        if self.cycle.lease().is_none() {
            // Nobody commands: go on at the devices' rate instead of racing.
            self.periodic.wait();
        }
        Begin { tick: self.lockstep_tick, deadline_ns: monotonic_ns(), reply_until_ns: u64::MAX }
    }

    fn wait_for_reply(&mut self, until_ns: u64) {
        if self.takes_former_reply() {
            return;
        }
        match self.clock {
            ClockMode::Lockstep => self.wait_without_limit(),
            ClockMode::Real | ClockMode::Virtual => self.wait_within(until_ns),
        }
        if self.mode == ReplyMode::FixedPhase && self.clock == ClockMode::Real {
            self.wait_for_phase(until_ns);
        }
    }

    fn takes_former_reply(&self) -> bool {
        self.mode == ReplyMode::NextTick
    }

    fn wait_within(&mut self, until_ns: u64) {
        // A commander that has yet to begin takes as long as it takes.
        let has_begun = self.cycle.seen_reply().is_some();
        let may_spin = has_begun && until_ns >= self.retreat_until_ns;
        let wait_mode = if may_spin { self.wait_mode } else { WaitMode::Futex };
        let begun_ns = monotonic_ns();
        while !self.cycle.take_reply() {
            let now = monotonic_ns();
            if now >= until_ns {
                return self.note_unanswered(has_begun, now);
            }
            match wait_mode {
                WaitMode::Spin => spin_loop(),
                // Not on the commander's bell: whoever sleeps or wakes there waits for everybody in the same bucket of the
                // kernel's table. The longer it takes the less it matters how exactly its end is met.
                WaitMode::Futex => {
                    let look_ns = LOOK_NS.max(now.saturating_sub(begun_ns) / 4);
                    sleep_until_ns(until_ns.min(now + look_ns));
                }
            }
        }
        self.unanswered_ticks = 0;
    }

    /// A tick that is made up for is over before anybody could answer it, and says nothing.
    fn note_unanswered(&mut self, has_begun: bool, now: u64) {
        let had_time = now.saturating_sub(self.deadline_ns) < self.period_ns;
        self.unanswered_ticks += u64::from(has_begun && had_time);
        if self.unanswered_ticks >= self.patience_ticks {
            self.retreat_until_ns = now + RETREAT_NS;
        }
    }

    /// In lockstep a tick has no other end than the reply, the end of the driver, a fault, or the end of the lease that
    /// its frame tells: the frame after it tells the next one, whose holder waits for it.
    fn wait_without_limit(&mut self) {
        let asked = self.asked();
        while !self.cycle.take_reply() && !self.is_stopping() && self.asked() == asked {
            self.sleep_for_reply(NAP);
            self.collect_mail(self.lockstep_tick);
        }
    }

    /// Whose reply a tick in lockstep waits for, and under which fault.
    fn asked(&self) -> (Option<u64>, FaultReason) {
        (self.cycle.lease().map(CommanderView::lease), self.cycle.safety().fault())
    }

    /// The same where the motors are written already: the next tick's shall have a reply.
    fn wait_until_answered(&mut self, tick: u64) {
        let asked = self.asked();
        while self.cycle.lease().is_some() && !self.is_stopping() && self.asked() == asked {
            self.cycle.take_reply();
            if self.cycle.seen_reply() == Some(tick) {
                return;
            }
            self.sleep_for_reply(NAP);
            self.collect_mail(tick);
        }
    }

    fn sleep_for_reply(&self, timeout: Duration) {
        if let Some(lease) = self.cycle.lease() {
            lease.sleep_for_command(self.cycle.seen_reply(), self.cycle.memory(), timeout);
        }
    }

    /// The motors are written at the same phase whether the reply came early, late or not at all.
    fn wait_for_phase(&self, phase_ns: u64) {
        match self.wait_mode {
            WaitMode::Spin => {
                while monotonic_ns() < phase_ns {
                    spin_loop();
                }
            }
            WaitMode::Futex => {
                sleep_until_ns(phase_ns);
            }
        }
    }

    fn log_phase(&mut self, tick: u64) {
        let steps = self.periodic.phase_steps();
        if self.logged_phase_steps != steps {
            self.logged_phase_steps = steps;
            let sentence = "deadlines step aside from what interrupts this CPU at their phase";
            self.log.push(LogLevel::Info, tick, sentence, &[]);
        }
    }

    fn log_state(&mut self, tick: u64) {
        let safety = self.cycle.safety();
        self.state_log.tell(safety.state(), safety.fault(), tick, &mut self.log);
    }

    fn collect_mail(&mut self, tick: u64) {
        self.inbox.deliver(&mut self.cycle);
        self.watch_service();
        match self.cycle.zero_verdict() {
            None => {}
            Some(Ok(_)) => self.log.push(LogLevel::Info, tick, "zeroed", &[]),
            Some(Err(refusal)) => {
                let (words, number) = refusal.for_log();
                self.log.push(LogLevel::Warning, tick, words, number.as_slice());
            }
        }
    }

    /// Without a force there is nothing that anybody would have to stop.
    fn watch_service(&mut self) {
        let is_silent = self.watch.as_mut().is_some_and(|watch| watch.looks_silent(monotonic_ns()));
        if is_silent && (self.cycle.lease().is_some() || !self.cycle.safety().is_released()) {
            self.cycle.fault(FaultReason::ServiceSilent);
        }
    }

    fn log_zeros(&mut self, tick: u64) {
        let not_zeroed = self.cycle.not_zeroed();
        let new = DeviceSet(not_zeroed.0 & !self.logged_not_zeroed.0);
        self.logged_not_zeroed = not_zeroed;
        for device in (0..MAX_DEVICES).filter(|device| new.has(*device)) {
            let words =
                "device {} does not know where it is: bring it into its zeroing pose, then `io-driver zero`";
            self.log.push(LogLevel::Warning, tick, words, &[device as f64]);
        }
    }

    fn is_stopping(&self) -> bool {
        let Shared { stop, signals, .. } = &self.shared;
        stop.load(Ordering::Relaxed) || signals.as_ref().is_some_and(|signals| signals.requested().is_some())
    }
}
