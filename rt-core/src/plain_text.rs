//! Escaping of foreign text for terminals.
//!
//! Problem: a name in a scene, a file's name or the metadata of a recording can hold an escape sequence that clears the
//! screen, renames the window or forges a line of ours, and characters that turn the direction of writing around.
//! Model: whatever is printed for people goes through [`Plain`] at the border, so that no message has to remember it.
//! What moves a cursor or hides is shown by its code, as in `\u{1b}`; everything else is shown as it is.
//! Invariant: what comes out holds no control character and nothing that is invisible or changes the direction.

use std::borrow::Cow;
use std::fmt::{self, Display, Write};

/// Displays a value with everything escaped that a terminal would act on, line breaks included.
#[derive(Debug, Clone, Copy)]
pub struct Plain<T>(pub T);

/// The same, but with line breaks and tabs as they are: for a text of several lines whose parts are plain already.
#[derive(Debug, Clone, Copy)]
pub struct PlainLines<T>(pub T);

/// The same for a JSON text, in which strings are escaped as JSON has it and so stay what they were.
#[derive(Debug, Clone, Copy)]
pub struct PlainJson<T>(pub T);

impl<T: Display> Display for Plain<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Escaping { out, keeps: "", escape }, "{}", self.0)
    }
}

impl<T: Display> Display for PlainLines<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Escaping { out, keeps: "\n\t", escape }, "{}", self.0)
    }
}

impl<T: Display> Display for PlainJson<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Escaping { out, keeps: "\n", escape: escape_json }, "{}", self.0)
    }
}

/// Characters of a foreign text that a message repeats.
const MOST_QUOTED_CHARS: usize = 60;

/// Beginning of a foreign text, enough to find it by, with points where it goes on: a line of a broken file can have
/// megabytes.
pub fn beginning(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(MOST_QUOTED_CHARS) {
        Some((end, _)) => format!("{}...", &text[..end]).into(),
        None => text.into(),
    }
}

/// The same between quotes, control characters escaped.
pub fn quoted(text: &str) -> String {
    format!("{:?}", beginning(text))
}

/// Names that a message lists.
const MOST_LISTED: usize = 20;

/// Foreign names with commas between them; of many the first, of a long one the beginning.
pub fn listed<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    let mut listed: Vec<_> = names.into_iter().take(MOST_LISTED + 1).map(beginning).collect();
    if let Some(last) = listed.get_mut(MOST_LISTED) {
        *last = "...".into();
    }
    listed.join(", ")
}

/// A text with everything escaped that a terminal would act on; borrowed where there is nothing.
pub fn plain(text: &str) -> Cow<'_, str> {
    if text.contains(is_harmful) { Plain(text).to_string().into() } else { text.into() }
}

struct Escaping<'a, 'b> {
    out: &'a mut fmt::Formatter<'b>,
    keeps: &'static str,
    escape: fn(&mut fmt::Formatter<'_>, char) -> fmt::Result,
}

impl Write for Escaping<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text;
        while let Some(at) = rest.find(|c| is_harmful(c) && !self.keeps.contains(c)) {
            let (before, from) = rest.split_at(at);
            self.out.write_str(before)?;
            let mut behind = from.chars();
            if let Some(harmful) = behind.next() {
                (self.escape)(self.out, harmful)?;
            }
            rest = behind.as_str();
        }
        self.out.write_str(rest)
    }
}

fn escape(out: &mut fmt::Formatter<'_>, harmful: char) -> fmt::Result {
    match harmful {
        '\n' | '\r' | '\t' => write!(out, "{}", harmful.escape_default()),
        _ => write!(out, "{}", harmful.escape_unicode()),
    }
}

fn escape_json(out: &mut fmt::Formatter<'_>, harmful: char) -> fmt::Result {
    harmful.encode_utf16(&mut [0; 2]).iter().try_for_each(|unit| write!(out, "\\u{unit:04x}"))
}

/// Control characters; format characters that are invisible, turn the direction of writing or break lines.
pub fn is_harmful(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_sequences_line_breaks_and_turned_writing_are_shown_by_their_codes() {
        for (foreign, shown) in [
            ("\u{1b}[2J", "\\u{1b}[2J"),
            ("a\nphantom3: all is well", "a\\nphantom3: all is well"),
            ("\r\t\u{7}\u{9b}31m", "\\r\\t\\u{7}\\u{9b}31m"),
            ("\u{202e}gnp.obj", "\\u{202e}gnp.obj"),
            ("a\u{200b}b\u{feff}\u{2066}", "a\\u{200b}b\\u{feff}\\u{2066}"),
            ("\u{2028}", "\\u{2028}"),
        ] {
            assert_eq!(Plain(foreign).to_string(), shown);
            assert_eq!(plain(foreign), shown);
        }
    }

    #[test]
    fn what_people_write_stays_as_it_is() {
        for text in ["", "Würfel 1/2 \"x\" \\n", "机", "é, e\u{301}", "{}"] {
            assert_eq!(plain(text), text);
            assert!(matches!(plain(text), Cow::Borrowed(_)));
        }
    }

    #[test]
    fn of_a_long_text_the_beginning_is_quoted() {
        let (whole, long) = ["ä".repeat(60), "ä".repeat(61)].into();
        assert_eq!(beginning(&whole), whole);
        assert_eq!(beginning(&long), whole.clone() + "...");
        assert_eq!(quoted(&long), format!("\"{whole}...\""));
        assert_eq!(quoted("a\n"), "\"a\\n\"");
    }

    #[test]
    fn of_many_names_the_first_are_listed() {
        assert_eq!(listed([]), "");
        assert_eq!(listed(["a", &"b".repeat(61)]), format!("a, {}...", "b".repeat(60)));
        assert_eq!(listed(["a"; 20]), ["a"; 20].join(", "));
        assert_eq!(listed(["a"; 21]), ["a"; 20].join(", ") + ", ...");
    }

    #[test]
    fn a_json_text_says_the_same() {
        let json = "{\n  \"a\": \"\u{9b}\u{202e}\u{e0001}ä\"\n}";
        assert_eq!(PlainJson(json).to_string(), "{\n  \"a\": \"\\u009b\\u202e\\udb40\\udc01ä\"\n}");
    }

    #[test]
    fn a_text_of_lines_keeps_its_breaks() {
        assert_eq!(PlainLines("a\n\tb\u{1b}\r\n").to_string(), "a\n\tb\\u{1b}\\r\n");
    }
}
