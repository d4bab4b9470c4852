//! LuGre friction: Dahl's strain with Stribeck's curve, damping and viscous friction.
//!
//! Model (C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky 1995):
//!
//! ```text
//! z' = v - |v| z / g(v),   g(v) = load (mu_d + (mu_s - mu_d) exp(-(v / v_s)^2))
//! F  = k z + sigma_1 z' + mu_v v N
//! ```
//!
//! Here the contact's stiffness k is the model's sigma_0, `z = S - G`, and v is the velocity of S,
//! which the HIP prescribes: so the falling curve needs no choice between solutions. Steady sliding
//! is on the Stribeck curve at every speed; a change of speed is followed over a path of about g, and
//! small motions are elastic with hysteresis.
//!
//! The damping of the strain and the viscous part are felt along the motion of the HIP, beside the
//! spring. `z'` is taken along that motion too, which it is unless the direction turns.
//!
//! On a curved surface the strain goes by the HIP's way along the tangent plane. In a ball of radius R at the depth d that is
//! shorter than the god-object's by d / R, so the bristle of a steady slide is longer than the curve's by R / (R - d): 5 % at
//! 5 mm in a ball of 0.1 m.
//!
//! Deviation: the damping is cut, which that of the model is not. It never lifts the dry part above `mu_s N`, since
//! a fast breakaway must not leave the cone, and it never drives: where `z'` is against the motion, as after a rise of
//! speed on the falling curve, it is left out.
//!
//! Like Dahl's it yields at every strain: it drifts under noise, and never reports sticking.
//!
//! Invariant: `|F_t| <= (mu_s + mu_v v) N`. Cost: two exponentials; no memory.

use super::dahl::yielded;
use super::sliding::within;
use super::stribeck::Stribeck;
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery};

/// The LuGre model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LuGre {
    steady: Stribeck,
    damping_n_s_per_m: f64,
}

impl LuGre {
    /// The Stribeck curve of steady sliding, and the damping of the strain, `sigma_1` (N s/m), 0 for
    /// none.
    ///
    /// Errors: a damping not finite or negative.
    pub fn new(steady: Stribeck, damping_n_s_per_m: f64) -> Result<Self, ParameterError> {
        at_least_zero("damping_n_s_per_m", damping_n_s_per_m)?;
        Ok(Self { steady, damping_n_s_per_m })
    }

    /// Friction force over normal force in steady sliding at this speed (m/s).
    pub fn ratio_at(&self, speed_m_s: f64) -> f64 {
        self.steady.ratio_at(speed_m_s)
    }

    /// g of the model (m).
    fn strain_limit_m(&self, query: &FrictionQuery) -> f64 {
        self.steady.dry_ratio_at(query.hip_speed_m_s()) * query.load_m
    }
}

impl FrictionLaw for LuGre {
    fn holds(&self, _query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        false
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        within(self.held_limit_m(query, memory), yielded(query, self.strain_limit_m(query)), query)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.steady.mu_s() * query.load_m
    }

    fn drag_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        let speed_m_s = query.hip_speed_m_s();
        let viscous_m = self.steady.mu_v_s_per_m() * speed_m_s * query.load_m;
        let limit_m = self.strain_limit_m(query);
        if self.damping_n_s_per_m == 0.0 || limit_m <= 0.0 {
            return viscous_m;
        }
        let strain_m_s = speed_m_s * (1.0 - query.gap_along_hip_m / limit_m);
        let damping_m =
            strain_damping_m(self.damping_n_s_per_m, strain_m_s, self.held_limit_m(query, memory), query);
        viscous_m + damping_m
    }
}

/// Damping of a strain along the motion of the HIP (m of spring), within what the contact can bear.
pub(super) fn strain_damping_m(
    damping_n_s_per_m: f64,
    strain_m_s: f64,
    limit_m: f64,
    query: &FrictionQuery,
) -> f64 {
    let asked_m = damping_n_s_per_m / query.stiffness_n_per_m * strain_m_s;
    let (gap_m, along_m) = (query.gap_m, query.gap_along_hip_m);
    // From the end of the strain along the motion to the rim of the circle.
    let room_m = ((limit_m - gap_m).max(0.0) * (limit_m + gap_m) + along_m * along_m).sqrt() - along_m;
    asked_m.min(room_m).max(0.0)
}
