//! How late sleeps end on this machine, and how long a loop therefore has to spin.
//!
//! Problem: a spin margin that is too short lets late sleeps through to the deadline, one that is too long
//! takes the CPU from everybody else; which is which differs by an order of magnitude between machines.
//! Model: some hundred absolute sleeps on the loop's own thread, set up as it will run, over the phases of the
//! kernel's tick; the margin is twice the lateness that one sleep in a hundred exceeds, and a little.
//! Measured here on a virtual machine: 50 us late at p99; margins of 30 to 50 us left p99 wake errors of
//! 0.7 to 1 us, 100 to 200 us left 0.05.
//! Cost: the time of the sleeps. Before the loop.

use crate::clock::{monotonic_ns, sleep_until_ns};
use crate::histogram::Histogram;

/// Below this a margin saves nothing (ns).
pub const SHORTEST_MARGIN_NS: u64 = 50_000;
/// What the code between a sleep's end and the spin's first look at the clock may take (ns).
const ALLOWANCE_NS: u64 = 20_000;
/// Not a divisor of the kernel's tick, so that the sleeps end at many phases of it (ns).
const INTERVAL_NS: u64 = 730_000;

/// Sleeps that are enough for a p99; some 200 ms.
pub const SLEEPS: usize = 300;

/// How late so many sleeps of the calling thread end. One that a signal cuts short is not counted.
#[must_use]
pub fn sleep_lateness(sleeps: usize) -> Histogram {
    let mut lateness = Histogram::new();
    let mut until = monotonic_ns();
    for _ in 0..sleeps {
        until = monotonic_ns().max(until) + INTERVAL_NS;
        if sleep_until_ns(until) {
            lateness.record(monotonic_ns().saturating_sub(until));
        }
    }
    lateness
}

/// The spin margin (ns) for such a lateness, at most `at_most_ns`.
#[must_use]
pub fn spin_margin_ns(lateness: &Histogram, at_most_ns: u64) -> u64 {
    let wanted = wanted_margin_ns(lateness);
    wanted.max(SHORTEST_MARGIN_NS).min(at_most_ns)
}

/// The margin that would hide all but one late sleep in some hundreds (ns).
#[must_use]
pub fn wanted_margin_ns(lateness: &Histogram) -> u64 {
    lateness.percentile(0.99).map_or(u64::MAX, |p99| 2 * p99 + ALLOWANCE_NS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lateness(ns: &[u64]) -> Histogram {
        let mut histogram = Histogram::new();
        ns.iter().for_each(|ns| histogram.record(*ns));
        histogram
    }

    #[test]
    fn the_margin_is_twice_the_lateness_and_a_little() {
        let usual: Vec<u64> = (0..100).map(|i| i * 500).collect();
        let margin = spin_margin_ns(&lateness(&usual), 200_000);
        // The histogram's buckets are 3 % wide.
        assert!((margin as f64 / 119_000.0 - 1.0).abs() < 0.04, "{margin}");
    }

    #[test]
    fn a_quick_machine_gets_the_shortest_and_a_slow_one_the_longest_margin() {
        assert_eq!(spin_margin_ns(&lateness(&[1000; 100]), 200_000), SHORTEST_MARGIN_NS);
        assert_eq!(spin_margin_ns(&lateness(&[5_000_000; 100]), 200_000), 200_000);
        assert_eq!(spin_margin_ns(&lateness(&[1000; 100]), 10_000), 10_000, "the bound goes before");
    }

    #[test]
    fn nothing_measured_gives_the_longest_margin() {
        assert_eq!(spin_margin_ns(&lateness(&[]), 150_000), 150_000);
    }

    #[test]
    fn one_stall_among_hundreds_of_sleeps_does_not_decide() {
        let mut ns = vec![10_000; 299];
        ns.push(30_000_000);
        assert_eq!(spin_margin_ns(&lateness(&ns), 200_000), SHORTEST_MARGIN_NS);
    }

    #[test]
    fn sleeps_are_measured_and_never_end_early() {
        let lateness = sleep_lateness(20);
        assert_eq!(lateness.count(), 20);
        assert!(lateness.max() > 0);
    }
}
