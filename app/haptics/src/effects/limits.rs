//! How strong an effect may be before it makes a device swing.
//!
//! Model: a device of mass M at its tip whose forces come late. A force is held for a tick and acts from the next
//! one on: 1.5 ticks behind the position that it answers. A velocity is estimated, and behind by another 2.5 ms: what the
//! driver's estimate needs for a contact's ring-down. From `M s x = -F(x) e^(-s delay)` by Nyquist:
//! - a damper b is stable up to `pi/2 M / delay`;
//! - a spring k takes `k delay` from the damping that is there, so that it is stable up to `b / delay`; counted is the
//!   hand's alone (3 N s/m, a finger held lightly), since a late damper cannot be relied on;
//! - a mass m felt through a filter of corner w is a spring `m w^2` at high frequencies: stable up to
//!   `2 M / (w delay)`, and with any delay up to M.
//!
//! Half of each is allowed: a gain margin of two. That is conservative: a hand adds mass and damping, and a device
//! its friction. A device of another mass at its tip is told by [`Limits::with_device_mass`].

use std::f64::consts::{FRAC_PI_4, TAU};

use crate::error::{ParameterError, above_zero, at_least_zero};

/// The limits of a device at a rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    device_mass_kg: f64,
    period_s: f64,
}

impl Limits {
    /// Mass at the tip if nothing is said \[kg\]: the least of a PHANToM Premium 1.5, along its lightest axis.
    pub const DEFAULT_DEVICE_MASS_KG: f64 = 0.03;

    /// For a device of the default mass with a tick of this length \[s\].
    ///
    /// Errors: a length that is not finite or not positive.
    pub fn at(period_s: f64) -> Result<Self, ParameterError> {
        let period_s = above_zero("period_s", period_s)?;
        Ok(Self { device_mass_kg: Self::DEFAULT_DEVICE_MASS_KG, period_s })
    }

    /// For a device of this mass at its tip \[kg\].
    ///
    /// Errors: a mass that is not finite or not positive.
    pub fn with_device_mass(self, device_mass_kg: f64) -> Result<Self, ParameterError> {
        Ok(Self { device_mass_kg: above_zero("device_mass_kg", device_mass_kg)?, ..self })
    }

    /// The largest damping \[N s/m\].
    pub fn damping_n_s_per_m(&self) -> f64 {
        FRAC_PI_4 * self.device_mass_kg / (self.position_delay_s() + VELOCITY_LAG_S)
    }

    /// The largest stiffness \[N/m\].
    pub fn stiffness_n_per_m(&self) -> f64 {
        0.5 * HAND_DAMPING_N_S_PER_M / self.position_delay_s()
    }

    /// The largest mass felt through a filter of this corner frequency \[kg\].
    pub fn mass_kg(&self, cutoff_hz: f64) -> f64 {
        self.device_mass_kg * (1.0 / (TAU * cutoff_hz * self.position_delay_s())).max(0.5)
    }

    /// The highest frequency of a vibration \[Hz\]: two and a half ticks to a period. Nearer to two of them its strength
    /// would wander.
    pub fn frequency_hz(&self) -> f64 {
        0.4 / self.period_s
    }

    fn position_delay_s(&self) -> f64 {
        1.5 * self.period_s
    }

    pub(super) fn check_damping(&self, value: f64) -> Result<f64, ParameterError> {
        let parameter = "damping_n_s_per_m";
        let value = at_least_zero(parameter, value)?;
        not_above(parameter, value, self.damping_n_s_per_m(), OF_DAMPING)
    }

    pub(super) fn check_stiffness(&self, parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
        not_above(parameter, at_least_zero(parameter, value)?, self.stiffness_n_per_m(), OF_STIFFNESS)
    }

    pub(super) fn check_mass(&self, value: f64, cutoff_hz: f64) -> Result<f64, ParameterError> {
        let value = at_least_zero("mass_kg", value)?;
        not_above("mass_kg", value, self.mass_kg(cutoff_hz), OF_MASS)
    }

    pub(super) fn check_frequency(&self, value: f64) -> Result<f64, ParameterError> {
        let value = above_zero("frequency_hz", value)?;
        not_above("frequency_hz", value, self.frequency_hz(), OF_FREQUENCY)
    }
}

pub(super) fn not_above(
    parameter: &'static str,
    value: f64,
    limit: f64,
    limit_is: &'static str,
) -> Result<f64, ParameterError> {
    if value <= limit {
        return Ok(value);
    }
    Err(ParameterError::AboveLimit { parameter, value, limit, limit_is })
}

/// How late the driver's estimate of the velocity is \[s\], for the ring-down of a contact at 50 Hz.
const VELOCITY_LAG_S: f64 = 2.5e-3;
/// What a finger's own flesh takes from a swing \[N s/m\]: 2 to 6 were measured.
const HAND_DAMPING_N_S_PER_M: f64 = 3.0;

const OF_DAMPING: &str = "the stability limit pi/4 device_mass / (1.5 ticks + 2.5 ms)";
const OF_STIFFNESS: &str = "the stability limit 3 N s/m / (3 ticks)";
const OF_MASS: &str = "the stability limit device_mass / (2 pi cutoff_hz 1.5 ticks)";
const OF_FREQUENCY: &str = "two and a half ticks a period";
