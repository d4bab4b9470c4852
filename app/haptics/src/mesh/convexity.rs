//! Convexity of a mesh, and the distance of its middle from its faces.
//!
//! Model: what is closed, hangs together and turns outward at each edge is convex. Edges of what is flat may turn inward as
//! rounding has it; that these do not add up to a hollow is looked at along some faces, over which no vertex may lie.
//! Cost: linear, up to the first edge that turns inward; and a query of the hierarchy for each of [`MOST_ASKED`] faces.

use super::{Linear, Mesh, Sides};
use nalgebra::Vector3;

impl Mesh {
    /// Of a convex solid, radius of the ball around its middle that touches its nearest face \[m\]; `None` of everything else.
    pub fn convex_inner_m(&self) -> Option<f64> {
        self.convex_inner_m
    }

    /// Of one that hangs together.
    pub(super) fn find_convex_inner_m(&self) -> Option<f64> {
        let rounding_m = ROUNDING * self.extent_m;
        let turns_outward = |link: &super::Link, face: &super::Face| {
            let beyond = &self.faces[link.face() as usize];
            let opposite = &self.vertices[beyond.vertices[(link.edge() + 2) % 3] as usize];
            let over_m = face.normal_B.dot(opposite) - face.offset_m;
            let inward = face.normal_B.cross(&beyond.normal_B).norm();
            over_m <= 0.0 || over_m <= rounding_m && inward <= FLAT
        };
        let is_solid = self.sides == Sides::Solid && !self.faces.iter().any(|face| face.is_crossed);
        let mut all = self.faces.iter();
        if !is_solid || !all.all(|face| face.links.iter().all(|link| turns_outward(link, face))) {
            return None;
        }
        let step = self.faces.len().div_ceil(MOST_ASKED);
        // Not in the order of the faces, in which those of two sides may take turns.
        let asked =
            (0..self.faces.len()).step_by(step).map(|at| at + at.wrapping_mul(0x9E37_79B9) / 64 % step);
        for face in asked.filter_map(|at| self.faces.get(at)) {
            let over = Linear::new(face.normal_B, rounding_m - face.offset_m);
            if self.outlying([&over, &Linear::ONE], &[], 2.0 * rounding_m, usize::MAX).is_some() {
                return None;
            }
        }
        let middle: Vector3<f64> = self.vertices.iter().sum::<Vector3<f64>>() / self.vertices.len() as f64;
        let depth_m = |face: &super::Face| face.offset_m - face.normal_B.dot(&middle);
        let inner_m = self.faces.iter().map(depth_m).fold(f64::INFINITY, f64::min);
        (inner_m > rounding_m).then_some(inner_m)
    }
}

/// Height over a face's plane, in extents, that is none: programs that make hulls round them, and leave dents.
const ROUNDING: f64 = 1e-5;
/// Sine of a turn inward that is none.
const FLAT: f64 = 1e-2;
/// Faces over which it is looked whether anything lies there.
const MOST_ASKED: usize = 1024;
