//! Where a segment first meets a mesh: did the finger's last step touch it?
//!
//! Problem: the step is tiny and lands anywhere, also on an edge, on a vertex, in the plane of a face; no rounding
//! may let it slip between two faces, or past all of them in two steps.
//!
//! Model: a face is met if the distances from its plane change sign along the segment and the segment's line passes
//! through it. The line test shears space so that the line becomes the axis of a plane (Woop, Benthin & Wald 2013):
//! a vertex is rounded to the same point of that plane for all its faces, and there the sign of `ax by - ay bx` is
//! never wrong, at worst zero, since rounding keeps the order of the two products. Zero counts as met; so nothing
//! fits between the faces of an edge or around a vertex.
//!
//! A finger that came to lie inside by rounding must be caught by its next step. So a start up to a tolerance
//! behind a face's plane counts as outside; there no line can tell through which face it went, but only one that is
//! as close as the tolerance is meant, hence that is what is asked. An end up to the tolerance in front counts as
//! met: no finger is free where rounding could put it on either side of a sheet.
//!
//! A god-object that is let go starts on the surface itself, and knows which side it leaves ([`Leaving`]). There the
//! tolerance would be a trap: of a plate thinner than that the far side would catch it from within, and hold it for good. So
//! of a face that lies back to back with one that is left it must not start behind by more than distances from planes are
//! rounded by, 8 eps of the coordinates ([`ROUNDED`]). Plates that are thicker are told apart by that, and vertices of thinner
//! ones are merged (`weld.rs`, 16 eps); what is left of those, a fold without any thickness, is not met from the
//! face on which it lies.
//!
//! Cost: a segment that ends far from the mesh or its box visits a few nodes; no bound holds for every segment.

use nalgebra::Vector3;

use super::closest::closest_on;
use super::stack::Stack;
use super::{Bvh, Node, Triangles, larger, smaller};
use crate::mesh::{Face, Sides};

/// The surface from which a god-object sets out.
pub(in crate::mesh) trait Leaving {
    /// True within a face, not at its rim.
    fn is_face(&self) -> bool;

    /// True for a face with this normal, towards the start, behind which that lies by more than rounding but less than the
    /// tolerance, if it is the far side of what is left.
    fn is_far_side(&self, normal_B: &Vector3<f64>) -> bool;

    /// True for such a face on which the start lies, if it is upon the one that is left, back to back.
    fn lies_upon(&self, normal_B: &Vector3<f64>) -> bool;
}

/// Free space.
struct Nothing;

impl Leaving for Nothing {
    fn is_face(&self) -> bool {
        false
    }

    fn is_far_side(&self, _: &Vector3<f64>) -> bool {
        false
    }

    fn lies_upon(&self, _: &Vector3<f64>) -> bool {
        false
    }
}

/// Where a segment meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the face; the lowest of those met at the same place.
    pub face: u32,
    /// How far along the segment, 0 at its start to 1 at its end.
    pub fraction: f64,
    /// On the face, in the object's frame \[m\].
    pub point_B: Vector3<f64>,
    /// Whether it goes against the face's normal; the other way only sheets are met.
    pub is_front: bool,
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// The first face that the segment `from_B -> to_B` enters; faces of a sheet are entered from either side, and so
    /// are all if `sides` says so.
    ///
    /// None if it is not finite, has no length, or is so long that its rounding hides the mesh (1e12 of its sizes).
    pub fn first_hit(
        &self,
        triangles: Triangles<'_>,
        sides: Sides,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
    ) -> Option<Hit> {
        self.first_hit_of_others(triangles, sides, from_B, to_B, |_| false)
    }

    /// As [`Self::first_hit`], of the faces that `is_skipped` does not name.
    pub fn first_hit_of_others(
        &self,
        triangles: Triangles<'_>,
        sides: Sides,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        let segment = Segment::new([from_B, to_B], sides, self.extent_m(), (0.0, &Nothing));
        self.first_met(triangles, &segment, is_skipped)
    }

    /// As [`Self::first_hit_of_others`], from a point of the surface that is left.
    pub(in crate::mesh) fn first_hit_in_flight(
        &self,
        triangles: Triangles<'_>,
        [from_B, to_B]: [&Vector3<f64>; 2],
        leaving: &impl Leaving,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        // A place on a face is rounded as the finger is for which it was computed, one on an edge as its ends are.
        let size_m = if leaving.is_face() { self.extent_m().max(to_B.amax()) } else { self.extent_m() };
        let leaving = (ROUNDED * size_m, leaving);
        let segment = Segment::new([from_B, to_B], Sides::Solid, self.extent_m(), leaving);
        self.first_met(triangles, &segment, is_skipped)
    }

    #[inline(always)]
    fn first_met(
        &self,
        triangles: Triangles<'_>,
        segment: &Segment<'_, impl Leaving>,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        let clipped = Clipped::new(segment, &self.lower_B, &self.upper_B)?;
        let line = Line::new(segment.path, clipped.end);
        let slabs = Slabs::new(&clipped);
        let mut best: Option<Met> = None;
        let mut limit = 1.0;
        let mut stack = Stack::<f32>::new();
        while let Some((entered, child)) = stack.pop() {
            if entered > limit {
                continue;
            }
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&slabs.entries(node, limit), &node.children, limit);
                continue;
            }
            for index in child.index()..child.index() + child.count() {
                // First, since of a thousand faces that share the place where the segment starts each would be near
                // enough to be looked at closely.
                if is_skipped(index as u32) {
                    continue;
                }
                let Some(met) = segment.meets(triangles, index as u32, &line) else { continue };
                if best.is_none_or(|best| (met.fraction, met.face) < (best.fraction, best.face)) {
                    best = Some(met);
                    limit = clipped.fraction(met.fraction);
                }
            }
        }
        best.map(|met| segment.hit(triangles, met))
    }
}

/// The segment and what its distances from planes are compared with.
struct Segment<'l, L> {
    from: Vector3<f64>,
    to: Vector3<f64>,
    path: Vector3<f64>,
    sides: Sides,
    tolerance_m: f64,
    /// Largest rounding of a distance from a plane.
    rounded_m: f64,
    leaving: &'l L,
}

#[derive(Clone, Copy)]
struct Met {
    face: u32,
    fraction: f64,
    is_front: bool,
}

impl<'l, L: Leaving> Segment<'l, L> {
    fn new(
        [from, to]: [&Vector3<f64>; 2],
        sides: Sides,
        extent_m: f64,
        (rounded_m, leaving): (f64, &'l L),
    ) -> Self {
        let tolerance_m = TOLERANCE * extent_m;
        Self { from: *from, to: *to, path: to - from, sides, tolerance_m, rounded_m, leaving }
    }

    #[inline]
    fn meets(&self, triangles: Triangles<'_>, index: u32, line: &Line) -> Option<Met> {
        let face = &triangles.faces[index as usize];
        let (mut before, mut after) =
            (face.normal_B.dot(&self.from) - face.offset_m, face.normal_B.dot(&self.to) - face.offset_m);
        let is_front = after < before;
        if !is_front && (self.sides == Sides::Sheet || face.sides == Sides::Sheet) {
            (before, after) = (-before, -after);
        }
        if !(before >= -self.tolerance_m && after < before && after <= self.tolerance_m) {
            return None;
        }
        if before <= self.rounded_m && self.leaves_back_to_back(face, is_front, before) {
            return None;
        }
        let fraction = (before / (before - after)).clamp(0.0, 1.0);
        // Behind the plane, not quite at it, or in it over the whole length: where the line meets it says nothing.
        let is_vague =
            before <= 0.0 || after > 0.0 || before <= self.tolerance_m && after >= -self.tolerance_m;
        let corners = triangles.corners(face);
        let touches = || self.touches(face, &corners, fraction);
        // Right in front of the plane: so may the start be beside the rim of a face at a concave edge.
        let is_met = if is_vague {
            touches()
        } else {
            line.meets(&corners) || before <= self.tolerance_m && touches()
        };
        is_met.then_some(Met { face: index, fraction, is_front })
    }

    /// True for the far side of what is left: behind it by more than rounding, or upon it.
    #[inline(always)]
    fn leaves_back_to_back(&self, face: &Face, is_front: bool, before: f64) -> bool {
        let normal_B = if is_front { face.normal_B } else { -face.normal_B };
        if before < -self.rounded_m {
            self.leaving.is_far_side(&normal_B)
        } else {
            self.leaving.lies_upon(&normal_B)
        }
    }

    /// Whether the face is as near as the tolerance: its plane may be one away, and so may its rim be.
    fn touches(&self, face: &Face, corners: &[Vector3<f64>; 3], fraction: f64) -> bool {
        let (point, at_most_m) = (self.from + self.path * fraction, 2.0 * self.tolerance_m);
        let closest = closest_on(face, corners, &point, at_most_m * at_most_m);
        closest.is_some_and(|closest| closest.squared_distance <= at_most_m * at_most_m)
    }

    /// Along a face the line leaves the place vague, the face does not: the point is brought onto it.
    fn hit(&self, triangles: Triangles<'_>, met: Met) -> Hit {
        let face = &triangles.faces[met.face as usize];
        let on_plane = self.from + self.path * met.fraction;
        let closest = closest_on(face, &triangles.corners(face), &on_plane, f64::INFINITY);
        let point_B = closest.map_or(on_plane, |closest| closest.point_B);
        Hit { face: met.face, fraction: met.fraction, point_B, is_front: met.is_front }
    }
}

/// A line, as the axis of a sheared space: `x` and `y` across it vanish on the line.
struct Line {
    origin: Vector3<f64>,
    axes: [usize; 3],
    shear: [f64; 2],
}

impl Line {
    fn new(path: Vector3<f64>, origin: Vector3<f64>) -> Self {
        let z = path.iamax();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        Self { origin, axes, shear: [path[axes[0]] / path[z], path[axes[1]] / path[z]] }
    }

    /// Whether it passes through a triangle, from either side; the rim counts.
    #[inline(always)]
    fn meets(&self, corners: &[Vector3<f64>; 3]) -> bool {
        let [a, b, c] = [self.across(&corners[0]), self.across(&corners[1]), self.across(&corners[2])];
        let (ab, bc, ca) = (a[0] * b[1] - a[1] * b[0], b[0] * c[1] - b[1] * c[0], c[0] * a[1] - c[1] * a[0]);
        (ab >= 0.0) & (bc >= 0.0) & (ca >= 0.0) | (ab <= 0.0) & (bc <= 0.0) & (ca <= 0.0)
    }

    #[inline(always)]
    fn across(&self, point: &Vector3<f64>) -> [f64; 2] {
        let [x, y, z] = self.axes;
        let relative = point - self.origin;
        [relative[x] - self.shear[0] * relative[z], relative[y] - self.shear[1] * relative[z]]
    }
}

/// The part of the segment within the box of the whole mesh: only there `f32` is fine enough.
struct Clipped {
    start: Vector3<f64>,
    end: Vector3<f64>,
    entry: f64,
    exit: f64,
    /// Largest coordinate that can occur \[m\].
    scale_m: f64,
}

impl Clipped {
    /// None if nothing of it can meet the box.
    #[inline]
    fn new<L>(segment: &Segment<'_, L>, lower: &Vector3<f64>, upper: &Vector3<f64>) -> Option<Self> {
        let Segment { from, to, path, .. } = segment;
        // Fails for NaN as well.
        if !(path.norm_squared() < f64::MAX && from.norm_squared() < f64::MAX && *path != Vector3::zeros()) {
            return None;
        }
        let extent = lower.amax().max(upper.amax());
        // The ends computed here are rounded relative to how far away the segment's are.
        let pad = BOX_PAD * (extent + from.amax() + to.amax());
        if pad > extent {
            return None;
        }
        let (mut entry, mut exit) = (0.0, 1.0);
        for axis in 0..3 {
            let (low, high) = (lower[axis] - pad, upper[axis] + pad);
            let (from, to, path) = (from[axis], to[axis], path[axis]);
            if from.max(to) < low || from.min(to) > high {
                return None;
            }
            let (near, far) = if path > 0.0 { (low, high) } else { (high, low) };
            // Only a coordinate that crosses a bound is divided by its change, which then is not 0.
            if (from < low) || (from > high) {
                entry = larger(entry, (near - from) / path);
            }
            if (to < low) || (to > high) {
                exit = smaller(exit, (far - from) / path);
            }
        }
        let (start, end) = (
            if entry > 0.0 { from + path * entry } else { *from },
            if exit < 1.0 { from + path * exit } else { *to },
        );
        (entry <= exit).then_some(Self { start, end, entry, exit, scale_m: extent + pad })
    }

    /// A fraction of the whole segment as one of this part, rounded up amply.
    fn fraction(&self, of_segment: f64) -> f32 {
        let fraction = (of_segment - self.entry) / (self.exit - self.entry).max(f64::MIN_POSITIVE);
        (fraction as f32 + SLAB_MARGIN).min(1.0)
    }
}

/// The clipped segment as nodes are tested with it: in `f32`, boxes grown by more than all its rounding.
///
/// Each of origin, direction, difference, quotient and product is off by at most 2^-24 of `scale_m` or twice
/// that, 12 x 2^-24 in all; the margin is 32 x 2^-24. A component of the path below 1/16 of the margin is replaced by
/// that much, which moves no point by more: so there is no division by zero, and nothing overflows.
struct Slabs {
    /// Which of lower (0) and upper (1) is met first.
    first: [usize; 3],
    origin_first: [f32; 3],
    origin_last: [f32; 3],
    inverse: [f32; 3],
}

impl Slabs {
    fn new(clipped: &Clipped) -> Self {
        let margin = (clipped.scale_m as f32 * SLAB_MARGIN).max(SMALLEST_MARGIN_M);
        let path = clipped.end - clipped.start;
        let (mut slabs, least) = (
            Self { first: [0; 3], origin_first: [0.0; 3], origin_last: [0.0; 3], inverse: [0.0; 3] },
            margin / 16.0,
        );
        for axis in 0..3 {
            let (origin, path) = (clipped.start[axis] as f32, path[axis] as f32);
            let is_down = path < 0.0;
            let length = larger(path.abs(), least);
            let (signed_margin, signed_length) = if is_down { (-margin, -length) } else { (margin, length) };
            slabs.first[axis] = usize::from(is_down);
            slabs.origin_first[axis] = origin + signed_margin;
            slabs.origin_last[axis] = origin - signed_margin;
            slabs.inverse[axis] = 1.0 / signed_length;
        }
        slabs
    }

    /// Fraction at which each child's box is entered, infinite if it is not met before `limit`.
    // Inlined, the compiler takes the lanes apart again where they are sorted.
    #[inline(never)]
    fn entries<const WIDTH: usize>(&self, node: &Node<WIDTH>, limit: f32) -> [f32; WIDTH] {
        let (mut near, mut far) = ([0.0; WIDTH], [limit; WIDTH]);
        for axis in 0..3 {
            let first = self.first[axis] & 1;
            let (nearer, farther) = (&node.bounds[first][axis], &node.bounds[first ^ 1][axis]);
            for i in 0..WIDTH {
                near[i] = larger((nearer[i] - self.origin_first[axis]) * self.inverse[axis], near[i]);
                far[i] = smaller((farther[i] - self.origin_last[axis]) * self.inverse[axis], far[i]);
            }
        }
        for i in 0..WIDTH {
            near[i] = if near[i] <= far[i] { near[i] } else { f32::INFINITY };
        }
        near
    }
}

/// How far behind a face a segment may start, relative to the mesh: a hundred times what rounding can do.
const TOLERANCE: f64 = 1e-13;
/// Distance behind a face at which a point on it may be found, relative to the coordinates. The three products of a distance
/// from a plane are rounded by 2.6 eps at most, those of the plane's own offset by as much; the normal of a well-shaped face,
/// and the place itself, by two more. Of 320,000 random faces and places it was 2.64 eps at most.
const ROUNDED: f64 = 8.0 * f64::EPSILON;
/// Relative to the coordinates from which the clipped ends are computed with a few roundings of 1e-16 each.
const BOX_PAD: f64 = 1e-12;
/// 2^-19.
const SLAB_MARGIN: f32 = 1.0 / 524_288.0;
/// Keeps its inverse, times any coordinate below 1e7 m, finite.
const SMALLEST_MARGIN_M: f32 = 1e-30;
