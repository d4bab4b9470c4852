//! Memory that a set of patches may take, counted before it is asked for.
//!
//! Problem: a patch of degree 7 with knots that are all different has 64 control points for each of its own, and falls
//! into a thousand cells where it bends: a small file could fill the memory.

use super::bezier::Control;
use super::error::NurbsError;
use super::patch::NurbsPatch;

/// What may still be taken (bytes).
#[derive(Debug)]
pub(super) struct Budget {
    left_bytes: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { left_bytes: MOST_BYTES }
    }
}

impl Budget {
    /// Takes so much of it.
    pub(super) fn spend(&mut self, bytes: usize) -> Result<(), NurbsError> {
        let left = self.left_bytes.checked_sub(bytes);
        self.left_bytes = left.ok_or(NurbsError::TooLarge { most_bytes: MOST_BYTES })?;
        Ok(())
    }
}

/// Refuses patches, each of them sound, whose polynomials would take too much.
pub(super) fn check(patches: &[NurbsPatch]) -> Result<(), NurbsError> {
    let mut budget = Budget::default();
    for patch in patches {
        let spans = [0, 1].map(|d| {
            let knots = &patch.knots[d][patch.degree[d]..];
            knots.windows(2).filter(|pair| pair[0] < pair[1]).count()
        });
        let of_one: usize = patch.degree.iter().map(|degree| degree + 1).product();
        // Once as they are cut, once as they are kept.
        let bytes = [spans[0], spans[1], of_one, 2 * size_of::<Control>()];
        budget.spend(bytes.into_iter().fold(1, usize::saturating_mul))?;
    }
    Ok(())
}

/// Leaves the rest of 256 MB to everything else.
const MOST_BYTES: usize = 160 << 20;
