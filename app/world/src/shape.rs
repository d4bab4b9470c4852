//! The shape of an entity, in the entity's frame B.

use std::path::PathBuf;

use nalgebra::{Unit, Vector3};

use crate::csg::{CSG_KEYS, CsgSpec};
use crate::error::{Location, SceneError};
use crate::pose::read_direction;
use crate::reader::{Bound, Table, Value};
use crate::units::most_at;
use crate::vocabulary::Vocabulary;

/// A shape with its sizes, as the scene file gives it. Sizes are above 0 unless it is said.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ShapeSpec {
    /// The half-space of points p with `normal . p <= offset_m`.
    Plane {
        /// Leaves the material; unit length.
        normal: Unit<Vector3<f64>>,
        /// Distance of the surface from B's origin along `normal`.
        offset_m: f64,
    },
    /// A ball around B's origin.
    Sphere {
        /// Its radius.
        radius_m: f64,
    },
    /// A box around B's origin, its edges along B's axes.
    Box {
        /// Full lengths of its edges.
        size_m: [f64; 3],
    },
    /// A cylinder around B's origin, its axis along y.
    Cylinder {
        /// Of its circles.
        radius_m: f64,
        /// Full length along y.
        length_m: f64,
    },
    /// A cone or the frustum of one around B's origin, its axis along y.
    Cone {
        /// Of the circle at y = -length / 2; one of the two may be 0, an apex.
        radius_bottom_m: f64,
        /// Of the circle at y = length / 2.
        radius_top_m: f64,
        /// Full length along y.
        length_m: f64,
    },
    /// A ring around B's y axis.
    Torus {
        /// From B's origin to the middle of the tube.
        ring_radius_m: f64,
        /// Of the tube.
        tube_radius_m: f64,
    },
    /// A cylinder with half a ball on either end, its axis along y, around B's origin.
    Capsule {
        /// Of the cylinder and the balls.
        radius_m: f64,
        /// Of the straight part; may be 0, a ball.
        length_m: f64,
    },
    /// An ellipsoid around B's origin, its axes along B's.
    Ellipsoid {
        /// Half its lengths along x, y and z.
        radii_m: [f64; 3],
    },
    /// Triangles in a file of their own.
    Mesh(MeshSpec),
    /// Several shapes joined to one.
    Csg(CsgSpec),
    /// Rational patches in a file of their own.
    Nurbs(MeshSpec),
    /// Another shape but a mesh, drawn out along B's axes.
    Scaled {
        /// The shape before.
        shape: Box<ShapeSpec>,
        /// Factors along x, y and z; above 0.
        scale: [f64; 3],
    },
}

/// A file of triangles or patches and what becomes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSpec {
    /// A model file ([`crate::model`]); of patches OBJ or TOML; made relative to where the scene file is. It is not opened by the reader of scenes.
    pub file: PathBuf,
    /// Factors along x, y and z that make metres of the file's numbers; above 0, default 1.
    pub scale: [f64; 3],
    /// A mesh that is closed is felt from both sides all the same, as a room is.
    pub hollow: bool,
    /// The largest hole that is closed, by the diagonal of the box around it (m); `None`: those that are small beside a
    /// part that is closed but for them.
    pub close_holes_m: Option<f64>,
    /// Where the scene names it, for messages.
    pub at: Location,
}

impl ShapeSpec {
    /// Its `kind` in a scene file.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Sphere { .. } => "sphere",
            Self::Box { .. } => "box",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Torus { .. } => "torus",
            Self::Capsule { .. } => "capsule",
            Self::Ellipsoid { .. } => "ellipsoid",
            Self::Mesh(_) => "mesh",
            Self::Csg(_) => "csg",
            Self::Nurbs(_) => "nurbs",
            Self::Scaled { shape, .. } => shape.kind(),
        }
    }

    /// Whether it has a closed form, so that the depth of a point in it is known without a search.
    pub fn is_closed_form(&self) -> bool {
        match self {
            Self::Plane { .. }
            | Self::Sphere { .. }
            | Self::Box { .. }
            | Self::Cylinder { .. }
            | Self::Cone { .. }
            | Self::Torus { .. }
            | Self::Capsule { .. }
            | Self::Ellipsoid { .. } => true,
            Self::Scaled { shape, .. } => shape.is_closed_form(),
            _ => false,
        }
    }

    /// Whether it can be a part of a csg: what is inside of it is known exactly.
    pub(crate) fn can_be_joined(&self) -> bool {
        match self {
            Self::Scaled { shape, .. } => shape.can_be_joined(),
            Self::Mesh(_) | Self::Nurbs(_) => false,
            _ => true,
        }
    }

    /// Reads the `shape` of an entity, or of a part of a csg.
    pub(crate) fn read(entity: &Table<'_>) -> Result<Self, SceneError> {
        let table = entity.require("shape", EXAMPLE)?.table(EXAMPLE)?;
        let kind = table.require("kind", KINDS.list())?.choose("shape kind", &KINDS)?;
        let (keys, read) = reader_of(kind);
        table.check_keys(keys)?;
        let shape = read(&table)?;
        let Some(value) = table.get("scale") else { return Ok(shape) };
        let scale = value.factors()?;
        Ok(match shape {
            ShapeSpec::Mesh(mesh) => ShapeSpec::Mesh(MeshSpec { scale, ..mesh }),
            ShapeSpec::Nurbs(nurbs) => ShapeSpec::Nurbs(MeshSpec { scale, ..nurbs }),
            shape => ShapeSpec::Scaled { shape: Box::new(shape), scale },
        })
    }
}

type Read = fn(&Table<'_>) -> Result<ShapeSpec, SceneError>;

/// The keys of a kind, and how they become a shape.
fn reader_of(kind: &str) -> (&'static Vocabulary, Read) {
    match kind {
        "plane" => (&PLANE_KEYS, read_plane),
        "sphere" => (&SPHERE_KEYS, read_sphere),
        "box" => (&BOX_KEYS, read_box),
        "cylinder" => (&CYLINDER_KEYS, read_cylinder),
        "cone" => (&CONE_KEYS, read_cone),
        "torus" => (&TORUS_KEYS, read_torus),
        "capsule" => (&CYLINDER_KEYS, read_capsule),
        "ellipsoid" => (&ELLIPSOID_KEYS, read_ellipsoid),
        "csg" => (&CSG_KEYS, read_csg),
        "nurbs" => (&NURBS_KEYS, read_nurbs),
        _ => (&MESH_KEYS, read_mesh),
    }
}

/// A half-space is given by `normal . p <= offset` for a normal of any length; both sides are
/// divided by that length.
fn read_plane(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let (normal, [scale, length]) = read_direction(&table.require("normal", "an array of 3 numbers")?)?;
    let offset: Value<'_> = table.require("offset_m", Bound::Any)?;
    let offset_m = offset.finite_number(Bound::Any)? / scale / length;
    if offset_m.is_nan() || offset_m.abs() > most_at("offset_m") {
        let most = most_at("offset_m");
        return Err(offset.out_of_range(format_args!(
            "a number whose quotient by the length of normal is {most:e} at most in size"
        )));
    }
    Ok(ShapeSpec::Plane { normal, offset_m })
}

fn read_sphere(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    Ok(ShapeSpec::Sphere { radius_m: size(table, "radius_m")? })
}

fn read_box(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    Ok(ShapeSpec::Box { size_m: sizes(table, "size_m")? })
}

fn read_cylinder(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    Ok(ShapeSpec::Cylinder { radius_m: size(table, "radius_m")?, length_m: size(table, "length_m")? })
}

/// The tip may be at either end.
fn read_cone(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let radius_bottom_m = table.number("radius_bottom_m", Bound::NotNegative)?;
    let radius_top_m = table.number("radius_top_m", Bound::NotNegative)?;
    if radius_bottom_m == 0.0 && radius_top_m == 0.0 {
        let allowed = "a number above 0, since radius_bottom_m is 0";
        return Err(table.require("radius_top_m", "")?.out_of_range(allowed));
    }
    Ok(ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m: size(table, "length_m")? })
}

/// A tube thicker than its ring would pass through itself in the middle.
fn read_torus(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let ring_radius_m = size(table, "ring_radius_m")?;
    let tube_radius_m = size(table, "tube_radius_m")?;
    if tube_radius_m >= ring_radius_m {
        let allowed = format!("a number above 0 and below ring_radius_m = {ring_radius_m}");
        return Err(table.require("tube_radius_m", "")?.out_of_range(allowed));
    }
    Ok(ShapeSpec::Torus { ring_radius_m, tube_radius_m })
}

fn read_capsule(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let length_m = table.number("length_m", Bound::NotNegative)?;
    Ok(ShapeSpec::Capsule { radius_m: size(table, "radius_m")?, length_m })
}

fn read_ellipsoid(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    Ok(ShapeSpec::Ellipsoid { radii_m: sizes(table, "radii_m")? })
}

fn read_mesh(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let mesh = read_file(table, MODEL_FILE)?;
    let hollow = table.get("hollow").map_or(Ok(false), |value| value.truth())?;
    let largest = |value: Value<'_>| value.number(Bound::NotNegative);
    let close_holes_m = table.get("close_holes_m").map(largest).transpose()?;
    Ok(ShapeSpec::Mesh(MeshSpec { hollow, close_holes_m, ..mesh }))
}

impl ShapeSpec {
    /// That of an environment which is a mesh: `file` and `scale` stand in its own table.
    pub(crate) fn read_hollow_mesh(environment: &Table<'_>) -> Result<Self, SceneError> {
        let mesh = read_file(environment, MODEL_FILE)?;
        let scale = environment.get("scale").map_or(Ok([1.0; 3]), |value| value.factors())?;
        Ok(Self::Mesh(MeshSpec { scale, hollow: true, ..mesh }))
    }
}

fn read_nurbs(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    let allowed = "the path of a file of patches, TOML or OBJ, relative to this file";
    Ok(ShapeSpec::Nurbs(read_file(table, allowed)?))
}

fn read_file(table: &Table<'_>, allowed: &str) -> Result<MeshSpec, SceneError> {
    let value = table.require("file", allowed)?;
    let file = value.file(allowed)?;
    Ok(MeshSpec { file, scale: [1.0; 3], hollow: false, close_holes_m: None, at: *value.at() })
}

fn read_csg(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    CsgSpec::read(table).map(ShapeSpec::Csg)
}

fn size(table: &Table<'_>, key: &str) -> Result<f64, SceneError> {
    table.number(key, Bound::Positive)
}

fn sizes(table: &Table<'_>, key: &str) -> Result<[f64; 3], SceneError> {
    table.require(key, "an array of 3 numbers above 0")?.numbers_in(Bound::Positive)
}

const MODEL_FILE: &str = "the path of an OBJ, STL, PLY, glTF, ASE or 3DS file, relative to this file";

const fn keys(available: &'static [&'static str]) -> Vocabulary {
    Vocabulary { available, later: &[] }
}

const PLANE_KEYS: Vocabulary = keys(&["kind", "normal", "offset_m", "scale"]);
const SPHERE_KEYS: Vocabulary = keys(&["kind", "radius_m", "scale"]);
const BOX_KEYS: Vocabulary = keys(&["kind", "size_m", "scale"]);
const CYLINDER_KEYS: Vocabulary = keys(&["kind", "radius_m", "length_m", "scale"]);
const CONE_KEYS: Vocabulary = keys(&["kind", "radius_bottom_m", "radius_top_m", "length_m", "scale"]);
const TORUS_KEYS: Vocabulary = keys(&["kind", "ring_radius_m", "tube_radius_m", "scale"]);
const ELLIPSOID_KEYS: Vocabulary = keys(&["kind", "radii_m", "scale"]);
const NURBS_KEYS: Vocabulary = keys(&["kind", "file", "scale"]);
const MESH_KEYS: Vocabulary = keys(&["kind", "file", "scale", "hollow", "close_holes_m"]);

const KINDS: Vocabulary = Vocabulary {
    available: &[
        "plane",
        "sphere",
        "box",
        "cylinder",
        "cone",
        "torus",
        "capsule",
        "ellipsoid",
        "mesh",
        "csg",
        "nurbs",
    ],
    later: &[],
};
const EXAMPLE: &str = "a table such as { kind = \"sphere\", radius_m = 0.05 }";
