//! Text in the picture: messages at a place for a time (Melder 7.2.9).
//!
//! Model: messages of one place stand below each other, the oldest above. In its last half second a message fades.

/// How long messages fade (s).
const FADE_S: f64 = 0.5;
/// So many are read at once; the oldest goes for one more.
const MOST: usize = 8;

/// Something to read.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// What.
    pub text: String,
    /// Where its middle is: shares of the picture's width and height, from the upper left corner.
    pub at: [f64; 2],
    /// For how long (s).
    pub seconds: f64,
}

impl<T: Into<String>> From<T> for Note {
    /// Below the middle, for four seconds.
    fn from(text: T) -> Self {
        Self { text: text.into(), at: [0.5, 0.65], seconds: 4.0 }
    }
}

/// What there is to read now.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown<'b> {
    /// What.
    pub text: &'b str,
    /// Where: shares of the picture.
    pub at: [f64; 2],
    /// How many messages stand above it at the same place.
    pub below: usize,
    /// From 0 to 1.
    pub opacity: f64,
}

/// All messages that are shown.
#[derive(Debug, Clone, Default)]
pub struct Board {
    notes: Vec<(Note, f64)>,
}

impl Board {
    /// From this time on (s); the same text at the same place begins anew.
    pub fn add(&mut self, note: Note, now_s: f64) {
        self.notes.retain(|(other, _)| other.text != note.text || other.at != note.at);
        if self.notes.len() == MOST {
            self.notes.remove(0);
        }
        self.notes.push((note, now_s));
    }

    /// Instead of all others at its place.
    pub fn replace(&mut self, note: Note, now_s: f64) {
        self.notes.retain(|(other, _)| other.at != note.at);
        self.add(note, now_s);
    }

    /// At this time (s); what is over is forgotten.
    pub fn shown(&mut self, now_s: f64) -> Vec<Shown<'_>> {
        self.notes.retain(|(note, begun_s)| now_s < begun_s + note.seconds);
        let shown = |(k, (note, begun_s)): (usize, &'_ (Note, f64))| {
            let left_s = begun_s + note.seconds - now_s;
            let fade_s = FADE_S.min(note.seconds);
            let below = self.notes[..k].iter().filter(|(other, _)| other.at == note.at).count();
            (below, (left_s / fade_s).clamp(0.0, 1.0))
        };
        let places: Vec<_> = self.notes.iter().enumerate().map(shown).collect();
        let both = self.notes.iter().zip(places);
        both.map(|((note, _), (below, opacity))| Shown { text: &note.text, at: note.at, below, opacity })
            .collect()
    }
}

/// Words in lines of at most so many characters, and at most so many lines: what is too much ends in an ellipsis.
pub fn lines(text: &str, columns: usize, most: usize) -> Vec<String> {
    let columns = columns.max(1);
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let mut rest: Vec<char> = word.chars().collect();
        let used = lines.last().map_or(0, |line| line.chars().count());
        if used > 0 && used + 1 + rest.len() > columns {
            lines.push(String::new());
        }
        // A word that is longer than a line is cut.
        while rest.len() > columns {
            let after = rest.split_off(columns);
            lines.last_mut().into_iter().for_each(|line| line.extend(&rest));
            lines.push(String::new());
            rest = after;
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.extend(rest);
        }
    }
    if lines.len() > most {
        lines.truncate(most);
        if let Some(last) = lines.last_mut() {
            let kept: String = last.chars().take(columns - 1).collect();
            *last = format!("{kept}\u{2026}");
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(text: &str, at: [f64; 2], seconds: f64) -> Note {
        Note { text: text.into(), at, seconds }
    }

    fn seen(board: &mut Board, now_s: f64) -> Vec<(String, usize, f64)> {
        board.shown(now_s).iter().map(|shown| (shown.text.to_owned(), shown.below, shown.opacity)).collect()
    }

    #[test]
    fn a_message_is_there_from_when_it_is_told_fades_in_its_last_half_second_and_ends() {
        let mut board = Board::default();
        board.add(note("press", [0.5, 0.5], 2.0), 10.0);
        for (now_s, opacity) in [(10.0, 1.0), (11.5, 1.0), (11.75, 0.5), (11.875, 0.25)] {
            assert_eq!(seen(&mut board, now_s), [("press".into(), 0, opacity)], "{now_s}");
        }
        assert!(seen(&mut board, 12.0).is_empty());
        board.add("four seconds".into(), 20.0);
        assert_eq!((seen(&mut board, 23.5).len(), seen(&mut board, 24.0).len()), (1, 0));
        board.add(note("short", [0.5, 0.5], 0.2), 30.0);
        assert!(
            (seen(&mut board, 30.1)[0].2 - 0.5).abs() < 1e-9,
            "what is shorter than fading fades all the time"
        );
    }

    #[test]
    fn messages_of_one_place_stand_below_each_other_and_others_where_they_are() {
        let mut board = Board::default();
        board.add(note("a", [0.5, 0.1], 1.0), 0.0);
        board.add(note("b", [0.5, 0.9], 9.0), 0.0);
        board.add(note("c", [0.5, 0.1], 9.0), 0.1);
        let below = |board: &mut Board, now_s| -> Vec<(String, usize)> {
            seen(board, now_s).into_iter().map(|(text, below, _)| (text, below)).collect()
        };
        assert_eq!(below(&mut board, 0.2), [("a".into(), 0), ("b".into(), 0), ("c".into(), 1)]);
        assert_eq!(below(&mut board, 1.0), [("b".into(), 0), ("c".into(), 0)], "what is over makes room");
        board.add(note("c", [0.5, 0.1], 9.0), 8.0);
        assert_eq!(seen(&mut board, 16.0), [("c".into(), 0, 1.0)], "told again it begins anew");
        board.replace(note("d", [0.5, 0.1], 9.0), 16.5);
        assert_eq!(seen(&mut board, 16.6), [("d".into(), 0, 1.0)]);
        (0..20).for_each(|k| board.add(note(&k.to_string(), [0.5, 0.5], 9.0), 20.0));
        assert_eq!(seen(&mut board, 20.0).len(), MOST);
        assert_eq!(seen(&mut board, 20.0)[MOST - 1].0, "19");
    }

    #[test]
    fn long_lines_are_broken_between_words_and_what_is_too_much_is_cut() {
        assert_eq!(lines("press the red cube", 9, 3), ["press the", "red cube"]);
        assert_eq!(lines("press the red cube now", 9, 2), ["press the", "red cube\u{2026}"]);
        assert_eq!(lines("abcdefghij kl", 4, 9), ["abcd", "efgh", "ij", "kl"]);
        assert_eq!(lines("abcdefghij", 4, 1), ["abc\u{2026}"]);
        assert_eq!(lines("", 4, 3), [""]);
        for columns in 1..30 {
            for most in 1..5 {
                let lines = lines("grün ist der cube, and heavy things are not", columns, most);
                assert!(lines.len() <= most && lines.iter().all(|line| line.chars().count() <= columns));
            }
        }
    }
}
