//! Slivers that are folded over their neighbour.
//!
//! Problem: CAD programs and decimation leave triangles that are lower than a micrometre and turned over, flat upon the face
//! beside them. Between the two is a slit of no width: a point slides in, and is held there when the hand has long left.
//!
//! Model: the longest edge of such a sliver, whichever edge it is folded along, gives way to the other diagonal of the two faces
//! beside it (an edge flip). The surface moves by no more than the sliver is high.
//!
//! Limits: lower than what no finger feels ([`widest_m`]); folds of wider faces stay, as a model has them.
//! Cost: linear.

use super::Link;
use super::beside::widest_m;
use super::order::{Curve, Triangle};
use super::repair::{area_vector, has_area};
use super::report::Finding;
use nalgebra::Vector3;

/// Turns the edges of slivers that are folded over their neighbour, each face's once; says whether there was any.
pub(super) fn unfold(
    triangles: &mut [Triangle],
    links: &[[Link; 3]],
    vertices: &[Vector3<f64>],
    unfolded: &mut Finding,
) -> bool {
    let extent_m = vertices.iter().fold(0.0_f64, |extent, vertex| extent.max(vertex.amax()));
    let folds: Vec<_> = (0..triangles.len())
        .filter_map(|face| Fold::of(face, triangles, links, vertices, widest_m(extent_m)))
        .collect();
    if folds.is_empty() {
        return false;
    }
    let curve = Curve::through(vertices);
    let mut is_changed = vec![false; triangles.len()];
    let mut any = false;
    for Fold { faces, corners } in folds {
        // Of what has changed the links are no longer true.
        let around = || faces.iter().flat_map(|&face| links[face]).filter(|link| !link.is_boundary());
        if faces.iter().any(|&face| is_changed[face]) || around().any(|link| is_changed[link.face() as usize])
        {
            continue;
        }
        unfolded.note(triangles[faces[0]].origin() as usize);
        let origin = triangles[faces[1]].origin();
        for (face, corners) in faces.into_iter().zip(corners) {
            let points = corners.map(|corner| vertices[corner as usize]);
            triangles[face] = Triangle::new(corners, &points, origin, &curve);
            is_changed[face] = true;
        }
        any = true;
    }
    any
}

/// A sliver and the face it is folded over, and what they become.
struct Fold {
    faces: [usize; 2],
    corners: [[u32; 3]; 2],
}

impl Fold {
    fn of(
        face: usize,
        triangles: &[Triangle],
        links: &[[Link; 3]],
        vertices: &[Vector3<f64>],
        widest_m: f64,
    ) -> Option<Self> {
        let at = |corners: [u32; 3]| corners.map(|corner| vertices[corner as usize]);
        let corners = triangles[face].corners;
        let points = at(corners);
        let length_m = |edge: usize| (points[(edge + 1) % 3] - points[edge]).norm();
        let longest = (0..3).max_by(|&i, &j| length_m(i).total_cmp(&length_m(j)))?;
        let area = area_vector(&points);
        // Twice the area over the base; `area_vector` is as long as twice the area.
        if area.norm() > widest_m * length_m(longest) {
            return None;
        }
        let link = links[face][longest];
        if link.is_boundary() || link.is_turned() || triangles[face].is_lid() {
            return None;
        }
        let is_over = |link: &Link| {
            let other = area_vector(&at(triangles[link.face() as usize].corners));
            area.dot(&other) < FOLDED * area.norm() * other.norm()
        };
        let is_folded =
            links[face].iter().any(|link| !link.is_boundary() && !link.is_turned() && is_over(link));
        let other = link.face() as usize;
        let over = triangles[other].corners;
        let over_area = area_vector(&at(over));
        if other == face || triangles[other].is_lid() || !is_folded {
            return None;
        }
        let [a, b, p] = [0, 1, 2].map(|i| corners[(longest + i) % 3]);
        let c = over[(link.edge() + 2) % 3];
        // An edge between the two that is there already would be one of four faces.
        let beside = |face: usize, edge: usize| {
            let link = links[face][edge];
            (!link.is_boundary()).then(|| triangles[link.face() as usize].corners)
        };
        let sides = (0..3).flat_map(|edge| [beside(face, edge), beside(other, edge)]).flatten();
        let is_there = sides.into_iter().any(|corners| corners.contains(&p) && corners.contains(&c));
        let pieces = [[p, a, c], [c, b, p]];
        let goes_on = |corners: &[u32; 3]| {
            let points = at(*corners);
            has_area(&points) && area_vector(&points).dot(&over_area) > 0.0
        };
        (p != c && !is_there && pieces.iter().all(goes_on))
            .then_some(Self { faces: [face, other], corners: pieces })
    }
}

/// Cosine between normals beyond which a face is folded over its neighbour: by more than 170 degrees.
const FOLDED: f64 = -0.985;
