//! What contact asks of a convex form: its farthest point in a direction, and the facet that lies there.
//!
//! Model: a form is a core with sharp edges, and all points within a radius of it (the core of a ball is a point, that of
//! a capsule a piece of its axis). Contact is found between cores, which are exact however round the form is.
//! A scaled form is its unscaled core seen through the scaling, without a radius of its own.
//! Frames: B is the frame in which two forms meet; each form is placed in it.

use haptics::Form;
use haptics::mesh::Mesh;
use nalgebra::{Isometry3, Matrix3, Vector3};

use super::mesh_corner::Corner;

/// A convex form, or a convex mesh, placed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Convex<'m> {
    pub(super) core: Core<'m>,
    /// All points within this distance of the core belong to it \[m\].
    pub(super) radius_m: f64,
    /// Scaled along its axes.
    factors: Option<Vector3<f64>>,
    pub(super) rotation: Matrix3<f64>,
    pub(super) origin: Vector3<f64>,
}

/// What is left of a form without its radius.
#[derive(Debug, Clone, Copy)]
pub(super) enum Core<'m> {
    Point,
    /// A piece of the y axis, and a radius that scaling has made no radius.
    Segment {
        half_m: f64,
        swollen_m: f64,
    },
    Box {
        half_m: Vector3<f64>,
    },
    Frustum {
        half_m: f64,
        /// Of bottom and top.
        radii_m: [f64; 2],
    },
    Ellipsoid {
        radii_m: Vector3<f64>,
    },
    Hull(&'m Mesh),
}

impl<'m> Convex<'m> {
    /// `None` for planes and rings.
    pub(super) fn of(form: &Form, pose: &Isometry3<f64>) -> Option<Self> {
        let (form, factors) = match form {
            Form::Scaled(scaled) => (scaled.unscaled(), Some(Vector3::from(scaled.factors()))),
            form => (*form, None),
        };
        let (core, mut radius_m) = match form {
            Form::Sphere(sphere) => (Core::Point, sphere.radius_m()),
            Form::Capsule(c) => (Core::Segment { half_m: 0.5 * c.length_m(), swollen_m: 0.0 }, c.radius_m()),
            Form::Cuboid(cuboid) => (Core::Box { half_m: Vector3::from(cuboid.size_m()) * 0.5 }, 0.0),
            Form::Cylinder(c) => {
                (Core::Frustum { half_m: 0.5 * c.length_m(), radii_m: [c.radius_m(); 2] }, 0.0)
            }
            Form::Cone(c) => {
                let radii_m = [c.radius_bottom_m(), c.radius_top_m()];
                (Core::Frustum { half_m: 0.5 * c.length_m(), radii_m }, 0.0)
            }
            Form::Ellipsoid(ellipsoid) => (Core::Ellipsoid { radii_m: ellipsoid.radii_m().into() }, 0.0),
            _ => return None,
        };
        let core = match core {
            Core::Segment { half_m, .. } if factors.is_some() => {
                Core::Segment { half_m, swollen_m: std::mem::take(&mut radius_m) }
            }
            core => core,
        };
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        Some(Self { core, radius_m, factors, rotation, origin: pose.translation.vector })
    }

    /// `None` for meshes that are not convex.
    pub(super) fn of_mesh(mesh: &'m Mesh, pose: &Isometry3<f64>) -> Option<Self> {
        mesh.convex_inner_m()?;
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let origin = pose.translation.vector;
        Some(Self { core: Core::Hull(mesh), radius_m: 0.0, factors: None, rotation, origin })
    }

    /// The core's farthest point in a direction, which need not be a unit vector.
    #[inline]
    pub(super) fn support(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let own = self.rotation.tr_mul(direction);
        let at = match self.factors {
            None => self.core.support(&own),
            Some(f) => self.core.support(&own.component_mul(&f)).component_mul(&f),
        };
        self.rotation * at + self.origin
    }

    /// A direction in the form's own frame, before scaling.
    pub(super) fn own_direction(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let own = self.rotation.tr_mul(direction);
        self.factors.map_or(own, |f| own.component_mul(&f))
    }

    /// A vector of the form's own frame, before scaling, in the frame in which it is placed.
    pub(super) fn placed_vector(&self, own: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * self.factors.map_or(*own, |f| own.component_mul(&f))
    }

    pub(super) fn placed_point(&self, own: &Vector3<f64>) -> Vector3<f64> {
        self.placed_vector(own) + self.origin
    }

    /// About the middle of it.
    pub(super) fn middle(&self) -> Vector3<f64> {
        let Core::Hull(mesh) = self.core else { return self.origin };
        let [low, high] = mesh.bounds_B();
        self.placed_point(&((low + high) * 0.5))
    }

    /// A measure of its size: of the ball within \[m\].
    pub(super) fn inner_m(&self) -> f64 {
        let of_core = match self.core {
            Core::Point | Core::Segment { .. } => 0.0,
            Core::Box { half_m } => half_m.min(),
            Core::Frustum { half_m, radii_m: [a, b] } => half_m.min(0.5 * (a + b)),
            Core::Ellipsoid { radii_m } => radii_m.min(),
            Core::Hull(mesh) => mesh.convex_inner_m().unwrap_or(0.0),
        };
        let swollen_m = if let Core::Segment { swollen_m, .. } = self.core { swollen_m } else { 0.0 };
        (of_core + swollen_m) * self.factors.map_or(1.0, |f| f.min()) + self.radius_m
    }
}

impl Core<'_> {
    #[inline]
    fn support(&self, d: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Point => Vector3::zeros(),
            Self::Segment { half_m, swollen_m } => {
                let end = Vector3::new(0.0, half_m.copysign(d.y), 0.0);
                let length = d.norm();
                if *swollen_m > 0.0 && length > 0.0 { end + d * (swollen_m / length) } else { end }
            }
            Self::Box { half_m } => half_m.zip_map(d, f64::copysign),
            Self::Frustum { half_m, radii_m: [bottom_m, top_m] } => {
                let across = (d.x * d.x + d.z * d.z).sqrt();
                let is_top = top_m * across + half_m * d.y > bottom_m * across - half_m * d.y;
                let (radius_m, y) = if is_top { (*top_m, *half_m) } else { (*bottom_m, -*half_m) };
                let part = if across > 0.0 { radius_m / across } else { 0.0 };
                Vector3::new(d.x * part, y, d.z * part)
            }
            Self::Ellipsoid { radii_m } => {
                let stretched = d.component_mul(radii_m);
                let length = stretched.norm();
                if length > 0.0 { stretched.component_mul(radii_m) / length } else { Vector3::zeros() }
            }
            Self::Hull(mesh) => farthest(mesh, d),
        }
    }
}

/// The vertex of a convex mesh that lies farthest in a direction.
fn farthest(mesh: &Mesh, d: &Vector3<f64>) -> Vector3<f64> {
    let vertices = mesh.vertices();
    if vertices.len() <= FEW {
        let farther = |most: &'_ Vector3<f64>, at: &Vector3<f64>| d.dot(at) > d.dot(most);
        return vertices.iter().fold(vertices[0], |most, at| if farther(&most, at) { *at } else { most });
    }
    *farthest_corner(mesh, d).point_M(mesh)
}

/// The corner of a face of a convex mesh that lies farthest in a direction.
pub(super) fn farthest_corner(mesh: &Mesh, d: &Vector3<f64>) -> Corner {
    let from = Corner::new(mesh.extreme(d).unwrap_or(0));
    // Over what is flat it does not go on for less.
    let per_step = (STEP * mesh.extent_m() * d.norm()).recip();
    from.climb(mesh, |corner| (d.dot(corner.point_M(mesh)) * per_step).floor()).0
}

/// By so much a vertex must be farther to be the farthest, in extents.
const STEP: f64 = 1e-9;
/// Of so few vertices each is looked at.
const FEW: usize = 24;
