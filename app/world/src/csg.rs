//! A shape made of others, in the frame of the whole.
//!
//! Only shapes with an inside that is known exactly can be joined: a mesh may have holes, and is refused.

use nalgebra::Isometry3;

use crate::error::SceneError;
use crate::pose::read_pose;
use crate::reader::Table;
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// Shapes and how they are joined.
#[derive(Debug, Clone, PartialEq)]
pub struct CsgSpec {
    /// How.
    pub op: CsgOp,
    /// At least one.
    pub children: Vec<CsgChild>,
}

/// How shapes are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CsgOp {
    /// What is in any of them.
    Union,
    /// What is in all of them.
    Intersection,
    /// What is in the first and in no other.
    Difference,
}

/// One of the shapes, and where it is in the frame of the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct CsgChild {
    /// A shape with a closed form, or a tree in turn.
    pub shape: ShapeSpec,
    /// Default identity.
    pub pose: Isometry3<f64>,
}

impl CsgSpec {
    pub(crate) fn read(shape: &Table<'_>) -> Result<Self, SceneError> {
        let op = match shape.require("op", OPS.list())?.choose("operation", &OPS)? {
            "union" => CsgOp::Union,
            "intersection" => CsgOp::Intersection,
            _ => CsgOp::Difference,
        };
        let written = shape.require("children", CHILDREN)?;
        let children = shape.tables("children")?;
        if children.is_empty() {
            return Err(written.out_of_range(CHILDREN));
        }
        Ok(Self { op, children: children.iter().map(CsgChild::read).collect::<Result<_, _>>()? })
    }
}

impl CsgChild {
    fn read(child: &Table<'_>) -> Result<Self, SceneError> {
        child.check_keys(&KEYS)?;
        let shape = ShapeSpec::read(child)?;
        if !shape.can_be_joined() {
            let written = child.require("shape", "")?.table("")?.require("kind", "")?;
            return Err(written.out_of_range(JOINED));
        }
        Ok(Self { shape, pose: read_pose(child)? })
    }
}

/// The keys of a shape of this kind.
pub(crate) const CSG_KEYS: Vocabulary =
    Vocabulary { available: &["kind", "op", "children", "scale"], later: &[] };
const OPS: Vocabulary = Vocabulary { available: &["union", "intersection", "difference"], later: &[] };
const KEYS: Vocabulary = Vocabulary { available: &["shape", "position_m", "orientation_wxyz"], later: &[] };
const CHILDREN: &str = "an array of tables such as { shape = { kind = \"sphere\", radius_m = 0.05 }, position_m = [0, 0, 0] }, at least one";
const JOINED: &str = "in a csg: plane, sphere, box, cylinder, cone, torus, capsule, ellipsoid, csg";
