//! Properties of a contact between two surfaces: stiffness and damping of [`Contacts`], friction the geometric mean.

use haptics::Entity;

use crate::contacts::{ContactDamping, Contacts};
use crate::pair_friction::PairFriction;

/// How a contact between entities answers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Response {
    /// A spring and a damper.
    #[default]
    Force,
    /// The same; but where entities meet, the approaching velocity is reflected before the spring is pressed.
    Bounce {
        /// e, 0 to 1: how much of the approaching velocity comes back, where neither entity says.
        restitution: f64,
    },
    /// Velocities are reflected, and what rests is held without a spring.
    Impulse {
        /// e, 0 to 1: how much of the approaching velocity comes back, where neither entity says.
        restitution: f64,
    },
}

impl Response {
    /// True if a spring presses what rests.
    pub(crate) fn has_springs(self) -> bool {
        !matches!(self, Self::Impulse { .. })
    }

    /// Share of an approaching velocity that comes back; `None`: what the spring and its damper leave.
    pub(crate) fn restitution(self) -> Option<f64> {
        match self {
            Self::Force => None,
            Self::Bounce { restitution } | Self::Impulse { restitution } => Some(restitution),
        }
    }
}

/// What two surfaces make of each other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surfacing {
    /// Of each contact point \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Of each contact point.
    pub damping: ContactDamping,
    /// Ratios.
    pub friction: PairFriction,
    /// How it answers.
    pub response: Response,
    /// Torsional friction and rolling friction: torques per normal force, about the normal and across it \[m\].
    pub turning_m: [f64; 2],
}

impl Surfacing {
    /// Things that rest on each other are no deeper \[m\]: what is found deeper was placed there, and its spring would throw it.
    pub(crate) fn deepest_rest_m(&self) -> f64 {
        if self.is_as_felt() { f64::INFINITY } else { DEEPEST_REST_M }
    }

    /// True if points are as soft as fingers feel both.
    pub(crate) fn is_as_felt(&self) -> bool {
        !self.damping.is_ratio()
    }

    /// Of two entities.
    pub fn between(a: &Entity, b: &Entity, contacts: &Contacts) -> Self {
        let (stiffness_n_per_m, damping) = contacts.between(a, b);
        Self {
            stiffness_n_per_m,
            damping,
            friction: PairFriction::between(&a.friction, &b.friction),
            response: contacts.response(a, b),
            // What gives way more has the larger patch.
            turning_m: [
                a.torsional_friction_m.max(b.torsional_friction_m),
                a.rolling_friction_m.max(b.rolling_friction_m),
            ],
        }
    }
}

/// Ten times what the heaviest rests at on one point \[m\].
const DEEPEST_REST_M: f64 = 2.5e-5;
