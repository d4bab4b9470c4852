//! What a loop suffered: page faults and context switches.
//!
//! Problem: "memory is locked" and "the CPU is ours" are claims; the kernel's counters are evidence.
//! Model: getrusage(2) before and after, and the difference.
//! Invariant: counters only grow.
//! Cost: one system call below a microsecond, no allocation. Fit for the loop, though once a second
//! is enough.

use nix::sys::resource::{UsageWho, getrusage};

/// Counters since the thread or process began, or between two readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResourceUsage {
    /// Pages mapped in without I/O: memory that was not touched, or not kept, beforehand.
    pub minor_faults: u64,
    /// Pages read from a disk: milliseconds each.
    pub major_faults: u64,
    /// Times it waited: about one a tick for a loop that sleeps.
    pub voluntary_switches: u64,
    /// Times it was preempted: zero on a CPU of its own.
    pub involuntary_switches: u64,
}

impl ResourceUsage {
    /// Counters of the calling thread.
    #[must_use]
    pub fn of_thread() -> Self {
        Self::read(UsageWho::RUSAGE_THREAD)
    }

    /// Counters of the whole process, ended threads included.
    #[must_use]
    pub fn of_process() -> Self {
        Self::read(UsageWho::RUSAGE_SELF)
    }

    /// What was added since `earlier`, which must be of the same thread or process; never below 0.
    #[must_use]
    pub fn delta(&self, earlier: &Self) -> Self {
        Self {
            minor_faults: self.minor_faults.saturating_sub(earlier.minor_faults),
            major_faults: self.major_faults.saturating_sub(earlier.major_faults),
            voluntary_switches: self.voluntary_switches.saturating_sub(earlier.voluntary_switches),
            involuntary_switches: self.involuntary_switches.saturating_sub(earlier.involuntary_switches),
        }
    }

    fn read(who: UsageWho) -> Self {
        // getrusage(2) fails only for an unknown `who` or a bad pointer.
        let Ok(usage) = getrusage(who) else { return Self::default() };
        Self {
            minor_faults: usage.minor_page_faults().unsigned_abs(),
            major_faults: usage.major_page_faults().unsigned_abs(),
            voluntary_switches: usage.voluntary_context_switches().unsigned_abs(),
            involuntary_switches: usage.involuntary_context_switches().unsigned_abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;
    use std::hint::black_box;
    use std::time::Duration;

    #[test]
    fn sleeping_is_a_voluntary_switch_of_this_thread() {
        let before = ResourceUsage::of_thread();
        for _ in 0..5 {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(ResourceUsage::of_thread().delta(&before).voluntary_switches >= 5);
    }

    #[test]
    fn touching_fresh_memory_is_a_minor_fault_of_thread_and_process() {
        let (thread, process) = (ResourceUsage::of_thread(), ResourceUsage::of_process());
        // 64 MiB come fresh from the kernel; even in huge pages of 2 MiB that is 32 faults.
        drop(black_box(vec![1_u8; 64 << 20]));
        assert!(ResourceUsage::of_thread().delta(&thread).minor_faults >= 32);
        assert!(ResourceUsage::of_process().delta(&process).minor_faults >= 32);
    }

    #[test]
    fn another_threads_faults_are_not_this_ones() {
        let before = ResourceUsage::of_thread();
        let theirs = std::thread::spawn(|| {
            let before = ResourceUsage::of_thread();
            drop(black_box(vec![1_u8; 64 << 20]));
            ResourceUsage::of_thread().delta(&before).minor_faults
        });
        let theirs = theirs.bounded_join().unwrap();
        // Starting a thread costs this one a few faults, far fewer than theirs.
        assert!(ResourceUsage::of_thread().delta(&before).minor_faults < theirs);
    }

    #[test]
    fn a_delta_never_goes_below_zero() {
        let later = ResourceUsage { minor_faults: 5, ..ResourceUsage::default() };
        let earlier = ResourceUsage { minor_faults: 2, major_faults: 1, ..ResourceUsage::default() };
        assert_eq!(later.delta(&earlier), ResourceUsage { minor_faults: 3, ..ResourceUsage::default() });
    }
}
