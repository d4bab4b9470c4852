//! The closed set of shapes an entity can have, dispatched without indirection.
//!
//! Own shapes go through [`crate::FrictionCone`] directly, which takes any [`Surface`].

use nalgebra::Vector3;

use crate::plane::Plane;
use crate::sphere::Sphere;
use crate::surface::{Surface, SurfacePoint};

/// Shape of an entity, in the entity's frame B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A half-space.
    Plane(Plane),
    /// A ball around B's origin.
    Sphere(Sphere),
}

impl From<Plane> for Shape {
    fn from(plane: Plane) -> Self {
        Self::Plane(plane)
    }
}

impl From<Sphere> for Shape {
    fn from(sphere: Sphere) -> Self {
        Self::Sphere(sphere)
    }
}

/// Asks whichever shape it is.
macro_rules! ask {
    ($shape:expr, $inner:ident => $answer:expr) => {
        match $shape {
            Shape::Plane($inner) => $answer,
            Shape::Sphere($inner) => $answer,
        }
    };
}

impl Surface for Shape {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        ask!(self, shape => shape.signed_distance(point_B))
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        ask!(self, shape => shape.nearest(point_B))
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        ask!(self, shape => shape.entry(from_B, to_B))
    }

    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        ask!(self, shape => shape.settle(from, on_tangent_plane_B))
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        ask!(self, shape => shape.tangent_offset(at))
    }

    fn grown(&self, radius_m: f64) -> Self {
        ask!(self, shape => shape.grown(radius_m).into())
    }
}
