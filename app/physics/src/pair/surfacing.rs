//! What two surfaces make of each other: stiffnesses in series, dampings added, friction the geometric mean.

use haptics::Entity;

use crate::pair_friction::PairFriction;

/// How a contact between entities answers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Response {
    /// A spring and a damper.
    #[default]
    Force,
    /// Velocities are reflected.
    Impulse {
        /// e, 0 to 1: how much of the approaching velocity comes back, where neither entity says.
        restitution: f64,
    },
}

/// What two surfaces make of each other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surfacing {
    /// Of each contact point \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Of each contact point \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// Ratios.
    pub friction: PairFriction,
    /// How it answers.
    pub response: Response,
}

impl Surfacing {
    /// Of two entities.
    pub fn between(a: &Entity, b: &Entity, response: Response) -> Self {
        let (k_a, k_b) = (a.stiffness_n_per_m, b.stiffness_n_per_m);
        Self {
            stiffness_n_per_m: k_a / (1.0 + k_a / k_b),
            damping_n_s_per_m: a.damping_n_s_per_m + b.damping_n_s_per_m,
            friction: PairFriction::between(&a.friction, &b.friction),
            response: response.between(a, b),
        }
    }
}
