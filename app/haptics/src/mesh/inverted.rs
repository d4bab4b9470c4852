//! Closed surfaces that are turned inside out somewhere, as a loop in an eight is.
//!
//! Problem: where a surface passes through itself so that the winding number is negative, its outer side looks into a pocket. A
//! point comes into it from behind, unfelt, and cannot get out again; a ball meets the surface from either side. Where faces
//! with a common vertex pass through each other, a walk takes them for neighbours, and goes on below one of them.
//!
//! Model: a pocket is bounded by lines in which faces cross. In front of both faces at such a line, the winding number is asked
//! for. Where limbs only go into each other it is never negative, and walks try them
//! ([`crossed`](super::crossed)).
//!
//! In doubt a surface is inverted: points roll over it, as balls do that nobody tells from points.
//! Cost: about linear; a ray for each pair of faces that cross, at most [`MOST_RAYS`].

use nalgebra::Vector3;

use super::crossed::MOST_PAIRS;
use super::winding::Parts;
use super::{Face, Mesh};

impl Mesh {
    /// True if points must roll, since walks come below faces or into pockets. Closed parts are turned outward by now; without
    /// cavities, different ones together are never inverted.
    pub(super) fn is_inverted(&self, parts: &Parts, has_cavities: bool) -> bool {
        let (mut is_inverted, mut rays) = (false, MOST_RAYS);
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        self.bvh.for_each_pair(0.0, |i, j| {
            left -= 1;
            let pair = [i, j].map(|face| &self.faces[face as usize]);
            // Few are, and that is known by now.
            let are_crossed = pair[0].is_crossed && pair[1].is_crossed;
            let common = pair[0].vertices.iter().filter(|vertex| pair[1].vertices.contains(vertex)).count();
            let is_one = || parts.of(i as usize) == parts.of(j as usize);
            let may_be = match common {
                // Of solids alone.
                0 => are_crossed && (is_one() || has_cavities),
                1 => true,
                _ => false,
            };
            if may_be && let Some(middle_B) = self.crossing(pair) {
                rays -= 1;
                is_inverted = common == 1 || rays == 0 || self.is_negative_at(pair, &middle_B);
            }
            left > 0 && !is_inverted
        });
        is_inverted
    }

    /// True if it is inverted in front of two faces that cross there.
    fn is_negative_at(&self, pair: [&Face; 2], at_B: &Vector3<f64>) -> bool {
        let ahead_B = (pair[0].normal_B + pair[1].normal_B).normalize();
        let ahead_B = at_B + ahead_B * (AHEAD * self.extent_m);
        let number = self.bvh.winding_number(self.triangles(), &ahead_B, usize::MAX);
        number.is_some_and(|number| number < 0)
    }

    /// Middle of the line in which two faces cross, if it has a length.
    fn crossing(&self, pair: [&Face; 2]) -> Option<Vector3<f64>> {
        let [one, other] = pair.map(|face| self.triangles().corners(face));
        let origin = one[0];
        let cut = |of: &[Vector3<f64>; 3], by: &Face, corner: &Vector3<f64>| {
            let heights = of.map(|at| by.normal_B.dot(&(at - corner)));
            let on_m = ON * self.extent_m;
            let heights = heights.map(|height| if height.abs() < on_m { 0.0 } else { height });
            cut_by_plane(of, heights)
        };
        // Of most pairs one lies on one side of the other.
        let ends = [cut(&other, pair[0], &origin)?, cut(&one, pair[1], &other[0])?];
        let line_B = pair[0].normal_B.cross(&pair[1].normal_B);
        let line_B = line_B.try_normalize(PARALLEL)?;
        let along = ends.map(|ends| ends.map(|end| line_B.dot(&(end - origin))));
        let [[a, b], [c, d]] = along.map(|[from, to]| [from.min(to), from.max(to)]);
        let (from, to) = (a.max(c), b.min(d));
        let start_B = ends[0][0];
        (to - from > LONG * self.extent_m)
            .then(|| start_B + line_B * (0.5 * (from + to) - line_B.dot(&(start_B - origin))))
    }
}

/// Ends of the line in which a plane cuts a triangle, of which these are the corners' heights above it.
fn cut_by_plane(corners: &[Vector3<f64>; 3], heights: [f64; 3]) -> Option<[Vector3<f64>; 2]> {
    let (mut ends, mut count) = ([Vector3::zeros(); 2], 0);
    for corner in 0..3 {
        let next = (corner + 1) % 3;
        let found = match (heights[corner], heights[next]) {
            (0.0, _) => Some(corners[corner]),
            (here, there) if here * there < 0.0 => {
                Some(corners[corner] + (corners[next] - corners[corner]) * (here / (here - there)))
            }
            _ => None,
        };
        if let Some(end) = found {
            // All three lie in it only where the faces are as one.
            *ends.get_mut(count)? = end;
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

/// Crossing pairs of which the winding number is asked for.
const MOST_RAYS: usize = 50_000;
/// Of the extent: so far before the faces; a thousand times what a ray's answer is rounded by.
const AHEAD: f64 = 1e-8;
/// Of the extent: nearer to a plane is in it.
const ON: f64 = 1e-13;
/// Of the extent: shorter lines are points.
const LONG: f64 = 1e-6;
/// Sine of the angle below which faces that cross are as one.
const PARALLEL: f64 = 1e-6;
