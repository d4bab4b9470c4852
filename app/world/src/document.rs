//! A TOML text whose parts still know where they stand in it.

use std::ops::Range;
use std::path::Path;

use rt_core::toml_slips;
use toml::Spanned;
use toml::de::DeTable;

use crate::document_size;
use crate::error::{Location, SceneError};

/// The text and the name of the file it came from: what a byte offset needs to become a line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Document<'d> {
    file: &'d Path,
    text: &'d str,
    lines: &'d LineEnds,
}

/// Where the lines of a text end, found once: ten thousand entities that keep their lines would otherwise count them
/// ten thousand times from the start.
#[derive(Debug)]
pub(crate) struct LineEnds(Vec<usize>);

impl LineEnds {
    pub(crate) fn of(text: &str) -> Self {
        Self(text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(offset, _)| offset).collect())
    }

    /// The line, counted from 1, of the byte at `offset`; past the end: the last line.
    fn line(&self, offset: usize) -> usize {
        1 + self.0.partition_point(|&end| end < offset)
    }
}

impl<'d> Document<'d> {
    pub(crate) fn new(text: &'d str, lines: &'d LineEnds, file: &'d Path) -> Self {
        Self { file, text, lines }
    }

    pub(crate) fn file(&self) -> &'d Path {
        self.file
    }

    /// The text as a tree of values, each with the range of bytes it was written in.
    pub(crate) fn parse(&self) -> Result<Spanned<DeTable<'d>>, SceneError> {
        if let Some((limit, what)) = document_size::excess(self.text) {
            return Err(SceneError::TooMuch { file: self.file.into(), limit, what });
        }
        DeTable::parse(self.text).map_err(|error| self.syntax_error(error.span(), error.message()))
    }

    pub(crate) fn line(&self, offset: usize) -> usize {
        self.lines.line(offset)
    }

    /// Another place, for a reader who is in this file: `on line 3`, or `in room.toml:3`.
    pub(crate) fn seen_from_here(&self, other: &Document<'_>, offset: usize) -> String {
        let line = other.line(offset);
        if other.file == self.file {
            format!("on line {line}")
        } else {
            format!("in {}:{line}", other.file.display())
        }
    }

    pub(crate) fn location(&self, offset: usize, key: String) -> Box<Location> {
        Box::new(Location { file: self.file.into(), line: self.line(offset), key })
    }

    /// What the file is, if its name is of something else than TOML, and where that belongs.
    fn other_kind(&self) -> Option<&'static str> {
        let is_csv = self.file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        if is_csv {
            Some("a table, such as a hand (`--hand`) or a recording (`phantom3 replay`)")
        } else if crate::model::is_named(self.file) {
            Some(
                "a model, which a scene names: shape = { kind = \"mesh\", file = \"cup.obj\" }; `phantom3 check` says how a \
                 model is understood",
            )
        } else {
            None
        }
    }

    fn syntax_error(&self, span: Option<Range<usize>>, message: &str) -> SceneError {
        let offset = span.map_or(0, |span| span.start);
        SceneError::Syntax {
            file: self.file.into(),
            line: self.line(offset),
            column: column_of(self.text.as_bytes(), offset),
            message: self.other_kind().map_or_else(
                || toml_slips::explain(self.text, offset, message),
                |kind| format!("by its name it is {kind}"),
            ),
        }
    }
}

/// The line, counted from 1, of the byte at `offset`; past the end: the last line.
pub(crate) fn line_of(text: &[u8], offset: usize) -> usize {
    1 + before(text, offset).iter().filter(|&&byte| byte == b'\n').count()
}

/// The column in characters, counted from 1. Bytes that continue a character do not count.
fn column_of(text: &[u8], offset: usize) -> usize {
    let line = before(text, offset).rsplit(|&byte| byte == b'\n').next().unwrap_or_default();
    1 + line.iter().filter(|&&byte| byte & 0b1100_0000 != 0b1000_0000).count()
}

fn before(text: &[u8], offset: usize) -> &[u8] {
    &text[..offset.min(text.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_and_in_characters() {
        let text = "a\nä = x".as_bytes();
        assert_eq!((line_of(text, 0), column_of(text, 0)), (1, 1));
        assert_eq!((line_of(text, 2), column_of(text, 2)), (2, 1));
        let offset_of_x = text.len() - 1;
        assert_eq!((line_of(text, offset_of_x), column_of(text, offset_of_x)), (2, 5));
    }

    #[test]
    fn lines_found_once_are_those_that_counting_finds() {
        for text in ["", "\n", "a", "a\n\nb\n", "a\r\nb", "ä\nö"] {
            let lines = LineEnds::of(text);
            for offset in 0..text.len() + 2 {
                let counted = line_of(text.as_bytes(), offset);
                assert_eq!(lines.line(offset), counted, "byte {offset} of {text:?}");
            }
        }
    }

    #[test]
    fn an_offset_past_the_end_is_on_the_last_line() {
        assert_eq!(line_of(b"a\nb\n", 99), 3);
        assert_eq!(column_of(b"a\nb", 99), 2);
    }
}
