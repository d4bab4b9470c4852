//! Normals of the vertices, interpolated over the faces.

use nalgebra::Vector3;

use super::at::Field;
use crate::mesh::{Face, Mesh, VertexNormals};

impl Field for VertexNormals {
    #[inline(always)]
    fn vertex_normals(&self) -> &VertexNormals {
        self
    }

    /// Continuous across blunt edges: on an edge the normals at its two ends alone count, the same from either side.
    #[inline(always)]
    fn normal(&self, mesh: &Mesh, index: usize, face: &Face, point_B: &Vector3<f64>) -> Vector3<f64> {
        let [a_B, b_B, c_B] = face.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
        let (to_b_B, to_c_B, to_point_B) = (b_B - a_B, c_B - a_B, point_B - a_B);
        // Twice the areas of the triangles that the point makes with the sides opposite of the corners. A point that
        // rounding, or the radius of a ball, put beyond a side counts as on it.
        let whole_m2 = face.normal_B.dot(&to_b_B.cross(&to_c_B));
        let of_b_m2 = face.normal_B.dot(&to_point_B.cross(&to_c_B));
        let of_c_m2 = face.normal_B.dot(&to_b_B.cross(&to_point_B));
        let of_a_m2 = whole_m2 - of_b_m2 - of_c_m2;
        let [at_a_B, at_b_B, at_c_B] = self.at_corners(index, face);
        //= melder#4.25
        at_a_B * of_a_m2.max(0.0) + at_b_B * of_b_m2.max(0.0) + at_c_B * of_c_m2.max(0.0)
    }
}
