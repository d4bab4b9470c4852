//! The point of a mesh that is nearest to a given one.
//!
//! Cost: about a microsecond near a surface of a million faces. Where very many faces are equally near, as at the
//! centre of a ball, all of these are looked at: it belongs into a tick only close to the surface.

use nalgebra::Vector3;

use super::closest::{Closest, closest_on};
use super::stack::Stack;
use super::{Bvh, Triangles};
use crate::surface::Feature;

/// The point of a mesh nearest to a given one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Index of the face it belongs to; the lowest of those equally near.
    pub face: u32,
    /// Whether it lies inside the face, on an edge or on a vertex of it.
    pub feature: Feature,
    /// Which edge or corner of the face; 0 if it lies inside.
    pub corner: usize,
    /// In the object's frame \[m\].
    pub point_B: Vector3<f64>,
    /// From the given point, never negative \[m\].
    pub distance_m: f64,
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// The nearest point of the faces, of which there must be at least one.
    ///
    /// A point that is not finite, or so far away that its squared distance is not (1e150 m), is answered by a
    /// corner of the first face at infinite distance.
    pub fn nearest(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> Nearest {
        let first = triangles.corners(&triangles.faces[0])[0];
        let mut best =
            Closest { feature: Feature::Vertex, corner: 0, point_B: first, squared_distance: f64::MAX };
        let mut best_face = u32::MAX;
        let mut stack = Stack::<f64>::new();
        while let Some((squared_distance, child)) = stack.pop() {
            if squared_distance > best.squared_distance {
                continue;
            }
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push_sorted(node.squared_distances(p_B), &node.children, best.squared_distance);
                continue;
            }
            for index in child.index()..child.index() + child.count() {
                let face = &triangles.faces[index];
                let found = closest_on(face, &triangles.corners(face), p_B);
                let (index, is_tie) = (index as u32, found.squared_distance == best.squared_distance);
                if found.squared_distance < best.squared_distance || is_tie && index < best_face {
                    (best, best_face) = (found, index);
                }
            }
        }
        let Closest { feature, corner, point_B, squared_distance } = best;
        if best_face == u32::MAX {
            return Nearest { face: 0, feature, corner, point_B, distance_m: f64::INFINITY };
        }
        Nearest { face: best_face, feature, corner, point_B, distance_m: squared_distance.sqrt() }
    }
}
