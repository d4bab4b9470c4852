//! Text built in place, without the heap, for code that runs while the process dies.
//!
//! Model: a byte array that takes what fits and drops the rest; once something was dropped, nothing
//! more is taken, so a text never has a hole.
//! Invariant: what is there is valid UTF-8, cut at a character's border.

use super::EPITAPH_TEXT_BYTES;
use std::fmt;

/// The text of an epitaph in the making.
#[derive(Debug)]
pub(crate) struct FixedText {
    bytes: [u8; EPITAPH_TEXT_BYTES],
    length: usize,
    full: bool,
}

impl FixedText {
    pub(crate) fn new() -> Self {
        Self { bytes: [0; EPITAPH_TEXT_BYTES], length: 0, full: false }
    }

    pub(crate) fn as_str(&self) -> &str {
        // Only whole characters were copied, so this always succeeds.
        std::str::from_utf8(&self.bytes[..self.length]).unwrap_or_default()
    }
}

impl fmt::Write for FixedText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.full {
            return Ok(());
        }
        let kept = truncated(text, EPITAPH_TEXT_BYTES - self.length);
        self.bytes[self.length..self.length + kept.len()].copy_from_slice(kept.as_bytes());
        self.length += kept.len();
        self.full = kept.len() < text.len();
        Ok(())
    }
}

/// The longest beginning of `text` that has at most `max_bytes` bytes and ends with a character.
pub(super) fn truncated(text: &str, max_bytes: usize) -> &str {
    let end = (0..=max_bytes.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    &text[..end.unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    #[test]
    fn text_is_cut_before_the_character_that_does_not_fit() {
        assert_eq!(truncated("aé", 2), "a");
        assert_eq!(truncated("aé", 3), "aé");
        assert_eq!(truncated("é", 0), "");
    }

    #[test]
    fn a_full_text_takes_nothing_more() {
        let mut text = FixedText::new();
        let fits = "x".repeat(EPITAPH_TEXT_BYTES - 1);
        write!(text, "{fits}é").unwrap();
        write!(text, "y").unwrap();
        assert_eq!(text.as_str(), fits, "'y' would fit, but 'é' before it did not");
    }
}
