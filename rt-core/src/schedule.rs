//! Which deadline is next: the arithmetic of a periodic loop, without a clock.
//!
//! Problem: a loop that adds a period to "now" drifts, one that adds it to the last deadline runs a
//! burst of late ticks after a stall, and both lose the tie between tick number and time.
//! Model: deadlines are the points `n * period + phase` of the clock. Tick numbers count them from
//! [`Schedule::start`]: tick 1 is due at the first grid point after it. Points that pass by a full
//! period or more are skipped and counted; a schedule may be told to catch up with the last few of
//! them instead, which then are handed out late.
//! Invariants: every deadline lies on the grid; `deadline = first deadline + (tick - 1) * period`, unless the
//! grid was moved in between;
//! a deadline handed out lies less than a period in the past, and `catch_up` periods more.
//! Cost: one division. Fit for the loop.

/// Absolute deadlines on a fixed grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    period_ns: u64,
    phase_ns: u64,
    next_deadline_ns: u64,
    tick: u64,
    catch_up: u64,
}

/// A deadline that has been reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Number of this deadline, from 1; grows by `1 + skipped` each time.
    pub tick: u64,
    /// The deadline itself, on the grid.
    pub deadline_ns: u64,
    /// Deadlines before this one that were left out.
    pub skipped: u64,
}

impl Schedule {
    /// A grid of points `n * period_ns + phase_offset_ns`, started at time zero.
    ///
    /// # Panics
    /// If the period is zero.
    #[must_use]
    pub fn new(period_ns: u64, phase_offset_ns: u64) -> Self {
        assert!(period_ns > 0, "a periodic loop needs a period above zero");
        let phase_ns = phase_offset_ns % period_ns;
        let mut schedule = Self { period_ns, phase_ns, next_deadline_ns: 0, tick: 0, catch_up: 0 };
        schedule.start(0);
        schedule
    }

    /// The same, but of deadlines that have passed at most the last `ticks` are handed out all the same.
    #[must_use]
    pub fn catching_up(self, ticks: u64) -> Self {
        Self { catch_up: ticks, ..self }
    }

    /// Begins (again) with tick 1 at the first grid point after `now`.
    pub fn start(&mut self, now: u64) {
        self.tick = 0;
        self.next_deadline_ns = match now.checked_sub(self.phase_ns) {
            Some(since_phase) => now - since_phase % self.period_ns + self.period_ns,
            None => self.phase_ns,
        };
    }

    /// Moves the grid, and the next deadline with it, to `by_ns` later. Tick numbers go on.
    pub fn shift(&mut self, by_ns: u64) {
        self.next_deadline_ns += by_ns;
        self.phase_ns = (self.phase_ns + by_ns) % self.period_ns;
    }

    /// The deadline to wait for.
    #[must_use]
    pub fn next_deadline_ns(&self) -> u64 {
        self.next_deadline_ns
    }

    /// Number of the last deadline handed out by [`Schedule::advance`]; 0 before the first.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Hands out the deadline that is due at `now` and moves on to the next.
    ///
    /// Called before the deadline is reached it hands out that deadline all the same: whether to
    /// wait is the caller's business.
    pub fn advance(&mut self, now: u64) -> Due {
        let passed = now.saturating_sub(self.next_deadline_ns) / self.period_ns;
        let skipped = passed.saturating_sub(self.catch_up);
        let deadline_ns = self.next_deadline_ns + skipped * self.period_ns;
        self.next_deadline_ns = deadline_ns + self.period_ns;
        self.tick += 1 + skipped;
        Due { tick: self.tick, deadline_ns, skipped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A second at most; the largest clock value leaves room for every step below.
    const PERIODS: std::ops::Range<u64> = 1..1_000_000_000;
    const TIMES: std::ops::Range<u64> = 0..1 << 60;

    #[test]
    fn a_grid_that_is_moved_makes_one_tick_longer_and_goes_on_from_there() {
        let mut schedule = Schedule::new(10, 3);
        schedule.start(0);
        assert_eq!(schedule.advance(3).deadline_ns, 3);
        schedule.shift(4);
        assert_eq!(schedule.advance(17), Due { tick: 2, deadline_ns: 17, skipped: 0 });
        assert_eq!(schedule.advance(27), Due { tick: 3, deadline_ns: 27, skipped: 0 });
        schedule.start(100);
        assert_eq!(schedule.next_deadline_ns(), 107, "the phase is the new one");
    }

    #[test]
    fn a_schedule_that_catches_up_hands_out_the_last_few_and_skips_the_rest() {
        let mut schedule = Schedule::new(10, 0).catching_up(3);
        schedule.start(0);
        assert_eq!(schedule.advance(10), Due { tick: 1, deadline_ns: 10, skipped: 0 });
        // At 75 the deadlines 20 to 70 are due: six, of which the last is not late by a period.
        assert_eq!(schedule.advance(75), Due { tick: 4, deadline_ns: 40, skipped: 2 });
        for tick in 5..=7 {
            assert_eq!(schedule.advance(76), Due { tick, deadline_ns: 10 * tick, skipped: 0 });
        }
        assert_eq!(schedule.next_deadline_ns(), 80, "and it is on time again");
    }

    #[test]
    fn the_first_deadline_is_the_next_grid_point_strictly_ahead() {
        let mut schedule = Schedule::new(1_000, 370);
        let mut first_after = |now| {
            schedule.start(now);
            schedule.next_deadline_ns()
        };
        assert_eq!(first_after(0), 370);
        assert_eq!(first_after(369), 370);
        assert_eq!(first_after(370), 1_370);
        assert_eq!(first_after(5_000), 5_370);
    }

    #[test]
    fn a_phase_beyond_the_period_means_the_same_grid() {
        assert_eq!(Schedule::new(1_000, 2_370), Schedule::new(1_000, 370));
    }

    #[test]
    fn a_loop_in_time_skips_nothing() {
        let mut schedule = Schedule::new(1_000, 0);
        for tick in 1..100 {
            let due = schedule.advance(schedule.next_deadline_ns());
            assert_eq!(due, Due { tick, deadline_ns: tick * 1_000, skipped: 0 });
        }
    }

    #[test]
    fn lateness_below_a_period_is_late_and_a_full_period_is_a_skip() {
        let mut schedule = Schedule::new(1_000, 0);
        assert_eq!(schedule.advance(1_999), Due { tick: 1, deadline_ns: 1_000, skipped: 0 });
        assert_eq!(schedule.advance(3_000), Due { tick: 3, deadline_ns: 3_000, skipped: 1 });
        assert_eq!(schedule.advance(7_500), Due { tick: 7, deadline_ns: 7_000, skipped: 3 });
    }

    #[test]
    fn starting_again_counts_from_one_again() {
        let mut schedule = Schedule::new(1_000, 0);
        schedule.advance(9_000);
        schedule.start(20_500);
        assert_eq!(schedule.advance(21_000), Due { tick: 1, deadline_ns: 21_000, skipped: 0 });
    }

    #[test]
    #[should_panic(expected = "period above zero")]
    fn a_period_of_zero_is_refused() {
        let _ = Schedule::new(0, 0);
    }

    proptest! {
        #[test]
        fn deadlines_stay_on_the_grid_and_ticks_stay_tied_to_time(
            period in PERIODS,
            phase in TIMES,
            start in TIMES,
            // Up to five periods between two looks at the clock, and looks before the deadline too.
            steps in prop::collection::vec(0.0..5.0_f64, 1..50),
        ) {
            let mut schedule = Schedule::new(period, phase);
            schedule.start(start);
            let first = schedule.next_deadline_ns();
            prop_assert!(first > start && first - start <= period.max(phase % period));
            let (mut now, mut last_tick) = (start, 0);
            for step in steps {
                now += (step * period as f64) as u64;
                let due = schedule.advance(now);
                prop_assert_eq!(due.deadline_ns % period, phase % period);
                prop_assert_eq!(due.deadline_ns, first + (due.tick - 1) * period);
                prop_assert_eq!(due.tick, last_tick + 1 + due.skipped);
                prop_assert!(now < due.deadline_ns + period, "a deadline a full period in the past");
                last_tick = due.tick;
            }
        }

        /// The oracle walks the grid one point at a time.
        #[test]
        fn skip_counts_are_exact(period in 1..1_000_u64, phase in 0..1_000_u64, late in 0..20_000_u64) {
            let mut schedule = Schedule::new(period, phase);
            let now = schedule.next_deadline_ns() + late;
            let (mut deadline, mut skipped) = (schedule.next_deadline_ns(), 0);
            while deadline + period <= now {
                deadline += period;
                skipped += 1;
            }
            prop_assert_eq!(schedule.advance(now), Due { tick: 1 + skipped, deadline_ns: deadline, skipped });
        }
    }
}
