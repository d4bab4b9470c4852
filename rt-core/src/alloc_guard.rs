//! Shows that a piece of code leaves the heap alone.
//!
//! Problem: one forgotten `push` in a tick takes a lock, or asks the kernel for pages, once in a
//! million ticks; a test must see it the first time.
//! Model: a test program installs [`CountingAllocator`]; [`count`] says how often the *calling
//! thread* went to the heap inside a closure. Other threads do not disturb the count.
//! Invariants: counting itself never allocates; nested counts are right, since they subtract two
//! readings of one running number.
//! Cost: two thread-local additions a heap call. Not meant for production binaries.

pub use crate::sys::counting_allocator::{CountingAllocator, HeapCalls};

use crate::sys::counting_allocator::calls_of_this_thread;
use std::hint::black_box;

/// Runs `f` and says how often it called the heap: allocations, reallocations and deallocations,
/// since a real-time step may do none of them.
///
/// Always zero unless the program installed [`CountingAllocator`]: call [`assert_installed`] first.
pub fn count<R>(f: impl FnOnce() -> R) -> (R, u64) {
    let (result, calls) = count_calls(f);
    (result, calls.allocations + calls.releases)
}

/// As [`count`], telling allocations from releases.
pub fn count_calls<R>(f: impl FnOnce() -> R) -> (R, HeapCalls) {
    let before = calls_of_this_thread();
    let result = f();
    let after = calls_of_this_thread();
    let calls = HeapCalls {
        allocations: after.allocations.wrapping_sub(before.allocations),
        releases: after.releases.wrapping_sub(before.releases),
    };
    (result, calls)
}

/// Fails unless a deliberate allocation is counted, so that "no allocation" is never vacuous.
///
/// # Panics
/// If the program has no [`CountingAllocator`] as its global allocator.
pub fn assert_installed() {
    let ((), calls) = count_calls(|| drop(black_box(Box::new(black_box(1_u64)))));
    assert_eq!(
        calls,
        HeapCalls { allocations: 1, releases: 1 },
        "this program lacks `#[global_allocator] static A: CountingAllocator = CountingAllocator;`"
    );
}
