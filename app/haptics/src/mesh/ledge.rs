//! Ledges of a part that no finger feels: a point steps over them.
//!
//! Problem: programs write walls of micrometres where outlines were rounded or parts were joined. One that stands straight or
//! leans over holds a point for good: the HIP is behind it and behind the floor, however far it goes.
//!
//! Model: a face that reaches no farther than [`widest_m`] from its longest edge is low, and a wall if it is concave with a
//! neighbour, and no gentle slope to it. A god-object that is held at the foot of such a wall, or by friction on it, goes on with
//! a step as over the ledge of another part ([`crack`](super::crack)), once the HIP is beyond it by as much as a step.
//!
//! Frames: object frame B.
//! Limit: a gentle slope holds the god-object back by up to a third of its depth. A wall that is made of several low strips is
//! stepped over from a floor that is at most two edges away.
//! Cost: linear in the faces of a mesh. In a tick nothing away from ledges; at one, up to [`MOST_STEPS`] steps, each of up to
//! five questions to the hierarchy.

use nalgebra::Vector3;
use std::collections::HashSet;

use super::beside::widest_m;
use super::crack::over_wall;
use super::face::Link;
use super::fan::for_each_around;
use super::place::{Facet, On, Place, Side, previous};
use super::{Mesh, Sides};

impl Mesh {
    /// Marks the faces at ledges.
    pub(super) fn mark_ledges(&mut self) {
        let walls = (0..self.faces.len() as u32).filter(|face| self.is_low_wall(*face));
        let vertices: HashSet<u32> = walls.flat_map(|face| self.faces[face as usize].vertices).collect();
        if vertices.is_empty() {
            return;
        }
        for face in self.faces.iter_mut().filter(|face| face.sides == Sides::Solid) {
            face.is_at_ledge = face.vertices.iter().any(|vertex| vertices.contains(vertex));
        }
    }

    /// A low face, no gentle slope, that is concave with a neighbour.
    fn is_low_wall(&self, index: u32) -> bool {
        let face = &self.faces[index as usize];
        let rises = |link: &Link| {
            let floor = &self.faces[link.face() as usize];
            let opposite_B = self.vertices[floor.vertices[previous(link.edge())] as usize];
            floor.normal_B.dot(&face.normal_B) < GENTLE && face.normal_B.dot(&opposite_B) > face.offset_m
        };
        let mut links = face.links.iter();
        face.sides == Sides::Solid
            && self.is_low(index)
            && links.any(|link| !link.is_boundary() && rises(link))
    }

    /// It reaches no farther from its longest edge than a crack is wide.
    fn is_low(&self, face: u32) -> bool {
        let [a, b, c] = self.faces[face as usize].vertices.map(|vertex| self.vertices[vertex as usize]);
        let twice_area = (b - a).cross(&(c - a)).norm();
        let longest_m = [b - a, c - b, a - c].map(|side| side.norm()).into_iter().fold(0.0, f64::max);
        twice_area <= widest_m(self.extent_m) * longest_m
    }
}

/// On top of the ledge that a god-object is held by, with the HIP beyond it as far as a step.
#[cold]
pub(super) fn off_ledge(mesh: &Mesh, at_B: &Vector3<f64>, on: On, hip_B: &Vector3<f64>) -> Option<Place> {
    let low = |side: Side| mesh.is_low(side.face).then_some(side);
    let across =
        |of: Side| mesh.faces[of.face as usize].links.into_iter().filter_map(move |link| of.across(link));
    let mut steps = 0;
    let mut off = |floor: Side, wall: Side| {
        let along_B = way_beyond(mesh, at_B, [floor, wall], hip_B).filter(|_| steps < MOST_STEPS)?;
        steps += 1;
        over_wall(mesh, &Facet::of(mesh, floor), at_B, &along_B, hip_B)
    };
    match on {
        On::Crossing(..) => None,
        // By friction it rests on the wall, too.
        On::Face(side) | On::Edge(side, _) => {
            let edge = if let On::Edge(_, edge) = on { Some(edge) } else { None };
            let over = edge.and_then(|edge| side.across(mesh.faces[side.face as usize].links[edge]));
            let mut walls = [Some(side), over].into_iter().flatten().filter_map(low);
            walls.find_map(|wall| {
                let next = || across(wall);
                next().chain(next().flat_map(across)).find_map(|floor| off(floor, wall))
            })
        }
        On::Vertex(side, corner) => {
            let (mut wall, mut top) = (None, None);
            for_each_around(mesh, side, corner, |sector| wall = wall.or_else(|| low(sector.facet.side)));
            let wall = wall?;
            for_each_around(mesh, side, corner, |sector| {
                top = top.or_else(|| off(sector.facet.side, wall));
            });
            top
        }
    }
}

/// Way along a floor to above the HIP, if that is beyond a wall which is no gentle slope.
fn way_beyond(
    mesh: &Mesh,
    at_B: &Vector3<f64>,
    [floor, wall]: [Side; 2],
    hip_B: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let [floor_B, wall_B] = [floor, wall].map(|side| Facet::of(mesh, side).normal_B);
    let to_hip_B = hip_B - at_B;
    let along_B = to_hip_B - floor_B * floor_B.dot(&to_hip_B);
    let is_beyond = along_B.norm() > 2.0 * widest_m(mesh.extent_m);
    (is_beyond && floor_B.dot(&wall_B) < GENTLE && wall_B.dot(&along_B) < 0.0).then_some(along_B)
}

/// Floors from which a way over a ledge is looked for at once.
const MOST_STEPS: u32 = 6;
/// Cosine of the angle up to which a wall is a slope, which a point goes up by itself: 20 degrees.
const GENTLE: f64 = 0.94;
