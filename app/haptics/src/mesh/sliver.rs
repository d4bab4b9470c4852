//! Closes the crack that a left-out face without an area leaves behind.
//!
//! Problem: such a face often holds a vertex m on the edge a-b of its neighbour: over a-m and m-b lie two faces of
//! the other side. Without it a-b fits neither.
//!
//! Model: the neighbour over a-b is divided at m. If one of its halves had no area either, m all but coincides with
//! a corner; then it stays whole, and the crack is reported as edges of one face.

use super::order::{Curve, Triangle};
use super::repair::has_area;
use super::report::Finding;
use nalgebra::Vector3;

/// A face without an area whose corners differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sliver {
    /// Of its longest edge, the lower number first.
    ends: [u32; 2],
    /// On that edge.
    middle: u32,
}

impl Sliver {
    /// `None` if two corners are the same.
    pub(super) fn new(corners: [u32; 3], points: &[Vector3<f64>; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            return None;
        }
        let length = |i: usize| (points[(i + 1) % 3] - points[i]).norm_squared();
        let longest = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j)))?;
        let [from, to, middle] = [0, 1, 2].map(|i| corners[(longest + i) % 3]);
        Some(Self { ends: [from.min(to), from.max(to)], middle })
    }
}

/// Divides faces over the longest edge of a sliver; halves in turn may have an edge with another sliver.
///
/// At most one face is added for each sliver, so there are never more than in the input.
pub(super) fn divide(
    triangles: &mut Vec<Triangle>,
    mut slivers: Vec<Sliver>,
    vertices: &[Vector3<f64>],
    curve: &Curve,
    divided: &mut Finding,
) {
    slivers.sort_unstable();
    let most = triangles.len() + slivers.len();
    let mut index = 0;
    while index < triangles.len() && triangles.len() < most {
        let (corners, origin) = (triangles[index].corners, triangles[index].origin());
        match (0..3).find_map(|edge| halves(corners, edge, &slivers, vertices)) {
            None => index += 1,
            Some(halves) => {
                let [half, other] = halves.map(|half| {
                    let points = half.map(|v| vertices[v as usize]);
                    Triangle::new(half, &points, origin, curve)
                });
                triangles[index] = half;
                triangles.push(other);
                divided.note(origin as usize);
            }
        }
    }
}

/// The halves of a face that has the longest edge of a sliver for its edge `edge`.
fn halves(
    corners: [u32; 3],
    edge: usize,
    slivers: &[Sliver],
    vertices: &[Vector3<f64>],
) -> Option<[[u32; 3]; 2]> {
    let [from, to, opposite] = [0, 1, 2].map(|i| corners[(edge + i) % 3]);
    let ends = [from.min(to), from.max(to)];
    let middle = slivers[slivers.partition_point(|sliver| sliver.ends < ends)..].first()?;
    let halves = [[from, middle.middle, opposite], [middle.middle, to, opposite]];
    let proper = |half: &[u32; 3]| has_area(&half.map(|v| vertices[v as usize]));
    (middle.ends == ends && halves.iter().all(proper)).then_some(halves)
}
