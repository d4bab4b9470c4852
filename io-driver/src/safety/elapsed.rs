//! Time from one tick to the next, as the guards count it.
//!
//! Problem: ticks are not time. Deadlines are skipped, a loop that catches up does several at once, one that steps
//! aside from an interrupt has a longer one, and at another rate the same number of ticks is another time. What ends
//! a force has to count all the time that has passed; what lets it grow must not make up for any of it, or the hand
//! would feel the sum of what was left out as one blow.
//! Model: two times of one tick. `passed` is what the clock says, but a period at least; commands age and forces ramp
//! out by it, so that they are gone in time as well as in ticks. `growth` is what the clock says, but a period at most;
//! forces and their share grow by it, and a pose has rested for it.
//! The clock is the schedule's: a tick happens at its deadline, or, if it is late by a period or more, when it really
//! happens. Under a clock that only counts (lockstep, virtual) each tick takes a period.
//! Invariants: `growth <= period <= passed`; over any number of ticks the sum of `passed` is no less, and that of `growth`
//! no more than the time that they took.
//! Cost: a few comparisons.

/// Time since the tick before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Elapsed {
    passed_ns: u64,
    growth_ns: u64,
}

impl Elapsed {
    /// So much time by the clock, in a loop of that period (ns).
    pub const fn new(time_ns: u64, period_ns: u64) -> Self {
        if time_ns < period_ns {
            Self { passed_ns: period_ns, growth_ns: time_ns }
        } else {
            Self { passed_ns: time_ns, growth_ns: period_ns }
        }
    }

    /// All of it (ns), a period at least: for what ends a force.
    pub fn passed_ns(self) -> u64 {
        self.passed_ns
    }

    /// As much of it as may let a force grow (ns), a period at most.
    pub fn growth_ns(self) -> u64 {
        self.growth_ns
    }
}

/// Tells the time of each tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickClock {
    period_ns: u64,
    /// Deadlines are times of the monotonic clock; else ticks are counted.
    is_real: bool,
    /// Number and time of the last tick.
    last: Option<(u64, u64)>,
}

impl TickClock {
    /// One that counts ticks.
    pub fn counting(period_ns: u64) -> Self {
        Self { period_ns, is_real: false, last: None }
    }

    /// One whose deadlines are times.
    pub fn real(period_ns: u64) -> Self {
        Self { is_real: true, ..Self::counting(period_ns) }
    }

    /// When the last tick was (ns); from any origin if ticks are counted.
    pub fn time_ns(&self) -> u64 {
        self.last.map_or(0, |(_, time_ns)| time_ns)
    }

    /// A tick of which the deadline is known, at `now_ns` of the monotonic clock; the time since the one before.
    pub fn pass(&mut self, tick: u64, deadline_ns: u64, now_ns: u64) -> Elapsed {
        let time_ns = self.time_of(tick, deadline_ns, now_ns);
        let last = self.last.replace((tick, time_ns));
        let since_ns = last.map_or(self.period_ns, |(_, last_ns)| time_ns - last_ns);
        Elapsed::new(since_ns, self.period_ns)
    }

    /// Never before the last.
    fn time_of(&self, tick: u64, deadline_ns: u64, now_ns: u64) -> u64 {
        let (last_tick, last_ns) = self.last.unwrap_or((tick, 0));
        if !self.is_real {
            let ticks = tick.saturating_sub(last_tick);
            return last_ns.saturating_add(ticks.saturating_mul(self.period_ns));
        }
        let is_late = now_ns.saturating_sub(deadline_ns) >= self.period_ns;
        (if is_late { now_ns } else { deadline_ns }).max(last_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    fn of(elapsed: Elapsed) -> (u64, u64) {
        (elapsed.passed_ns(), elapsed.growth_ns())
    }

    #[test]
    fn the_time_of_a_tick_is_its_deadline_unless_it_is_late_and_where_ticks_are_counted_their_sum() {
        let mut real = TickClock::real(MS);
        assert_eq!(real.time_ns(), 0, "there was none");
        for (tick, deadline_ns, now_ns, time_ns) in
            [(1, 5 * MS, 5 * MS + 7, 5 * MS), (2, 6 * MS, 8 * MS, 8 * MS), (3, 7 * MS, 7 * MS, 8 * MS)]
        {
            real.pass(tick, deadline_ns, now_ns);
            assert_eq!(real.time_ns(), time_ns, "tick {tick}");
        }
        let mut counting = TickClock::counting(MS);
        for (tick, time_ns) in [(7, 0), (8, MS), (11, 4 * MS)] {
            counting.pass(tick, 99, 1);
            assert_eq!(counting.time_ns(), time_ns, "tick {tick}");
        }
    }

    #[test]
    fn a_clock_that_counts_takes_a_period_for_each_tick_whatever_the_time() {
        let mut clock = TickClock::counting(MS);
        assert_eq!(of(clock.pass(7, 99, 1)), (MS, MS));
        assert_eq!(of(clock.pass(8, 5, 1 << 60)), (MS, MS));
        assert_eq!(of(clock.pass(11, 0, 0)), (3 * MS, MS), "two were skipped");
        assert_eq!(of(clock.pass(11, 0, 0)), (MS, 0), "the same tick again");
    }

    #[test]
    fn a_tick_that_is_late_by_less_than_a_period_happens_at_its_deadline() {
        let mut clock = TickClock::real(MS);
        assert_eq!(of(clock.pass(1, 50 * MS, 50 * MS + 999_999)), (MS, MS));
        assert_eq!(of(clock.pass(2, 51 * MS, 51 * MS)), (MS, MS));
        // It steps aside by 0.382 of a period.
        assert_eq!(of(clock.pass(3, 52 * MS + 382_000, 53 * MS)), (1_382_000, MS));
    }

    #[test]
    fn skipped_deadlines_have_passed_and_let_nothing_grow() {
        let mut clock = TickClock::real(MS);
        clock.pass(1, 50 * MS, 50 * MS);
        assert_eq!(of(clock.pass(31, 80 * MS, 80 * MS + 7)), (30 * MS, MS));
    }

    /// A stall of 5.3 ms, and five ticks that are made up for within a tenth of one.
    #[test]
    fn ticks_that_are_made_up_for_are_as_short_as_they_really_are() {
        let mut clock = TickClock::real(MS);
        clock.pass(1, 50 * MS, 50 * MS);
        let woke = 55_300_000;
        let elapsed: Vec<_> =
            (0..5).map(|k| of(clock.pass(2 + k, (51 + k) * MS, woke + 20_000 * k))).collect();
        let short = (MS, 20_000);
        assert_eq!(elapsed, [(5_300_000, MS), short, short, short, (MS, 0)], "the last one is in time again");
        // What the made-up ticks took of it lets nothing grow twice.
        assert_eq!(of(clock.pass(7, 56 * MS, 56 * MS)), (MS, 640_000));
    }

    #[test]
    fn a_stall_between_deadline_and_writing_has_passed_when_it_is_written() {
        let mut clock = TickClock::real(MS);
        clock.pass(1, 50 * MS, 50 * MS);
        assert_eq!(of(clock.pass(2, 51 * MS, 72 * MS)), (22 * MS, MS));
        assert_eq!(of(clock.pass(23, 72 * MS, 72 * MS + 10)), (MS, 0));
    }

    proptest! {
        /// Any stalls, with and without catching up.
        #[test]
        fn all_time_ends_forces_and_none_of_it_lets_one_grow_twice(
            stalls in proptest::collection::vec((0u64..20_000_000, 0u64..8), 1..60),
        ) {
            let mut clock = TickClock::real(MS);
            let mut schedule = rt_core::schedule::Schedule::new(MS, 0);
            let (mut now, mut passed, mut growth, mut first) = (0, 0, 0, None);
            for (stall_ns, catch_up) in stalls {
                schedule = schedule.catching_up(catch_up);
                now = schedule.next_deadline_ns().max(now + stall_ns);
                let due = schedule.advance(now);
                let elapsed = clock.pass(due.tick, due.deadline_ns, now);
                prop_assert!(elapsed.growth_ns() <= MS && MS <= elapsed.passed_ns());
                passed += elapsed.passed_ns();
                growth += elapsed.growth_ns();
                // The first took a period. Both ends are right to within the period by which a tick may be late.
                let since_first = now - *first.get_or_insert(now) + MS;
                prop_assert!(passed + MS >= since_first, "{passed} {since_first}");
                prop_assert!(growth <= since_first + MS, "{growth} {since_first}");
            }
        }
    }
}
