//! Hairline cracks and ledges between parts that lie side by side: a point slides over them.
//!
//! Problem: where a walk comes to the edge of a part, the surface may go on with another part, higher or lower by a few
//! micrometres or roundings. No edge leads there, and a ledge that stands straight would hold the god-object for good. Cracks
//! between walls are closed on loading ([`fit`](super::fit)), but for those of very small faces.
//!
//! Model: a step (as characters in games step over kerbs): up by 1.5 times [`widest_m`] off the face that holds the HIP, on along
//! it by twice that width, and down again. If nothing is in the way and the way down meets a face that looks the same way, the
//! surface goes on there. As long as the HIP is above the crack, not as far as that step, the god-object rests at the edge;
//! then it goes over. Going back is the same, so there is no point from which both parts are left in turn.
//! Overlapping parts: the wall of one stands in the way over the other; if it is no higher than a step, the walk goes on upon
//! it.
//!
//! Frames and signs: object frame B; `out` is along a face, away from it.
//! Invariant: whatever is passed over is narrower than twice [`widest_m`] and lower than 1.5 times that.
//! Cost: nothing where no other part is near ([`beside`](super::beside)); else up to five questions to the hierarchy for each
//! direction, at most [`MOST_WAYS`], where an edge or a vertex lets the HIP go, and one where it holds.

use nalgebra::Vector3;

use super::Mesh;
use super::beside::widest_m;
use super::fan::for_each_around;
use super::place::{Facet, On, Place, Side, previous};

/// Place beyond an edge at which a surface goes on.
pub(super) enum Beyond {
    /// Nearer than a step: the HIP is above the crack.
    Near,
    /// There.
    At(Place),
}

/// Continuation, on another part, of a surface that ends at an edge or a vertex and behind which the HIP lies.
#[cold]
pub(super) fn beyond(mesh: &Mesh, place: Place, hip_B: &Vector3<f64>) -> Option<Beyond> {
    let (mut is_near, mut farthest) = (false, None);
    let mut look = |facet: &Facet<'_>, edges: [Option<usize>; 2]| {
        let to_hip_B = hip_B - place.point_B;
        if facet.depth_m(hip_B) <= 0.0 {
            return;
        }
        let along_B = to_hip_B - facet.normal_B * facet.normal_B.dot(&to_hip_B);
        for way_B in ways(mesh, facet, edges, &along_B).into_iter().flatten() {
            let reach_m = way_B.dot(&along_B);
            let is_farther = farthest.is_none_or(|(most_m, _)| reach_m > most_m);
            if reach_m <= 0.0 || !is_farther {
                continue;
            }
            let Some(next) = step(mesh, facet, &place.point_B, &way_B) else { continue };
            if reach_m < 2.0 * widest_m(mesh.extent_m) {
                is_near = true;
            } else {
                farthest = Some((reach_m, next));
            }
        }
    };
    match place.on {
        On::Edge(side, edge) => {
            let here = Facet::of(mesh, side);
            look(&here, [Some(edge), None]);
            let link = here.face.links[edge];
            if let Some(over) = side.across(link) {
                look(&Facet::of(mesh, over), [Some(link.edge()), None]);
            }
        }
        On::Vertex(side, corner) => {
            for_each_around(mesh, side, corner, |sector| {
                look(&sector.facet, [Some(sector.corner), Some(previous(sector.corner))]);
            });
        }
        On::Face(_) | On::Crossing(..) => {}
    }
    match farthest {
        Some((_, next)) => Some(Beyond::At(next)),
        None => is_near.then_some(Beyond::Near),
    }
}

/// Directions in which to step off a face over one or two of its edges: towards the HIP, straight over each edge, and where two
/// cracks cross, beside the other one.
fn ways(
    mesh: &Mesh,
    facet: &Facet<'_>,
    edges: [Option<usize>; 2],
    along_B: &Vector3<f64>,
) -> [Option<Vector3<f64>>; MOST_WAYS] {
    let out = |edge: usize| {
        let (_, edge_B) = facet.edge_B(mesh, edge);
        (-facet.inward_B(&edge_B)).try_normalize(0.0)
    };
    let [one, other] = edges.map(|edge| edge.and_then(out));
    let towards = along_B.try_normalize(0.0).filter(|way| {
        one.is_none_or(|out| out.dot(way) > 0.0) || other.is_some_and(|out| out.dot(way) > 0.0)
    });
    let beside = |of: Option<Vector3<f64>>, away: Option<Vector3<f64>>| Some((of? - away? * 0.5).normalize());
    [towards, one, other, beside(one, other), beside(other, one)]
}

/// Up off a face, on along it, and down: the place where the surface goes on, if it does at about the same height.
fn step(mesh: &Mesh, facet: &Facet<'_>, from_B: &Vector3<f64>, way_B: &Vector3<f64>) -> Option<Place> {
    let widest_m = widest_m(mesh.extent_m);
    let up_B = facet.normal_B * (STEP * widest_m);
    let [above_B, on_B] = [from_B + up_B, from_B + up_B + way_B * (2.0 * widest_m)];
    if mesh.first_hit(&above_B, &on_B).is_some() || mesh.is_inside(&above_B) {
        return None;
    }
    let aside_B = facet.normal_B.cross(way_B) * widest_m;
    // Right above a crack that goes on along the way, down beside it.
    [Vector3::zeros(), aside_B, -aside_B].into_iter().find_map(|aside_B| {
        let from_B = on_B + aside_B;
        let place = Place::hit(&mesh.first_hit(&from_B, &(from_B - up_B * 2.0))?);
        if mesh.is_inside(&from_B) {
            return None;
        }
        (Facet::of(mesh, place.on.side()).normal_B.dot(&facet.normal_B) > ALIKE).then_some(place)
    })
}

/// Beyond a ledge that a way along a face, behind which the HIP lies, has come to: on top of it. `wall` is what it came to.
#[cold]
pub(super) fn over_ledge(
    mesh: &Mesh,
    [side, wall]: [Side; 2],
    at_B: &Vector3<f64>,
    way_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> Option<Place> {
    let facet = Facet::of(mesh, side);
    if is_flush(mesh, wall, &facet.normal_B) { over_wall(mesh, &facet, at_B, way_B, hip_B) } else { None }
}

/// The same where the wall is known for a low one.
pub(super) fn over_wall(
    mesh: &Mesh,
    facet: &Facet<'_>,
    at_B: &Vector3<f64>,
    way_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> Option<Place> {
    let along = |v_B: &Vector3<f64>| v_B - facet.normal_B * facet.normal_B.dot(v_B);
    // A way that ends at once has no direction of its own.
    let way_B = along(way_B).try_normalize(0.0).or_else(|| along(&(hip_B - at_B)).try_normalize(0.0))?;
    if facet.depth_m(hip_B) <= 0.0 { None } else { step(mesh, facet, at_B, &way_B) }
}

/// True for a wall that is parallel to a face, or from which a parallel face is at most two edges away: another part's foot
/// that comes out of it aslant is no ledge, however low it is there. Or for one that is folded: of two walls without a gap,
/// whose tops are joined.
fn is_flush(mesh: &Mesh, wall: Side, normal_B: &Vector3<f64>) -> bool {
    let across =
        |side: Side| Facet::of(mesh, side).face.links.iter().filter_map(move |link| side.across(*link));
    let is_parallel = |side: Side| Facet::of(mesh, side).normal_B.dot(normal_B) > FLUSH;
    let wall_B = Facet::of(mesh, wall).normal_B;
    let is_folded = |side: Side| Facet::of(mesh, side).normal_B.dot(&wall_B) < -FLUSH;
    let is_top = |side: Side| is_parallel(side) || is_folded(side) || across(side).any(is_parallel);
    is_parallel(wall) || across(wall).any(is_top)
}

/// The same, for a god-object that is held by a ledge and a face, with the HIP beyond the ledge, as far as a step.
#[cold]
pub(super) fn off_crossing(
    mesh: &Mesh,
    at_B: &Vector3<f64>,
    sides: [Side; 2],
    hip_B: &Vector3<f64>,
) -> Option<Place> {
    [sides, [sides[1], sides[0]]].into_iter().find_map(|[side, wall]| {
        let (normal_B, to_hip_B) = (Facet::of(mesh, side).normal_B, hip_B - at_B);
        let along_B = to_hip_B - normal_B * normal_B.dot(&to_hip_B);
        let is_beyond = along_B.norm() > 2.0 * widest_m(mesh.extent_m);
        if is_beyond { over_ledge(mesh, [side, wall], at_B, &along_B, hip_B) } else { None }
    })
}

/// Height of a step, in widths of the widest crack: over a ledge of that height.
const STEP: f64 = 1.5;
/// Directions that are tried from a vertex.
const MOST_WAYS: usize = 5;
/// Cosine of the angle up to which the top of a ledge is parallel to what it is on: 2 degrees.
const FLUSH: f64 = 0.9994;
/// Cosine of the angle up to which a surface goes on: 45 degrees.
const ALIKE: f64 = std::f64::consts::FRAC_1_SQRT_2;
