//! The shape of an entity, in the entity's frame B.

use nalgebra::{Unit, Vector3};

use crate::error::SceneError;
use crate::pose::read_direction;
use crate::reader::{Bound, Table, Value};
use crate::vocabulary::Vocabulary;

/// A shape with its sizes, as the scene file gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        /// Above 0.
        radius_m: f64,
    },
}

impl ShapeSpec {
    /// Reads the `shape` of an entity.
    pub(crate) fn read(entity: &Table<'_>) -> Result<Self, SceneError> {
        let table = entity.require("shape", EXAMPLE)?.table(EXAMPLE)?;
        let kind = table.require("kind", KINDS.list())?.choose("shape kind", &KINDS)?;
        match kind {
            "plane" => read_plane(&table),
            _ => read_sphere(&table),
        }
    }
}

/// A half-space is given by `normal . p <= offset` for a normal of any length; both sides are
/// divided by that length.
fn read_plane(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    table.check_keys(&Vocabulary { available: &["kind", "normal", "offset_m"], later: &[] })?;
    let (normal, [scale, length]) = read_direction(&table.require("normal", "an array of 3 numbers")?)?;
    let offset: Value<'_> = table.require("offset_m", Bound::Any)?;
    let offset_m = offset.number(Bound::Any)? / scale / length;
    if !offset_m.is_finite() {
        return Err(offset.out_of_range("a number whose quotient by the length of normal is finite"));
    }
    Ok(ShapeSpec::Plane { normal, offset_m })
}

fn read_sphere(table: &Table<'_>) -> Result<ShapeSpec, SceneError> {
    table.check_keys(&Vocabulary { available: &["kind", "radius_m"], later: &[] })?;
    Ok(ShapeSpec::Sphere { radius_m: table.number("radius_m", Bound::Positive)? })
}

const KINDS: Vocabulary = Vocabulary {
    available: &["plane", "sphere"],
    later: &["box", "cylinder", "cone", "torus", "capsule", "ellipsoid", "mesh", "nurbs", "csg"],
};
const EXAMPLE: &str = "a table such as { kind = \"sphere\", radius_m = 0.05 }";
