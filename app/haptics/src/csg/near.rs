//! What of a solid matters near a point: a few patches, and the tree as a table over their sides.
//!
//! Model: within a ball around an anchor, all patches whose level there exceeds the ball's radius keep their side. The
//! others, at most eight, make up to 256 combinations of sides; for each the tree is evaluated once, all of them at once:
//! a leaf is a bit pattern of 256 bits, and union, intersection and difference are single operations on them. With
//! the table in hand the solid is `table[sides]`, whatever the tree was.
//!
//! Invariants: a patch that is not listed keeps its side within the ball. If more than eight are near, the ball is as
//! small as it must be for eight, but not smaller than [`SMALLEST`].
//! Cost: a level per patch of the [cell](super::cells) there; seldom twice.

use nalgebra::Vector3;

use super::cells::{CellStep, Part};
use super::patch::Patch;
use super::{Csg, CsgOp, Item, STACK};

/// The patches near an anchor, and the solid in terms of their sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbourhood {
    pub(super) anchor_B: Vector3<f64>,
    /// Within which it is true (m).
    pub(super) radius_m: f64,
    /// The patches, by their numbers in the solid.
    patches: [u16; MAX_NEAR],
    count: usize,
    table: Table,
}

/// A bit for each combination of sides: whether that is inside the solid.
type Table = [u64; 4];

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

    fn nowhere(anchor_B: &Vector3<f64>) -> Self {
        Self { anchor_B: *anchor_B, radius_m: 0.0, patches: [0; MAX_NEAR], count: 0, table: NOTHING }
    }

    #[inline]
    pub(super) fn holds(&self, point_B: &Vector3<f64>, reach_m: f64) -> bool {
        (point_B - self.anchor_B).norm() + reach_m <= self.radius_m
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
        self.table[(sides >> 6) & 3] >> (sides & 63) & 1 == 1
    }

    /// Nothing in it but free space.
    pub(super) fn is_empty(&self) -> bool {
        self.table == [0; 4]
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

/// The patches within a radius, or from which distance on there would be too many.
fn gather(csg: &Csg, anchor_B: &Vector3<f64>, radius_m: f64, keep_eight: bool) -> Result<Neighbourhood, f64> {
    gather_from(csg, &csg.cells.part(anchor_B, radius_m, u32::MAX), anchor_B, radius_m, keep_eight)
}

fn gather_from(
    csg: &Csg,
    part: &Part<'_>,
    anchor_B: &Vector3<f64>,
    radius_m: f64,
    keep_eight: bool,
) -> Result<Neighbourhood, f64> {
    let mut here = Neighbourhood { radius_m, ..Neighbourhood::nowhere(anchor_B) };
    let mut crowd = Crowd::default();
    let leaf = |first, count| leaf(csg, &mut here, &mut crowd, part.items(first, count), keep_eight);
    // A stack is as deep as there are leaves, at the most; most parts have few.
    let table = if part.steps.len() < 2 * FEW {
        evaluated::<FEW>(part.steps, leaf)
    } else {
        evaluated::<STACK>(part.steps, leaf)
    };
    if crowd.is_too_large && !keep_eight {
        return Err(crowd.ninth_m());
    }
    here.table = table;
    Ok(here)
}

/// For every combination of sides whether that is inside, from what is inside the leaves.
#[inline(always)]
fn evaluated<const DEPTH: usize>(steps: &[CellStep], mut leaf: impl FnMut(u32, u32) -> Table) -> Table {
    let mut stack = [NOTHING; DEPTH];
    let mut top = 0;
    for step in steps {
        match *step {
            CellStep::Leaf { first, count } => {
                stack[top] = leaf(first, count);
                top += 1;
            }
            CellStep::Join(op) => {
                let (a, b) = (stack[top - 2], stack[top - 1]);
                stack[top - 2] = match op {
                    CsgOp::Union => std::array::from_fn(|i| a[i] | b[i]),
                    CsgOp::Intersection => std::array::from_fn(|i| a[i] & b[i]),
                    CsgOp::Difference => std::array::from_fn(|i| a[i] & !b[i]),
                };
                top -= 1;
            }
        }
    }
    stack[0]
}

/// Whether a leaf is inside, for every combination of sides.
fn leaf(csg: &Csg, here: &mut Neighbourhood, crowd: &mut Crowd, items: &[Item], keep_eight: bool) -> Table {
    let mut heights_m = [f64::INFINITY; MAX_ITEMS];
    for (item, height_m) in items.iter().zip(&mut heights_m) {
        let level = csg.patches[usize::from(item.patch)].level(&here.anchor_B);
        let is_inside = (level <= 0.0) != item.is_flipped;
        *height_m = level.abs();
        if *height_m > here.radius_m && !is_inside {
            // Whatever the other patches say: they need no place in the list.
            return NOTHING;
        }
    }
    let mut inside = EVERYTHING;
    for (item, &height_m) in items.iter().zip(&heights_m) {
        if height_m > here.radius_m {
            continue;
        }
        let listed = match here.position(item.patch) {
            Some(index) => Some(index),
            None => here.list(item.patch, height_m, crowd),
        };
        let Some(index) = listed else {
            // Nowhere to list it. If it cannot be helped, the leaf is as if it went on there.
            debug_assert!(keep_eight || crowd.is_too_large);
            if !keep_eight {
                // It will have to be smaller: whatever is farther need not be looked at any more.
                here.radius_m = here.radius_m.min(crowd.ninth_m());
            }
            continue;
        };
        let sides = SIDES[index];
        inside = std::array::from_fn(|i| inside[i] & if item.is_flipped { !sides[i] } else { sides[i] });
    }
    inside
}

impl Neighbourhood {
    fn list(&mut self, number: u16, height_m: f64, crowd: &mut Crowd) -> Option<usize> {
        if self.count == MAX_NEAR {
            crowd.overflow(&self.patches, number, height_m);
            return None;
        }
        self.patches[self.count] = number;
        crowd.heights_m[self.count] = height_m;
        self.count += 1;
        Some(self.count - 1)
    }
}

/// The nearest nine, if there are as many: the ninth decides how large a neighbourhood can be.
struct Crowd {
    /// Of those that are listed.
    heights_m: [f64; MAX_NEAR],
    nearest: [(f64, u16); MAX_NEAR + 1],
    is_too_large: bool,
}

impl Default for Crowd {
    fn default() -> Self {
        let nearest = [(f64::INFINITY, u16::MAX); MAX_NEAR + 1];
        Self { heights_m: [f64::INFINITY; MAX_NEAR], nearest, is_too_large: false }
    }
}

impl Crowd {
    /// Takes note of one more than can be listed.
    fn overflow(&mut self, listed: &[u16; MAX_NEAR], number: u16, height_m: f64) {
        if !self.is_too_large {
            self.is_too_large = true;
            for (index, &number) in listed.iter().enumerate() {
                self.add(number, self.heights_m[index]);
            }
        }
        self.add(number, height_m);
    }

    /// Patches beyond the eighth are not listed, and may come twice.
    fn add(&mut self, number: u16, height_m: f64) {
        if self.nearest.iter().any(|&(_, known)| known == number) {
            return;
        }
        let mut newcomer = (height_m, number);
        for place in &mut self.nearest {
            if newcomer.0 < place.0 {
                std::mem::swap(place, &mut newcomer);
            }
        }
    }

    fn ninth_m(&self) -> f64 {
        self.nearest[MAX_NEAR].0
    }
}

/// The most patches of a leaf: a box has as many.
const MAX_ITEMS: usize = 6;
/// Leaves of a common part.
const FEW: usize = 6;
const NOTHING: Table = [0; 4];
const EVERYTHING: Table = [u64::MAX; 4];
/// For each patch, the combinations in which one is inside of it.
const SIDES: [Table; MAX_NEAR] = [
    [0xAAAA_AAAA_AAAA_AAAA; 4],
    [0xCCCC_CCCC_CCCC_CCCC; 4],
    [0xF0F0_F0F0_F0F0_F0F0; 4],
    [0xFF00_FF00_FF00_FF00; 4],
    [0xFFFF_0000_FFFF_0000; 4],
    [0xFFFF_FFFF_0000_0000; 4],
    [0, u64::MAX, 0, u64::MAX],
    [0, 0, u64::MAX, u64::MAX],
];
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
