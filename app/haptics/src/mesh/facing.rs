//! Which piece of the mesh holds the HIP back: the transitions that the movement of the HIP makes.
//!
//! Problem: a god-object on an edge or a vertex goes on along one of the faces that meet there, stays, or is free.
//! Melder ch. 4.2.4.4-4.2.4.8 lists rules that disagree at acute edges, saddles and needles, and leaves vertex to
//! face open.
//!
//! Model: seen from an edge or a vertex the surface is a wedge or a cone without end. Its point nearest to the HIP
//! tells where to go: on a face, onto that face; on an edge, along it; at the tip, nowhere. And it tells, by the side of
//! the surface that the HIP has there, whether the HIP is outside. For a convex edge that is "the nearest face plane
//! wins" and "free when in front of either", for a concave one "free when in front of both". Two faces that pass through each
//! other are a concave edge to whoever is outside of both.
//!
//! Frames and signs: object frame B; depths are positive behind a face.
//! Invariant: free needs a HIP that is in front of a face; in doubt the god-object stays where it is.
//! Cost: one face record on a face, two on an edge, one for each face around a vertex.

use nalgebra::Vector3;

use super::Mesh;
use super::cone::{Cone, Nearest};
use super::place::{Facet, On, Place, Side};

/// What holds the HIP back: a face, a concave edge, a vertex; `None` if the HIP is in front of the surface here.
#[inline(always)]
pub(crate) fn facing(mesh: &Mesh, place: Place, hip_B: Vector3<f64>) -> Option<On> {
    match place.on {
        On::Face(side) => (!is_in_front(mesh, Facet::of(mesh, side).depth_m(&hip_B))).then_some(place.on),
        On::Edge(side, edge) => on_edge(mesh, side, edge, place.point_B, hip_B),
        On::Vertex(side, corner) => at_vertex(mesh, side, corner, place.point_B, hip_B),
        On::Crossing(side, other) => at_crossing(mesh, [side, other], place.point_B, hip_B),
    }
}

#[inline(always)]
fn on_edge(mesh: &Mesh, side: Side, edge: usize, point_B: Vector3<f64>, hip_B: Vector3<f64>) -> Option<On> {
    let here = Facet::of(mesh, side);
    let link = here.face.links[edge];
    let (_, edge_B) = here.edge_B(mesh, edge);
    let to_hip_B = hip_B - point_B;
    let here_inward_B = here.inward_B(&edge_B);
    let here_wants = here_inward_B.dot(&to_hip_B) > 0.0;
    let here_depth_m = here.depth_m(&hip_B);
    let Some(over) = side.across(link).map(|side| Facet::of(mesh, side)) else {
        // The rim of a sheet: beyond it there is nothing.
        return (here_wants && !is_in_front(mesh, here_depth_m)).then_some(On::Face(side));
    };
    // Neighbours run along their edge in opposite directions, unless one of them is turned.
    let over_inward_B = over.inward_B(&if link.is_turned() { edge_B } else { -edge_B });
    let over_wants = over_inward_B.dot(&to_hip_B) > 0.0;
    let over_depth_m = over.depth_m(&hip_B);
    let rise = over_inward_B.dot(&here.normal_B);
    let is_fold = over_inward_B.dot(&here_inward_B) > 0.0 && rise.abs() < FOLD * edge_B.norm();
    let is_concave = if is_fold { is_groove(mesh, &hip_B) } else { rise > 0.0 };
    let in_front = [is_in_front(mesh, here_depth_m), is_in_front(mesh, over_depth_m)];
    let is_free = if is_concave { in_front == [true; 2] } else { in_front != [false; 2] };
    if is_free {
        return None;
    }
    match (here_wants && !in_front[0], over_wants && !in_front[1]) {
        (true, false) => Some(On::Face(side)),
        (false, true) => Some(On::Face(over.side)),
        // On a sharp edge by rounding only: beyond it, in both planes at once.
        (false, false) if !is_concave && over_inward_B.dot(&here_inward_B) > 0.0 => None,
        // On a blunt one, too: right below it.
        (false, false) => Some(On::Edge(side, edge)),
        // The lower index among equals, so that the result does not depend on where one came from.
        (true, true) if (here_depth_m, side.face) <= (over_depth_m, over.side.face) => Some(On::Face(side)),
        (true, true) => Some(On::Face(over.side)),
    }
}

/// True for two faces upon each other that are a groove without room, not a plate without thickness: their planes cannot tell.
/// At the bottom of a groove, who has left it is inside.
#[cold]
fn is_groove(mesh: &Mesh, hip_B: &Vector3<f64>) -> bool {
    mesh.is_inside(hip_B)
}

/// Where two faces cross, seen from outside of both, they are as two at a concave edge: what is free is convex, and one of its
/// points is nearest.
#[inline(never)]
fn at_crossing(mesh: &Mesh, sides: [Side; 2], point_B: Vector3<f64>, hip_B: Vector3<f64>) -> Option<On> {
    let facets = sides.map(|side| Facet::of(mesh, side));
    let is_held = facets.map(|facet| !is_in_front(mesh, facet.depth_m(&hip_B)));
    let [a_B, b_B] = facets.map(|facet| facet.normal_B);
    let cosine = a_B.dot(&b_B);
    // Along each face away from the other.
    let wants = [b_B - a_B * cosine, a_B - b_B * cosine].map(|away_B| away_B.dot(&(hip_B - point_B)) > 0.0);
    match [0, 1].map(|i| wants[i] && is_held[i]) {
        _ if is_held == [false; 2] => None,
        [true, _] => Some(On::Face(sides[0])),
        [false, true] => Some(On::Face(sides[1])),
        [false, false] => Some(On::Crossing(sides[0], sides[1])),
    }
}

#[inline(never)]
fn at_vertex(
    mesh: &Mesh,
    side: Side,
    corner: usize,
    point_B: Vector3<f64>,
    hip_B: Vector3<f64>,
) -> Option<On> {
    let cone = Cone::around(mesh, side, corner, &(hip_B - point_B));
    match cone.nearest {
        Nearest::Face(side, depth_m) => (!is_in_front(mesh, depth_m)).then_some(On::Face(side)),
        Nearest::Edge(side, edge) => on_edge(mesh, side, edge, point_B, hip_B),
        Nearest::Tip => cone.is_behind(mesh, side, corner).then_some(On::Vertex(side, corner)),
    }
}

/// Whether a HIP at this depth is clearly in front of a face: by more than a path that ends there is met before it. A
/// finger that rounding could put on either side of a sheet is in contact, without a force.
#[inline]
fn is_in_front(mesh: &Mesh, depth_m: f64) -> bool {
    depth_m < -RELEASE * mesh.extent_m
}

/// Angle between two faces that lie upon each other \[rad\]: 0.1 m from their edge they are 0.1 nm apart. Normals of faces of
/// 10 um, 10 m from the origin, are rounded by a tenth of that.
const FOLD: f64 = 1e-9;
/// A few times the tolerance of [`Mesh::first_hit`].
const RELEASE: f64 = 4e-13;
