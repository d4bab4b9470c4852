//! Wakes a loop on an absolute time grid, by sleeping first and spinning last.
//!
//! Problem: a plain sleep ends tens of microseconds late, a plain spin takes the whole CPU and is
//! throttled by the kernel.
//! Model: sleep until `spin_margin` before the deadline, then spin to it. What the deadlines are is
//! [`Schedule`]'s business. The phase moves the deadlines off the kernel's own timer tick, which
//! fires on whole milliseconds; a loop may be let to find a quiet phase by itself.
//! Invariants: a completed wait is never early and less than one period late, save in a loop that catches
//! up: what it missed before that is in `skipped`. The tick number stays tied to absolute time, but for the 0.382 of a
//! period by which a loop that steps aside lags behind with each step. A signal ends the sleep.
//! Cost: one system call a tick, none when the deadline is within the margin; no allocation.

use crate::clock::{monotonic_ns, sleep_until_ns};
use crate::phase_keeper::{self, DISTURBED_NS, PhaseKeeper};
use crate::schedule::Schedule;
use crate::spin_margin::SpinMargin;
use std::hint::spin_loop;

/// How a loop wakes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeriodicConfig {
    /// Time between two deadlines.
    pub period_ns: u64,
    /// Where in the period the deadlines lie: they are at `n * period_ns + phase_offset_ns`.
    pub phase_offset_ns: u64,
    /// How long before the deadline sleeping ends and spinning begins; 0 is a plain sleep, a period
    /// or more a plain spin (which no signal interrupts: the caller looks at its flag each tick).
    pub spin_margin_ns: u64,
}

impl PeriodicConfig {
    /// Above the usual lateness of a sleep (50 us on a virtual machine), and at 1 kHz a sixth of
    /// the CPU's time.
    pub const SPIN_MARGIN_NS: u64 = 150_000;
    /// Any offset away from whole milliseconds, where the kernel's tick runs, serves.
    pub const PHASE_OFFSET_NS: u64 = 370_000;

    /// Sleep, then spin, with margin and phase that suit a 1 kHz loop; the margin is at most half of
    /// the period, so that the CPU is never taken altogether.
    #[must_use]
    pub fn hybrid(period_ns: u64) -> Self {
        let spin_margin_ns = Self::SPIN_MARGIN_NS.min(period_ns / 2);
        Self { period_ns, phase_offset_ns: Self::PHASE_OFFSET_NS, spin_margin_ns }
    }
}

/// The waiting half of a periodic loop.
#[derive(Clone, Debug)]
pub struct Periodic {
    schedule: Schedule,
    margin: SpinMargin,
    /// None: the phase stays what it is.
    phase: Option<PhaseKeeper>,
    period_ns: u64,
    started: bool,
}

/// How a wait ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wake {
    /// Number of this tick, from 1; grows by `1 + skipped`. After an interrupted wait: of the last
    /// completed one.
    pub tick: u64,
    /// The deadline waited for, on the grid.
    pub deadline_ns: u64,
    /// When the wait ended.
    pub woke_ns: u64,
    /// Deadlines before this one that passed unserved.
    pub skipped: u64,
    /// A signal came before the deadline. The tick is not over: the next wait goes on with it.
    pub interrupted: bool,
}

impl Wake {
    /// How long after the deadline the wait ended; below one period unless the loop catches up, 0 after an
    /// interrupted wait.
    #[must_use]
    pub fn latency_ns(&self) -> u64 {
        self.woke_ns.saturating_sub(self.deadline_ns)
    }
}

impl Periodic {
    /// A loop that begins with its first [`wait`](Self::wait), or with [`start`](Self::start).
    ///
    /// # Panics
    /// If the period is zero.
    #[must_use]
    pub fn new(config: PeriodicConfig) -> Self {
        let schedule = Schedule::new(config.period_ns, config.phase_offset_ns);
        let margin = SpinMargin::fixed(config.spin_margin_ns);
        Self { schedule, margin, phase: None, period_ns: config.period_ns, started: false }
    }

    /// The same, but its deadlines step aside from what happens at the same phase; see
    /// [`phase_keeper`]. A tick in which they do is longer by 0.382 of a period.
    #[must_use]
    pub fn stepping_aside(self) -> Self {
        Self { phase: Some(PhaseKeeper::default()), ..self }
    }

    /// The same, but the spin margin grows where sleeps end too late for it, up to `at_most_ns`.
    #[must_use]
    pub fn learning(self, at_most_ns: u64) -> Self {
        Self { margin: SpinMargin::growing(self.margin.ns(), at_most_ns), ..self }
    }

    /// How long before a deadline sleeping ends now (ns).
    #[must_use]
    pub fn spin_margin_ns(&self) -> u64 {
        self.margin.ns()
    }

    /// The same, but of deadlines that have passed at most the last `ticks` are served all the same, at once
    /// and one after another; their lateness then is a period or more.
    #[must_use]
    pub fn catching_up(self, ticks: u64) -> Self {
        Self { schedule: self.schedule.catching_up(ticks), ..self }
    }

    /// Begins (again) with tick 1 at the first grid point after `now` on the monotonic clock.
    pub fn start(&mut self, now: u64) {
        self.schedule.start(now);
        self.started = true;
    }

    /// The deadline that the next wait is for.
    #[must_use]
    pub fn next_deadline_ns(&self) -> u64 {
        self.schedule.next_deadline_ns()
    }

    /// Waits for the next deadline.
    pub fn wait(&mut self) -> Wake {
        let mut now = monotonic_ns();
        if !self.started {
            self.start(now);
        }
        let deadline_ns = self.schedule.next_deadline_ns();
        let sleep_until = deadline_ns.saturating_sub(self.margin.ns());
        if now < sleep_until {
            let slept = sleep_until_ns(sleep_until);
            now = monotonic_ns();
            if !slept && now < deadline_ns {
                return self.interrupted(now);
            }
            self.margin.learn(now > deadline_ns);
        }
        let spins = now < deadline_ns;
        while now < deadline_ns {
            spin_loop();
            now = monotonic_ns();
        }
        let wake = self.completed(now);
        if spins {
            self.mind_phase(now - deadline_ns);
        }
        wake
    }

    /// After a spin that ended so late: the next deadline may have to move.
    fn mind_phase(&mut self, late_ns: u64) {
        let moves = self.phase.as_mut().is_some_and(|keeper| keeper.learn(late_ns > DISTURBED_NS));
        if moves {
            self.schedule.shift(phase_keeper::step_ns(self.period_ns));
        }
    }

    /// Skips by the time of waking, not of going to sleep: a stall inside the sleep is the commonest.
    fn completed(&mut self, now: u64) -> Wake {
        let due = self.schedule.advance(now);
        let (tick, deadline_ns, skipped) = (due.tick, due.deadline_ns, due.skipped);
        Wake { tick, deadline_ns, woke_ns: now, skipped, interrupted: false }
    }

    fn interrupted(&self, now: u64) -> Wake {
        let (tick, deadline_ns) = (self.schedule.tick(), self.schedule.next_deadline_ns());
        Wake { tick, deadline_ns, woke_ns: now, skipped: 0, interrupted: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sys::pthread::{pthread_kill, pthread_self};
    use nix::sys::signal::Signal;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;
    use std::time::Duration;

    const MS: u64 = 1_000_000;

    fn check_waits(config: PeriodicConfig) {
        let mut periodic = Periodic::new(config);
        let mut last = periodic.wait();
        for _ in 0..50 {
            let wake = periodic.wait();
            assert!(!wake.interrupted);
            assert_eq!(wake.tick, last.tick + 1 + wake.skipped);
            assert_eq!(wake.deadline_ns, last.deadline_ns + (1 + wake.skipped) * config.period_ns);
            assert!(wake.woke_ns >= wake.deadline_ns, "early");
            assert!(wake.latency_ns() < config.period_ns, "late by a period without a skip");
            last = wake;
        }
        assert_eq!(last.deadline_ns % config.period_ns, config.phase_offset_ns);
    }

    #[test]
    fn sleeping_spinning_and_both_wake_on_the_grid_and_never_early() {
        for spin_margin_ns in [0, 150_000, MS] {
            check_waits(PeriodicConfig { period_ns: MS, phase_offset_ns: 370_000, spin_margin_ns });
        }
    }

    #[test]
    fn a_stalled_loop_skips_what_it_missed() {
        let mut periodic = Periodic::new(PeriodicConfig::hybrid(MS));
        let before = periodic.wait();
        sleep_until_ns(before.deadline_ns + 10 * MS);
        let after = periodic.wait();
        // Ten periods after tick k, k + 1 to k + 9 are gone; a busy machine loses more.
        assert!(after.skipped >= 9, "{after:?}");
        assert_eq!(after.tick, before.tick + 1 + after.skipped);
        assert!(after.latency_ns() < MS);
    }

    #[test]
    fn the_margin_never_takes_more_than_half_of_the_period() {
        assert_eq!(PeriodicConfig::hybrid(MS).spin_margin_ns, 150_000);
        assert_eq!(PeriodicConfig::hybrid(100_000).spin_margin_ns, 50_000);
    }

    /// The deadline is 20 s ahead, for the phase is now: no delay of a busy machine comes near.
    #[test]
    fn a_signal_ends_the_sleep_and_the_tick_goes_on() {
        let handled = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(libc::SIGUSR1, handled.clone()).unwrap();
        let (send_thread, thread) = mpsc::channel();
        let sleeper = std::thread::spawn(move || {
            let far =
                PeriodicConfig { phase_offset_ns: monotonic_ns(), ..PeriodicConfig::hybrid(20_000 * MS) };
            let mut periodic = Periodic::new(far);
            send_thread.send(pthread_self()).unwrap();
            let (first, deadline) = (periodic.wait(), periodic.next_deadline_ns());
            (first, deadline)
        });
        let thread = thread.recv().unwrap();
        // Signals until one of them meets the sleep: the first may come before it.
        while !sleeper.is_finished() {
            pthread_kill(thread, Signal::SIGUSR1).unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
        let (wake, next_deadline_ns) = sleeper.join().unwrap();
        assert!(wake.interrupted && handled.load(Ordering::SeqCst));
        assert_eq!((wake.tick, wake.skipped, wake.latency_ns()), (0, 0, 0));
        assert_eq!(wake.deadline_ns, next_deadline_ns, "the same deadline is still to come");
    }
}
