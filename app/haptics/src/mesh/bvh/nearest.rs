//! The point of a mesh that is nearest to a given one.
//!
//! Cost: about a microsecond near a surface of a million faces. Where very many faces are equally near, as at the
//! centre of a ball, [`Bvh::nearest_unbounded`] looks at all of these, 0.1 s for a million; in a tick [`Bvh::nearest`] is
//! asked, which stops after [`MOST_VISITS`].

use nalgebra::Vector3;

use super::closest::{Closest, closest_on};
use super::stack::Stack;
use super::{Bvh, Face, Rounded, Triangles, above, larger};
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
    /// A point more than 1000 times as far away as the mesh is large is looked for as if it was that far away, in
    /// the same direction: from there, too many faces look equally near. One that is not finite is answered by a
    /// corner of the first face, infinitely far away.
    pub fn nearest_unbounded(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> Nearest {
        self.nearest_of_visited(triangles, p_B, usize::MAX).0
    }

    /// As [`Self::nearest_unbounded`], at a cost that a tick can bear: where very many faces are as near, a point that may
    /// be a little farther away than the nearest.
    pub fn nearest(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> Nearest {
        self.nearest_of_visited(triangles, p_B, MOST_VISITS).0
    }

    /// The nearest point of the faces, if any is as near as this \[m\]: the smaller, the cheaper.
    ///
    /// Errors: so many are about as near that a tick cannot look at all.
    pub(in crate::mesh) fn nearest_within(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Result<Option<Nearest>, TooMany> {
        self.nearest_of(triangles, p_B, at_most_m, |_| true)
    }

    /// As [`Self::nearest_within`], of what reaches above a plane that is as far below the point, `normal . x = offset`:
    /// a face with all corners below need not be looked at. On a convex mesh that is every one.
    pub(in crate::mesh) fn nearest_above(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        (normal_B, offset_m): (&Vector3<f64>, f64),
    ) -> Result<Option<Nearest>, TooMany> {
        self.nearest_of(triangles, p_B, at_most_m, |face| {
            let [a, b, c] = triangles.corners(face).map(|corner| normal_B.dot(&corner));
            larger(larger(a, b), c) > offset_m
        })
    }

    /// Visits all faces that may be as near to a point as this \[m\], until `visit` says `false`; says whether it never did.
    pub(in crate::mesh) fn for_each_within(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        mut visit: impl FnMut(&Face) -> bool,
    ) -> bool {
        self.for_each_face_near(triangles, p_B, at_most_m, |face| visit(&triangles.faces[face as usize]))
    }

    /// As [`Self::for_each_within`], with the faces' numbers.
    pub(in crate::mesh) fn for_each_face_near(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        mut visit: impl FnMut(u32) -> bool,
    ) -> bool {
        debug_assert!(triangles.faces.len() < u32::MAX as usize);
        let limit = above(at_most_m * at_most_m).min(f32::MAX);
        let mut stack = Stack::<f32>::new();
        let p = Rounded::new(p_B);
        while let Some((_, child)) = stack.pop() {
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&node.squared_distances(&p), &node.children, limit);
            } else if !(child.index()..child.index() + child.count()).all(|face| visit(face as u32)) {
                return false;
            }
        }
        true
    }

    #[inline(always)]
    fn nearest_of(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        counts: impl Fn(&Face) -> bool,
    ) -> Result<Option<Nearest>, TooMany> {
        let mut search = Search::new(triangles, p_B, self.extent_m());
        if search.limit < 0.0 || search.p_B != *p_B {
            // Not finite, or farther away than any ball is large.
            return Ok(None);
        }
        let mut visits = 0;
        search.reach_m = at_most_m;
        search.limit = above(at_most_m * at_most_m).min(f32::MAX);
        let mut stack = Stack::<f32>::new();
        let p = Rounded::new(&search.p_B);
        while let Some((squared_distance, child)) = stack.pop() {
            if squared_distance > search.limit {
                continue;
            }
            if visits == MOST_VISITS_OF_BALLS {
                return Err(TooMany);
            }
            visits += 1;
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&node.squared_distances(&p), &node.children, search.limit);
            } else {
                for face in child.index()..child.index() + child.count() {
                    if counts(&triangles.faces[face]) && search.may_reach(triangles, face as u32) {
                        search.consider(triangles, face as u32);
                    }
                }
            }
        }
        Ok((search.best.squared_distance <= at_most_m * at_most_m).then(|| search.result(p_B)))
    }

    /// As [`Self::nearest_unbounded`], and `true`; or the nearest of what was seen when so many nodes and runs of faces had been
    /// visited, and `false`.
    pub(super) fn nearest_of_visited(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        most_visits: usize,
    ) -> (Nearest, bool) {
        let mut visits = 0;
        let mut search = Search::new(triangles, p_B, self.extent_m());
        let mut stack = Stack::<f32>::new();
        let p = Rounded::new(&search.p_B);
        while let Some((squared_distance, child)) = stack.pop() {
            if squared_distance > search.limit {
                continue;
            }
            if visits == most_visits {
                return (search.result(p_B), false);
            }
            visits += 1;
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&node.squared_distances(&p), &node.children, search.limit);
            } else {
                for face in child.index()..child.index() + child.count() {
                    search.consider(triangles, face as u32);
                }
            }
        }
        (search.result(p_B), true)
    }
}

/// More faces are about as near to a point as was asked than a tick can look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooMany;

/// The nearest point so far.
struct Search {
    p_B: Vector3<f64>,
    best: Closest,
    face: u32,
    /// No face comes nearer than its plane does: faces whose planes are farther are dropped.
    reach_m: f64,
    slack_m: f64,
    /// Squared distance that boxes must not exceed; below 0 when nothing is looked for \[m^2\].
    limit: f32,
}

impl Search {
    fn new(triangles: Triangles<'_>, p_B: &Vector3<f64>, extent_m: f64) -> Self {
        let is_finite = p_B.iter().all(|coordinate| coordinate.is_finite());
        let nearer = (FARTHEST * extent_m / p_B.amax()).min(1.0);
        let point_B = triangles.corners(&triangles.faces[0])[0];
        Self {
            p_B: if nearer < 1.0 { p_B * nearer } else { *p_B },
            best: Closest { feature: Feature::Vertex, corner: 0, point_B, squared_distance: f64::INFINITY },
            face: 0,
            reach_m: f64::INFINITY,
            slack_m: ROUNDING * FARTHEST.min(1.0 + p_B.amax() / extent_m) * extent_m,
            // Finite, since boxes of nothing are infinitely far away.
            limit: if is_finite { f32::MAX } else { -1.0 },
        }
    }

    /// Whether a face is not obviously too far away: of most faces beside a tangent ball, one edge shows it, and
    /// without a division.
    #[inline(always)]
    fn may_reach(&self, triangles: Triangles<'_>, index: u32) -> bool {
        let face = &triangles.faces[index as usize];
        let height = face.normal_B.dot(&self.p_B) - face.offset_m;
        let left = self.reach_m * self.reach_m - height * height;
        if left < 0.0 {
            return false;
        }
        let left = left * (1.0 + ROUNDING) + self.slack_m * self.slack_m;
        let [a, b, c] = triangles.corners(face);
        let is_beyond = |from: &Vector3<f64>, to: &Vector3<f64>| {
            let edge = to - from;
            let beyond = edge.cross(&face.normal_B).dot(&(self.p_B - from));
            beyond > 0.0 && beyond * beyond > left * edge.norm_squared()
        };
        !(is_beyond(&a, &b) | is_beyond(&b, &c) | is_beyond(&c, &a))
    }

    #[inline(always)]
    fn consider(&mut self, triangles: Triangles<'_>, index: u32) {
        let face = &triangles.faces[index as usize];
        let height = face.normal_B.dot(&self.p_B) - face.offset_m;
        if height.abs() > self.reach_m {
            return;
        }
        let at_most = self.reach_m * self.reach_m;
        let Some(found) = closest_on(face, &triangles.corners(face), &self.p_B, at_most) else { return };
        let (distance, best) = (found.squared_distance, self.best.squared_distance);
        if distance < best || distance == best && index < self.face {
            (self.best, self.face) = (found, index);
            self.reach_m = distance.sqrt() + self.slack_m;
            self.limit = above(distance).min(f32::MAX);
        }
    }

    fn result(self, p_B: &Vector3<f64>) -> Nearest {
        let Closest { feature, corner, point_B, squared_distance } = self.best;
        let is_as_asked = self.p_B == *p_B || squared_distance == f64::INFINITY;
        let distance_m = if is_as_asked { squared_distance.sqrt() } else { (p_B - point_B).norm() };
        Nearest { face: self.face, feature, corner, point_B, distance_m }
    }
}

/// Bound on the nodes and runs of faces that a tick's query visits. Near the surface some tens are needed, at the centre
/// of a ball of a million faces 700,000.
pub(super) const MOST_VISITS: usize = 1024;
/// The same of queries for balls, of which most ask some tens; one that rests in a ring of a tenth of a million faces asks more
/// than 4096. A ball that touches all over is left where it is.
const MOST_VISITS_OF_BALLS: usize = 8192;
/// Ten times what is lost when a distance from a plane is computed, relative to the coordinates.
const ROUNDING: f64 = 1e-14;
/// How many times the extent of the mesh a point may be away before it is brought nearer.
const FARTHEST: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, make};

    #[test]
    fn what_is_asked_for_balls_gives_up_where_very_many_faces_are_as_near() {
        let (mesh, _) = Mesh::build(make::uv_sphere(200, 101, 0.1)).unwrap();
        let centre = Vector3::new(1e-9, 2e-9, 3e-9);
        assert_eq!(mesh.nearest_within(&centre, 0.11), Err(TooMany), "40,000 are as near");
        let below = (&Vector3::y(), -0.2);
        assert_eq!(mesh.nearest_above(&centre, 0.11, below), Err(TooMany));
        // But not where they are farther than is asked, or where some are nearer than others.
        assert_eq!(mesh.nearest_within(&centre, 0.09), Ok(None));
        let beside = Vector3::new(0.02, 0.201, 0.01);
        let near = mesh.nearest_within(&beside, 0.2).unwrap().unwrap();
        assert_eq!(near, mesh.nearest(&beside));
    }
}
