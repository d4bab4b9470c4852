//! Karnopp's friction: stuck within a band of speeds around zero, Coulomb and viscous outside.
//!
//! Model (D. Karnopp 1985; for haptics S. E. Salcudean and T. D. Vlaar 1995; Melder eq. 3.1-3.2): while
//! stuck, the spring between god-object and HIP bears `|f_stick| <= mu_s N`. Beyond it slips with
//! `mu_d N + mu_v v N`, and sticks again when the speed has fallen to `v_min` or below, wherever the
//! spring is by then, if that is less than it can bear.
//!
//! Corrected: the printed test compares `f_stick` without taking its magnitude, and the printed slip
//! state has no Coulomb force at all.
//!
//! The speed is that of the HIP along the surface, the measured one, for which the band was made: the
//! god-object's own speed is never in doubt and would need none. Dragged more slowly than `v_min` the
//! contact sticks and slips by turns. Measured with an encoder, a speed is zero or one step over a tick at least (0.03 mm
//! in a millisecond are 30 mm/s): a `v_min` below that is never seen, and the contact sticks in each tick in which the
//! encoder does not count, whatever `v_min` is. Where the length of a tick is unknown, every speed is zero.
//!
//! Invariant: `|F_t| <= (mu_s + mu_v v) N`. Cost: a few flops; no memory.

use super::classical::Classical;
use crate::error::{ParameterError, above_zero, at_least_zero, static_at_least};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};

/// Karnopp's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Karnopp {
    mu_s: f64,
    v_min_m_s: f64,
    slip: Classical,
}

impl Karnopp {
    /// Static and dynamic coefficient, half width of the band (m/s, above zero), viscous coefficient
    /// (s/m).
    ///
    /// Errors: a value out of range, or `mu_s < mu_d`.
    pub fn new(mu_s: f64, mu_d: f64, v_min_m_s: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        static_at_least(mu_s, mu_d)?;
        above_zero("v_min_m_s", v_min_m_s)?;
        at_least_zero("mu_v_s_per_m", mu_v_s_per_m)?;
        Ok(Self { mu_s, v_min_m_s, slip: Classical::smooth(mu_d, mu_v_s_per_m) })
    }

    /// Friction force over normal force while it slips at this speed (m/s).
    pub fn ratio_at(&self, speed_m_s: f64) -> f64 {
        self.slip.mu_d + self.slip.mu_v_s_per_m * speed_m_s.abs()
    }
}

impl FrictionLaw for Karnopp {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        //= melder#3.1
        let is_slow = query.state == FrictionState::Stick || query.hip_speed_m_s() <= self.v_min_m_s;
        // A gap is a magnitude.
        //= melder#3.2
        is_slow && self.mu_s > 0.0 && query.gap_m <= self.held_limit_m(query, memory)
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        self.slip.slide(query, memory)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.mu_s * query.load_m
    }
}
