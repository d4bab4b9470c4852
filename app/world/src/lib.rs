//! Scenes: which fingers and entities a run starts with, and the files that say so.
//!
//! Problem: a scene file is written by hand, so it is wrong at first. Whoever reads the message
//! must be able to mend the file without reading this code.
//!
//! Model: [`Scene::parse`] turns TOML text into plain validated data, or into one
//! [`SceneError`] that names file, line, key, what was found and what is allowed. [`Layout`] does
//! the same for the file that says where the devices stand. Reading renders and moves nothing:
//! the numbers are handed to the crates that do.
//!
//! Two modules do more than read: [`lists`] steps what moves, shared between a fast and a slow list, and [`events`]
//! carries what happens to whoever wants to know.
//!
//! Frames: W world (right-handed, y up), B entity, D device base. A pose `X_WB` takes points
//! of B into W. SI throughout; quaternions are written w, x, y, z.
//!
//! Invariants of what is returned: every number is finite, directions and quaternions have unit
//! length, stiffness and sizes are positive, names are unique and safe as CSV column names.
//!
//! ```
//! use std::path::Path;
//! use world::{Scene, ShapeSpec};
//!
//! let text = r#"
//!     [[finger]]
//!     [[entity]]
//!     shape = { kind = "sphere", radius_m = 0.05 }
//! "#;
//! let scene = Scene::parse(text, Path::new("ball.toml"))?;
//! assert_eq!(scene.name, "ball");
//! assert_eq!(scene.fingers[0].name, "f0");
//! assert_eq!(scene.entities[0].shape, ShapeSpec::Sphere { radius_m: 0.05 });
//! # Ok::<(), world::SceneError>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod attach;
mod camera;
mod colour;
mod csg;
mod document;
mod document_size;
mod dynamics;
mod effects;
mod entity;
mod environment;
mod error;
pub mod events;
mod faces;
mod field;
mod finger;
mod friction;
mod grid;
mod guide;
mod height_map;
mod key_file;
mod layout;
mod light;
pub mod lists;
mod material;
pub mod model;
mod motion;
mod names;
mod passivity;
pub mod picture;
mod placement;
mod pose;
mod problems;
mod reader;
mod scene;
pub mod seen;
mod settings;
mod shading;
mod shape;
mod soft;
mod solid;
mod source;
mod sources;
mod templates;
pub mod thesis;
mod things;
mod units;
mod visual;
mod vocabulary;

pub use attach::{AttachSpec, AttachedOrientation};
pub use camera::SceneCamera;
pub use csg::{CsgChild, CsgOp, CsgSpec};
pub use dynamics::{ContactStiffnessSpec, DynamicsSpec, IntegratorSpec, ResponseSpec};
pub use effects::{MagnetismSpec, VibrationSpec};
pub use entity::{AlgorithmSpec, EntityKind, SceneEntity};
pub use environment::{DoorSpec, EnvironmentKind, SceneEnvironment};
pub use error::{Location, SceneError};
pub use faces::FacesSpec;
pub use field::{FieldKindSpec, FieldSpec, MAX_FIELDS};
pub use finger::SceneFinger;
pub use friction::FrictionSpec;
pub use grid::MAX_ENTITIES;
pub use guide::{GuideSpec, MAX_GUIDES, TrackSpec};
pub use height_map::HeightMapSpec;
pub use key_file::{KeyLine, parse_key_lines, read_key_lines};
pub use layout::Layout;
pub use light::{LightKind, SceneLight};
pub use motion::{MassSpec, MotionSpec};
pub use names::{MAX_NAME_BYTES, is_name};
pub use passivity::PassivitySpec;
pub use placement::{Affine, LEAST_STRETCH, MOST_STRETCH, Placement};
pub use scene::{Scene, SceneText};
pub use settings::{Origin, Set, Settings, StereoMode};
pub use shading::{ShadingFormSpec, ShadingSpec};
pub use shape::{MeshSpec, ShapeSpec};
pub use soft::{SoftModelSpec, SoftSpec};
pub use solid::NoSolid;
pub use source::MAX_FILE_BYTES;
pub use sources::{MAX_FILES, MAX_INCLUDE_DEPTH, MAX_SCENE_BYTES};
pub use templates::{MAX_TEMPLATE_DEPTH, SceneTemplate};
pub use visual::VisualSpec;

/// Fingers in a scene, devices in a layout, and haptic devices of one driver: at most this many.
pub const MAX_DEVICES: usize = 8;
