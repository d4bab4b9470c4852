//! Faces of closed parts that lie beside other parts, with a hairline crack between them or none.
//!
//! Problem: CAD programs write assemblies as closed parts, which are meant to touch: by rounding, or by the tolerance of a fit,
//! there are cracks between them, or they overlap by as much, and no edge joins their faces. A point falls into the least crack.
//!
//! Model: a crack that is no wider than [`widest_m`] is none to a finger ([`crack`](super::crack)). Marked are the faces of parts
//! that come as near as that to a face of another one, as far as separating axes can tell
//! ([`crossed`](super::crossed)), and their neighbours at vertices: from each edge and vertex where a walk may end, both are told
//! by the face that it comes over.
//!
//! Cost: nothing for a single part; about linear in the faces else, at most as many pairs as [`crossed`](super::crossed) looks at.

use super::crossed::{MOST_PAIRS, do_cross};
use super::report::NarrowGaps;
use super::winding::Parts;
use super::{Mesh, Sides};
use std::collections::HashSet;

/// The widest crack that no finger feels, for a mesh with this largest coordinate \[m\].
///
/// A spring of 5 kN/m, as stiff as devices render, changes its force over it by 0.05 N, about what fingertips just notice
/// (Dosher & Hannaford 2005: 0.03 N and more), and encoders of desktop devices resolve 7 to 30 um.
pub(super) fn widest_m(extent_m: f64) -> f64 {
    WIDEST_M.min(WIDEST_SHARE * extent_m)
}

impl Mesh {
    /// Marks the faces beside other parts, and says how many there are, and which of them are walls that fit.
    pub(super) fn mark_beside(&mut self, parts: &Parts) -> (NarrowGaps, Vec<bool>) {
        let widest_m = widest_m(self.extent_m);
        let mut gaps = NarrowGaps { widest_m, ..NarrowGaps::default() };
        if parts.len() < 2 || !self.has_inside {
            return (gaps, Vec::new());
        }
        let (sizes, mut is_fitting) = (self.sizes(parts), vec![false; self.faces.len()]);
        let (mut is_beside, mut is_told) = (vec![false; self.faces.len()], vec![false; self.faces.len()]);
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        self.bvh.for_each_pair(widest_m, |i, j| {
            let pair = [i, j].map(|face| &self.faces[face as usize]);
            let corners = || pair.map(|face| face.vertices.map(|vertex| self.vertices[vertex as usize]));
            let is_other_part = parts.of(i as usize) != parts.of(j as usize);
            let are_solid = pair.iter().all(|face| face.sides == Sides::Solid);
            if is_other_part && are_solid && do_cross(&corners(), &pair.map(|face| face.normal_B), widest_m) {
                (is_beside[i as usize], is_beside[j as usize]) = (true, true);
                // What passes through another part does so at an angle, and has been told.
                let lies_along = pair[0].normal_B.dot(&pair[1].normal_B).abs() > ALONG;
                is_told[i as usize] |= lies_along;
                is_told[j as usize] |= lies_along;
                if lies_along && let Some(face) = self.fitting([i, j], parts, &sizes) {
                    is_fitting[face as usize] = true;
                }
            }
            left -= 1;
            left > 0
        });
        for (face, _) in self.faces.iter().zip(&is_told).filter(|(_, is_told)| **is_told) {
            gaps.faces += 1;
            let [a, b, c] = face.vertices.map(|vertex| self.vertices[vertex as usize]);
            gaps.first_B.get_or_insert(((a + b + c) / 3.0).into());
        }
        let marked = self.faces.iter().zip(&is_beside).filter(|(_, is_beside)| **is_beside);
        let vertices: HashSet<u32> = marked.flat_map(|(face, _)| face.vertices).collect();
        for face in self.faces.iter_mut().filter(|face| face.sides == Sides::Solid) {
            face.is_beside = face.vertices.iter().any(|vertex| vertices.contains(vertex));
        }
        (gaps, is_fitting)
    }
}

/// Cosine of the angle up to which faces lie beside each other.
const ALONG: f64 = 0.9;
const WIDEST_M: f64 = 1e-5;
/// Of a mesh that is small itself; of the extent.
const WIDEST_SHARE: f64 = 2e-4;
