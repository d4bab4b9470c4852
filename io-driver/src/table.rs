//! Reads a CSV table of numbers over time.
//!
//! Problem: hand files and encoder traces are the same thing, rows of numbers at rising times,
//! written by scripts, spreadsheets and other laboratories.
//! Model: the first line names the columns, the first column is `t` in seconds, each further line
//! has one number per column. Spaces around cells, Windows line ends, a byte order mark and blank
//! lines at the end are tolerated; nothing else is guessed.
//! Invariants of a [`TimeTable`]: at least one row; times rise strictly; all cells are finite and
//! at most [`MAX_MAGNITUDE`] in size, so that differences and slopes are finite as well.
//! Cost: one pass, a million rows of four columns in a fraction of a second. [`TimeCursor`] finds
//! the row of a time in constant time when time runs on, in logarithmic time after a jump.

use std::fmt::{self, Display};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use rt_core::separators;
use thiserror::Error;

mod time_cursor;

pub use time_cursor::TimeCursor;

/// Largest number a table may hold: enough for counters of 32 bits and for a year in
/// microseconds, exactly representable, and its square is still finite.
pub const MAX_MAGNITUDE: f64 = 1e15;

/// The most a file of a table may have: hours of a finger's path at 1 kHz.
pub const MAX_TABLE_BYTES: u64 = 512 << 20;

/// Line of the first row: the header has line 1.
const FIRST_ROW_LINE: usize = 2;

/// The place of a mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// File as the user named it.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Name of the column, empty if the whole line is meant.
    pub column: String,
}

/// Why a text is not a table.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TableError {
    /// Not even a header.
    #[error(
        "{at}: found an empty file, allowed: a header line that starts with `t,` and then rows of numbers"
    )]
    Empty {
        /// Where.
        at: Place,
    },
    /// Lines of old Macintoshes.
    #[error("{at}: {words}")]
    Ends {
        /// Where.
        at: Place,
        /// What is wrong, and what to do.
        words: &'static str,
    },
    /// The first column is not the time.
    #[error("{at}: found the first column {found}, allowed: `t`, the time in seconds{hint}")]
    NoTime {
        /// Where.
        at: Place,
        /// The cell.
        found: String,
        /// What may be wrong.
        hint: &'static str,
    },
    /// A column without a name, or one name twice.
    #[error(
        "{at}: found {found} as the name of column {number}, allowed: names that are not empty and different"
    )]
    BadName {
        /// Where.
        at: Place,
        /// The cell.
        found: String,
        /// Number of the column, from 1.
        number: usize,
    },
    /// Header only.
    #[error("{at}: found the end of the file after the header, allowed: at least one row of numbers")]
    NoRows {
        /// Where.
        at: Place,
    },
    /// A row is longer or shorter than the header.
    #[error("{at}: found {found} cells, allowed: {allowed}, as in the header{hint}")]
    RowLength {
        /// Where.
        at: Place,
        /// What may be wrong.
        hint: &'static str,
        /// Cells in the row.
        found: usize,
        /// Cells in the header.
        allowed: usize,
    },
    /// A cell is no number, or one that is not allowed here.
    #[error("{at}: found {found}, allowed: {allowed}")]
    BadCell {
        /// Where.
        at: Place,
        /// The cell.
        found: String,
        /// What would be right.
        allowed: String,
    },
    /// Time stands still or runs back.
    #[error(
        "{at}: found {found_s} s after {previous_s} s, allowed: a time later than that of the row before"
    )]
    TimeNotRising {
        /// Where.
        at: Place,
        /// Time of this row.
        found_s: String,
        /// Time of the row before.
        previous_s: String,
    },
}

/// What the cells beside the time may be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cells {
    /// Any finite number up to [`MAX_MAGNITUDE`].
    Numbers,
    /// Whole numbers of a range, itself within plus and minus [`MAX_MAGNITUDE`].
    Integers(RangeInclusive<i64>),
}

/// A table whose header has been read, and whose rows have not.
#[derive(Debug, Clone)]
pub struct TableReader<'a> {
    file: &'a Path,
    header: Vec<&'a str>,
    rows: &'a str,
}

/// Rows of numbers at rising times.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeTable {
    /// Time of each row, seconds.
    pub times_s: Vec<f64>,
    /// The other cells, row after row.
    pub cells: Vec<f64>,
    /// Cells per row, without the time.
    pub columns: usize,
}

impl Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)?;
        if self.column.is_empty() { Ok(()) } else { write!(f, ": column `{}`", self.column) }
    }
}

impl<'a> TableReader<'a> {
    /// Reads the header; `file` is only named in errors, never opened.
    ///
    /// # Errors
    /// [`TableError`] if there is no header, its first column is not `t`, or names are missing or
    /// double.
    pub fn open(text: &'a str, file: &'a Path) -> Result<Self, TableError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim_end();
        let (first, rows) = text.split_once('\n').unwrap_or((text, ""));
        let reader = Self { file, header: cells(first).collect(), rows };
        reader.check_header(text.is_empty())?;
        Ok(reader)
    }

    /// Names of the columns beside the time.
    pub fn columns(&self) -> &[&'a str] {
        &self.header[1..]
    }

    /// Place of a column's name, for errors of the caller.
    pub fn header_place(&self, column: &str) -> Place {
        self.place(1, column)
    }

    /// Place of a cell, for errors of the caller; rows count from 0.
    pub fn cell_place(&self, row: usize, column: &str) -> Place {
        self.place(row + FIRST_ROW_LINE, column)
    }

    /// Reads all rows.
    ///
    /// # Errors
    /// [`TableError`] at the first cell that is not allowed.
    pub fn rows(&self, allowed: &Cells) -> Result<TimeTable, TableError> {
        self.rows_of(|_| allowed.clone())
    }

    /// Reads all rows; each column, by its name, has cells of its own kind.
    ///
    /// # Errors
    /// [`TableError`] at the first cell that is not allowed.
    pub fn rows_of(&self, allowed: impl Fn(&str) -> Cells) -> Result<TimeTable, TableError> {
        let allowed: Vec<Cells> = self.columns().iter().map(|column| allowed(column)).collect();
        let columns = allowed.len();
        let mut table = TimeTable { times_s: Vec::new(), cells: Vec::new(), columns };
        if self.rows.is_empty() {
            return Err(TableError::NoRows { at: self.place(1, "") });
        }
        for (index, row) in self.rows.split('\n').enumerate() {
            self.row(index + FIRST_ROW_LINE, row, &allowed, &mut table)?;
        }
        Ok(table)
    }

    fn check_header(&self, empty: bool) -> Result<(), TableError> {
        if let Some(words) = separators::mistaken_ends(&self.header.join(",")) {
            return Err(TableError::Ends { at: self.place(1, ""), words });
        }
        if empty {
            return Err(TableError::Empty { at: self.place(1, "") });
        }
        if self.header[0] != "t" {
            let hint = separators::hint_for_header(&self.header.join(","));
            return Err(TableError::NoTime { at: self.place(1, ""), found: quote(self.header[0]), hint });
        }
        let bad = (1..self.header.len())
            .find(|&i| self.header[i].is_empty() || self.header[..i].contains(&self.header[i]));
        bad.map_or(Ok(()), |i| {
            let found = quote(self.header[i]);
            Err(TableError::BadName { at: self.place(1, ""), found, number: i + 1 })
        })
    }

    fn row(
        &self,
        line: usize,
        row: &str,
        allowed: &[Cells],
        table: &mut TimeTable,
    ) -> Result<(), TableError> {
        if row.trim().is_empty() {
            return Err(self.row_length(line, row));
        }
        let mut cells = cells(row);
        for (index, &name) in self.header.iter().enumerate() {
            let cell = cells.next().ok_or_else(|| self.row_length(line, row))?;
            if index == 0 {
                let time_s = self.cell(line, name, cell, &Cells::Numbers)?;
                self.check_time(line, time_s, table.times_s.last().copied())?;
                table.times_s.push(time_s);
            } else {
                table.cells.push(self.cell(line, name, cell, &allowed[index - 1])?);
            }
        }
        if cells.next().is_some() { Err(self.row_length(line, row)) } else { Ok(()) }
    }

    fn cell(&self, line: usize, column: &str, cell: &str, allowed: &Cells) -> Result<f64, TableError> {
        let value = match allowed {
            Cells::Numbers => cell.parse().ok().filter(|value: &f64| value.abs() <= MAX_MAGNITUDE),
            // Exact: the range ends at MAX_MAGNITUDE, far below 2^53.
            Cells::Integers(range) => cell.parse().ok().filter(|v| range.contains(v)).map(|v: i64| v as f64),
        };
        value.ok_or_else(|| TableError::BadCell {
            at: self.place(line, column),
            found: quote(cell),
            allowed: format!("{allowed}{}", separators::hint_for_half_a_cell(cell)),
        })
    }

    fn check_time(&self, line: usize, time_s: f64, previous_s: Option<f64>) -> Result<(), TableError> {
        match previous_s {
            Some(previous_s) if time_s <= previous_s => Err(TableError::TimeNotRising {
                at: self.place(line, "t"),
                found_s: time_s.to_string(),
                previous_s: previous_s.to_string(),
            }),
            _ => Ok(()),
        }
    }

    fn row_length(&self, line: usize, row: &str) -> TableError {
        let found = if row.trim().is_empty() { 0 } else { row.split(',').count() };
        let hint = separators::hint_for_row(row, self.header.len());
        TableError::RowLength { at: self.place(line, ""), found, allowed: self.header.len(), hint }
    }

    fn place(&self, line: usize, column: &str) -> Place {
        Place { file: self.file.to_owned(), line, column: clip(column) }
    }
}

impl Display for Cells {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers => write!(f, "a finite number up to {MAX_MAGNITUDE:e} in size"),
            Self::Integers(range) => {
                write!(f, "a whole number from {} to {}", range.start(), range.end())
            }
        }
    }
}

fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(|cell| separators::unquoted(cell).trim())
}

fn quote(cell: &str) -> String {
    if cell.is_empty() { "nothing".to_owned() } else { format!("`{}`", clip(cell)) }
}

/// What of a cell fits into a message, and cannot disturb a terminal.
fn clip(cell: &str) -> String {
    const SHOWN: usize = 40;
    let shown: String = cell.chars().take(SHOWN).flat_map(char::escape_debug).collect();
    if cell.chars().nth(SHOWN).is_some() { shown + "..." } else { shown }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Result<TimeTable, TableError> {
        TableReader::open(text, Path::new("a/b.csv"))?.rows(&Cells::Numbers)
    }

    fn message(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn rows_become_times_and_cells() {
        let table = read("t,x,y\n0,1,2\n0.5,3,-4e-1\n").unwrap();
        assert_eq!(
            table,
            TimeTable { times_s: vec![0.0, 0.5], cells: vec![1.0, 2.0, 3.0, -0.4], columns: 2 }
        );
    }

    #[test]
    fn spreadsheet_dialects_read_the_same() {
        let plain = read("t,x\n0,1\n1,2").unwrap();
        for dialect in [
            "\u{feff}t,x\r\n0,1\r\n1,2\r\n",
            " t , x \n 0 ,\t1\n1, +2.0 \n\n  \n",
            "t,x\n0,1\n1,2\r\n\r\n",
            "\"t\", \"x\"\n0,\"1\"\n1,2",
        ] {
            assert_eq!(read(dialect).unwrap(), plain, "{dialect:?}");
        }
    }

    #[test]
    fn every_mistake_names_file_line_column_found_and_allowed() {
        assert_eq!(
            message("t,x\n0,1\n1,2;5\n"),
            "a/b.csv:3: column `x`: found `2;5`, allowed: a finite number up to 1e15 in size"
        );
        assert_eq!(
            message("t,x\n0,1\n0,2\n"),
            "a/b.csv:3: column `t`: found 0 s after 0 s, allowed: a time later than that of the row before"
        );
        assert_eq!(message("t,x\n0,1\n1\n"), "a/b.csv:3: found 1 cells, allowed: 2, as in the header");
        assert_eq!(message("t,x\n0,1,2\n"), "a/b.csv:2: found 3 cells, allowed: 2, as in the header");
        assert_eq!(message("t,x\n0,1\n\n1,1\n"), "a/b.csv:3: found 0 cells, allowed: 2, as in the header");
        assert!(message("t,x\n0,\n").contains("a/b.csv:2: column `x`: found nothing"));
        assert!(message("time,x\n0,1\n").contains("a/b.csv:1: found the first column `time`"));
        assert!(message("t,x,x\n0,1\n").contains("found `x` as the name of column 3"));
        assert!(message("t,,x\n0,1\n").contains("found nothing as the name of column 2"));
        assert!(message("t,x\n\n\n").contains("found the end of the file after the header"));
        assert!(message(" \n").contains("found an empty file"));
    }

    #[test]
    fn numbers_that_are_no_measurement_are_refused() {
        for cell in ["nan", "inf", "-infinity", "1e400", "1.1e15", "0x1", "1 2", "1_000"] {
            assert!(matches!(read(&format!("t,x\n0,{cell}\n")), Err(TableError::BadCell { .. })), "{cell}");
            assert!(matches!(read(&format!("t,x\n{cell},0\n")), Err(TableError::BadCell { .. })), "{cell}");
        }
    }

    #[test]
    fn whole_numbers_keep_to_their_range() {
        let read = |cell: &str| {
            let text = format!("t,c\n0.5,{cell}\n");
            TableReader::open(&text, Path::new("c.csv")).unwrap().rows(&Cells::Integers(-8..=15))
        };
        assert_eq!(read("-8").unwrap().cells, [-8.0]);
        for cell in ["16", "-9", "1.0", "1e0", "99999999999999999999"] {
            let message = read(cell).unwrap_err().to_string();
            assert!(message.contains("allowed: a whole number from -8 to 15"), "{message}");
        }
    }

    #[test]
    fn a_huge_cell_makes_a_short_message() {
        let message = message(&format!("t,x\n0,{}\n", "\u{1b}z".repeat(100_000)));
        assert!(message.len() < 500 && !message.contains('\u{1b}'), "{message}");
    }

    proptest! {
        #[test]
        fn no_text_panics(text in any::<String>(), rest in "[t,xy0-9.e+\\- \r\n\u{feff}]{0,80}") {
            let _ = read(&text);
            let _ = read(&rest);
            let _ = read(&format!("t,x\n{rest}"));
        }
    }
}
