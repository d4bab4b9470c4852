//! Triangle meshes for the Friction Cone Algorithm: faces that know their neighbours.
//!
//! Problem: a god-object walks from face to face, a thousand times a second, on meshes of a million triangles; no
//! step of it may depend on how large the mesh is (Melder ch. 4.2.3).
//!
//! Model: a Face Directed Connection Graph. A [`Face`] record of one cache line holds its plane, its three
//! vertices and a [`Link`] across each of its edges; faces and vertices are stored in spatial order, whatever the
//! order of the input was.
//!
//! Frames and signs: object frame B; vertices run counter-clockwise seen from outside, normals leave the material.
//!
//! [`Mesh::build`] makes one of any [`TriangleSoup`], repairs what can be repaired and says so:
//! ```
//! use haptics::mesh::{Mesh, Sides, make};
//!
//! let mut soup = make::cuboid([0.1, 0.2, 0.3]);
//! soup.faces[5].swap(1, 2);
//! let (mesh, report) = Mesh::build(soup)?;
//! assert_eq!(mesh.sides(), Sides::Solid);
//! assert_eq!(report.flipped.first, Some(5));
//! println!("{report}");
//! # Ok::<(), haptics::mesh::MeshError>(())
//! ```

mod beside;
mod build;
mod bvh;
mod change;
mod cone;
mod convexity;
mod crack;
mod crossed;
mod crossing;
mod crowded;
pub(crate) mod draw;
mod error;
mod extremes;
mod face;
mod facing;
mod fan;
mod fan_crossing;
mod fit;
mod fold;
mod hole;
mod inverted;
mod junction;
mod labels;
mod ledge;
pub mod make;
mod mesh_cone;
mod nesting;
mod normals;
mod order;
mod pinch;
mod place;
mod query;
mod repair;
mod report;
mod rolling;
mod sealed;
mod sliver;
mod soup;
mod topology;
mod touching;
mod uv;
mod walk;
mod weld;
mod winding;

#[cfg(test)]
pub(crate) use bvh::POPPED;
pub(crate) use bvh::TooMany;
pub use bvh::{Bvh, Hit, Linear, Nearest, Triangles};
pub use error::MeshError;
pub use face::{Face, Link};
pub use hole::CloseHoles;
pub use labels::FaceData;
pub use mesh_cone::{Beginning, MeshCone};
pub use normals::{SHARPEST_CREASE_RAD, VertexNormals};
pub(crate) use repair::area_vector;
pub(crate) use report::plural;
pub use report::{Finding, MeshReport, NarrowGaps, OpenHole, OpenHoles, ShortRims};
pub(crate) use rolling::BallOnMesh;
pub use soup::TriangleSoup;
pub use uv::CornerUv;
pub use walk::MAX_FEATURE_CHANGES;

use extremes::Extremes;
use nalgebra::Vector3;
use std::fmt;
use std::sync::OnceLock;
use uv::FaceUv;

/// The most faces around a vertex: a walk goes round it within a tick.
pub const MAX_VALENCE: u32 = 16_384;

/// A triangle mesh whose faces know their neighbours.
pub struct Mesh {
    faces: Box<[Face]>,
    vertices: Box<[Vector3<f64>]>,
    bvh: Bvh,
    sides: Sides,
    /// Whether any part is closed.
    has_inside: bool,
    extent_m: f64,
    longest_edge_m: f64,
    /// Zero where no sheet crosses or meets anything, and nothing is inverted.
    point_radius_m: f64,
    /// There are edges of three and more faces, of whatever parts.
    has_crowds: bool,
    /// Of a convex solid.
    convex_inner_m: Option<f64>,
    /// Of all meshes that this process has built, which. An address would be another mesh's as soon as this one is gone.
    identity: u64,
    /// Texture coordinates of each face's corners, where somebody gave any: 24 bytes a face beside its 64.
    uv: Option<Box<[FaceUv]>>,
    /// The label of each face, where somebody gave any.
    labels: Option<Box<[u16]>>,
    /// Vertices that lie farthest out, if somebody has asked for them.
    extremes: OnceLock<Extremes>,
}

/// From where a mesh, or a part of it that hangs together by edges, can be felt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// Closed and orientable: it has an inside, and is felt from outside.
    Solid,
    /// Open, or not orientable as a Klein bottle is: felt from both sides.
    Sheet,
}

impl Mesh {
    /// In spatial order.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// In the object's frame B \[m\], in order of their first use by a face. All are used. Two are equal only where
    /// parts touch at that point alone: each of them has its own.
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// Radius with which a point rolls over it as a ball \[m\]; 0: it walks. What passes through a sheet is on both sides of
    /// it, and of a point on the line in which they cross, or in which sheets meet, nobody can tell the side; of a ball beside
    /// it everybody can. So it is in pockets of a solid that is turned inside out there.
    pub fn point_radius_m(&self) -> f64 {
        self.point_radius_m
    }

    /// The same, felt from both sides though it may be closed: a room, felt by whoever is in it.
    #[must_use]
    pub fn into_sheet(mut self) -> Self {
        if self.has_crowds || self.faces.iter().any(|face| face.is_crossed) {
            self.point_radius_m = self.least_ball_m();
        }
        for face in &mut self.faces {
            face.sides = Sides::Sheet;
            (face.is_crossed, face.is_beside, face.is_at_ledge) = (false, false, false);
        }
        Self { sides: Sides::Sheet, has_inside: false, convex_inner_m: None, ..self }
    }

    /// Solid if all of its parts are; each [`Face`] says it of its own part.
    pub fn sides(&self) -> Sides {
        self.sides
    }

    /// Whether any of its parts is solid.
    pub fn has_inside(&self) -> bool {
        self.has_inside
    }

    /// Of all edges \[m\]: no point of an edge is farther than half of it from a vertex.
    pub fn longest_edge_m(&self) -> f64 {
        self.longest_edge_m
    }

    /// Largest coordinate, without its sign \[m\]: what rounding errors are measured by.
    pub fn extent_m(&self) -> f64 {
        self.extent_m
    }
}

/// Its size alone: a million faces would help nobody.
impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [faces, vertices] = [self.faces.len(), self.vertices.len()];
        write!(f, "Mesh {{ {faces} faces, {vertices} vertices, {:?} }}", self.sides)
    }
}
