//! One device's chain of limits, between what was commanded and what its motors are asked for.
//!
//! Model: peak, workspace edge, authority, what the motors can give, slew rate, in this order: the slew rate bounds what
//! all the others may make of a force from tick to tick, and none of them can make it longer. What motors can give is
//! a box of torques, a convex set of forces that has zero in it, since the arm's own weight is cut first to what they give:
//! between a force within it and another one every force is, so that what the slew rate lets through is given as it is.
//! Frames and signs: forces on the user and positions in the device's base frame D.
//! Invariants: whatever is commanded, what comes out is finite and within the peak; with no authority it is
//! exactly zero.
//! Cost: constant; no allocation, no panic.

use super::elapsed::Elapsed;
use super::peak::limit_force;
use super::slew::Slew;
use super::speed::Speed;
use super::workspace::Edge;
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::frame::{LIMIT_PEAK, LIMIT_SLEW, LIMIT_WORKSPACE};
use shm_abi::segment::DeviceInfo;

/// What one device may be made to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest force (N); infinite: none.
    pub peak_n: f64,
    /// How fast a force may grow (N/s); infinite: at once.
    pub slew_n_per_s: f64,
    /// Speed of the tip that is a fault (m/s); infinite: none.
    pub speed_m_per_s: f64,
    /// Where force is let through.
    pub edge: Edge,
}

impl Limits {
    /// Those that a device's description tells, with a margin around its workspace (m).
    pub fn of(info: &DeviceInfo, margin_m: f64) -> Self {
        let edge = Edge { min_m: info.workspace_min_m.into(), max_m: info.workspace_max_m.into(), margin_m };
        Self {
            peak_n: info.peak_force_n,
            slew_n_per_s: info.slew_n_per_s,
            speed_m_per_s: info.speed_limit_m_per_s,
            edge,
        }
    }
}

/// The chain of one device.
#[derive(Debug, Clone)]
pub struct Guard {
    limits: Limits,
    slew: Slew,
    speed: Speed,
    position: Vector3<f64>,
}

/// What is left of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restrained {
    /// The force on the user to ask of the motors, in D (N).
    pub force_on_user_n: Vector3<f64>,
    /// Bits of `LIMIT_...`: what had to act.
    pub limits: u64,
}

impl Restrained {
    /// A force of which nothing was cut.
    pub fn whole(force_on_user_n: Vector3<f64>) -> Self {
        Self { force_on_user_n, limits: 0 }
    }
}

impl Guard {
    /// A device at rest without force.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            slew: Slew::new(limits.slew_n_per_s),
            speed: Speed::new(limits.speed_m_per_s),
            position: Vector3::zeros(),
        }
    }

    /// Takes the tip's position (m) and estimated velocity (m/s), so long (ns) after the last ones.
    ///
    /// # Errors
    /// That it moved faster than it may.
    pub fn observe(
        &mut self,
        elapsed_ns: u64,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
    ) -> Result<(), FaultReason> {
        self.position = position;
        self.speed.observe(elapsed_ns, position, velocity)
    }

    /// It could not be read for so long (ns).
    pub fn overlook(&mut self, elapsed_ns: u64) {
        self.speed.overlook(elapsed_ns);
    }

    /// The position is not known; the next one is compared with nothing.
    pub fn lose_sight(&mut self) {
        self.speed.forget();
    }

    /// The force to ask of the motors so long after the last time, given the share that is let through and the part of
    /// a force, in its own direction, that they can give now.
    pub fn restrain(
        &mut self,
        commanded: Vector3<f64>,
        authority: f64,
        elapsed: Elapsed,
        attainable: impl Fn(Vector3<f64>) -> Restrained,
    ) -> Restrained {
        // Not `commanded * 0.0`: that leaves a negative zero or, for a fault, anything at all.
        if authority <= 0.0 {
            self.release();
            return Restrained { force_on_user_n: Vector3::zeros(), limits: 0 };
        }
        let (within_peak, is_cut) = limit_force(commanded, self.limits.peak_n);
        let share = self.limits.edge.share(self.position);
        let is_outside = share < 1.0;
        let faded = if is_outside { within_peak * share } else { within_peak };
        let wanted = attainable(faded * authority);
        let held = attainable(self.slew.last());
        let growth_s = elapsed.growth_ns() as f64 / 1e9;
        let (force, is_slewed) =
            self.slew.follow_from(held.force_on_user_n, wanted.force_on_user_n, growth_s);
        let bit = |acted: bool, bit: u64| if acted { bit } else { 0 };
        // What shortened the last force shortened the step from there, too.
        let limits = bit(is_cut, LIMIT_PEAK)
            | bit(is_outside, LIMIT_WORKSPACE)
            | bit(is_slewed, LIMIT_SLEW | held.limits);
        Restrained { force_on_user_n: force, limits: limits | wanted.limits }
    }

    /// The force is gone, whatever it was.
    pub fn release(&mut self) {
        self.slew.release();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shm_abi::frame::LIMIT_HEAT;

    const MS: u64 = 1_000_000;
    const TICK: Elapsed = Elapsed::new(MS, MS);

    fn limits() -> Limits {
        let edge = Edge { min_m: Vector3::repeat(-0.1), max_m: Vector3::repeat(0.1), margin_m: 0.02 };
        Limits { peak_n: 8.5, slew_n_per_s: 2000.0, speed_m_per_s: 1.5, edge }
    }

    #[test]
    fn each_limit_that_acts_is_told() {
        let mut guard = Guard::new(limits());
        guard.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        let small = guard.restrain(Vector3::x(), 1.0, TICK, Restrained::whole);
        assert_eq!(small, Restrained { force_on_user_n: Vector3::x(), limits: 0 });
        let step = guard.restrain(Vector3::x() * 9.0, 1.0, TICK, Restrained::whole);
        assert_eq!(step.limits, LIMIT_PEAK | LIMIT_SLEW);
        assert_eq!(step.force_on_user_n, Vector3::x() * 3.0);
        let mut outside = Guard::new(limits());
        outside.observe(MS, Vector3::x() * 0.11, Vector3::zeros()).unwrap();
        let faded = outside.restrain(Vector3::x(), 1.0, TICK, Restrained::whole);
        assert_eq!(faded.limits, LIMIT_WORKSPACE);
        assert!((faded.force_on_user_n.x - 0.5).abs() < 1e-14, "half of it in mid margin, to rounding");
    }

    #[test]
    fn a_step_that_the_loss_of_the_last_force_used_up_is_told_of_both_limits() {
        for (wanted, told) in [
            (Vector3::new(6.0, 6.0, 0.0), LIMIT_SLEW | LIMIT_HEAT),
            // Itself too much for them, as the last one is.
            (Vector3::new(7.2, 4.4, 0.0), LIMIT_SLEW | LIMIT_HEAT),
            // Shortened anyway: the loss changes nothing.
            (Vector3::x() * 6.0, 0),
        ] {
            let mut guard = Guard::new(limits());
            for _ in 0..4 {
                guard.restrain(Vector3::x() * 8.0, 1.0, TICK, Restrained::whole);
            }
            let within_seven = |force: Vector3<f64>| match force.x <= 7.0 {
                true => Restrained::whole(force),
                false => Restrained { force_on_user_n: force * (7.0 / force.x), limits: LIMIT_HEAT },
            };
            assert_eq!(guard.restrain(wanted, 1.0, TICK, within_seven).limits, told, "{wanted}");
        }
    }

    /// As after a stall, in which the motors became warm.
    #[test]
    fn a_force_that_motors_hold_no_more_is_shortened_and_grows_by_what_that_leaves_of_the_step() {
        let mut guard = Guard::new(limits());
        for _ in 0..4 {
            guard.restrain(Vector3::x() * 8.0, 1.0, TICK, Restrained::whole);
        }
        let within_seven = |force: Vector3<f64>| Restrained::whole(force * (7.0 / force.x.abs()).min(1.0));
        let wanted = Vector3::new(6.0, 6.0, 0.0);
        let force = guard.restrain(wanted, 1.0, TICK, within_seven).force_on_user_n;
        assert!(force.x <= 7.0 && force.y > 0.0, "{force}");
        // A newton of the two was lost; roundings of numbers below 10.
        assert!((force - Vector3::x() * 7.0).norm() <= 1.0 + 1e-14, "{force}");
        assert!((force - Vector3::x() * 8.0).norm() <= 2.0 + 1e-14, "{force}");
    }

    #[test]
    fn without_authority_there_is_exactly_nothing_and_force_grows_from_there_again() {
        let mut guard = Guard::new(limits());
        for _ in 0..10 {
            guard.restrain(Vector3::x() * 8.0, 1.0, TICK, Restrained::whole);
        }
        let none = guard.restrain(Vector3::new(-8.0, f64::NAN, 1.0), 0.0, TICK, Restrained::whole);
        assert_eq!(none, Restrained { force_on_user_n: Vector3::zeros(), limits: 0 });
        assert!(none.force_on_user_n.iter().all(|c| c.is_sign_positive()), "and no negative zero");
        assert_eq!(
            guard.restrain(Vector3::x() * 8.0, 1.0, TICK, Restrained::whole).force_on_user_n,
            Vector3::x() * 2.0
        );
    }

    proptest! {
        /// Also where ticks were skipped, or take no time at all.
        #[test]
        fn whatever_is_commanded_stays_finite_within_the_peak_and_the_step(
            commands in proptest::collection::vec(
                (prop::array::uniform3(any::<f64>()), 0.0..1.0f64, prop::array::uniform3(-0.2..0.2f64), 0u64..9 * MS),
                1..60,
            ),
        ) {
            let mut guard = Guard::new(limits());
            let mut last = Vector3::zeros();
            for (force, authority, position, passed_ns) in commands {
                let _ = guard.observe(passed_ns, position.into(), Vector3::zeros());
                let elapsed = Elapsed::new(passed_ns, MS);
                let out = guard.restrain(force.into(), authority, elapsed, Restrained::whole).force_on_user_n;
                prop_assert!(out.iter().all(|c| c.is_finite()));
                // A few roundings of numbers below 10.
                prop_assert!(out.norm() <= 8.5 + 1e-13);
                let step = 2000.0 * elapsed.growth_ns() as f64 / 1e9;
                prop_assert!(out.norm() <= last.norm() + step + 1e-13);
                // It shortened along itself, to a billionth, or moved by a step.
                prop_assert!((out - last).norm() <= last.norm().max(step) + 1e-8);
                last = out;
            }
        }
    }
}
