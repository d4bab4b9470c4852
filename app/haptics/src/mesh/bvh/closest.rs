//! The point of one triangle that is closest to a given one.
//!
//! Model: where the point's projection lies strictly inside all three edges it is the answer, else the closest
//! point of the three edges is. Other than by barycentric regions (Ericson 2004), no difference of products decides
//! between corners of a triangle with a tiny angle.
//!
//! Invariant: an edge is measured from its vertex of lower index, so that the faces on both sides of it find the
//! same point, to the last bit.

use nalgebra::Vector3;

use super::{larger, smaller};
use crate::mesh::Face;
use crate::surface::Feature;

/// A point of a triangle.
#[derive(Debug, Clone, Copy)]
pub(in crate::mesh) struct Closest {
    pub(in crate::mesh) feature: Feature,
    /// Which edge or corner.
    pub(in crate::mesh) corner: usize,
    pub(in crate::mesh) point_B: Vector3<f64>,
    pub(in crate::mesh) squared_distance: f64,
}

/// None may be answered if it is farther than the root of `at_most`, which saves half of the work.
#[inline]
pub(in crate::mesh) fn closest_on(
    face: &Face,
    corners: &[Vector3<f64>; 3],
    p: &Vector3<f64>,
    at_most: f64,
) -> Option<Closest> {
    let edges = [corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]];
    let to_p = [p - corners[0], p - corners[1], p - corners[2]];
    let is_left_of = |i: usize| face.normal_B.dot(&edges[i].cross(&to_p[i])) > 0.0;
    if is_left_of(0) & is_left_of(1) & is_left_of(2) {
        let height = face.normal_B.dot(p) - face.offset_m;
        let point_B = p - face.normal_B * height;
        return Some(Closest {
            feature: Feature::Face,
            corner: 0,
            point_B,
            squared_distance: height * height,
        });
    }
    let squared_distance = |i: usize| squared_distance_from_edge(&edges[i], &to_p[i]);
    let (first, second, third) = (squared_distance(0), squared_distance(1), squared_distance(2));
    let least = smaller(smaller(first, second), third);
    if least > at_most {
        return None;
    }
    let edge = if least == first {
        0
    } else if least == second {
        1
    } else {
        2
    };
    Some(closest_on_edge(face, corners, edge, p))
}

/// Good enough to choose an edge by.
#[inline(always)]
fn squared_distance_from_edge(edge: &Vector3<f64>, to_p: &Vector3<f64>) -> f64 {
    let along = smaller(larger(edge.dot(to_p) / edge.norm_squared(), 0.0), 1.0);
    (to_p - edge * along).norm_squared()
}

/// From the vertex of lower index to the other.
fn closest_on_edge(face: &Face, corners: &[Vector3<f64>; 3], edge: usize, p: &Vector3<f64>) -> Closest {
    let next = (edge + 1) % 3;
    let (from, to) = if face.vertices[edge] < face.vertices[next] { (edge, next) } else { (next, edge) };
    let along = corners[to] - corners[from];
    let reach = along.dot(&(p - corners[from]));
    let length_squared = along.norm_squared();
    let (feature, corner, point_B) = if reach <= 0.0 {
        (Feature::Vertex, from, corners[from])
    } else if reach >= length_squared {
        (Feature::Vertex, to, corners[to])
    } else {
        (Feature::Edge, edge, corners[from] + along * (reach / length_squared))
    };
    Closest { feature, corner, point_B, squared_distance: (p - point_B).norm_squared() }
}
