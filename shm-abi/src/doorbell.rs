//! Telling the other side that a value stands, and waiting to be told.
//!
//! Problem: the reader must not miss a value, must not read a half-written one, and the writer must not
//! pay for a system call unless somebody really sleeps.
//!
//! Model: after the value is complete the writer stores its number, then the doorbell. A reader spins on
//! the number, or, where it shares its CPU with the writer, raises its own `owner_sleeps`, looks once more
//! and sleeps on the doorbell by futex. The writer looks at that flag after ringing; the fence between
//! store and look on both sides forbids that each misses the other (Dekker). Readers wait on the doorbell,
//! never on a sequence word, which is odd for part of the time.
//!
//! The driver's doorbell lies in memory that every observer maps, and waking costs by the sleeper. So the commander
//! sleeps on a word of its own segment, which the driver changes and has rung while the flag says so, and observers
//! look by the clock. A wake also walks past the sleepers of whatever word shares a bucket of the kernel's table, whoever they
//! are: a loop with deadlines neither wakes nor sleeps so.
//!
//! Invariant: a sleeper that saw an old number is woken by the next ring (loom test).
//! Cost: ringing is two stores, a fence and a load; if the flag is up, one system call more.

use crate::enumeration::from_word;
use crate::layout::{Bell, SLEEPS_ON_OTHERS_BELL, SLEEPS_ON_OWN_WORD};
use crate::seqlock::Word;
use rustix::thread::futex;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

/// How to wait for the other side.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaitMode {
    /// Burn the CPU: shortest, and only right when both sides own a CPU each.
    Spin = 0,
    /// Sleep in the kernel: right when they share a CPU or run without real-time rights.
    Futex = 1,
}

from_word!(WaitMode { Spin, Futex });

impl WaitMode {
    /// The name a person reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spin => "spin",
            Self::Futex => "futex",
        }
    }
}

/// Where a reader sleeps.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// The futex word.
    pub word: &'a AtomicU32,
    /// How `owner_sleeps` names it.
    pub flag: u64,
}

impl<'a> Place<'a> {
    /// The doorbell of the segment that is waited for.
    pub fn bell(bell: &'a Bell) -> Self {
        Self { word: &bell.doorbell, flag: SLEEPS_ON_OTHERS_BELL }
    }
}

/// Announces value `k`, which must stand already, and wakes whoever `sleeps` says is asleep on `bell`.
pub fn ring(bell: &Bell, k: u64, sleeps: &AtomicU64) {
    tell(bell, k);
    if sleeper(sleeps) != 0 {
        wake(bell);
    }
}

/// As [`ring`], from the driver's loop, which wakes nobody itself: says whether the commander sleeps, whose own word it
/// changes then. Whoever is told so wakes it by [`wake_sleeper`].
pub fn tell_frame(bell: &Bell, k: u64, sleeps: &AtomicU64, own_word: &AtomicU32) -> bool {
    tell(bell, k);
    let place = sleeper(sleeps);
    if place == SLEEPS_ON_OWN_WORD {
        own_word.store(low_half(k), Ordering::Release);
    }
    place != 0
}

/// Wakes a commander that sleeps: one sleeper on its own word, or, for one that sleeps on the bell that all share, as those of
/// before 1.3 do, [`OLD_SLEEPERS`] there, the kernel choosing them by priority. Returns how many were woken. However few, it
/// takes as long as there are sleepers in the same bucket of the kernel's table, of whatever process.
pub fn wake_sleeper(bell: &Bell, sleeps: &AtomicU64, own_word: &AtomicU32) -> usize {
    match sleeper(sleeps) {
        0 => 0,
        SLEEPS_ON_OWN_WORD => wake_some(own_word, 1),
        _ => wake_some(&bell.doorbell, OLD_SLEEPERS),
    }
}

/// Announces value `k`, which must stand already, and wakes nobody.
pub fn tell(bell: &Bell, k: u64) {
    announce(&bell.latest_plus_one, k);
    bell.doorbell.store(low_half(k), Ordering::Release);
}

/// What a futex word says of value `k`.
fn low_half(k: u64) -> u32 {
    k.wrapping_add(1) as u32
}

/// Wakes everybody who sleeps on `bell`, without a new value: so that they look at something else. The
/// word does not change, so that this is lost on somebody who is just about to sleep: whoever relies on it
/// bounds the sleep by a time-out. Returns how many were woken.
pub fn wake(bell: &Bell) -> usize {
    wake_some(&bell.doorbell, EVERYBODY)
}

fn wake_some(word: &AtomicU32, at_most: u32) -> usize {
    // The word is mapped; the errors are those of a bad address, and of a sleeper who sleeps on it as on a lock,
    // which is its own fault.
    futex::wake(word, futex::Flags::empty(), at_most).unwrap_or(0)
}

/// The number of the newest complete value.
pub fn latest(bell: &Bell) -> Option<u64> {
    newest(&bell.latest_plus_one)
}

/// Sleeps at `place` until the other side rings, `timeout` passes or a signal comes, unless the newest value of
/// `bell` is no longer `seen`. Returns at once then; the caller looks for itself in any case.
pub fn sleep(place: Place<'_>, bell: &Bell, seen: Option<u64>, own_flag: &AtomicU64, timeout: Duration) {
    let expected = place.word.load(Ordering::Acquire);
    raise_flag(own_flag, place.flag);
    if latest(bell) == seen {
        let timeout = futex::Timespec {
            // "For ever" must not become negative: the kernel would refuse, and the caller would spin.
            tv_sec: i64::try_from(timeout.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: timeout.subsec_nanos().into(),
        };
        // Every outcome (woken, changed, interrupted, timed out) means the same: look again.
        let _ = futex::wait(place.word, futex::Flags::empty(), expected, Some(&timeout));
    }
    own_flag.store(0, Ordering::Relaxed);
}

/// How many sleepers on the shared bell the loop wakes for a commander of before 1.3: itself, and some who sleep
/// there beside it at the same priority.
pub const OLD_SLEEPERS: u32 = 8;

/// The kernel reads the number of sleepers to wake as a signed one: -1 would wake a single one.
const EVERYBODY: u32 = i32::MAX as u32;

/// Publishes the number of a value that stands.
pub fn announce<W: Word>(latest_plus_one: &W, k: u64) {
    latest_plus_one.store(k.wrapping_add(1), Ordering::Release);
}

/// The number last published.
pub fn newest<W: Word>(latest_plus_one: &W) -> Option<u64> {
    latest_plus_one.load(Ordering::Acquire).checked_sub(1)
}

/// Where the reader may be asleep, 0: nowhere. Asked after [`announce`], on the writer's side of Dekker's handshake.
pub fn sleeper<W: Word>(flag: &W) -> u64 {
    W::fence(Ordering::SeqCst);
    flag.load(Ordering::Relaxed)
}

/// Says where the reader is about to sleep: done before it looks at [`newest`] for the last time.
pub fn raise_flag<W: Word>(own_flag: &W, place: u64) {
    own_flag.store(place, Ordering::Relaxed);
    W::fence(Ordering::SeqCst);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn every_way_to_wait_has_its_name() {
        assert_eq!([WaitMode::Spin, WaitMode::Futex].map(WaitMode::name), ["spin", "futex"]);
    }

    /// Sleepers compare the word with what they saw: it must differ from one value to the next.
    #[test]
    fn the_word_of_a_bell_is_the_low_half_of_the_number_behind_the_newest() {
        let bell = bell();
        for (k, word) in [(0, 1), (1, 2), (u64::from(u32::MAX) - 1, u32::MAX), (u64::from(u32::MAX), 0)] {
            tell(&bell, k);
            assert_eq!((latest(&bell), bell.doorbell.load(Ordering::Relaxed)), (Some(k), word));
        }
    }

    fn bell() -> Bell {
        Bell {
            latest_plus_one: AtomicU64::new(0),
            doorbell: AtomicU32::new(0),
            padding: AtomicU32::new(0),
            owner_sleeps: AtomicU64::new(0),
            reserved: Default::default(),
        }
    }

    /// A sleeper that has looked, and does not sleep yet, must find another word.
    #[test]
    fn the_word_of_a_commander_is_changed_where_it_sleeps_on_it_and_nowhere_else() {
        for (place, word) in [(0, 0), (SLEEPS_ON_OTHERS_BELL, 0), (SLEEPS_ON_OWN_WORD, 8)] {
            let (sleeps, own_word) = (AtomicU64::new(place), AtomicU32::new(0));
            assert_eq!(tell_frame(&bell(), 7, &sleeps, &own_word), place != 0);
            assert_eq!(own_word.load(Ordering::Relaxed), word, "{place}");
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "futexes are the system's")]
    fn where_no_commander_sleeps_nobody_is_woken() {
        let (bell, own_word) = (bell(), AtomicU32::new(0));
        let wake = |place| wake_sleeper(&bell, &AtomicU64::new(place), &own_word);
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let _at_the_end = patience::Raised(&stop);
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    sleep(Place::bell(&bell), &bell, None, &AtomicU64::new(0), Duration::from_secs(1));
                }
            });
            patience::until("somebody sleeps on the bell", || wake(SLEEPS_ON_OTHERS_BELL) == 1);
            for _ in 0..50 {
                std::thread::sleep(Duration::from_millis(1));
                assert_eq!(wake(0), 0);
            }
        });
    }
}
