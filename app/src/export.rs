//! `phantom3 export`: a recording as a table for other tools.
//!
//! Model: rows are read from either format and written with the same columns that `run --record OUT.csv` writes, so CSV
//! out of MCAP is byte for byte what would have been recorded. A recording whose end is missing, or that is damaged behind
//! its first row, is exported as far as it is whole, and that is told; damage is a fault (status 3).

mod parquet_file;

use crate::outcome::{RunFailure, Stop};
use crate::outputs::{self, Output};
use crate::record::destination::{TableFormat, is_standard_output, shown};
use crate::record::read::{ReadError, RecordedRun};
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use clap::Args;
use io_driver::device::run_time_s;
use io_driver::say::say;
use parquet_file::ParquetFile;
use rt_core::plain_text::Plain;
use std::path::{Path, PathBuf};

/// What becomes what.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ExportArgs {
    /// The recording (MCAP or CSV)
    recording: PathBuf,
    /// The tables: OUT.csv with the columns of `run --record OUT.csv`, OUT.parquet with the same columns, - for CSV on the
    /// standard output
    #[arg(value_name = "OUT", required_unless_present_any = ["csv", "parquet"])]
    out: Vec<PathBuf>,
    /// As CSV, whatever the file is called
    #[arg(long, value_name = "OUT")]
    csv: Option<PathBuf>,
    /// As Parquet, whatever the file is called
    #[arg(long, value_name = "OUT")]
    parquet: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  phantom3 export lift.mcap lift.csv
  phantom3 export lift.mcap lift.parquet
  phantom3 export lift.mcap - | head -3";

/// Exports.
///
/// # Errors
/// A recording that cannot be read or is none, and tables that cannot be written.
pub fn execute(args: &ExportArgs) -> Result<Stop, RunFailure> {
    let mut recorded = RecordedRun::open(&args.recording).map_err(|error| wrong(&error))?;
    let outs = args.outs()?;
    // Of a recording without a good row there is no table.
    let mut next = recorded.next_row().map(Some).map_err(|error| wrong(&error))?;
    let mut tables = outs.iter().map(|out| Table::create(out, &recorded)).collect::<Result<Vec<_>, _>>()?;
    let mut last = None;
    let mut rows = 0u64;
    let end = loop {
        match next.take().map_or_else(|| recorded.next_row(), Ok) {
            Ok(Some((row, bodies))) => {
                if !append(&mut tables, &row, &bodies, &recorded)? {
                    // Who reads the standard output has seen enough.
                    return Ok(Stop::Finished);
                }
                (last, rows) = (Some(row.run_tick), rows + 1);
            }
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    tables.into_iter().try_for_each(Table::finish)?;
    let until_s = last.map_or(0.0, |tick| run_time_s(tick.cast_signed(), recorded.period_ns()));
    let part = if end.is_err() { ", up to the damage" } else { "" };
    let end = tell_end(&args.recording, end, recorded.cut(), rows, until_s);
    let is_taken = outs.iter().any(|(out, _)| is_standard_output(out));
    for (out, _) in &outs {
        outputs::tell(&format_args!("{} ({rows} rows{part})", Plain(shown(out).display())), is_taken);
    }
    end.map(|()| Stop::Finished)
}

impl ExportArgs {
    /// Where the tables go, and their formats.
    fn outs(&self) -> Result<Vec<(PathBuf, TableFormat)>, RunFailure> {
        let by_option = [(&self.csv, TableFormat::Csv), (&self.parquet, TableFormat::Parquet)];
        let by_option = by_option.into_iter().filter_map(|(out, format)| Some((out.clone()?, format)));
        let files = self.out.iter().chain(&self.csv).chain(&self.parquet);
        outputs::check(&files.map(|file| Output::table(file)).collect::<Vec<_>>(), &[&self.recording])?;
        let by_ending = self
            .out
            .iter()
            .map(|out| Ok((out.clone(), TableFormat::of(out).map_err(|error| wrong(&error))?)));
        by_ending.chain(by_option.map(Ok)).collect()
    }
}

/// `false`: nobody reads the standard output any more.
fn append(
    tables: &mut [Table],
    row: &Row,
    bodies: &[BodyRow],
    recorded: &RecordedRun,
) -> Result<bool, RunFailure> {
    for table in tables {
        match table {
            Table::Csv(csv) => {
                csv.learn_entities(recorded.names());
                match csv.append(row, bodies) {
                    Err(error) if error.is_of_a_reader_who_left() => return Ok(false),
                    written => written.map_err(|error| late(&error))?,
                }
            }
            Table::Parquet(parquet) => parquet.append(row, bodies, recorded.names())?,
        }
    }
    Ok(true)
}

/// Says how a recording ends, if not as it should; what is damaged is a fault once good rows were read.
pub(crate) fn tell_end(
    file: &Path,
    end: Result<(), ReadError>,
    cut: Option<&str>,
    rows: u64,
    until_s: f64,
) -> Result<(), RunFailure> {
    if let Some(cut) = cut {
        say(format_args!(
            "phantom3: {}: {cut}; what is whole is used: {rows} rows, up to t = {until_s} s",
            file.display()
        ));
    }
    end.map_err(|error| damaged(&error, rows, until_s))
}

/// The fault that damage behind good rows is.
pub(crate) fn damaged(error: &dyn std::fmt::Display, rows: u64, until_s: f64) -> RunFailure {
    RunFailure::Results(format!(
        "{error}; what is whole before it is used: {rows} rows, up to t = {until_s} s"
    ))
}

pub(crate) fn wrong(error: &dyn std::fmt::Display) -> RunFailure {
    RunFailure::Start(error.to_string())
}

/// A table being written.
enum Table {
    Csv(Box<Recording>),
    Parquet(Box<ParquetFile>),
}

impl Table {
    fn create((out, format): &(PathBuf, TableFormat), recorded: &RecordedRun) -> Result<Self, RunFailure> {
        let (names, period_ns) = (recorded.names(), recorded.period_ns());
        Ok(match format {
            TableFormat::Csv => {
                let csv = Recording::create(out, names.clone(), period_ns).map_err(|error| late(&error))?;
                Self::Csv(Box::new(csv))
            }
            TableFormat::Parquet => Self::Parquet(Box::new(ParquetFile::create(out, names, period_ns)?)),
        })
    }

    fn finish(self) -> Result<(), RunFailure> {
        match self {
            Self::Csv(csv) => match csv.finish() {
                Err(error) if error.is_of_a_reader_who_left() => Ok(()),
                finished => finished.map(drop).map_err(|error| late(&error)),
            },
            Self::Parquet(parquet) => parquet.finish(),
        }
    }
}

/// No run goes on without an export that fails.
fn late(error: &RecordingError) -> RunFailure {
    match error {
        RecordingError::Create { file, source } => wrong(&format_args!(
            "cannot create {}: {source}; name a file that can be written",
            file.display()
        )),
        RecordingError::Format(error) => wrong(error),
        RecordingError::Write { file, source, rows, .. } => RunFailure::Results(format!(
            "cannot write {}: {source}; it is complete up to its row {rows}",
            file.display()
        )),
    }
}
