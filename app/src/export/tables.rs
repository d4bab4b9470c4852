//! The tables of an export, written side by side.
//!
//! Invariants: a table that cannot be made leaves the others as they were; one that cannot be written any further, or that
//! nobody reads any more, ends, and the others go on to their ends. A table takes the place of an earlier one when it is
//! whole ([`Replacement`]).

use super::parquet_file::ParquetFile;
use super::wrong;
use crate::columns::Names;
use crate::outcome::RunFailure;
use crate::record::Opened;
use crate::record::destination::{TableFormat, is_standard_output};
use crate::record::read::RecordedRun;
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use io_driver::say::say;
use parquet::errors::ParquetError;
use rt_core::limits;
use rt_core::output_file::is_claimed;
use rt_core::replacement::{Replacement, is_torn};
use std::io;
use std::path::{Path, PathBuf};

/// Those that are still written, and the first failure of another.
pub(super) struct Tables {
    open: Vec<Table>,
    failure: Result<(), RunFailure>,
}

/// A table being written.
struct Table {
    out: PathBuf,
    format: Format,
    /// `None`: it goes to the standard output.
    replacement: Option<Replacement>,
}

enum Format {
    Csv(Box<Recording>),
    Parquet(Box<ParquetFile>),
}

/// Why a table ended before its end.
enum Ended {
    Csv(RecordingError),
    Parquet(ParquetError),
}

impl Tables {
    /// Begins them all, or none.
    ///
    /// # Errors
    /// The first that cannot be made.
    pub(super) fn begin(outs: &[(PathBuf, TableFormat)], recorded: &RecordedRun) -> Result<Self, RunFailure> {
        let replace = |(out, _): &(PathBuf, TableFormat)| {
            let begun = (!is_standard_output(out)).then(|| Replacement::begin(out)).transpose();
            begun.map_err(|error| not_created(out, &error))
        };
        // All of them before one is emptied.
        let replacements = outs.iter().map(replace).collect::<Result<Vec<_>, _>>()?;
        let begin = |((out, format), replacement): (&(PathBuf, TableFormat), Option<Replacement>)| {
            Table::begin(out, *format, replacement, recorded)
        };
        let open = outs.iter().zip(replacements).map(begin).collect::<Result<_, _>>()?;
        Ok(Self { open, failure: Ok(()) })
    }

    /// Whether none is written any more.
    pub(super) fn is_empty(&self) -> bool {
        self.open.is_empty()
    }

    /// Appends a row to each.
    pub(super) fn append(&mut self, row: &Row, bodies: &[BodyRow], names: &Names) {
        let Self { open, failure } = self;
        open.retain_mut(|table| match table.format.append(row, bodies, names) {
            Ok(()) => true,
            Err(ended) => {
                note(failure, ended.tell(&table.out, table.replacement.as_ref()));
                false
            }
        });
    }

    /// Leaves those places as they were that have drafts; the failure that this is.
    pub(super) fn give_up(self, why: &dyn std::fmt::Display) -> RunFailure {
        let is_drafted = |table: &Table| table.replacement.as_ref().is_some_and(Replacement::is_drafted);
        let part =
            self.open.iter().find(|table| !is_drafted(table)).map(|table| table.out.display().to_string());
        let left = part.map_or_else(|| NOTHING_LEFT.to_owned(), |part| format!("{part} is not complete"));
        RunFailure::Results(format!("{why}; no table is written: {left}"))
    }

    /// Writes them to their ends; returns those that are whole, and the first failure.
    pub(super) fn finish(self) -> (Vec<PathBuf>, Result<(), RunFailure>) {
        let Self { open, mut failure } = self;
        let finish = |table: Table| {
            let Table { out, format, replacement } = table;
            let finished = format.finish().map_err(|ended| ended.tell(&out, replacement.as_ref()));
            finished.map_err(|told| note(&mut failure, told)).ok().map(|()| (out, replacement))
        };
        let whole: Vec<_> = open.into_iter().filter_map(finish).collect();
        let keep = |(out, replacement): (PathBuf, Option<Replacement>)| {
            let is_drafted = replacement.as_ref().is_some_and(Replacement::is_drafted);
            let kept = replacement.map_or(Ok(()), Replacement::keep);
            let told = |error| note(&mut failure, Some(not_kept(&out, &error, is_drafted)));
            kept.map_err(told).ok().map(|()| out)
        };
        (whole.into_iter().filter_map(keep).collect(), failure)
    }
}

/// The first failure is told last; others are told at once.
fn note(first: &mut Result<(), RunFailure>, failure: Option<RunFailure>) {
    match failure {
        None => {}
        Some(failure) if first.is_ok() => *first = Err(failure),
        Some(failure) => say(format_args!("phantom3: {failure}")),
    }
}

impl Table {
    fn begin(
        out: &Path,
        format: TableFormat,
        replacement: Option<Replacement>,
        recorded: &RecordedRun,
    ) -> Result<Self, RunFailure> {
        let refused = |error: &io::Error| not_created(out, error);
        let file = match &replacement {
            Some(replacement) => replacement.file().and_then(|file| Opened::of(file, out)),
            None => Opened::open(out),
        };
        let file = file.map_err(|error| refused(&error))?;
        let (names, period_ns) = (recorded.names(), recorded.period_ns());
        let format = match format {
            TableFormat::Csv => {
                Recording::begin(file, names.clone(), period_ns).map(|csv| Format::Csv(Box::new(csv)))
            }
            TableFormat::Parquet => {
                ParquetFile::begin(file, names, period_ns).map(|parquet| Format::Parquet(Box::new(parquet)))
            }
        };
        let format = format.map_err(|error| match error {
            RecordingError::Create { source, .. } => refused(&source),
            other => wrong(&other),
        })?;
        Ok(Self { out: out.into(), format, replacement })
    }
}

impl Format {
    fn append(&mut self, row: &Row, bodies: &[BodyRow], names: &Names) -> Result<(), Ended> {
        match self {
            Self::Csv(csv) => {
                csv.learn_entities(names);
                csv.append(row, bodies).map_err(Ended::Csv)
            }
            Self::Parquet(parquet) => parquet.append(row, bodies, names).map_err(Ended::Parquet),
        }
    }

    fn finish(self) -> Result<(), Ended> {
        match self {
            Self::Csv(csv) => csv.finish().map(drop).map_err(Ended::Csv),
            Self::Parquet(parquet) => parquet.finish().map_err(Ended::Parquet),
        }
    }
}

impl Ended {
    /// In words; `None`: who reads the standard output has seen enough.
    fn tell(self, out: &Path, replacement: Option<&Replacement>) -> Option<RunFailure> {
        let is_drafted = replacement.is_some_and(Replacement::is_drafted);
        let place = out.display();
        let words = match self {
            Self::Csv(error) if error.is_of_a_reader_who_left() => return None,
            Self::Csv(RecordingError::Write { file, source, .. }) if is_drafted => {
                format!("cannot write {}: {source}; {NOTHING_LEFT}", file.display())
            }
            Self::Csv(RecordingError::Write { file, source, rows, .. }) => {
                format!("cannot write {}: {source}; it is complete up to its row {rows}", file.display())
            }
            Self::Csv(RecordingError::NotBegun { file, source }) => {
                format!("cannot write {}: {source}; what was there is as it was", file.display())
            }
            Self::Csv(error) => error.to_string(),
            Self::Parquet(error) => {
                let left = if is_drafted { NOTHING_LEFT } else { "what is there is of no use" };
                format!(
                    "cannot write {place}: {error}; a Parquet file without its end cannot be read: {left}"
                )
            }
        };
        Some(RunFailure::Results(words))
    }
}

const NOTHING_LEFT: &str = "nothing is left of it, and what was there is as it was";

fn not_created(out: &Path, error: &io::Error) -> RunFailure {
    let place = out.display();
    if is_claimed(error) {
        return wrong(&format_args!(
            "cannot create {place}: {error}; name another file, or wait until that has ended"
        ));
    }
    let why = limits::with_remedy_or(error, "name a file that can be written");
    wrong(&format_args!("cannot create {place}: {why}"))
}

fn not_kept(out: &Path, error: &io::Error, is_drafted: bool) -> RunFailure {
    let left = if is_torn(error) || !is_drafted { String::new() } else { format!("; {NOTHING_LEFT}") };
    RunFailure::Results(format!("cannot write {}: {error}{left}", out.display()))
}
