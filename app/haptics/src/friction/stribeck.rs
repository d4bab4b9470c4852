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
//! Where the curve falls faster than `L |mu'| = dt / 2`, no steady slide at constant HIP speed is
//! stable, as no slider without mass on a spring is: the contact sticks and slips by turns, as dry
//! bearings do. Every tick of it is on the curve all the same.
//!
//! Search: in units `u = x / (v_s dt)` the solutions are the zeros of `h(u) = p - q u - r exp(-u^2)`.
//! Up to `u = 1 / sqrt(2)` it is convex, and a zero at which it falls is met by Newton's steps from 0;
//! beyond it is concave, and one is met from `p / q` downwards. Neither can pass its zero, and where a
//! step comes to a rise or to the other part, there was none.
//!
//! Invariants: `|F_t| <= (mu_s + mu_v v) N`. Cost: at most three searches of [`MAX_STEPS`] steps, in
//! general of five, each with one exponential; the flatter the touch of two solutions, the longer.

use super::RESTICK_MARGIN;
use super::classical::Classical;
use super::sliding::{ON_THE_CURVE, knows_time, remember_speed, start_m, within};
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
        let is_within = self.mu_s > 0.0 && query.gap_m <= self.held_limit_m(query, memory);
        if !is_within || query.state == FrictionState::Stick || self.flat().is_some() || !knows_time(query) {
            return is_within;
        }
        // The least at which a slide goes on, if that is less than what rest can bear.
        let margin_m = RESTICK_MARGIN * self.mu_d * query.load_m;
        let gap_m = (query.gap_m + margin_m).min(self.held_limit_m(query, memory));
        self.balance(&FrictionQuery { gap_m, travel_m: 0.0, ..*query }).far_solution().is_none()
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if let Some(classical) = self.flat() {
            return classical.slide(query, memory);
        }
        if !knows_time(query) || query.load_m <= 0.0 {
            return query.gap_m - self.mu_s * query.load_m;
        }
        //= melder#4.8
        let balance = self.balance(query);
        let excess_m = query.gap_m - query.load_m * self.ratio_at(query.travel_m / query.dt_s);
        if query.travel_m > 0.0 && excess_m.abs() <= ON_THE_CURVE * query.load_m {
            return excess_m;
        }
        match balance.first_met_from(start_m(query, memory) / balance.unit_m) {
            Some(u) => u * balance.unit_m - query.travel_m,
            None => within(self.held_limit_m(query, memory), -query.travel_m, query),
        }
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
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
    /// `h` and its slope.
    fn at(&self, u: f64) -> (f64, f64) {
        let fall = self.r * (-u * u).exp();
        (self.p - self.q * u - fall, 2.0 * u * fall - self.q)
    }

    /// The solution that a slider meets which has moved by `start`; `None` if it comes to rest.
    fn first_met_from(&self, start: f64) -> Option<f64> {
        let (pull, slope) = self.at(start);
        let is_beyond = start > FRAC_1_SQRT_2;
        if pull >= 0.0 {
            // Past where the pull begins to grow, nothing stops it before the far solution.
            let is_past_near = is_beyond || slope > 0.0;
            let near = if is_past_near { None } else { self.near_solution() };
            return near.or_else(|| self.far_solution()).or_else(|| self.near_solution());
        }
        let far = if is_beyond && slope <= 0.0 { self.far_solution() } else { None };
        far.or_else(|| self.near_solution())
    }

    /// From 0 upwards, where `h` is convex.
    fn near_solution(&self) -> Option<f64> {
        let mut u = 0.0;
        if self.at(u).0 < 0.0 {
            return None;
        }
        for _ in 0..MAX_STEPS {
            let (pull, slope) = self.at(u);
            if pull <= 0.0 {
                break;
            }
            let step = -pull / slope;
            // Also if it is not a number.
            if !(step > 0.0 && u + step <= FRAC_1_SQRT_2) {
                return None;
            }
            u += step;
            if step <= 2.0 * f64::EPSILON * u {
                break;
            }
        }
        Some(u)
    }

    /// From where there would be no fall left downwards, where `h` is concave.
    fn far_solution(&self) -> Option<f64> {
        let mut u = self.p / self.q;
        for _ in 0..MAX_STEPS {
            let (pull, slope) = self.at(u);
            if !(slope < 0.0 && (FRAC_1_SQRT_2..f64::INFINITY).contains(&u)) {
                return None;
            }
            let step = pull / slope;
            if pull >= 0.0 || step <= 2.0 * f64::EPSILON * u {
                break;
            }
            u -= step;
        }
        Some(u)
    }
}

/// Where two solutions all but meet, each step only halves the distance: 64 reach rounding.
const MAX_STEPS: u32 = 64;
