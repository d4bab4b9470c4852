//! Moves a loop's deadlines away from what happens at the same phase.
//!
//! Problem: whatever interrupts a CPU every millisecond (the kernel's tick, and under a hypervisor the host's,
//! whose clock drifts against ours) costs a loop at 1 kHz either nothing or 20 us in *every* tick, depending
//! only on the phase between the two; and one that was right at the start may be wrong a minute later.
//! Model: in a window of ticks, if more than a quarter of the spins that should have ended on the deadline ended
//! late, the deadlines move on by 0.382 of a period (steps of the golden section come near every phase soon, and
//! never return to one). If that does not help, the trouble is not a matter of phase: the window doubles with
//! each move, and shrinks again in quiet times.
//! Invariants: no more than one move in a window of at least 256 ticks.
//! Cost: a comparison a tick.

/// Decides when to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhaseKeeper {
    window: u32,
    ticks: u32,
    disturbed: u32,
}

/// A spin that ends so late was interrupted (ns); by itself it ends within 0.1 us.
pub const DISTURBED_NS: u64 = 3_000;

const SHORTEST_WINDOW: u32 = 256;
const LONGEST_WINDOW: u32 = 1 << 16;

impl Default for PhaseKeeper {
    fn default() -> Self {
        Self { window: SHORTEST_WINDOW, ticks: 0, disturbed: 0 }
    }
}

impl PhaseKeeper {
    /// A spin has ended, disturbed or not. Returns whether the deadlines should move now.
    pub fn learn(&mut self, was_disturbed: bool) -> bool {
        self.ticks += 1;
        self.disturbed += u32::from(was_disturbed);
        if self.ticks < self.window {
            return false;
        }
        let moves = self.disturbed > self.window / 4;
        let window = if moves { self.window * 2 } else { self.window / 2 };
        *self = Self { window: window.clamp(SHORTEST_WINDOW, LONGEST_WINDOW), ticks: 0, disturbed: 0 };
        moves
    }
}

/// By how much a move goes on (ns).
#[must_use]
pub fn step_ns(period_ns: u64) -> u64 {
    (period_ns as f64 * 0.381_966) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    /// Runs ticks of a loop at a phase among interrupts 30 us long; returns the moves and how many were disturbed.
    fn run(ticks: u32, mut interrupt_at: impl FnMut(u32) -> Option<u64>) -> (u32, u32) {
        let (mut keeper, mut phase, mut moves, mut disturbed) = (PhaseKeeper::default(), 370_000, 0, 0);
        for tick in 0..ticks {
            let hit = interrupt_at(tick).is_some_and(|at| (phase + PERIOD_NS - at) % PERIOD_NS < 30_000);
            disturbed += u32::from(hit);
            if keeper.learn(hit) {
                phase = (phase + step_ns(PERIOD_NS)) % PERIOD_NS;
                moves += 1;
            }
        }
        (moves, disturbed)
    }

    #[test]
    fn a_loop_that_coincides_with_something_moves_once_and_is_free_of_it() {
        assert_eq!(run(10_000, |_| Some(350_000)), (1, 256));
    }

    #[test]
    fn what_drifts_across_is_stepped_aside_from() {
        // A host's tick that drifts by 1 us in a second; ten minutes, in which it crosses the phase once.
        let (moves, disturbed) = run(600_000, |tick| Some((100_000 + u64::from(tick) / 1000) % PERIOD_NS));
        assert!(moves <= 2, "{moves}");
        assert!(disturbed <= 512, "instead of 30,000: {disturbed}");
    }

    #[test]
    fn a_loop_at_peace_never_moves_nor_does_one_that_stalls_now_and_then() {
        assert_eq!(run(100_000, |_| None), (0, 0));
        assert_eq!(run(100_000, |tick| (tick % 10 == 0).then_some(350_000)).0, 0);
    }

    #[test]
    fn trouble_at_every_phase_does_not_keep_it_moving() {
        let mut keeper = PhaseKeeper::default();
        let moves = (0..1_000_000).filter(|_| keeper.learn(true)).count();
        // Windows of 256, 512, ... 65,536 and then one in 65,536.
        assert!(moves <= 24, "{moves}");
    }
}
