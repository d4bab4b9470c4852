//! Last words: a dying process writes why, and another one reads it.
//!
//! Problem: when a driver is gone, whoever sees the connection end wants to know whether it was told
//! to stop, crashed or killed, without a log file and without asking a process that no longer is.
//! Model: a block of 32 words of 64 bits, usually in shared memory, written at most once: the first
//! writer wins, since what comes later is mostly a consequence. All zero means "no epitaph", so a
//! process that was killed outright leaves none.
//!
//! | word | contents |
//! |---|---|
//! | 0 | bits 0-31: kind (1 stopped, 2 signal, 3 panic, 4 fault; 0 no epitaph); bits 32-63: signal number for kind 2, else 0 |
//! | 1 | tick in which it was written |
//! | 2 | 0 while the text is being written, then 1 + its length in bytes (0 to 232) |
//! | 3-31 | text, UTF-8: byte `i` is bits `8 (i % 8)` to `8 (i % 8) + 7` of word `3 + i / 8`; the rest is 0 |
//!
//! The kind is claimed by a compare-and-swap on word 0 and word 2 is stored last (release), so even
//! a writer that dies in between leaves its kind.
//! Invariants: writing is async-signal-safe: no allocation, no lock, no panic. Reading takes
//! nothing on trust: an unknown kind, an impossible length, bad UTF-8 and control characters (they
//! might steer the reader's terminal) come out as something printable.
//! Cost: a write stores at most 32 words, some 50 ns.

mod fixed_text;
mod panic_hook;

#[cfg(test)]
mod death_tests;

pub use crate::sys::fatal::install_fatal_handlers;
pub use panic_hook::install_panic_hook;

pub(crate) use fixed_text::FixedText;

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

/// Words in an epitaph.
pub const EPITAPH_WORDS: usize = 32;
/// Bytes of text that fit.
pub const EPITAPH_TEXT_BYTES: usize = (EPITAPH_WORDS - TEXT) * 8;

/// The block that holds an epitaph, wherever it lies.
pub type EpitaphWords = [AtomicU64; EPITAPH_WORDS];

const KIND: usize = 0;
const TICK: usize = 1;
const LENGTH: usize = 2;
const TEXT: usize = 3;

/// Why a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EpitaphKind {
    /// It was asked to.
    Stopped,
    /// A fatal signal, by number.
    Signal(i32),
    /// A panic: a broken assumption in the program.
    Panic,
    /// It gave up: a device or set-up failed.
    Fault,
    /// A kind that this version does not know; never written.
    Unknown(u32),
}

impl EpitaphKind {
    fn to_word(self) -> u64 {
        let (kind, argument) = match self {
            Self::Stopped => (1, 0),
            Self::Signal(number) => (2, number.cast_unsigned()),
            Self::Panic => (3, 0),
            Self::Fault => (4, 0),
            Self::Unknown(kind) => (kind, 0),
        };
        u64::from(argument) << 32 | u64::from(kind)
    }

    fn from_word(word: u64) -> Self {
        match word as u32 {
            1 => Self::Stopped,
            2 => Self::Signal(((word >> 32) as u32).cast_signed()),
            3 => Self::Panic,
            4 => Self::Fault,
            kind => Self::Unknown(kind),
        }
    }
}

impl fmt::Display for EpitaphKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped => f.write_str("stopped"),
            Self::Signal(number) => write!(f, "killed by signal {number}"),
            Self::Panic => f.write_str("panicked"),
            Self::Fault => f.write_str("gave up"),
            Self::Unknown(kind) => write!(f, "ended for a reason of unknown kind {kind}"),
        }
    }
}

/// What a process left behind; an allegation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Epitaph {
    /// Why it ended.
    pub kind: EpitaphKind,
    /// In which tick.
    pub tick: u64,
    /// In its own words; printable.
    pub text: String,
    /// False if it died while writing the text, or is still at it.
    pub complete: bool,
}

impl fmt::Display for Epitaph {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in tick {}", self.kind, self.tick)?;
        match (self.complete, self.text.is_empty()) {
            (false, _) => f.write_str(" (last words cut short)"),
            (true, true) => Ok(()),
            (true, false) => write!(f, ": {}", self.text),
        }
    }
}

/// A block without epitaph, for one that lives in this process.
#[must_use]
pub const fn empty_epitaph() -> EpitaphWords {
    [const { AtomicU64::new(0) }; EPITAPH_WORDS]
}

/// What is written in `words`; None if nothing is.
#[must_use]
pub fn read(words: &EpitaphWords) -> Option<Epitaph> {
    EpitaphRef::new(words).read()
}

/// An epitaph in place.
#[derive(Clone, Copy, Debug)]
pub struct EpitaphRef<'a>(&'a EpitaphWords);

impl<'a> EpitaphRef<'a> {
    /// Looks at `words` as an epitaph; changes nothing.
    #[must_use]
    pub fn new(words: &'a EpitaphWords) -> Self {
        Self(words)
    }

    /// Writes the epitaph unless there is one, and says whether it did. A text that does not fit is
    /// cut at a character's border. Async-signal-safe.
    pub fn write(&self, kind: EpitaphKind, tick: u64, text: &str) -> bool {
        let claim = kind.to_word();
        let claimed = self.0[KIND].compare_exchange(0, claim, Ordering::Relaxed, Ordering::Relaxed);
        if claimed.is_err() || claim == 0 {
            return false;
        }
        let text = fixed_text::truncated(text, EPITAPH_TEXT_BYTES).as_bytes();
        self.0[TICK].store(tick, Ordering::Relaxed);
        for (word, bytes) in self.0[TEXT..].iter().zip(text.chunks(8)) {
            word.store(pack(bytes), Ordering::Relaxed);
        }
        self.0[LENGTH].store(1 + text.len() as u64, Ordering::Release);
        true
    }

    /// What is written here; None if nothing is.
    #[must_use]
    pub fn read(&self) -> Option<Epitaph> {
        let complete_length = self.0[LENGTH].load(Ordering::Acquire).checked_sub(1);
        let kind = self.0[KIND].load(Ordering::Relaxed);
        if kind as u32 == 0 {
            return None;
        }
        Some(Epitaph {
            kind: EpitaphKind::from_word(kind),
            tick: self.0[TICK].load(Ordering::Relaxed),
            text: complete_length.map(|length| self.read_text(length)).unwrap_or_default(),
            complete: complete_length.is_some(),
        })
    }

    /// Makes room for a new epitaph. Only for the owner, while nobody else may write.
    pub fn clear(&self) {
        // The kind last: until then no writer gets in.
        self.0.iter().rev().for_each(|word| word.store(0, Ordering::Release));
    }

    fn read_text(&self, length: u64) -> String {
        let length = usize::try_from(length).map_or(EPITAPH_TEXT_BYTES, |n| n.min(EPITAPH_TEXT_BYTES));
        let bytes: Vec<u8> =
            self.0[TEXT..].iter().flat_map(|word| word.load(Ordering::Relaxed).to_le_bytes()).collect();
        let printable = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
        String::from_utf8_lossy(&bytes[..length]).chars().map(printable).collect()
    }
}

/// Up to eight bytes as a word, the first one lowest.
fn pack(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_written_is_read() {
        let kinds = [EpitaphKind::Stopped, EpitaphKind::Signal(11), EpitaphKind::Panic, EpitaphKind::Fault];
        for kind in kinds {
            let words = empty_epitaph();
            assert!(EpitaphRef::new(&words).write(kind, 42, "the arm's cable came off"));
            let text = "the arm's cable came off".to_owned();
            assert_eq!(read(&words), Some(Epitaph { kind, tick: 42, text, complete: true }));
        }
    }

    #[test]
    fn nothing_written_is_no_epitaph() {
        assert_eq!(read(&empty_epitaph()), None);
    }

    #[test]
    fn the_first_writer_wins() {
        let words = empty_epitaph();
        let epitaph = EpitaphRef::new(&words);
        assert!(epitaph.write(EpitaphKind::Fault, 1, "cause"));
        assert!(!epitaph.write(EpitaphKind::Panic, 2, "consequence"));
        assert_eq!(read(&words).unwrap().text, "cause");
        epitaph.clear();
        assert_eq!(read(&words), None);
        assert!(epitaph.write(EpitaphKind::Panic, 2, "next life"));
    }

    #[test]
    fn of_many_writers_at_once_exactly_one_is_read_whole() {
        for _ in 0..200 {
            let words = empty_epitaph();
            let write = |n: u64| {
                let text = format!("{n}").repeat(100);
                EpitaphRef::new(&words).write(EpitaphKind::Signal(n as i32), n, &text)
            };
            let winners = std::thread::scope(|scope| {
                let threads: Vec<_> = (1..=4).map(|n| scope.spawn(move || write(n))).collect();
                threads.into_iter().map(|t| t.bounded_join().unwrap()).filter(|won| *won).count()
            });
            let epitaph = read(&words).unwrap();
            assert_eq!(winners, 1);
            assert_eq!(epitaph.kind, EpitaphKind::Signal(epitaph.tick as i32));
            assert_eq!(epitaph.text, format!("{}", epitaph.tick).repeat(100));
        }
    }

    /// The layout is a contract with programs in other languages.
    #[test]
    fn the_words_are_laid_out_as_documented() {
        let words = empty_epitaph();
        EpitaphRef::new(&words).write(EpitaphKind::Signal(6), 9, "abcdefghi");
        let plain: Vec<u64> = words.iter().map(|w| w.load(Ordering::Relaxed)).collect();
        assert_eq!(plain[..3], [6 << 32 | 2, 9, 1 + 9]);
        assert_eq!(plain[3], u64::from_le_bytes(*b"abcdefgh"));
        assert_eq!(plain[4], u64::from(b'i'));
        assert!(plain[5..].iter().all(|word| *word == 0));
        assert_eq!(EPITAPH_TEXT_BYTES, 232);
    }

    #[test]
    fn a_writer_that_died_within_leaves_its_kind() {
        let words = empty_epitaph();
        words[0].store(3, Ordering::Relaxed);
        let epitaph = read(&words).unwrap();
        assert_eq!((epitaph.kind, epitaph.complete), (EpitaphKind::Panic, false));
        assert_eq!(epitaph.to_string(), "panicked in tick 0 (last words cut short)");
    }

    #[test]
    fn control_characters_do_not_reach_the_readers_terminal() {
        let words = empty_epitaph();
        EpitaphRef::new(&words).write(EpitaphKind::Fault, 0, "\x1b[2Jgone\n");
        assert_eq!(read(&words).unwrap().text, "\u{fffd}[2Jgone\u{fffd}");
    }

    proptest! {
        #[test]
        fn garbage_reads_as_something_printable(garbage in prop::array::uniform32(any::<u64>())) {
            let words = garbage.map(AtomicU64::new);
            if let Some(epitaph) = read(&words) {
                prop_assert!(!epitaph.to_string().chars().any(char::is_control));
            }
        }

        #[test]
        fn a_long_text_is_cut_at_a_character(text in "\\PC{0,120}") {
            let words = empty_epitaph();
            EpitaphRef::new(&words).write(EpitaphKind::Fault, 0, &text);
            let kept = read(&words).unwrap().text;
            prop_assert!(text.starts_with(&kept));
            // At most the bytes of one character less one are given up.
            prop_assert!(kept.len() == text.len() || kept.len() + 3 >= EPITAPH_TEXT_BYTES);
        }
    }
}
