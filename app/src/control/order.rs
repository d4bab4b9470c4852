//! Orders, as the fast thread gets them: checked, and with all memory that they need.

use super::gradual::Gradual;
use crate::fast_step::FastStep;
use nalgebra::Vector3;

/// What is to change.
pub enum Order {
    /// Stiffness or damping of what fingers feel.
    Scale(Scale),
    /// Where an entity is.
    Move(Move),
    /// The world: a reset, or another scene.
    Replace(Box<Replacement>),
}

/// Which of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// k.
    Stiffness,
    /// b.
    Damping,
}

/// Fingers are to feel so many times the stiffness or damping that they feel now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Of which.
    pub which: Which,
    /// How many times, > 0.
    pub by: f64,
    /// Of which entity; `None`: of all.
    pub entity: Option<usize>,
}

/// An entity that is no body goes somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Its number.
    pub entity: usize,
    /// Where its frame's origin comes to rest \[m\].
    pub to_W: Vector3<f64>,
    /// How long it takes \[s\], if that is not too fast.
    pub over_s: f64,
}

/// A world that takes the place of the one that runs; what it replaced, once it has.
pub struct Replacement {
    /// Its fingers and entities.
    pub step: FastStep,
    /// Room for what is changed gradually in it.
    pub gradual: Gradual,
    /// Whether it is the running scene as it began.
    pub is_same_scene: bool,
}

impl Replacement {
    /// A world that nothing has been changed in.
    pub fn new(step: FastStep, is_same_scene: bool) -> Box<Self> {
        let gradual = Gradual::new(step.entities().len());
        Box::new(Self { step, gradual, is_same_scene })
    }
}
