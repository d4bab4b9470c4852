//! Whether a point is inside a closed mesh.
//!
//! Model: the sign of the distance to the nearest point, by the normal there: of a face its own, of an edge the sum
//! of both faces', of a vertex the sum of all faces' around it, each weighted by its angle (Baerentzen & Aanaes
//! 2005). With any other weights a sharp vertex would call outside what is inside.
//!
//! Cost: that of [`Bvh::nearest`], and a walk around a vertex where one is nearest.

use nalgebra::Vector3;

use super::{Bvh, Triangles};
use crate::mesh::MAX_VALENCE;
use crate::surface::Feature;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Whether a point is inside or on the surface. The faces must be closed and wound consistently.
    pub fn is_inside(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> bool {
        let is_within_box =
            (0..3).all(|axis| p_B[axis] >= self.lower_B[axis] && p_B[axis] <= self.upper_B[axis]);
        if !is_within_box {
            return false;
        }
        let nearest = self.nearest(triangles, p_B);
        let face = &triangles.faces[nearest.face as usize];
        let normal = match nearest.feature {
            Feature::Edge => {
                let link = face.links[nearest.corner];
                if link.is_boundary() {
                    face.normal_B
                } else {
                    face.normal_B + triangles.faces[link.face() as usize].normal_B
                }
            }
            Feature::Vertex => normal_at_vertex(triangles, nearest.face, nearest.corner),
            _ => return face.normal_B.dot(p_B) - face.offset_m <= 0.0,
        };
        normal.dot(&(p_B - nearest.point_B)) <= 0.0
    }
}

/// Sum of the normals around a vertex, weighted by the angle of each face there; not of unit length.
fn normal_at_vertex(triangles: Triangles<'_>, first: u32, corner: usize) -> Vector3<f64> {
    let (mut face, mut corner) = (first, corner);
    let mut sum = Vector3::zeros();
    for _ in 0..MAX_VALENCE {
        let record = &triangles.faces[face as usize];
        let corners = triangles.corners(record);
        let (left, right) =
            (corners[(corner + 1) % 3] - corners[corner], corners[(corner + 2) % 3] - corners[corner]);
        sum += record.normal_B * left.cross(&right).norm().atan2(left.dot(&right));
        let link = record.links[corner];
        if link.is_boundary() || link.is_turned() {
            break;
        }
        (face, corner) = (link.face(), (link.edge() + 1) % 3);
        if face == first {
            break;
        }
    }
    sum
}
