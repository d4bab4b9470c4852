//! Stribeck friction: falls from the static coefficient as sliding sets in, then grows with speed.
//!
//! Model (R. Stribeck 1902; the exponential form of L. C. Bo and D. Pavelescu 1982, with the square
//! of B. Armstrong-Helouvry 1991): friction force over normal force is
//!
//! ```text
//! mu(v) = mu_d + (mu_s - mu_d) exp(-(v / v_s)^2) + mu_v v
//! ```
//!
//! It holds up to `mu_s * load`. The slide is implicit in the speed of its own move (Melder eq. 4.8,
//! corrected); of several solutions it takes the first one met from the speed before (see
//! [`super::sliding`]). Sliding, it sticks again where the falling curve no longer sustains a slide,
//! with the margin of [`RESTICK_MARGIN`]; with `v_s -> 0` all of this becomes stiction. A curve so
//! flat that no tick sees it jump (`L |mu'| < dt`) sticks and slides without any hysteresis.
//!
//! Where the curve falls faster than that, no quasi-static slider of any simulation is stable: at a
//! HIP speed there, the contact sticks and slips by turns, as dry bearings do.
//!
//! Search: in units `u = x / (v_s dt)` the solutions are the zeros of `h(u) = p - q u - r exp(-u^2)`,
//! which falls and is convex up to `u1`, rises up to `u2`, then falls and is concave. So Newton's
//! steps from 0 towards the near zero, and from `p / q` down to the far one, never pass it.
//!
//! Invariants: `|F_t| <= (mu_s + mu_v v) N`. Cost: at most four searches of [`MAX_STEPS`] steps, in
//! general of five.

use super::RESTICK_MARGIN;
use super::classical::Classical;
use super::sliding::{ON_THE_CURVE, knows_time, remember_speed, start_m};
use crate::error::{ParameterError, above_zero, at_least_zero, static_at_least};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use std::f64::consts::FRAC_1_SQRT_2;

/// The Stribeck curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck {
    mu_s: f64,
    mu_d: f64,
    v_s_m_s: f64,
    mu_v_s_per_m: f64,
}

impl Stribeck {
    /// Static coefficient, dynamic one, speed at which their difference has fallen to 1/e (m/s, above
    /// zero), viscous coefficient (s/m).
    ///
    /// Errors: a value out of range, or `mu_s < mu_d`.
    pub fn new(mu_s: f64, mu_d: f64, v_s_m_s: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        static_at_least(mu_s, mu_d)?;
        above_zero("v_s_m_s", v_s_m_s)?;
        at_least_zero("mu_v_s_per_m", mu_v_s_per_m)?;
        Ok(Self { mu_s, mu_d, v_s_m_s, mu_v_s_per_m })
    }

    /// Friction force over normal force at this speed (m/s).
    pub fn ratio_at(&self, speed_m_s: f64) -> f64 {
        self.dry_ratio_at(speed_m_s) + self.mu_v_s_per_m * speed_m_s.abs()
    }

    /// The same without the viscous part.
    pub(super) fn dry_ratio_at(&self, speed_m_s: f64) -> f64 {
        let u = speed_m_s / self.v_s_m_s;
        self.mu_d + (self.mu_s - self.mu_d) * (-u * u).exp()
    }

    pub(super) fn mu_s(&self) -> f64 {
        self.mu_s
    }

    pub(super) fn mu_v_s_per_m(&self) -> f64 {
        self.mu_v_s_per_m
    }

    /// Without a fall there is nothing to search.
    fn flat(&self) -> Option<Classical> {
        (self.mu_s == self.mu_d).then(|| Classical::smooth(self.mu_d, self.mu_v_s_per_m))
    }

    fn balance(&self, query: &FrictionQuery) -> Balance {
        let unit_m = self.v_s_m_s * query.dt_s;
        Balance {
            unit_m,
            p: query.gap_m + query.travel_m - self.mu_d * query.load_m,
            q: unit_m + self.mu_v_s_per_m * self.v_s_m_s * query.load_m,
            r: (self.mu_s - self.mu_d) * query.load_m,
        }
    }
}

impl FrictionLaw for Stribeck {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        remember_speed(query, memory);
        let is_within = self.mu_s > 0.0 && query.gap_m <= self.held_limit_m(query);
        if !is_within || query.state == FrictionState::Stick || self.flat().is_some() || !knows_time(query) {
            return is_within;
        }
        let balance = self.balance(query);
        // The gap below which no slide goes on, if that is less than what rest can bear.
        let Some((_, u2)) = balance.turning_points() else { return true };
        let least_m = self.mu_d * query.load_m + balance.q * u2 + balance.r * (-u2 * u2).exp();
        least_m >= self.held_limit_m(query)
            || query.gap_m < least_m - RESTICK_MARGIN * self.mu_d * query.load_m
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if let Some(classical) = self.flat() {
            return classical.slide(query, memory);
        }
        if !knows_time(query) {
            return query.gap_m - self.mu_s * query.load_m;
        }
        //= melder#4.8
        let balance = self.balance(query);
        let excess_m = balance.pull(query.travel_m / balance.unit_m);
        if query.travel_m > 0.0 && excess_m.abs() <= ON_THE_CURVE * query.load_m {
            return excess_m;
        }
        match balance.first_met_from(start_m(query, memory) / balance.unit_m) {
            Some(u) => u * balance.unit_m - query.travel_m,
            None => -query.travel_m,
        }
    }

    fn held_limit_m(&self, query: &FrictionQuery) -> f64 {
        self.mu_s * query.load_m
    }
}

/// Spring against friction after a move `u`, in units of `v_s dt`: `h(u) = p - q u - r exp(-u^2)` (m).
#[derive(Debug, Clone, Copy)]
struct Balance {
    unit_m: f64,
    p: f64,
    q: f64,
    r: f64,
}

impl Balance {
    fn pull(&self, u: f64) -> f64 {
        self.p - self.q * u - self.r * (-u * u).exp()
    }

    fn slope(&self, u: f64) -> f64 {
        2.0 * self.r * u * (-u * u).exp() - self.q
    }

    /// Where `h` begins to rise and where it falls again, if it rises at all: the solutions of
    /// `u exp(-u^2) = c`. Its logarithm is concave, hence Newton's steps from outside stay outside.
    fn turning_points(&self) -> Option<(f64, f64)> {
        let c = self.q / (2.0 * self.r);
        let height = (STEEPEST / c).ln();
        if c.is_nan() || c <= 0.0 || height.is_nan() || height <= 0.0 {
            return None;
        }
        let log_c = c.ln();
        let above = |u: f64| u.ln() - u * u - log_c;
        let slope = |u: f64| 1.0 / u - 2.0 * u;
        let u1 = newton(c, above, slope);
        // There the logarithm has sunk below `log_c`: its second derivative is below -2.
        let u2 = newton(FRAC_1_SQRT_2 + height.sqrt(), above, slope);
        Some((u1.min(FRAC_1_SQRT_2), u2.max(FRAC_1_SQRT_2)))
    }

    /// The solution that a slider meets which has moved by `start`; `None` if it comes to rest.
    fn first_met_from(&self, start: f64) -> Option<f64> {
        // A curve that only falls changes from convex to concave here, and all below holds for it too.
        let (u1, u2) = self.turning_points().unwrap_or((FRAC_1_SQRT_2, FRAC_1_SQRT_2));
        let has_near = self.pull(0.0) >= 0.0 && self.pull(u1) <= 0.0;
        let has_far = self.pull(u2) >= 0.0;
        let is_sped_up = self.pull(start) >= 0.0;
        let goes_far = if is_sped_up { start > u1 || !has_near } else { start >= u2 };
        if goes_far && has_far {
            let from = (self.p / self.q).max(u2);
            return Some(newton(from, |u| self.pull(u), |u| self.slope(u)).max(u2));
        }
        has_near.then(|| newton(0.0, |u| self.pull(u), |u| self.slope(u)).min(u1))
    }
}

/// Newton's steps from one side of a zero that they cannot pass, since the function bends away.
fn newton(from: f64, value: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> f64 {
    let mut u = from;
    let sign = value(u).signum();
    for _ in 0..MAX_STEPS {
        let value = value(u);
        let step = value / slope(u);
        if value * sign <= 0.0 || !step.is_finite() {
            break;
        }
        u -= step;
        if step.abs() <= 2.0 * f64::EPSILON * u.abs() {
            break;
        }
    }
    u
}

/// Where two solutions all but meet, each step only halves the distance: 64 reach rounding.
const MAX_STEPS: u32 = 64;

/// The largest value of `u exp(-u^2)`, at `1 / sqrt(2)`.
const STEEPEST: f64 = 0.428_881_942_480_353_4;
