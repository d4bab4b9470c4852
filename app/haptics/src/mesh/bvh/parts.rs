//! The way out of a solid whose parts overlap, or that cuts through itself.
//!
//! Problem: inside one part, the nearest face may be of another part, which the point is outside of. By that face
//! alone a finger that one part has let go would be free, deep inside the other.
//!
//! Model: a straight way leads from the point out of the mesh's box. Each face that it leaves through counts one, each
//! that it enters through takes one off; what is left is how many parts the point is inside of. A way that meets first a
//! face that it leaves through leaves a part that the point is inside of, and there it can be pushed out. Of several such
//! ways the shortest is tried first. All must agree that the point is inside, since a way may by bad luck run through an
//! edge, and a finger that is free must not be drawn.
//!
//! Cost: outside, one way, which leads away from the nearest face; inside [`WAYS`]. Each is followed over
//! [`MOST_CROSSINGS`] at most, each of them one bounded query; what is not known then counts as outside.

use nalgebra::Vector3;

use super::{Bvh, Hit, Nearest, Triangles};
use crate::mesh::Sides;
use crate::surface::Feature;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Places on parts that the point is inside of, the nearer ones first, not the nearest of all; none outside of all
    /// parts. `nearest` is the nearest point of all faces, whatever part it is on.
    /// The point must be within the box.
    pub fn ways_out_of_parts(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        nearest: &Nearest,
    ) -> Option<[Nearest; WAYS.len()]> {
        let normal_B = triangles.faces[nearest.face as usize].normal_B;
        let away_B = (p_B - nearest.point_B).try_normalize(0.0).unwrap_or(normal_B);
        let away = self.left_along(triangles, p_B, &(away_B + Vector3::from(WAYS[0]) * TILT))?;
        let mut all = [away; WAYS.len()];
        for (left, way) in all.iter_mut().zip(WAYS) {
            *left = self.left_along(triangles, p_B, &way.into())?;
        }
        all.sort_unstable_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        Some(all)
    }

    /// Where a way leaves a part that the point is inside of; infinitely far away if it enters another part first. `None`
    /// if the point is inside of none, or too much is in the way.
    fn left_along(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        way_B: &Vector3<f64>,
    ) -> Option<Nearest> {
        let beyond_B = p_B + way_B * (BEYOND * self.extent_m());
        let mut met: [Option<Hit>; MOST_CROSSINGS] = [None; MOST_CROSSINGS];
        let mut crossings = 0;
        while let Some(hit) = self.next_of_visited(triangles, p_B, &beyond_B, &met[..crossings])? {
            *met.get_mut(crossings)? = Some(hit);
            crossings += 1;
        }
        let inside_of: i32 = met.iter().flatten().map(|hit| if hit.is_front { -1 } else { 1 }).sum();
        let first = met[0].filter(|_| inside_of > 0)?;
        let distance_m = if first.is_front { f64::INFINITY } else { (first.point_B - p_B).norm() };
        Some(Nearest {
            face: first.face,
            feature: Feature::Face,
            corner: 0,
            point_B: first.point_B,
            distance_m,
        })
    }

    /// The first face on the way that has not been met; `None` if it takes too long to find out.
    fn next_of_visited(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        beyond_B: &Vector3<f64>,
        met: &[Option<Hit>],
    ) -> Option<Option<Hit>> {
        let is_met = |face| met.iter().flatten().any(|hit| hit.face == face);
        self.first_hit_of_visited(triangles, Sides::Sheet, p_B, beyond_B, is_met, MOST_VISITS).ok()
    }
}

/// Near the axes, to either side, and along nothing that a mesh is likely to have an edge or a plane along.
const WAYS: [[f64; 3]; 6] = [
    [0.943, 0.271, 0.193],
    [-0.911, 0.337, -0.239],
    [0.257, 0.931, -0.263],
    [-0.283, -0.947, 0.151],
    [0.211, -0.317, 0.923],
    [-0.163, 0.229, -0.961],
];
/// By this much of another way the one that leads away is tilted, so as not to run along a normal.
const TILT: f64 = 0.1;
/// So many extents away is out of the box, whose diagonal is 3.5 of them, on each of the ways, also on the shortest,
/// 0.9 long.
const BEYOND: f64 = 4.0;
/// Most faces that a way is followed through.
const MOST_CROSSINGS: usize = 16;
/// Bound on the nodes and runs of faces that the search for each of them visits: a long way through a ball of a million
/// faces takes a hundred.
const MOST_VISITS: usize = 256;
