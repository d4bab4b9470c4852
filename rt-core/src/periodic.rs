//! Wakes a loop on an absolute time grid, by sleeping first and spinning last.
//!
//! Problem: a plain sleep ends tens of microseconds late, a plain spin takes the whole CPU and is
//! throttled by the kernel.
//! Model: sleep until `spin_margin` before the deadline, then spin to it. What the deadlines are is
//! [`Schedule`]'s business. The phase moves the deadlines off the kernel's own timer tick, which
//! fires on whole milliseconds; a loop may be let to find a quiet phase by itself.
//! Invariants: a completed wait is never early, and less than one period after the deadline that it serves, save in
//! a loop that catches up: what it missed before that is in `skipped`. The tick number stays tied to absolute time, but
//! for the 0.382 of a period by which a loop that steps aside lags behind with each step. A signal ends the sleep.
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
    phase_steps: u64,
    period_ns: u64,
    started: bool,
}

/// How a wait ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wake {
    /// Number of this tick, from 1; grows by `1 + skipped`. After an interrupted wait: of the last
    /// completed one.
    pub tick: u64,
    /// The deadline that is served, on the grid.
    pub deadline_ns: u64,
    /// The deadline that the wait was for: the first that nobody had served. Earlier than `deadline_ns` by what was
    /// skipped.
    pub awaited_ns: u64,
    /// When the wait ended.
    pub woke_ns: u64,
    /// Deadlines before this one that passed unserved.
    pub skipped: u64,
    /// A signal came before the deadline. The tick is not over: the next wait goes on with it.
    pub interrupted: bool,
}

impl Wake {
    /// Wake-up latency: how long after the *first* unserved deadline the wait ended; 0 after an interrupted wait.
    ///
    /// One figure a wake, and a stall of a hundred periods is a hundred periods: as cyclictest counts, which also
    /// takes one sample a wake, against the time that it had asked to be woken at, and then steps over what has
    /// passed.
    #[must_use]
    pub fn latency_ns(&self) -> u64 {
        self.woke_ns.saturating_sub(self.awaited_ns)
    }

    /// How long after the deadline that is served the wait ended; below one period unless the loop catches up.
    #[must_use]
    pub fn into_period_ns(&self) -> u64 {
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
        Self { schedule, margin, phase: None, phase_steps: 0, period_ns: config.period_ns, started: false }
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

    /// How often its deadlines have stepped aside so far.
    #[must_use]
    pub fn phase_steps(&self) -> u64 {
        self.phase_steps
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
            self.phase_steps += 1;
        }
    }

    /// Skips by the time of waking, not of going to sleep: a stall inside the sleep is the commonest.
    fn completed(&mut self, now: u64) -> Wake {
        let awaited_ns = self.schedule.next_deadline_ns();
        let due = self.schedule.advance(now);
        let (tick, deadline_ns, skipped) = (due.tick, due.deadline_ns, due.skipped);
        Wake { tick, deadline_ns, awaited_ns, woke_ns: now, skipped, interrupted: false }
    }

    fn interrupted(&self, now: u64) -> Wake {
        let (tick, deadline_ns) = (self.schedule.tick(), self.schedule.next_deadline_ns());
        Wake { tick, deadline_ns, awaited_ns: deadline_ns, woke_ns: now, skipped: 0, interrupted: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sys::pthread::{pthread_kill, pthread_self};
    use nix::sys::signal::Signal;
    use patience::prelude::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

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
            assert!(wake.into_period_ns() < config.period_ns, "late by a period without a skip");
            assert_eq!(wake.latency_ns(), wake.into_period_ns() + wake.skipped * config.period_ns);
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
    fn a_loop_that_learns_and_steps_aside_counts_its_ticks_and_says_when_it_stepped() {
        let mut periodic = Periodic::new(PeriodicConfig::hybrid(MS)).learning(MS / 2).stepping_aside();
        let (mut last, mut steps) = (periodic.wait(), 0);
        for _ in 0..600 {
            // The step is taken after a wait, for the next one.
            let stepped_ns = (periodic.phase_steps() - steps) * phase_keeper::step_ns(MS);
            steps = periodic.phase_steps();
            let wake = periodic.wait();
            assert_eq!(wake.tick, last.tick + 1 + wake.skipped);
            assert_eq!(wake.deadline_ns, last.deadline_ns + (1 + wake.skipped) * MS + stepped_ns);
            assert!(wake.woke_ns >= wake.deadline_ns, "early");
            last = wake;
        }
        assert!((150_000..=MS / 2).contains(&periodic.spin_margin_ns()));
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
        assert_eq!(after.awaited_ns, before.deadline_ns + MS);
        assert!(after.latency_ns() >= 9 * MS, "{after:?}");
    }

    /// A clock that the test reads out: no machine, however busy, changes the figures.
    #[test]
    fn a_stall_of_106_periods_is_106_periods_late_and_one_wake() {
        let mut periodic = Periodic::new(PeriodicConfig::hybrid(MS));
        periodic.start(0);
        let first = periodic.completed(370_020);
        assert_eq!((first.tick, first.skipped, first.latency_ns()), (1, 0, 20));
        // Due at 1.37 ms, served 106.582 ms later: cyclictest's figure under the same load.
        let stalled = periodic.completed(1_370_000 + 106_582_000);
        assert_eq!((stalled.tick, stalled.skipped, stalled.latency_ns()), (108, 106, 106_582_000));
        assert_eq!((stalled.deadline_ns, stalled.into_period_ns()), (107_370_000, 582_000));
        let next = periodic.completed(108_370_000);
        assert_eq!((next.tick, next.skipped, next.latency_ns()), (109, 0, 0), "the stall counts once");
    }

    /// Each deadline made up for is a wake of its own, late by what it is late.
    #[test]
    fn a_loop_that_catches_up_tells_the_lateness_of_each_deadline() {
        let mut periodic = Periodic::new(PeriodicConfig::hybrid(MS)).catching_up(2);
        periodic.start(0);
        periodic.completed(370_000);
        // Due are 1.37 to 9.37 ms; two before the last are made up for.
        let wakes = [0; 3].map(|_| periodic.completed(9_470_000));
        assert_eq!(wakes.map(|wake| wake.skipped), [6, 0, 0]);
        assert_eq!(wakes.map(|wake| wake.latency_ns()), [8_100_000, 1_100_000, 100_000]);
        assert_eq!(wakes.map(|wake| wake.into_period_ns()), [2_100_000, 1_100_000, 100_000]);
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
        let thread = thread.bounded_recv().unwrap();
        // Signals until one of them meets the sleep: the first may come before it.
        patience::until("the end of the sleep", || {
            // Whoever has ended can still be asked.
            pthread_kill(thread, Signal::SIGUSR1).unwrap();
            sleeper.is_finished()
        });
        let (wake, next_deadline_ns) = sleeper.bounded_join().unwrap();
        assert!(wake.interrupted && handled.load(Ordering::SeqCst));
        assert_eq!((wake.tick, wake.skipped, wake.latency_ns()), (0, 0, 0));
        assert_eq!(wake.deadline_ns, next_deadline_ns, "the same deadline is still to come");
    }
}
