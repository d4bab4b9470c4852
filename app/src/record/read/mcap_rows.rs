//! Rows of an MCAP file, read from front to back: an index, which a killed process did not write, is not needed.

use super::mcap_chunk::{self, ChunkError};
use super::mcap_record::{self, McapRecord, RecordError};
use super::tick_order::{TickOrder, check_period};
use super::{ReadError, check_text};
use crate::columns::Names;
use crate::record::about::{About, InputFile, MOST_FILE_BYTES, names_of};
use crate::record::mcap_file::{ABOUT, COLUMNS, END, ORDER_TOPIC, TICK_TOPIC};
use crate::record::schema::order;
use crate::record::tick;
use crate::record::wire::each_field;
use crate::row::{BodyRow, Row};
use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use rt_core::input_file;
use rt_core::plain_text::beginning;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A longer record is none of ours.
const MOST_RECORD_BYTES: usize = 256 << 20;
/// Orders of a run take no more: a key that goes down and up every second for a day takes half of it.
const MOST_ORDER_BYTES: usize = 16 << 20;
/// Read at once.
const AT_ONCE_BYTES: usize = 256 * 1024;

pub(super) struct McapRows {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    /// Bytes of the file that were read.
    read_bytes: u64,
    chunk: OpenChunk,
    order: TickOrder,
    channels: Channels,
    first: Option<(Row, Vec<BodyRow>)>,
    /// The bodies of the last tick: one that is not told again is as it was. Other programs may have put ticks into other chunks.
    before: Option<Vec<BodyRow>>,
    rows: u64,
    pub(super) names: Names,
    pub(super) period_ns: u64,
    pub(super) about: About,
    pub(super) cut: Option<String>,
    /// Orders that were met so far, each with its tick.
    pub(super) orders: Vec<(u64, String)>,
    /// What they take, and the files of the run.
    order_bytes: usize,
    file_bytes: u64,
}

/// The records of a chunk, and where the next one begins.
#[derive(Debug, Default)]
struct OpenChunk {
    records: Vec<u8>,
    at: usize,
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
        let file = input_file::open(path).map_err(|source| ReadError::Io { file: path.into(), source })?;
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_record_length_limit(MOST_RECORD_BYTES);
        let mut rows = Self {
            path: path.into(),
            file,
            reader: LinearReader::new_with_options(options),
            read_bytes: 0,
            chunk: OpenChunk::default(),
            order: TickOrder::default(),
            channels: Channels::default(),
            first: None,
            before: None,
            rows: 0,
            names: Names::default(),
            period_ns: 0,
            about: About::default(),
            cut: None,
            orders: Vec::new(),
            order_bytes: 0,
            file_bytes: 0,
        };
        rows.first = rows.read_row()?;
        if !rows.is_of_a_run() {
            let why = rows.cut.take().unwrap_or_else(|| NO_RUN.into());
            return Err(ReadError::NoRecording { file: path.into(), why });
        }
        check_period(rows.period_ns).map_err(|why| rows.damaged(&why))?;
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

    /// The next record: of the chunk that is open, else of the file.
    fn read_record(&mut self) -> Result<Found, ReadError> {
        if let Some(rest) = self.chunk.records.get(self.chunk.at..).filter(|rest| !rest.is_empty()) {
            let Ok(((opcode, body), behind)) = mcap_record::split_record(rest) else {
                return Err(self.damaged("a chunk ends in the middle of a record"));
            };
            if let Some(what) = mcap_record::refused_in_chunks(opcode) {
                let why = format!("a chunk holds {what}; allowed: schemas, channels and messages");
                return Err(self.damaged(&why));
            }
            self.chunk.at = self.chunk.records.len() - behind.len();
            let found = own(opcode, body, self.channels, (&self.names, self.before.as_deref()));
            return self.keep(found);
        }
        loop {
            match self.reader.next_event() {
                None => return Ok(Found::End),
                Some(Ok(LinearReadEvent::ReadRequest(least))) => {
                    if !self.read_more(least)? {
                        self.cut = Some(CUT.into());
                        return Ok(Found::End);
                    }
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    let found = own(opcode, data, self.channels, (&self.names, self.before.as_deref()));
                    return self.keep(found);
                }
                Some(Err(McapError::UnexpectedEof)) => {
                    self.cut = Some(CUT.into());
                    return Ok(Found::End);
                }
                Some(Err(McapError::BadMagic)) if self.rows == 0 => {
                    let why = "it is no MCAP file".into();
                    return Err(ReadError::NoRecording { file: self.path.clone(), why });
                }
                Some(Err(error)) => return Err(self.damaged(&error.to_string())),
            }
        }
    }

    /// Reads at least so much into the reader, and no more memory is asked for than the file has bytes; `false`: it has
    /// not so many.
    fn read_more(&mut self, least: usize) -> Result<bool, ReadError> {
        let failed = |source| ReadError::Io { file: self.path.clone(), source };
        // Asked anew: a run that goes on makes it longer.
        let left = self.file.metadata().map_err(failed)?.len().saturating_sub(self.read_bytes);
        if least as u64 > left {
            return Ok(false);
        }
        let wanted = least.max(AT_ONCE_BYTES.min(left as usize));
        let read = read_some(&mut self.file, self.reader.insert(wanted)).map_err(failed)?;
        self.reader.notify_read(read);
        self.read_bytes += read as u64;
        Ok(true)
    }

    /// Whether it said whose ticks it has, which ours do before the first.
    fn is_of_a_run(&self) -> bool {
        !self.names.fingers.is_empty() && self.period_ns != 0
    }

    /// Keeps what was found for later.
    fn keep(&mut self, found: Kept) -> Result<Found, ReadError> {
        match found {
            Kept::Row(_) | Kept::Chunk(_) if !self.is_of_a_run() => {
                return Err(ReadError::NoRecording { file: self.path.clone(), why: NO_RUN.into() });
            }
            Kept::Row(row) => {
                let (row, bodies) = (*row).ok_or_else(|| self.damaged("a tick is no tick of this scene"))?;
                self.order.check(row.run_tick, self.period_ns).map_err(|why| self.damaged(&why))?;
                self.before = (bodies.len() > tick::ALWAYS).then(|| bodies.clone());
                return Ok(Found::Row(Box::new(row), bodies));
            }
            Kept::Facts(name, facts) if name == ABOUT || name == COLUMNS => self.take_facts(&name, facts)?,
            Kept::Facts(name, facts) if name == END => self.end(&facts)?,
            Kept::Chunk(Ok(records)) => self.chunk = OpenChunk { records, at: 0 },
            Kept::Chunk(Err(ChunkError::Damage(why))) => return Err(self.damaged(&why)),
            Kept::Chunk(Err(ChunkError::Memory)) => {
                return Err(ReadError::Memory { file: self.path.clone(), rows: self.rows });
            }
            Kept::Chunk(Err(ChunkError::Compression(other))) => return Err(self.compressed_by(&other)),
            Kept::Damage(error) => return Err(self.damaged(&error.to_string())),
            Kept::File(file) => self.take_file(file)?,
            Kept::Order(order) => order.map_or(Ok(()), |order| self.take_order(order))?,
            Kept::Channels(found) => self.channels = found,
            Kept::Facts(..) | Kept::Nothing => {}
        }
        Ok(Found::Other)
    }

    /// Takes what is told of the run, which its rows are read by: behind the first of them it stays as it is.
    fn take_facts(&mut self, name: &str, facts: Facts) -> Result<(), ReadError> {
        let (mut about, mut names) = (None, None);
        if name == ABOUT {
            about = Some(facts).filter(|facts| *facts != self.about.facts);
        } else {
            let read = names_of(&facts);
            let read = read.ok_or_else(|| self.damaged("the names of the columns are not complete"))?;
            read.all().try_for_each(check_text).map_err(|why| self.damaged(&format!("its names: {why}")))?;
            names = Some(read).filter(|names| *names != self.names);
        }
        if self.rows > 0 && (about.is_some() || names.is_some()) {
            return Err(self.damaged(&format!("its {name} changes behind the first row")));
        }
        if let Some(facts) = about {
            self.period_ns = facts.get("period_ns").and_then(|text| text.parse().ok()).unwrap_or(0);
            self.about.facts = facts;
        }
        self.names = names.unwrap_or_else(|| std::mem::take(&mut self.names));
        Ok(())
    }

    /// Takes what its end tells of it: rows may have been taken out of the middle.
    fn end(&mut self, facts: &Facts) -> Result<(), ReadError> {
        let Some(told) = facts.get("rows") else { return Ok(()) };
        match told.parse::<u64>() {
            Ok(told) if told == self.rows => {}
            Ok(told) if told > self.rows => {
                let missing = told - self.rows;
                self.cut = Some(format!("its end tells of {told} rows, of which {missing} are missing"));
            }
            _ => {
                let why = format!("its end tells of {} rows", beginning(told));
                return Err(self.damaged(&why));
            }
        }
        Ok(())
    }

    fn take_file(&mut self, file: InputFile) -> Result<(), ReadError> {
        self.file_bytes += (file.name.len() + file.bytes.len()) as u64;
        if self.file_bytes > MOST_FILE_BYTES {
            let why = format!("its files have more than {} MiB, the most of a run", MOST_FILE_BYTES >> 20);
            return Err(self.damaged(&why));
        }
        self.about.files.push(file);
        Ok(())
    }

    fn take_order(&mut self, order: (u64, String)) -> Result<(), ReadError> {
        self.order_bytes += size_of_val(&order) + order.1.len();
        if self.order_bytes > MOST_ORDER_BYTES {
            let why = format!("its orders take more than {} MiB", MOST_ORDER_BYTES >> 20);
            return Err(self.damaged(&why));
        }
        self.orders.push(order);
        Ok(())
    }

    fn compressed_by(&self, other: &str) -> ReadError {
        let why = format!(
            "its chunks are compressed by {}; allowed: lz4, or none: rewrite it with `mcap compress --compression lz4 \
             IN.mcap -o OUT.mcap`",
            beginning(other)
        );
        ReadError::Unsupported { file: self.path.clone(), why }
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
    Chunk(Result<Vec<u8>, ChunkError>),
    Nothing,
    /// A record that is none.
    Damage(RecordError),
}

fn own(opcode: u8, body: &[u8], channels: Channels, (names, before): (&Names, Option<&[BodyRow]>)) -> Kept {
    let record = match mcap_record::parse(opcode, body) {
        Ok(record) => record,
        Err(error) => return Kept::Damage(error),
    };
    match record {
        McapRecord::Message { channel, data } if Some(channel) == channels.tick => {
            Kept::Row(Box::new(tick::read(data, names, before)))
        }
        McapRecord::Message { channel, data } if Some(channel) == channels.orders => {
            Kept::Order(read_order(data))
        }
        McapRecord::Chunk(chunk) => Kept::Chunk(mcap_chunk::content(&chunk)),
        McapRecord::Metadata { name, facts } => Kept::Facts(name.to_owned(), facts),
        McapRecord::Attachment { name, data } => {
            Kept::File(InputFile { name: name.to_owned(), bytes: data.to_vec() })
        }
        McapRecord::Channel { id, topic: TICK_TOPIC } => {
            Kept::Channels(Channels { tick: Some(id), ..channels })
        }
        McapRecord::Channel { id, topic: ORDER_TOPIC } => {
            Kept::Channels(Channels { orders: Some(id), ..channels })
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

const NO_RUN: &str = "it has no metadata of a run (phantom3.run, phantom3.columns) before its first tick; \
                      another program made or rewrote it";
const CUT: &str = "it ends in the middle, as when a disk is full or a process was killed";

fn read_some(file: &mut File, room: &mut [u8]) -> io::Result<usize> {
    loop {
        match file.read(room) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
