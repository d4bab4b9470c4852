//! A disc that spins about its axis and is turned a little: by what each tick stretches its lean.
//!
//! Problem: this is where the gyroscopic term of the thesis (eq. 5.15, 8.1) shut the simulation down (ch. 8.2.6).
//! Model: moments J3 about the axis and J across; spin s. Seen from the disc, what is across turns at
//! `lambda = s (J3 - J) / J`. Euler's method stretches it by `sqrt(1 + (lambda dt)^2)` a tick; with the printed term, which
//! lost its J, lambda is `1 / J3` times as large. The thesis' matrix of a small angle stretches the axis by
//! `sqrt(1 + (s dt)^2)` besides. Where the angular momentum is carried the lean stays.

#![allow(non_snake_case)] // Names carry their frame.

use super::spin::{FreeBody, NO_LIMIT};
use nalgebra::Vector3;
use physics::Integrator;

/// Across the axis, and along (kg m^2): 100 g.
const ACROSS: f64 = 1e-4;
const ALONG: f64 = 1.7e-4;
/// How far it leans at first, as a share of its spin.
const FIRST_LEAN: f64 = 1e-9;
/// Beyond this the axis follows, and the closed form no longer is one.
const LAST_LEAN: f64 = 1e-3;
const MOST_TICKS: u32 = 1000;

/// What a tick makes of the lean, measured; `None`: nothing was measured.
pub fn growth(integrator: Integrator, spin_rad_s: f64, dt_s: f64) -> Option<f64> {
    let omega = Vector3::new(FIRST_LEAN * spin_rad_s, 0.0, spin_rad_s);
    let mut disc = FreeBody::new(integrator, [ACROSS, ACROSS, ALONG], omega, NO_LIMIT)?;
    let first = lean(&disc, spin_rad_s);
    let (mut is, mut ticks) = (first, 0);
    while ticks < MOST_TICKS && is < LAST_LEAN {
        disc.step(dt_s);
        is = lean(&disc, spin_rad_s);
        ticks += 1;
    }
    Some((is / first).powf(f64::from(ticks).recip()))
}

/// The same in theory.
pub fn growth_in_theory(integrator: Integrator, spin_rad_s: f64, dt_s: f64) -> f64 {
    let turn = spin_rad_s * (ALONG - ACROSS) / ACROSS * dt_s;
    let stretched = |turn: f64| turn.hypot(1.0);
    let axis = stretched(spin_rad_s * dt_s);
    match integrator {
        Integrator::Implicit | Integrator::Rk4 => 1.0,
        Integrator::ThesisEuler => axis,
        Integrator::ThesisEulerGyroscopic => axis * stretched(turn),
        Integrator::ThesisEulerPrinted => axis * stretched(turn / ALONG),
    }
}

fn lean(disc: &FreeBody, spin_rad_s: f64) -> f64 {
    let body = disc.body();
    let axis_W = body.orientation * Vector3::z();
    let omega_W = body.angular_velocity_W();
    (omega_W - axis_W * omega_W.dot(&axis_W)).norm() / spin_rad_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lean_grows_by_the_factor_of_theory_and_stays_where_momentum_is_carried() {
        for spin in [0.1, 1.0, 10.0, 100.0] {
            for (name, integrator) in Integrator::NAMES {
                let found = growth(integrator, spin, 1e-3).unwrap();
                let expected = growth_in_theory(integrator, spin, 1e-3);
                // Seven digits of a lean of a billionth; Runge and Kutta's is off by the fifth power of 0.1 rad.
                assert!((found / expected - 1.0).abs() < 1e-5, "{name}, {spin} rad/s: {found} {expected}");
            }
        }
        assert!(growth_in_theory(Integrator::ThesisEulerPrinted, 1.0, 1e-3) > 4.0);
    }
}
