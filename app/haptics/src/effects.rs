//! Forces beside those of contact: fields, guides, magnetism, vibration.
//!
//! Problem: scenes written for other haptic libraries have more than surfaces: water that slows the hand, a rail that
//! guides it, a magnet, a motor that hums. None of these needs a god-object.
//!
//! Model: [`Field`] and [`Guide`] are things of the world, in lists of their own beside the entities; [`Magnetism`] and
//! [`Vibration`] are properties of an entity's surface. What a finger remembers of them (filters, what it is captured by)
//! is in [`FingerEffects`], which steps after [`crate::Finger::step`]; its force adds to that of the contacts.
//!
//! Gains that would make a device swing are refused where an effect is made, by the [`Limits`] of the device and rate.
//!
//! Reaction: fields and guides are things of the world; who feels them pushes nothing. Magnetism and vibration are an
//! entity's own: each [`Reaction`] says what of the force came from which entity, which gets it with the sign turned where
//! it moves.
//!
//! Frames and signs: world, forces on the user. SI.
//! Invariants: every force is finite and bounded ([`MOST_FORCE_N`] an effect); no allocation, panic or unbounded
//! loop in a step; entering or leaving the reach of anything gives no step of the force.
//! Cost: linear in the number of effects, and nothing where there are none.

mod acceleration;
mod field;
mod finger_effects;
mod footing;
mod gains;
mod guide;
mod limits;
mod magnetism;
mod path;
mod reaction;
mod region;
mod track;
mod vibration;

pub use field::{Field, FieldKind};
pub use finger_effects::{FingerEffects, Moment};
pub use gains::Gains;
pub use guide::{Guide, HYSTERESIS_M};
pub use limits::Limits;
pub use magnetism::Magnetism;
pub use reaction::Reaction;
pub use region::Region;
pub use track::{MAX_PATH_POINTS, Track};
pub use vibration::Vibration;

use nalgebra::Vector3;

use crate::entity::Entity;

/// The most that one field or guide ever pulls \[N\]: more than a desktop device renders.
pub const MOST_FORCE_N: f64 = 10.0;

/// Every effect of a world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Effects {
    fields: Box<[Field]>,
    guides: Box<[Guide]>,
    /// Indices of the entities that attract, and of those that hum.
    magnetic: Box<[usize]>,
    vibrating: Box<[usize]>,
}

impl Effects {
    /// These fields and guides, and what the surfaces of these entities do.
    ///
    /// Which entities have magnetism or vibration is noted here: make it anew when that changes. Their poses and
    /// strengths may change at any time.
    pub fn new(fields: Vec<Field>, guides: Vec<Guide>, entities: &[Entity]) -> Self {
        let indices = |has: fn(&Entity) -> bool| {
            entities.iter().enumerate().filter(|(_, entity)| has(entity)).map(|(index, _)| index).collect()
        };
        Self {
            fields: fields.into(),
            guides: guides.into(),
            magnetic: indices(|entity| entity.magnetism.is_some()),
            vibrating: indices(|entity| entity.vibration.is_some()),
        }
    }

    /// Whether there is nothing to feel.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty()
            && self.guides.is_empty()
            && self.magnetic.is_empty()
            && self.vibrating.is_empty()
    }

    /// Its fields.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Its guides.
    pub fn guides(&self) -> &[Guide] {
        &self.guides
    }

    /// The most entities that act on a finger at once, each as often as it has effects.
    fn most_reactions(&self) -> usize {
        self.magnetic.len() + self.vibrating.len()
    }
}

/// How a finger moves in a tick, in the world frame.
#[derive(Debug, Clone, Copy)]
struct Motion {
    position_W: Vector3<f64>,
    /// By the driver's estimate, else by the difference of positions (m/s).
    velocity_W: Vector3<f64>,
    dt_s: f64,
    /// Since the last tick (m).
    way_m: f64,
    /// Of this tick and the last one together (m/s).
    speeds_m_s: f64,
}

/// What something that draws a finger does in a tick.
#[derive(Debug, Clone, Copy, Default)]
struct Pull {
    /// World frame (N).
    force_on_user_W: Vector3<f64>,
    /// What it gives back if the finger follows (J).
    stored_j: f64,
    /// By how much the force can have changed in this tick (N), but for turns where two places are equally near.
    explained_n: f64,
}

impl Pull {
    fn add(&mut self, other: &Self) {
        self.force_on_user_W += other.force_on_user_W;
        self.stored_j += other.stored_j;
        self.explained_n += other.explained_n;
    }
}

/// From 0 at `x <= 0` to 1 at `x >= 1` without a step in value or slope; 0 for what is no number.
fn smooth_step(x: f64) -> f64 {
    if x > 0.0 {
        let x = x.min(1.0);
        x * x * (3.0 - 2.0 * x)
    } else {
        0.0
    }
}

/// `force` cut to `most_n`, its direction kept; zero for what is not finite.
fn bounded(force: Vector3<f64>, most_n: f64) -> Vector3<f64> {
    let size_n = force.norm();
    if size_n <= most_n {
        force
    } else if size_n.is_finite() {
        force * (most_n / size_n)
    } else {
        Vector3::zeros()
    }
}
