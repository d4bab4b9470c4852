//! Walls within solids: open parts that no finger gets to.
//!
//! Problem: programs that put solids together side by side leave one wall between two of them. Its edges have three faces, of
//! which two are the skin around both solids; what is left is a sheet with a rim, though nothing is open to anybody.
//!
//! Model: an open part is a wall within if the middle of each of its faces is within closed parts, by their winding number, and
//! each of its vertices is so, too, or is a vertex of a closed part. It stays as it is, and is told as what it is.
//! In doubt a part is open.
//!
//! Cost: nothing where all parts are closed, or none; else a ray for each open part, and of walls within one for each face and
//! vertex.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::winding::Parts;
use super::{Mesh, Sides};

impl Mesh {
    /// The parts that are walls within.
    pub(super) fn inner_walls(&self, parts: &Parts) -> HashSet<usize> {
        let sheets = || {
            let all = self.faces.iter().enumerate();
            all.filter(|(_, face)| face.sides == Sides::Sheet).map(|(at, face)| (parts.of(at), face))
        };
        let mut outside = HashSet::new();
        for (part, face) in sheets() {
            if !outside.contains(&part) {
                let [a, b, c] = self.triangles().corners(face);
                if !self.is_within_solids(&((a + b + c) / 3.0)) {
                    outside.insert(part);
                }
            }
        }
        let within = || sheets().filter(|(part, _)| !outside.contains(part));
        let ends = || within().flat_map(|(part, face)| face.vertices.map(|vertex| (part, vertex as usize)));
        let places: HashSet<Place> = ends().map(|(_, vertex)| place(&self.vertices[vertex])).collect();
        if places.is_empty() {
            return HashSet::new();
        }
        let solids = self.faces.iter().filter(|face| face.sides == Sides::Solid);
        let skin = solids.flat_map(|face| face.vertices).map(|vertex| place(&self.vertices[vertex as usize]));
        let on_skin: HashSet<Place> = skin.filter(|place| places.contains(place)).collect();
        let mut walls: HashSet<usize> = within().map(|(part, _)| part).collect();
        for (part, vertex) in ends() {
            let at = &self.vertices[vertex];
            if walls.contains(&part) && !on_skin.contains(&place(at)) && !self.is_within_solids(at) {
                walls.remove(&part);
            }
        }
        walls
    }

    fn is_within_solids(&self, at_B: &Vector3<f64>) -> bool {
        let mut number = 0;
        self.bvh.for_each_face_on_the_way_out(self.triangles(), at_B, |_, is_leaving| {
            number += if is_leaving { 1 } else { -1 };
        });
        number != 0
    }
}

/// The bits of a point.
type Place = [u64; 3];

fn place(point: &Vector3<f64>) -> Place {
    // Not -0.
    <[f64; 3]>::from(point + Vector3::zeros()).map(f64::to_bits)
}
