//! Requests to the loop for which there is always room: emergency stop, leaving a fault, the end of a lease.
//!
//! Model: one atomic word holds whether an emergency stop and whether leaving the fault are asked for, who made
//! the emergency stop that stands, and a count of faults and stops, so that who compares the word and swaps it sees one
//! that came meanwhile; another one holds the number of the last lease that has ended. To ask twice is to ask once, so
//! nothing can be full and nobody waits.
//! Invariants: a request to leave a fault never undoes a fault or an emergency stop that came after it, however late it
//! is heard, nor a stop that the loop has not seen yet; the emergency stop of somebody stays his until it is left.
//! Cost: a load for a tick in which nothing is asked.

use rt_core::clock::monotonic_ns;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const EMERGENCY_STOP: u64 = 1 << 63;
const CLEAR_FAULT: u64 = 1 << 62;
const ASKED: u64 = EMERGENCY_STOP | CLEAR_FAULT;
/// A loop that has not taken an emergency stop for so long hangs (ns): a process of a higher priority may keep it from its
/// CPU for some tenths of a second, and is no reason to end the driver.
const HANGS_NS: u64 = 1_000_000_000;
/// Several users, or one whom the kernel does not name.
const SEVERAL: u64 = 1 << 33;
const COUNT_OF_ONE: u64 = SEVERAL << 1;
const COUNT: u64 = !ASKED & !(COUNT_OF_ONE - 1);

/// Whose emergency stop it is that stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoppedBy {
    /// Nobody's: there is none, or somebody pressed a switch.
    Nobody,
    /// A user's, by id.
    User(u32),
    /// More than one user's, or an unknown one's.
    Several,
}

/// What is asked of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    /// Motors off, now.
    pub emergency_stop: bool,
    /// Leave the fault state.
    pub clear_fault: bool,
    /// Every lease up to this number has ended.
    pub ended_lease: u64,
}

/// Why a fault is not left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotCleared {
    /// A fault or an emergency stop came after that was asked.
    Outdated,
    /// Who asks may not undo what stands.
    NotAllowed,
}

/// The words, shared between whoever asks and the loop.
#[derive(Debug, Clone, Default)]
pub struct Urgent(Arc<Words>);

#[derive(Debug, Default)]
struct Words {
    state: AtomicU64,
    /// When the last emergency stop was asked for, or the last fault began (CLOCK_MONOTONIC, ns).
    stopped_ns: AtomicU64,
    /// Since when an emergency stop has been waiting for the loop, if one does (CLOCK_MONOTONIC, ns).
    waiting_ns: AtomicU64,
    ended_lease: AtomicU64,
}

impl Urgent {
    /// All motors off with the loop's next tick. `user` is who asks, if that is known, and `asked_ns` when (CLOCK_MONOTONIC).
    /// Returns whether no emergency stop of anybody stood before.
    pub fn stop(&self, user: Option<u32>, asked_ns: u64) -> bool {
        // Before the stop itself: whoever sees that sees when it was.
        self.0.stopped_ns.fetch_max(asked_ns, Ordering::Release);
        let mut former = StoppedBy::Nobody;
        let now_ns = monotonic_ns();
        self.update(|state| {
            former = by_of(state);
            if state & EMERGENCY_STOP == 0 {
                self.0.waiting_ns.store(now_ns, Ordering::Release);
            }
            let by = merge(former, user.map_or(StoppedBy::Several, StoppedBy::User));
            Some(EMERGENCY_STOP | counted(state) | word_of(by))
        });
        former == StoppedBy::Nobody
    }

    /// The loop has not taken the last emergency stop yet.
    pub fn is_waiting(&self) -> bool {
        self.0.state.load(Ordering::Acquire) & EMERGENCY_STOP != 0
    }

    /// An emergency stop has been waiting for longer than a loop takes that does not hang.
    pub fn is_unheard(&self) -> bool {
        self.is_waiting()
            && monotonic_ns().saturating_sub(self.0.waiting_ns.load(Ordering::Acquire)) > HANGS_NS
    }

    /// The loop is in a fault since now: who asked before to leave one did not know of it. Fit for the loop: it tries
    /// again only if somebody else changed the word meanwhile.
    pub fn fault_began(&self) {
        self.0.stopped_ns.fetch_max(monotonic_ns(), Ordering::Release);
        self.update(|state| Some(state & !(COUNT | CLEAR_FAULT) | counted(state)));
    }

    /// Leave the fault state, as was asked at `asked_ns` (CLOCK_MONOTONIC), if `may` who asks undo what stands.
    ///
    /// # Errors
    /// Why not.
    pub fn clear_fault(&self, asked_ns: u64, may: impl Fn(StoppedBy) -> bool) -> Result<(), NotCleared> {
        let mut why = NotCleared::Outdated;
        let is_done = self.update(|state| {
            let by = by_of(state);
            if self.0.stopped_ns.load(Ordering::Acquire) >= asked_ns {
                why = NotCleared::Outdated;
                return None;
            }
            why = NotCleared::NotAllowed;
            let left = if state & EMERGENCY_STOP == 0 { StoppedBy::Nobody } else { by };
            may(by).then_some(state & (ASKED | COUNT) | CLEAR_FAULT | word_of(left))
        });
        if is_done { Ok(()) } else { Err(why) }
    }

    /// Whose emergency stop stands.
    #[cfg(test)]
    fn stopped_by(&self) -> StoppedBy {
        by_of(self.0.state.load(Ordering::Acquire))
    }

    /// This lease has ended, and any before it.
    pub fn end_lease(&self, lease: u64) {
        self.0.ended_lease.fetch_max(lease, Ordering::Release);
    }

    /// What is asked since the last call. Fit for the loop.
    pub fn take(&self) -> Asked {
        let state = &self.0.state;
        let asked = if state.load(Ordering::Relaxed) & ASKED == 0 {
            0
        } else {
            state.fetch_and(!ASKED, Ordering::AcqRel)
        };
        Asked {
            emergency_stop: asked & EMERGENCY_STOP != 0,
            clear_fault: asked & CLEAR_FAULT != 0,
            ended_lease: self.0.ended_lease.load(Ordering::Acquire),
        }
    }

    fn update(&self, change: impl FnMut(u64) -> Option<u64>) -> bool {
        self.0.state.fetch_update(Ordering::AcqRel, Ordering::Acquire, change).is_ok()
    }
}

fn merge(former: StoppedBy, new: StoppedBy) -> StoppedBy {
    if former == StoppedBy::Nobody || former == new { new } else { StoppedBy::Several }
}

/// One more fault or stop than this word counts.
fn counted(state: u64) -> u64 {
    state.wrapping_add(COUNT_OF_ONE) & COUNT
}

fn word_of(by: StoppedBy) -> u64 {
    match by {
        StoppedBy::Nobody => 0,
        StoppedBy::User(user) => u64::from(user) + 1,
        StoppedBy::Several => SEVERAL,
    }
}

fn by_of(state: u64) -> StoppedBy {
    match state & !(ASKED | COUNT) {
        0 => StoppedBy::Nobody,
        word => u32::try_from(word - 1).map_or(StoppedBy::Several, StoppedBy::User),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANN: u32 = 0;
    const BEN: u32 = u32::MAX;

    fn own(user: u32) -> impl Fn(StoppedBy) -> bool {
        move |by| by == StoppedBy::Nobody || by == StoppedBy::User(user)
    }

    const NOT_ALLOWED: Result<(), NotCleared> = Err(NotCleared::NotAllowed);

    /// Asked after all that was done so far.
    fn now(urgent: &Urgent, may: impl Fn(StoppedBy) -> bool) -> Result<(), NotCleared> {
        urgent.clear_fault(monotonic_ns() + 1, may)
    }

    #[test]
    fn a_stop_that_the_loop_does_not_take_is_unheard_after_a_while() {
        let urgent = Urgent::default();
        assert!(!urgent.is_unheard());
        // However far back somebody says that he asked.
        urgent.stop(Some(ANN), 0);
        assert!(!urgent.is_unheard());
        let begun_ns = monotonic_ns();
        while monotonic_ns() - begun_ns <= HANGS_NS {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        urgent.stop(Some(BEN), monotonic_ns());
        assert!(urgent.is_unheard(), "asking again is no news to a loop that hangs");
        assert!(urgent.take().emergency_stop && !urgent.is_unheard());
        urgent.stop(Some(ANN), monotonic_ns());
        assert!(!urgent.is_unheard(), "and the next one has its own time");
    }

    /// The request lies in a socket while the service is stuck; the stop comes by datagram meanwhile.
    #[test]
    fn a_request_to_leave_a_fault_that_is_heard_late_does_not_undo_a_stop_that_came_after_it() {
        let urgent = Urgent::default();
        urgent.stop(Some(ANN), monotonic_ns());
        assert!(urgent.take().emergency_stop);
        let asked_ns = monotonic_ns() + 1;
        while monotonic_ns() <= asked_ns {}
        urgent.stop(Some(ANN), monotonic_ns());
        assert!(urgent.take().emergency_stop);
        assert_eq!(urgent.clear_fault(asked_ns, |_| true), Err(NotCleared::Outdated));
        assert!(!urgent.take().clear_fault);
        assert_eq!(urgent.stopped_by(), StoppedBy::User(ANN));
        assert_eq!(now(&urgent, own(ANN)), Ok(()));
    }

    #[test]
    fn a_request_to_leave_a_fault_does_not_leave_one_that_began_after_it() {
        let urgent = Urgent::default();
        let asked_ns = monotonic_ns();
        while monotonic_ns() <= asked_ns {}
        urgent.fault_began();
        assert_eq!(urgent.clear_fault(asked_ns, |_| true), Err(NotCleared::Outdated));
        assert_eq!(now(&urgent, |_| true), Ok(()));
        // Granted, and not yet collected.
        urgent.fault_began();
        assert!(!urgent.take().clear_fault);
    }

    /// The count runs over without touching what is beside it.
    #[test]
    fn a_stop_stands_whatever_number_of_faults_came_before() {
        let urgent = Urgent::default();
        urgent.0.state.store(COUNT, Ordering::Relaxed);
        assert!(
            urgent.stop(Some(ANN), monotonic_ns()) && !urgent.stop(Some(ANN), monotonic_ns()),
            "the first one is new"
        );
        urgent.0.state.fetch_or(COUNT, Ordering::Relaxed);
        urgent.fault_began();
        assert_eq!(urgent.stopped_by(), StoppedBy::User(ANN));
        assert_eq!(urgent.take(), Asked { emergency_stop: true, clear_fault: false, ended_lease: 0 });
    }

    #[test]
    fn a_stop_of_several_is_left_by_none_of_them_alone() {
        let urgent = Urgent::default();
        urgent.stop(Some(ANN), monotonic_ns());
        assert_eq!(urgent.stopped_by(), StoppedBy::User(ANN));
        urgent.stop(Some(BEN), monotonic_ns());
        assert_eq!(urgent.stopped_by(), StoppedBy::Several);
        assert!(urgent.take().emergency_stop);
        assert!(now(&urgent, own(ANN)) == NOT_ALLOWED && now(&urgent, own(BEN)) == NOT_ALLOWED);
        assert!(!urgent.take().clear_fault);
        assert_eq!(now(&urgent, |_| true), Ok(()));
        assert_eq!(urgent.stopped_by(), StoppedBy::Nobody);
        assert!(urgent.take().clear_fault);
    }

    #[test]
    fn a_stop_cancels_a_request_to_leave_a_fault_that_came_before_it() {
        let urgent = Urgent::default();
        assert_eq!(now(&urgent, own(BEN)), Ok(()));
        urgent.stop(Some(ANN), monotonic_ns());
        let asked = urgent.take();
        assert!(asked.emergency_stop && !asked.clear_fault, "{asked:?}");
        assert_eq!(urgent.stopped_by(), StoppedBy::User(ANN));
    }

    #[test]
    fn a_stop_that_the_loop_has_not_seen_stays_its_makers() {
        let urgent = Urgent::default();
        urgent.stop(Some(ANN), monotonic_ns());
        assert_eq!(now(&urgent, own(ANN)), Ok(()));
        assert_eq!(urgent.stopped_by(), StoppedBy::User(ANN));
        let asked = urgent.take();
        assert!(asked.emergency_stop && asked.clear_fault);
    }

    #[test]
    fn what_was_taken_is_asked_no_more_and_the_last_lease_that_ended_stays() {
        let urgent = Urgent::default();
        urgent.end_lease(7);
        urgent.end_lease(5);
        urgent.stop(None, monotonic_ns());
        assert_eq!(urgent.take(), Asked { emergency_stop: true, clear_fault: false, ended_lease: 7 });
        assert_eq!(urgent.take(), Asked { emergency_stop: false, clear_fault: false, ended_lease: 7 });
        assert_eq!(urgent.stopped_by(), StoppedBy::Several, "nobody knows whose it is");
    }
}
