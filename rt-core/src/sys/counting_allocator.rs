//! The system's allocator with a count of calls for each thread.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Const-initialised and without destructor, so touching it neither allocates nor registers
    /// anything: else the allocator would call itself.
    static CALLS: Cell<HeapCalls> = const { Cell::new(HeapCalls { allocations: 0, releases: 0 }) };
}

/// How often a thread called the allocator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeapCalls {
    /// Allocations and reallocations.
    pub allocations: u64,
    /// Deallocations.
    pub releases: u64,
}

/// Counts since the thread began.
pub(crate) fn calls_of_this_thread() -> HeapCalls {
    CALLS.with(Cell::get)
}

fn count(allocations: u64, releases: u64) {
    // `try_with`: the allocator is called until the very end of a thread.
    let _ = CALLS.try_with(|calls| {
        let before = calls.get();
        calls.set(HeapCalls {
            allocations: before.allocations.wrapping_add(allocations),
            releases: before.releases.wrapping_add(releases),
        });
    });
}

/// [`System`], counting the calls of each thread. For test and bench programs:
///
/// ```
/// use rt_core::alloc_guard::{self, CountingAllocator};
///
/// #[global_allocator]
/// static ALLOCATOR: CountingAllocator = CountingAllocator;
///
/// let (sum, heap_calls) = alloc_guard::count(|| (1..=10).sum::<u32>());
/// assert_eq!((sum, heap_calls), (55, 0));
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingAllocator;

// SAFETY: every method hands its arguments unchanged to `System`, which keeps the contract; the
// counting touches neither the memory nor the layout and does not unwind.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(1, 0);
        // SAFETY: the caller keeps `GlobalAlloc::alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(1, 0);
        // SAFETY: the caller keeps `GlobalAlloc::alloc_zeroed`'s contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(1, 0);
        // SAFETY: the caller keeps `GlobalAlloc::realloc`'s contract; `block` came from `System`.
        unsafe { System.realloc(block, layout, new_size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(0, 1);
        // SAFETY: the caller keeps `GlobalAlloc::dealloc`'s contract; `block` came from `System`.
        unsafe { System.dealloc(block, layout) };
    }
}
