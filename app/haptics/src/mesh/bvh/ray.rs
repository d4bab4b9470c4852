//! Faces that a ray along an axis crosses, and the winding number that they add up to.
//!
//! Problem: is a point inside? The normal at the nearest point lies where a fan of faces is folded (the sum of normals
//! around its vertex may lean anywhere) and where parts overlap or a surface cuts through itself (the nearest face may
//! be one that the point is in front of, deep inside another part).
//!
//! Model: the winding number of closed surfaces is the number of faces that a ray from the point to infinity leaves
//! through, less those that it enters through. Seen along the ray a face is a triangle of the plane across it. Two of
//! its edges cross the plane's first axis or none does; it contains the ray if one of them crosses in front of it (x > 0)
//! and one behind. Which side of the axis a vertex lies on is an exact comparison of coordinates, with 0 on the lower side;
//! where an edge crosses is computed from its lower vertex to its upper one, hence in the same way for both of its
//! faces. So no rounding lets a ray slip between neighbours or counts both, neither on edges nor on vertices nor along
//! faces: the sum is that of some ray that differs from the one meant by rounding.
//!
//! Invariant: the winding number is wrong at most for a point within rounding of the surface, where a face may count as
//! behind that is ahead. A point exactly on a face counts as inside of it.
//! Faces of sheets do not count: they have no inside.
//!
//! Cost: the boxes that the ray meets, some tens of a million faces; a ray in the plane of a finely divided face meets very
//! many. So each ray has a bound, and the axes are tried from the shortest way out on.

use nalgebra::Vector3;

use super::stack::Stack;
use super::{Bvh, Node, Rounded, Triangles};
use crate::mesh::Sides;

/// Where a ray crosses a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) face: u32,
    /// From the ray's beginning, 0 or more \[m\].
    pub(super) ahead_m: f64,
    /// Whether it leaves the material there.
    pub(super) is_leaving: bool,
}

/// A ray from a point along an axis of frame B, to infinity.
pub(super) struct Ray {
    pub(super) from_B: Vector3<f64>,
    rounded: Rounded,
    /// The two axes across it and the one along it; in this order a right-handed frame.
    pub(super) axes: [usize; 3],
    is_upward: bool,
}

/// A ray met its bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooLong;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// How often the closed parts go around a point: 0 outside, 1 inside of one, 2 where two overlap, negative where
    /// a surface is turned inside out. `None` if that takes more than `most_visits` nodes and runs of faces on each of
    /// three rays.
    pub(in crate::mesh) fn winding_number(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        most_visits: usize,
    ) -> Option<i32> {
        if !self.is_within_box(p_B) {
            return Some(0);
        }
        self.rays(p_B).iter().step_by(2).find_map(|ray| {
            let mut number = 0;
            let count = |crossing: Crossing| number += if crossing.is_leaving { 1 } else { -1 };
            self.for_each_crossing(triangles, ray, most_visits, count).ok().map(|()| number)
        })
    }

    /// Visits all faces of solids that a ray from a point crosses on the shortest way along an axis out of the box around the
    /// mesh, and says whether it leaves the material there; whatever it costs.
    pub(in crate::mesh) fn for_each_face_on_the_way_out(
        &self,
        triangles: Triangles<'_>,
        p_B: &Vector3<f64>,
        mut visit: impl FnMut(u32, bool),
    ) {
        let [ray, ..] = self.rays(p_B);
        let visit = |crossing: Crossing| visit(crossing.face, crossing.is_leaving);
        let all = self.for_each_crossing(triangles, &ray, usize::MAX, visit);
        debug_assert!(all.is_ok());
    }

    /// Along the three axes both ways: the axes with the shortest way out of the box first, and of each that way first.
    pub(super) fn rays(&self, p_B: &Vector3<f64>) -> [Ray; 6] {
        let room_m = |axis: usize, is_upward: bool| {
            if is_upward { self.upper_B[axis] - p_B[axis] } else { p_B[axis] - self.lower_B[axis] }
        };
        let shorter = |axis: usize| room_m(axis, true) < room_m(axis, false);
        let least_m = |axis: &usize| room_m(*axis, shorter(*axis));
        let mut axes = [0, 1, 2];
        axes.sort_unstable_by(|a, b| least_m(a).total_cmp(&least_m(b)));
        std::array::from_fn(|i| {
            let axis = axes[i / 2];
            Ray::new(p_B, axis, shorter(axis) == (i % 2 == 0))
        })
    }

    /// Visits all faces of solids that a ray crosses, in no order.
    pub(super) fn for_each_crossing(
        &self,
        triangles: Triangles<'_>,
        ray: &Ray,
        most_visits: usize,
        mut visit: impl FnMut(Crossing),
    ) -> Result<(), TooLong> {
        let mut stack = Stack::<f32>::new();
        let mut visits = 0;
        while let Some((_, child)) = stack.pop() {
            if visits == most_visits {
                return Err(TooLong);
            }
            visits += 1;
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&ray.keys(node), &node.children, 0.0);
                continue;
            }
            for index in child.index()..child.index() + child.count() {
                let face = &triangles.faces[index];
                if face.sides == Sides::Sheet {
                    continue;
                }
                if let Some((ahead_m, is_leaving)) = ray.crosses(&triangles.corners(face)) {
                    visit(Crossing { face: index as u32, ahead_m, is_leaving });
                }
            }
        }
        Ok(())
    }
}

impl Ray {
    fn new(from_B: &Vector3<f64>, axis: usize, is_upward: bool) -> Self {
        let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
        Self { from_B: *from_B, rounded: Rounded::new(from_B), axes, is_upward }
    }

    /// The point on it that is so far ahead \[m\].
    pub(super) fn at(&self, ahead_m: f64) -> Vector3<f64> {
        let mut at_B = self.from_B;
        at_B[self.axes[2]] += if self.is_upward { ahead_m } else { -ahead_m };
        at_B
    }

    /// 0 for each box that it may meet, infinite for the others.
    // Inlined, the compiler takes the lanes apart again where they are sorted.
    #[inline(never)]
    fn keys<const WIDTH: usize>(&self, node: &Node<WIDTH>) -> [f32; WIDTH] {
        let [across, over, along] = self.axes;
        let (p, [lower, upper]) = (&self.rounded, &node.bounds);
        let mut keys = [0.0; WIDTH];
        for i in 0..WIDTH {
            let is_across = (lower[across][i] <= p.upper[across]) & (upper[across][i] >= p.lower[across]);
            let is_over = (lower[over][i] <= p.upper[over]) & (upper[over][i] >= p.lower[over]);
            let is_ahead = if self.is_upward {
                upper[along][i] >= p.lower[along]
            } else {
                lower[along][i] <= p.upper[along]
            };
            keys[i] = if is_across & is_over & is_ahead { 0.0 } else { f32::INFINITY };
        }
        keys
    }

    /// How far ahead it crosses a triangle, and whether it leaves there.
    #[inline(always)]
    fn crosses(&self, corners: &[Vector3<f64>; 3]) -> Option<(f64, bool)> {
        let [a, b, c] = [self.seen(&corners[0]), self.seen(&corners[1]), self.seen(&corners[2])];
        let is_up = [a.y > 0.0, b.y > 0.0, c.y > 0.0];
        // The corner that is alone on its side of the axis, and the two others as they follow.
        let (apex, next, last, apex_is_up) = match is_up {
            [true, true, true] | [false, false, false] => return None,
            [apex, next, last] if next == last => (a, b, c, apex),
            [last, apex, next] if next == last => (b, c, a, apex),
            [_, _, apex] => (c, a, b, apex),
        };
        let (rising, falling) = if apex_is_up {
            (cut(&last, &apex), cut(&next, &apex))
        } else {
            (cut(&apex, &next), cut(&apex, &last))
        };
        let (right, left, is_counterclockwise) = match (rising.0 > 0.0, falling.0 > 0.0) {
            (true, false) => (rising, falling, true),
            (false, true) => (falling, rising, false),
            _ => return None,
        };
        let ahead_m = left.1 + (right.1 - left.1) * (-left.0 / (right.0 - left.0));
        let is_leaving = is_counterclockwise == self.is_upward;
        let is_ahead = if is_leaving { ahead_m >= 0.0 } else { ahead_m > 0.0 };
        is_ahead.then_some((ahead_m, is_leaving))
    }

    /// A point as seen from the ray's beginning: across it x and y, along it z.
    #[inline(always)]
    fn seen(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        let [x, y, z] = self.axes.map(|axis| point_B[axis] - self.from_B[axis]);
        Vector3::new(x, y, if self.is_upward { z } else { -z })
    }
}

/// Where an edge crosses y = 0, from its end below or at it to the one above: x and z there.
///
/// x lies between the ends' also where rounding would have it otherwise: boxes were left out by that.
#[inline(always)]
fn cut(low: &Vector3<f64>, high: &Vector3<f64>) -> (f64, f64) {
    let share = low.y / (low.y - high.y);
    let x = low.x + (high.x - low.x) * share;
    let (least, most) = if low.x < high.x { (low.x, high.x) } else { (high.x, low.x) };
    (x.clamp(least, most), low.z + (high.z - low.z) * share)
}
