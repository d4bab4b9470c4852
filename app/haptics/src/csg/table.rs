//! A tree as a table: for each combination of sides of a few patches, whether that is inside the solid.
//!
//! Model: the tree is evaluated for all combinations at once: a leaf is a bit pattern of 256 bits, and union, intersection
//! and difference are single operations on them.

use super::cells::CellStep;
use super::near::{MAX_NEAR, Sides};
use super::{CsgOp, STACK};

/// A bit for each combination of sides.
pub(super) type Table = [u64; 4];

#[inline(always)]
pub(super) fn is_set(table: &Table, sides: Sides) -> bool {
    table[(sides >> 6) & 3] >> (sides & 63) & 1 == 1
}

/// Where a tree is inside, from where its leaves are.
#[inline(always)]
pub(super) fn evaluate(steps: &[CellStep], leaf: impl FnMut(u32, u32) -> Table) -> Table {
    // A stack is as deep as there are leaves, at the most; most parts have few.
    if steps.len() < 2 * FEW { evaluate_on::<FEW>(steps, leaf) } else { evaluate_on::<STACK>(steps, leaf) }
}

#[inline(always)]
fn evaluate_on<const DEPTH: usize>(steps: &[CellStep], mut leaf: impl FnMut(u32, u32) -> Table) -> Table {
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

/// Of what is inside, that on one side of a patch.
#[inline(always)]
pub(super) fn cut(inside: &Table, patch: usize, is_flipped: bool) -> Table {
    let flip = if is_flipped { u64::MAX } else { 0 };
    std::array::from_fn(|i| inside[i] & (SIDES[patch][i] ^ flip))
}

/// Leaves of a common part.
const FEW: usize = 6;
pub(super) const NOTHING: Table = [0; 4];
pub(super) const EVERYTHING: Table = [u64::MAX; 4];
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
