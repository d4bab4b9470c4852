//! Objects that move: grasped, pushed, thrown, put down. A pure library, like `haptics`.
//!
//! Problem: fingers and surroundings press on an object at any number of points. What is left of all these forces and
//! torques (N. Melder, *Multi-Finger Manipulation Physics for Haptic Rendering*, ch. 5: the Residual Force and Torque
//! Algorithms) moves it, a thousand times a second, whether it weighs a gram or ten kilograms and whatever hand holds it.
//!
//! Model: a [`Body`] is an entity with a [mass](MassProperties). In each tick [`Manipulation::step`]
//! - finds where bodies touch what is around them ([`collide`]): contact points that keep their identity from tick to tick;
//! - takes each of these, and each finger's touch, as a spring with a friction cone ([`Row`]);
//! - asks what the springs do at the *end* of the tick ([`Solver`]): so no spring is too stiff for a light body;
//! - sums the forces up ([`Wrench`]) and moves the bodies ([`Integrator`]).
//!
//! Fingers are points, unless told otherwise: [soft](SoftFinger), with a gimbal or a button that
//! [ties](Attachment) an object to them ([`Manipulation::step_with`]). How well they hold an object: [`grasp`].
//!
//! What a finger's spring did to a body in a tick, times -1, is what the user is made to feel in that tick.
//!
//! Frames and signs: W world, B a body's own frame, P its principal axes with the centre of mass as origin. SI, y up.
//! Contact normals leave the other one and point to the body; forces say on whom they act.
//! Invariants: a step never allocates, panics, reads a clock or loops without a constant bound; all it returns is finite;
//! contacts never pull.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
// Names carry their frame (`point_W`, `X_WB`), which is worth more here than the case lint.
#![allow(non_snake_case)]

mod anchor;
mod attach;
mod body;
mod broad_phase;
pub mod collide;
mod contacts;
mod error;
mod gimbal;
pub mod grasp;
mod grasp_axis;
mod hand;
mod integrator;
mod limit_surface;
mod manipulation;
mod mass;
mod pair;
mod pair_friction;
mod pair_restitution;
mod pairs;
mod pull;
mod restitution;
mod roster;
mod row;
mod settings;
mod sleep;
mod soft_finger;
mod solver;
mod touch;
mod twist;
mod wrench;

pub use anchor::Anchor;
pub use attach::{Attachment, HeldOrientation};
pub use body::Body;
pub use broad_phase::{Aabb, BroadPhase};
pub use contacts::{ContactDamping, ContactStiffness, Contacts};
pub use error::BodyError;
pub use grasp::{Grasp, GraspContact, GraspQuality};
pub use grasp_axis::GraspAxis;
pub use hand::{FingerSettings, FingerTick};
pub use integrator::Integrator;
pub use limit_surface::LimitSurface;
pub use manipulation::{
    Begins, MAX_DRIVEN, Made, Manipulation, PairStanding, Parcel, Parked, Reason, Room, Wanted,
};
pub use mass::MassProperties;
pub use pair::{Response, Surfacing};
pub use pair_friction::PairFriction;
pub use pairs::MOST_PAIRS;
pub use pull::{MAX_PULLS, Pull};
pub use roster::Standing;
pub use row::{Held, Rolling, Row, Torsion};
pub use settings::Settings;
pub use sleep::Sleep;
pub use soft_finger::{SoftFinger, TorsionModel};
pub use solver::{Islands, MAX_SWEEPS, Motion, Solved, Solver};
pub use touch::Touch;
pub use wrench::Wrench;
