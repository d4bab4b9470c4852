//! Lines of a table in text, the same for whoever reads one.
//!
//! Model: whole lines without their ends, of bounded length. A last line without its end is left out: half a number is a
//! number. Windows line ends, a byte order mark, and empty lines behind the last row, which editors and spreadsheets add, do
//! not count.

use super::ReadError;
use rt_core::{input_file, separators};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The longest row, of as many objects as a scene can have.
const MOST_ROW_BYTES: usize = 64 << 20;

/// A table, line by line.
pub(crate) struct CsvLines {
    file: PathBuf,
    reader: BufReader<File>,
    is_first: bool,
    /// Read already, to know whether the empty lines before it are the end.
    next: Option<String>,
    /// End of the table, if that is in the middle of a line.
    pub(crate) cut: Option<String>,
}

impl CsvLines {
    /// Opens a regular file.
    pub(crate) fn open(file: &Path) -> Result<Self, ReadError> {
        let opened = input_file::open(file).map_err(|source| ReadError::Io { file: file.into(), source })?;
        Ok(Self { file: file.into(), reader: BufReader::new(opened), is_first: true, next: None, cut: None })
    }

    /// The first line, which there has to be.
    pub(crate) fn header(&mut self) -> Result<String, ReadError> {
        self.next_line()?.ok_or_else(|| self.no_recording("it has no first line".into()))
    }

    /// A whole line without its end; `None` behind the last.
    pub(crate) fn next_line(&mut self) -> Result<Option<String>, ReadError> {
        if let Some(next) = self.next.take() {
            return Ok(Some(next));
        }
        let is_header = self.is_first;
        let line = self.read_line()?;
        if is_header || line.as_ref().is_none_or(|line| !line.is_empty()) {
            return Ok(line);
        }
        while let Some(next) = self.read_line()? {
            if !next.is_empty() {
                self.next = Some(next);
                return Ok(line);
            }
        }
        Ok(None)
    }

    fn read_line(&mut self) -> Result<Option<String>, ReadError> {
        let mut bytes = Vec::new();
        let read = self.reader.by_ref().take(MOST_ROW_BYTES as u64).read_until(b'\n', &mut bytes);
        read.map_err(|source| ReadError::Io { file: self.file.clone(), source })?;
        if bytes.len() == MOST_ROW_BYTES {
            return Err(self.no_recording(format!("a line has more than {MOST_ROW_BYTES} bytes")));
        }
        let is_first = std::mem::replace(&mut self.is_first, false);
        if bytes.pop_if(|last| *last == b'\n').is_none() {
            let mistaken = std::str::from_utf8(&bytes).ok().and_then(separators::mistaken_ends);
            if let Some(words) = mistaken.filter(|_| is_first) {
                return Err(self.no_recording(words.into()));
            }
            if !bytes.is_empty() {
                self.cut = Some("the last row is not complete and is left out".into());
            }
            return Ok(None);
        }
        bytes.pop_if(|last| *last == b'\r');
        let text = String::from_utf8(bytes).map_err(|_| self.no_recording("it is no text".into()))?;
        Ok(Some(separators::unquoted_line(match text.strip_prefix('\u{feff}').filter(|_| is_first) {
            Some(rest) => rest.to_owned(),
            None => text,
        })))
    }

    fn no_recording(&self, why: String) -> ReadError {
        ReadError::NoRecording { file: self.file.clone(), why }
    }
}
