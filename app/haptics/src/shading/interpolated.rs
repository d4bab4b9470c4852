//! Normals of the vertices, interpolated over the faces.

use nalgebra::Vector3;

use super::at::{Field, corners_B};
use crate::mesh::{Face, Mesh, VertexNormals};

impl Field for VertexNormals {
    #[inline(always)]
    fn vertex_normals(&self) -> &VertexNormals {
        self
    }

    /// Continuous across blunt edges: on an edge the normals at its two ends alone count, the same from either side.
    #[inline(always)]
    fn normal(&self, mesh: &Mesh, index: usize, face: &Face, point_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        let [at_a_B, at_b_B, at_c_B] = self.at_corners(index, face);
        let [a_B, b_B, c_B] = corners_B(mesh, face);
        let (to_b_B, to_c_B, to_point_B) = (b_B - a_B, c_B - a_B, point_B - a_B);
        // Twice the areas of the triangles that the point makes with the sides opposite of the corners. A point that
        // rounding, or the radius of a ball, put beyond a side counts as on it.
        let from_ab_B = face.normal_B.cross(&to_b_B);
        let whole_m2 = from_ab_B.dot(&to_c_B);
        let of_c_m2 = from_ab_B.dot(&to_point_B);
        let of_b_m2 = to_c_B.cross(&face.normal_B).dot(&to_point_B);
        let of_a_m2 = whole_m2 - of_b_m2 - of_c_m2;
        //= melder#4.25
        Some(at_a_B * of_a_m2.max(0.0) + at_b_B * of_b_m2.max(0.0) + at_c_B * of_c_m2.max(0.0))
    }
}
