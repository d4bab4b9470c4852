//! Slivers and flaps that are folded over their neighbour.
//!
//! Problem: CAD programs and decimation leave triangles that are lower than a micrometre and turned over, flat upon the face
//! beside them. Between the two is a slit of no width: a point slides in, and is held there when the hand has long left.
//! Lids of holes with a ragged rim have such faces, too. A flap of a
//! closed part is as wide as it likes, but opens a slit that no finger feels; of a sheet it is a second layer, which stays.
//!
//! Model: at each such face the best of these changes is made ([`change`](super::change)):
//! 1. An edge gives way to the other diagonal of the two faces beside it (an edge flip).
//! 2. A corner moves along an edge to the other end, and the faces between the two vanish (an edge collapse).
//!
//! The faces must lie in one plane, or the opposite corner as near to the edge, or the edge be as short, as no finger feels
//! ([`widest_m`]). A change is made only if fewer edges are folded after it, or as many and the surface is smaller: so no change is
//! undone by a later one, the work ends, and nothing is left to be done when the mesh is read again.
//!
//! Limits: wider faces that lie upon another to the bit stay, as a model has them; so does what no single change improves.
//! Cost: linear in the faces to find them, then bounded by the number of folds.

use super::beside::widest_m;
use super::change::Changing;
use super::order::Triangle;
use super::repair::area_vector;
use super::report::Finding;
use super::walk::RIM;
use super::winding::Parts;
use super::{Link, Sides};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Unfolds what is folded; says whether there was any. Faces must be wound alike, and each fan have vertices of its own
/// ([`pinch`](super::pinch)); the last vertices are copies of these.
pub(super) fn unfold(
    triangles: &mut Vec<Triangle>,
    (links, parts): (&[[Link; 3]], &Parts),
    vertices: &[Vector3<f64>],
    copies: &[u32],
    unfolded: &mut Finding,
) -> bool {
    let extent_m = vertices.iter().fold(0.0_f64, |extent, vertex| extent.max(vertex.amax()));
    let thin = Thin { widest_m: widest_m(extent_m), facing: facing(triangles, parts, vertices) };
    let is_folded = |face: &usize| is_folded(*face, triangles, links, vertices, &thin);
    let mut queue: VecDeque<u32> = (0..triangles.len()).filter(is_folded).map(|face| face as u32).collect();
    if queue.is_empty() {
        return false;
    }
    let mut left = queue.len().saturating_mul(MOST_CHANGES);
    let mut changing = Changing::new(triangles, vertices, copies, thin);
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

fn is_folded(
    face: usize,
    triangles: &[Triangle],
    links: &[[Link; 3]],
    vertices: &[Vector3<f64>],
    thin: &Thin,
) -> bool {
    let at = |face: usize| triangles[face].corners.map(|corner| vertices[corner as usize]);
    let points = at(face);
    let is_over = |link: &Link| {
        !link.is_boundary() && !link.is_turned() && thin.is_folded(face, &points, &at(link.face() as usize))
    };
    links[face].iter().any(is_over)
}

/// Folds that no finger feels.
pub(super) struct Thin {
    pub(super) widest_m: f64,
    /// For each face.
    facing: Vec<Facing>,
}

/// Side of its winding that a face is felt from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Facing {
    Outward,
    Inward,
    Both,
}

impl Thin {
    /// True for a sliver that is folded over the face beside it, and for a flap.
    pub(super) fn is_folded(
        &self,
        face: usize,
        points: &[Vector3<f64>; 3],
        others: &[Vector3<f64>; 3],
    ) -> bool {
        is_sliver(points, self.widest_m) && is_folded_over(points, others)
            || self.is_flap(self.facing[face], points, others)
    }

    /// The smaller of two faces with a slit between them: overhanging, by however little.
    fn is_flap(&self, facing: Facing, points: &[Vector3<f64>; 3], others: &[Vector3<f64>; 3]) -> bool {
        let (area, other) = (area_vector(points), area_vector(others));
        if area.dot(&other) >= 0.0 || area.norm_squared() > other.norm_squared() {
            return false;
        }
        let normal = other.normalize();
        // Two of the corners are the other face's, too.
        let heights_m = points.map(|point| {
            let height_m = normal.dot(&(point - others[0]));
            match facing {
                Facing::Outward => height_m,
                Facing::Inward => -height_m,
                Facing::Both => 0.0,
            }
        });
        let highest_m = heights_m.into_iter().fold(0.0, f64::max);
        let least_m = RIM * points.iter().fold(0.0_f64, |most, point| most.max(point.amax()));
        highest_m > least_m && highest_m <= self.widest_m
    }
}

/// By the volume of the part. A cavity is taken for a body that is wound inward.
fn facing(triangles: &[Triangle], parts: &Parts, vertices: &[Vector3<f64>]) -> Vec<Facing> {
    let mut volumes = vec![(None, 0.0); parts.len()];
    for (face, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.corners.map(|corner| vertices[corner as usize]);
        let (apex, times_six_m3) = &mut volumes[parts.of(face)];
        let apex = *apex.get_or_insert(a);
        *times_six_m3 += (a - apex).dot(&(b - apex).cross(&(c - apex)));
    }
    let of_face = |face: usize| match (parts.sides(face), volumes[parts.of(face)].1) {
        (Sides::Sheet, _) => Facing::Both,
        (Sides::Solid, volume) if volume < 0.0 => Facing::Inward,
        (Sides::Solid, _) => Facing::Outward,
    };
    (0..triangles.len()).map(of_face).collect()
}

/// Lower over its longest edge than that.
fn is_sliver(points: &[Vector3<f64>; 3], widest_m: f64) -> bool {
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
