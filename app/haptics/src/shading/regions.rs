//! Regions of activation: faces stay flat, and are rounded towards their edges.
//!
//! Printed (Melder eq. 4.28-4.29): at a distance from the edge below `l` the normal is mixed from those of both faces,
//! by `alpha = dist / l`. Corrected: `alpha = 1/2 + dist / (2 l)`; as printed each side has the *other* face's normal
//! at the edge, and the force leaps there. Printed for several regions: one after the other, by which the result
//! depends on their order, and leaps where an edge is crossed near its end.
//!
//! Model for several: a face f with neighbours i at the distances `c_i l` has
//!
//!   N = n_f + sum_i g_i / 2 (n_i - n_f),   g_i = (1 - c_i) prod_j c_j / (c_i + c_j - c_i c_j),   c_i = min(1, dist_i / l)
//!
//! With one region g = 1 - c, which is eq. 4.29. On an edge (c_i = 0) g_i is 1 and every other 0, whatever they were a
//! step before: the mean of the two faces, from either side. That leaves the vertices, around which N takes the value of
//! each edge in turn. There, the normal of the vertex is mixed in, by a share w that falls from 1 at the vertex to 0 at
//! the distance `r`: `(1 - w) N + w N_vertex`, w depending on the distance alone, hence the same from all faces around.
//! N stays bounded where 1 - w vanishes, so that all is continuous.
//!
//! Lengths: `l` is at most the radius of the circle inside the face, so that no more than two regions overlap. `r` is the
//! smallest `l` around the vertex: it ends before the opposite edges, and before the regions of other vertices begin.
//!
//! Creases have no region.

use nalgebra::Vector3;

use super::at::{Field, corners_B};
use crate::error::{ParameterError, above_zero};
use crate::mesh::{Face, Mesh, VertexNormals};

/// The regions of activation of a mesh. Beside the vertex normals 8 bytes for each vertex.
#[derive(Debug)]
pub struct Regions {
    normals: VertexNormals,
    length_m: f64,
    /// How far the normal of each vertex reaches (m).
    reach_m: Box<[f64]>,
}

impl Regions {
    /// Those of a mesh, this long; see [`super::Shading::regions`].
    ///
    /// Errors: a length that is not above 0, a crease angle that is not between 0 and pi (rad).
    pub fn of(mesh: &Mesh, length_m: f64, crease_angle_rad: f64) -> Result<Self, ParameterError> {
        let length_m = above_zero("length_m", length_m)?;
        let normals = VertexNormals::of(mesh, crease_angle_rad)?;
        let mut reach_m = vec![length_m; mesh.vertices().len()].into_boxed_slice();
        for face in mesh.faces() {
            let inradius_m = Triangle::of(mesh, face).inradius_m();
            for vertex in face.vertices {
                let reach_m = &mut reach_m[vertex as usize];
                *reach_m = reach_m.min(inradius_m);
            }
        }
        Ok(Self { normals, length_m, reach_m })
    }

    /// How much memory they take.
    pub fn bytes(&self) -> usize {
        self.normals.bytes() + size_of_val(&*self.reach_m)
    }

    /// The normal across an edge; `None` if there is none, or if the edge is a crease.
    #[inline(always)]
    fn over(&self, mesh: &Mesh, face: &Face, edge: usize) -> Option<Vector3<f64>> {
        let link = face.links[edge];
        if link.is_boundary() {
            return None;
        }
        let over_B = mesh.faces()[link.face() as usize].normal_B;
        let over_B = if link.is_turned() { -over_B } else { over_B };
        self.normals.joins(&face.normal_B, &over_B).then_some(over_B)
    }
}

impl Field for Regions {
    fn vertex_normals(&self) -> &VertexNormals {
        &self.normals
    }

    fn normal(&self, mesh: &Mesh, index: usize, face: &Face, point_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        let triangle = Triangle::of(mesh, face);
        let l_m = self.length_m.min(triangle.inradius_m());
        let distances_m = triangle.distances_m(face, point_B);
        let [a_m, b_m, c_m] = distances_m;
        if a_m.min(b_m).min(c_m) >= l_m {
            return None;
        }
        let mut normal_B =
            mixed(&face.normal_B, &distances_m.map(|m| m / l_m), |edge| self.over(mesh, face, edge));
        let at_corners_B = self.normals.at_corners(index, face);
        for (corner, at_corner_B) in at_corners_B.iter().enumerate() {
            let reach_m = self.reach_m[face.vertices[corner] as usize];
            let away_m = triangle.away_m(face, corner, point_B);
            normal_B = drawn_to_vertex(&normal_B, at_corner_B, away_m / reach_m);
        }
        Some(normal_B)
    }
}

/// The normal of a face near some of its edges, at these distances from them per length of a region; `over` tells the
/// normal across an edge that has one.
#[inline(always)]
pub(super) fn mixed<const N: usize>(
    own_B: &Vector3<f64>,
    distances: &[f64; N],
    over: impl Fn(usize) -> Option<Vector3<f64>>,
) -> Vector3<f64> {
    let mut over_B = [None; N];
    // A crease has no region: as if it were far away.
    let mut c = [1.0; N];
    for edge in 0..N {
        if distances[edge] < 1.0 {
            over_B[edge] = over(edge);
            c[edge] = if over_B[edge].is_some() { distances[edge].max(0.0) } else { 1.0 };
        }
    }
    let mut normal_B = *own_B;
    for edge in 0..N {
        let Some(over_B) = over_B[edge] else { continue };
        //= melder#4.28
        let mut alpha = 0.5 + 0.5 * c[edge];
        for other in (0..N).filter(|&other| other != edge) {
            let sum = c[edge] + c[other] - c[edge] * c[other];
            // At the vertex itself nothing of it counts.
            alpha = if sum > 0.0 { 1.0 - (1.0 - alpha) * (c[other] / sum) } else { 1.0 };
        }
        //= melder#4.29
        normal_B += (over_B - own_B) * (1.0 - alpha);
    }
    normal_B
}

/// Drawn towards a vertex' normal, at this distance from it per reach.
#[inline(always)]
pub(super) fn drawn_to_vertex(
    normal_B: &Vector3<f64>,
    vertex_B: &Vector3<f64>,
    distance: f64,
) -> Vector3<f64> {
    if distance < 1.0 { normal_B * distance + vertex_B * (1.0 - distance) } else { *normal_B }
}

/// A face's measures.
struct Triangle {
    corners_B: [Vector3<f64>; 3],
    edges_B: [Vector3<f64>; 3],
    lengths_m: [f64; 3],
}

impl Triangle {
    #[inline(always)]
    fn of(mesh: &Mesh, face: &Face) -> Self {
        let corners_B = corners_B(mesh, face);
        let [a_B, b_B, c_B] = corners_B;
        let [ab_B, bc_B, ca_B] = [b_B - a_B, c_B - b_B, a_B - c_B];
        Self { corners_B, edges_B: [ab_B, bc_B, ca_B], lengths_m: [ab_B.norm(), bc_B.norm(), ca_B.norm()] }
    }

    #[inline(always)]
    fn inradius_m(&self) -> f64 {
        let [a_m, b_m, c_m] = self.lengths_m;
        self.edges_B[0].cross(&self.edges_B[1]).norm() / (a_m + b_m + c_m)
    }

    /// From its edges, along its plane.
    #[inline(always)]
    fn distances_m(&self, face: &Face, point_B: &Vector3<f64>) -> [f64; 3] {
        let from_edge_m = |i: usize| {
            let inward_B = face.normal_B.cross(&self.edges_B[i]);
            inward_B.dot(&(point_B - self.corners_B[i])) / self.lengths_m[i]
        };
        [from_edge_m(0), from_edge_m(1), from_edge_m(2)]
    }

    /// From a corner, along its plane.
    #[inline(always)]
    fn away_m(&self, face: &Face, corner: usize, point_B: &Vector3<f64>) -> f64 {
        let away_B = point_B - self.corners_B[corner];
        (away_B - face.normal_B * face.normal_B.dot(&away_B)).norm()
    }
}
