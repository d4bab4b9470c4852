//! Whether an arm stands still: only then can the pose that it is in be taken for its zeroing pose.
//!
//! Problem: whoever zeroes an arm holds it by hand; a zero taken in the middle of a movement is a wrong one.
//! Model: the counters stay within [`COUNTS`] of where the present rest began, for [`REST_NS`] of readings on end.
//! A slow drift leaves that band sooner or later and begins a new rest.
//! Units: counts; a count of a Premium is 0.03 mm at the tip, so two are less than a hand trembles in the air, and
//! more than a flickering counter shows.
//! Invariant: each reading stands for a period at most ([`Elapsed::growth_ns`]), so that ticks that were skipped prove
//! nothing, and those that are made up for only what they are.
//! Cost: six comparisons; no allocation.

use super::elapsed::Elapsed;

/// How far a counter may stray.
pub const COUNTS: u64 = 2;
/// For how long (ns).
pub const REST_NS: u64 = 500_000_000;

/// One device's rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stillness {
    /// How long, and where, if it has been seen.
    rest: Option<(u64, [i64; 6])>,
}

impl Stillness {
    /// Takes the counters of a reading, so long after the one before.
    pub fn observe(&mut self, counts: [i64; 6], elapsed: Elapsed) {
        let strays = |began_at: &[i64; 6]| {
            counts.iter().zip(began_at).any(|(count, began)| count.abs_diff(*began) > COUNTS)
        };
        let (rested_ns, began_at) = self.rest.filter(|rest| !strays(&rest.1)).unwrap_or((0, counts));
        self.rest = Some((rested_ns.saturating_add(elapsed.growth_ns()), began_at));
    }

    /// It could not be read: nobody knows what it did meanwhile.
    pub fn lose_sight(&mut self) {
        self.rest = None;
    }

    /// Whether it has rested long enough.
    pub fn is_still(&self) -> bool {
        self.rest.is_some_and(|(rested_ns, _)| rested_ns >= REST_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    const TICK: Elapsed = Elapsed::new(MS, MS);

    fn at(count: i64) -> [i64; 6] {
        [7, count, -3, 0, 0, 0]
    }

    #[test]
    fn half_a_second_within_two_counts_is_still_and_a_third_count_begins_anew() {
        let mut still = Stillness::default();
        for tick in 0..500 {
            assert!(!still.is_still(), "{tick}");
            still.observe(at(100 + [0, 2, -2, 1][tick % 4]), TICK);
        }
        assert!(still.is_still());
        still.observe(at(103), TICK);
        assert!(!still.is_still());
        (0..499).for_each(|_| still.observe(at(103), TICK));
        assert!(still.is_still());
    }

    #[test]
    fn the_same_time_at_every_rate() {
        for period_ns in [MS, MS / 2, MS / 8, 7 * MS, 1000 * MS] {
            let mut still = Stillness::default();
            for _ in 0..REST_NS.div_ceil(period_ns) {
                assert!(!still.is_still(), "{period_ns}");
                still.observe(at(0), Elapsed::new(period_ns, period_ns));
            }
            assert!(still.is_still(), "{period_ns}");
        }
    }

    #[test]
    fn skipped_ticks_prove_nothing_and_made_up_ones_only_what_they_are() {
        let mut still = Stillness::default();
        (0..499).for_each(|_| still.observe(at(0), Elapsed::new(400 * MS, MS)));
        assert!(!still.is_still());
        (0..9).for_each(|_| still.observe(at(0), Elapsed::new(MS / 10, MS)));
        assert!(!still.is_still());
        still.observe(at(0), Elapsed::new(MS / 10, MS));
        assert!(still.is_still());
    }

    #[test]
    fn a_drift_that_is_slow_is_no_rest_and_a_gimbal_that_swings_is_none_either() {
        let mut still = Stillness::default();
        for tick in 0..5000 {
            still.observe(at(tick / 100), TICK);
            assert!(!still.is_still(), "a count each 0.1 s");
        }
        for tick in 0..1000 {
            still.observe([0, 0, 0, 0, tick / 50, 0], TICK);
            assert!(!still.is_still());
        }
    }

    #[test]
    fn a_reading_that_fails_begins_anew_and_no_count_is_too_far() {
        let mut still = Stillness::default();
        (0..500).for_each(|_| still.observe(at(i64::MIN), TICK));
        assert!(still.is_still());
        still.lose_sight();
        assert!(!still.is_still());
        still.observe(at(i64::MAX), TICK);
        still.observe(at(i64::MIN), TICK);
        assert!(!still.is_still());
    }
}
