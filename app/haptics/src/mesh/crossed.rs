//! Faces that others pass through.
//!
//! Problem: artists put parts together by letting them overlap. Where one part comes out of another no edge joins their
//! faces, so a walk that knows neighbours alone would go on into the other part.
//!
//! Model: two triangles have no common point if along the normal of one of them, or along a direction across an edge of
//! each, they are apart (separating axes). What share a vertex are neighbours, and are left out.
//!
//! A part that cannot be oriented is no obstacle to itself: a Klein bottle passes through itself, and whoever walks over it
//! goes on. Where sheets cross anything, and where a solid is turned inside out ([`inverted`](super::inverted)), points roll over the whole mesh as balls that nobody tells from points: a ball beside a
//! sheet knows on which side of it it is.
//!
//! In doubt a face is taken for crossed: that costs a walk time, and nothing else.
//! Cost: about linear; at most [`MOST_PAIRS`] for each face, beyond which all are taken for crossed.

use nalgebra::Vector3;

use super::winding::Parts;
use super::{Mesh, Sides};

/// Boxes of more pairs overlap only where faces lie in heaps upon one another.
pub(super) const MOST_PAIRS: usize = 1000;

impl Mesh {
    /// Finds the faces that others pass through, and says how many they are. Those of solids are marked, for walks; where a sheet
    /// is among them, or for what the caller knows, fingers [roll](Self::point_radius_m).
    pub(super) fn mark_crossed(&mut self, parts: &Parts, must_roll: bool) -> usize {
        let mut is_crossed = vec![false; self.faces.len()];
        let mut do_sheets_cross = must_roll;
        let is_done = self.for_each_near_pair(parts, |pair, do_cross| {
            let [one, other] = pair.map(|face| &self.faces[face]);
            // Skins that lie on one another go nowhere.
            let is_of_sheets = [one.sides, other.sides].contains(&Sides::Sheet)
                && one.normal_B.cross(&other.normal_B).norm() > PARALLEL;
            // In heaps most is known of most faces already.
            let is_known = pair.iter().all(|&face| is_crossed[face]) && (do_sheets_cross || !is_of_sheets);
            if !is_known && do_cross() {
                do_sheets_cross |= is_of_sheets;
                pair.iter().for_each(|&face| is_crossed[face] = true);
            }
        });
        let sheets = self.faces.iter().zip(&is_crossed).filter(|(face, _)| face.sides == Sides::Sheet);
        let crossed_sheets = sheets.filter(|(_, is_crossed)| **is_crossed).count();
        // In doubt they cross.
        do_sheets_cross |= !is_done && self.faces.iter().any(|face| face.sides == Sides::Sheet);
        self.point_radius_m = if do_sheets_cross { self.least_ball_m() } else { 0.0 };
        for (face, is_crossed) in self.faces.iter_mut().zip(is_crossed) {
            face.is_crossed = face.sides == Sides::Solid && (is_crossed || !is_done);
        }
        crossed_sheets + self.faces.iter().filter(|face| face.is_crossed).count()
    }

    /// Radius of a ball that nobody tells from a point, and that has room beside what it has met.
    pub(super) fn least_ball_m(&self) -> f64 {
        let [low_B, high_B] = self.bounds_B();
        (LEAST_BALL * (high_B - low_B).max()).min(LEAST_BALL_M)
    }

    /// Visits each pair of faces that may pass through each other once, with the question whether they do; says whether these
    /// are all.
    #[inline(always)]
    pub(super) fn for_each_near_pair(
        &self,
        parts: &Parts,
        mut visit: impl FnMut([usize; 2], &dyn Fn() -> bool),
    ) -> bool {
        let slack_m = TOUCHING * self.extent_m;
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        self.bvh.for_each_pair(0.0, |i, j| {
            let pair = [i, j].map(|face| &self.faces[face as usize]);
            let corners = || pair.map(|face| face.vertices.map(|vertex| self.vertices[vertex as usize]));
            let are_neighbours = || pair[0].vertices.iter().any(|vertex| pair[1].vertices.contains(vertex));
            let normals = pair.map(|face| face.normal_B);
            let [one, other] = [i, j].map(|face| parts.of(face as usize));
            let is_obstacle = one != other || parts.is_orientable(one);
            if is_obstacle && !are_neighbours() {
                visit([i, j].map(|face| face as usize), &|| do_cross(&corners(), &normals, slack_m));
            }
            left -= 1;
            left > 0
        })
    }
}

/// Whether two triangles have a common point, or cannot be told from such by as much as `slack_m`.
#[inline(always)]
pub(super) fn do_cross(corners: &[[Vector3<f64>; 3]; 2], normals: &[Vector3<f64>; 2], slack_m: f64) -> bool {
    // From one of them, so that nothing is rounded as what is far from the origin.
    let origin = corners[0][0];
    let corners = corners.map(|corners| corners.map(|corner| corner - origin));
    let edges = corners.map(|[a, b, c]| [b - a, c - b, a - c]);
    let are_apart = |axis: Vector3<f64>| {
        let [[a, b], [c, d]] = corners.map(|corners| {
            let [p, q, r] = corners.map(|corner| axis.dot(&corner));
            [p.min(q).min(r), p.max(q).max(r)]
        });
        let slack = slack_m * axis.norm();
        b < c - slack || d < a - slack
    };
    let across = |of: usize| edges[of].iter().map(move |edge| normals[of].cross(edge));
    let of_both = edges[0].iter().flat_map(|edge| edges[1].iter().map(|other| edge.cross(other)));
    !(normals.iter().copied().any(are_apart) || across(0).chain(across(1)).chain(of_both).any(are_apart))
}

/// Sine of the angle below which faces that cross are as one: in a decimetre they part by a tenth of a millimetre.
const PARALLEL: f64 = 1e-3;
/// As a share of the size of a mesh, and at most \[m\]: a third of a count of a device's encoders.
const LEAST_BALL: f64 = 1e-4;
const LEAST_BALL_M: f64 = 1e-5;
/// As a share of the extent: nearer than this, a walk over one of two faces may be stopped by the other.
const TOUCHING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TriangleSoup, make};

    fn crossed(soups: &[TriangleSoup]) -> Vec<Vector3<f64>> {
        let mut all = TriangleSoup::default();
        for soup in soups {
            let first = all.vertices.len() as u32;
            all.vertices.extend(&soup.vertices);
            all.faces.extend(soup.faces.iter().map(|face| face.map(|vertex| vertex + first)));
        }
        let (mesh, report) = Mesh::build(all).unwrap();
        let crossed: Vec<_> =
            mesh.faces.iter().filter(|face| face.is_crossed).map(|face| face.normal_B).collect();
        assert_eq!(report.crossed, crossed.len());
        crossed
    }

    fn moved(mut soup: TriangleSoup, by: Vector3<f64>) -> TriangleSoup {
        soup.vertices.iter_mut().for_each(|vertex| *vertex += by);
        soup
    }

    #[test]
    fn faces_that_a_part_passes_through_are_marked_and_no_others() {
        for far_m in [0.0, 1e3] {
            let far = Vector3::repeat(far_m);
            let floor = moved(make::cuboid([0.2, 0.02, 0.2]), far);
            let wall = |y: f64| moved(make::cuboid([0.02, 0.1, 0.02]), far + Vector3::new(0.03, y, 0.01));
            // Through the floor's top, with all four of its sides, of which each has two faces.
            let through = crossed(&[floor.clone(), wall(0.05)]);
            assert_eq!(through.iter().filter(|normal| normal.y.abs() < 0.5).count(), 8);
            assert!(through.iter().filter(|normal| normal.y > 0.5).count() >= 1);
            assert!(through.iter().all(|normal| normal.y > -0.5));
            // Above it, beside it, and within it.
            assert!(crossed(&[floor.clone(), wall(0.07)]).is_empty());
            assert!(crossed(&[floor.clone(), moved(floor.clone(), Vector3::x() * 0.3)]).is_empty());
            assert!(crossed(&[floor, moved(make::cuboid([0.01; 3]), far)]).is_empty());
        }
        assert!(crossed(&[make::torus(40, 20, 0.1, 0.04)]).is_empty());
        assert!(crossed(&[make::bumpy_sphere(100, 50, 0.1)]).is_empty());
    }
}
