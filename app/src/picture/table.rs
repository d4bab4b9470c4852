//! A recording's table, whatever file it lies in: CSV, MCAP or Parquet.
//!
//! Model: columns have names, rows have cells. A recording whose end is missing is read as far as it is whole.

use super::recorded::RecordedError;
use crate::columns::{Cell, columns, each_cell, feature_named, friction_named};
use crate::record::read::{
    CsvLines, ReadError, RecordedRun, TimeOrder, check_begin, check_cells, check_text, header_fault, is_mcap,
    is_parquet,
};
use io_driver::say::say;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use parquet::record::reader::RowIter;
use rt_core::plain_text::{beginning, quoted};
use rt_core::{input_file, separators};
use std::path::{Path, PathBuf};

/// A table that is read from its first row to its last.
pub(super) struct Table {
    file: PathBuf,
    columns: Vec<String>,
    rows: Rows,
    read: u64,
    times: TimeOrder,
}

enum Rows {
    Csv(Box<CsvTable>),
    Run(Box<RecordedRun>),
    Parquet(Box<RowIter<'static>>),
}

/// A row of it.
pub(super) struct TableRow {
    /// Where it stands, from 1; the header of a text is line 1.
    line: u64,
    cells: Vec<Value>,
}

enum Value {
    Number(f64),
    Text(String),
}

impl Table {
    /// Opens it and reads which columns there are.
    pub(super) fn open(file: &Path) -> Result<Self, RecordedError> {
        check_begin(file)?;
        let (columns, rows) = if is_mcap(file) {
            open_run(file)?
        } else if is_parquet(file) {
            let (columns, rows) = open_parquet(file).map_err(|source| unreadable(file, source))?;
            (columns, Rows::Parquet(Box::new(rows)))
        } else {
            open_csv(file)?
        };
        for (index, column) in columns.iter().enumerate() {
            check_text(column)
                .map_err(|why| bad_text(file, 1, &format!("its column {}: {why}", index + 1)))?;
        }
        Ok(Self { file: file.into(), columns, rows, read: 0, times: TimeOrder::default() })
    }

    /// The names of its columns.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The next row; `None` behind the last.
    pub(super) fn next_row(&mut self) -> Result<Option<TableRow>, RecordedError> {
        let cells = match &mut self.rows {
            Rows::Csv(csv) => match csv.next_row() {
                Ok(cells) => cells,
                Err(CsvFault::Read(error)) => return Err(error.into()),
                // The header is line 1.
                Err(CsvFault::Row(why)) => return Err(bad_text(&self.file, self.read + 2, &why)),
            },
            Rows::Run(run) => next_of_run(run)?,
            Rows::Parquet(rows) => next_of_parquet(rows).map_err(|source| unreadable(&self.file, source))?,
        };
        match cells {
            Some(cells) => {
                self.read += 1;
                let line = self.read + 1;
                for (index, cell) in cells.iter().enumerate() {
                    let Value::Text(text) = cell else { continue };
                    let name = self.columns.get(index).map_or("", String::as_str);
                    check_text(text)
                        .map_err(|why| format!("column {} ({}): {why}", index + 1, beginning(name)))
                        .and_then(|()| check_word(name, text))
                        .map_err(|why| bad_text(&self.file, line, &why))?;
                }
                Ok(Some(TableRow { line, cells }))
            }
            None => {
                self.tell_cut();
                Ok(None)
            }
        }
    }

    fn tell_cut(&self) {
        let cut = match &self.rows {
            Rows::Csv(csv) => csv.lines.cut.as_deref(),
            Rows::Run(run) => run.cut(),
            Rows::Parquet(_) => None,
        };
        if let Some(cut) = cut {
            say(format_args!("phantom3: {}: {cut}; {} rows are drawn", self.file.display(), self.read));
        }
    }

    /// The number in this column of a row.
    pub(super) fn number(&self, row: &TableRow, column: usize) -> Result<f64, RecordedError> {
        let cell = row.cells.get(column);
        let number = match cell {
            Some(Value::Number(number)) => Some(*number),
            Some(Value::Text(text)) => text.parse().ok(),
            None => None,
        };
        number.filter(|number: &f64| number.is_finite()).ok_or_else(|| RecordedError::NoNumber {
            file: self.file.clone(),
            line: row.line,
            column: beginning(&self.columns[column]).into(),
            found: match cell {
                Some(Value::Number(number)) => number.to_string(),
                Some(Value::Text(text)) => beginning(text).into(),
                None => String::new(),
            },
        })
    }

    /// The time in this column of a row (s), which is later than that of the row before.
    pub(super) fn time(&mut self, row: &TableRow, column: usize) -> Result<f64, RecordedError> {
        let time_s = self.number(row, column)?;
        let said = self.times.check(time_s);
        said.map_err(|why| RecordedError::BadTime { file: self.file.clone(), line: row.line, why })?;
        Ok(time_s)
    }
}

impl TableRow {
    /// The words in this column; empty in a column of numbers.
    pub(super) fn text(&self, column: usize) -> &str {
        match self.cells.get(column) {
            Some(Value::Text(text)) => text,
            _ => "",
        }
    }
}

/// Refuses a word that a recording does not have in such a column.
fn check_word(column: &str, word: &str) -> Result<(), String> {
    let is_known = match column.rsplit_once('_') {
        Some((_, "feature")) => feature_named(word).is_some(),
        Some((_, "friction")) => friction_named(word).is_some(),
        _ => true,
    };
    if is_known {
        return Ok(());
    }
    Err(format!("{} is {}, which is no word for it", beginning(column), quoted(word)))
}

fn unreadable(file: &Path, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> RecordedError {
    RecordedError::Read { file: file.into(), source: source.into() }
}

fn bad_text(file: &Path, line: u64, why: &str) -> RecordedError {
    RecordedError::BadText { file: file.into(), line, why: why.into() }
}

/// A table in text that is not in all columns that of a recording: those that are known are found by their names.
struct CsvTable {
    lines: CsvLines,
    columns: usize,
}

impl CsvTable {
    fn next_row(&mut self) -> Result<Option<Vec<Value>>, CsvFault> {
        let Some(line) = self.lines.next_line().map_err(CsvFault::Read)? else { return Ok(None) };
        let cells: Vec<Value> = line.split(',').map(|cell| Value::Text(cell.into())).collect();
        check_cells(&line, cells.len(), self.columns).map_err(CsvFault::Row)?;
        Ok(Some(cells))
    }
}

/// Why there is no row.
enum CsvFault {
    Read(ReadError),
    Row(String),
}

/// Columns and rows of a table in text. That of a recording is read as by all who read one, so that none is called
/// damaged by some of them alone.
fn open_csv(file: &Path) -> Result<(Vec<String>, Rows), ReadError> {
    let mut lines = CsvLines::open(file)?;
    let header = lines.header()?;
    let Some(why) = header_fault(&header) else { return open_run(file) };
    if !separators::hint_for_header(&header).is_empty() {
        return Err(ReadError::NoRecording { file: file.into(), why });
    }
    let columns: Vec<String> = header.split(',').map(str::to_owned).collect();
    let table = CsvTable { lines, columns: columns.len() };
    Ok((columns, Rows::Csv(Box::new(table))))
}

fn open_run(file: &Path) -> Result<(Vec<String>, Rows), ReadError> {
    let run = RecordedRun::open(file)?;
    let columns = columns(run.names()).into_iter().map(|column| column.name).collect();
    Ok((columns, Rows::Run(Box::new(run))))
}

fn next_of_run(run: &mut RecordedRun) -> Result<Option<Vec<Value>>, RecordedError> {
    let Some((row, bodies)) = run.next_row()? else { return Ok(None) };
    let mut cells = Vec::new();
    each_cell(&row, &bodies, run.names(), run.period_ns(), |cell| {
        cells.push(match cell {
            Cell::Number(number) => Value::Number(number),
            Cell::Whole(whole) => Value::Number(whole as f64),
            Cell::Text(text) => Value::Text(text.into()),
        });
    });
    Ok(Some(cells))
}

fn open_parquet(file: &Path) -> Result<(Vec<String>, RowIter<'static>), ParquetError> {
    let reader = SerializedFileReader::new(input_file::open(file)?)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let columns = schema.columns().iter().map(|column| column.name().to_owned()).collect();
    Ok((columns, RowIter::from_file_into(Box::new(reader))))
}

fn next_of_parquet(rows: &mut RowIter<'static>) -> Result<Option<Vec<Value>>, ParquetError> {
    let Some(row) = rows.next().transpose()? else { return Ok(None) };
    let value = |field: &Field| match field {
        Field::Double(number) => Value::Number(*number),
        Field::Long(whole) => Value::Number(whole.cast_unsigned() as f64),
        Field::Str(text) => Value::Text(text.clone()),
        other => Value::Text(other.to_string()),
    };
    Ok(Some(row.get_column_iter().map(|(_, field)| value(field)).collect()))
}
