//! Chords of edges: a quick look at which edges cannot run along each other.
//!
//! Problem: where many edges come together, all of their boxes overlap; comparing each with each takes minutes.
//!
//! Model: an edge lies in the hull of its control points, and distances from a segment are convex: no point of the edge
//! is farther from the segment between its ends than the farthest of its control points.
//!
//! Cost: of an edge, once, its control points; of a pair two distances from a segment.

use nalgebra::Vector3;

use super::Nurbs;
use super::seams::{on_edge, running};

/// The segment between an edge's ends, and how far the edge leaves it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chord {
    ends_B: [Vector3<f64>; 2],
    reach_m: f64,
}

impl Chord {
    pub(super) fn of(nurbs: &Nurbs, (patch, edge): (u32, u8)) -> Self {
        let ends_B = [0.0, 1.0].map(|x| nurbs.local(patch, on_edge(edge, x)).point_B);
        let chord = Self { ends_B, reach_m: 0.0 };
        let reach_m = border(nurbs, patch, edge).map(|point_B| chord.distance(&point_B)).fold(0.0, f64::max);
        Self { reach_m, ..chord }
    }

    /// Whether the ends of `part` may lie on this edge, or `slack` off it.
    pub(super) fn may_hold(&self, part: &Self, slack: f64) -> bool {
        // Once more the slack, so that no rounding leaves one out.
        part.ends_B.iter().all(|end_B| self.distance(end_B) <= self.reach_m + 2.0 * slack)
    }

    fn distance(&self, point_B: &Vector3<f64>) -> f64 {
        let (along_B, off_B) = (self.ends_B[1] - self.ends_B[0], point_B - self.ends_B[0]);
        let share = off_B.dot(&along_B) / along_B.norm_squared();
        // Of a closed edge the chord is a point.
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        (off_B - along_B * share).norm()
    }
}

/// The control points along an edge.
fn border(nurbs: &Nurbs, patch: u32, edge: u8) -> impl Iterator<Item = Vector3<f64>> + '_ {
    let patch = &nurbs.patches[patch as usize];
    let spans = [0, 1].map(|d| patch.breaks[d].len() - 1);
    let d = running(edge);
    let is_last = !edge.is_multiple_of(2);
    let place = move |sizes: [usize; 2], k: usize| {
        let across = if is_last { sizes[1 - d] - 1 } else { 0 };
        let at = if d == 0 { [k, across] } else { [across, k] };
        at[0] + at[1] * sizes[0]
    };
    let rows = patch.degree.map(|degree| degree + 1);
    (0..spans[d]).flat_map(move |span| {
        let element = &nurbs.elements[patch.first_element + place(spans, span)];
        (0..rows[d]).map(move |k| {
            let [x, y, z, w] = nurbs.controls[element.net + place(rows, k)];
            element.origin_B + Vector3::new(x, y, z) / w
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::make;

    #[test]
    fn a_chord_holds_every_point_of_its_edge() {
        for patches in [make::sphere(0.05), make::torus(0.05, 0.02), make::vase(0.1), make::mouse(0.1)] {
            let nurbs = Nurbs::build(&patches).unwrap().0;
            let edges =
                (0..nurbs.patches.len() as u32).flat_map(|patch| (0..4).map(move |edge| (patch, edge)));
            for (patch, edge) in edges {
                let chord = Chord::of(&nurbs, (patch, edge));
                let at = |x: f64| nurbs.local(patch, on_edge(edge, x)).point_B;
                let most = (0..=64).map(|k| chord.distance(&at(f64::from(k) / 64.0))).fold(0.0, f64::max);
                assert!(most <= chord.reach_m + 1e-15, "{most:e} {chord:?}");
                // Arcs of a quarter circle reach 0.293 r, their control points 0.707 r.
                assert!(chord.reach_m <= 2.5 * most + 1e-15, "{most:e} {chord:?}");
            }
        }
    }
}
