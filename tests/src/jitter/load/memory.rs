//! Copies through memory: caches are emptied, the memory bus is busy.

use std::hint::black_box;

/// Touched in turn; above the last-level cache of most machines.
pub(super) const BYTES: usize = 64 << 20;

pub(super) fn work() -> std::io::Error {
    let mut memory = vec![1_u8; BYTES];
    let (from, to) = memory.split_at_mut(BYTES / 2);
    loop {
        to.copy_from_slice(black_box(from));
        from.copy_from_slice(black_box(to));
    }
}
