//! What a mesh is asked: where a finger enters, what is nearest, how far it may still go.

use nalgebra::Vector3;

use super::bvh::{Leaving, TooMany, closest_on};
use super::fan::for_each_around;
use super::place::Side;
use super::{Face, Hit, Linear, Mesh, Nearest, Sides, Triangles};
use crate::surface::Feature;

impl Mesh {
    /// The first face that the segment `from_B -> to_B` enters: from outside, or from either side of a sheet.
    ///
    /// No rounding lets it slip through where faces meet, nor past the surface in two steps: a start that lies up
    /// to 1e-13 of the extent behind a face still counts as in front of it. None for a segment that is not finite
    /// or has no length.
    pub fn first_hit(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Hit> {
        self.bvh.first_hit(self.triangles(), Sides::Solid, from_B, to_B)
    }

    /// The first face that the segment goes through, from either side of it; as precise as [`Self::first_hit`].
    pub fn first_crossing(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Hit> {
        self.bvh.first_hit(self.triangles(), Sides::Sheet, from_B, to_B)
    }

    /// As [`Self::first_hit`], of the faces that `is_skipped` does not name.
    pub(crate) fn first_hit_of_others(
        &self,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        self.bvh.first_hit_of_others(self.triangles(), Sides::Solid, from_B, to_B, is_skipped)
    }

    /// As [`Self::first_hit_of_others`], from a point of the surface that is left.
    pub(super) fn first_hit_in_flight(
        &self,
        way_B: [&Vector3<f64>; 2],
        leaving: &impl Leaving,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        self.bvh.first_hit_in_flight(self.triangles(), way_B, leaving, is_skipped)
    }

    /// A point of the mesh nearest to a point on either side, at a cost that a tick can bear.
    ///
    /// Where very many faces are as near, as at the centre of a ball, it is one of those seen first, and may be a little
    /// farther away than the very nearest: [`Self::nearest_unbounded`] is that one.
    pub fn nearest(&self, p_B: &Vector3<f64>) -> Nearest {
        self.bvh.nearest(self.triangles(), p_B)
    }

    /// The point of the mesh nearest to a point on either side. For tools and tests: at the centre of a ball it looks at
    /// all faces, and no tick has the time for that.
    ///
    /// A point that is not finite is answered by a corner of face 0, infinitely far away. Beyond 1000 extents the
    /// answer is that for a point 1000 extents away in the same direction, with the point's own distance.
    pub fn nearest_unbounded(&self, p_B: &Vector3<f64>) -> Nearest {
        self.bvh.nearest_unbounded(self.triangles(), p_B)
    }

    /// As [`Self::nearest`], if it is as near as this \[m\].
    pub(crate) fn nearest_within(
        &self,
        p_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Result<Option<Nearest>, TooMany> {
        self.bvh.nearest_within(self.triangles(), p_B, at_most_m)
    }

    /// Visits all faces that may be as near as this \[m\], until `visit` says `false`; says whether it never did.
    pub(crate) fn for_each_within(
        &self,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        visit: impl FnMut(&Face) -> bool,
    ) -> bool {
        self.bvh.for_each_within(self.triangles(), p_B, at_most_m, visit)
    }

    /// As [`Self::nearest_within`], of faces that reach above a plane that is no nearer than this either.
    pub(crate) fn nearest_above(
        &self,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        plane: (&Vector3<f64>, f64),
    ) -> Result<Option<Nearest>, TooMany> {
        self.bvh.nearest_above(self.triangles(), p_B, at_most_m, plane)
    }

    /// Whether a point is inside of a closed part or on its surface, at a cost that a tick can bear: where the winding
    /// number of all closed parts is positive. A sheet has no inside.
    ///
    /// Exact but within rounding of the surface. Where so many faces are in line with the point along each of the axes
    /// that a tick cannot look at all, it is outside.
    pub fn is_inside(&self, p_B: &Vector3<f64>) -> bool {
        self.has_inside && self.bvh.is_inside(self.triangles(), p_B)
    }

    /// As [`Self::is_inside`], whatever it costs: for tools and tests.
    pub fn is_inside_unbounded(&self, p_B: &Vector3<f64>) -> bool {
        self.has_inside && self.bvh.is_inside_unbounded(self.triangles(), p_B)
    }

    /// As [`Self::nearest`], and whether the point is inside, as [`Self::is_inside`] says.
    pub fn nearest_and_side(&self, p_B: &Vector3<f64>) -> (Nearest, bool) {
        if self.has_inside {
            self.bvh.nearest_and_side(self.triangles(), p_B)
        } else {
            (self.nearest(p_B), false)
        }
    }

    /// A point of the surface through which to push out what is inside, at a cost that a tick can bear.
    ///
    /// The nearest one, unless very many are as near or it leads into another part. Just beyond it is outside of all closed
    /// parts. `None` outside, hence always for a sheet.
    pub fn way_out(&self, p_B: &Vector3<f64>) -> Option<Nearest> {
        self.has_inside.then(|| self.bvh.way_out(self.triangles(), p_B)).flatten()
    }

    /// Ways out of what is inside, to be tried one after the other: that of [`Self::way_out`], and along the axes, the nearer
    /// ones first, to where all parts end and to where the first one does. Each has a cost that a tick can bear, and
    /// none if it is not asked for.
    pub(crate) fn ways_out(&self, p_B: &Vector3<f64>) -> impl Iterator<Item = Nearest> {
        let first = self.way_out(p_B);
        let along_axes = move || {
            let mut ways = self.bvh.ways_along_axes(self.triangles(), p_B);
            let distance_m =
                |[exit, _]: &[Option<Nearest>; 2]| exit.map_or(f64::INFINITY, |way| way.distance_m);
            ways.sort_unstable_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
            ways
        };
        let others = first.is_some().then_some(along_axes).into_iter().flat_map(|ways| ways());
        first.into_iter().chain(others.flatten().flatten())
    }

    /// A lower bound of the distance from a point to the mesh, at most `at_most_m`; 0 if nothing better is known
    /// \[m\].
    ///
    /// As long as a finger has moved less than this, it cannot have touched. Constant cost, whatever the mesh.
    pub fn clearance(&self, p_B: &Vector3<f64>, at_most_m: f64) -> f64 {
        self.bvh.clearance(p_B, at_most_m)
    }

    /// The box around it, in its own frame: lowest and highest coordinates \[m\].
    pub fn bounds_B(&self) -> [Vector3<f64>; 2] {
        self.bvh.bounds_B()
    }

    /// The vertex with the largest product of two counts, as a corner of a face (three times its number plus that of the
    /// corner), and that product, if it is larger than `more_than`; see [`Bvh::outlying`](super::Bvh::outlying).
    pub fn outlying(
        &self,
        counts: [&Linear; 2],
        limits: &[Linear],
        more_than: f64,
        most_visits: usize,
    ) -> Option<(u32, f64)> {
        self.bvh.outlying(self.triangles(), counts, limits, more_than, most_visits)
    }

    /// Visits the vertices at which none of at most six limits is negative, as corners of faces, each as often as faces meet
    /// there, until `visit` says `false`, or so many nodes and runs of faces were looked at; says whether all were visited.
    pub fn for_each_vertex_within(
        &self,
        limits: &[Linear],
        visit: impl FnMut(u32) -> bool,
        most_visits: usize,
    ) -> bool {
        self.bvh.for_each_vertex_within(self.triangles(), limits, visit, most_visits)
    }

    /// Visits the numbers of the faces in all boxes to which `key_of` gives a key by their middle and half their size, smallest
    /// keys first; see [`Bvh::for_each_face_in_boxes`](super::Bvh::for_each_face_in_boxes).
    pub fn for_each_face_in_boxes<S>(
        &self,
        state: &mut S,
        key_of: impl Fn(&S, &Vector3<f64>, &Vector3<f64>) -> Option<f64>,
        visit: impl FnMut(&mut S, u32) -> bool,
        most_visits: usize,
    ) -> bool {
        self.bvh.for_each_face_in_boxes(state, key_of, visit, most_visits)
    }

    /// The point of one face that is nearest to a point, and what it lies on.
    pub fn nearest_of_face(&self, face: u32, p_B: &Vector3<f64>) -> (Vector3<f64>, Feature) {
        let record = &self.faces[face as usize];
        let corners = record.vertices.map(|vertex| self.vertices[vertex as usize]);
        match closest_on(record, &corners, p_B, f64::INFINITY) {
            Some(closest) => (closest.point_B, closest.feature),
            None => (corners[0], Feature::Vertex),
        }
    }

    /// Visits the numbers of all faces that may be as near as this \[m\], in no order that means anything, until `visit`
    /// says `false`; says whether it never did.
    pub fn for_each_face_near(
        &self,
        p_B: &Vector3<f64>,
        at_most_m: f64,
        visit: impl FnMut(u32) -> bool,
    ) -> bool {
        self.bvh.for_each_face_near(self.triangles(), p_B, at_most_m, visit)
    }

    /// Visits the faces around a corner of a face, itself among them: each with the number of that corner in it. At most
    /// [`MAX_VALENCE`](super::MAX_VALENCE).
    pub fn for_each_face_around(&self, face: u32, corner: usize, mut visit: impl FnMut(&Face, usize)) {
        for_each_around(self, Side { face, is_back: false }, corner, |sector| {
            visit(sector.facet.face, sector.corner);
        });
    }

    pub(super) fn triangles(&self) -> Triangles<'_> {
        Triangles { faces: &self.faces, vertices: &self.vertices }
    }
}
