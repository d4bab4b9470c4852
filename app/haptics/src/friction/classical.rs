//! The classical models: none, Coulomb, stiction, viscous, Coulomb plus viscous.
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

use super::RESTICK_MARGIN;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};

/// What the classical models have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Classical {
    pub(crate) mu_s: f64,
    pub(crate) mu_d: f64,
    pub(crate) mu_v_s_per_m: f64,
    /// Sticking again takes a margin, since it brings the static coefficient back.
    pub(crate) sticks_and_slips: bool,
}

impl Classical {
    pub(crate) fn smooth(mu: f64, mu_v_s_per_m: f64) -> Self {
        Self { mu_s: mu, mu_d: mu, mu_v_s_per_m, sticks_and_slips: false }
    }

    pub(crate) fn stiction(mu_s: f64, mu_d: f64) -> Self {
        Self { mu_s, mu_d, mu_v_s_per_m: 0.0, sticks_and_slips: true }
    }
}

impl FrictionLaw for Classical {
    fn holds(&self, query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        if self.sticks_and_slips && query.state == FrictionState::Slip {
            return caught_again(query, self.mu_d);
        }
        // A zero coefficient holds nothing, not even a gap of zero: the frictionless
        // god-object is recomputed each tick, as the classic one is.
        //= melder#4.2
        self.mu_s > 0.0 && query.gap_m <= self.mu_s * query.load_m
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        let coulomb_slide = query.gap_m - self.mu_d * query.load_m;
        if self.mu_v_s_per_m == 0.0 || query.dt_s.is_nan() || query.dt_s <= 0.0 {
            return coulomb_slide;
        }
        // Corrected: implicit in the speed of this very move.
        //= melder#4.8
        let load_per_travel = self.mu_v_s_per_m * query.load_m / query.dt_s;
        // In this order neither a short tick nor a long travel overflows.
        coulomb_slide / (1.0 + load_per_travel) - query.travel_m / (1.0 + 1.0 / load_per_travel)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        //= melder#4.1
        self.mu_s * query.load_m
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
    use crate::error::ParameterError;
    use crate::friction::Friction;

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
    fn a_sliding_contact_without_load_does_not_stick_again() {
        let law = Friction::stiction(0.7, 0.3).unwrap();
        assert!(!holds(&law, FrictionQuery { load_m: 0.0, ..query(FrictionState::Slip, 0.0) }));
    }

    #[test]
    fn where_time_is_unknown_speeds_count_as_zero() {
        let law = Friction::coulomb_viscous(0.3, 2.0).unwrap();
        for dt_s in [0.0, -1e-3, f64::NAN] {
            let asked = FrictionQuery { dt_s, travel_m: 1e-5, ..query(FrictionState::Slip, 4e-3) };
            assert_eq!(law.slide(&asked, &FrictionMemory::default()), 4e-3 - 0.3 * LOAD, "{dt_s} s");
        }
    }

    #[test]
    fn in_no_time_a_viscous_slide_takes_back_what_was_travelled() {
        let law = Friction::coulomb_viscous(2.0, 4e5).unwrap();
        for (dt_s, travel_m) in [(1e-300, 100.0), (1e-300, -100.0), (f64::MIN_POSITIVE, 1e-3)] {
            let asked = FrictionQuery { load_m: 100.0, dt_s, travel_m, ..query(FrictionState::Slip, 4e-3) };
            assert_eq!(law.slide(&asked, &FrictionMemory::default()), -travel_m, "{dt_s} s");
        }
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
