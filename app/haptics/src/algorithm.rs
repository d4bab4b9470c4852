//! How a contact is rendered: by the Friction Cone Algorithm, by a baseline to compare it with, or by somebody's own.
//!
//! An own algorithm answers for all of a contact: when it begins and ends, where the god-object is, which force is
//! felt. The finger does the rest: frames, sums, finite numbers.

use std::fmt;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::friction::Friction;
use crate::friction_cone::ConeInput;
use crate::friction_law::FrictionState;
use crate::shape::Shape;
use crate::shared::Shared;
use crate::surface::SurfacePoint;

/// How the contact with an entity is rendered.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Algorithm {
    /// The Friction Cone Algorithm (Melder ch. 4).
    #[default]
    FrictionCone,
    /// Somebody's own.
    Own(Shared<dyn ContactAlgorithm>),
}

impl Algorithm {
    /// Somebody's own algorithm.
    pub fn own(algorithm: impl ContactAlgorithm + 'static) -> Self {
        let algorithm: Arc<dyn ContactAlgorithm> = Arc::new(algorithm);
        Self::Own(algorithm.into())
    }
}

/// A way to render a contact: implement it to plug in your own.
///
/// A tick must not allocate, panic or loop without a constant bound. Answers that are not finite end the contact.
pub trait ContactAlgorithm: fmt::Debug + Send + Sync {
    /// One tick of one finger against one entity; `None` while they do not touch.
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch>;
}

/// What an algorithm is told, in the entity's frame B.
#[derive(Debug, Clone, Copy)]
pub struct TouchInput<'e> {
    /// The entity's shape.
    pub shape: &'e Shape,
    /// The entity's friction.
    pub friction: &'e Friction,
    /// Radius of the finger \[m\].
    pub finger_radius_m: f64,
    /// Where the HIP was in the last tick \[m\], taken through the pose that the entity had then; `None` at first.
    pub previous_hip_B: Option<Vector3<f64>>,
    /// Where the HIP is, and what the entity's material is like.
    pub cone: ConeInput,
}

/// What an algorithm answers, in the entity's frame B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Where the finger is held.
    pub god_object: SurfacePoint,
    /// Force the device renders \[N\].
    pub force_on_user_B: Vector3<f64>,
    /// Normal part of it \[N\], >= 0.
    pub normal_force_n: f64,
    /// Whether friction holds.
    pub friction: FrictionState,
}

/// What an algorithm remembers of one contact from tick to tick; all zero when the finger meets the entity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactMemory {
    /// Whatever the algorithm makes of them.
    pub words: [f64; CONTACT_WORDS],
}

/// Numbers in a [`ContactMemory`].
pub const CONTACT_WORDS: usize = 16;
