//! Finds out which faces share an edge.
//!
//! Model: each edge is entered at its lower-numbered vertex; sorted by the other one, the faces at an edge stand
//! side by side: one on a boundary, two inside, more where parts touch or meet ([`crowded`]). Vertices are numbered in
//! spatial order by now, so this runs through memory in order.

use super::crowded::{self, Crowd};
use super::order::Triangle;
use super::report::MeshReport;
use super::winding::Parts;
use super::{Link, MAX_VALENCE, MeshError, Sides};
use nalgebra::Vector3;

/// The links of every face, as wound in the input.
pub(super) fn link(
    triangles: &[Triangle],
    vertices: &[Vector3<f64>],
    report: &mut MeshReport,
) -> Result<Vec<[Link; 3]>, MeshError> {
    check_valences(triangles, vertices)?;
    let (mut sides, starts) = sides_by_lower_vertex(triangles, vertices.len());
    let mut links = vec![[Link::BOUNDARY; 3]; triangles.len()];
    let (mut crowds, mut rims) = (Vec::new(), Vec::new());
    for (lower, around) in starts.windows(2).enumerate() {
        let around = &mut sides[around[0] as usize..around[1] as usize];
        around.sort_unstable();
        for edge in around.chunk_by(|a, b| a.upper() == b.upper()) {
            match edge {
                [side] => rims.push(side.face()),
                [a, b] => join(&mut links, *a, *b),
                many => crowds.push(Crowd { lower, sides: many.to_vec() }),
            }
        }
    }
    crowded::join_crowds(&crowds, &rims, triangles, vertices, &mut links, report);
    Ok(links)
}

/// True if three and more faces, one of them of a sheet at least, share an edge. Whichever two of them are joined, a walk over
/// that edge passes below the others on one of its sides.
pub(super) fn do_sheets_meet(triangles: &[Triangle], vertices: usize, parts: &Parts) -> bool {
    let (mut sides, starts) = sides_by_lower_vertex(triangles, vertices);
    starts.windows(2).any(|around| {
        let around = &mut sides[around[0] as usize..around[1] as usize];
        around.sort_unstable();
        around.chunk_by(|a, b| a.upper() == b.upper()).any(|edge| {
            edge.len() > 2 && edge.iter().any(|side| parts.sides(side.face() as usize) == Sides::Sheet)
        })
    })
}

/// A face's side of an edge. Packed, so that sorting compares one word: bits 32.. the edge's upper vertex, bit 0
/// whether the face runs upward along it, between them 3 * face + edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) struct Side(u64);

impl Side {
    fn new(face: usize, edge: usize, from: u32, to: u32) -> Self {
        Self(u64::from(from.max(to)) << 32 | ((3 * face + edge) as u64) << 1 | u64::from(from < to))
    }

    pub(super) fn upper(self) -> u32 {
        (self.0 >> 32) as u32
    }

    pub(super) fn face(self) -> u32 {
        (self.0 as u32 >> 1) / 3
    }

    fn edge(self) -> usize {
        ((self.0 as u32 >> 1) % 3) as usize
    }

    pub(super) fn is_upward(self) -> bool {
        self.0 & 1 == 1
    }
}

// 3 * face + edge has 31 bits.
const _: () = assert!(3 * Link::MAX_FACES < 1 << 31);

/// All sides, grouped by the lower vertex v of their edge: `sides[starts[v]..starts[v + 1]]`.
fn sides_by_lower_vertex(triangles: &[Triangle], vertices: usize) -> (Vec<Side>, Vec<u32>) {
    let edges = |corners: &[u32; 3]| [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3]));
    let mut starts = vec![0_u32; vertices + 1];
    for (from, to) in triangles.iter().flat_map(|t| edges(&t.corners)) {
        starts[from.min(to) as usize] += 1;
    }
    let mut end = 0;
    for start in &mut starts {
        end += *start;
        *start = end;
    }
    // Each start is now the group's end, and falls to its beginning as the group fills from behind.
    let mut sides = vec![Side::default(); 3 * triangles.len()];
    for (face, triangle) in triangles.iter().enumerate().rev() {
        for (edge, (from, to)) in edges(&triangle.corners).into_iter().enumerate() {
            let start = &mut starts[from.min(to) as usize];
            *start -= 1;
            sides[*start as usize] = Side::new(face, edge, from, to);
        }
    }
    (sides, starts)
}

pub(super) fn join(links: &mut [[Link; 3]], a: Side, b: Side) {
    let turned = a.is_upward() == b.is_upward();
    links[a.face() as usize][a.edge()] = Link::new(b.face(), b.edge() as u8, turned);
    links[b.face() as usize][b.edge()] = Link::new(a.face(), a.edge() as u8, turned);
}

pub(super) fn first_of_input(sides: &[Side], triangles: &[Triangle]) -> usize {
    sides.iter().map(|side| triangles[side.face() as usize].origin() as usize).min().unwrap_or(0)
}

fn check_valences(triangles: &[Triangle], vertices: &[Vector3<f64>]) -> Result<(), MeshError> {
    let mut faces = vec![0_u32; vertices.len()];
    for corner in triangles.iter().flat_map(|triangle| triangle.corners) {
        faces[corner as usize] += 1;
    }
    match faces.iter().position(|&count| count > MAX_VALENCE) {
        Some(vertex) => Err(MeshError::Valence {
            at_B: vertices[vertex].into(),
            faces: faces[vertex] as usize,
            allowed: MAX_VALENCE as usize,
        }),
        None => Ok(()),
    }
}
