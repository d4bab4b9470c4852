//! What an entity is shaped like: a closed form, a mesh, or somebody's own surface.
//!
//! Shapes are cheap to clone: what is large is shared.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::capsule::Capsule;
use crate::chart::Chart;
use crate::cone::Cone;
use crate::csg::Csg;
use crate::cuboid::Cuboid;
use crate::cylinder::Cylinder;
use crate::ellipsoid::Ellipsoid;
use crate::mesh::Mesh;
use crate::nurbs::Nurbs;
use crate::plane::Plane;
use crate::scaled::Scaled;
use crate::shared::Shared;
use crate::sphere::Sphere;
use crate::surface::{Surface, SurfacePoint};
use crate::torus::Torus;

/// Shape of an entity, in the entity's frame B.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A surface with a closed form.
    Form(Form),
    /// Triangles.
    Mesh(Shared<Mesh>),
    /// A tree of closed forms.
    Csg(Shared<Csg>),
    /// Rational patches.
    Nurbs(Shared<Nurbs>),
    /// Somebody's own surface.
    Own(Shared<dyn OwnSurface>),
}

/// A [`Surface`] that an entity can share between threads: every surface is one that is `Debug`, `Send` and `Sync`.
pub trait OwnSurface: Surface + std::fmt::Debug + Send + Sync {
    /// Shows `ask` the surface grown by `radius_m` (m), see [`Surface::grown`]; `false` where there is none.
    ///
    /// Behind a pointer nothing of unknown size can be answered; shown, it needs no memory.
    fn show_grown(&self, radius_m: f64, ask: &mut dyn FnMut(&dyn Surface)) -> bool;
}

impl<S: Surface + std::fmt::Debug + Send + Sync> OwnSurface for S {
    fn show_grown(&self, radius_m: f64, ask: &mut dyn FnMut(&dyn Surface)) -> bool {
        self.grown(radius_m).inspect(|grown| ask(grown)).is_some()
    }
}

/// The closed forms, dispatched without indirection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A half-space.
    Plane(Plane),
    /// A ball around B's origin.
    Sphere(Sphere),
    /// A box.
    Cuboid(Cuboid),
    /// A cylinder with caps.
    Cylinder(Cylinder),
    /// A cone, whole or cut off, with caps.
    Cone(Cone),
    /// A cylinder with half balls on its ends.
    Capsule(Capsule),
    /// A tube bent to a ring.
    Torus(Torus),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
    /// One of them scaled by different factors along its axes.
    Scaled(Scaled),
}

impl Shape {
    /// Somebody's own surface.
    pub fn own(surface: impl OwnSurface + 'static) -> Self {
        let surface: Arc<dyn OwnSurface> = Arc::new(surface);
        Self::Own(surface.into())
    }

    /// Whether a finger of this radius can feel it: every shape is felt by points, some by balls.
    pub fn is_felt_by(&self, finger_radius_m: f64) -> bool {
        let is_point = finger_radius_m == 0.0;
        match self {
            Self::Form(form) => is_point || form.grown(finger_radius_m).is_some(),
            Self::Mesh(_) => true,
            Self::Csg(_) | Self::Nurbs(_) => finger_radius_m >= 0.0,
            Self::Own(surface) => is_point || surface.show_grown(finger_radius_m, &mut |_| {}),
        }
    }
}

/// Where a picture lies on it.
impl Shape {
    /// Coordinates along the surface at one of its points; `None` where there are none: on trees of shapes, on meshes
    /// without texture coordinates and on own surfaces that tell none.
    pub fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        match self {
            Self::Form(form) => form.chart(at),
            Self::Mesh(mesh) => mesh.chart(at.piece, &at.point_B),
            Self::Own(surface) => surface.chart(at),
            _ => None,
        }
    }
}

impl From<Arc<Mesh>> for Shape {
    fn from(mesh: Arc<Mesh>) -> Self {
        Self::Mesh(mesh.into())
    }
}

impl From<Arc<Csg>> for Shape {
    fn from(csg: Arc<Csg>) -> Self {
        Self::Csg(csg.into())
    }
}

impl From<Arc<Nurbs>> for Shape {
    fn from(nurbs: Arc<Nurbs>) -> Self {
        Self::Nurbs(nurbs.into())
    }
}

impl<F: Into<Form>> From<F> for Shape {
    fn from(form: F) -> Self {
        Self::Form(form.into())
    }
}

/// Lists the closed forms once: how each becomes a [`Form`], and how a form asks whichever it is.
macro_rules! forms {
    ($($form:ident),*) => {
        $(impl From<$form> for Form {
            fn from(form: $form) -> Self {
                Self::$form(form)
            }
        })*

        impl Surface for Form {
            fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
                match self { $(Self::$form(form) => form.signed_distance(point_B)),* }
            }

            fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
                match self { $(Self::$form(form) => form.nearest(point_B)),* }
            }

            fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
                match self { $(Self::$form(form) => form.entry(from_B, to_B)),* }
            }

            fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
                match self { $(Self::$form(form) => form.settle(from, on_tangent_plane_B)),* }
            }

            fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
                match self { $(Self::$form(form) => form.tangent_offset(at)),* }
            }

            fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
                match self { $(Self::$form(form) => form.holds_outside(at, depth_m)),* }
            }

            fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
                match self { $(Self::$form(form) => form.chart(at)),* }
            }

            fn grown(&self, radius_m: f64) -> Option<Self> {
                match self { $(Self::$form(form) => form.grown(radius_m).map(Self::$form)),* }
            }
        }
    };
}

forms!(Plane, Sphere, Cuboid, Cylinder, Cone, Capsule, Torus, Ellipsoid, Scaled);
