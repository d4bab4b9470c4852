//! A key with those that are held while it is pressed.

use eframe::egui::{Key, Modifiers};
use std::fmt;

/// A key, and which of Ctrl, Alt and Shift are held with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chord {
    /// The key.
    pub key: Key,
    /// Held: Ctrl, Alt, Shift.
    pub held: [bool; 3],
}

const HELD: [&str; 3] = ["Ctrl", "Alt", "Shift"];
/// What desktops make of them is no key.
const TEXT_KEYS: [Key; 3] = [Key::C, Key::X, Key::V];

/// What may be written, for messages.
pub(super) const ALLOWED: &str = "a key such as A, 1, F1, Space, Escape, Left, PageUp or Minus, after Ctrl+, Alt+ or \
                                  Shift+ if they are held; not Ctrl+C, Ctrl+X or Ctrl+V, which are the desktop's";

impl Chord {
    /// As egui tells it.
    pub fn new(key: Key, held: Modifiers) -> Self {
        Self { key, held: [held.ctrl, held.alt, held.shift] }
    }

    /// As it is written: `Ctrl+Shift+F1`; `None`: it is no key.
    pub fn parse(text: &str) -> Option<Self> {
        let mut held = [false; 3];
        let mut rest = text;
        while let Some((word, after)) = rest.split_once('+').filter(|(_, after)| !after.is_empty()) {
            let at = HELD.iter().position(|name| *name == word)?;
            if std::mem::replace(&mut held[at], true) {
                return None;
            }
            rest = after;
        }
        let chord = Self { key: Key::from_name(rest)?, held };
        (!(chord.held[0] && TEXT_KEYS.contains(&chord.key))).then_some(chord)
    }

    /// The same without Shift.
    pub(super) fn without_shift(self) -> Self {
        Self { held: [self.held[0], self.held[1], false], ..self }
    }
}

impl fmt::Display for Chord {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, _) in HELD.iter().zip(self.held).filter(|(_, is_held)| *is_held) {
            write!(out, "{name}+")?;
        }
        out.write_str(self.key.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_the_other_way_round() {
        for key in Key::ALL {
            for held in [[false; 3], [true, false, false], [true, true, true]] {
                let chord = Chord { key: *key, held };
                let is_text = held[0] && TEXT_KEYS.contains(key);
                assert_eq!(Chord::parse(&chord.to_string()), (!is_text).then_some(chord), "{chord}");
            }
        }
        // A plus is a key too.
        assert_eq!(Chord::parse("Ctrl++").map(|chord| (chord.key, chord.held[0])), Some((Key::Plus, true)));
        for wrong in ["", "ctrl+Q", "Ctrl+", "Ctrl+Ctrl+Q", "Q+Ctrl", "Any", "Ctrl+C"] {
            assert_eq!(Chord::parse(wrong), None, "{wrong}");
        }
    }
}
