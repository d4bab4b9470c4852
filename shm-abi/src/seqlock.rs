//! Values of many words that are read whole or not at all.
//!
//! Problem: one writer, any number of readers, no lock: a reader that is late, or a writer that dies in
//! the middle, must cost the other side nothing.
//!
//! Model: value `k` of a slot is framed by a sequence word that holds `2k + 1` while it is written and
//! `2k + 2` once it stands. The payload itself is atomic words, so an overlapping read is a detected
//! [`Torn`], not a data race. The sequence names *which* value stands, so that a reader of a ring also
//! learns that it was lapped.
//!
//! Invariant: if [`read`] returns `Ok`, every word belongs to one [`write()`]. Proven over all
//! interleavings by the loom test, which runs these very functions over loom's atomics.
//!
//! Cost: one pass over the words; no loop besides. Retrying is the caller's, and bounded there.
//!
//! Reference: H. Boehm, *Can seqlocks get along with programming language memory models?*, MSPC 2012.

use std::sync::atomic::{AtomicU64, Ordering, fence};

/// An atomic 64-bit word. The production one is [`AtomicU64`]; a model checker brings its own.
pub trait Word {
    /// Reads the word.
    fn load(&self, order: Ordering) -> u64;
    /// Writes the word.
    fn store(&self, value: u64, order: Ordering);
    /// A fence in the memory model this word belongs to.
    fn fence(order: Ordering);
}

impl Word for AtomicU64 {
    #[inline]
    fn load(&self, order: Ordering) -> u64 {
        self.load(order)
    }
    #[inline]
    fn store(&self, value: u64, order: Ordering) {
        self.store(value, order);
    }
    #[inline]
    fn fence(order: Ordering) {
        fence(order);
    }
}

/// The reader overlapped a writer, or the writer died inside a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Torn;

/// The sequence word of value `k` once it stands whole.
pub const fn stamp(k: u64) -> u64 {
    k.wrapping_mul(2).wrapping_add(2)
}

/// Writes `payload` as value `k`. There must be one writer; `words` and `payload` have equal length.
#[inline]
pub fn write<W: Word>(sequence: &W, words: &[W], payload: &[u64], k: u64) {
    debug_assert_eq!(words.len(), payload.len());
    sequence.store(stamp(k).wrapping_sub(1), Ordering::Relaxed);
    // No payload word may become visible before the odd sequence.
    W::fence(Ordering::Release);
    for (word, value) in words.iter().zip(payload) {
        word.store(*value, Ordering::Relaxed);
    }
    sequence.store(stamp(k), Ordering::Release);
}

/// Reads the slot into `payload` and returns the stamp of the value that stood there throughout.
#[inline]
pub fn read<W: Word>(sequence: &W, words: &[W], payload: &mut [u64]) -> Result<u64, Torn> {
    debug_assert_eq!(words.len(), payload.len());
    let before = sequence.load(Ordering::Acquire);
    if before & 1 == 1 {
        return Err(Torn);
    }
    for (word, value) in words.iter().zip(payload) {
        *value = word.load(Ordering::Relaxed);
    }
    // Whoever saw a word of a later write must also see that write's odd sequence.
    W::fence(Ordering::Acquire);
    if sequence.load(Ordering::Relaxed) == before { Ok(before) } else { Err(Torn) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot() -> (AtomicU64, [AtomicU64; 3]) {
        (AtomicU64::new(0), Default::default())
    }

    #[test]
    fn a_written_value_is_read_back_under_its_own_stamp() {
        let (sequence, words) = slot();
        write(&sequence, &words, &[1, 2, 3], 7);
        let mut out = [0; 3];
        assert_eq!(read(&sequence, &words, &mut out), Ok(stamp(7)));
        assert_eq!(out, [1, 2, 3]);
    }

    #[test]
    fn a_writer_that_died_inside_a_write_leaves_a_torn_slot_that_the_next_write_heals() {
        let (sequence, words) = slot();
        write(&sequence, &words, &[1, 2, 3], 7);
        sequence.store(stamp(8) - 1, Ordering::Relaxed);
        words[0].store(9, Ordering::Relaxed);
        let mut out = [0; 3];
        assert_eq!(read(&sequence, &words, &mut out), Err(Torn));
        write(&sequence, &words, &[4, 5, 6], 9);
        assert_eq!(read(&sequence, &words, &mut out), Ok(stamp(9)));
        assert_eq!(out, [4, 5, 6]);
    }

    #[test]
    fn an_untouched_slot_never_passes_for_value_zero() {
        let (sequence, words) = slot();
        let mut out = [0; 3];
        assert_ne!(read(&sequence, &words, &mut out), Ok(stamp(0)));
    }
}
