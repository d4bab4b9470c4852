//! Edges of three and more faces: which of them are neighbours.
//!
//! Problem: a wall inside a solid, a fin on it, sheets that meet and skins that lie upon each other share edges with what they
//! touch. A walk over such an edge needs one next face or none; and the solid must stay closed, whatever hangs on it.
//!
//! Model: faces that hang together by edges of two faces are a piece. Each piece is wound as most of its faces were. Then, at
//! each edge, by the first rule that applies:
//! 1. Where faces that look one way and the other alternate around the edge, those are neighbours that bound the same
//!    piece of outside ([`touching`](super::touching)).
//! 2. Two faces of the same piece are neighbours: a solid goes on below a fin.
//! 3. Of what is left, faces that bound the same wedge of outside are neighbours, as brackets that open and close; first among
//!    pieces without a rim of their own, then among all: a solid closes around a wall within and below a flange.
//! 4. What is left looks one way. The two of different pieces that are bent the least are neighbours; all others end there, at
//!    a rim.
//!
//! Limit: the two faces that are joined pass below the ones that end there, so a walk over neighbours would slip through between
//! them. Where one of them is of a sheet, points roll over the mesh as [balls](super::Mesh::point_radius_m), which meet all.
//! Invariant: each face has one neighbour at most across the edge; neighbours are wound alike as far as their pieces can be.
//! Cost: linear in the faces, plus sorting the faces of each such edge.

use super::Link;
use super::order::Triangle;
use super::report::MeshReport;
use super::topology::{Side, first_of_input, join};
use super::touching::{pair_across_outside, sorted_by_angle};
use super::winding::{Part, State, count, flood};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// The faces at an edge of three and more.
pub(super) struct Crowd {
    /// The end of the edge with the lower number.
    pub(super) lower: usize,
    pub(super) sides: Vec<Side>,
}

/// Joins what can be joined. `rims` names faces at edges of one face.
pub(super) fn join_crowds(
    crowds: &[Crowd],
    rims: &[u32],
    triangles: &[Triangle],
    vertices: &[Vector3<f64>],
    links: &mut [[Link; 3]],
    report: &mut MeshReport,
) {
    if crowds.is_empty() {
        return;
    }
    let pieces = Pieces::new(links, rims, triangles);
    for Crowd { lower, sides } in crowds {
        let around = sorted_by_angle(sides, *lower, triangles, vertices);
        let first = first_of_input(sides, triangles);
        let is_upward = |side| pieces.is_upward(side);
        if let Some(pairs) = pair_across_outside(&around, is_upward) {
            pairs.iter().for_each(|&[a, b]| join(links, a, b));
            report.touching_edges.note(first);
            continue;
        }
        report.crowded_edges.note(first);
        let mut left = around;
        let mut pairs = within_pieces(&left, &pieces);
        take_out(&mut left, &pairs);
        for counts in [|has_rim: bool| !has_rim, |_| true] {
            let of_these = left.iter().map(|(_, side)| *side).filter(|side| counts(pieces.has_rim(*side)));
            let more = brackets(&of_these.collect::<Vec<_>>(), is_upward);
            take_out(&mut left, &more);
            pairs.extend(more);
        }
        let of_pieces: Vec<_> = left.iter().map(|&(angle, side)| (angle, pieces.piece(side))).collect();
        pairs.extend(flattest(&of_pieces).map(|pair| pair.map(|at| left[at].1)));
        pairs.iter().for_each(|&[a, b]| join(links, a, b));
    }
}

/// What hangs together by edges of two faces.
struct Pieces {
    states: Vec<State>,
    parts: Vec<Part>,
    has_rim: Vec<bool>,
}

impl Pieces {
    fn new(links: &[[Link; 3]], rims: &[u32], triangles: &[Triangle]) -> Self {
        let (states, mut parts) = flood(links);
        count(&states, triangles, &mut parts);
        let mut has_rim = vec![false; parts.len()];
        rims.iter().for_each(|&face| has_rim[states[face as usize].part as usize] = true);
        Self { states, parts, has_rim }
    }

    fn piece(&self, side: Side) -> usize {
        self.states[side.face() as usize].part as usize
    }

    fn has_rim(&self, side: Side) -> bool {
        self.has_rim[self.piece(side)]
    }

    /// Whether a face runs upward along the edge, once it is wound like its piece.
    fn is_upward(&self, side: Side) -> bool {
        let state = self.states[side.face() as usize];
        side.is_upward() != self.parts[state.part as usize].turns(state)
    }
}

/// Faces that are the only two of their piece, and look different ways.
fn within_pieces(left: &[(f64, Side)], pieces: &Pieces) -> Vec<[Side; 2]> {
    let mut by_piece: Vec<(usize, Side)> = left.iter().map(|&(_, side)| (pieces.piece(side), side)).collect();
    by_piece.sort_unstable();
    let of_piece = by_piece.chunk_by(|a, b| a.0 == b.0).filter_map(|piece| match piece {
        &[(_, a), (_, b)] => (pieces.is_upward(a) != pieces.is_upward(b)).then_some([a, b]),
        _ => None,
    });
    of_piece.collect()
}

/// Faces that bound the same wedge of outside. The outside lies ahead of a face that runs upward, so that is an opening
/// bracket, closed by the next one that runs downward and is not closed yet; around the edge and once more.
fn brackets(around: &[Side], is_upward: impl Fn(Side) -> bool) -> Vec<[Side; 2]> {
    let (mut open, mut pairs): (Vec<usize>, Vec<[Side; 2]>) = (Vec::new(), Vec::new());
    let mut is_closed = vec![false; around.len()];
    for turn in 0..2 * around.len() {
        let at = turn % around.len();
        if is_closed[at] {
            continue;
        }
        if is_upward(around[at]) {
            if turn < around.len() {
                open.push(at);
            }
        } else if let Some(opened) = open.pop() {
            (is_closed[opened], is_closed[at]) = (true, true);
            pairs.push([around[opened], around[at]]);
        }
    }
    pairs
}

/// Of faces that all look the same way, the two of different pieces that lie most nearly in one plane: of sheets nobody
/// can tell which way they are meant. Angles and pieces come by their angle, so that those opposite of a face stand side by side.
fn flattest(left: &[(f64, usize)]) -> Option<[usize; 2]> {
    let count = left.len();
    let piece_at = |at: usize| left[at].1;
    if (1..count).all(|at| piece_at(at) == piece_at(0)) {
        return None;
    }
    // For each the next one of another piece, going up and going down; twice around, since the first ones need the last.
    let (mut above, mut below) = (vec![0; count], vec![0; count]);
    for turn in 0..2 * count {
        let (at, before) = (turn % count, (turn + count - 1) % count);
        below[at] = if piece_at(before) == piece_at(at) { below[before] } else { before };
    }
    for turn in (0..2 * count).rev() {
        let (at, after) = (turn % count, (turn + 1) % count);
        above[at] = if piece_at(after) == piece_at(at) { above[after] } else { after };
    }
    let opposite = |at: usize| {
        let (angle, _) = left[at];
        let over = if angle > 0.0 { angle - PI } else { angle + PI };
        let up = left.partition_point(|(angle, _)| *angle < over) % count;
        let down = (up + count - 1) % count;
        let other =
            |near: usize, next: &[usize]| if piece_at(near) == piece_at(at) { next[near] } else { near };
        [other(up, &above), other(down, &below)].map(|other| [at.min(other), at.max(other)])
    };
    let bend = |[a, b]: &[usize; 2]| (left[*a].0 - left[*b].0).cos();
    (0..count).flat_map(opposite).min_by(|a, b| bend(a).total_cmp(&bend(b)).then(a.cmp(b)))
}

fn take_out(left: &mut Vec<(f64, Side)>, pairs: &[[Side; 2]]) {
    let mut out = pairs.as_flattened().to_vec();
    out.sort_unstable();
    left.retain(|(_, side)| out.binary_search(side).is_err());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flattest_pair_is_that_of_all_pairs() {
        let mut state = 3_u64;
        let mut next = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for round in 0..2000 {
            let (count, pieces) = (next(12), 1 + next(5));
            // Some angles are equal or opposite.
            let steps = if round % 2 == 0 { 16 } else { 1 << 20 };
            let mut angle = || (2 * next(steps)) as f64 * PI / steps as f64 - PI;
            let mut angles: Vec<f64> = (0..count).map(|_| angle()).collect();
            angles.sort_unstable_by(f64::total_cmp);
            let left: Vec<_> = angles.into_iter().map(|angle| (angle, next(pieces) as usize)).collect();
            let bend = |a: usize, b: usize| (left[a].0 - left[b].0).cos();
            let pairs = (0..left.len()).flat_map(|a| (0..a).map(move |b| [b, a]));
            let of_two = pairs.filter(|&[a, b]| left[a].1 != left[b].1);
            let least = of_two.map(|[a, b]| bend(a, b)).min_by(f64::total_cmp);
            let found = flattest(&left);
            assert_eq!(found.map(|[a, b]| bend(a, b)), least, "{left:?}");
            assert!(found.is_none_or(|[a, b]| a < b && left[a].1 != left[b].1), "{left:?} {found:?}");
        }
    }
}
