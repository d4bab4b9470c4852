//! What of a solid matters near a point: a few patches, and the tree as a table over their sides.
//!
//! Model: within a ball around an anchor, all patches whose level there exceeds the ball's radius keep their side. The
//! others, at most eight, make up to 256 combinations of sides; for each the tree is evaluated once (see [`gather`](super::gather)).
//! With the table in hand the solid is `table[sides]`, whatever the tree was.
//!
//! Invariants: a patch that is not listed keeps its side within the ball. If more than eight are near, the ball is as
//! small as it must be for eight, but not smaller than [`SMALLEST`].
//! Cost: a level per patch of the [cell](super::cells) there; seldom twice.

use nalgebra::Vector3;

use super::Csg;
use super::crowd::Crowd;
use super::gather::{gather, gather_from};
use super::patch::Patch;
use super::table::{NOTHING, Table, is_set};

/// The patches near an anchor, and the solid in terms of their sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbourhood {
    pub(super) anchor_B: Vector3<f64>,
    /// Within which it is true (m).
    pub(super) radius_m: f64,
    /// The patches, by their numbers in the solid.
    patches: [u16; MAX_NEAR],
    count: usize,
    /// The solid in terms of their sides.
    pub(super) table: Table,
}

/// Sides of the listed patches: a bit for each, set inside. Their place in the list is their bit's.
pub(super) type Sides = usize;

/// The most patches of a neighbourhood.
pub(super) const MAX_NEAR: usize = 8;

impl Neighbourhood {
    /// All that matters within `wish_m` of a point, or within less if that would be too much.
    pub(super) fn around(csg: &Csg, anchor_B: &Vector3<f64>, wish_m: f64) -> Self {
        Self::at_least(csg, anchor_B, wish_m, wish_m)
    }

    /// As [`Self::around`] within `need_m`; up to `wish_m` where that takes no longer.
    pub(super) fn at_least(csg: &Csg, anchor_B: &Vector3<f64>, need_m: f64, wish_m: f64) -> Self {
        let (mut here, is_crowded) = Self::soon(csg, anchor_B, wish_m);
        // It grows until it is crowded: to look at all of a large ball first would take longer.
        let mut radius_m = here.radius_m;
        for _ in 0..MAX_TRIES {
            if is_crowded || radius_m >= need_m {
                break;
            }
            radius_m *= GROWTH;
            match gather(csg, anchor_B, radius_m, false) {
                Ok(larger) => here = larger,
                Err(ninth_m) => {
                    let largest = gather(csg, anchor_B, ninth_m * JUST_BELOW, false);
                    return largest.unwrap_or(here);
                }
            }
        }
        here
    }

    /// All that matters within `wish_m` of a point, or within less where that would be too much or would take longer.
    pub(super) fn amid(csg: &Csg, anchor_B: &Vector3<f64>, wish_m: f64) -> Self {
        Self::soon(csg, anchor_B, wish_m).0
    }

    /// What is found soon, and whether it is as large as it can be.
    fn soon(csg: &Csg, anchor_B: &Vector3<f64>, wish_m: f64) -> (Self, bool) {
        let smallest_m = SMALLEST * csg.extent_m;
        let mut radius_m = wish_m.max(smallest_m);
        for tries in 0..MAX_TRIES {
            let part = csg.cells.part(anchor_B, radius_m, CROWD);
            radius_m = radius_m.min(part.reach_m);
            match gather_from(csg, &part, anchor_B, radius_m, false) {
                Ok(neighbourhood) => return (neighbourhood, tries > 0),
                // Just below the ninth, or a part of it if that cannot be told.
                Err(ninth_m) if ninth_m < radius_m => radius_m = ninth_m * JUST_BELOW,
                Err(_) => radius_m *= 0.25,
            }
            if radius_m <= smallest_m {
                break;
            }
        }
        (gather(csg, anchor_B, smallest_m, true).unwrap_or(Self::nowhere(anchor_B)), true)
    }

    /// All that matters within exactly this radius; `None` where that would be more than eight patches.
    pub(super) fn exactly(csg: &Csg, anchor_B: &Vector3<f64>, radius_m: f64) -> Option<Self> {
        gather(csg, anchor_B, radius_m, false).ok()
    }

    #[inline(always)]
    pub(super) fn nowhere(anchor_B: &Vector3<f64>) -> Self {
        Self { anchor_B: *anchor_B, radius_m: 0.0, patches: [0; MAX_NEAR], count: 0, table: NOTHING }
    }

    #[inline]
    pub(super) fn holds(&self, point_B: &Vector3<f64>, reach_m: f64) -> bool {
        (point_B - self.anchor_B).norm() + reach_m <= self.radius_m
    }

    /// Adds a patch, if there is room.
    #[inline(always)]
    pub(super) fn list(&mut self, number: u16, height_m: f64, crowd: &mut Crowd) -> Option<usize> {
        let place = self.count;
        if place == MAX_NEAR {
            crowd.overflow(&self.patches, number, height_m);
            return None;
        }
        self.patches[place] = number;
        crowd.listed(place, height_m);
        self.count += 1;
        Some(place)
    }

    /// How far a point may go without leaving it (m).
    pub(super) fn room_m(&self, point_B: &Vector3<f64>) -> f64 {
        (self.radius_m - (point_B - self.anchor_B).norm()) * (1.0 - 1e-9)
    }

    /// How many patches it lists.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub(super) fn patch<'c>(&self, csg: &'c Csg, index: usize) -> &'c Patch {
        &csg.patches[usize::from(self.patches[index])]
    }

    /// A patch's number in the solid.
    pub(super) fn number(&self, index: usize) -> u16 {
        self.patches[index]
    }

    /// Where a patch is listed.
    pub(super) fn position(&self, number: u16) -> Option<usize> {
        self.patches[..self.count].iter().position(|&patch| patch == number)
    }

    /// Whether these sides are inside the solid.
    #[inline(always)]
    pub(super) fn is_solid(&self, sides: Sides) -> bool {
        is_set(&self.table, sides)
    }

    /// Nothing in it but free space.
    pub(super) fn is_empty(&self) -> bool {
        self.table == NOTHING
    }

    /// Of the listed patches, at a point.
    #[inline(always)]
    pub(super) fn levels_m(&self, csg: &Csg, point_B: &Vector3<f64>) -> [f64; MAX_NEAR] {
        let mut levels_m = [f64::INFINITY; MAX_NEAR];
        for (index, level_m) in levels_m.iter_mut().enumerate().take(self.count) {
            *level_m = self.patch(csg, index).level(point_B);
        }
        levels_m
    }

    /// The sides of a point.
    #[inline(always)]
    pub(super) fn sides(&self, csg: &Csg, point_B: &Vector3<f64>) -> Sides {
        (0..self.count).fold(0, |sides, index| {
            sides | usize::from(self.patch(csg, index).level(point_B) <= 0.0) << index
        })
    }
}

/// Bound on the sizes that are tried: from a metre to the smallest in quarters takes fewer.
const MAX_TRIES: u32 = 16;
/// No neighbourhood is smaller, in terms of the solid's extent.
const SMALLEST: f64 = 1e-8;
/// How much larger the next ball is that is tried.
const GROWTH: f64 = 2.0;
/// With more patches than this in a cell a neighbourhood would probably be too crowded.
const CROWD: u32 = 16;
/// So that the ninth nearest is outside.
const JUST_BELOW: f64 = 1.0 - 1e-9;

#[cfg(test)]
mod tests {
    use super::super::{CsgPart, CsgTree};
    use super::*;
    use crate::cuboid::Cuboid;
    use crate::plane::Plane;
    use crate::sphere::Sphere;

    /// A block of bricks with a ball taken out of its middle.
    fn bricks() -> Csg {
        let brick = Cuboid::new([0.02; 3]).unwrap();
        let grid = (0..27).map(|i| {
            let place = Vector3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) * 0.02;
            CsgPart::at(brick, place - Vector3::repeat(0.02))
        });
        let block = CsgTree::union(grid);
        Csg::build(&CsgTree::difference([CsgPart::from(block), Sphere::new(0.025).unwrap().into()])).unwrap()
    }

    #[test]
    fn bricks_side_by_side_share_their_planes() {
        // Four planes for each axis, and the ball.
        assert_eq!(bricks().patch_count(), 13);
    }

    #[test]
    fn within_a_neighbourhood_the_table_says_what_the_tree_says() {
        let csg = bricks();
        let spread = |i: u32, step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        let point = |i: u32| Vector3::new(spread(i, 0.618_034), spread(i, 0.414_214), spread(i, 0.732_051));
        for i in 0..2000 {
            let near = Neighbourhood::around(&csg, &(point(i) * 0.035), 0.004);
            assert!(near.count() <= MAX_NEAR);
            for j in 0..20 {
                let p = near.anchor_B + point(7 * i + j) * (near.radius_m / 3f64.sqrt());
                assert_eq!(near.is_solid(near.sides(&csg, &p)), csg.is_inside(&p), "{p:?} {near:?}");
            }
        }
    }

    #[test]
    fn where_more_than_eight_patches_meet_the_ball_is_as_small_as_it_can_be() {
        let flank = |i: u32| {
            let angle = f64::from(i) * 0.5;
            CsgPart::from(Plane::new(Vector3::new(angle.cos(), 1.0, angle.sin()), 0.0).unwrap())
        };
        let pyramid = Csg::build(&CsgTree::intersection((0..12).map(flank))).unwrap();
        let beside = Neighbourhood::around(&pyramid, &Vector3::new(0.01, -0.02, 0.0), 0.1);
        assert!(beside.count() == MAX_NEAR && beside.radius_m > 1e-3, "{beside:?}");
        let at_tip = Neighbourhood::around(&pyramid, &Vector3::zeros(), 0.1);
        assert_eq!((at_tip.count(), at_tip.radius_m), (MAX_NEAR, SMALLEST * pyramid.extent_m));
    }

    #[test]
    fn what_is_not_a_number_has_a_neighbourhood_too() {
        for bad in [f64::NAN, f64::INFINITY, f64::MAX] {
            let near = Neighbourhood::around(&bricks(), &Vector3::repeat(bad), bad);
            assert!(near.count() <= MAX_NEAR);
        }
    }
}
