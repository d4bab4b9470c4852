//! The point of one triangle that is closest to a given one.
//!
//! Model: where the point's projection lies strictly inside all three edges it is the answer, else the closest
//! point of the three edges is. Other than by barycentric regions (Ericson 2004), no difference of products decides
//! between corners of a triangle with a tiny angle.
//!
//! Invariant: an edge is measured from its vertex of lower index, so that the faces on both sides of it find the
//! same point, to the last bit.

use nalgebra::Vector3;

use crate::mesh::Face;
use crate::surface::Feature;

/// A point of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closest {
    pub(super) feature: Feature,
    /// Which edge or corner.
    pub(super) corner: usize,
    pub(super) point_B: Vector3<f64>,
    pub(super) squared_distance: f64,
}

pub(super) fn closest_on(face: &Face, corners: &[Vector3<f64>; 3], p: &Vector3<f64>) -> Closest {
    let height = face.normal_B.dot(p) - face.offset_m;
    let is_above = (0..3).all(|edge| {
        let (from, to) = canonical(face, corners, edge);
        let left = face.normal_B.dot(&(to.1 - from.1).cross(&(p - from.1)));
        if from.0 == edge { left > 0.0 } else { left < 0.0 }
    });
    if is_above {
        let point_B = p - face.normal_B * height;
        return Closest { feature: Feature::Face, corner: 0, point_B, squared_distance: height * height };
    }
    let mut best = closest_on_edge(face, corners, 0, p);
    for edge in 1..3 {
        let other = closest_on_edge(face, corners, edge, p);
        if other.squared_distance < best.squared_distance {
            best = other;
        }
    }
    best
}

fn closest_on_edge(face: &Face, corners: &[Vector3<f64>; 3], edge: usize, p: &Vector3<f64>) -> Closest {
    let (from, to) = canonical(face, corners, edge);
    let along = to.1 - from.1;
    let reach = along.dot(&(p - from.1));
    let length_squared = along.norm_squared();
    let (feature, corner, point_B) = match reach {
        reach if reach <= 0.0 => (Feature::Vertex, from.0, from.1),
        reach if reach >= length_squared => (Feature::Vertex, to.0, to.1),
        _ => (Feature::Edge, edge, from.1 + along * (reach / length_squared)),
    };
    Closest { feature, corner, point_B, squared_distance: (p - point_B).norm_squared() }
}

/// The ends of an edge, each with its corner, the vertex of lower index first.
fn canonical(
    face: &Face,
    corners: &[Vector3<f64>; 3],
    edge: usize,
) -> ((usize, Vector3<f64>), (usize, Vector3<f64>)) {
    let next = (edge + 1) % 3;
    let (from, to) = ((edge, corners[edge]), (next, corners[next]));
    if face.vertices[edge] < face.vertices[next] { (from, to) } else { (to, from) }
}
