//! The one clock of all loops: `CLOCK_MONOTONIC` in nanoseconds.
//!
//! Problem: a wall clock jumps, a relative sleep drifts by the time between reading and sleeping.
//! Model: unsigned nanoseconds since boot (584 years fit), absolute deadlines on that clock. All
//! processes of a machine share it, so time stamps may cross process borders.
//! Invariant: never runs backwards.
//! Cost: reading takes some 25 ns and no system call; sleeping is one system call. Neither
//! allocates. Fit for the loop.

use nix::errno::Errno;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};

const NS_PER_S: u64 = 1_000_000_000;

/// The monotonic clock now, in nanoseconds.
pub fn monotonic_ns() -> u64 {
    // Fails only for an unknown clock or a bad pointer, and both are constants here.
    let now = clock_gettime(ClockId::CLOCK_MONOTONIC).unwrap_or_else(|_| TimeSpec::new(0, 0));
    now.tv_sec() as u64 * NS_PER_S + now.tv_nsec() as u64
}

/// Sleeps until the monotonic clock reaches `deadline_ns`; returns at once if it has.
///
/// False if a signal handler ran meanwhile: the deadline may lie ahead, and the caller should look
/// whether it was asked to stop. True is never early.
pub fn sleep_until_ns(deadline_ns: u64) -> bool {
    let deadline = TimeSpec::new((deadline_ns / NS_PER_S) as i64, (deadline_ns % NS_PER_S) as i64);
    let slept = clock_nanosleep(ClockId::CLOCK_MONOTONIC, ClockNanosleepFlags::TIMER_ABSTIME, &deadline);
    slept != Err(Errno::EINTR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_does_not_run_backwards() {
        let mut before = monotonic_ns();
        assert_ne!(before, 0);
        for _ in 0..10_000 {
            let now = monotonic_ns();
            assert!(now >= before);
            before = now;
        }
    }

    #[test]
    fn a_completed_sleep_is_never_early() {
        // Crosses a second's border in both fields of the deadline sooner or later, and asks for
        // less than a tick of the kernel too.
        for ns in [0, 1, 1_000, 1_500_000, 20_000_000] {
            let deadline = monotonic_ns() + ns;
            if sleep_until_ns(deadline) {
                assert!(monotonic_ns() >= deadline);
            }
        }
    }

    #[test]
    fn a_deadline_in_the_past_returns_without_waiting_for_the_next_wrap() {
        assert!(sleep_until_ns(0));
        assert!(sleep_until_ns(monotonic_ns() - 1));
    }
}
