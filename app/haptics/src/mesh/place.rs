//! Where on a mesh a god-object is, and on which side of it.

use nalgebra::Vector3;

use super::face::{Face, Link};
use super::{Hit, Mesh, Nearest};
use crate::surface::Feature;

/// A point of a mesh and the feature it lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) point_B: Vector3<f64>,
    /// Feature that holds the HIP back there.
    pub(crate) on: On,
    /// Feature that it lies on: of a corner or an edge, a face that meets there may hold the HIP back.
    at: On,
}

/// A feature of a mesh, told by one of its faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum On {
    Face(Side),
    /// The edge of this number of the face.
    Edge(Side, usize),
    /// The corner of this number of the face.
    Vertex(Side, usize),
    /// Where two faces pass through each other.
    Crossing(Side, Side),
}

/// One of the two sides of a face: the back of a sheet can be felt, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Side {
    pub(crate) face: u32,
    pub(crate) is_back: bool,
}

/// One side of a face with its plane: what is in front of the plane is free.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facet<'m> {
    pub(crate) side: Side,
    pub(crate) face: &'m Face,
    /// Unit normal, towards the finger.
    pub(crate) normal_B: Vector3<f64>,
    pub(crate) offset_m: f64,
}

impl Place {
    #[inline(always)]
    pub(crate) fn new(point_B: Vector3<f64>, on: On) -> Self {
        Self { point_B, on, at: on }
    }

    #[inline]
    pub(crate) fn hit(hit: &Hit) -> Self {
        Self::new(hit.point_B, On::Face(Side { face: hit.face, is_back: !hit.is_front }))
    }

    /// The same place, with nothing said of what holds the HIP back.
    #[inline(always)]
    pub(crate) fn anew(self) -> Self {
        Self { on: self.at, ..self }
    }

    pub(crate) fn nearest(nearest: &Nearest) -> Self {
        let side = Side { face: nearest.face, is_back: false };
        let on = match nearest.feature {
            Feature::Edge => On::Edge(side, nearest.corner),
            Feature::Vertex => On::Vertex(side, nearest.corner),
            _ => On::Face(side),
        };
        Self::new(nearest.point_B, on)
    }

    /// A face that it lies on.
    pub(crate) fn face(&self) -> u32 {
        self.on.side().face
    }

    pub(crate) fn feature(&self) -> Feature {
        match self.on {
            On::Face(_) => Feature::Face,
            On::Edge(..) | On::Crossing(..) => Feature::Edge,
            On::Vertex(..) => Feature::Vertex,
        }
    }
}

impl On {
    /// The face by which it is told, from the side of the finger.
    #[inline(always)]
    pub(crate) fn side(self) -> Side {
        let (Self::Face(side) | Self::Edge(side, _) | Self::Vertex(side, _) | Self::Crossing(side, _)) = self;
        side
    }
}

impl Side {
    /// The side that one comes to across an edge; `None` where the mesh ends.
    #[inline]
    pub(crate) fn across(self, link: Link) -> Option<Self> {
        (!link.is_boundary()).then(|| Self { face: link.face(), is_back: self.is_back != link.is_turned() })
    }
}

impl<'m> Facet<'m> {
    #[inline(always)]
    pub(crate) fn of(mesh: &'m Mesh, side: Side) -> Self {
        let face = &mesh.faces[side.face as usize];
        let (normal_B, offset_m) =
            if side.is_back { (-face.normal_B, -face.offset_m) } else { (face.normal_B, face.offset_m) };
        Self { side, face, normal_B, offset_m }
    }

    /// How far below the plane a point lies \[m\].
    #[inline(always)]
    pub(crate) fn depth_m(&self, point_B: &Vector3<f64>) -> f64 {
        self.offset_m - self.normal_B.dot(point_B)
    }

    /// From the start of an edge to its end \[m\].
    #[inline(always)]
    pub(crate) fn edge_B(&self, mesh: &Mesh, edge: usize) -> (Vector3<f64>, Vector3<f64>) {
        let start_B = self.corner_B(mesh, edge);
        (start_B, self.corner_B(mesh, next(edge)) - start_B)
    }

    #[inline(always)]
    pub(crate) fn corners_B(&self, mesh: &Mesh) -> [Vector3<f64>; 3] {
        let [a, b, c] = self.face.vertices;
        [mesh.vertices[a as usize], mesh.vertices[b as usize], mesh.vertices[c as usize]]
    }

    #[inline(always)]
    pub(crate) fn corner_B(&self, mesh: &Mesh, corner: usize) -> Vector3<f64> {
        mesh.vertices[self.face.vertices[corner] as usize]
    }

    /// Across an edge into the face, along its plane; as long as `edge_B`. The same for both sides.
    #[inline(always)]
    pub(crate) fn inward_B(&self, edge_B: &Vector3<f64>) -> Vector3<f64> {
        self.face.normal_B.cross(edge_B)
    }
}

/// The corner after this one, which is also where the edge of this number ends.
#[inline]
pub(crate) fn next(corner: usize) -> usize {
    if corner == 2 { 0 } else { corner + 1 }
}

/// The corner before this one, and the edge that leads from it to this one.
#[inline]
pub(crate) fn previous(corner: usize) -> usize {
    if corner == 0 { 2 } else { corner - 1 }
}
