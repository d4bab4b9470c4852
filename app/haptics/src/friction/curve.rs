//! Friction drawn as a curve against speed: points, with straight lines between them.
//!
//! Model (Melder ch. 4.1.2, "arbitrarily complex friction models"): friction force over normal force
//! is interpolated between the points and stays at the last one's value beyond it. It holds up to
//! `mu_s * load`. The slide solves `D - x = L mu(x / dt)` exactly, segment by segment; of several
//! solutions it takes the first one met from the speed before (see [`super::sliding`]).
//!
//! Sticking again: a curve without fall, `mu_s` being its first value, holds wherever the gap allows,
//! as Coulomb friction does. Else it sticks where it no longer slides even with the margin of
//! [`RESTICK_MARGIN`] on its lowest value.
//!
//! Invariants: `|F_t| <= N max(mu_s, mu)`. Cost: linear in the points, of which there are at most
//! [`MAX_CURVE_POINTS`]; nothing is allocated after construction.

use super::RESTICK_MARGIN;
use super::sliding::{ON_THE_CURVE, knows_time, remember_speed, start_m, within};
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use std::sync::Arc;

/// A piecewise linear curve of friction against speed.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionCurve {
    mu_s: f64,
    /// Speed (m/s) and ratio.
    points: Arc<[(f64, f64)]>,
    lowest: f64,
}

/// The most points of a curve.
pub const MAX_CURVE_POINTS: usize = 64;

impl FrictionCurve {
    /// Static coefficient, then speeds (m/s) with the ratio at each.
    ///
    /// Errors: no point or too many; a first speed other than 0, or a speed not above the one before;
    /// a ratio not finite or negative; `mu_s` below the first ratio.
    pub fn new(mu_s: f64, points: &[(f64, f64)]) -> Result<Self, ParameterError> {
        if points.is_empty() || points.len() > MAX_CURVE_POINTS {
            let (parameter, value) = ("number of points", points.len() as f64);
            return Err(ParameterError::OutOfRange { parameter, value, allowed: "1 to 64" });
        }
        let mut before = None;
        for (index, &(speed_m_s, mu)) in points.iter().enumerate() {
            check_point(before, speed_m_s, mu).map_err(|allowed| ParameterError::CurvePoint {
                index,
                speed_m_s,
                mu,
                allowed,
            })?;
            before = Some(speed_m_s);
        }
        if at_least_zero("mu_s", mu_s)? < points[0].1 {
            return Err(ParameterError::StaticBelowDynamic { mu_s, mu_d: points[0].1 });
        }
        let lowest = points.iter().map(|&(_, mu)| mu).fold(f64::INFINITY, f64::min);
        Ok(Self { mu_s, points: points.into(), lowest })
    }

    /// Friction force over normal force at this speed (m/s).
    pub fn ratio_at(&self, speed_m_s: f64) -> f64 {
        let speed_m_s = speed_m_s.abs();
        let segment = self.points.iter().rposition(|&(v, _)| v <= speed_m_s).unwrap_or(0);
        let (v, mu) = self.points[segment];
        mu + self.slope(segment) * (speed_m_s - v)
    }

    /// Static coefficient.
    pub fn mu_s(&self) -> f64 {
        self.mu_s
    }

    /// Speeds (m/s) and ratios.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// Of the segment after this point (s/m).
    fn slope(&self, segment: usize) -> f64 {
        let (v, mu) = self.points[segment];
        self.points.get(segment + 1).map_or(0.0, |&(v_next, mu_next)| (mu_next - mu) / (v_next - v))
    }

    /// What the spring pulls more than friction holds, had the god-object this point's speed (m).
    fn excess_at(&self, point: usize, query: &FrictionQuery) -> f64 {
        let (v, mu) = self.points[point];
        query.gap_m - (v * query.dt_s - query.travel_m) - query.load_m * mu
    }

    /// Exact within a segment, whose excess falls wherever a solution is looked for.
    fn solve(&self, segment: usize, query: &FrictionQuery) -> f64 {
        let (v, mu) = self.points[segment];
        let slope = self.slope(segment);
        let load_per_travel = slope * query.load_m / query.dt_s;
        let at_rest_m = query.gap_m - (mu - slope * v) * query.load_m;
        (at_rest_m - load_per_travel * query.travel_m) / (1.0 + load_per_travel)
    }

    /// The move to the solution that a slider meets which has moved by `start_m`.
    fn first_met_from(&self, start_m: f64, query: &FrictionQuery) -> Option<f64> {
        let start_m_s = start_m / query.dt_s;
        let below = self.points.iter().rposition(|&(v, _)| v <= start_m_s).unwrap_or(0);
        let moved_m = start_m - query.travel_m;
        let is_sped_up = query.gap_m - moved_m - query.load_m * self.ratio_at(start_m_s) >= 0.0;
        let segment = if is_sped_up {
            (below..self.points.len() - 1).find(|&i| self.excess_at(i + 1, query) <= 0.0)
        } else {
            // Held at rest by less than it could bear, it stays.
            return (0..=below)
                .rev()
                .find(|&i| self.excess_at(i, query) >= 0.0)
                .map(|i| self.solve(i, query));
        };
        Some(self.solve(segment.unwrap_or(self.points.len() - 1), query))
    }

    /// Least gap at which any sliding is in balance (m).
    fn least_gap_m(&self, query: &FrictionQuery) -> f64 {
        let gaps = self.points.iter().map(|&(v, mu)| v * query.dt_s + mu * query.load_m);
        gaps.fold(f64::INFINITY, f64::min)
    }
}

fn check_point(before_m_s: Option<f64>, speed_m_s: f64, mu: f64) -> Result<(), &'static str> {
    let is_in_order = match before_m_s {
        None => speed_m_s == 0.0,
        Some(before_m_s) => speed_m_s > before_m_s && speed_m_s.is_finite(),
    };
    if !is_in_order {
        return Err("speeds that begin with 0 and increase");
    }
    if mu.is_finite() && mu >= 0.0 { Ok(()) } else { Err("a finite ratio >= 0") }
}

impl FrictionLaw for FrictionCurve {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        remember_speed(query, memory);
        let limit_m = self.held_limit_m(query, memory);
        let is_within = self.mu_s > 0.0 && query.gap_m <= limit_m;
        if !is_within || query.state == FrictionState::Stick || !knows_time(query) {
            return is_within;
        }
        let margin_m = RESTICK_MARGIN * self.lowest * query.load_m;
        let asked = FrictionQuery { gap_m: query.gap_m + margin_m, travel_m: 0.0, ..*query };
        self.least_gap_m(query) >= limit_m || self.first_met_from(start_m(&asked, memory), &asked).is_none()
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        if !knows_time(query) {
            return query.gap_m - self.points[0].1 * query.load_m;
        }
        if query.travel_m > 0.0 {
            let excess_m = query.gap_m - query.load_m * self.ratio_at(query.travel_m / query.dt_s);
            if excess_m.abs() <= ON_THE_CURVE * query.load_m {
                return excess_m;
            }
        }
        //= melder#4.8
        match self.first_met_from(start_m(query, memory), query) {
            Some(x) => x,
            // Friction that begins with zero holds nothing back on its way to S.
            None if self.points[0].1 == 0.0 => query.gap_m,
            None => within(self.held_limit_m(query, memory), -query.travel_m, query),
        }
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.mu_s * query.load_m
    }
}
