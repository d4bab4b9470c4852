//! `phantom3 export`: a recording as a table for other tools.
//!
//! Model: rows are read from either format and written with the same columns that `run --record OUT.csv` writes, so CSV
//! out of MCAP is byte for byte what would have been recorded. A recording whose end is missing, or that is damaged behind
//! its first row, is exported as far as it is whole, and that is told; damage is a fault (status 3). Of one without a row
//! nothing is written.

mod parquet_file;
mod tables;

use crate::outcome::{RunFailure, Stop};
use crate::outputs::{self, Output};
use crate::record::destination::{TableFormat, is_standard_output, shown};
use crate::record::read::{ReadError, RecordedRun};
use clap::Args;
use io_driver::device::run_time_s;
use io_driver::say::say;
use rt_core::plain_text::Plain;
use std::path::{Path, PathBuf};
use tables::Tables;

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
    let first = recorded.next_row().map_err(|error| wrong(&error))?;
    let first = first.ok_or_else(|| without_rows(&args.recording, recorded.cut()))?;
    let mut tables = Tables::begin(&outs, &recorded)?;
    let (mut next, mut last, mut rows) = (Some(first), 0, 0u64);
    let end = loop {
        match next.take().map_or_else(|| recorded.next_row(), |row| Ok(Some(row))) {
            Ok(Some((row, bodies))) => {
                tables.append(&row, &bodies, recorded.names());
                (last, rows) = (row.run_tick, rows + 1);
            }
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
        if tables.is_empty() {
            // Nobody is left who wants more rows.
            return tables.finish().1.map(|()| Stop::Finished);
        }
    };
    if let Err(error) = &end
        && error.is_of_memory()
    {
        // It is not the recording that ends here: half of it would be taken for all.
        return Err(tables.give_up(error));
    }
    let (whole, failure) = tables.finish();
    let until_s = run_time_s(last.cast_signed(), recorded.period_ns());
    let part = if end.is_err() { ", up to the damage" } else { "" };
    let end = tell_end(&args.recording, end, recorded.cut(), rows, until_s);
    let is_taken = outs.iter().any(|(out, _)| is_standard_output(out));
    for out in &whole {
        outputs::tell(&format_args!("{} ({rows} rows{part})", Plain(shown(out).display())), is_taken);
    }
    end.and(failure).map(|()| Stop::Finished)
}

fn without_rows(recording: &Path, cut: Option<&str>) -> RunFailure {
    let cut = cut.map_or_else(String::new, |cut| format!(": {cut}"));
    wrong(&format_args!("{}: it has no rows{cut}", recording.display()))
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
