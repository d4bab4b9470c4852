//! A surface that hums while it is touched.
//!
//! Model: along the outward normal, `A min(1, N / N0) sin(2 pi f t)` for a normal force N of the contact. The time t is
//! the tick's own, that of the run: whoever plays a scene again, under whichever clock, feels the same wave, and a tick that
//! was missed leaves no jump of the phase. It fades in with the load, and since `A <= N0` contact and vibration together
//! never pull.
//! Limits: frequencies of less than two and a half ticks a period are refused.

use std::f64::consts::TAU;

use super::Limits;
use super::Reaction;
use super::limits::not_above;
use crate::contact::Contact;
use crate::error::{ParameterError, above_zero, at_least_zero};

/// A vibration of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vibration {
    frequency_hz: f64,
    amplitude_n: f64,
    full_load_n: f64,
}

impl Vibration {
    /// With this frequency f and amplitude A, reached at a normal force of `full_load_n` (N0).
    ///
    /// Errors: a value out of range, a frequency above the limit, an amplitude above `full_load_n`.
    pub fn new(
        frequency_hz: f64,
        amplitude_n: f64,
        full_load_n: f64,
        limits: &Limits,
    ) -> Result<Self, ParameterError> {
        let full_load_n = above_zero("full_load_n", full_load_n)?;
        let amplitude_n = at_least_zero("amplitude_n", amplitude_n)?;
        not_above("amplitude_n", amplitude_n, full_load_n, "full_load_n: more of it would pull")?;
        Ok(Self { frequency_hz: limits.check_frequency(frequency_hz)?, amplitude_n, full_load_n })
    }

    /// f \[Hz\].
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// A \[N\].
    pub fn amplitude_n(&self) -> f64 {
        self.amplitude_n
    }

    /// N0 \[N\].
    pub fn full_load_n(&self) -> f64 {
        self.full_load_n
    }

    /// By how much its force can have changed in a tick of this length (s) (N).
    pub(super) fn explained_n(&self, contact: &Contact, dt_s: f64) -> f64 {
        let wave_n = self.amplitude_n * (TAU * self.frequency_hz * dt_s).min(2.0);
        wave_n + self.amplitude_n / self.full_load_n * contact.explained_n
    }

    /// What it does to a finger of this radius that touches it.
    pub(super) fn hum(&self, contact: &Contact, finger_radius_m: f64, t_s: f64) -> Reaction {
        let periods = self.frequency_hz * t_s;
        // Whole periods are taken off first: the sine of a large number would be less exact.
        let wave = (TAU * (periods - periods.floor())).sin();
        let load = (contact.normal_force_n / self.full_load_n).min(1.0);
        Reaction {
            entity: contact.entity,
            point_W: contact.touch_point_W(finger_radius_m),
            force_on_user_W: contact.normal_W * (self.amplitude_n * load * wave),
            stiffness_n_per_m: 0.0,
        }
    }
}
