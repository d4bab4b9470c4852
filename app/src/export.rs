//! `phantom3 export`: a recording as a table for other tools.
//!
//! Model: rows are read from either format and written with the same columns that `run --record OUT.csv` writes, so CSV
//! out of MCAP is byte for byte what would have been recorded. A recording whose end is missing is exported as far as it
//! is whole, and that is told.

mod parquet_file;

use crate::cli::is_same_file;
use crate::outcome::{RunFailure, Stop};
use crate::record::read::{ReadError, RecordedRun};
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use clap::Args;
use io_driver::device::run_time_s;
use io_driver::say::{say, tell};
use parquet_file::ParquetFile;
use std::path::{Path, PathBuf};

/// What becomes what.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The recording (MCAP or CSV)
    recording: PathBuf,
    /// As CSV, with the columns of `run --record OUT.csv`
    #[arg(long, value_name = "OUT")]
    csv: Option<PathBuf>,
    /// As Parquet, with the same columns
    #[arg(long, value_name = "OUT", required_unless_present = "csv")]
    parquet: Option<PathBuf>,
}

/// Exports.
///
/// # Errors
/// A recording that cannot be read or is none, and tables that cannot be written.
pub fn execute(args: &ExportArgs) -> Result<Stop, RunFailure> {
    let mut recorded = RecordedRun::open(&args.recording).map_err(|error| wrong(&error))?;
    for out in args.csv.iter().chain(&args.parquet) {
        if is_same_file(out, &args.recording) {
            return Err(wrong(&format_args!(
                "{} would be overwritten by its own export; name another file",
                args.recording.display()
            )));
        }
    }
    let mut tables = Tables::create(args, &recorded)?;
    let mut last = None;
    let mut rows = 0u64;
    let end = loop {
        match recorded.next_row() {
            Ok(Some((row, bodies))) => {
                tables.append(&row, &bodies, &recorded)?;
                (last, rows) = (Some(row.run_tick), rows + 1);
            }
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    tables.finish()?;
    let until_s = last.map_or(0.0, |tick| run_time_s(tick.cast_signed(), recorded.period_ns()));
    tell_end(&args.recording, end, recorded.cut(), rows, until_s)?;
    for out in args.csv.iter().chain(&args.parquet) {
        tell(format_args!("{} ({rows} rows)", out.display()));
    }
    Ok(Stop::Finished)
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
    end.map_err(|error| RunFailure::Results(error.to_string()))
}

pub(crate) fn wrong(error: &dyn std::fmt::Display) -> RunFailure {
    RunFailure::Start(error.to_string())
}

/// What is written.
struct Tables {
    csv: Option<Recording>,
    parquet: Option<ParquetFile>,
}

impl Tables {
    fn create(args: &ExportArgs, recorded: &RecordedRun) -> Result<Self, RunFailure> {
        let (names, period_ns) = (recorded.names(), recorded.period_ns());
        let csv =
            |path: &PathBuf| Recording::create(path, names.clone(), period_ns).map_err(|error| late(&error));
        let parquet = |path: &PathBuf| ParquetFile::create(path, names, period_ns);
        Ok(Self {
            csv: args.csv.as_ref().map(csv).transpose()?,
            parquet: args.parquet.as_ref().map(parquet).transpose()?,
        })
    }

    fn append(&mut self, row: &Row, bodies: &[BodyRow], recorded: &RecordedRun) -> Result<(), RunFailure> {
        if let Some(csv) = &mut self.csv {
            csv.learn_entities(recorded.names());
            csv.append(row, bodies).map_err(|error| late(&error))?;
        }
        if let Some(parquet) = &mut self.parquet {
            parquet.append(row, bodies, recorded.names())?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), RunFailure> {
        if let Some(csv) = self.csv {
            csv.finish().map_err(|error| late(&error))?;
        }
        self.parquet.map_or(Ok(()), ParquetFile::finish)
    }
}

/// No run goes on without an export that fails.
fn late(error: &RecordingError) -> RunFailure {
    match error {
        RecordingError::Create { file, source } => wrong(&format_args!(
            "cannot create {}: {source}; name a file that can be written",
            file.display()
        )),
        RecordingError::Write { file, source, rows, .. } => RunFailure::Results(format!(
            "cannot write {}: {source}; it is complete up to its row {rows}",
            file.display()
        )),
    }
}
