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
//! Invariant: a sleeper that saw an old number is woken by the next ring (loom test).
//! Cost: ringing is two stores, a fence and a load; one system call more if the flag is up.

use crate::enumeration::from_word;
use crate::layout::Bell;
use crate::seqlock::Word;
use rustix::thread::futex;
use std::sync::atomic::{AtomicU64, Ordering};
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

/// Announces value `k`, which must stand already. Wakes whoever `sleeps` says is asleep.
pub fn ring(bell: &Bell, k: u64, sleeps: &AtomicU64) {
    announce(&bell.latest_plus_one, k);
    bell.doorbell.store(k.wrapping_add(1) as u32, Ordering::Release);
    if is_asleep(sleeps) {
        wake(bell);
    }
}

/// Wakes everybody who sleeps on `bell`, without a new value: so that they look at something else. The
/// word does not change, so that this is lost on somebody who is just about to sleep: whoever relies on it
/// bounds the sleep by a time-out.
pub fn wake(bell: &Bell) {
    // The word is mapped; the only errors are those of a bad address.
    let _ = futex::wake(&bell.doorbell, futex::Flags::empty(), EVERYBODY);
}

/// The number of the newest complete value.
pub fn latest(bell: &Bell) -> Option<u64> {
    newest(&bell.latest_plus_one)
}

/// Sleeps until the bell rings, `timeout` passes or a signal comes, unless its newest value is no longer
/// `seen`. Returns at once then; the caller looks for itself in any case.
pub fn sleep(bell: &Bell, seen: Option<u64>, own_flag: &AtomicU64, timeout: Duration) {
    let expected = bell.doorbell.load(Ordering::Acquire);
    raise_flag(own_flag);
    if latest(bell) == seen {
        let timeout = futex::Timespec {
            // "For ever" must not become negative: the kernel would refuse, and the caller would spin.
            tv_sec: i64::try_from(timeout.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: timeout.subsec_nanos().into(),
        };
        // Every outcome (woken, changed, interrupted, timed out) means the same: look again.
        let _ = futex::wait(&bell.doorbell, futex::Flags::empty(), expected, Some(&timeout));
    }
    own_flag.store(0, Ordering::Relaxed);
}

/// The kernel reads the number of sleepers to wake as a signed one: -1 would wake a single one, and an
/// observer that sleeps on the same word could take the commander's turn.
const EVERYBODY: u32 = i32::MAX as u32;

/// Publishes the number of a value that stands.
pub fn announce<W: Word>(latest_plus_one: &W, k: u64) {
    latest_plus_one.store(k.wrapping_add(1), Ordering::Release);
}

/// The number last published.
pub fn newest<W: Word>(latest_plus_one: &W) -> Option<u64> {
    latest_plus_one.load(Ordering::Acquire).checked_sub(1)
}

/// Whether the reader may be asleep: asked after [`announce`], on the writer's side of Dekker's handshake.
pub fn is_asleep<W: Word>(flag: &W) -> bool {
    W::fence(Ordering::SeqCst);
    flag.load(Ordering::Relaxed) != 0
}

/// Says that the reader is about to sleep: done before it looks at [`newest`] for the last time.
pub fn raise_flag<W: Word>(own_flag: &W) {
    own_flag.store(1, Ordering::Relaxed);
    W::fence(Ordering::SeqCst);
}
