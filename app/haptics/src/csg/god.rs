//! A god-object on patches: where it is, what it rests on, and how far from there nothing else matters.
//!
//! Model: its state is the set of patches that hold it (Melder fig. 9.4): one on a patch, two on an edge, more in a
//! corner. Around it lies a [`Clearing`] that no other patch reaches into: within it a god-object that stays on its patches
//! crosses nothing and meets nothing, and nobody has to look at the others. Where it comes to the end of both its clearing and
//! its neighbourhood, it looks ahead in a tick that has little else to do.
//!
//! Frames: object frame B. Invariants: it is on all patches that hold it, on the free side of each; a clearing is either
//! true or empty.

use nalgebra::Vector3;

use super::Csg;
use super::hit::Hit;
use super::near::{MAX_NEAR, Neighbourhood, Sides};
use super::patch::{Look, Patch};
use crate::surface::Feature;

/// Where a god-object is.
#[derive(Debug, Clone, Copy)]
pub(super) struct God {
    pub(super) point_B: Vector3<f64>,
    pub(super) near: Neighbourhood,
    /// Its side of each patch nearby; of those that it is on, the free one.
    pub(super) sides: Sides,
    /// The patches that hold it: one on a patch, two on an edge, more in a corner.
    pub(super) active: Sides,
    pub(super) clearing: Clearing,
}

/// A ball in which all patches but those that hold the god-object keep their side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clearing {
    centre_B: Vector3<f64>,
    radius_m: f64,
}

impl Clearing {
    pub(super) const NONE: Self = Self { centre_B: Vector3::new(0.0, 0.0, 0.0), radius_m: 0.0 };

    /// Of a god-object on `count` patches, `nearest_m` away from the nearest of the others and `room_m` from the end of what
    /// is known.
    fn around(god: &God, count: usize, nearest_m: f64, room_m: f64) -> Self {
        if god.active.count_ones() as usize != count || count > MAX_CLEAR {
            return Self::NONE;
        }
        Self { centre_B: god.point_B, radius_m: nearest_m.min(room_m).max(0.0) }
    }

    #[cfg(test)]
    pub(super) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Whether it is still the same one.
    #[inline(always)]
    pub(super) fn is_around(&self, other: &Self) -> bool {
        self.centre_B == other.centre_B
    }

    #[inline(always)]
    fn is_all_but_left(&self, point_B: &Vector3<f64>) -> bool {
        (point_B - self.centre_B).norm_squared() > (LEFT * self.radius_m).powi(2)
    }

    /// How far a point is from its end (m).
    #[inline(always)]
    pub(super) fn room_m(&self, point_B: &Vector3<f64>) -> f64 {
        self.radius_m - (point_B - self.centre_B).norm()
    }

    /// Whether a point is in it.
    #[inline(always)]
    pub(super) fn holds(&self, point_B: &Vector3<f64>) -> bool {
        (point_B - self.centre_B).norm_squared() < self.radius_m * self.radius_m
    }
}

impl God {
    pub(super) fn new(point_B: Vector3<f64>, near: Neighbourhood, sides: Sides, active: Sides) -> Self {
        Self { point_B, near, sides, active, clearing: Clearing::NONE }
    }

    pub(super) fn hit(hit: &Hit) -> Self {
        Self::new(hit.point_B, hit.near, hit.sides, hit.patch)
    }

    /// What it rests on: curved patches are surfaces, planes faces.
    pub(super) fn feature(&self, csg: &Csg) -> Feature {
        match self.active.count_ones() {
            0 | 1 if self.is_on_planes(csg) => Feature::Face,
            0 | 1 => Feature::Surface,
            2 => Feature::Edge,
            _ => Feature::Vertex,
        }
    }

    /// The number of a patch that it rests on.
    pub(super) fn piece(&self) -> u32 {
        u32::from(self.near.number(self.active.trailing_zeros() as usize % MAX_NEAR))
    }

    #[inline]
    pub(super) fn is_on_planes(&self, csg: &Csg) -> bool {
        self.held_by().all(|index| self.near.patch(csg, index).is_plane())
    }

    /// The patches that hold it, by their places in the neighbourhood.
    #[inline(always)]
    pub(super) fn held_by(&self) -> impl Iterator<Item = usize> + use<> {
        places(self.active)
    }

    /// Whether it rests on one curved patch, inside of it.
    #[inline]
    pub(super) fn is_in_hollow(&self, csg: &Csg) -> bool {
        self.active.count_ones() == 1 && self.active & self.sides != 0 && !self.is_on_planes(csg)
    }

    /// The patches that hold it, by number.
    #[inline]
    pub(super) fn held_patches(&self) -> [u16; 3] {
        let mut numbers = [u16::MAX; 3];
        for (place, index) in numbers.iter_mut().zip(self.held_by()) {
            *place = self.near.number(index);
        }
        if numbers[1] != u16::MAX {
            numbers.sort_unstable();
        }
        numbers
    }

    /// The patch that holds it, if it is one.
    #[inline(always)]
    pub(super) fn only_patch<'c>(&self, csg: &'c Csg) -> Option<&'c Patch> {
        let index = self.active.trailing_zeros() as usize;
        (self.active.count_ones() == 1).then(|| self.near.patch(csg, index))
    }

    /// The two patches that hold it, if it is on an edge.
    #[inline(always)]
    pub(super) fn both_patches<'c>(&self, csg: &'c Csg) -> Option<[&'c Patch; 2]> {
        let first = self.active.trailing_zeros() as usize;
        let second = (self.active & self.active.wrapping_sub(1)).trailing_zeros() as usize;
        (self.active.count_ones() == 2).then(|| [self.near.patch(csg, first), self.near.patch(csg, second)])
    }

    /// Whether it is free, and each of the one or two patches that hold it is boundary there.
    #[inline]
    pub(super) fn is_before_walls(&self) -> bool {
        let is_wall = |index: usize| self.near.is_solid(self.sides ^ 1 << index);
        self.active.count_ones() > 2 || !self.near.is_solid(self.sides) && self.held_by().all(is_wall)
    }

    /// Knows its clearing from how far away the nearest patch is that does not hold it; it is on `count` patches.
    pub(super) fn clear(&mut self, count: usize, nearest_m: f64) {
        let room_m = self.near.room_m(&self.point_B);
        self.clearing = Clearing::around(self, count, nearest_m, room_m);
    }

    /// Whether it comes to the end of its clearing, and of its neighbourhood.
    #[inline(always)]
    pub(super) fn sees_an_end(&self) -> bool {
        self.clearing.is_all_but_left(&self.point_B)
            && self.near.room_m(&self.point_B) < SHORT * self.near.radius_m
    }

    /// Makes its surroundings known anew before it has left them.
    #[inline(never)]
    pub(super) fn look_ahead(&mut self, csg: &Csg) {
        let count = self.active.count_ones() as usize;
        self.look_around(csg, 0.0);
        let levels_m = self.near.levels_m(csg, &self.point_B);
        let others = (0..self.near.count()).filter(|&index| self.active >> index & 1 == 0);
        let nearest_m = others.fold(f64::INFINITY, |nearest: f64, index| nearest.min(levels_m[index].abs()));
        self.clear(count, nearest_m - 2.0 * csg.tolerance_m());
    }

    /// Makes its surroundings known anew, if it can be for a way of this length.
    pub(super) fn look_around(&mut self, csg: &Csg, length_m: f64) {
        let wish_m = (LARGER * length_m).max(COMMON * csg.extent_m);
        let near = Neighbourhood::at_least(csg, &self.point_B, length_m, wish_m);
        let active = self.held_by().filter_map(|index| near.position(self.near.number(index)));
        self.active = active.fold(0, |active, place| active | 1 << place);
        self.sides = near.sides_after(csg, &self.point_B, &self.near, self.sides);
        self.near = near;
        self.clearing = Clearing::NONE;
    }
}

/// The patches of a set.
#[inline(always)]
pub(super) fn places(mut set: Sides) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let index = set.trailing_zeros() as usize;
        set &= set.wrapping_sub(1);
        (index < MAX_NEAR).then_some(index)
    })
}

/// Of what the patches that hold it show, the steepest of its heights (m).
#[inline(always)]
pub(super) fn worst_m(looks: &[Look]) -> f64 {
    looks.iter().fold(0.0, |worst: f64, look| worst.max(look.height_m.abs()))
}

/// The most patches that a god-object in a clearing is held by.
const MAX_CLEAR: usize = 2;
/// A neighbourhood is asked for this much larger than the way.
const LARGER: f64 = 2.0;
/// Radius of a common neighbourhood, in terms of the extent.
const COMMON: f64 = 0.06;
/// Share of a clearing's radius from which on it ends soon.
const LEFT: f64 = 0.6;
/// With less room than this share of its radius, a neighbourhood comes to its end.
const SHORT: f64 = 0.5;
