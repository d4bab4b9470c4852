//! T-junctions: a vertex of one face on the edge of another.
//!
//! Problem: two faces on one side of an edge and one on the other share no edge, so the mesh has a crack there that no eye sees
//! and no finger should.
//!
//! Model: an edge of one face alone, with vertices of other such edges upon it, is divided at these, if the pieces fit any of
//! those edges. Upon it is what is nearer than [`NEAR`] of the mesh: files with six digits are no more exact.
//!
//! Limit: pieces are to join sides of other faces, so there are no more of them than the input had sides. A division that would
//! make more is left out: a hundred faces upon the same long edge with a hundred vertices upon it mean nothing.
//! Cost: nothing for a closed mesh; else sorting the vertices at open edges, and at most [`MOST_LOOKS`] comparisons.

use super::Link;
use super::order::{Curve, Triangle};
use super::repair::has_area;
use super::report::Finding;
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// Divides what can be divided, each face on one edge at most; says whether there was any. `room` is how many faces may be added.
pub(super) fn divide(
    triangles: &mut Vec<Triangle>,
    links: &[[Link; 3]],
    vertices: &[Vector3<f64>],
    room: &mut usize,
    divided: &mut Finding,
) -> bool {
    let open = Open::new(triangles, links, vertices);
    let (mut looks, mut pieces) = (0, Vec::new());
    for face in 0..links.len() {
        let corners = triangles[face].corners;
        let is_open = |edge: &usize| links[face][*edge].is_boundary();
        let division = (0..3).filter(is_open).find_map(|edge| {
            let turned = [0, 1, 2].map(|i| corners[(edge + i) % 3]);
            let upon = open.upon(turned, vertices, &mut looks);
            if upon.len() <= *room { open.divided(turned, &upon, vertices) } else { None }
        });
        if let Some(division) = division {
            *room -= division.len() - 1;
            pieces.push((face, division));
        }
        if looks > MOST_LOOKS {
            break;
        }
    }
    let curve = Curve::through(vertices);
    for (face, division) in &pieces {
        let origin = triangles[*face].origin();
        divided.note(origin as usize);
        let mut pieces =
            division.iter().map(|corners| Triangle::new(*corners, &at(vertices, corners), origin, &curve));
        if let Some(first) = pieces.next() {
            triangles[*face] = first;
        }
        triangles.extend(pieces);
    }
    !pieces.is_empty()
}

/// Where the mesh ends.
struct Open {
    /// By their place along x.
    vertices: Vec<u32>,
    edges: BTreeSet<[u32; 2]>,
    near_m: f64,
}

impl Open {
    fn new(triangles: &[Triangle], links: &[[Link; 3]], vertices: &[Vector3<f64>]) -> Self {
        let mut edges = BTreeSet::new();
        for (Triangle { corners, .. }, links) in triangles.iter().zip(links) {
            let open = (0..3).filter(|&edge| links[edge].is_boundary());
            edges.extend(open.map(|edge| ends(corners[edge], corners[(edge + 1) % 3])));
        }
        let mut open: Vec<u32> = edges.iter().flatten().copied().collect();
        let x = |vertex: &u32| vertices[*vertex as usize].x;
        open.sort_unstable_by(|a, b| x(a).total_cmp(&x(b)).then(a.cmp(b)));
        open.dedup();
        let extent_m = vertices.iter().fold(0.0_f64, |extent, vertex| extent.max(vertex.amax()));
        Self { vertices: open, edges, near_m: NEAR * extent_m }
    }

    /// The vertices upon the edge from the first corner to the second, in order.
    fn upon(&self, [a, b, c]: [u32; 3], vertices: &[Vector3<f64>], looks: &mut usize) -> Vec<u32> {
        let [from, to] = [a, b].map(|vertex| vertices[vertex as usize]);
        let along = to - from;
        let length_m = along.norm();
        let least = from.x.min(to.x) - self.near_m;
        let most = from.x.max(to.x) + self.near_m;
        let first = self.vertices.partition_point(|&vertex| vertices[vertex as usize].x < least);
        let mut upon = Vec::new();
        for &vertex in &self.vertices[first..] {
            let away = vertices[vertex as usize] - from;
            *looks += 1;
            if away.x + from.x > most || *looks > MOST_LOOKS {
                break;
            }
            let reach_m = away.dot(&along) / length_m;
            let is_between = reach_m > self.near_m && reach_m < length_m - self.near_m;
            let is_near = (away - along * (reach_m / length_m)).norm() <= self.near_m;
            if is_between && is_near && vertex != c {
                upon.push((reach_m, vertex));
            }
        }
        upon.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        upon.into_iter().map(|(_, vertex)| vertex).collect()
    }

    /// The pieces of a face that is divided on its first edge; `None` if that would join nothing, or leave a face without an area.
    fn divided(&self, [a, b, c]: [u32; 3], upon: &[u32], vertices: &[Vector3<f64>]) -> Option<Vec<[u32; 3]>> {
        let chain: Vec<u32> = std::iter::once(a).chain(upon.iter().copied()).chain([b]).collect();
        let fits = |pair: &[u32]| self.edges.contains(&ends(pair[0], pair[1]));
        let is_useful = !upon.is_empty() && chain.windows(2).any(fits);
        let pieces: Vec<[u32; 3]> = chain.windows(2).map(|pair| [pair[0], pair[1], c]).collect();
        (is_useful && pieces.iter().all(|piece| has_area(&at(vertices, piece)))).then_some(pieces)
    }
}

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn at(vertices: &[Vector3<f64>], corners: &[u32; 3]) -> [Vector3<f64>; 3] {
    corners.map(|corner| vertices[corner as usize])
}

/// Of the mesh's largest coordinate.
const NEAR: f64 = 1e-6;
/// A mesh of a million loose faces is not searched to the end.
const MOST_LOOKS: usize = 50_000_000;
