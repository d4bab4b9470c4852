//! Winds all faces counter-clockwise seen from outside, as far as a mesh has an outside.
//!
//! Model, for each part of the mesh that hangs together by edges:
//! 1. Faces are turned over until neighbours agree; the winding that most of the part's faces had stays.
//! 2. A part on which that is impossible (a Klein bottle, a Moebius strip) stays as it was, and its links say
//!    where the winding changes.
//! 3. A closed part that lies in no other one is turned outward, by the sign of its volume. Whatever closed part
//!    lies within its box turns with it: so a cavity, wound inward, stays a cavity, also in a file that is inside
//!    out as a whole.
//!
//! Cost: linear; step 3 also sorts the closed parts ([`nesting`](super::nesting)).

use super::order::Triangle;
use super::report::{Finding, MeshReport};
use super::{Link, Sides, nesting};
use nalgebra::Vector3;

/// Turns faces over where needed, and notes what was found. Says of each face whether its part has an inside.
pub(super) fn orient(
    triangles: &mut [Triangle],
    links: &mut [[Link; 3]],
    vertices: &[Vector3<f64>],
    report: &mut MeshReport,
) -> Vec<Sides> {
    let (mut states, mut parts) = flood(links);
    count(&states, triangles, &mut parts);
    for (state, triangle) in states.iter_mut().zip(&*triangles) {
        state.is_turned_over = parts[state.part as usize].turns(*state);
        if state.is_turned_over {
            report.flipped.note(triangle.origin() as usize);
        }
    }
    measure(&states, triangles, vertices, &mut parts);
    turn_outward(&mut parts, report);
    states.iter_mut().for_each(|state| state.is_turned_over ^= parts[state.part as usize].is_inside_out);
    apply(triangles, links, &states);
    report.components = parts.len();
    report.sheets = Finding::default();
    parts.iter().filter(|part| !part.has_inside()).for_each(|part| report.sheets.note(part.first));
    let sides =
        |state: &State| if parts[state.part as usize].has_inside() { Sides::Solid } else { Sides::Sheet };
    states.iter().map(sides).collect()
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
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Any point of it: volumes are measured from here, since from far away they would cancel.
    apex: Option<Vector3<f64>>,
    /// Times six (m^3); negative if it is inside out. Only of a closed part.
    volume: f64,
    is_inside_out: bool,
}

impl Part {
    fn new() -> Self {
        Self {
            is_closed: true,
            is_orientable: true,
            faces: 0,
            turned_over: 0,
            first: usize::MAX,
            low: Vector3::repeat(f64::INFINITY),
            high: Vector3::repeat(f64::NEG_INFINITY),
            apex: None,
            volume: 0.0,
            is_inside_out: false,
        }
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

/// Boxes and volumes of the closed parts.
fn measure(states: &[State], triangles: &[Triangle], vertices: &[Vector3<f64>], parts: &mut [Part]) {
    for (state, triangle) in states.iter().zip(triangles) {
        let part = &mut parts[state.part as usize];
        if !part.has_inside() {
            continue;
        }
        let [a, b, c] = triangle.corners.map(|v| vertices[v as usize]);
        let apex = *part.apex.get_or_insert(a);
        let volume = (a - apex).dot(&(b - apex).cross(&(c - apex)));
        part.volume += if state.is_turned_over { -volume } else { volume };
        for corner in [a, b, c] {
            part.low = part.low.zip_map(&corner, |low, x| if x < low { x } else { low });
            part.high = part.high.zip_map(&corner, |high, x| if x > high { x } else { high });
        }
    }
}

/// Each closed part like the outermost one around it.
fn turn_outward(parts: &mut [Part], report: &mut MeshReport) {
    let closed: Vec<usize> = (0..parts.len()).filter(|&i| parts[i].has_inside()).collect();
    let boxes: Vec<_> = closed.iter().map(|&i| [parts[i].low, parts[i].high]).collect();
    for (&i, outermost) in closed.iter().zip(nesting::outermost(&boxes)) {
        parts[i].is_inside_out = parts[closed[outermost]].volume < 0.0;
        let part = &parts[i];
        if part.is_inside_out {
            report.inside_out.note(part.first);
        }
        if (part.volume < 0.0) != part.is_inside_out {
            report.cavities.note(part.first);
        }
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
