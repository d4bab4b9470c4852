//! Faces that others pass through.
//!
//! Problem: artists put parts together by letting them overlap. Where one part comes out of another no edge joins their
//! faces, so a walk that knows neighbours alone would go on into the other part.
//!
//! Model: two triangles have no common point if along the normal of one of them, or along a direction across an edge of
//! each, they are apart (separating axes). What share a vertex are neighbours, and are left out.
//!
//! A part that cannot be oriented is no obstacle to itself: a Klein bottle passes through itself, and whoever walks over it
//! goes on.
//!
//! In doubt a face is taken for crossed: that costs a walk time, and nothing else.
//! Cost: about linear; at most [`MOST_PAIRS`] for each face, beyond which all are taken for crossed.

use nalgebra::Vector3;

use super::winding::Parts;
use super::{Mesh, Sides};

/// Boxes of more pairs overlap only where faces lie in heaps upon one another.
pub(super) const MOST_PAIRS: usize = 1000;

impl Mesh {
    /// Marks the faces that others pass through, and says how many they are.
    pub(super) fn mark_crossed(&mut self, parts: &Parts) -> usize {
        let mut is_crossed = vec![false; self.faces.len()];
        let is_done =
            self.for_each_crossed_pair(parts, |pair| pair.iter().for_each(|&face| is_crossed[face] = true));
        for (face, is_crossed) in self.faces.iter_mut().zip(is_crossed) {
            // Of sheets in heaps none is: a walk among them would end nowhere.
            face.is_crossed = if is_done { is_crossed } else { face.sides == Sides::Solid };
        }
        self.faces.iter().filter(|face| face.is_crossed).count()
    }

    /// Visits each pair of faces that pass through each other once; says whether these are all.
    #[inline(always)]
    pub(super) fn for_each_crossed_pair(&self, parts: &Parts, mut visit: impl FnMut([usize; 2])) -> bool {
        let slack_m = TOUCHING * self.extent_m;
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        self.bvh.for_each_pair(0.0, |i, j| {
            let pair = [i, j].map(|face| &self.faces[face as usize]);
            let corners = || pair.map(|face| face.vertices.map(|vertex| self.vertices[vertex as usize]));
            let are_neighbours = || pair[0].vertices.iter().any(|vertex| pair[1].vertices.contains(vertex));
            let normals = pair.map(|face| face.normal_B);
            let [one, other] = [i, j].map(|face| parts.of(face as usize));
            let is_obstacle = one != other || parts.is_orientable(one);
            if is_obstacle && !are_neighbours() && do_cross(&corners(), &normals, slack_m) {
                visit([i, j].map(|face| face as usize));
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
