//! Dahl's friction: a strain that yields as it grows.
//!
//! Model (P. R. Dahl 1968, 1976): the strain z of the contact follows
//!
//! ```text
//! z' = v - |v| z / z_max,    z_max = mu * load
//! ```
//!
//! and the friction force is stiffness times strain. Dahl's own formula has the exponent i of
//! `(1 - z / z_max sgn v)^i` for a parameter, which tells brittle materials from ductile ones; here it is 1, which
//! most who use the model choose, and for which a tick has a closed form. Here the contact's own spring is that stiffness:
//! `z = S - G`, and v is the velocity of S, which the HIP prescribes. From rest the force rises as
//! `mu N (1 - exp(-s / z_max))` over the path s; reversing, it falls along another branch: a loop.
//!
//! Per tick, implicit: `z (1 + r) = z_before + dS`, `r = |dS| / z_max`, that is a slide of
//! `D r / (1 + r)` from the gap D. It meets `z_max` and never passes it, whatever the step.
//!
//! Known and shown in the tests: any vibration makes it creep under any bias, since it yields at
//! every strain; Hayward and Armstrong's model ([`super::HaywardArmstrong`]) exists because of that.
//! It has no stuck state and so never reports one.
//!
//! Invariant: `|F_t| <= mu N`; when the load falls below what the strain asks for, the god-object
//! slides. Cost: a few flops; no memory.

use super::sliding::within;
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery};

/// Dahl's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dahl {
    mu: f64,
}

impl Dahl {
    /// Friction coefficient of steady sliding. Errors: not finite or negative.
    pub fn new(mu: f64) -> Result<Self, ParameterError> {
        Ok(Self { mu: at_least_zero("mu", mu)? })
    }
}

impl FrictionLaw for Dahl {
    fn holds(&self, _query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        false
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        let limit_m = self.mu * query.load_m;
        // When the load falls, what the strain asks for may be more than can be borne.
        within(limit_m, yielded(query, limit_m), query)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.mu * query.load_m
    }
}

/// How far the god-object still has to move for a strain that yields towards `z_max` (m):
/// `(r gap - travel) / (1 + r)` with numerator and denominator times `z_max`, which may be zero.
pub(super) fn yielded(query: &FrictionQuery, z_max_m: f64) -> f64 {
    if z_max_m.is_nan() || z_max_m <= 0.0 {
        return query.gap_m;
    }
    let yields = query.hip_travel_m / (z_max_m + query.hip_travel_m);
    query.gap_m * yields - query.travel_m * (1.0 - yields)
}
