//! How long before a deadline a loop stops sleeping, and that it learns.
//!
//! Problem: how late sleeps end is measured before the loop begins, when the machine may have been busy and its
//! CPUs awake; later they sleep, and waking them takes longer.
//! Model: if in a window of ticks several sleeps ended after the deadline they were to lead up to, the margin grows
//! by a half, up to a bound. One alone is a stall, which no margin would have hidden. It never shrinks: what
//! has been late once may be late again.
//! Cost: a comparison a tick; no system call.

/// A margin with its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpinMargin {
    ns: u64,
    at_most_ns: u64,
    ticks: u32,
    late: u32,
}

/// Ticks of a window.
const WINDOW: u32 = 128;
/// So many late sleeps in a window are no accident; three in a hundred are.
const TOO_MANY: u32 = 4;

impl SpinMargin {
    /// One that stays what it is.
    #[must_use]
    pub fn fixed(ns: u64) -> Self {
        Self::growing(ns, ns)
    }

    /// One that begins with `ns` and grows as far as `at_most_ns` where it has to.
    #[must_use]
    pub fn growing(ns: u64, at_most_ns: u64) -> Self {
        Self { ns, at_most_ns: at_most_ns.max(ns), ticks: 0, late: 0 }
    }

    /// What it is now (ns).
    #[must_use]
    pub fn ns(&self) -> u64 {
        self.ns
    }

    /// A sleep has ended, before or after the deadline.
    pub fn learn(&mut self, was_late: bool) {
        self.ticks += 1;
        self.late += u32::from(was_late);
        if self.late >= TOO_MANY {
            self.ns = (self.ns + self.ns / 2).min(self.at_most_ns);
            (self.ticks, self.late) = (0, 0);
        } else if self.ticks >= WINDOW {
            (self.ticks, self.late) = (0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_grows_until_sleeps_end_in_time() {
        let mut margin = SpinMargin::growing(40_000, 200_000);
        for tick in 0..10_000u32 {
            // Every fourth sleep ends 90 us late.
            margin.learn(tick % 4 == 0 && margin.ns() < 90_000);
        }
        assert_eq!(margin.ns(), 90_000);
    }

    #[test]
    fn a_stall_now_and_then_changes_nothing_and_many_stop_at_the_bound() {
        let mut margin = SpinMargin::growing(40_000, 200_000);
        for tick in 0..100_000u32 {
            margin.learn(tick % 100 == 0);
        }
        assert_eq!(margin.ns(), 40_000);
        for _ in 0..1000 {
            margin.learn(true);
        }
        assert_eq!(margin.ns(), 200_000);
    }

    #[test]
    fn a_fixed_margin_stays() {
        let mut margin = SpinMargin::fixed(0);
        (0..1000).for_each(|_| margin.learn(true));
        assert_eq!(margin.ns(), 0);
    }
}
