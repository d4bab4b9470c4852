//! The tables of an export, written side by side.
//!
//! Invariant: a table that cannot be made leaves the others as they were; one that cannot be written any further, or that
//! nobody reads any more, ends, and the others go on to their ends.

use super::parquet_file::ParquetFile;
use super::wrong;
use crate::columns::Names;
use crate::outcome::RunFailure;
use crate::record::destination::TableFormat;
use crate::record::read::RecordedRun;
use crate::record::{Opened, begin_all};
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use io_driver::say::say;
use std::path::PathBuf;

/// Those that are still written, and the first failure of another.
pub(super) struct Tables {
    open: Vec<(PathBuf, Table)>,
    failure: Result<(), RunFailure>,
}

/// A table being written.
enum Table {
    Csv(Box<Recording>),
    Parquet(Box<ParquetFile>),
}

/// Why a table ended before its end.
enum Ended {
    /// Who reads the standard output has seen enough.
    Unread,
    Failed(RunFailure),
}

impl Tables {
    /// Begins them all, or none.
    ///
    /// # Errors
    /// The first that cannot be made.
    pub(super) fn begin(outs: &[(PathBuf, TableFormat)], recorded: &RecordedRun) -> Result<Self, RunFailure> {
        let paths: Vec<&PathBuf> = outs.iter().map(|(out, _)| out).collect();
        let begun = begin_all(&paths, |number, file| Table::begin(file, outs[number].1, recorded));
        let begun = begun.map_err(|error| late(&error))?;
        Ok(Self { open: paths.into_iter().cloned().zip(begun).collect(), failure: Ok(()) })
    }

    /// Whether none is written any more.
    pub(super) fn is_empty(&self) -> bool {
        self.open.is_empty()
    }

    /// Appends a row to each.
    pub(super) fn append(&mut self, row: &Row, bodies: &[BodyRow], names: &Names) {
        let Self { open, failure } = self;
        open.retain_mut(|(_, table)| match table.append(row, bodies, names) {
            Ok(()) => true,
            Err(ended) => {
                note(failure, ended);
                false
            }
        });
    }

    /// Writes them to their ends; returns those that are whole, and the first failure.
    pub(super) fn finish(self) -> (Vec<PathBuf>, Result<(), RunFailure>) {
        let Self { open, mut failure } = self;
        let finish = |(out, table): (PathBuf, Table)| match table.finish() {
            Ok(()) => Some(out),
            Err(ended) => {
                note(&mut failure, ended);
                None
            }
        };
        (open.into_iter().filter_map(finish).collect(), failure)
    }
}

/// The first failure is told last; others are told at once.
fn note(first: &mut Result<(), RunFailure>, ended: Ended) {
    match ended {
        Ended::Unread => {}
        Ended::Failed(failure) if first.is_ok() => *first = Err(failure),
        Ended::Failed(failure) => say(format_args!("phantom3: {failure}")),
    }
}

impl Table {
    fn begin(file: Opened, format: TableFormat, recorded: &RecordedRun) -> Result<Self, RecordingError> {
        let (names, period_ns) = (recorded.names(), recorded.period_ns());
        Ok(match format {
            TableFormat::Csv => Self::Csv(Box::new(Recording::begin(file, names.clone(), period_ns)?)),
            TableFormat::Parquet => Self::Parquet(Box::new(ParquetFile::begin(file, names, period_ns)?)),
        })
    }

    fn append(&mut self, row: &Row, bodies: &[BodyRow], names: &Names) -> Result<(), Ended> {
        match self {
            Self::Csv(csv) => {
                csv.learn_entities(names);
                Ok(csv.append(row, bodies)?)
            }
            Self::Parquet(parquet) => parquet.append(row, bodies, names).map_err(Ended::Failed),
        }
    }

    fn finish(self) -> Result<(), Ended> {
        match self {
            Self::Csv(csv) => Ok(csv.finish().map(drop)?),
            Self::Parquet(parquet) => parquet.finish().map_err(Ended::Failed),
        }
    }
}

impl From<RecordingError> for Ended {
    fn from(error: RecordingError) -> Self {
        if error.is_of_a_reader_who_left() { Self::Unread } else { Self::Failed(late(&error)) }
    }
}

/// In the words of an export.
fn late(error: &RecordingError) -> RunFailure {
    match error {
        RecordingError::Create { file, source } => wrong(&format_args!(
            "cannot create {}: {source}; name a file that can be written",
            file.display()
        )),
        RecordingError::Claimed { file } => wrong(&format_args!(
            "cannot create {}: another process writes it; name another file, or wait until that has ended",
            file.display()
        )),
        RecordingError::Format(error) => wrong(error),
        RecordingError::Write { file, source, rows, .. } => RunFailure::Results(format!(
            "cannot write {}: {source}; it is complete up to its row {rows}",
            file.display()
        )),
    }
}
