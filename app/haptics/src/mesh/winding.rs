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
//! Cost: linear; step 3 also compares each closed part with the outermost ones.

use super::repair::Triangle;
use super::report::MeshReport;
use super::{Link, Sides};
use nalgebra::Vector3;

/// Turns faces over where needed, and notes what was found.
pub(super) fn orient(
    triangles: &mut [Triangle],
    links: &mut [[Link; 3]],
    vertices: &[Vector3<f64>],
    report: &mut MeshReport,
) -> Sides {
    let mut turned_over = vec![false; triangles.len()];
    let mut parts = Vec::new();
    let members = agree(links, triangles, &mut turned_over, &mut parts, report);
    let mut closed: Vec<Closed> = parts
        .iter()
        .filter(|part| part.is_closed && part.is_orientable)
        .map(|part| Closed::new(&members[part.from..part.to], triangles, &turned_over, vertices))
        .collect();
    turn_outward(&mut closed, &mut turned_over, report);
    apply(triangles, links, &turned_over);
    report.components = parts.len();
    if closed.len() == parts.len() { Sides::Solid } else { Sides::Sheet }
}

/// Faces that hang together: `members[from..to]`.
struct Part {
    from: usize,
    to: usize,
    is_closed: bool,
    is_orientable: bool,
}

/// Floods each part from its first face. Gives the faces, part by part.
fn agree(
    links: &[[Link; 3]],
    triangles: &[Triangle],
    turned_over: &mut [bool],
    parts: &mut Vec<Part>,
    report: &mut MeshReport,
) -> Vec<u32> {
    let mut members: Vec<u32> = Vec::with_capacity(links.len());
    let mut seen = vec![false; links.len()];
    for seed in 0..links.len() {
        if seen[seed] {
            continue;
        }
        let from = members.len();
        let (is_closed, is_orientable) = flood(seed as u32, links, &mut seen, turned_over, &mut members);
        let part = &members[from..];
        if is_orientable {
            keep_majority(part, turned_over);
            let turned = part.iter().filter(|&&face| turned_over[face as usize]);
            turned.for_each(|&face| report.flipped.note(triangles[face as usize].origin as usize));
        } else {
            part.iter().for_each(|&face| turned_over[face as usize] = false);
        }
        parts.push(Part { from, to: members.len(), is_closed, is_orientable });
    }
    members
}

/// Appends the part of `seed` to `members`, wound like it. Gives whether it is closed and orientable.
fn flood(
    seed: u32,
    links: &[[Link; 3]],
    seen: &mut [bool],
    turned_over: &mut [bool],
    members: &mut Vec<u32>,
) -> (bool, bool) {
    let (mut is_closed, mut is_orientable) = (true, true);
    let mut next = members.len();
    members.push(seed);
    seen[seed as usize] = true;
    while next < members.len() {
        let face = members[next] as usize;
        next += 1;
        for link in links[face] {
            if link.is_boundary() {
                is_closed = false;
                continue;
            }
            let neighbour = link.face() as usize;
            let agreeing = turned_over[face] ^ link.is_turned();
            if !seen[neighbour] {
                seen[neighbour] = true;
                turned_over[neighbour] = agreeing;
                members.push(neighbour as u32);
            } else if turned_over[neighbour] != agreeing {
                is_orientable = false;
            }
        }
    }
    (is_closed, is_orientable)
}

/// On a tie the first face stays as it is: it was the seed.
fn keep_majority(part: &[u32], turned_over: &mut [bool]) {
    let turned = part.iter().filter(|&&face| turned_over[face as usize]).count();
    if 2 * turned > part.len() {
        turn_over(part, turned_over);
    }
}

fn turn_over(part: &[u32], turned_over: &mut [bool]) {
    part.iter().for_each(|&face| turned_over[face as usize] ^= true);
}

/// A closed part with an inside and an outside.
struct Closed<'a> {
    members: &'a [u32],
    /// Of the input (face).
    first: usize,
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Times six \[m^3\]; negative if it is inside out.
    volume: f64,
}

impl<'a> Closed<'a> {
    fn new(
        members: &'a [u32],
        triangles: &[Triangle],
        turned_over: &[bool],
        vertices: &[Vector3<f64>],
    ) -> Self {
        let corners = |face: u32| triangles[face as usize].corners.map(|v| vertices[v as usize]);
        // From a point of the part: from far away, tetrahedra would cancel.
        let apex = corners(members[0])[0];
        let origins = members.iter().map(|&face| triangles[face as usize].origin as usize);
        let mut part =
            Self { members, first: origins.min().unwrap_or(0), low: apex, high: apex, volume: 0.0 };
        for &face in members {
            let [a, b, c] = corners(face);
            part.low = part.low.inf(&a.inf(&b).inf(&c));
            part.high = part.high.sup(&a.sup(&b).sup(&c));
            let volume = (a - apex).dot(&(b - apex).cross(&(c - apex)));
            part.volume += if turned_over[face as usize] { -volume } else { volume };
        }
        part
    }

    fn contains(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low[i] < other.low[i] && other.high[i] < self.high[i])
    }
}

fn turn_outward(closed: &mut [Closed], turned_over: &mut [bool], report: &mut MeshReport) {
    // What lies in a box comes after it. Stable, so parts of one size stay in spatial order.
    closed.sort_by(|a, b| (b.high - b.low).sum().total_cmp(&(a.high - a.low).sum()));
    let mut outermost: Vec<usize> = Vec::new();
    for i in 0..closed.len() {
        let around = outermost.iter().find(|&&o| closed[o].contains(&closed[i]));
        let is_inside_out = closed[around.copied().unwrap_or(i)].volume < 0.0;
        if is_inside_out {
            report.inside_out.note(closed[i].first);
            turn_over(closed[i].members, turned_over);
        }
        if around.is_none() {
            outermost.push(i);
        }
        if (closed[i].volume < 0.0) != is_inside_out {
            report.cavities.note(closed[i].first);
        }
    }
}

/// Turning a face over exchanges its last two corners, and with them its first and last edges.
fn apply(triangles: &mut [Triangle], links: &mut [[Link; 3]], turned_over: &[bool]) {
    for (face, own) in links.iter_mut().enumerate() {
        for link in own.iter_mut().filter(|link| !link.is_boundary()) {
            let beyond = turned_over[link.face() as usize];
            let edge = if beyond { 2 - link.edge() } else { link.edge() };
            *link = Link::new(link.face(), edge as u8, link.is_turned() ^ turned_over[face] ^ beyond);
        }
        if turned_over[face] {
            own.swap(0, 2);
            triangles[face].corners.swap(1, 2);
        }
    }
}
