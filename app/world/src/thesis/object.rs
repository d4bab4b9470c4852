//! An object file (Melder figure 7.3): `Key=Value` lines.

use super::ThesisError;
use super::list::without_comment;
use nalgebra::{Matrix3, UnitQuaternion};
use rt_core::plain_text::quoted;
use std::cell::Cell;
use std::path::{Path, PathBuf};

/// What an object file says; it takes note of what was asked for, so that the rest can be told.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectFile {
    file: PathBuf,
    lines: Vec<Line>,
}

#[derive(Debug, Clone, PartialEq)]
struct Line {
    line: usize,
    key: String,
    value: String,
    is_used: Cell<bool>,
}

/// Reads an object file; `file` is named in errors and not opened.
///
/// # Errors
/// A line without `=`; a key given twice, but for `Entity`.
pub fn read_object(text: &str, file: &Path) -> Result<ObjectFile, ThesisError> {
    let mut object = ObjectFile { file: file.into(), lines: Vec::new() };
    for (index, words) in text.lines().map(without_comment).enumerate() {
        let line = index + 1;
        if words.is_empty() {
            continue;
        }
        let (key, value) = words
            .split_once('=')
            .ok_or_else(|| object.wrong(line, quoted(words), "`Key=Value`, or a comment behind //"))?;
        let (key, value) = (key.trim().to_owned(), value.trim().to_owned());
        if let Some(first) = object.lines.iter().find(|other| other.key == key && key != "Entity") {
            let found = format!("{key}, already given on line {}", first.line);
            return Err(object.wrong(line, found, "each key once"));
        }
        object.lines.push(Line { line, key, value, is_used: Cell::new(false) });
    }
    Ok(object)
}

impl ObjectFile {
    /// Its name.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The object files that a mixed environment consists of.
    pub fn parts(&self) -> Vec<String> {
        let parts = self.lines.iter().filter(|line| line.key == "Entity");
        parts.inspect(|line| line.is_used.set(true)).map(|line| line.value.clone()).collect()
    }

    pub(super) fn text(&self, key: &str) -> Option<&str> {
        let line = self.lines.iter().find(|line| line.key == key)?;
        line.is_used.set(true);
        Some(&line.value)
    }

    pub(super) fn truth(&self, key: &str) -> Result<Option<bool>, ThesisError> {
        let Some(word) = self.text(key) else { return Ok(None) };
        match word.to_ascii_lowercase().as_str() {
            "true" | "1" => Ok(Some(true)),
            "false" | "0" => Ok(Some(false)),
            _ => Err(self.refused(key, "True or False")),
        }
    }

    /// `N` finite numbers between commas.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, ThesisError> {
        let Some(list) = self.text(key) else { return Ok(None) };
        let read: Vec<f64> = list.split(',').filter_map(|word| word.trim().parse().ok()).collect();
        let is_whole = read.len() == list.split(',').count() && read.iter().all(|number| number.is_finite());
        let numbers = if is_whole { <[f64; N]>::try_from(read).ok() } else { None };
        let allowed = if N == 1 { "a number".to_owned() } else { format!("{N} numbers between commas") };
        numbers.map(Some).ok_or_else(|| self.refused(key, &allowed))
    }

    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, ThesisError> {
        Ok(self.numbers::<1>(key)?.map(|[number]| number))
    }

    pub(super) fn positive(&self, key: &str) -> Result<Option<f64>, ThesisError> {
        match self.number(key)? {
            Some(number) if number <= 0.0 => Err(self.refused(key, "a number above 0")),
            number => Ok(number),
        }
    }

    pub(super) fn orientation(&self) -> Result<Option<UnitQuaternion<f64>>, ThesisError> {
        let Some(rows) = self.numbers::<9>("Orientation")? else { return Ok(None) };
        let matrix = Matrix3::from_row_slice(&rows);
        let is_rotation = (matrix * matrix.transpose() - Matrix3::identity()).amax() < ROUNDING
            && matrix.determinant() > 0.0;
        if !is_rotation {
            return Err(self.refused("Orientation", "the 9 numbers of a rotation matrix, row by row"));
        }
        Ok(Some(UnitQuaternion::from_matrix(&matrix)))
    }

    pub(super) fn missing(&self, key: &'static str, allowed: &'static str) -> ThesisError {
        ThesisError::Missing { file: self.file.clone(), key, allowed }
    }

    pub(super) fn refused(&self, key: &str, allowed: &str) -> ThesisError {
        let line = self.lines.iter().find(|line| line.key == key);
        let found = line.map_or_else(String::new, |line| format!("{key}={}", line.value));
        self.wrong(line.map_or(0, |line| line.line), quoted(&found), allowed)
    }

    /// Lines that nobody asked for.
    pub(super) fn rest(&self) -> impl Iterator<Item = (usize, String)> {
        let unused = self.lines.iter().filter(|line| !line.is_used.get());
        unused.map(|line| (line.line, format!("{}={}", line.key, line.value)))
    }

    fn wrong(&self, line: usize, found: String, allowed: &str) -> ThesisError {
        ThesisError::Line { file: self.file.clone(), line, found, allowed: allowed.into() }
    }
}

/// Files give three digits or more.
const ROUNDING: f64 = 2e-3;
