//! Walks where faces pass through one another.
//!
//! Problem: where one part comes out of another no edge joins their faces, and a walk over neighbours would go on into the
//! other part.
//!
//! Model: on a face that others cross ([`crossed`](super::crossed)) the way is tried against these. Where it meets one it goes
//! on along the line in which both cross, as along a concave edge ([`facing`](super::facing)). Over an edge of one of them it
//! comes to what lies beyond, and to the other again at once, without a way. At an edge that pierces a face two lines begin;
//! it takes the one that leads towards the HIP. Where three faces meet and hold it, each pair has its turn, and it rests.
//!
//! Limit: two faces are known at a time; where four and more meet in a point a walk may rest although there is a way on. Faces
//! that have a vertex in common are taken for neighbours: over a fan that passes through itself points roll
//! ([`inverted`](super::inverted)).

use nalgebra::Vector3;

use super::Mesh;
use super::crack::over_ledge;
use super::place::{Facet, On, Place, Side, previous};
use super::walk::{RIM, Reached, cross_face, plane_through, rim};

/// Goes along the line in which two faces cross: to the target, or to the first of their edges on the way.
pub(super) fn follow_crossing(
    mesh: &Mesh,
    sides: [Side; 2],
    from_B: Vector3<f64>,
    target_B: Vector3<f64>,
) -> Reached {
    let [first, second] = sides.map(|side| cross_face(mesh, side, from_B, target_B));
    let way_m = |reached: &Reached| match reached {
        Reached::Target(_) => f64::INFINITY,
        Reached::Rim(place) => (place.point_B - from_B).norm(),
    };
    match if way_m(&second) < way_m(&first) { second } else { first } {
        Reached::Target(_) => Reached::Target(Place::new(target_B, On::Crossing(sides[0], sides[1]))),
        rim => rim,
    }
}

/// Of a way along faces that others cross: as far as one of these lets it go.
#[cold]
pub(super) fn meet_others(mesh: &Mesh, place: Place, reached: Reached, hip_B: &Vector3<f64>) -> Reached {
    let side = place.on.side();
    let here = &mesh.faces[side.face as usize];
    let beside = match place.on {
        On::Crossing(_, other) => other.face,
        On::Edge(_, edge) => side.across(here.links[edge]).map_or(side.face, |over| over.face),
        _ => side.face,
    };
    let beside = &mesh.faces[beside as usize];
    let way_B = reached.place().point_B - place.point_B;
    let mut passed = [side.face; MAX_PASSED];
    for passing in 0..MAX_PASSED {
        let is_skipped = |number: u32| {
            let face = &mesh.faces[number as usize];
            let is_neighbour = |vertex| here.vertices.contains(vertex) || beside.vertices.contains(vertex);
            // Along a face that is parallel, what is met is rounding.
            let is_parallel = || here.normal_B.cross(&face.normal_B).norm() < PARALLEL_FACES;
            !face.is_crossed
                || passed.contains(&number)
                || face.vertices.iter().any(is_neighbour)
                || is_parallel()
        };
        let Some(hit) = mesh.first_hit_of_others(&place.point_B, &reached.place().point_B, is_skipped) else {
            break;
        };
        let on_rim = |place: Place| rim(mesh, place).unwrap_or(place).on;
        let met = on_rim(Place::hit(&hit));
        if !leads_past(mesh, met, &way_B) {
            if here.is_beside
                && let Some(on_top) = over_ledge(mesh, [side, met.side()], &hit.point_B, &way_B, hip_B)
            {
                return Reached::Rim(on_top);
            }
            let to_hip_B = hip_B - hit.point_B;
            // Of three that meet, each pair has its turn.
            let side = if let On::Crossing(_, other) = place.on { other } else { side };
            let here = on_rim(Place::new(hit.point_B, On::Face(side)));
            let side = face_of_line(mesh, here, met.side(), &to_hip_B);
            let other = face_of_line(mesh, met, side, &to_hip_B);
            let other = if goes_away_in_fold(mesh, [met.side(), other], &way_B) { met.side() } else { other };
            return Reached::Rim(Place::new(hit.point_B, On::Crossing(side, other)));
        }
        passed[passing] = hit.face;
    }
    reached
}

/// Of the faces that meet at an edge or a vertex, the one into which the line leads, towards the HIP, in which `other` crosses
/// it.
fn face_of_line(mesh: &Mesh, on: On, other: Side, to_hip_B: &Vector3<f64>) -> Side {
    let side = on.side();
    let [here, other] = [side, other].map(|side| Facet::of(mesh, side));
    let line_B = here.normal_B.cross(&other.normal_B);
    let leads_out = |&edge: &usize| {
        let (_, edge_B) = here.edge_B(mesh, edge);
        here.inward_B(&edge_B).dot(&line_B) * to_hip_B.dot(&line_B) < 0.0
    };
    let edge = edges_at(on).into_iter().flatten().find(leads_out);
    edge.and_then(|edge| side.across(here.face.links[edge])).unwrap_or(side)
}

/// True if a way that comes into the first of two neighbours goes away from the other one, at the foot of a fold between them:
/// that one is not in its way, and to follow it leads to the first again, for ever.
fn goes_away_in_fold(mesh: &Mesh, [met, other]: [Side; 2], way_B: &Vector3<f64>) -> bool {
    let [met, other] = [met, other].map(|side| Facet::of(mesh, side));
    let rise_m = |corner_B: Vector3<f64>| -met.depth_m(&corner_B);
    other.normal_B.dot(way_B) > 0.0
        && met.normal_B.dot(way_B) < 0.0
        && other.corners_B(mesh).into_iter().map(rise_m).fold(0.0, f64::max) > RIM * mesh.extent_m()
}

/// Those edges of its face on which a place lies.
fn edges_at(on: On) -> [Option<usize>; 2] {
    match on {
        On::Face(_) | On::Crossing(..) => [None; 2],
        On::Edge(_, edge) => [Some(edge), None],
        On::Vertex(_, corner) => [Some(corner), Some(previous(corner))],
    }
}

/// Whether a way that comes to a face at its rim goes on outside, in front of what lies across a convex edge there.
fn leads_past(mesh: &Mesh, on: On, way_B: &Vector3<f64>) -> bool {
    let side = on.side();
    let facet = Facet::of(mesh, side);
    edges_at(on).into_iter().flatten().any(|edge| {
        let (_, edge_B) = facet.edge_B(mesh, edge);
        let outward_B = -facet.inward_B(&edge_B);
        match side.across(facet.face.links[edge]).map(|side| Facet::of(mesh, side)) {
            Some(over) => over.normal_B.dot(&outward_B) > 0.0 && over.normal_B.dot(way_B) > 0.0,
            // Beyond the rim of a sheet there is nothing.
            None => outward_B.dot(way_B) > 0.0,
        }
    })
}

/// Where two faces cross, as on an edge.
pub(super) fn plane_at_crossing(
    mesh: &Mesh,
    sides: [Side; 2],
    point_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> (Vector3<f64>, f64) {
    let [a_B, b_B] = sides.map(|side| Facet::of(mesh, side).normal_B);
    let line_B = a_B.cross(&b_B);
    let square = line_B.norm_squared();
    // Faces that are as one have no line.
    let is_one = square < PARALLEL_FACES * PARALLEL_FACES;
    let foot_B = if is_one { *point_B } else { point_B + line_B * (line_B.dot(&(hip_B - point_B)) / square) };
    plane_through(&foot_B, hip_B, &a_B)
}

/// Faces past whose rims one way may lead.
const MAX_PASSED: usize = 4;
/// Sine of the angle below which faces that cross are as one.
const PARALLEL_FACES: f64 = 1e-6;
