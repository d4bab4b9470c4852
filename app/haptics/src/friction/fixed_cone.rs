//! A cone of fixed size: friction that does not depend on the normal force.
//!
//! Model (Melder ch. 9.1; the behaviour of S. E. Salcudean and T. D. Vlaar 1995): the friction circle
//! has the radius `f / k` however deep the HIP is. With a static force above the dynamic one it sticks
//! and slips as stiction does, with the margin of [`RESTICK_MARGIN`].
//!
//! A contact without any normal force has no friction: a circle of fixed size would hold a finger that
//! only just touches, and the force would jump from nothing. It jumps at the first pressure instead,
//! which is what such a model means.
//!
//! Invariant: `|F_t| <= static_n`. Cost: a few flops; no memory.

use super::RESTICK_MARGIN;
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};

/// Friction of a fixed force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedCone {
    friction_n: f64,
    static_n: f64,
}

impl FixedCone {
    /// Force while it slides (N), and force that it takes to break away (N), if that is more.
    ///
    /// Errors: a value not finite or negative, or `static_n < friction_n`.
    pub fn new(friction_n: f64, static_n: Option<f64>) -> Result<Self, ParameterError> {
        at_least_zero("friction_n", friction_n)?;
        let static_n = static_n.unwrap_or(friction_n);
        if at_least_zero("static_n", static_n)? < friction_n {
            let (parameter, allowed) = ("static_n", "a finite number >= friction_n");
            return Err(ParameterError::OutOfRange { parameter, value: static_n, allowed });
        }
        Ok(Self { friction_n, static_n })
    }
}

impl FrictionLaw for FixedCone {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        if query.state == FrictionState::Slip && self.static_n > self.friction_n {
            return query.gap_m < (1.0 - RESTICK_MARGIN) * radius_m(self.friction_n, query);
        }
        self.static_n > 0.0 && query.gap_m <= self.held_limit_m(query, memory)
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        query.gap_m - radius_m(self.friction_n, query)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        radius_m(self.static_n, query)
    }
}

/// Radius of the friction circle (m).
fn radius_m(force_n: f64, query: &FrictionQuery) -> f64 {
    if query.load_m > 0.0 { force_n / query.stiffness_n_per_m } else { 0.0 }
}
