//! Hayward and Armstrong's friction: Dahl's without the drift of small strains.
//!
//! Model (V. Hayward and B. Armstrong 2000, "A new computational model of friction applied to haptic
//! rendering"): displacement is the sum of an elastic strain z and a plastic slide w, with
//!
//! ```text
//! dw = alpha(z) z |dx|,    alpha = 1 / z_max for all z: Dahl's model
//! ```
//!
//! Here `z = S - G` and w is the god-object's place. What stops the drift is that alpha vanishes for
//! small strains. They leave its shape open and give `z^8 / (z_stick^8 + z^8) / z_max` as an example,
//! which is small but nowhere zero. This one is exactly zero up to `z_stick`, so that no drift is
//! zero drift, and then straight:
//!
//! ```text
//! alpha(z) = 0                                                for |z| <= z_stick
//!          = (|z| - z_stick) / (z_max - z_stick) / z_max      up to z_max
//! ```
//!
//! with `z_max = mu * load`, `z_stick = stick_fraction * z_max`. Per tick, implicit, the strain is
//! the positive solution of a quadratic equation.
//!
//! Noise and bias: a bias b in noise of standard deviation s is borne for ever while the strain stays below `z_stick`, so
//! for three minutes at 1 kHz while `stick_fraction mu load > b + 5 s`, about. Noise that reaches farther takes the excess
//! away bit by bit, until it reaches no farther or the bias is gone. In the noise of Melder ch. 8.1, test 3 (5 mm deep,
//! s = 0.2 mm) and a bias of 0.4 mm, with `mu = 0.3`: a stick fraction of 0.5 (0.75 mm) loses two thirds to all of the bias in
//! three minutes, 0.9 (1.35 mm) less than a tenth, and Coulomb friction, which bears 1.5 mm, nothing. The smooth alpha of the paper,
//! which is nowhere zero, loses all of it within ten seconds at 0.5. This is the model's, not the tick's: its equation
//! integrated in steps a hundred times as short loses as much (`tests/all/friction_drift.rs`).
//!
//! Invariants: `|F_t| <= mu N`; while the strain is within `z_stick` it holds. Cost: one square root; no memory.

use super::sliding::within;
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery};

/// Hayward and Armstrong's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HaywardArmstrong {
    mu: f64,
    stick_fraction: f64,
}

impl HaywardArmstrong {
    /// Friction coefficient of steady sliding, and the part of it that is borne without any slide.
    ///
    /// Errors: `mu` not finite or negative, `stick_fraction` not in 0 to 1, 1 excluded.
    pub fn new(mu: f64, stick_fraction: f64) -> Result<Self, ParameterError> {
        at_least_zero("mu", mu)?;
        if !(0.0..1.0).contains(&stick_fraction) {
            let (parameter, allowed) = ("stick_fraction", "a number >= 0 and < 1");
            return Err(ParameterError::OutOfRange { parameter, value: stick_fraction, allowed });
        }
        Ok(Self { mu, stick_fraction })
    }

    /// The strain that a gap of `before_m` keeps after the HIP has moved by `path_m`: the solution z of
    /// `before = z + path alpha(z) z`.
    fn strain_m(&self, before_m: f64, path_m: f64, z_max_m: f64) -> f64 {
        let z_stick_m = self.stick_fraction * z_max_m;
        let a = path_m / (z_max_m * (z_max_m - z_stick_m));
        if before_m <= z_stick_m || !a.is_finite() {
            return before_m.min(z_max_m);
        }
        let half = 0.5 * (1.0 - a * z_stick_m);
        let root = (half * half + a * before_m).sqrt();
        // Two forms of the same number, each without cancellation.
        let z_m = if half > 0.0 { before_m / (half + root) } else { (root - half) / a };
        z_m.min(z_max_m)
    }
}

impl FrictionLaw for HaywardArmstrong {
    fn holds(&self, query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        self.mu > 0.0 && query.gap_m <= self.stick_fraction * self.mu * query.load_m
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        let z_max_m = self.mu * query.load_m;
        if z_max_m.is_nan() || z_max_m <= 0.0 {
            return query.gap_m;
        }
        let strain_m = self.strain_m(query.gap_m + query.travel_m, query.hip_travel_m, z_max_m);
        within(z_max_m, query.gap_m - strain_m, query)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.mu * query.load_m
    }
}
