//! Walks a god-object over faces, edges and vertices towards where friction lets it rest.
//!
//! Problem: the god-object is drawn to the rim of the friction circle, and the way there may lead over many triangles.
//! Placed on each edge until the next tick it would stick there (Melder ch. 7.5.4).
//!
//! Model: on a face the way to the rim is straight, and either ends in the face or meets an edge or a vertex. There,
//! what faces the HIP is asked for anew, and the walk goes on from the same place. On a concave edge it goes along the
//! edge, S being the foot of the HIP's perpendicular on it. A HIP in front of the surface lifts the god-object off: it
//! flies straight to the HIP, and touches again where that way meets the mesh.
//!
//! Faces that pass through one another are no neighbours: on a face that others cross the way is tried against these
//! ([`crossing`](super::crossing)).
//!
//! Friction on a concave edge: one cone, about the direction of what both faces bear (Melder ch. 4.2.5). This is Coulomb's law
//! in a groove whose bottom is round, however little, which a point touches in one place. Cones of both faces together could
//! always bear what is felt. Along the edge they could bear more, in a groove of the angle `a` up to `1 / sin(a / 2)` times as
//! much; so they do of a ball, which touches both ([`crate::rolling`]). By squeezing, friction could also hold a finger in any
//! groove of less than twice the friction angle against every pull; neither points nor balls are squeezed.
//! `tests/mesh/grooves.rs` holds points to all of this.
//!
//! Frames and signs: object frame B; forces are springs on the user \[m\].
//! Invariants: the god-object is on the mesh. A frictionless walk never lengthens the spring, hence ends at a local
//! minimum of the distance to the HIP.
//! Cost: two to four face records a tick on small triangles; bounded by [`MAX_FEATURE_CHANGES`], at which the
//! god-object waits where it is and goes on in the next tick. On a face that others cross, a question to the hierarchy of
//! boxes for each piece, at most [`MAX_QUESTIONS`]. Dear are single ticks in which a god-object that was held in
//! a dale comes over the saddle, and is drawn over centimetres to where the HIP has got to meanwhile: 3 to 10 us for 50 to
//! 90 faces of a million and a flight; 20 us more for a vertex of 1000 faces, and 60 for a flight that starts at one.

use nalgebra::Vector3;

use super::Mesh;
use super::bvh::Leaving;
use super::crack::{self, Beyond};
use super::crossing::{follow_crossing, meet_others, plane_at_crossing};
use super::draw::{Draw, Drawn};
use super::facing::facing;
use super::ledge::off_ledge;
use super::place::{Facet, On, Place, Side, next};
use crate::friction_cone::ConeInput;
use crate::surface::direction_or_up;
use crate::tangent_view::TangentView;

/// Bound on the pieces of a mesh that a god-object comes to within one tick. Fingers at 0.5 m/s cross one
/// triangle of 0.5 mm a tick; a jump of 0.1 m over such triangles takes two ticks.
pub const MAX_FEATURE_CHANGES: u32 = 256;

/// Bound on the flights of a god-object within one tick: each asks the hierarchy of boxes.
const MAX_FLIGHTS: u32 = 8;

/// Bound on the pieces that others cross: each asks the hierarchy of boxes.
const MAX_QUESTIONS: u32 = 64;

/// Where a walk ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walked {
    pub(crate) place: Place,
    pub(crate) view: TangentView,
    /// Tangential force over stiffness, on the user \[m\].
    pub(crate) tangential_B: Vector3<f64>,
    pub(crate) changes: u32,
}

/// Where the god-object stands when the HIP has moved, and what it sees; `None` if it is free and gone.
///
/// Its place may change without moving: from an edge to the face that now holds the HIP back.
#[inline(always)]
pub(crate) fn stand(mesh: &Mesh, mut place: Place, input: &ConeInput) -> Option<(Place, TangentView)> {
    let hip_B = input.hip_B;
    for flight in 0..MAX_FLIGHTS {
        if let Some(on) = facing(mesh, place, hip_B) {
            let face = &mesh.faces[place.face() as usize];
            // What holds the HIP goes on holding it where there are too many ledges.
            let may_step = flight + 1 < MAX_FLIGHTS;
            if may_step
                && face.is_at_ledge
                && let Some(next) = off_ledge(mesh, &place.point_B, on, &hip_B)
            {
                place = next;
                continue;
            }
            if may_step
                && face.is_beside
                && let On::Crossing(side, other) = on
                && let Some(next) = crack::off_crossing(mesh, &place.point_B, [side, other], &hip_B)
            {
                place = next;
                continue;
            }
            let (normal_B, offset_m) = match on {
                On::Face(side) => plane_of_face(mesh, side),
                On::Edge(side, edge) => plane_on_edge(mesh, side, edge, hip_B),
                On::Vertex(..) => plane_at_vertex(place.point_B, hip_B),
                On::Crossing(side, other) => plane_at_crossing(mesh, [side, other], &place.point_B, &hip_B),
            };
            place.on = on;
            return Some((place, TangentView::new(&place.point_B, normal_B, offset_m, input)));
        }
        if let Some(rim) = rim(mesh, place) {
            place = rim;
            continue;
        }
        match leave(mesh, place, hip_B)? {
            Beyond::At(next) => place = next,
            Beyond::Near => return Some(at_rest_at(mesh, place, input)),
        }
    }
    None
}

/// Off the surface: over a crack, or on to what is met in flight; `None`: free.
#[inline(never)]
fn leave(mesh: &Mesh, place: Place, hip_B: Vector3<f64>) -> Option<Beyond> {
    let is_beside = mesh.faces[place.face() as usize].is_beside;
    if is_beside && let Some(beyond) = crack::beyond(mesh, place, &hip_B) {
        return Some(beyond);
    }
    fly(mesh, place, hip_B).map(Beyond::At)
}

/// On an edge or a vertex that holds the HIP back though it lies beyond: above a crack.
#[cold]
fn at_rest_at(mesh: &Mesh, place: Place, input: &ConeInput) -> (Place, TangentView) {
    let (normal_B, offset_m) = match place.on {
        On::Edge(side, edge) => plane_on_edge(mesh, side, edge, input.hip_B),
        _ => plane_at_vertex(place.point_B, input.hip_B),
    };
    (place, TangentView::new(&place.point_B, normal_B, offset_m, input))
}

/// Goes on from where the god-object stands until nothing draws it any further; `None` if it is free and gone.
#[inline(always)]
pub(crate) fn walk(
    mesh: &Mesh,
    (mut place, mut view): (Place, TangentView),
    draw: &impl Draw,
    input: &ConeInput,
) -> Option<Walked> {
    let start_B = place.point_B;
    let (mut changes, mut questions, mut turns) = (0, 0, 0);
    loop {
        let Drawn { target_B, is_at_rest, tangential_B } = draw.drawn(&view, &(start_B - place.point_B));
        let is_late = changes == MAX_FEATURE_CHANGES || questions == MAX_QUESTIONS;
        if is_at_rest || is_late || matches!(place.on, On::Vertex(..)) {
            return Some(Walked { place, view, tangential_B, changes });
        }
        changes += 1;
        let mut reached = match place.on {
            On::Face(side) => cross_face(mesh, side, place.point_B, target_B),
            On::Edge(side, edge) | On::Vertex(side, edge) => follow_edge(mesh, side, edge, target_B),
            On::Crossing(side, other) => follow_crossing(mesh, [side, other], place.point_B, target_B),
        };
        if mesh.faces[place.face() as usize].is_crossed {
            questions += 1;
            reached = meet_others(mesh, place, reached, &input.hip_B);
            let way_m = (reached.place().point_B - place.point_B).amax();
            turns = if way_m > RIM * mesh.extent_m { 0 } else { turns + 1 };
            if turns == MAX_TURNS {
                return Some(rest(place, &(start_B - place.point_B), changes, draw, input));
            }
        }
        match reached {
            Reached::Target(place) => return Some(Walked { place, view, tangential_B, changes }),
            Reached::Rim(place_there) => (place, view) = stand(mesh, place_there, input)?,
        }
    }
}

/// Where it is held as at a vertex.
#[cold]
fn rest(place: Place, back_B: &Vector3<f64>, changes: u32, draw: &impl Draw, input: &ConeInput) -> Walked {
    let (normal_B, offset_m) = plane_at_vertex(place.point_B, input.hip_B);
    let view = TangentView::new(&place.point_B, normal_B, offset_m, input);
    let Drawn { tangential_B, .. } = draw.drawn(&view, back_B);
    Walked { place, view, tangential_B, changes }
}

/// How far a way led.
pub(super) enum Reached {
    Target(Place),
    /// Only to an edge or a vertex, or to a face that crosses this one.
    Rim(Place),
}

impl Reached {
    pub(super) fn place(&self) -> &Place {
        let (Self::Target(place) | Self::Rim(place)) = self;
        place
    }
}

/// Goes straight through a face: to the target or to the first edge or vertex on the way.
#[inline(always)]
pub(super) fn cross_face(mesh: &Mesh, side: Side, from_B: Vector3<f64>, target_B: Vector3<f64>) -> Reached {
    let facet = Facet::of(mesh, side);
    let [a_B, b_B, c_B] = facet.corners_B(mesh);
    let met = |start_B, end_B| share_until_met(&facet, start_B, end_B, &from_B, &target_B);
    let met = [met(&a_B, &b_B), met(&b_B, &c_B), met(&c_B, &a_B)];
    let (edge, share) = if met[1] < met[0] { (1, met[1]) } else { (0, met[0]) };
    let (edge, share) = if met[2] < share { (2, met[2]) } else { (edge, share) };
    if share == f64::INFINITY {
        return Reached::Target(Place::new(target_B, On::Face(side)));
    }
    let met_B = from_B + (target_B - from_B) * share;
    let (start_B, edge_B) = facet.edge_B(mesh, edge);
    let share = edge_B.dot(&(met_B - start_B)) / edge_B.norm_squared();
    Reached::Rim(on_edge(mesh, side, edge, share))
}

/// The share of the way to the target at which it leaves a face over an edge; infinite if it does not.
#[inline(always)]
fn share_until_met(
    facet: &Facet<'_>,
    start_B: &Vector3<f64>,
    end_B: &Vector3<f64>,
    from_B: &Vector3<f64>,
    target_B: &Vector3<f64>,
) -> f64 {
    let edge_B = end_B - start_B;
    // Distances from the edge, times its length: the Voronoi plane through the edge, Melder eq. 4.15-4.20 with the
    // offset corrected (the printed one is always 0).
    let inward_B = facet.inward_B(&edge_B);
    let way_B = target_B - from_B;
    let gained = inward_B.dot(&way_B);
    let is_beyond = inward_B.dot(&(target_B - start_B)) < 0.0;
    let leaves = gained * gained > PARALLEL * PARALLEL * edge_B.norm_squared() * way_B.norm_squared();
    let left = inward_B.dot(&(from_B - start_B)).max(0.0);
    if is_beyond & (gained < 0.0) & leaves { left / -gained } else { f64::INFINITY }
}

/// Goes along an edge: to the target or to the vertex on the way.
#[inline(never)]
fn follow_edge(mesh: &Mesh, side: Side, edge: usize, target_B: Vector3<f64>) -> Reached {
    let (start_B, edge_B) = Facet::of(mesh, side).edge_B(mesh, edge);
    let share = edge_B.dot(&(target_B - start_B)) / edge_B.norm_squared();
    let place = on_edge(mesh, side, edge, share);
    if matches!(place.on, On::Edge(..)) { Reached::Target(place) } else { Reached::Rim(place) }
}

/// The place on an edge at this share of its length; near its ends, the vertex.
#[inline(always)]
fn on_edge(mesh: &Mesh, side: Side, edge: usize, share: f64) -> Place {
    let facet = Facet::of(mesh, side);
    let at = |corner| Place::new(facet.corner_B(mesh, corner), On::Vertex(side, corner));
    if share <= SNAP {
        return at(edge);
    }
    if share >= 1.0 - SNAP {
        return at(next(edge));
    }
    let (start_B, edge_B) = facet.edge_B(mesh, edge);
    Place::new(start_B + edge_B * share, On::Edge(side, edge))
}

/// The edge or vertex that a place on a face happens to lie on, where a neighbour may hold what the face lets go.
#[cold]
pub(super) fn rim(mesh: &Mesh, place: Place) -> Option<Place> {
    let On::Face(side) = place.on else { return None };
    let facet = Facet::of(mesh, side);
    let near_m = |edge_m: f64| (SNAP * edge_m).max(RIM * mesh.extent_m());
    let edge = (0..3).find(|&edge| {
        let (start_B, edge_B) = facet.edge_B(mesh, edge);
        let edge_m = edge_B.norm();
        facet.inward_B(&edge_B).dot(&(place.point_B - start_B)) <= edge_m * near_m(edge_m)
    })?;
    let near_m = near_m(facet.edge_B(mesh, edge).1.norm());
    let is_at = |&corner: &usize| (facet.corner_B(mesh, corner) - place.point_B).amax() <= near_m;
    let on = match [edge, next(edge)].iter().find(|&corner| is_at(corner)) {
        Some(&corner) => On::Vertex(side, corner),
        None => On::Edge(side, edge),
    };
    Some(Place::new(place.point_B, on))
}

/// Straight from where it was to the HIP through free space; `None` if nothing is in the way.
///
/// The HIP is in front of all that meets here, so none of that is in the way, whatever rounding says. Of a place on a
/// face, only that face is here: on its rim it would have been taken for one on the edge.
#[cold]
fn fly(mesh: &Mesh, place: Place, hip_B: Vector3<f64>) -> Option<Place> {
    let side = place.on.side();
    let facet = Facet::of(mesh, side);
    let vertices_of = |face: u32| mesh.faces[face as usize].vertices;
    let way_B = [&place.point_B, &hip_B];
    let leaving = &Left { mesh, on: place.on };
    let hit = match place.on {
        On::Face(_) => mesh.first_hit_in_flight(way_B, leaving, |face| face == side.face),
        On::Edge(_, edge) => {
            let ends = [edge, next(edge)].map(|corner| facet.face.vertices[corner]);
            let has_both = |face| ends.iter().all(|end| vertices_of(face).contains(end));
            mesh.first_hit_in_flight(way_B, leaving, has_both)
        }
        On::Vertex(_, corner) => {
            let tip = facet.face.vertices[corner];
            mesh.first_hit_in_flight(way_B, leaving, |face| vertices_of(face).contains(&tip))
        }
        On::Crossing(_, other) => {
            mesh.first_hit_in_flight(way_B, leaving, |face| face == side.face || face == other.face)
        }
    };
    hit.map(|hit| Place::hit(&hit))
}

/// Surface that a flight leaves.
struct Left<'m> {
    mesh: &'m Mesh,
    on: On,
}

impl Leaving for Left<'_> {
    fn is_face(&self) -> bool {
        matches!(self.on, On::Face(_))
    }

    fn is_far_side(&self, normal_B: &Vector3<f64>) -> bool {
        match self.on {
            On::Face(side) => Facet::of(self.mesh, side).normal_B.dot(normal_B) < BACK_TO_BACK,
            On::Edge(..) | On::Vertex(..) => true,
            // It is as far from either face as the hit was rounded.
            On::Crossing(..) => false,
        }
    }

    fn lies_upon(&self, normal_B: &Vector3<f64>) -> bool {
        let On::Face(side) = self.on else { return false };
        Facet::of(self.mesh, side).normal_B.dot(normal_B) < ANTIPARALLEL
    }
}

/// The plane that the god-object sees on a face: its normal, and `normal . x` of its points.
#[inline(always)]
fn plane_of_face(mesh: &Mesh, side: Side) -> (Vector3<f64>, f64) {
    let facet = Facet::of(mesh, side);
    (facet.normal_B, facet.offset_m)
}

/// On an edge S is the foot of the HIP's perpendicular, and the depth is measured from there.
#[inline(never)]
fn plane_on_edge(mesh: &Mesh, side: Side, edge: usize, hip_B: Vector3<f64>) -> (Vector3<f64>, f64) {
    let facet = Facet::of(mesh, side);
    //= melder#4.21
    let (start_B, edge_B) = facet.edge_B(mesh, edge);
    //= melder#4.22
    //= melder#4.23
    let share = edge_B.dot(&(hip_B - start_B)) / edge_B.norm_squared();
    //= melder#4.24
    let foot_B = start_B + edge_B * share;
    plane_through(&foot_B, &hip_B, &facet.normal_B)
}

/// On a vertex nothing can slide: S is the vertex.
#[inline(never)]
fn plane_at_vertex(vertex_B: Vector3<f64>, hip_B: Vector3<f64>) -> (Vector3<f64>, f64) {
    plane_through(&vertex_B, &hip_B, &direction_or_up(&(vertex_B - hip_B)))
}

/// As seen from the point of an edge or vertex nearest to the HIP; `otherwise_B` is the normal where both coincide.
pub(super) fn plane_through(
    nearest_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
    otherwise_B: &Vector3<f64>,
) -> (Vector3<f64>, f64) {
    let out_B = nearest_B - hip_B;
    let depth_m = out_B.norm();
    let normal_B = if depth_m > 0.0 { direction_or_up(&out_B) } else { *otherwise_B };
    (normal_B, normal_B.dot(hip_B) + depth_m)
}

/// Cosine of 154 degrees: a blade of less than 26 degrees is thinner than the tolerance where no edge is near.
const BACK_TO_BACK: f64 = -0.9;
/// Cosine of an angle that differs from 180 degrees by 1e-6 rad.
const ANTIPARALLEL: f64 = -1.0 + 0.5e-12;
/// Steps without a way between faces that cross: three of them hold, in pairs, and each pair may be left over an edge of each.
const MAX_TURNS: u32 = 12;
/// A way that leaves an edge by less than this per length runs along it: its crossing would be rounding.
const PARALLEL: f64 = 1e-10;
/// Nearer to the end of an edge than this share of it is at the vertex.
const SNAP: f64 = 1e-9;
/// Nearer to an edge than this share of the mesh's extent is on it: a few times what [`Mesh::first_hit`] tolerates.
pub(super) const RIM: f64 = 4e-13;
