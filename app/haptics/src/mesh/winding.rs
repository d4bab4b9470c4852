//! Winds the faces of each part of a mesh alike.
//!
//! Model, for each part of the mesh that hangs together by edges:
//! 1. Faces are turned over until neighbours agree; the winding that most of the part's faces had stays.
//! 2. A part on which that is impossible (a Klein bottle, a Moebius strip) stays as it was, and its links say
//!    where the winding changes.
//!
//! Inside and outside of closed parts are decided later ([`nesting`](super::nesting)).
//!
//! Cost: linear.

use super::order::Triangle;
use super::report::{Finding, MeshReport};
use super::{Link, Sides};

/// The parts of a mesh, whose faces are wound alike.
#[derive(Debug)]
pub(super) struct Parts {
    of_face: Vec<u32>,
    all: Vec<Part>,
}

impl Parts {
    /// Part of a face.
    pub(super) fn of(&self, face: usize) -> usize {
        self.of_face[face] as usize
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// The first face of the input in a part.
    pub(super) fn first_of_input(&self, part: usize) -> usize {
        self.all[part].first
    }

    /// True of a part with two sides, perhaps both outside.
    pub(super) fn is_orientable(&self, part: usize) -> bool {
        self.all[part].is_orientable
    }

    /// From where a face is felt.
    pub(super) fn sides(&self, face: usize) -> Sides {
        if self.all[self.of(face)].has_inside() { Sides::Solid } else { Sides::Sheet }
    }
}

#[cfg(test)]
impl Parts {
    /// Parts of a mesh that is built.
    pub(super) fn of_faces(faces: &[super::Face]) -> Self {
        let links: Vec<_> = faces.iter().map(|face| face.links).collect();
        let (states, all) = flood(&links);
        Self { of_face: states.iter().map(|state| state.part).collect(), all }
    }
}

/// Turns faces over where needed, and notes what was found.
pub(super) fn orient(triangles: &mut [Triangle], links: &mut [[Link; 3]], report: &mut MeshReport) -> Parts {
    let (mut states, mut parts) = flood(links);
    count(&states, triangles, &mut parts);
    for (state, triangle) in states.iter_mut().zip(&*triangles) {
        state.is_turned_over = parts[state.part as usize].turns(*state);
        if state.is_turned_over {
            report.flipped.note(triangle.origin() as usize);
        }
    }
    apply(triangles, links, &states);
    report.components = parts.len();
    report.sheets = Finding::default();
    parts.iter().filter(|part| !part.has_inside()).for_each(|part| report.sheets.note(part.first));
    Parts { of_face: states.iter().map(|state| state.part).collect(), all: parts }
}

/// Of a face.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    pub(super) part: u32,
    is_turned_over: bool,
}

const UNSEEN: u32 = u32::MAX;

/// Faces that hang together by edges.
#[derive(Debug)]
pub(super) struct Part {
    is_closed: bool,
    is_orientable: bool,
    faces: usize,
    /// How many of them the flood turned over, to be wound like the first.
    turned_over: usize,
    /// First face of the input.
    first: usize,
}

impl Part {
    fn new() -> Self {
        Self { is_closed: true, is_orientable: true, faces: 0, turned_over: 0, first: usize::MAX }
    }

    /// Whether a face that the flood left in this state is to be turned over: most faces stay as they are, on a
    /// tie the first.
    pub(super) fn turns(&self, state: State) -> bool {
        self.is_orientable && state.is_turned_over != (2 * self.turned_over > self.faces)
    }

    fn has_inside(&self) -> bool {
        self.is_closed && self.is_orientable
    }
}

/// Winds each part like its first face, and finds out on which this leaves a contradiction.
pub(super) fn flood(links: &[[Link; 3]]) -> (Vec<State>, Vec<Part>) {
    let mut states = vec![State { part: UNSEEN, is_turned_over: false }; links.len()];
    let mut parts = Vec::new();
    let mut open = Vec::new();
    for seed in 0..links.len() {
        if states[seed].part != UNSEEN {
            continue;
        }
        let mut part = Part::new();
        let number = parts.len() as u32;
        states[seed].part = number;
        open.push(seed as u32);
        while let Some(face) = open.pop() {
            for link in links[face as usize] {
                if link.is_boundary() {
                    part.is_closed = false;
                    continue;
                }
                let agreeing = states[face as usize].is_turned_over ^ link.is_turned();
                let beyond = &mut states[link.face() as usize];
                if beyond.part == UNSEEN {
                    *beyond = State { part: number, is_turned_over: agreeing };
                    open.push(link.face());
                } else {
                    part.is_orientable &= beyond.is_turned_over == agreeing;
                }
            }
        }
        parts.push(part);
    }
    (states, parts)
}

pub(super) fn count(states: &[State], triangles: &[Triangle], parts: &mut [Part]) {
    for (state, triangle) in states.iter().zip(triangles) {
        let part = &mut parts[state.part as usize];
        part.faces += 1;
        part.turned_over += usize::from(state.is_turned_over);
        part.first = part.first.min(triangle.origin() as usize);
    }
}

/// Turning a face over exchanges its last two corners, and with them its first and last edges.
fn apply(triangles: &mut [Triangle], links: &mut [[Link; 3]], states: &[State]) {
    for (face, own) in links.iter_mut().enumerate() {
        let here = states[face].is_turned_over;
        for link in own.iter_mut().filter(|link| !link.is_boundary()) {
            let beyond = states[link.face() as usize].is_turned_over;
            let edge = if beyond { 2 - link.edge() } else { link.edge() };
            *link = Link::new(link.face(), edge as u8, link.is_turned() ^ here ^ beyond);
        }
        if here {
            own.swap(0, 2);
            triangles[face].corners.swap(1, 2);
        }
    }
}
