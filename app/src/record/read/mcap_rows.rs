//! Rows of an MCAP file, read from front to back: an index, which a killed process did not write, is not needed.

use super::ReadError;
use crate::columns::Names;
use crate::record::about::{About, InputFile, names_of};
use crate::record::mcap_file::{ABOUT, COLUMNS, ORDER_TOPIC, TICK_TOPIC};
use crate::record::schema::order;
use crate::record::tick;
use crate::record::wire::each_field;
use crate::row::{BodyRow, Row};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A longer record is none of ours: a length that is garbage must not ask for all memory.
const MOST_RECORD_BYTES: usize = 256 << 20;
/// Read at once.
const AT_ONCE_BYTES: usize = 256 * 1024;

pub(super) struct McapRows {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    channels: Channels,
    first: Option<(Row, Vec<BodyRow>)>,
    rows: u64,
    pub(super) names: Names,
    pub(super) period_ns: u64,
    pub(super) about: About,
    pub(super) cut: Option<String>,
    /// Orders that were met so far, each with its tick.
    pub(super) orders: Vec<(u64, String)>,
}

/// Those that are read.
#[derive(Debug, Clone, Copy, Default)]
struct Channels {
    tick: Option<u16>,
    orders: Option<u16>,
}

/// What a record was.
enum Found {
    /// A tick.
    Row(Box<Row>, Vec<BodyRow>),
    /// Something else.
    Other,
    /// The end of the file.
    End,
}

impl McapRows {
    pub(super) fn open(path: &Path) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(|source| ReadError::Io { file: path.into(), source })?;
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_record_length_limit(MOST_RECORD_BYTES);
        let mut rows = Self {
            path: path.into(),
            file,
            reader: LinearReader::new_with_options(options),
            channels: Channels::default(),
            first: None,
            rows: 0,
            names: Names::default(),
            period_ns: 0,
            about: About::default(),
            cut: None,
            orders: Vec::new(),
        };
        rows.first = rows.read_row()?;
        if rows.names.fingers.is_empty() || rows.period_ns == 0 {
            let why = rows.cut.take().unwrap_or_else(|| "it has no metadata of a run".into());
            return Err(ReadError::NoRecording { file: path.into(), why });
        }
        Ok(rows)
    }

    pub(super) fn next_row(&mut self) -> Result<Option<(Row, Vec<BodyRow>)>, ReadError> {
        match self.first.take() {
            Some(row) => Ok(Some(row)),
            None => self.read_row(),
        }
    }

    fn read_row(&mut self) -> Result<Option<(Row, Vec<BodyRow>)>, ReadError> {
        while self.cut.is_none() {
            match self.read_record()? {
                Found::Row(row, bodies) => {
                    self.rows += 1;
                    return Ok(Some((*row, bodies)));
                }
                Found::Other => {}
                Found::End => return Ok(None),
            }
        }
        Ok(None)
    }

    fn read_record(&mut self) -> Result<Found, ReadError> {
        let mut failure = None;
        let found = loop {
            match self.reader.next_event() {
                None => return Ok(Found::End),
                Some(Ok(LinearReadEvent::ReadRequest(least))) => {
                    let room = self.reader.insert(least.clamp(AT_ONCE_BYTES, MOST_RECORD_BYTES));
                    let read = read_some(&mut self.file, room);
                    let read = read.map_err(|source| ReadError::Io { file: self.path.clone(), source })?;
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    match mcap::parse_record(opcode, data) {
                        Ok(record) => break Some(own(record, self.channels, &self.names)),
                        Err(error) => failure = Some(error),
                    }
                }
                Some(Err(error)) => failure = Some(error),
            }
            if failure.is_some() {
                break None;
            }
        };
        match (found, failure) {
            (Some(found), _) => self.keep(found),
            (None, Some(McapError::UnexpectedEof)) => {
                self.cut =
                    Some("it ends in the middle, as when a disk is full or a process was killed".into());
                Ok(Found::End)
            }
            (None, Some(McapError::BadMagic)) if self.rows == 0 => {
                Err(ReadError::NoRecording { file: self.path.clone(), why: "it is no MCAP file".into() })
            }
            (None, failure) => {
                Err(self.damaged(&failure.map_or_else(String::new, |error| error.to_string())))
            }
        }
    }

    /// Keeps what was found for later.
    fn keep(&mut self, found: Kept) -> Result<Found, ReadError> {
        match found {
            Kept::Row(row) => {
                let (row, bodies) = (*row).ok_or_else(|| self.damaged("a tick is no tick of this scene"))?;
                return Ok(Found::Row(Box::new(row), bodies));
            }
            Kept::Facts(name, facts) if name == ABOUT => {
                self.period_ns = facts.get("period_ns").and_then(|text| text.parse().ok()).unwrap_or(0);
                self.about.facts = facts;
            }
            Kept::Facts(name, facts) if name == COLUMNS => {
                let names = names_of(&facts);
                self.names =
                    names.ok_or_else(|| self.damaged("the names of the columns are not complete"))?;
            }
            Kept::File(file) => self.about.files.push(file),
            Kept::Order(order) => self.orders.extend(order),
            Kept::Channels(found) => self.channels = found,
            Kept::Facts(..) | Kept::Nothing => {}
        }
        Ok(Found::Other)
    }

    fn damaged(&self, why: &str) -> ReadError {
        ReadError::Damaged { file: self.path.clone(), rows: self.rows, why: why.into() }
    }
}

type Facts = std::collections::BTreeMap<String, String>;

/// What is taken out of a record.
enum Kept {
    Row(Box<Option<(Row, Vec<BodyRow>)>>),
    Facts(String, Facts),
    File(InputFile),
    Order(Option<(u64, String)>),
    Channels(Channels),
    Nothing,
}

fn own(record: Record<'_>, channels: Channels, names: &Names) -> Kept {
    match record {
        Record::Message { header, data } if Some(header.channel_id) == channels.tick => {
            Kept::Row(Box::new(tick::read(&data, names)))
        }
        Record::Message { header, data } if Some(header.channel_id) == channels.orders => {
            Kept::Order(read_order(&data))
        }
        Record::Metadata(metadata) => Kept::Facts(metadata.name, metadata.metadata),
        Record::Attachment { header, data, .. } => {
            Kept::File(InputFile { name: header.name, bytes: data.into_owned() })
        }
        Record::Channel(channel) if channel.topic == TICK_TOPIC => {
            Kept::Channels(Channels { tick: Some(channel.id), ..channels })
        }
        Record::Channel(channel) if channel.topic == ORDER_TOPIC => {
            Kept::Channels(Channels { orders: Some(channel.id), ..channels })
        }
        _ => Kept::Nothing,
    }
}

/// When it was taken, and its words.
fn read_order(message: &[u8]) -> Option<(u64, String)> {
    let (mut tick, mut words) = (0, String::new());
    each_field(message, |field, value| {
        match field {
            order::TICK => tick = value.whole()?,
            order::WORDS => words = value.text()?.to_owned(),
            _ => {}
        }
        Some(())
    })?;
    Some((tick, words))
}

fn read_some(file: &mut File, room: &mut [u8]) -> io::Result<usize> {
    loop {
        match file.read(room) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
