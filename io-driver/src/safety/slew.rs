//! Limit of the change of a force from tick to tick.
//!
//! Problem: a step of the force is felt as a blow, and a defect in an application makes large ones; but a force
//! that should end has to end now: holding on to it would push somebody for no reason.
//! Model: from one tick to the next a force may change by `slew * dt` as a vector, `|F - F_last| <= slew * dt`, or it
//! may become shorter along its own direction by as much as it likes. Of the two the one is taken that comes nearer
//! to what is wanted. So zero is always within reach, and a reversal or a turn counts whole: from 5 N to -5 N are
//! 10 N, and no force that was there is a credit for one the other way. What would have to reverse by more than a
//! step becomes zero first and grows the other way from the next tick on.
//! `dt` is the time since the last tick, but no more than [`LONGEST_STEP_S`]: the motors follow what is written within
//! that, so that a value of a slower loop hits as hard as one of a fast loop.
//!
//! Figures, for the 5000 N/s of the arms described here, 5 N a tick at 1 kHz:
//! - What a device does by itself: a Premium's winding has `L/R` = 0.11 ms and its current loop 0.16 ms, so 8.5 N are
//!   there after 0.3 ms. Nothing but this limit makes a step in the codes less than one at the hand.
//! - What rendering needs: a wall of 2 N/mm hit at 1 m/s grows by 2 N in a millisecond, one of 3.5 N/mm, the stiffest
//!   that a Premium holds, by 3.5 N; Coulomb friction of mu = 0.5 under 4 N turns round by 4 N.
//! - What a hand bears: 5 N on the 80 g of a Premium's tip for a millisecond are 0.06 m/s and 0.03 mm, which is felt as
//!   a tap; the 17 N from peak to peak would be 0.2 m/s in every tick.
//!
//! A force that the motors do not hold any more, being warmer than they were, is shortened to what they hold, which uses
//! up as much of the step.
//!
//! Invariants: `|F - F_last| <= slew * dt`, or `F` is `F_last` shortened; never longer than the longer of `F_last` and
//! what was asked for, to rounding; with no time to grow in, a force only shrinks.
//! Cost: two dozen operations.

use nalgebra::Vector3;

/// A tick that takes longer allows no larger step (s).
pub const LONGEST_STEP_S: f64 = 1e-3;

/// What is as little beside a force as this part of it lies along it, but for rounding.
const ALONG: f64 = 1e-9;

/// The limiter of one device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slew {
    n_per_s: f64,
    last: Vector3<f64>,
}

impl Slew {
    /// At most `n_per_s`; infinite: no limit.
    pub fn new(n_per_s: f64) -> Self {
        Self { n_per_s, last: Vector3::zeros() }
    }

    /// The force that may follow the last one after `dt_s`, and whether it is another than `wanted`, which is
    /// finite.
    pub fn follow(&mut self, wanted: Vector3<f64>, dt_s: f64) -> (Vector3<f64>, bool) {
        let step = self.n_per_s * dt_s.min(LONGEST_STEP_S);
        self.step_towards(wanted, step)
    }

    /// The same where of the last force only `held` can be kept, which is as long or shorter.
    pub fn follow_from(
        &mut self,
        held: Vector3<f64>,
        wanted: Vector3<f64>,
        dt_s: f64,
    ) -> (Vector3<f64>, bool) {
        let lost = (self.last - held).norm();
        let step = self.n_per_s * dt_s.min(LONGEST_STEP_S);
        self.last = held;
        self.step_towards(wanted, if lost > 0.0 { (step - lost).max(0.0) } else { step })
    }

    /// The force that was let through last.
    pub fn last(&self) -> Vector3<f64> {
        self.last
    }

    fn step_towards(&mut self, wanted: Vector3<f64>, step: f64) -> (Vector3<f64>, bool) {
        let way = wanted - self.last;
        let length = way.norm();
        let shortened = nearest_on_segment(self.last, wanted);
        let is_shorter = (wanted - shortened).norm() <= ALONG * self.last.norm();
        // An infinite step times no time is not a number: then nothing is too far.
        let is_too_far = length > step;
        if !is_too_far || is_shorter {
            self.last = wanted;
            return (wanted, false);
        }
        let rest = length - step;
        let is_shortened = (wanted - shortened).norm() <= rest;
        self.last = if is_shortened { shortened } else { self.last + way * (step / length) };
        (self.last, true)
    }

    /// There is no force any more.
    pub fn release(&mut self) {
        self.last = Vector3::zeros();
    }
}

/// The point between the origin and `end` that is nearest to `point`.
fn nearest_on_segment(end: Vector3<f64>, point: Vector3<f64>) -> Vector3<f64> {
    let length_squared = end.norm_squared();
    if length_squared == 0.0 { end } else { end * (point.dot(&end) / length_squared).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// One that renders this force, and may change by 1 N a millisecond.
    fn rendering(force: Vector3<f64>) -> Slew {
        Slew { last: force, ..Slew::new(1000.0) }
    }

    fn after_a_tick(from: Vector3<f64>, wanted: Vector3<f64>) -> (Vector3<f64>, bool) {
        rendering(from).follow(wanted, 1e-3)
    }

    #[test]
    fn a_step_becomes_a_ramp_of_the_slew_rate() {
        let mut slew = rendering(Vector3::zeros());
        for tick in 1..=8 {
            let (force, is_cut) = slew.follow(Vector3::new(0.0, 8.0, 0.0), 1e-3);
            // Sums of 1.0, exact.
            assert_eq!(force, Vector3::new(0.0, f64::from(tick), 0.0));
            assert_eq!(is_cut, tick < 8);
        }
    }

    #[test]
    fn a_force_vanishes_or_shortens_at_once() {
        let force = Vector3::new(6.0, 0.0, -8.0);
        assert_eq!(after_a_tick(force, Vector3::zeros()), (Vector3::zeros(), false));
        let (half, is_cut) = after_a_tick(Vector3::x() * 8.0, Vector3::x() * 4.0);
        assert_eq!((half, is_cut), (Vector3::x() * 4.0, false));
    }

    #[test]
    fn a_reversal_goes_through_zero_and_counts_whole() {
        let mut slew = rendering(Vector3::x() * 8.0);
        let wanted = Vector3::x() * -8.0;
        let forces: Vec<f64> = (0..10).map(|_| slew.follow(wanted, 1e-3).0.x).collect();
        assert_eq!(forces, [0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -7.0, -8.0, -8.0]);
        // Within the step it is free.
        assert_eq!(after_a_tick(Vector3::x() * 0.5, Vector3::x() * -0.5), (Vector3::x() * -0.5, false));
        // Beyond zero the whole change counts: 1 N of these 1.8 N, one rounding.
        assert!((after_a_tick(Vector3::x() * 0.9, Vector3::x() * -0.9).0.x + 0.1).abs() < 1e-15);
    }

    #[test]
    fn a_turn_counts_whole_and_takes_the_nearer_of_the_two_ways() {
        // 5 N to the side of 5 N are 7 N away; shortened to nothing 5 N are left to go.
        assert_eq!(after_a_tick(Vector3::x() * 5.0, Vector3::y() * 5.0), (Vector3::zeros(), true));
        // A small turn is taken by the step: 3-4-5 triangles, of which a fifth is a newton.
        let (turned, is_cut) = after_a_tick(Vector3::new(8.0, 0.0, 0.0), Vector3::new(5.0, 4.0, 0.0));
        assert!(is_cut);
        // Shortened to 5 N it is 4 N away; a newton along the way leaves 4 N as well, and the shorter is taken.
        assert_eq!(turned, Vector3::x() * 5.0);
        let (grown, _) = after_a_tick(Vector3::new(8.0, 0.0, 0.0), Vector3::new(11.0, 4.0, 0.0));
        // A fifth of a 3-4-5 triangle: one rounding of each product.
        assert!((grown - Vector3::new(8.6, 0.8, 0.0)).norm() < 1e-14, "{grown}");
    }

    #[test]
    fn a_tick_that_takes_no_time_lets_nothing_grow_and_a_long_one_no_more_than_a_millisecond() {
        let mut slew = rendering(Vector3::x() * 2.0);
        assert_eq!(slew.follow(Vector3::x() * 3.0, 0.0), (Vector3::x() * 2.0, true));
        assert_eq!(slew.follow(Vector3::x(), 0.0), (Vector3::x(), false));
        assert_eq!(slew.follow(Vector3::x() * 9.0, 0.1), (Vector3::x() * 2.0, true));
    }

    #[test]
    fn without_a_limit_everything_passes() {
        let mut slew = Slew::new(f64::INFINITY);
        let huge = Vector3::repeat(1e300);
        for dt_s in [1e-3, 0.0] {
            assert_eq!(slew.follow(huge, dt_s), (huge, false));
            assert_eq!(slew.follow(-huge, dt_s), (-huge, false));
            assert_eq!(slew.follow_from(-huge, huge, dt_s), (huge, false), "nothing of it was lost");
            slew.release();
        }
    }

    proptest! {
        #[test]
        fn a_force_changes_by_the_step_at_most_or_shortens_and_is_never_longer_than_asked(
            wanted in proptest::collection::vec((prop::array::uniform3(-10.0..10.0f64), 0.0..3e-3f64), 1..50),
            n_per_s in 1.0..1e5f64,
        ) {
            let mut slew = Slew::new(n_per_s);
            let mut last = Vector3::zeros();
            for (wanted, dt_s) in wanted {
                let wanted = Vector3::from(wanted);
                let (force, is_cut) = slew.follow(wanted, dt_s);
                // Roundings of a few products of numbers up to 17, some ulps of 4e-15.
                let is_step = (force - last).norm() <= n_per_s * dt_s.min(1e-3) + 1e-13;
                // What counts as along is so to a billionth.
                let is_shortened = force.cross(&last).norm() <= 1e-9 * last.norm_squared() + 1e-12
                    && force.dot(&last) >= -1e-9 * last.norm_squared()
                    && force.norm() <= last.norm() * (1.0 + 1e-9) + 1e-13;
                prop_assert!(is_step || is_shortened, "{last} to {force}");
                prop_assert!(force.norm() <= wanted.norm().max(last.norm()) + 1e-13);
                prop_assert!((wanted - force).norm() <= (wanted - last).norm() + 1e-13, "towards what is wanted");
                prop_assert!(is_cut || force == wanted);
                last = force;
            }
        }

        /// Else a force could be stuck.
        #[test]
        fn whatever_is_wanted_is_reached_in_time(
            from in prop::array::uniform3(-10.0..10.0f64), to in prop::array::uniform3(-10.0..10.0f64),
        ) {
            let (from, to) = (Vector3::from(from), Vector3::from(to));
            let mut slew = rendering(from);
            // Shortened once at most, then straight on: a tick for each newton of the longest way, and two for ends.
            let ticks = 2 + (from.norm() + to.norm()).ceil() as usize;
            let reached = (0..ticks).any(|_| slew.follow(to, 1e-3).0 == to);
            prop_assert!(reached, "{from} to {to}");
        }
    }
}
