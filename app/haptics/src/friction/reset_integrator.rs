//! The reset integrator: the bristle model's force without its bonds.
//!
//! Model (D. A. Haessig and B. Friedland 1991): the strain of the contact integrates the velocity and
//! saturates at `z_0`. Below, a bond is assumed, which bears `(1 + a) k z` and damps the strain; once
//! it saturates, the bond is gone, and the force drops to `k z_0`. The moment that the motion
//! reverses, the strain falls below `z_0` and the bond is back.
//!
//! Mapped onto the god-object, whose stiffness does not change: `z_0 = mu_d * load` is the gap while
//! it slides; stuck it bears `mu_s * load`, which is `(1 + a) z_0`; it sticks again as soon as the gap
//! is below `z_0`, without the margin of stiction. So one tick in which an encoder does not count is
//! enough to stick, and the next break costs `mu_s` again: the model is meant for smooth positions.
//! The damping acts while stuck, along the motion of the HIP, within the same `mu_s N`.
//!
//! Invariant: `|F_t| <= mu_s N`. Cost: a few flops; no memory.

use super::lugre::strain_damping_m;
use crate::error::{ParameterError, at_least_zero, static_at_least};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};

/// The reset integrator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResetIntegrator {
    mu_s: f64,
    mu_d: f64,
    damping_n_s_per_m: f64,
}

impl ResetIntegrator {
    /// Static and dynamic coefficient, damping of the strain while stuck (N s/m), 0 for none.
    ///
    /// Errors: a value not finite or negative, or `mu_s < mu_d`.
    pub fn new(mu_s: f64, mu_d: f64, damping_n_s_per_m: f64) -> Result<Self, ParameterError> {
        static_at_least(mu_s, mu_d)?;
        at_least_zero("damping_n_s_per_m", damping_n_s_per_m)?;
        Ok(Self { mu_s, mu_d, damping_n_s_per_m })
    }
}

impl FrictionLaw for ResetIntegrator {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        match query.state {
            FrictionState::Stick => self.mu_s > 0.0 && query.gap_m <= self.held_limit_m(query, memory),
            FrictionState::Slip => query.gap_m < self.mu_d * query.load_m,
        }
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        query.gap_m - self.mu_d * query.load_m
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.mu_s * query.load_m
    }

    fn drag_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if query.state == FrictionState::Slip || self.damping_n_s_per_m == 0.0 {
            return 0.0;
        }
        // Stuck, the strain changes as fast as the HIP moves.
        strain_damping_m(
            self.damping_n_s_per_m,
            query.hip_speed_m_s(),
            self.held_limit_m(query, memory),
            query,
        )
    }
}
