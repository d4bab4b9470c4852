//! Words of a text and the line each stands on.

use super::{ModelError, a_number, number, shown};

pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

pub(super) struct Words<'t> {
    text: &'t [u8],
    /// Behind the last word.
    at: usize,
    line: usize,
}

impl<'t> Words<'t> {
    pub(super) fn new(text: &'t [u8]) -> Self {
        Self::from_line(text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text), 1)
    }

    /// Of a text that begins with this line of its file.
    pub(super) fn from_line(text: &'t [u8], line: usize) -> Self {
        Self { text, at: 0, line }
    }

    pub(super) fn next(&mut self) -> Option<&'t [u8]> {
        while self.text.get(self.at)?.is_ascii_whitespace() {
            self.line += usize::from(self.text[self.at] == b'\n');
            self.at += 1;
        }
        let rest = &self.text[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        Some(&rest[..length])
    }

    /// Passes over the rest of the last word's line, as of a name.
    pub(super) fn skip_line(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
    }

    pub(super) fn expect(&mut self, keyword: &str) -> Result<(), ModelError> {
        match self.next() {
            Some(word) if word.eq_ignore_ascii_case(keyword.as_bytes()) => Ok(()),
            other => Err(self.wrong(other, &format!("`{keyword}`"))),
        }
    }

    pub(super) fn number(&mut self) -> Result<f64, ModelError> {
        let word = self.next();
        word.and_then(number).ok_or_else(|| self.wrong(word, &a_number(word)))
    }

    /// The line of the last word.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    pub(super) fn wrong(&self, found: Option<&[u8]>, allowed: &str) -> ModelError {
        let found = found.map_or_else(|| "the end of the file; it may be cut short".into(), shown);
        ModelError::Line { line: self.line, found, allowed: allowed.into() }
    }
}
