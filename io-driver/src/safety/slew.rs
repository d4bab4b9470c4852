//! How fast a force may grow.
//!
//! Problem: a step of the force is felt as a blow, and a defect in an application makes large ones; but a force
//! that should end has to end now: holding on to it would push somebody for no reason.
//! Model: the next force lies within `slew * dt` of *some* force between nothing and the last one. So it may
//! shrink at once, to zero if need be, and what it grows, turns or reverses is bounded.
//! Invariants: never longer than it was by more than the step, never longer than asked for by rounding only;
//! zero is always within reach.
//! Cost: a dozen operations.

use nalgebra::Vector3;

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
        let step = self.n_per_s * dt_s;
        let from = nearest_on_segment(self.last, wanted);
        let way = wanted - from;
        let length = way.norm();
        // Not `length > step`: an infinite step times nothing is not a number, and then nothing is cut.
        let is_cut = length > step;
        self.last = if is_cut { from + way * (step / length) } else { wanted };
        (self.last, is_cut)
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

    #[test]
    fn a_step_becomes_a_ramp_of_the_slew_rate() {
        let mut slew = Slew::new(1000.0);
        for tick in 1..=8 {
            let (force, is_cut) = slew.follow(Vector3::new(0.0, 8.0, 0.0), 1e-3);
            // Sums of 1.0, exact.
            assert_eq!(force, Vector3::new(0.0, f64::from(tick), 0.0));
            assert_eq!(is_cut, tick < 8);
        }
    }

    #[test]
    fn a_force_vanishes_at_once_and_reverses_no_faster_than_it_grows() {
        let mut slew = Slew::new(1000.0);
        for _ in 0..8 {
            slew.follow(Vector3::x() * 8.0, 1e-3);
        }
        let mut reversing = slew;
        assert_eq!(slew.follow(Vector3::zeros(), 1e-3), (Vector3::zeros(), false));
        assert_eq!(reversing.follow(Vector3::x() * -8.0, 1e-3), (-Vector3::x(), true));
    }

    #[test]
    fn without_a_limit_everything_passes() {
        let mut slew = Slew::new(f64::INFINITY);
        let huge = Vector3::repeat(1e300);
        for dt_s in [1e-3, 0.0] {
            assert_eq!(slew.follow(huge, dt_s).0, huge);
            slew.release();
        }
    }

    proptest! {
        #[test]
        fn a_force_grows_by_the_step_at_most_and_never_beyond_what_was_asked(
            wanted in proptest::collection::vec(prop::array::uniform3(-10.0..10.0f64), 1..50),
            n_per_s in 1.0..1e5f64,
        ) {
            let mut slew = Slew::new(n_per_s);
            let mut last = Vector3::zeros();
            for wanted in wanted.into_iter().map(Vector3::from) {
                let (force, is_cut) = slew.follow(wanted, 1e-3);
                // Roundings of a few products of numbers up to 10, some ulps of 2e-15.
                prop_assert!(force.norm() <= last.norm() + n_per_s * 1e-3 + 1e-13);
                prop_assert!(force.norm() <= wanted.norm().max(last.norm()) + 1e-13);
                prop_assert!(is_cut || force == wanted);
                last = force;
            }
        }
    }
}
