//! Fans of faces around a vertex that pass through themselves.
//!
//! Problem: a walk goes from face to face around a vertex. Where two of them cross it goes on below one of them. To try each
//! pair of faces with a common vertex takes as long as all the rest of loading.
//!
//! Model: seen along the mean normal of its faces, by their angles, a fan that goes once around, with all faces turned to whoever looks,
//! lies side by side: no two of its faces cross. How often it goes around tells the number of its sectors that hold one
//! direction. Each pair is tried of all other fans: of rims, of what cannot be oriented, and of tips and saddles.
//!
//! Invariant: each vertex has one fan ([`pinch`](super::pinch)).
//! Cost: linear, some products for each corner; of fans that are tried, pairs.

use nalgebra::Vector3;

use super::Mesh;
use super::crossed::MOST_PAIRS;

/// What is known of the fan around a vertex.
#[derive(Clone, Copy)]
struct Fan {
    /// Sum of the normals of its faces, each by the chord of its angle: however many a cap is cut into, it counts as one.
    axis_B: Vector3<f64>,
    /// Sectors that hold one direction across the axis.
    around: u16,
    /// One of its faces is turned away from the axis, or ends.
    is_open: bool,
}

impl Mesh {
    /// True if two faces cross that have one vertex in common, and no more; in doubt as well.
    pub(super) fn has_crossed_fan(&self) -> bool {
        let mut fans = vec![Fan { axis_B: Vector3::zeros(), around: 0, is_open: false }; self.vertices.len()];
        for face in &self.faces {
            let corners = self.triangles().corners(face);
            let edges_B: [Vector3<f64>; 3] = std::array::from_fn(|edge| {
                (corners[(edge + 1) % 3] - corners[edge]).try_normalize(0.0).unwrap_or_default()
            });
            for corner in 0..3 {
                let chord = (edges_B[corner] + edges_B[(corner + 2) % 3]).norm();
                fans[face.vertices[corner] as usize].axis_B += face.normal_B * chord;
            }
        }
        for face in &self.faces {
            let corners = self.triangles().corners(face);
            let ends = face.links.map(|link| link.is_boundary() || link.is_turned());
            for corner in 0..3 {
                let [next, last] = [(corner + 1) % 3, (corner + 2) % 3];
                let fan = &mut fans[face.vertices[corner] as usize];
                let height = face.normal_B.dot(&fan.axis_B);
                let is_seen = height > 0.0 && height * height > SEEN * SEEN * fan.axis_B.norm_squared();
                fan.is_open |= !is_seen || ends[corner] || ends[last];
                let [from, to] = [next, last].map(|end| corners[end] - corners[corner]);
                // Any direction across the axis, and the one a quarter of a turn further.
                let across_B = fan.axis_B.cross(&Vector3::ith(fan.axis_B.iamin(), 1.0));
                let beside_B = fan.axis_B.cross(&across_B);
                let holds_it = beside_B.dot(&from) <= 0.0 && beside_B.dot(&to) > 0.0;
                fan.around = fan.around.saturating_add(u16::from(holds_it));
            }
        }
        let is_tried: Vec<bool> = fans.iter().map(|fan| fan.is_open || fan.around != 1).collect();
        drop(fans);
        let corners = |i: u32| self.faces[i as usize].vertices.map(|vertex| (vertex, i));
        let all = (0..self.faces.len() as u32).flat_map(corners);
        let mut tried: Vec<(u32, u32)> = all.filter(|(vertex, _)| is_tried[*vertex as usize]).collect();
        tried.sort_unstable();
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        tried.chunk_by(|(a, _), (b, _)| a == b).any(|fan| {
            fan.iter().enumerate().any(|(at, &(_, i))| {
                fan[at + 1..].iter().any(|&(_, j)| {
                    left -= 1;
                    let pair = [i, j].map(|face| &self.faces[face as usize]);
                    let common = pair[0].vertices.iter().filter(|vertex| pair[1].vertices.contains(vertex));
                    left == 0 || common.count() == 1 && self.crossing(pair).is_some()
                })
            })
        })
    }
}

/// Cosine between axis and normal of faces that are surely seen along it: no rounding turns them away.
const SEEN: f64 = 0.05;
