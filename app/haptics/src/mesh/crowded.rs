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
//! Limit: the two faces that are joined pass below the ones that end there. A god-object that is pressed into the corner
//! between them slides through below.
//! Invariant: each face has one neighbour at most across the edge; neighbours are wound alike as far as their pieces can be.
//! Cost: linear in the faces, plus sorting the faces of each such edge.

use super::Link;
use super::order::Triangle;
use super::report::MeshReport;
use super::topology::{Side, first_of_input, join};
use super::touching::{pair_across_outside, sorted_by_angle};
use super::winding::{Part, State, count, flood};
use nalgebra::Vector3;

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
        let mut left: Vec<Side> = around.iter().map(|(_, side)| *side).collect();
        let mut pairs = within_pieces(&left, &pieces);
        take_out(&mut left, &pairs);
        for counts in [|has_rim: bool| !has_rim, |_| true] {
            let of_these = left.iter().copied().filter(|side| counts(pieces.has_rim(*side)));
            let more = brackets(&of_these.collect::<Vec<_>>(), is_upward);
            take_out(&mut left, &more);
            pairs.extend(more);
        }
        pairs.extend(flattest(&left, &around, &pieces));
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
fn within_pieces(left: &[Side], pieces: &Pieces) -> Vec<[Side; 2]> {
    let mut pairs = Vec::new();
    for &side in left {
        let mut of_piece = left.iter().copied().filter(|&other| pieces.piece(other) == pieces.piece(side));
        if let (Some(a), Some(b), None) = (of_piece.next(), of_piece.next(), of_piece.next())
            && a == side
            && pieces.is_upward(a) != pieces.is_upward(b)
        {
            pairs.push([a, b]);
        }
    }
    pairs
}

/// Faces that bound the same wedge of outside. The outside lies ahead of a face that runs upward, so that is an opening
/// bracket, closed by the next one that runs downward and is not closed yet; around the edge and once more.
fn brackets(around: &[Side], is_upward: impl Fn(Side) -> bool) -> Vec<[Side; 2]> {
    let (mut open, mut pairs): (Vec<Side>, Vec<[Side; 2]>) = (Vec::new(), Vec::new());
    for (turn, &side) in around.iter().chain(around).enumerate() {
        if pairs.as_flattened().contains(&side) {
            continue;
        }
        if is_upward(side) {
            if turn < around.len() {
                open.push(side);
            }
        } else if let Some(opened) = open.pop() {
            pairs.push([opened, side]);
        }
    }
    pairs
}

/// Of faces that all look the same way, the two of different pieces that lie most nearly in one plane: of sheets nobody
/// can tell which way they are meant.
fn flattest(left: &[Side], around: &[(f64, Side)], pieces: &Pieces) -> Option<[Side; 2]> {
    let angle_of =
        |side: Side| around.iter().find(|(_, other)| *other == side).map_or(0.0, |(angle, _)| *angle);
    let bend = |[a, b]: &[Side; 2]| (angle_of(*a) - angle_of(*b)).cos();
    let pairs = left.iter().enumerate().flat_map(|(i, &a)| left[i + 1..].iter().map(move |&b| [a, b]));
    let of_two = pairs.filter(|[a, b]| pieces.piece(*a) != pieces.piece(*b));
    of_two.min_by(|a, b| bend(a).total_cmp(&bend(b)))
}

fn take_out(left: &mut Vec<Side>, pairs: &[[Side; 2]]) {
    left.retain(|side| !pairs.as_flattened().contains(side));
}
