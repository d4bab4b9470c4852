//! The scene files of the thesis' own program (Melder 7.2.3, figures 7.2 and 7.3), turned into scenes of ours.
//!
//! Model: a *scene list* names a kind and an object file on each line, an *object file* has `Key=Value` lines; `//`
//! begins a comment in both. The thesis prints one of each, and of the other kinds only what they contain (7.2.6): their
//! keys are called here as the text calls what they hold, and [`KEYS`] lists all of them. What has no counterpart is kept
//! as a comment and told.
//!
//! Units and frames: the figures fit metres, kilograms and y up. An `Orientation` is a rotation matrix by rows; the
//! figure shows the identity, which does not tell rows from columns.

mod list;
mod object;
mod words;
mod write;

pub use list::{ListEntry, ObjectKind, read_list};
pub use object::{ObjectFile, read_object};
pub use write::{Conversion, Converted};

use std::path::PathBuf;

/// Why a file of the thesis' program was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ThesisError {
    /// Something wrong on a line.
    #[error("{}:{line}: found {found}; allowed: {allowed}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What was found.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A key that an object of this kind needs.
    #[error("{}: {key} is missing; allowed: {allowed}", file.display())]
    Missing {
        /// The file.
        file: PathBuf,
        /// The key.
        key: &'static str,
        /// What may stand there.
        allowed: &'static str,
    },
}

/// The keys that are known, by kind of object, and whether the thesis prints them.
pub const KEYS: [(&str, &str, bool); 9] = [
    ("all", "Name, Type, Position, Orientation", true),
    (
        "GameObject",
        "Scale, Colour, Mesh, HapticMesh, NoRotate, Inputtable, Mass, InertiaX, InertiaY, InertiaZ",
        true,
    ),
    ("GameObject", "Shape, Size, Radius, Length, RingRadius, TubeRadius, Normal", false),
    (
        "GameObject",
        "CentreOfMass, Velocity, AngularVelocity, Stiffness, Damping, StaticFriction, DynamicFriction",
        false,
    ),
    ("Environment, EnvironmentMesh, EnvironmentEntity", "as GameObject, without what moves", false),
    ("EnvironmentMixed", "Entity (an object file; several), or as EnvironmentMesh", false),
    ("Light", "LightType, Direction, Diffuse, Specular, Ambient, Attenuation, CastShadow", false),
    ("Camera", "FieldOfView, NearPlane, FarPlane", false),
    ("Phantom", "Master, Parent", false),
];
