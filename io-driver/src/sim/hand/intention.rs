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
    now: Moving,
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
        Self { spec, reach: start, now: Moving::resting(start), transition, step_s: USUAL_TICK_S }
    }

    /// Moves on by a tick of `dt_s` > 0; returns where the point is now, with the even velocity that takes it to the
    /// tick's end.
    pub(super) fn step(&mut self, wanted: Vector3<f64>, dt_s: f64) -> Moving {
        if dt_s != self.step_s {
            (self.transition, self.step_s) = (self.spec.transition(dt_s), dt_s);
        }
        self.reach = towards(self.reach, wanted, self.spec.speed_limit_m_per_s * dt_s);
        let before = self.now.at;
        for i in 0..3 {
            let (offset, speed) = self.transition.apply(before[i] - self.reach[i], self.now.velocity[i]);
            self.now.at[i] = self.reach[i] + offset;
            self.now.velocity[i] = without_dregs(speed);
        }
        Moving { at: before, velocity: (self.now.at - before) / dt_s }
    }
}

/// From `from` towards `to`, at most `step`; exactly `to` if that is near enough.
fn towards(from: Vector3<f64>, to: Vector3<f64>, step: f64) -> Vector3<f64> {
    let way = to - from;
    let length = way.norm();
    if length <= step { to } else { from + way * (step / length) }
}

const USUAL_TICK_S: f64 = 1e-3;
