//! A recording, row by row, whatever its format; also one whose end is missing.
//!
//! Model: what ends in the middle (a killed process, a full disk, a copy that broke off) is read as far as it is whole,
//! and [`RecordedRun::cut`] says so. What is there but wrong is an error.

mod csv_lines;
mod csv_rows;
mod mcap_chunk;
mod mcap_record;
mod mcap_rows;
mod tick_order;

use super::about::About;
use super::destination::RunFormat;
use super::opened::HALF_REPLACED;
use crate::columns::Names;
use crate::row::{BodyRow, Row};
pub(crate) use csv_lines::CsvLines;
use csv_rows::CsvRows;
pub(crate) use csv_rows::{check_cells, header_fault};
use mcap_rows::McapRows;
use rt_core::file_kind::{self, BEGIN_BYTES};
use rt_core::input_file;
use rt_core::limits;
use rt_core::plain_text::{is_harmful, quoted};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use thiserror::Error;
pub(crate) use tick_order::{LONGEST_GAP_S, TimeOrder};

/// Why a file is no recording.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It cannot be read.
    #[error("cannot read the recording {file}: {source}")]
    Io {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is something else.
    #[error("{file} is no recording of `phantom3 run --record`: {why}")]
    NoRecording {
        /// Which.
        file: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// It may be a recording, in a form that is not read.
    #[error("{file}: {why}")]
    Unsupported {
        /// Which.
        file: PathBuf,
        /// What is not read, and what is.
        why: String,
    },
    /// A row of a table is wrong.
    #[error("{file}:{line}: {why}")]
    BadRow {
        /// Which.
        file: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong.
        why: String,
    },
    /// There is no memory for its next rows, which may be sound.
    #[error("there is not enough memory to read {file} behind its row {rows}; {}", more_memory())]
    Memory {
        /// Which.
        file: PathBuf,
        /// Rows before it.
        rows: u64,
    },
    /// A part of the file is damaged.
    #[error("{file}: damaged behind {rows} good rows: {why}")]
    Damaged {
        /// Which.
        file: PathBuf,
        /// Rows before it.
        rows: u64,
        /// What is wrong.
        why: String,
    },
}

impl ReadError {
    /// Nothing is known to be wrong with the file.
    pub fn is_of_memory(&self) -> bool {
        matches!(self, Self::Memory { .. })
    }
}

fn more_memory() -> String {
    limits::memory_limit().map_or_else(
        || "end other programs, or give the machine more memory".into(),
        |limit| format!("raise the limit {limit}"),
    )
}

/// The orders in a recording as far as it can be read, each with the tick in which it was taken. A table has none.
pub fn orders(file: &Path) -> Vec<(u64, String)> {
    let Some(mut rows) = is_mcap(file).then(|| McapRows::open(file).ok()).flatten() else {
        return Vec::new();
    };
    while let Ok(Some(_)) = rows.next_row() {}
    rows.orders
}

/// A recording being read.
pub struct RecordedRun {
    rows: Rows,
}

enum Rows {
    Csv(Box<CsvRows>),
    Mcap(Box<McapRows>),
}

impl RecordedRun {
    /// Opens it and reads what stands before the first row.
    ///
    /// # Errors
    /// If it cannot be read or is something else.
    pub fn open(file: &Path) -> Result<Self, ReadError> {
        check_begin(file)?;
        let rows = if is_mcap(file) {
            Rows::Mcap(Box::new(McapRows::open(file)?))
        } else if is_parquet(file) {
            let why =
                "it is a Parquet table, which is for other tools; name the MCAP or CSV that it was made of";
            return Err(ReadError::NoRecording { file: file.into(), why: why.into() });
        } else {
            Rows::Csv(Box::new(CsvRows::open(file)?))
        };
        Ok(Self { rows })
    }

    /// The names of fingers, objects and entities. A table names entities only as they are touched, so this grows.
    pub fn names(&self) -> &Names {
        match &self.rows {
            Rows::Csv(rows) => &rows.names,
            Rows::Mcap(rows) => &rows.names,
        }
    }

    /// Length of a tick (ns).
    pub fn period_ns(&self) -> u64 {
        match &self.rows {
            Rows::Csv(rows) => rows.period_ns,
            Rows::Mcap(rows) => rows.period_ns,
        }
    }

    /// What it tells of its run, if its format tells any.
    pub fn about(&self) -> Option<&About> {
        match &self.rows {
            Rows::Csv(_) => None,
            Rows::Mcap(rows) => Some(&rows.about),
        }
    }

    /// Whether its rows have the velocities that rendering saw.
    pub fn has_velocities(&self) -> bool {
        matches!(self.rows, Rows::Mcap(_))
    }

    /// The next row and its bodies; `None` behind the last.
    ///
    /// # Errors
    /// If it cannot be read or is damaged.
    pub fn next_row(&mut self) -> Result<Option<(Row, Vec<BodyRow>)>, ReadError> {
        match &mut self.rows {
            Rows::Csv(rows) => rows.next_row(),
            Rows::Mcap(rows) => rows.next_row(),
        }
    }

    /// Known behind the last row: how it ends, if that is in the middle.
    pub fn cut(&self) -> Option<&str> {
        match &self.rows {
            Rows::Csv(rows) => rows.cut(),
            Rows::Mcap(rows) => rows.cut.as_deref(),
        }
    }
}

/// Refuses a text that a terminal would act on: names go from recordings to people and into files of ours.
pub(crate) fn check_text(text: &str) -> Result<(), String> {
    if text.contains(is_harmful) {
        return Err(format!("found {}, allowed: no control characters", quoted(text)));
    }
    Ok(())
}

/// Refuses what can be told from the first bytes to be no recording in any format.
pub(crate) fn check_begin(file: &Path) -> Result<(), ReadError> {
    let mut begin = Vec::with_capacity(BEGIN_BYTES);
    let opened =
        input_file::open(file).and_then(|file| file.take(BEGIN_BYTES as u64).read_to_end(&mut begin));
    opened.map_err(|source| ReadError::Io { file: file.into(), source })?;
    let why = match &begin[..] {
        [] => Some("it is empty"),
        // More of them are a hole in a file.
        [HALF_REPLACED, next, ..] if *next != HALF_REPLACED => Some(
            "whoever wrote it was killed while it took the place of an earlier one, and what it has may be of both",
        ),
        begin if input_file::is_utf16(begin) => Some(input_file::UTF16),
        begin => file_kind::mistaken(begin),
    };
    why.map_or(Ok(()), |why| Err(ReadError::NoRecording { file: file.into(), why: why.into() }))
}

/// By its ending; or, whatever it is called, by its first bytes.
pub(crate) fn is_mcap(file: &Path) -> bool {
    RunFormat::of(file) == Ok(RunFormat::Mcap) || begins_with(file, mcap::MAGIC)
}

/// By its first bytes.
pub(crate) fn is_parquet(file: &Path) -> bool {
    begins_with(file, b"PAR1")
}

/// What is no regular file is left alone.
fn begins_with(file: &Path, magic: &[u8]) -> bool {
    let mut found = Vec::with_capacity(magic.len());
    let opened = input_file::open(file).ok();
    let read = opened.and_then(|file| file.take(magic.len() as u64).read_to_end(&mut found).ok());
    read.is_some() && found == magic
}
