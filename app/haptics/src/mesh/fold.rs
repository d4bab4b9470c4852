//! Slivers that are folded over their neighbour.
//!
//! Problem: CAD programs and decimation leave triangles that are lower than a micrometre and turned over, flat upon the face
//! beside them. Between the two is a slit of no width: a point slides in, and is held there when the hand has long left.
//! Lids of holes with a ragged rim have such faces, too.
//!
//! Model: at each such sliver the best of these changes is made ([`change`](super::change)):
//! 1. An edge gives way to the other diagonal of the two faces beside it (an edge flip).
//! 2. A corner moves along an edge to the other end, and the faces between the two vanish (an edge collapse).
//!
//! The faces must lie in one plane, or the opposite corner as near to the edge, or the edge be as short, as no finger feels
//! ([`widest_m`]). A change is made only if fewer edges are folded after it, or as many and the surface is smaller: so no change is
//! undone by a later one, the work ends, and nothing is left to be done when the mesh is read again.
//!
//! Limits: folds of wider faces stay, as a model has them; so do slivers that no single change improves.
//! Cost: linear in the faces to find them, then bounded by the number of folds.

use super::Link;
use super::beside::widest_m;
use super::change::Changing;
use super::order::Triangle;
use super::repair::area_vector;
use super::report::Finding;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Unfolds what is folded; says whether there was any. Faces must be wound alike, and each fan have vertices of its own
/// ([`pinch`](super::pinch)); the last vertices are copies of these.
pub(super) fn unfold(
    triangles: &mut Vec<Triangle>,
    links: &[[Link; 3]],
    vertices: &[Vector3<f64>],
    copies: &[u32],
    unfolded: &mut Finding,
) -> bool {
    let extent_m = vertices.iter().fold(0.0_f64, |extent, vertex| extent.max(vertex.amax()));
    let widest_m = widest_m(extent_m);
    let is_folded = |face: &usize| is_folded_sliver(*face, triangles, links, vertices, widest_m);
    let mut queue: VecDeque<u32> = (0..triangles.len()).filter(is_folded).map(|face| face as u32).collect();
    if queue.is_empty() {
        return false;
    }
    let mut left = queue.len().saturating_mul(MOST_CHANGES);
    let mut changing = Changing::new(triangles, vertices, copies, widest_m);
    let mut any = false;
    while let Some(face) = queue.pop_front().filter(|_| left > 0) {
        let Some(change) = changing.best(face) else { continue };
        left -= 1;
        unfolded.note(triangles[face as usize].origin() as usize);
        queue.extend(changing.make(&change));
        any = true;
    }
    if any {
        changing.write(triangles);
    }
    any
}

fn is_folded_sliver(
    face: usize,
    triangles: &[Triangle],
    links: &[[Link; 3]],
    vertices: &[Vector3<f64>],
    widest_m: f64,
) -> bool {
    let at = |face: usize| triangles[face].corners.map(|corner| vertices[corner as usize]);
    let points = at(face);
    if !is_sliver(&points, widest_m) {
        return false;
    }
    let is_over = |link: &Link| {
        !link.is_boundary() && !link.is_turned() && is_folded_over(&points, &at(link.face() as usize))
    };
    links[face].iter().any(is_over)
}

/// Lower over its longest edge than that.
pub(super) fn is_sliver(points: &[Vector3<f64>; 3], widest_m: f64) -> bool {
    let [a, b, c] = points;
    let longest_m2 = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    // Twice the area over the base; `area_vector` is as long as twice the area.
    area_vector(points).norm_squared() <= widest_m * widest_m * longest_m2
}

/// True if two faces, wound alike, look opposite ways.
pub(super) fn is_folded_over(points: &[Vector3<f64>; 3], others: &[Vector3<f64>; 3]) -> bool {
    let [area, other] = [points, others].map(area_vector);
    area.dot(&other) < FOLDED * area.norm() * other.norm()
}

/// Cosine between normals beyond which a face is folded over its neighbour: by more than 170 degrees.
const FOLDED: f64 = -0.985;
/// For each fold that there was; each change leaves fewer folds or less of them.
const MOST_CHANGES: usize = 16;
