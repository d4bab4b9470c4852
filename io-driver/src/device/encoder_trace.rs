//! Plays back a trace of raw encoder counters, as if the device were moving again.
//!
//! Problem: a fault seen in the laboratory has to be seen again without the device.
//! Model: `t,c0,c1,c2` with the raw counters of the three encoders, before extension, sign and
//! reduction; sampled and held: a counter keeps its value until the next row. Columns may come in
//! any order.
//! Units: seconds and counts; counters may be written as unsigned (0 to `2^bits - 1`) or signed
//! (from `-2^(bits-1)`) numbers, which the extension of counters takes as the same.
//! Invariants: a time before the first row, or not a number, gives the first row.
//! Cost: [`EncoderReplay::counts_at`] constant while time runs on, logarithmic after a jump; no
//! allocation.

use std::path::Path;

use thiserror::Error;

use crate::table::{Cells, Place, TableError, TableReader, TimeCursor};

/// Raw counters over time.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderTrace {
    times_s: Vec<f64>,
    counts: Vec<[i64; 3]>,
}

/// A trace and the place at which it is being read.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderReplay {
    trace: EncoderTrace,
    cursor: TimeCursor,
}

/// Why a text is not an encoder trace.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TraceError {
    /// Not a table of whole numbers over time.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column that is not a counter.
    #[error("{at}: found an unknown column, allowed: `t` and the counters `c0`, `c1`, `c2`")]
    UnknownColumn {
        /// Where.
        at: Place,
    },
    /// A counter without a column.
    #[error("{at}: found no such column, allowed: `t` and all three counters `c0`, `c1`, `c2`")]
    MissingColumn {
        /// Where, with the missing column.
        at: Place,
    },
}

const COUNTERS: [&str; 3] = ["c0", "c1", "c2"];

impl EncoderTrace {
    /// Reads a trace of counters of `count_bits` bits, 1 to 32; `file` is only named in errors,
    /// never opened.
    ///
    /// # Errors
    /// [`TraceError`] names file, line and column of the first mistake.
    pub fn parse(text: &str, file: &Path, count_bits: u32) -> Result<Self, TraceError> {
        let reader = TableReader::open(text, file)?;
        let columns = counter_columns(&reader)?;
        let range = 1i64 << count_bits.clamp(1, 32);
        let table = reader.rows(&Cells::Integers(-range / 2..=range - 1))?;
        let rows = table.cells.chunks_exact(table.columns);
        // Whole numbers below 2^53 in size: exact.
        let counts = rows.map(|row| columns.map(|column| row[column] as i64)).collect();
        Ok(Self { times_s: table.times_s, counts })
    }

    /// Time of the last row, from which on the counters stand still; zero if that is negative.
    pub fn duration_s(&self) -> f64 {
        self.times_s.last().map_or(0.0, |last| last.max(0.0))
    }
}

impl EncoderReplay {
    /// Starts at the beginning.
    pub fn new(trace: EncoderTrace) -> Self {
        Self { trace, cursor: TimeCursor::default() }
    }

    /// The raw counters at a time.
    pub fn counts_at(&mut self, time_s: f64) -> [i64; 3] {
        let row = self.cursor.seek(&self.trace.times_s, time_s).unwrap_or(0);
        self.trace.counts[row]
    }

    /// The trace being played.
    pub fn trace(&self) -> &EncoderTrace {
        &self.trace
    }
}

/// Columns of the three counters.
fn counter_columns(reader: &TableReader<'_>) -> Result<[usize; 3], TraceError> {
    let unknown = reader.columns().iter().find(|column| !COUNTERS.contains(column));
    if let Some(column) = unknown {
        return Err(TraceError::UnknownColumn { at: reader.header_place(column) });
    }
    let mut columns = [0; 3];
    for (column, name) in columns.iter_mut().zip(COUNTERS) {
        let found = reader.columns().iter().position(|&header| header == name);
        *column = found.ok_or_else(|| TraceError::MissingColumn { at: reader.header_place(name) })?;
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoders::{EncoderExtender, wrapped};
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<EncoderTrace, TraceError> {
        EncoderTrace::parse(text, Path::new("trace.csv"), 16)
    }

    fn message(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn counters_hold_their_value_until_the_next_row() {
        let trace = parse("t,c0,c1,c2\n0,1,2,3\n0.5,65535,-32768,0\n").unwrap();
        assert_eq!(trace.duration_s(), 0.5);
        let mut replay = EncoderReplay::new(trace);
        assert_eq!(replay.counts_at(-1.0), [1, 2, 3]);
        assert_eq!(replay.counts_at(0.499_999), [1, 2, 3]);
        assert_eq!(replay.counts_at(0.5), [65_535, -32_768, 0]);
        assert_eq!(replay.counts_at(1e9), [65_535, -32_768, 0]);
        assert_eq!(replay.counts_at(f64::NAN), [1, 2, 3]);
    }

    #[test]
    fn columns_may_come_in_any_order() {
        let trace = parse("t,c2,c0,c1\n0,3,1,2\n").unwrap();
        assert_eq!(EncoderReplay::new(trace).counts_at(0.0), [1, 2, 3]);
    }

    #[test]
    fn mistakes_name_line_column_found_and_allowed() {
        assert_eq!(
            message("t,c0,c1,c2\n0,1,2,65536\n"),
            "trace.csv:2: column `c2`: found `65536`, allowed: a whole number from -32768 to 65535"
        );
        assert!(message("t,c0,c1,c2\n0,1,2.5,3\n").contains("trace.csv:2: column `c1`: found `2.5`"));
        assert!(message("t,c0,c1\n0,1,2\n").contains("trace.csv:1: column `c2`: found no such column"));
        assert!(message("t,c0,c1,c2,c3\n0,1,2,3,4\n").contains("column `c3`: found an unknown column"));
        assert!(message("t,c0,c1,c2\n").contains("found the end of the file"));
        assert!(message("t,c0,c1,c2\n1,0,0,0\n1,0,0,0\n").contains("trace.csv:3: column `t`"));
    }

    proptest! {
        /// A joint that wanders over many turns of its counter, recorded raw and played back.
        #[test]
        fn a_replayed_trace_gives_the_same_joint_counts(
            steps in prop::collection::vec(prop::array::uniform3(-30_000i64..30_000), 1..100),
        ) {
            let walk: Vec<[i64; 3]> = steps.iter().scan([0i64; 3], |at, step| {
                *at = std::array::from_fn(|j| at[j] + step[j]);
                Some(*at)
            }).collect();
            let lines = walk.iter().enumerate().map(|(k, at)| {
                let [a, b, c] = at.map(|count| wrapped(count, 16));
                format!("{},{a},{b},{c}\n", k as f64 / 1000.0)
            });
            let text: String = std::iter::once("t,c0,c1,c2\n".to_owned()).chain(lines).collect();
            let mut replay = EncoderReplay::new(parse(&text).unwrap());
            let mut extender = EncoderExtender::new(16);
            for (k, at) in walk.iter().enumerate() {
                prop_assert_eq!(extender.extend(replay.counts_at(k as f64 / 1000.0)), *at);
            }
        }

        #[test]
        fn no_text_panics(text in any::<String>(), rest in "[tc0-9,.\\- \r\n]{0,80}", bits: u32) {
            let file = Path::new("x.csv");
            for text in [&text, &rest, &format!("t,c0,c1,c2\n{rest}")] {
                if let Ok(trace) = EncoderTrace::parse(text, file, bits) {
                    let _ = EncoderReplay::new(trace).counts_at(0.5);
                }
            }
        }
    }
}
