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
//! and two wedges that touch in an edge are two walls. Patches that part no free cell from a solid one are left out, since
//! of two that coincide the cells between them would bar the way.
//!
//! Frames and signs: object frame B, the god-object as origin. Invariant: which of several cells as near is taken
//! depends on where they are, not on the order of the tree.
//! Cost: for m patches at most `2^m` cells of `1 + m + m (m - 1) / 2` candidates; one patch needs none of it.

use nalgebra::Vector3;

use super::feet::{Feet, Nearest, SLIT, nearest_before, only_both_hold};
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
    #[inline(always)]
    pub(super) fn facing(
        &self,
        near: &Neighbourhood,
        sides: Sides,
        to_hip_B: &Vector3<f64>,
        release_m: f64,
    ) -> Option<Facing> {
        if !self.is_clear() {
            return self.without_seams(near, sides).facing_among_all(near, sides, to_hip_B, release_m);
        }
        self.facing_among_all(near, sides, to_hip_B, release_m)
    }

    #[inline(always)]
    fn facing_among_all(
        &self,
        near: &Neighbourhood,
        sides: Sides,
        to_hip_B: &Vector3<f64>,
        release_m: f64,
    ) -> Option<Facing> {
        let [a_B, b_B, c_B, ..] = self.normals_B;
        match self.count {
            2 => {
                let feet = Feet::<2, 1>::of(&[a_B, b_B], to_hip_B);
                self.facing_among(near, sides, to_hip_B, release_m, |cell| feet.nearest(cell))
            }
            3 => {
                let feet = Feet::<3, 3>::of(&[a_B, b_B, c_B], to_hip_B);
                self.facing_among(near, sides, to_hip_B, release_m, |cell| feet.nearest(cell))
            }
            _ => self.facing_among(near, sides, to_hip_B, release_m, |cell| self.nearest_of(cell, to_hip_B)),
        }
    }

    #[inline(never)]
    fn facing_among(
        &self,
        near: &Neighbourhood,
        sides: Sides,
        to_hip_B: &Vector3<f64>,
        release_m: f64,
        nearest: impl Fn(usize) -> Nearest,
    ) -> Option<Facing> {
        let others = sides & !self.spread((1 << self.count) - 1);
        let start = (0..self.count).fold(0, |cell, i| cell | (sides >> self.indices[i] & 1) << i);
        let is_clear = self.is_clear();
        let is_free = |cell: usize| {
            !near.is_solid(others | self.spread(cell)) && (is_clear || self.has_room_in_between(cell))
        };
        let is_walled_in = (0..self.count).all(|i| near.is_solid(sides ^ 1 << self.indices[i]));
        let facing = if is_walled_in && is_free(start) {
            // The common case, a concave edge or corner: there is no other cell to go to.
            let Nearest { way_B, mask, .. } = nearest(start);
            Facing { sides, active: self.spread(mask), way_B }
        } else {
            let free = (0..1usize << self.count)
                .filter(|&cell| is_free(cell))
                .fold(0u64, |free, cell| free | 1 << cell);
            self.best_of(self.reached(free, start), others, to_hip_B, nearest)?
        };
        Some(if facing.active == 0 { self.held(near, facing, to_hip_B, release_m) } else { facing })
    }

    /// The cell whose nearest point is nearest to the HIP.
    #[inline(always)]
    fn best_of(
        &self,
        mut cells: u64,
        others: Sides,
        to_hip_B: &Vector3<f64>,
        nearest: impl Fn(usize) -> Nearest,
    ) -> Option<Facing> {
        let slack_m2 = TIE * to_hip_B.norm_squared();
        let mut best: Option<(Nearest, usize)> = None;
        while cells != 0 {
            let cell = cells.trailing_zeros() as usize;
            cells &= cells - 1;
            let here = nearest(cell);
            let is_better = best.is_none_or(|(other, _)| {
                here.distance_m2 < other.distance_m2 - slack_m2
                    || (here.distance_m2 <= other.distance_m2 + slack_m2
                        && is_before(&here.way_B, &other.way_B))
            });
            if is_better {
                best = Some((here, cell));
            }
        }
        let (Nearest { way_B, mask, .. }, cell) = best?;
        Some(Facing { sides: others | self.spread(cell), active: self.spread(mask), way_B })
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

    /// The same corner of only those patches that part free cells from solid ones. Two that coincide and part nothing, as where
    /// two equal ends of leaves are cut off, have a slit between them that counts as no room: in front of it a god-object
    /// would be held by nothing.
    #[inline(never)]
    fn without_seams(&self, near: &Neighbourhood, sides: Sides) -> Self {
        let others = sides & !self.spread((1 << self.count) - 1);
        let solid = (0..1usize << self.count)
            .filter(|&cell| near.is_solid(others | self.spread(cell)))
            .fold(0u64, |solid, cell| solid | 1 << cell);
        let mut left = Self::new();
        for (i, outside) in OUTSIDE.iter().enumerate().take(self.count) {
            if (solid ^ solid >> (1 << i)) & outside & self.cells() != 0 {
                left.indices[left.count] = self.indices[i];
                left.normals_B[left.count] = self.normals_B[i];
                left.count += 1;
            }
        }
        left
    }

    /// A bit for each cell.
    fn cells(&self) -> u64 {
        u64::MAX >> (64 - (1u32 << self.count))
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

    /// Whether all cells are far more than slits: two planes that meet in an edge leave four wedges, three that meet in a point
    /// eight corners.
    fn is_clear(&self) -> bool {
        let [a, b, c, ..] = &self.normals_B;
        match self.count {
            0 | 1 => true,
            2 => a.cross(b).norm_squared() > CLEAR * CLEAR,
            3 => a.cross(b).dot(c).abs() > CLEAR,
            _ => false,
        }
    }

    /// Whether a cell is more than a slit: between two planes back to back, or three that meet in one line, nothing fits.
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
    pub(super) fn nearest(&self, cell: usize, to_hip_B: &Vector3<f64>) -> (Vector3<f64>, usize) {
        let Nearest { way_B, mask, .. } = self.nearest_of(cell, to_hip_B);
        (way_B, mask)
    }

    fn nearest_of(&self, cell: usize, to_hip_B: &Vector3<f64>) -> Nearest {
        let mut normals_B = self.normals_B;
        for (i, normal_B) in normals_B.iter_mut().enumerate().take(self.count) {
            *normal_B = self.outward(i, cell >> i);
        }
        nearest_before(&normals_B[..self.count], to_hip_B)
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
    let along_B = outward_B[0].cross(&outward_B[1]);
    let sine2 = along_B.norm_squared();
    let is_walled_in = !near.is_solid(sides)
        && near.is_solid(sides ^ 1 << first)
        && near.is_solid(sides ^ 1 << second)
        && sine2 > CLEAR * CLEAR;
    (is_walled_in && only_both_hold(outward_B, to_hip_B)).then(|| along_B * (along_B.dot(to_hip_B) / sine2))
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
/// Planes that meet under more than this (rad) are not parallel by far.
const CLEAR: f64 = 1e-3;
/// Squares of distances that differ by less, as a share, are equal.
const TIE: f64 = 1e-14;
