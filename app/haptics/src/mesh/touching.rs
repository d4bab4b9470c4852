//! Parts that touch along an edge: four or more faces share it.
//!
//! Problem: a walk over the edge needs to know which of them comes next. Two cubes that stand edge to edge come as
//! one with four faces at that edge; in a file that names no shared vertices nothing tells them apart.
//!
//! Model: around the edge, material and outside alternate. A finger lives in one of the outside wedges, so the two
//! faces that bound the same wedge are neighbours: it cannot slip through where the parts touch. This is clear only
//! if the faces do alternate; three faces, crossing sheets and faces that coincide and look the same way do not
//! ([`crowded`](super::crowded)).
//!
//! Two faces that coincide and look opposite ways have no room between them, whether they are the walls of two parts or the two
//! layers of a plate of which no thickness is left: what is between them counts as material, so that the surface goes on over it.

use super::order::Triangle;
use super::repair::area_vector;
use super::topology::Side;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// The pairs of faces, given with their angles around an edge, that bound the same piece of outside; `None` if that is
/// not clear.
pub(super) fn pair_across_outside(
    around: &[(f64, Side)],
    is_upward: impl Fn(Side) -> bool,
) -> Option<Vec<[Side; 2]>> {
    let around = &without_room(around, &is_upward);
    let mut pairs = Vec::with_capacity(around.len() / 2);
    for (i, &(angle, side)) in around.iter().enumerate() {
        let (next_angle, next_side) = around[(i + 1) % around.len()];
        let gap = (next_angle - angle).rem_euclid(TAU);
        if is_upward(side) == is_upward(next_side) {
            return None;
        }
        // The angle grows along the normal of a face that runs upward, so the outside lies ahead of it.
        if is_upward(side) {
            if !(SMALLEST_GAP_RAD..TAU - SMALLEST_GAP_RAD).contains(&gap) {
                return None;
            }
            pairs.push([side, next_side]);
        }
    }
    Some(pairs)
}

/// The same, of two that coincide the one first that has the outside behind it.
fn without_room(around: &[(f64, Side)], is_upward: impl Fn(Side) -> bool) -> Vec<(f64, Side)> {
    let mut around = around.to_vec();
    // Of two that coincide one may be the last and the other the first.
    let crowd = around.len();
    for i in 0..crowd {
        let (one, other) = (i, (i + 1) % crowd);
        let gap = (around[other].0 - around[one].0).rem_euclid(TAU);
        let is_same = !(SMALLEST_GAP_RAD..=TAU - SMALLEST_GAP_RAD).contains(&gap);
        if is_same && is_upward(around[one].1) && !is_upward(around[other].1) {
            around.swap(one, other);
        }
    }
    around
}

/// Nearer than this two faces are taken to coincide; normals of needles are hardly better.
const SMALLEST_GAP_RAD: f64 = 1e-6;

/// The faces at an edge by their angle around it; `lower` is the end of the edge with the lower number.
pub(super) fn sorted_by_angle(
    sides: &[Side],
    lower: usize,
    triangles: &[Triangle],
    vertices: &[Vector3<f64>],
) -> Vec<(f64, Side)> {
    let along = vertices[sides[0].upper() as usize] - vertices[lower];
    // Perpendicular to the edge and to the face, towards growing angles.
    let ahead = |side: Side| {
        let corners = triangles[side.face() as usize].corners.map(|v| vertices[v as usize]);
        let normal = area_vector(&corners).normalize();
        if side.is_upward() { normal } else { -normal }
    };
    let zero = ahead(sides[0]);
    let quarter = along.cross(&zero).normalize();
    let angle = |side: Side| ahead(side).dot(&quarter).atan2(ahead(side).dot(&zero));
    let mut around: Vec<_> = sides.iter().map(|&side| (angle(side), side)).collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    around
}
