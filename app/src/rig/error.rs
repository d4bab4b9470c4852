//! What can be wrong with the input of a run.

use super::LONGEST_RUN_S;
use crate::simulated::SimulationError;
use haptics::mesh::MeshError;
use haptics::{CsgError, HeightMapError, ParameterError};
use io_driver::open::OpenError;
use io_driver::sim::script::HandError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;
use world::model::ModelError;
use world::picture::PictureError;
use world::{Location, SceneError};

/// What is wrong with the input.
#[derive(Debug, Error)]
pub enum RigError {
    /// The scene or the layout.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The hand file.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// The hand file cannot be read.
    #[error(
        "cannot read the hand file {file}, named by {named_by}: {source}; name a CSV file that can be read"
    )]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// Who asks for it.
        named_by: String,
        /// What the system said.
        source: io::Error,
    },
    /// The hand file is a pipe, a directory or a device.
    #[error(
        "the hand file {file}, named by {named_by}, is not a regular file; \
         allowed: a file, since every device reads it from its beginning"
    )]
    NotAFile {
        /// Which.
        file: PathBuf,
        /// Who asks for it.
        named_by: String,
    },
    /// The hand file would make a run that is longer than any may be.
    #[error(
        "{file}: its last time is t = {last_s:.2} s, allowed: at most {LONGEST_RUN_S} s; t counts seconds from the beginning of \
         the run: subtract the first time from all of them"
    )]
    HandTooLong {
        /// Which.
        file: PathBuf,
        /// The last time in it.
        last_s: f64,
    },
    /// The devices cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The simulated devices cannot be had.
    #[error(transparent)]
    Device(#[from] OpenError),
    /// The scene holds something that rendering refuses.
    #[error("{}{}: {what}: {source}", .file.display(), on_line(*.line))]
    Refused {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins; `None` for a finger.
        line: Option<usize>,
        /// The entity or finger.
        what: String,
        /// Why.
        source: ParameterError,
    },
    /// The parts of a shape make no solid.
    #[error("{}:{line}: {what}: {source}", .file.display())]
    NoSolid {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins.
        line: usize,
        /// The entity.
        what: String,
        /// Why.
        source: CsgError,
    },
    /// An algorithm that cannot render a shape of this kind.
    #[error(
        "{}:{line}: {what} is a csg, which algorithm {found} cannot render; allowed: friction-cone, which without friction \
         is the classic god-object", .file.display()
    )]
    NotRendered {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins.
        line: usize,
        /// The entity.
        what: String,
        /// The algorithm.
        found: &'static str,
    },
    /// An entity that cannot move as it is described.
    #[error("{}:{line}: {what}: {source}", .file.display())]
    NoBody {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins.
        line: usize,
        /// The entity.
        what: String,
        /// Why.
        source: physics::BodyError,
    },
    /// A shape whose distance from a finger outside is not known.
    #[error(
        "{}:{line}: entity {entity} is a {kind}, which cannot have magnetism; allowed: no magnetism, or another shape",
        .file.display()
    )]
    NoMagnet {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins.
        line: usize,
        /// The entity's name.
        entity: String,
        /// The kind of its shape.
        kind: &'static str,
    },
    /// A model file cannot be read.
    #[error("{at}: {}: {source}", .file.display())]
    Model {
        /// Where the scene names it.
        at: Box<Location>,
        /// The model's file.
        file: PathBuf,
        /// Why.
        source: ModelError,
    },
    /// A model file's triangles make no mesh.
    #[error("{at}: {}: {source}", .file.display())]
    Mesh {
        /// Where the scene names it.
        at: Box<Location>,
        /// The model's file.
        file: PathBuf,
        /// Why.
        source: Box<MeshError>,
    },
    /// A model file has no face of this name.
    #[error("{at}: found {found:?}, which no face of {} is known by; allowed: {allowed}", .file.display())]
    FaceName {
        /// Where the scene names it.
        at: Box<Location>,
        /// The model's file.
        file: PathBuf,
        /// The name.
        found: String,
        /// Names in the file.
        allowed: String,
    },
    /// A picture file cannot be read.
    #[error("{at}: {}: {source}", .file.display())]
    Picture {
        /// Where the scene names it.
        at: Box<Location>,
        /// The picture's file.
        file: PathBuf,
        /// Why.
        source: PictureError,
    },
    /// A picture cannot lie on its shape.
    #[error("{at}: {source}")]
    HeightMap {
        /// Where the scene says so.
        at: Box<Location>,
        /// Why.
        source: HeightMapError,
    },
    /// A file of patches makes no surface.
    #[error("{at}: {said}")]
    Patches {
        /// Where the scene names it.
        at: Box<Location>,
        /// The file, the place in it, and why.
        said: String,
    },
    /// A finger with a radius meets a shape that has no surface for its centre to roll on.
    #[error(
        "{}:{line}: finger {finger} has radius_m = {radius_m}, and entity {entity}, a {kind}, cannot be felt by such a finger; \
         allowed: radius_m = 0, which feels every shape{otherwise}, or another shape", .file.display()
    )]
    NotFelt {
        /// The scene's file.
        file: PathBuf,
        /// Where the entity begins.
        line: usize,
        /// The finger's name.
        finger: String,
        /// Its radius (m).
        radius_m: f64,
        /// The entity's name.
        entity: String,
        /// The kind of its shape.
        kind: &'static str,
        /// What else would do.
        otherwise: &'static str,
    },
    /// Something of the grammar that this version has not got.
    #[error("{file}: {what} is not available in this version")]
    NotAvailable {
        /// The scene's file.
        file: PathBuf,
        /// What.
        what: String,
    },
}

impl RigError {
    /// Where in a scene's or layout's file it is, if it has one place there.
    pub fn location(&self) -> Option<Location> {
        let at = |file: &PathBuf, line: usize, key: &str| {
            Some(Location { file: file.clone(), line, key: key.into() })
        };
        match self {
            Self::Scene(error) => error.location().cloned(),
            Self::Refused { file, line: Some(line), what, .. } => at(file, *line, what),
            Self::NoSolid { file, line, what, .. }
            | Self::NotRendered { file, line, what, .. }
            | Self::NoBody { file, line, what, .. } => at(file, *line, what),
            Self::NoMagnet { file, line, entity, .. } | Self::NotFelt { file, line, entity, .. } => {
                at(file, *line, entity)
            }
            Self::Model { at, .. }
            | Self::Mesh { at, .. }
            | Self::FaceName { at, .. }
            | Self::Picture { at, .. }
            | Self::HeightMap { at, .. }
            | Self::Patches { at, .. } => Some((**at).clone()),
            _ => None,
        }
    }
}

fn on_line(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!(":{line}"))
}
