//! A recording's table, whatever file it lies in: CSV, MCAP or Parquet.
//!
//! Model: columns have names, rows have cells. A recording whose end is missing is read as far as it is whole.

use super::recorded::RecordedError;
use crate::bounded_lines::BoundedLines;
use crate::columns::{Cell, columns, each_cell};
use crate::record::read::{
    MOST_ROW_BYTES, RecordedRun, TimeOrder, check_begin, check_text, is_mcap, is_parquet,
};
use csv::{StringRecord, Terminator};
use io_driver::say::say;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use parquet::record::reader::RowIter;
use rt_core::input_file;
use rt_core::plain_text::beginning;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
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
            let run = RecordedRun::open(file)?;
            let columns = columns(run.names()).into_iter().map(|column| column.name).collect();
            (columns, Rows::Run(Box::new(run)))
        } else if is_parquet(file) {
            let (columns, rows) = open_parquet(file).map_err(|source| unreadable(file, source))?;
            (columns, Rows::Parquet(Box::new(rows)))
        } else {
            let (columns, rows) = CsvTable::open(file).map_err(|source| unreadable(file, source))?;
            (columns, Rows::Csv(Box::new(rows)))
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
            Rows::Csv(csv) => csv.next_row().map_err(|source| unreadable(&self.file, source))?,
            Rows::Run(run) => next_of_run(run)?,
            Rows::Parquet(rows) => next_of_parquet(rows).map_err(|source| unreadable(&self.file, source))?,
        };
        match cells {
            Some(cells) => {
                self.read += 1;
                let line = self.read + 1;
                for (index, cell) in cells.iter().enumerate() {
                    let Value::Text(text) = cell else { continue };
                    check_text(text).map_err(|why| {
                        let name = self.columns.get(index).map_or("", String::as_str);
                        bad_text(
                            &self.file,
                            line,
                            &format!("column {} ({}): {why}", index + 1, beginning(name)),
                        )
                    })?;
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
            Rows::Csv(csv) => csv.is_cut.then_some("the last row is not complete and is left out"),
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

fn unreadable(file: &Path, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> RecordedError {
    RecordedError::Read { file: file.into(), source: source.into() }
}

fn bad_text(file: &Path, line: u64, why: &str) -> RecordedError {
    RecordedError::BadText { file: file.into(), line, why: why.into() }
}

/// Text, whose last line may be cut off.
struct CsvTable {
    reader: csv::Reader<BoundedLines<File>>,
    row: StringRecord,
    /// Where the file ends, if that is in the middle of a line (bytes).
    cut_at: Option<u64>,
    is_cut: bool,
}

impl CsvTable {
    fn open(file: &Path) -> Result<(Vec<String>, Self), csv::Error> {
        let mut opened = input_file::open(file)?;
        let cut_at = end_of_cut_file(&mut opened)?;
        // Lines end as for `export` and `replay`: the carriage returns that Windows puts before the ends do not count.
        let mut builder = csv::ReaderBuilder::new();
        builder.terminator(Terminator::Any(b'\n'));
        let mut reader = builder.from_reader(BoundedLines::new(opened, MOST_ROW_BYTES));
        let columns = reader.headers()?;
        let last = columns.len().saturating_sub(1);
        let columns =
            columns.iter().enumerate().map(|(index, name)| without_end(name, index == last).into()).collect();
        Ok((columns, Self { reader, row: StringRecord::new(), cut_at, is_cut: false }))
    }

    fn next_row(&mut self) -> Result<Option<Vec<Value>>, csv::Error> {
        let is_row = self.reader.read_record(&mut self.row);
        // Half a number is a number, and half a row is an error: neither counts.
        if self.cut_at == Some(self.reader.position().byte()) && !matches!(is_row, Ok(false)) {
            self.is_cut = true;
            return Ok(None);
        }
        let last = self.row.len().saturating_sub(1);
        let cell = |(index, cell)| Value::Text(without_end(cell, index == last).into());
        Ok(is_row?.then(|| self.row.iter().enumerate().map(cell).collect()))
    }
}

/// The cell, of a line that may end as those of Windows.
fn without_end(cell: &str, is_last: bool) -> &str {
    if is_last { cell.strip_suffix('\r').unwrap_or(cell) } else { cell }
}

/// `None`: it ends with a whole line, or is a pipe.
fn end_of_cut_file(file: &mut File) -> std::io::Result<Option<u64>> {
    let length = file.metadata().ok().filter(std::fs::Metadata::is_file).map_or(0, |found| found.len());
    if length == 0 {
        return Ok(None);
    }
    let mut last = [0];
    file.seek(SeekFrom::Start(length - 1))?;
    file.read_exact(&mut last)?;
    file.rewind()?;
    Ok((last != *b"\n").then_some(length))
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
