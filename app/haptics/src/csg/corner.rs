//! What holds a HIP back where patches meet: the regenerate transitions of Melder fig. 9.4.
//!
//! Problem: on an edge or in a corner the god-object goes on along one of the patches, along an edge, stays, or is free.
//! Melder's rules (ch. 9.3.1.4-9.3.1.8) tell convex from concave edges by planes in front of which the HIP lies, and are
//! wrong where both meet; "closer than the edge" (9.3.1.7-8) is always true, since no plane is farther than its own edge.
//!
//! Model: the tangent planes of the patches that meet cut the space around the god-object into cells, which the tree's
//! table calls free or solid. Of all free cells that are reached from the god-object's own through free cells, the
//! point nearest to the HIP tells: in the open, the finger is free there; on one plane, along that patch; on two, along
//! their edge; at the tip, nowhere. "In front of either" at convex edges and "in front of both" at concave ones follow,
//! and two wedges that touch in an edge are two walls.
//!
//! Frames and signs: object frame B, the god-object as origin. Invariant: which of several cells as near is taken
//! depends on where they are, not on the order of the tree.
//! Cost: for m patches at most `2^m` cells of `1 + m + m (m - 1) / 2` candidates; one patch needs none of it.

use nalgebra::Vector3;

use super::near::{Neighbourhood, Sides};
use super::patch::Look;

/// The most patches that a corner is made of.
pub(super) const MAX_CORNER: usize = 6;

/// Patches that meet at the god-object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Their places in the neighbourhood, and their normals.
    pub(super) indices: [usize; MAX_CORNER],
    pub(super) normals_B: [Vector3<f64>; MAX_CORNER],
    pub(super) count: usize,
}

/// What a HIP sees of a corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facing {
    /// The free cell.
    pub(super) sides: Sides,
    /// The patches that hold the HIP back; none if it is free.
    pub(super) active: Sides,
    /// From the god-object to the point of the free cells nearest to the HIP.
    pub(super) way_B: Vector3<f64>,
}

impl Corner {
    pub(super) fn new() -> Self {
        Self { indices: [0; MAX_CORNER], normals_B: [Vector3::zeros(); MAX_CORNER], count: 0 }
    }

    /// Adds a patch, if there is room.
    pub(super) fn add(&mut self, index: usize, look: &Look) {
        if self.count < MAX_CORNER {
            self.indices[self.count] = index;
            self.normals_B[self.count] = look.normal_B;
            self.count += 1;
        }
    }

    /// Where a patch of the neighbourhood is listed here.
    #[inline(always)]
    pub(super) fn place(&self, index: usize) -> usize {
        self.indices[..self.count].iter().position(|&i| i == index).unwrap_or(0)
    }

    /// `sides` of the god-object's own cell; `to_hip_B` leads from the god-object to the HIP. `None` if all is solid.
    pub(super) fn facing(
        &self,
        near: &Neighbourhood,
        sides: Sides,
        to_hip_B: &Vector3<f64>,
        release_m: f64,
    ) -> Option<Facing> {
        let others = sides & !self.spread((1 << self.count) - 1);
        let start = (0..self.count).fold(0, |cell, i| cell | (sides >> self.indices[i] & 1) << i);
        let is_free = |cell: usize| !near.is_solid(others | self.spread(cell)) && self.has_room(cell);
        let is_walled_in = (0..self.count).all(|i| near.is_solid(sides ^ 1 << self.indices[i]));
        if is_walled_in && is_free(start) {
            // The common case, a concave edge or corner: there is no other cell to go to.
            let (way_B, mask) = self.nearest(start, to_hip_B);
            let facing = Facing { sides, active: self.spread(mask), way_B };
            return Some(if mask == 0 { self.held(near, facing, to_hip_B, release_m) } else { facing });
        }
        self.facing_of_many(near, others, start, to_hip_B, release_m)
    }

    #[inline(never)]
    fn facing_of_many(
        &self,
        near: &Neighbourhood,
        others: Sides,
        start: usize,
        to_hip_B: &Vector3<f64>,
        release_m: f64,
    ) -> Option<Facing> {
        let is_free = |cell: usize| !near.is_solid(others | self.spread(cell)) && self.has_room(cell);
        let free =
            (0..1usize << self.count).filter(|&cell| is_free(cell)).fold(0u64, |free, cell| free | 1 << cell);
        let reached = self.reached(free, start);
        let mut best: Option<(f64, Facing)> = None;
        for cell in (0..1usize << self.count).filter(|cell| reached >> cell & 1 == 1) {
            let (way_B, mask) = self.nearest(cell, to_hip_B);
            let distance_m2 = (way_B - to_hip_B).norm_squared();
            let is_better = best.is_none_or(|(shortest, other)| {
                let slack = TIE * to_hip_B.norm_squared();
                distance_m2 < shortest - slack
                    || (distance_m2 <= shortest + slack && is_before(&way_B, &other.way_B))
            });
            if is_better {
                let cell_sides = others | self.spread(cell);
                best = Some((distance_m2, Facing { sides: cell_sides, active: self.spread(mask), way_B }));
            }
        }
        let (_, facing) = best?;
        Some(if facing.active == 0 { self.held(near, facing, to_hip_B, release_m) } else { facing })
    }

    /// In the open: unless it is so little in front of a wall that rounding may have put it there.
    fn held(&self, near: &Neighbourhood, facing: Facing, to_hip_B: &Vector3<f64>, release_m: f64) -> Facing {
        let walls = (0..self.count).filter(|&i| near.is_solid(facing.sides ^ 1 << self.indices[i]));
        let height_m = |i: usize| self.outward(i, facing.sides >> self.indices[i]).dot(to_hip_B);
        let nearest = walls.min_by(|&i, &j| height_m(i).total_cmp(&height_m(j)));
        match nearest {
            Some(i) if height_m(i) <= release_m => Facing { active: 1 << self.indices[i], ..facing },
            _ => facing,
        }
    }

    /// From bits of the corner to bits of the neighbourhood.
    pub(super) fn spread(&self, cell: usize) -> Sides {
        (0..self.count).fold(0, |sides, i| sides | (cell >> i & 1) << self.indices[i])
    }

    /// The normal of a patch into a cell: out of the patch, or into it where the cell is inside of it.
    pub(super) fn outward(&self, i: usize, side: usize) -> Vector3<f64> {
        if side & 1 == 1 { -self.normals_B[i] } else { self.normals_B[i] }
    }

    /// The free cells that are reached from one of them over patches; from a cell that is not free, all.
    fn reached(&self, free: u64, start: usize) -> u64 {
        if free >> start & 1 == 0 {
            return free;
        }
        let mut reached = 1u64 << start;
        for _ in 0..self.count {
            for (i, outside) in OUTSIDE.iter().enumerate().take(self.count) {
                // Cells that differ in patch i lie 2^i apart.
                let apart = 1 << i;
                reached |= (reached & outside) << apart & free;
                reached |= (reached & !outside) >> apart & free;
            }
        }
        reached
    }

    /// Whether a cell is more than a slit: between two planes back to back, or three that meet in one line, nothing fits.
    fn has_room(&self, cell: usize) -> bool {
        if self.count == 1 {
            return true;
        }
        // The common cases: two planes that meet in an edge leave four wedges, three that meet in a point eight corners.
        let [a, b, c, ..] = &self.normals_B;
        let is_clear = match self.count {
            2 => a.cross(b).norm_squared() > CLEAR * CLEAR,
            3 => a.cross(b).dot(c).abs() > CLEAR,
            _ => false,
        };
        is_clear || self.has_room_in_between(cell)
    }

    #[inline(never)]
    fn has_room_in_between(&self, cell: usize) -> bool {
        let normal = |i: usize| self.outward(i, cell >> i);
        // A cone has room if one of the directions along its edges and across its faces, all added, is in front of all.
        let mut middle_B = Vector3::zeros();
        let mut add = |direction_B: Vector3<f64>| {
            let length = direction_B.norm();
            if length > SLIT {
                let direction_B = direction_B / length;
                if (0..self.count).all(|k| normal(k).dot(&direction_B) >= -SLIT) {
                    middle_B += direction_B;
                }
            }
        };
        for i in 0..self.count {
            add(normal(i));
            for j in 0..i {
                let along_B = normal(i).cross(&normal(j));
                [along_B, -along_B].into_iter().for_each(&mut add);
                // Across the edge along either plane: for wedges, whose edges lead both ways.
                [along_B.cross(&normal(i)), normal(j).cross(&along_B)].into_iter().for_each(&mut add);
                [normal(i).cross(&along_B), along_B.cross(&normal(j))].into_iter().for_each(&mut add);
            }
        }
        (0..self.count).all(|k| normal(k).dot(&middle_B) > SLIT)
    }

    /// The point of a cell nearest to the HIP, and the planes that it lies on.
    #[inline]
    pub(super) fn nearest(&self, cell: usize, to_hip_B: &Vector3<f64>) -> (Vector3<f64>, usize) {
        let mut normals_B = self.normals_B;
        for (i, normal_B) in normals_B.iter_mut().enumerate().take(self.count) {
            *normal_B = self.outward(i, cell >> i);
        }
        match self.count {
            2 => nearest_before(&[normals_B[0], normals_B[1]], to_hip_B),
            count => nearest_before(&normals_B[..count], to_hip_B),
        }
    }
}

/// The way to the nearest place on an edge, if nothing but the edge holds the HIP back: all around it is solid.
#[inline(always)]
pub(super) fn edge_holds(
    near: &Neighbourhood,
    sides: Sides,
    [first, second]: [usize; 2],
    outward_B: &[Vector3<f64>; 2],
    to_hip_B: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let is_walled_in = !near.is_solid(sides)
        && near.is_solid(sides ^ 1 << first)
        && near.is_solid(sides ^ 1 << second)
        && outward_B[0].cross(&outward_B[1]).norm_squared() > CLEAR * CLEAR;
    if !is_walled_in {
        return None;
    }
    let (way_B, mask) = nearest_before(outward_B, to_hip_B);
    (mask == 0b11).then_some(way_B)
}

/// The point in front of all planes through the origin nearest to the HIP, and those that it lies on.
#[inline(always)]
fn nearest_before(normals_B: &[Vector3<f64>], to_hip_B: &Vector3<f64>) -> (Vector3<f64>, usize) {
    let slack_m = SLACK * to_hip_B.norm();
    let is_in = |p: &Vector3<f64>, mask: usize| {
        (0..normals_B.len()).all(|k| mask >> k & 1 == 1 || normals_B[k].dot(p) >= -slack_m)
    };
    if normals_B.iter().all(|normal_B| normal_B.dot(to_hip_B) >= 0.0) {
        return (*to_hip_B, 0);
    }
    // At the tip, if nowhere else.
    let mut best = (to_hip_B.norm_squared(), (Vector3::zeros(), (1 << normals_B.len()) - 1));
    let mut offer = |p: Vector3<f64>, mask: usize| {
        let distance_m2 = (p - to_hip_B).norm_squared();
        if distance_m2 < best.0 && is_in(&p, mask) {
            best = (distance_m2, (p, mask));
        }
    };
    for i in 0..normals_B.len() {
        let height_m = normals_B[i].dot(to_hip_B);
        if height_m < 0.0 {
            offer(to_hip_B - normals_B[i] * height_m, 1 << i);
        }
        for j in 0..i {
            let along_B = normals_B[i].cross(&normals_B[j]);
            let length_squared = along_B.norm_squared();
            if length_squared > SLIT * SLIT {
                offer(along_B * (along_B.dot(to_hip_B) / length_squared), 1 << i | 1 << j);
            }
        }
    }
    best.1
}

/// An order of places.
fn is_before(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    let differs = (0..3).find(|&axis| a[axis] != b[axis]);
    differs.is_some_and(|axis| a[axis] < b[axis])
}

/// For each patch of a corner, the cells that are outside of it.
const OUTSIDE: [u64; MAX_CORNER] = [
    0x5555_5555_5555_5555,
    0x3333_3333_3333_3333,
    0x0F0F_0F0F_0F0F_0F0F,
    0x00FF_00FF_00FF_00FF,
    0x0000_FFFF_0000_FFFF,
    0x0000_0000_FFFF_FFFF,
];
/// Planes closer to parallel than this (rad) are one, or leave a slit between them through which nothing goes.
const SLIT: f64 = 1e-6;
/// Planes that meet under more than this (rad) are not parallel by far.
const CLEAR: f64 = 1e-3;
/// Points may miss a plane by this share of their distance.
const SLACK: f64 = 1e-12;
/// Squares of distances that differ by less, as a share, are equal.
const TIE: f64 = 1e-14;
