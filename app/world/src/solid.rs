//! From the shapes that a scene says to those that are felt: closed forms, and solids joined of them.

use haptics::{
    Capsule, Cone, Csg, CsgError, CsgPart, CsgTree, Cuboid, Cylinder, Ellipsoid, Form, ParameterError, Plane,
    Scaled, Sphere, Torus,
};
use nalgebra::Isometry3;

use crate::csg::{CsgOp, CsgSpec};
use crate::shape::ShapeSpec;

/// Cause why a shape is no closed form and no solid joined of them.
#[derive(Debug, Clone, PartialEq)]
pub enum NoSolid {
    /// Its numbers are refused.
    Refused(ParameterError),
    /// Its parts make none.
    Unjoined(CsgError),
    /// It is in a file.
    Modelled(String),
}

impl From<ParameterError> for NoSolid {
    fn from(error: ParameterError) -> Self {
        Self::Refused(error)
    }
}

impl From<CsgError> for NoSolid {
    fn from(error: CsgError) -> Self {
        Self::Unjoined(error)
    }
}

impl ShapeSpec {
    /// True of a shape that is joined of others, scaled or not.
    pub fn is_csg(&self) -> bool {
        match self {
            Self::Scaled { shape, .. } => shape.is_csg(),
            spec => matches!(spec, Self::Csg(_)),
        }
    }

    /// The solid of a shape that is joined of others.
    pub fn csg(&self) -> Result<Csg, NoSolid> {
        // As the only part of a tree it may be scaled like any other.
        Ok(Csg::build(&CsgTree::union([self.part(Isometry3::identity())?]))?)
    }

    /// The closed form of a shape that has one.
    pub fn form(&self) -> Result<Form, NoSolid> {
        Ok(match *self {
            Self::Plane { normal, offset_m } => Plane::new(normal.into_inner(), offset_m)?.into(),
            Self::Sphere { radius_m } => Sphere::new(radius_m)?.into(),
            Self::Box { size_m } => Cuboid::new(size_m)?.into(),
            Self::Cylinder { radius_m, length_m } => Cylinder::new(radius_m, length_m)?.into(),
            Self::Cone { radius_bottom_m, radius_top_m, length_m } => {
                Cone::new(radius_bottom_m, radius_top_m, length_m)?.into()
            }
            Self::Capsule { radius_m, length_m } => Capsule::new(radius_m, length_m)?.into(),
            Self::Torus { ring_radius_m, tube_radius_m } => Torus::new(ring_radius_m, tube_radius_m)?.into(),
            Self::Ellipsoid { radii_m } => Ellipsoid::new(radii_m)?.into(),
            Self::Scaled { ref shape, scale } => Scaled::new(shape.form()?, scale)?,
            ref other => return Err(NoSolid::Modelled(format!("shape {other:?}"))),
        })
    }

    fn part(&self, pose: Isometry3<f64>) -> Result<CsgPart, NoSolid> {
        match self {
            Self::Csg(spec) => Ok(CsgPart::tree(spec.tree()?, pose)),
            Self::Scaled { shape, scale } if shape.is_csg() => Ok(shape.part(pose)?.scaled(*scale)),
            spec => Ok(CsgPart::new(spec.form()?, pose)),
        }
    }
}

impl CsgSpec {
    fn tree(&self) -> Result<CsgTree, NoSolid> {
        let parts =
            self.children.iter().map(|child| child.shape.part(child.pose)).collect::<Result<Vec<_>, _>>()?;
        Ok(match self.op {
            CsgOp::Union => CsgTree::union(parts),
            CsgOp::Intersection => CsgTree::intersection(parts),
            CsgOp::Difference => CsgTree::difference(parts),
        })
    }
}
