//! Orders, as the fast thread gets them: checked, and with all memory that they need.

use super::gradual::Gradual;
use crate::displaced::Displaced;
use crate::fast_step::{EventTeller, FastStep};
use crate::row::BodyRow;
use crate::row_queue::RowSender;
use haptics::Friction;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use world::events::Kind;

/// What is to change.
pub enum Order {
    /// Stiffness or damping of what fingers feel.
    Scale(Scale),
    /// Where an entity is.
    Move(Move),
    /// Where the camera is that devices go with.
    Camera(Isometry3<f64>),
    /// Of what kind its friction is.
    Friction(Box<FrictionChange>),
    /// Whether things move by themselves.
    Pause(bool),
    /// Nothing; it is told among the events, as of this tick of the run if that is not later than now.
    Tell(Kind, Option<u64>),
    /// Nothing; whoever looks on reads it when it is taken.
    Text,
    /// The world: a reset, or another scene.
    Replace(Box<Replacement>),
    /// The same, by the next one of those that are made one after the other.
    ReplaceByNext,
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

/// An entity goes somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Its number.
    pub entity: usize,
    /// Where its frame's origin comes to rest \[m\]; `None`: where it is.
    pub to_W: Option<Vector3<f64>>,
    /// How it is turned then.
    pub turn: Turn,
    /// How long it takes \[s\], if that is not too fast.
    pub over_s: f64,
}

/// How an entity is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// As it is.
    Not,
    /// So, whatever it is now.
    To(UnitQuaternion<f64>),
    /// By so much from how it is when it sets out, about axes of the world.
    By(UnitQuaternion<f64>),
}

/// An entity gets another friction.
pub struct FrictionChange {
    /// Its number.
    pub entity: usize,
    /// Which; what it was, once it has been exchanged.
    pub friction: Friction,
    /// The same for the slow list.
    pub for_slow: Option<Friction>,
}

/// A world that takes the place of the one that runs; what it replaced, once it has.
pub struct Replacement {
    /// Its fingers and entities.
    pub step: FastStep,
    /// Room for what is changed gradually in it.
    pub gradual: Gradual,
    /// Room for what happens in it.
    pub teller: EventTeller,
    /// Another scene: where its rows go. `None`: it is the running scene as it began.
    pub other: Option<Other>,
}

/// What another scene has of its own.
pub struct Other {
    /// Where its rows go.
    pub rows: RowSender,
    /// Room for all of its bodies, by their numbers.
    pub bodies: Vec<(u32, BodyRow)>,
    /// Room for what else is moved.
    pub displaced: Displaced,
    /// The how-many-th of the run, the one that it began with being 0.
    pub number: u32,
}

impl Replacement {
    /// A world that nothing has been changed in.
    pub fn new(mut step: FastStep, other: Option<Other>) -> Box<Self> {
        let gradual = Gradual::new(step.entities().len());
        let teller = EventTeller::new(&mut step);
        Box::new(Self { step, gradual, teller, other })
    }
}

/// What goes back to the slow side, to be freed there.
pub enum Spent {
    /// A world that was replaced.
    World(Box<Replacement>),
    /// A friction that was.
    Friction(Box<FrictionChange>),
}
