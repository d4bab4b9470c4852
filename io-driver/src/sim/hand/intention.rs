//! Where the user means to be: the script's position through what a person can do.
//!
//! Problem: a script may jump; a hand neither jumps nor trembles at 100 Hz on purpose.
//! Model: a reach follows the wanted position at no more than the hand's top speed; the intention follows the reach
//! through a critically damped low-pass of second order, x'' = w^2 (reach - x) - 2 w x', whose magnitude is
//! 1 / (1 + (f/f0)^2), hence half the power at f0 sqrt(sqrt 2 - 1). Its impulse response is nowhere negative, so it
//! neither overshoots nor becomes faster than the reach.
//! Bandwidth: Brooks ("Telerobotic response requirements", 1990) has people follow unexpected signals at 1-2 Hz,
//! periodic ones at 2-5 Hz, own and learnt paths up to 5 Hz; force can be varied on purpose up to some 7 Hz.
//! A script is a learnt path: 5 Hz for the hand, 7 Hz for a finger alone (model files).
//! Invariants: rests exactly where it starts while that is wanted; a constant wanted position is reached exactly.
//! Cost: some 20 ns a tick, one matrix exponential when the tick's length changes; no allocation.

use nalgebra::Vector3;

use super::impedance::{Moving, without_dregs};
use super::transition::Transition;

/// What a person can do on purpose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntentionSpec {
    /// Frequency at which a movement has half the power that was wanted (Hz).
    pub bandwidth_hz: f64,
    /// Top speed (m/s).
    pub speed_limit_m_per_s: f64,
}

/// The intended point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Intention {
    spec: IntentionSpec,
    reach: Vector3<f64>,
    /// The intended point against the reach, which is a number that can fall to zero, as a position would not.
    offset: Moving,
    at: Vector3<f64>,
    transition: Transition,
    /// What the transition is for (s).
    step_s: f64,
}

impl IntentionSpec {
    /// The low-pass's corner f0 as an angular frequency (rad/s).
    pub(super) fn corner_rad_per_s(&self) -> f64 {
        // 1 / (1 + (f/f0)^2) is 1/sqrt(2) where (f/f0)^2 = sqrt(2) - 1.
        std::f64::consts::TAU * self.bandwidth_hz / (std::f64::consts::SQRT_2 - 1.0).sqrt()
    }

    pub(super) fn transition(&self, dt_s: f64) -> Transition {
        let w = self.corner_rad_per_s();
        Transition::new(w * w, 2.0 * w, dt_s)
    }
}

impl Intention {
    /// At rest at `start`.
    pub(super) fn new(spec: IntentionSpec, start: Vector3<f64>) -> Self {
        let transition = spec.transition(USUAL_TICK_S);
        let offset = Moving::resting(Vector3::zeros());
        Self { spec, reach: start, offset, at: start, transition, step_s: USUAL_TICK_S }
    }

    /// Moves on by a tick of `dt_s` > 0; returns where the point is now, with the even velocity that takes it to the
    /// tick's end.
    pub(super) fn step(&mut self, wanted: Vector3<f64>, dt_s: f64) -> Moving {
        if dt_s != self.step_s {
            (self.transition, self.step_s) = (self.spec.transition(dt_s), dt_s);
        }
        let reach = towards(self.reach, wanted, self.spec.speed_limit_m_per_s * dt_s);
        let moved = std::mem::replace(&mut self.reach, reach) - reach;
        for i in 0..3 {
            let (offset, speed) =
                self.transition.apply(self.offset.at[i] + moved[i], self.offset.velocity[i]);
            self.offset.at[i] = without_dregs(offset);
            self.offset.velocity[i] = without_dregs(speed);
        }
        let before = std::mem::replace(&mut self.at, reach + self.offset.at);
        Moving { at: before, velocity: (self.at - before) / dt_s }
    }
}

/// From `from` towards `to`, at most `step`; exactly `to` if that is near enough.
fn towards(from: Vector3<f64>, to: Vector3<f64>, step: f64) -> Vector3<f64> {
    let way = to - from;
    let length = way.norm();
    if length <= step { to } else { from + way * (step / length) }
}

const USUAL_TICK_S: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    const HAND: IntentionSpec = IntentionSpec { bandwidth_hz: 5.0, speed_limit_m_per_s: 1.0 };

    #[test]
    fn it_rests_exactly_where_it_starts() {
        let start = Vector3::new(0.1, -0.2, 1.0 / 3.0);
        let mut intention = Intention::new(HAND, start);
        for _ in 0..1000 {
            assert_eq!(intention.step(start, 1e-3), Moving::resting(start));
        }
    }

    #[test]
    fn a_constant_target_is_reached_exactly_without_overshoot_and_no_faster_than_a_hand_is() {
        for dt_s in [1e-3, 125e-6, 2e-3] {
            let target = Vector3::new(0.3, -0.2, 0.1);
            let mut intention = Intention::new(HAND, Vector3::zeros());
            let mut end = Vector3::zeros();
            for tick in 0..(3.0 / dt_s) as usize {
                let moving = intention.step(target, dt_s);
                // Where a tick begins is where the last one ended, to the rounding of numbers below one.
                assert!((moving.at - end).norm() < 1e-15, "tick {tick}");
                end = moving.after(dt_s).at;
                assert!(moving.velocity.norm() <= 1.0 + 1e-9, "tick {tick}");
                // On its way along a line, never behind its end; rounding again.
                assert!(end.dot(&target) <= target.norm_squared() * (1.0 + 1e-14), "tick {tick}");
            }
            assert_eq!(intention.step(target, dt_s), Moving::resting(target));
        }
    }

    #[test]
    fn at_its_bandwidth_a_movement_has_half_the_power_that_was_wanted() {
        let (amplitude, dt_s) = (0.01, 1e-3);
        for (hertz, share) in [(5.0, std::f64::consts::FRAC_1_SQRT_2), (0.1, 0.99983), (20.0, 0.131)] {
            let w = std::f64::consts::TAU * hertz;
            let mut intention = Intention::new(HAND, Vector3::zeros());
            let mut largest = 0.0_f64;
            for tick in 0..20_000 {
                let wanted = Vector3::x() * (amplitude * (w * dt_s * f64::from(tick)).sin());
                let moving = intention.step(wanted, dt_s);
                if tick > 5000 {
                    largest = largest.max(moving.at.x);
                }
            }
            // Top speed 20 Hz x 10 mm x 2 pi is 1.26 m/s: that one is limited besides, by less than the tolerance allows.
            // Else: a maximum is missed by at most (w dt / 2)^2 / 2, 0.2 % at 20 Hz.
            let tolerance = if hertz < 10.0 { 2e-3 } else { 0.3 };
            assert!(
                (largest / amplitude / share - 1.0).abs() < tolerance,
                "{hertz} Hz: {}",
                largest / amplitude
            );
        }
    }
}
