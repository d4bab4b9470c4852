//! A table as Parquet: the columns of a recording, numbers as `double`, words as strings, whole numbers as 64 bits.
//!
//! Model: columns are gathered for a group of rows and written one after the other. Numbers that change little from row
//! to row are split into streams of their first, second, ... bytes, which then compress; words have dictionaries. A
//! Parquet file cannot be read before its end is written, which is why runs do not record it.

use crate::columns::{Cell, CellKind, Names, columns, each_cell};
use crate::record::Opened;
use crate::recording::RecordingError;
use crate::row::{BodyRow, Row};
use parquet::basic::{Compression, ConvertedType, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::sync::Arc;

/// Cells that are gathered at most.
const GROUP_CELLS: usize = 8 << 20;
const GROUP_ROWS: std::ops::RangeInclusive<usize> = 1024..=131_072;

/// A table being written.
pub(super) struct ParquetFile {
    writer: SerializedFileWriter<File>,
    group: Vec<Cells>,
    rows_in_group: usize,
    rows_of_group: usize,
    period_ns: u64,
    words: HashMap<String, ByteArray>,
}

/// What is gathered of a column.
enum Cells {
    Numbers(Vec<f64>),
    Whole(Vec<i64>),
    Words(Vec<ByteArray>),
}

impl ParquetFile {
    /// Empties the file and begins the table.
    ///
    /// # Errors
    /// If that cannot be done.
    pub(super) fn begin(file: Opened, names: &Names, period_ns: u64) -> Result<Self, RecordingError> {
        let columns = columns(names);
        let path = file.path().to_path_buf();
        let create = |source| RecordingError::Create { file: path.clone(), source };
        let failed = |error: ParquetError| create(io::Error::other(error));
        let file = file.empty().map_err(create)?;
        let mut fields = Vec::with_capacity(columns.len());
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_created_by(concat!("phantom3 ", env!("CARGO_PKG_VERSION")).into());
        for column in &columns {
            let (kind, is_word) = match column.kind {
                CellKind::Number => (Physical::DOUBLE, false),
                CellKind::Whole => (Physical::INT64, false),
                CellKind::Text => (Physical::BYTE_ARRAY, true),
            };
            let field =
                Type::primitive_type_builder(&column.name, kind).with_repetition(Repetition::REQUIRED);
            let field = match column.kind {
                CellKind::Text => field
                    .with_logical_type(Some(LogicalType::String))
                    .with_converted_type(ConvertedType::UTF8),
                _ => field,
            };
            fields.push(Arc::new(field.build().map_err(failed)?));
            let at = ColumnPath::from(column.name.as_str());
            properties = match column.kind {
                CellKind::Number => properties.set_column_encoding(at, Encoding::BYTE_STREAM_SPLIT),
                _ => properties.set_column_dictionary_enabled(at, is_word),
            };
        }
        let schema = Type::group_type_builder("recording").with_fields(fields).build().map_err(failed)?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()));
        let rows = GROUP_CELLS / columns.len();
        let group = columns.iter().map(|column| Cells::of(column.kind)).collect();
        Ok(Self {
            writer: writer.map_err(failed)?,
            group,
            rows_in_group: 0,
            rows_of_group: rows.clamp(*GROUP_ROWS.start(), *GROUP_ROWS.end()),
            period_ns,
            words: HashMap::new(),
        })
    }

    pub(super) fn append(
        &mut self,
        row: &Row,
        bodies: &[BodyRow],
        names: &Names,
    ) -> Result<(), ParquetError> {
        let Self { group, words, .. } = self;
        let mut columns = group.iter_mut();
        each_cell(row, bodies, names, self.period_ns, |cell| {
            match (columns.next(), cell) {
                (Some(Cells::Numbers(numbers)), Cell::Number(number)) => numbers.push(number),
                // Bits are bits: a reader that wants 64 buttons sees them.
                (Some(Cells::Whole(numbers)), Cell::Whole(number)) => numbers.push(number.cast_signed()),
                (Some(Cells::Words(all)), Cell::Text(word)) => match words.get(word) {
                    Some(known) => all.push(known.clone()),
                    None => all.push(words.entry(word.to_owned()).or_insert_with(|| word.into()).clone()),
                },
                _ => unreachable!("cells are of the kinds that `columns` tells"),
            }
        });
        self.rows_in_group += 1;
        if self.rows_in_group < self.rows_of_group { Ok(()) } else { self.write_group() }
    }

    pub(super) fn finish(mut self) -> Result<(), ParquetError> {
        if self.rows_in_group > 0 {
            self.write_group()?;
        }
        self.writer.close().map(drop)
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        self.rows_in_group = 0;
        write_columns(&mut self.writer, &mut self.group)
    }
}

fn write_columns(writer: &mut SerializedFileWriter<File>, columns: &mut [Cells]) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for cells in columns {
        let Some(mut column) = group.next_column()? else { break };
        match cells {
            Cells::Numbers(cells) => {
                column.typed::<DoubleType>().write_batch(cells, None, None)?;
                cells.clear();
            }
            Cells::Whole(cells) => {
                column.typed::<Int64Type>().write_batch(cells, None, None)?;
                cells.clear();
            }
            Cells::Words(cells) => {
                column.typed::<ByteArrayType>().write_batch(cells, None, None)?;
                cells.clear();
            }
        }
        column.close()?;
    }
    group.close().map(drop)
}

impl Cells {
    fn of(kind: CellKind) -> Self {
        match kind {
            CellKind::Number => Self::Numbers(Vec::new()),
            CellKind::Whole => Self::Whole(Vec::new()),
            CellKind::Text => Self::Words(Vec::new()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn every_cell_reads_back_bit_for_bit_over_several_groups_of_rows() {
        let names = Names {
            fingers: vec!["a".into()],
            extras: vec![io_driver::device::Extras { orientation: true, buttons: true }],
            entities: vec!["table".into(), "ball".into()],
            bodies: vec!["ball".into()],
            grasp_quality: true,
            ..Names::default()
        };
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.parquet");
        let file = Opened::open(&path).expect("created");
        let mut file = ParquetFile::begin(file, &names, 1_000_000).expect("begun");
        file.rows_of_group = 7;
        let row = |tick: u64| {
            let mut row = Row { run_tick: tick, ..Row::empty() };
            let finger = &mut row.fingers[0];
            finger.hip = Vector3::new(0.1 * tick as f64, -0.0, 1e-300);
            finger.buttons = if tick == 3 { u64::MAX } else { tick };
            finger.entity = (!tick.is_multiple_of(3)).then_some((tick % 2) as u32);
            row
        };
        for tick in 0..20 {
            file.append(&row(tick), &[BodyRow::default()], &names).expect("appended");
        }
        file.finish().expect("finished");
        let reader = SerializedFileReader::new(File::open(&path).expect("there")).expect("a table");
        assert_eq!(reader.metadata().num_row_groups(), 3);
        let mut rows = 0;
        for (tick, read) in (0..).zip(reader.get_row_iter(None).expect("rows")) {
            let mut cells = Vec::new();
            for (_, cell) in read.expect("a row").get_column_iter() {
                cells.push(match cell {
                    Field::Double(number) => format!("{:x}", number.to_bits()),
                    Field::Long(number) => number.cast_unsigned().to_string(),
                    Field::Str(word) => word.clone(),
                    other => panic!("{other:?}"),
                });
            }
            let mut expected = Vec::new();
            each_cell(&row(tick), &[BodyRow::default()], &names, 1_000_000, |cell| {
                expected.push(match cell {
                    Cell::Number(number) => format!("{:x}", number.to_bits()),
                    Cell::Whole(number) => number.to_string(),
                    Cell::Text(word) => word.to_owned(),
                });
            });
            assert_eq!(cells, expected);
            rows += 1;
        }
        assert_eq!(rows, 20);
    }
}
