//! The friction models with a closed form: none, Coulomb, stiction, viscous, Coulomb plus viscous.
//!
//! Problem: the friction circle of radius `mu * load` decides whether a god-object holds; with
//! viscous friction the circle grows with the speed of the very motion that it decides about.
//!
//! Model: two coefficients for holding and sliding (Melder ch. 4.1.1) and a viscous term. The
//! printed eq. 4.8, `mu_vd = mu_d + mu_v s` with the speed of the *last* tick, chatters as soon as
//! `mu_v d / dt > 1/2`. Corrected: the speed is that of the move being computed. With D the gap, L
//! the load, m the travel so far and x the move asked for,
//!
//! ```text
//! D - x = L (mu_d + mu_v (m + x) / dt)   =>   x = (D - L (mu_d + mu_v m / dt)) / (1 + mu_v L / dt)
//! ```
//!
//! which is unique, exact and stable for every `mu_v >= 0`: the gap relaxes geometrically towards
//! `L (mu_d + mu_v v)` with the ratio `c / (1 + c) < 1`, `c = mu_v L / dt`.
//!
//! Invariants: a frictionless law never holds, so that its god-object is the classic one, tick by
//! tick. Cost: a few flops; no state.

use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use crate::shared::Shared;
use std::sync::Arc;

/// How far below the dynamic friction circle a sliding contact must relax before it sticks again,
/// as a fraction (the epsilon of Melder eq. 7.35).
///
/// It should be about one encoder step over `mu_d * depth`: 2 % is 30 um at 5 mm depth and
/// mu_d = 0.3, the step of a desktop device. A smaller one re-sticks whenever the encoder happens
/// not to move during one tick.
pub const RESTICK_MARGIN: f64 = 0.02;

/// Friction of an entity. The constructors refuse parameters outside their range.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Friction {
    /// No friction: the classic god-object.
    #[default]
    None,
    /// One coefficient for holding and sliding.
    Coulomb {
        /// Friction coefficient, >= 0.
        mu: f64,
    },
    /// Stick-slip: it takes more to break away than to keep sliding.
    Stiction {
        /// Static coefficient, >= `mu_d`.
        mu_s: f64,
        /// Dynamic coefficient, >= 0.
        mu_d: f64,
    },
    /// Friction proportional to normal force and speed; never holds.
    Viscous {
        /// Viscous coefficient \[s/m\], >= 0.
        mu_v_s_per_m: f64,
    },
    /// Coulomb friction that grows with speed.
    CoulombViscous {
        /// Friction coefficient at rest, >= 0.
        mu: f64,
        /// Viscous coefficient \[s/m\], >= 0.
        mu_v_s_per_m: f64,
    },
    /// Somebody's own law.
    Own(Shared<dyn OwnLaw>),
}

/// A [`FrictionLaw`] that an entity can share between threads.
pub trait OwnLaw: FrictionLaw + std::fmt::Debug + Send + Sync {}

impl<L: FrictionLaw + std::fmt::Debug + Send + Sync> OwnLaw for L {}

impl Friction {
    /// Coulomb friction. Errors: `mu` not finite or negative.
    pub fn coulomb(mu: f64) -> Result<Self, ParameterError> {
        Self::Coulomb { mu }.validated()
    }

    /// Stick-slip friction. Errors: a value not finite or negative, or `mu_s < mu_d`.
    pub fn stiction(mu_s: f64, mu_d: f64) -> Result<Self, ParameterError> {
        Self::Stiction { mu_s, mu_d }.validated()
    }

    /// Viscous friction. Errors: a value not finite or negative.
    pub fn viscous(mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Self::Viscous { mu_v_s_per_m }.validated()
    }

    /// Coulomb plus viscous friction. Errors: a value not finite or negative.
    pub fn coulomb_viscous(mu: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Self::CoulombViscous { mu, mu_v_s_per_m }.validated()
    }

    /// Somebody's own law.
    pub fn own(law: impl OwnLaw + 'static) -> Self {
        let law: Arc<dyn OwnLaw> = Arc::new(law);
        Self::Own(law.into())
    }

    /// The same friction, if its parameters are in range; for values built without a constructor.
    pub fn validated(self) -> Result<Self, ParameterError> {
        match &self {
            Self::None | Self::Own(_) => {}
            Self::Coulomb { mu } => _ = at_least_zero("mu", *mu)?,
            Self::Stiction { mu_s, mu_d } => {
                at_least_zero("mu_s", *mu_s)?;
                at_least_zero("mu_d", *mu_d)?;
                if mu_s < mu_d {
                    return Err(ParameterError::StaticBelowDynamic { mu_s: *mu_s, mu_d: *mu_d });
                }
            }
            Self::Viscous { mu_v_s_per_m } => _ = at_least_zero("mu_v_s_per_m", *mu_v_s_per_m)?,
            Self::CoulombViscous { mu, mu_v_s_per_m } => {
                at_least_zero("mu", *mu)?;
                at_least_zero("mu_v_s_per_m", *mu_v_s_per_m)?;
            }
        }
        Ok(self)
    }

    /// (mu_s, mu_d, mu_v), of which every variant is a special case.
    fn coefficients(&self) -> (f64, f64, f64) {
        match *self {
            Self::None | Self::Own(_) => (0.0, 0.0, 0.0),
            Self::Coulomb { mu } => (mu, mu, 0.0),
            Self::Stiction { mu_s, mu_d } => (mu_s, mu_d, 0.0),
            Self::Viscous { mu_v_s_per_m } => (0.0, 0.0, mu_v_s_per_m),
            Self::CoulombViscous { mu, mu_v_s_per_m } => (mu, mu, mu_v_s_per_m),
        }
    }
}

impl FrictionLaw for Friction {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        if let Self::Own(law) = self {
            return law.holds(query, memory);
        }
        let (mu_s, mu_d, _) = self.coefficients();
        match (self, query.state) {
            (Self::Stiction { .. }, FrictionState::Slip) => caught_again(query, mu_d),
            // A zero coefficient holds nothing, not even a gap of zero: the frictionless
            // god-object is recomputed each tick, as the classic one is.
            //= melder#4.2
            _ => mu_s > 0.0 && query.gap_m <= mu_s * query.load_m,
        }
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if let Self::Own(law) = self {
            return law.slide(query, memory);
        }
        let (_, mu_d, mu_v) = self.coefficients();
        let coulomb_slide = query.gap_m - mu_d * query.load_m;
        if mu_v == 0.0 || query.dt_s.is_nan() || query.dt_s <= 0.0 {
            return coulomb_slide;
        }
        // Corrected: implicit in the speed of this very move.
        //= melder#4.8
        let load_per_travel = mu_v * query.load_m / query.dt_s;
        (coulomb_slide - load_per_travel * query.travel_m) / (1.0 + load_per_travel)
    }

    fn held_limit_m(&self, query: &FrictionQuery) -> f64 {
        if let Self::Own(law) = self {
            return law.held_limit_m(query);
        }
        //= melder#4.1
        self.coefficients().0 * query.load_m
    }

    fn drag_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if let Self::Own(law) = self { law.drag_m(query, memory) } else { 0.0 }
    }
}

/// Melder eq. 7.34-7.36, corrected: the printed inequality points the other way, and its absolute
/// epsilon never lets small coefficients stick again. Squared, so that no angle is needed.
fn caught_again(query: &FrictionQuery, mu_d: f64) -> bool {
    //= melder#7.34
    //= melder#7.35
    //= melder#7.36
    let threshold = (1.0 - RESTICK_MARGIN) * mu_d * query.load_m;
    query.gap_m * query.gap_m < threshold * threshold
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOAD: f64 = 5e-3;

    fn query(state: FrictionState, gap_m: f64) -> FrictionQuery {
        FrictionQuery { state, gap_m, load_m: LOAD, dt_s: 1e-3, ..Default::default() }
    }

    fn holds(law: &Friction, query: FrictionQuery) -> bool {
        law.holds(&query, &mut FrictionMemory::default())
    }

    #[test]
    fn constructors_refuse_what_no_material_has() {
        for bad in [-1e-9, f64::NAN, f64::INFINITY] {
            assert!(Friction::coulomb(bad).is_err());
            assert!(Friction::stiction(bad, 0.1).is_err());
            assert!(Friction::stiction(0.1, bad).is_err());
            assert!(Friction::viscous(bad).is_err());
            assert!(Friction::coulomb_viscous(0.1, bad).is_err());
            assert!(Friction::coulomb_viscous(bad, 0.1).is_err());
        }
        let expected = ParameterError::StaticBelowDynamic { mu_s: 0.2, mu_d: 0.3 };
        assert_eq!(Friction::stiction(0.2, 0.3), Err(expected));
        assert!(Friction::stiction(0.3, 0.3).is_ok());
    }

    #[test]
    //= melder#4.2 type=test
    fn the_friction_circle_is_mu_times_the_load() {
        let law = Friction::coulomb(0.5).unwrap();
        assert!(holds(&law, query(FrictionState::Stick, 0.5 * LOAD)));
        assert!(!holds(&law, query(FrictionState::Stick, 0.5 * LOAD * (1.0 + 1e-15))));
    }

    #[test]
    //= melder#7.34 type=test
    //= melder#7.35 type=test
    //= melder#7.36 type=test
    fn a_sliding_contact_sticks_again_only_clearly_inside_the_dynamic_circle() {
        let law = Friction::stiction(0.7, 0.3).unwrap();
        let rim = 0.3 * LOAD;
        assert!(holds(&law, query(FrictionState::Slip, 0.979 * rim)));
        assert!(!holds(&law, query(FrictionState::Slip, 0.981 * rim)));
        assert!(
            law.slide(&query(FrictionState::Slip, 0.981 * rim), &FrictionMemory::default()) < 0.0,
            "inside, hence unmoved"
        );
        assert!(holds(&law, query(FrictionState::Stick, 0.7 * LOAD)), "held, it bears the static limit");
    }

    #[test]
    fn small_coefficients_stick_again_too() {
        let law = Friction::stiction(1e-4, 1e-5).unwrap();
        assert!(holds(&law, query(FrictionState::Slip, 0.9e-5 * LOAD)));
    }

    #[test]
    fn without_friction_nothing_holds() {
        for law in [Friction::None, Friction::coulomb(0.0).unwrap(), Friction::viscous(2.0).unwrap()] {
            assert!(!holds(&law, query(FrictionState::Stick, 0.0)));
        }
    }

    #[test]
    //= melder#4.8 type=test
    fn the_viscous_slide_solves_its_implicit_equation() {
        for mu_v in [1e-3, 1.0, 1e3, 1e6] {
            let law = Friction::coulomb_viscous(0.3, mu_v).unwrap();
            let asked = FrictionQuery { travel_m: 2e-5, ..query(FrictionState::Slip, 4e-3) };
            let x = law.slide(&asked, &FrictionMemory::default());
            let left = 4e-3 - x;
            let right = LOAD * (0.3 + mu_v * (2e-5 + x) / 1e-3);
            // The subtraction of two terms of size mu_v L m / dt leaves their rounding.
            let tolerance = 4.0 * f64::EPSILON * (4e-3 + mu_v * LOAD * 2e-5 / 1e-3);
            assert!((left - right).abs() <= tolerance, "mu_v {mu_v}: {left} vs {right}");
        }
    }
}
