//! What theory says of a case.
//!
//! - The sampled linear loop ([`super::linear`]): exact for this hand and arm, but for friction and encoder steps.
//! - Passivity (Colgate and Schenkel 1997): `K < (b - B) / (T/2 + td)`, with the arm's own viscous friction `b` and the
//!   wall's damping `B`, holds against any hand whatever, and so is far below what a given hand stands. Without delay it
//!   is the well-known `2 (b - B) / T`. For whole ticks of delay the condition is `b > K T/2 (1 + 2 cos w) - B cos 2w` at
//!   worst, which this implies; for a part `r` of a tick it is stricter by less than 8 %.
//! - With a hand that damps, roughly `K < (b + b1 + B) / (T/2 + td)`: the same phase against all damping there is.
//! - Friction against encoder steps (Abbott and Okamura 2005): below `2 f_c / count` the friction takes more than
//!   rounding a position can give, so no oscillation of some counts keeps itself up.

use super::case::{Case, Mode};
use super::linear::{Hand, Loop};
use super::search::{Found, Search};
use super::trial::{Bench, ROUND_TRIP_S};
use crate::outcome::RunFailure;
use nalgebra::{Vector2, Vector3};

/// All of it (N/m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Theory {
    /// The sampled linear loop's limit.
    pub linear: Found,
    /// Passive against any hand; zero: the wall's damping is more than the arm's own.
    pub passive: f64,
    /// Phase against damping, this hand's included.
    pub damped: f64,
    /// Friction against encoder steps.
    pub friction: f64,
}

impl Theory {
    /// Of a case.
    ///
    /// # Errors
    /// If the hand's model cannot be had.
    pub fn of(bench: &Bench, case: &Case) -> Result<Self, RunFailure> {
        let plant = &bench.plant;
        let hand = hand_along(bench, case)?;
        let (period_s, damping) = (case.period_s(), case.damping_n_s_per_m);
        let delay = match case.mode {
            Mode::SameTick => (0, ROUND_TRIP_S),
            Mode::FixedPhase => (0, 0.5 * period_s),
            Mode::NextTick => (1, ROUND_TRIP_S),
        };
        let system = Loop {
            mass_kg: plant.mass_kg,
            viscous_n_s_per_m: plant.viscous_n_s_per_m,
            amplifier_hz: plant.amplifier_hz,
            hand,
            damping_n_s_per_m: damping,
            period_s,
            delay,
        };
        let amplifier_s = 1.0 / (std::f64::consts::TAU * plant.amplifier_hz);
        let late_s = f64::from(delay.0) * period_s + delay.1 + amplifier_s;
        let lag_s = 0.5 * period_s + late_s;
        let held_by = hand.map_or(0.0, |hand| hand.grasp.y);
        Ok(Self {
            linear: limit(&system),
            passive: ((plant.viscous_n_s_per_m - damping) / lag_s).max(0.0),
            damped: (plant.viscous_n_s_per_m + held_by + damping) / lag_s,
            friction: 2.0 * plant.coulomb_n / plant.count_m,
        })
    }
}

fn limit(system: &Loop) -> Found {
    let mut search = Search::default();
    while let Some(stiffness) = search.next() {
        search.learn(stiffness, system.is_stable(stiffness));
    }
    search.found()
}

fn hand_along(bench: &Bench, case: &Case) -> Result<Option<Hand>, RunFailure> {
    let Some(model) = bench.hand_model(case)? else { return Ok(None) };
    let normal = bench.axis.normal();
    let along = |per_axis: Vector3<f64>| per_axis.dot(&normal);
    let spec = &model.impedance;
    Ok(Some(Hand {
        mass_kg: along(spec.mass_kg),
        grasp: Vector2::new(along(spec.grasp.stiffness_n_per_m), along(spec.grasp.damping_n_s_per_m)),
        arm: Vector2::new(along(spec.arm.stiffness_n_per_m), along(spec.arm.damping_n_s_per_m)),
    }))
}
