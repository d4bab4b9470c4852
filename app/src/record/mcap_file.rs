//! The recording of a run as MCAP: every tick, events, and what people look at, with all that is needed to play it again.
//!
//! | channel | schema | how often |
//! |---|---|---|
//! | `/tick` | `phantom3.Tick`, made for the scene | every tick |
//! | `/events` | `phantom3.Event` | when something happens |
//! | `/orders` | `phantom3.Order` | when somebody ordered something; not there if nobody did |
//! | `/scene`, of large scenes also `/scene/2` and so on | `foxglove.SceneUpdate` | once |
//! | `/frames` | `foxglove.FrameTransforms`, of what moves by itself and of fingers; of many things those that have moved | 50 times a second |
//! | `/frames/fixed` | `foxglove.FrameTransforms`, of everything else | once |
//! | `/frames/moved` | `foxglove.FrameTransforms`, of what orders have moved of that | when it moves; not there if nothing did |
//! | `/fingers` | `foxglove.SceneUpdate` | 50 times a second |
//!
//! Model: messages are encoded as Protocol Buffers and gathered into chunks of half a second of the run. A chunk goes to
//! the file in one piece, so that whatever ends the process leaves all chunks before readable. Times are those of the
//! run: 0 is its first tick.
//! Invariants: what could not be written as a whole is cut off again; after that nothing more is written, not even an end, nor to
//! a file that somebody else has cut or written.

use super::about::{self, About};
use super::changes::Changes;
use super::content::ContentState;
use super::destination::shown;
use super::event_line::{holders, name, said};
use super::foxglove;
use super::opened::Opened;
use super::schema::{self, event, order};
use super::tick;
use super::view::View;
use super::wire::Message;
use crate::book::Book;
use crate::columns::Names;
use crate::displaced::Placed;
use crate::recording::RecordingError;
use crate::row::{BodyRow, Row};
use io_driver::device::run_time_s;
use io_driver::say::say;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use world::events::{Event, Facts, Kind};

/// A chunk has so much of the run (ns): what a killed process loses at most, besides what waits for the disk.
const CHUNK_NS: u64 = 500_000_000;
/// Or so many bytes, besides its first tick, which has all objects.
const CHUNK_BYTES: usize = 4 << 20;
/// More than this no chunk has: readers of ours take twice as much.
pub(super) const MOST_CHUNK_BYTES: usize = 32 << 20;
/// Most bytes of a message besides its content.
const MESSAGE_HEAD_BYTES: usize = 32;
/// Between two pictures (ns).
const PICTURE_NS: u64 = 20_000_000;

/// Names of metadata.
pub(super) const ABOUT: &str = "phantom3.run";
pub(super) const COLUMNS: &str = "phantom3.columns";
pub(super) const END: &str = "phantom3.end";
/// The schema of channels that tell where frames are.
const FRAMES: &str = "foxglove.FrameTransforms";
/// The channel of ticks.
pub(super) const TICK_TOPIC: &str = "/tick";
/// And that of orders.
pub(super) const ORDER_TOPIC: &str = "/orders";

/// An MCAP file being written.
pub struct McapFile {
    writer: Writer<NoSeek<WholeWrites>>,
    /// Another handle of the file, until somebody takes it.
    second_handle: Option<File>,
    beginning: Arc<Beginning>,
    content: Arc<ContentState>,
    path: PathBuf,
    names: Names,
    period_ns: u64,
    view: View,
    channels: Channels,
    message: Message,
    sequence: u32,
    /// The chunk has a tick with all bodies.
    chunk_has_all: bool,
    /// The chunk has a picture of all bodies, and the newest one these; those that have changed since.
    chunk_shows_all: bool,
    shown_bodies: Vec<BodyRow>,
    changed_since: Changes,
    /// Things that are no bodies and have been moved, as they were told last.
    last_placed: Vec<Placed>,
    /// Length of what the chunk has, and of what in it is of all objects at once; and its first tick.
    chunk_bytes: usize,
    chunk_of_all: usize,
    chunk_rows: u64,
    chunk_began: u64,
    next_picture: u64,
    /// On disk.
    rows: u64,
    last_tick: u64,
    last_in_chunk: u64,
    lost: u64,
    failure: Option<McapError>,
    book: Book,
    /// Which scene of the run it is, and whether events are of that one.
    scene: u32,
    is_current: bool,
}

#[derive(Debug, Clone)]
struct Channels {
    tick: u16,
    events: u16,
    orders: Option<u16>,
    /// One for each part, so that players which go back to the last message of each channel show all of them.
    scene: Vec<u16>,
    frames: u16,
    fixed: u16,
    moved: Option<u16>,
    fingers: u16,
}

impl McapFile {
    /// Writes what is known before the first tick; into what may wait for a reader, with the first [`Self::flush`], and
    /// into a file that has content, with the first chunk that has rows.
    ///
    /// # Errors
    /// If that cannot be written.
    pub fn create(
        file: Opened,
        names: Names,
        period_ns: u64,
        about: &About,
        view: View,
    ) -> Result<Self, RecordingError> {
        Self::create_at(file, names, period_ns, about, view, 0)
    }

    /// The same of a recording that begins when the run has come to this tick.
    ///
    /// # Errors
    /// If that cannot be written.
    pub fn create_at(
        file: Opened,
        names: Names,
        period_ns: u64,
        about: &About,
        view: View,
        begins: u64,
    ) -> Result<Self, RecordingError> {
        let path = file.path().to_owned();
        let failed = |error| RecordingError::Create { file: path.clone(), source: into_io(error) };
        let (may_wait, content) = (file.may_wait(), file.content());
        let second_handle = file.second_handle().map_err(|error| failed(error.into()))?;
        let beginning = Arc::new(Beginning::default());
        let changed_since = Changes::none(names.bodies.len());
        let writes = WholeWrites::new(file, Arc::clone(&beginning));
        let mut writer = options().create(NoSeek::new(writes)).map_err(failed)?;
        let channels = begin(&mut writer, &names, about, view.scene.len()).map_err(failed)?;
        for (input, why) in about.left_out() {
            say(format_args!("phantom3: {} is recorded without {input}: {why}", shown(&path).display()));
        }
        let mut file = Self {
            writer,
            second_handle,
            beginning,
            content,
            path: path.clone(),
            names,
            period_ns,
            view,
            channels,
            message: Message::new(),
            sequence: 0,
            chunk_has_all: false,
            chunk_shows_all: false,
            shown_bodies: Vec::new(),
            changed_since,
            last_placed: Vec::new(),
            chunk_bytes: 0,
            chunk_of_all: 0,
            chunk_rows: 0,
            chunk_began: 0,
            next_picture: 0,
            rows: 0,
            last_tick: 0,
            last_in_chunk: 0,
            lost: 0,
            failure: None,
            book: Book::default(),
            scene: 0,
            is_current: true,
        };
        file.put_scene(begins, may_wait).map_err(failed)?;
        Ok(file)
    }

    /// Picture of the scene; nothing of it goes out yet into what may wait for a reader.
    fn put_scene(&mut self, begins: u64, may_wait: bool) -> Result<(), McapError> {
        let scene = std::mem::take(&mut self.view.scene);
        self.beginning.is_held.store(may_wait, Ordering::Relaxed);
        for (channel, part) in self.channels.scene.clone().into_iter().zip(scene.iter()) {
            self.put(channel, begins, part)?;
        }
        let fixed = std::mem::take(&mut self.view.fixed);
        if !fixed.is_empty() {
            self.put(self.channels.fixed, begins, &fixed)?;
        }
        self.beginning.is_held.store(false, Ordering::Relaxed);
        if may_wait { Ok(()) } else { self.end_chunk() }
    }

    /// Of the scene of this number, in a run in which all that is written here was ordered.
    #[must_use]
    pub fn of_scene(self, (book, scene): (&Book, u32)) -> Self {
        Self { book: book.clone(), scene, is_current: scene == 0, ..self }
    }

    /// The scene runs already.
    #[must_use]
    pub fn under_way(self) -> Self {
        Self { is_current: true, ..self }
    }

    /// Rows in the file.
    pub(super) fn rows(&self) -> u64 {
        self.rows
    }

    /// Content of the file, to be looked at from another thread.
    pub(super) fn content(&self) -> Arc<ContentState> {
        Arc::clone(&self.content)
    }

    /// Another handle of the file ([`Opened::second_handle`]), once.
    pub(super) fn take_second_handle(&mut self) -> Option<File> {
        self.second_handle.take()
    }

    /// Nothing more is written, not even what the chunk has.
    pub(super) fn give_up(&self) {
        self.beginning.is_given_up.store(true, Ordering::Relaxed);
    }

    /// No row has come, and the file has its earlier content.
    pub fn is_as_before(&self) -> bool {
        let Beginning { has_content, has_rows, .. } = &*self.beginning;
        has_content.load(Ordering::Relaxed) && !has_rows.load(Ordering::Relaxed)
    }

    /// Appends a row and its bodies, of which no others than those of the numbers `changed`, which ascend, have changed since the
    /// row before; `placed` is what else has been moved, where it stands.
    ///
    /// # Errors
    /// If it or rows before it cannot be written.
    pub fn append(
        &mut self,
        row: &Row,
        bodies: (&[BodyRow], &[u32]),
        placed: &[Placed],
    ) -> Result<(), RecordingError> {
        self.beginning.has_rows.store(true, Ordering::Relaxed);
        if self.chunk_rows == 0 {
            self.chunk_began = row.run_tick;
        } else if self.chunk_bytes - self.chunk_of_all > CHUNK_BYTES
            || self.time_ns(row.run_tick - self.chunk_began) >= CHUNK_NS
        {
            self.flush()?;
            self.chunk_began = row.run_tick;
        }
        let written = self.put_row(row, bodies, placed);
        self.chunk_rows += 1;
        self.last_in_chunk = row.run_tick;
        let written = self.failure.take().map_or(written, Err);
        written.map_err(|error| self.failed(error))
    }

    /// Writes the chunk to the file.
    ///
    /// # Errors
    /// If that fails.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.end_chunk().map_err(|error| self.failed(error))
    }

    fn end_chunk(&mut self) -> Result<(), McapError> {
        self.writer.flush()?;
        self.rows += self.chunk_rows;
        self.last_tick = self.last_in_chunk;
        (self.chunk_rows, self.chunk_bytes, self.chunk_of_all) = (0, 0, 0);
        (self.chunk_has_all, self.chunk_shows_all) = (false, false);
        Ok(())
    }

    /// Tells that rows before `run_tick` are missing.
    pub fn tell_lost(&mut self, run_tick: u64, count: u64) {
        self.lost += count;
        let mut message = self.begin_event(run_tick, "rows-lost");
        message.double(event::VALUE, count as f64).text(event::TEXT, "the recorder was too slow");
        self.put_event(run_tick, &message);
    }

    /// Writes down what happened. A failure is told with the next row.
    pub fn event(&mut self, happened: &Event) {
        // Between two scenes events are those of either; each has its own names.
        let begins = matches!(happened.kind, Kind::Scene { number } if number == self.scene);
        self.is_current |= begins;
        if !self.is_current {
            return;
        }
        self.is_current = begins || !matches!(happened.kind, Kind::Scene { .. });
        let (words, _) = said(happened, &self.book);
        if let Kind::Order { .. } = happened.kind {
            return self.order(happened.run_tick, &words);
        }
        let facts = happened.kind.facts();
        let mut message = self.begin_event(happened.run_tick, facts.word);
        let held_by;
        let text = if let Some([from, to]) = facts.spaces {
            held_by = format!("{}>{}", self.names.space(from), self.names.space(to));
            &held_by
        } else if facts.holders == 0 {
            if words.is_empty() { facts.text } else { &words }
        } else {
            held_by = holders(facts.holders, &self.names.fingers);
            &held_by
        };
        message
            .text(event::FINGER, facts.finger.map_or("", |finger| name(&self.names.fingers, finger)))
            .text(event::ENTITY, self.names.entity(facts.entity))
            .double(event::VALUE, value(&facts))
            .text(event::TEXT, text)
            .text(event::OTHER, self.names.entity(facts.other));
        if let Some(life) = facts.life {
            foxglove::vector(&mut message, event::IMPULSE, &life.impulse_W);
            message.double(event::PEAK, life.peak_n);
        }
        self.put_event(happened.run_tick, &message);
    }

    fn order(&mut self, run_tick: u64, words: &str) {
        let mut message = Message::new();
        message
            .whole(order::TICK, run_tick)
            .double(order::T, run_time_s(run_tick.cast_signed(), self.period_ns))
            .text(order::WORDS, words);
        let channel = self.order_channel();
        let written = channel.and_then(|channel| self.put(channel, run_tick, message.bytes()));
        if let Err(error) = written {
            self.failure.get_or_insert(error);
        }
    }

    /// Made for the first thing that is moved.
    fn moved_channel(&mut self) -> Result<u16, McapError> {
        if let Some(channel) = self.channels.moved {
            return Ok(channel);
        }
        let set = schema::descriptors(&self.names);
        let channel = add_channel(&mut self.writer, "/frames/moved", FRAMES, &set)?;
        self.channels.moved = Some(channel);
        Ok(channel)
    }

    /// Made for the first order.
    fn order_channel(&mut self) -> Result<u16, McapError> {
        if let Some(channel) = self.channels.orders {
            return Ok(channel);
        }
        let set = schema::descriptors(&self.names);
        let channel = add_channel(&mut self.writer, ORDER_TOPIC, schema::ORDER, &set)?;
        self.channels.orders = Some(channel);
        Ok(channel)
    }

    fn begin_event(&self, run_tick: u64, word: &str) -> Message {
        let mut message = Message::new();
        message
            .whole(event::TICK, run_tick)
            .double(event::T, run_time_s(run_tick.cast_signed(), self.period_ns))
            .text(event::KIND, word);
        message
    }

    fn put_event(&mut self, run_tick: u64, message: &Message) {
        if let Err(error) = self.put(self.channels.events, run_tick, message.bytes()) {
            self.failure.get_or_insert(error);
        }
    }

    /// Writes what is left, the index, and how the recording ended. Returns the number of rows.
    ///
    /// # Errors
    /// If that fails, or nobody would find it.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        if self.is_as_before() {
            return Ok(0);
        }
        self.beginning.has_rows.store(true, Ordering::Relaxed);
        self.flush()?;
        let facts = BTreeMap::from([
            ("rows".to_owned(), self.rows.to_string()),
            ("rows_lost".to_owned(), self.lost.to_string()),
            ("until_s".to_owned(), format!("{:?}", self.until_s())),
        ]);
        let end = Metadata { name: END.into(), metadata: facts };
        let closed = self.writer.write_metadata(&end).and_then(|()| self.writer.finish().map(drop));
        closed.map_err(|error| self.failed(error))?;
        let (path, content, rows, until_s) = (self.path.clone(), self.content(), self.rows, self.until_s());
        let mut whole = self.writer.into_inner().into_inner();
        match whole.sync() {
            Ok(()) if whole.is_removed() => Err(RecordingError::Removed { file: path, rows }),
            Ok(()) => Ok(rows),
            Err(source) => Err(RecordingError::of_write(&path, source, &content, (until_s, rows))),
        }
    }

    fn put_row(
        &mut self,
        row: &Row,
        (bodies, changed): (&[BodyRow], &[u32]),
        placed: &[Placed],
    ) -> Result<(), McapError> {
        let mut message = std::mem::take(&mut self.message);
        message.clear();
        let which = self.chunk_has_all.then_some(changed);
        tick::write(&mut message, row, (bodies, which), &self.names, self.period_ns);
        if which.is_some() && !self.has_room_for(&message) {
            // Or this tick would be the first of another chunk, without all that has not changed.
            self.end_chunk()?;
            message.clear();
            tick::write(&mut message, row, (bodies, None), &self.names, self.period_ns);
        }
        if !self.chunk_has_all {
            self.chunk_of_all += message.bytes().len();
        }
        self.chunk_has_all = true;
        self.changed_since.note(changed);
        let mut written = self.put(self.channels.tick, row.run_tick, message.bytes());
        let time_ns = self.time_ns(row.run_tick);
        if time_ns >= self.next_picture {
            self.next_picture = (time_ns / PICTURE_NS + 1) * PICTURE_NS;
            message.clear();
            self.write_frames(&mut message, row, bodies);
            if self.chunk_shows_all && !self.has_room_for(&message) {
                self.end_chunk()?;
                message.clear();
                self.write_frames(&mut message, row, bodies);
            }
            if !self.chunk_shows_all {
                self.chunk_of_all += message.bytes().len();
            }
            self.chunk_shows_all = true;
            self.note_shown(bodies);
            written = written.and_then(|()| self.put(self.channels.frames, row.run_tick, message.bytes()));
            if placed != self.last_placed {
                self.last_placed.clear();
                self.last_placed.extend_from_slice(placed);
                message.clear();
                self.view.moved(&mut message, time_ns, placed);
                let channel = self.moved_channel();
                let put = channel.and_then(|channel| self.put(channel, row.run_tick, message.bytes()));
                written = written.and(put);
            }
            message.clear();
            self.view.fingers(&mut message, time_ns, row, &self.names);
            written = written.and_then(|()| self.put(self.channels.fingers, row.run_tick, message.bytes()));
        }
        self.message = message;
        written
    }

    /// A picture of those that are not where they were in the last one of the chunk, or of all.
    fn write_frames(&mut self, message: &mut Message, row: &Row, bodies: &[BodyRow]) {
        let time_ns = self.time_ns(row.run_tick);
        if bodies.len() <= tick::ALWAYS || !self.chunk_shows_all {
            return self.view.frames(message, time_ns, row, (bodies, 0..bodies.len()), &self.names);
        }
        let shown = &self.shown_bodies;
        let has_moved = |&at: &usize| {
            (shown[at].position, shown[at].orientation) != (bodies[at].position, bodies[at].orientation)
        };
        let changed = self.changed_since.sorted().iter().map(|&at| at as usize);
        self.view.frames(message, time_ns, row, (bodies, changed.filter(has_moved)), &self.names);
    }

    /// The bodies are known as they are.
    fn note_shown(&mut self, bodies: &[BodyRow]) {
        if self.shown_bodies.len() == bodies.len() {
            for &at in self.changed_since.sorted() {
                self.shown_bodies[at as usize] = bodies[at as usize];
            }
        } else {
            self.shown_bodies = bodies.to_vec();
        }
        self.changed_since.forget();
    }

    /// It need not go into another chunk.
    fn has_room_for(&self, message: &Message) -> bool {
        self.chunk_bytes + message.bytes().len() + MESSAGE_HEAD_BYTES <= MOST_CHUNK_BYTES
    }

    fn put(&mut self, channel_id: u16, run_tick: u64, data: &[u8]) -> Result<(), McapError> {
        let bytes = data.len() + MESSAGE_HEAD_BYTES;
        if self.chunk_bytes > 0 && self.chunk_bytes + bytes > MOST_CHUNK_BYTES {
            self.end_chunk()?;
        }
        if self.chunk_bytes == 0 {
            has_memory_for_a_chunk()?;
        }
        let time_ns = self.time_ns(run_tick);
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time_ns, publish_time: time_ns };
        self.sequence = self.sequence.wrapping_add(1);
        self.chunk_bytes += bytes;
        self.writer.write_to_known_channel(&header, data)
    }

    fn time_ns(&self, run_ticks: u64) -> u64 {
        run_ticks.saturating_mul(self.period_ns)
    }

    fn until_s(&self) -> f64 {
        run_time_s(self.last_tick.cast_signed(), self.period_ns)
    }

    fn failed(&self, error: McapError) -> RecordingError {
        RecordingError::of_write(&self.path, into_io(error), &self.content, (self.until_s(), self.rows))
    }
}

/// Of a contact that is over, or a grasp, how long it was (s), else its force, or what was cut (N); else the number that there is.
fn value(facts: &Facts) -> f64 {
    match facts.life {
        Some(life) if matches!(facts.word, "contact-end" | "pair-end") => life.lasted_s,
        Some(life) => life.force_n,
        None => facts.force_n.or(facts.lasted_s).unwrap_or(facts.number.unwrap_or(0) as f64),
    }
}

/// The writer panics where the compressor finds no memory, as it does at the beginning of a chunk.
fn has_memory_for_a_chunk() -> io::Result<()> {
    // What else is asked for until then.
    let mut spare = Vec::<u8>::new();
    spare.try_reserve_exact(SPARE_BYTES).map_err(|_| rustix::io::Errno::NOMEM)?;
    let tried = lz4::EncoderBuilder::new().build(io::sink());
    tried.map(drop).map_err(|_| rustix::io::Errno::NOMEM.into())
}

const SPARE_BYTES: usize = 1 << 18;

/// Chunks are ended here and nowhere else, and go out in one piece.
fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .profile("phantom3")
        .library(concat!("phantom3 ", env!("CARGO_PKG_VERSION")))
        .chunk_size(None)
        .disable_seeking(true)
}

fn begin(
    writer: &mut Writer<NoSeek<WholeWrites>>,
    names: &Names,
    about: &About,
    scene_parts: usize,
) -> Result<Channels, McapError> {
    let facts = [(ABOUT, about.facts.clone()), (COLUMNS, about::columns_of(names))];
    for (name, metadata) in facts {
        writer.write_metadata(&Metadata { name: name.into(), metadata })?;
    }
    for file in &about.files {
        let media_type = if file.name.ends_with(".csv") { "text/csv" } else { "application/octet-stream" };
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: file.name.clone(),
            media_type: if file.name.starts_with("scene:") { "application/toml" } else { media_type }.into(),
            data: Cow::Borrowed(&file.bytes),
        })?;
    }
    let set = schema::descriptors(names);
    has_memory_for_a_chunk()?;
    let mut channel = |topic: &str, message: &str| add_channel(writer, topic, message, &set);
    Ok(Channels {
        tick: channel(TICK_TOPIC, schema::TICK)?,
        events: channel("/events", schema::EVENT)?,
        orders: None,
        scene: (1..=scene_parts)
            .map(|part| channel(&scene_topic(part), "foxglove.SceneUpdate"))
            .collect::<Result<_, _>>()?,
        frames: channel("/frames", FRAMES)?,
        fixed: channel("/frames/fixed", FRAMES)?,
        moved: None,
        fingers: channel("/fingers", "foxglove.SceneUpdate")?,
    })
}

fn scene_topic(part: usize) -> String {
    if part == 1 { "/scene".into() } else { format!("/scene/{part}") }
}

fn add_channel(
    writer: &mut Writer<NoSeek<WholeWrites>>,
    topic: &str,
    message: &str,
    set: &[u8],
) -> Result<u16, McapError> {
    let schema = writer.add_schema(message, "protobuf", set)?;
    writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())
}

fn into_io(error: McapError) -> io::Error {
    if let McapError::Io(error) = error { error } else { io::Error::other(error) }
}

/// State of a recording's beginning, shared with its writer.
#[derive(Debug, Default)]
struct Beginning {
    /// The file has its earlier content still.
    has_content: AtomicBool,
    /// The first row has come.
    has_rows: AtomicBool,
    /// Nothing goes out yet.
    is_held: AtomicBool,
    /// Nothing more goes out.
    is_given_up: AtomicBool,
}

/// Gathers what is written until it is flushed, then writes it whole or, if it does not fit, not at all. Into a file that has
/// content nothing is written before there are rows, and nothing at all if these do not fit.
#[derive(Debug)]
struct WholeWrites {
    file: Opened,
    has_name: bool,
    beginning: Arc<Beginning>,
    pending: Vec<u8>,
    written_bytes: u64,
    /// Something did not fit. The library still writes an end behind it, which would be that of a whole file.
    has_ended: bool,
}

impl WholeWrites {
    fn new(file: Opened, beginning: Arc<Beginning>) -> Self {
        let has_name = file.has_name();
        beginning.has_content.store(file.has_content(), Ordering::Relaxed);
        Self { file, has_name, beginning, pending: Vec::new(), written_bytes: 0, has_ended: false }
    }

    /// The name that led to the file in the beginning does so no more.
    fn is_removed(&self) -> bool {
        self.has_name && self.file.has_lost_name()
    }

    /// Writes what is left out to the disk itself.
    fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        match self.file.file().sync_data() {
            // A pipe or a character device has no disk to reach.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            synced => synced.and_then(|()| self.file.check_all(self.written_bytes)),
        }
    }

    /// Writes all of it, or none that stays.
    fn write_whole(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = if self.file.has_content() {
            self.file.replace_content(bytes)
        } else {
            self.file.file().write_all(bytes)
        };
        self.beginning.has_content.store(self.file.has_content(), Ordering::Relaxed);
        written?;
        self.file.wrote(self.written_bytes, bytes);
        self.written_bytes += bytes.len() as u64;
        Ok(())
    }

    /// Cuts off what has reached the file in part, unless it has its earlier content still.
    fn end(&mut self) {
        self.has_ended = true;
        if self.file.has_content() {
            return;
        }
        // If even this fails, readers skip the last piece.
        let _ = self.file.cut(self.written_bytes);
        let _ = self.file.file().seek(SeekFrom::Start(self.written_bytes));
    }
}

impl Write for WholeWrites {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.beginning.is_held.load(Ordering::Relaxed) {
            return Ok(());
        }
        let bytes = self.pending.len() as u64;
        if self.file.has_content() && !self.beginning.has_rows.load(Ordering::Relaxed) {
            return self.file.reserve(bytes);
        }
        let pending = std::mem::take(&mut self.pending);
        if self.has_ended || self.beginning.is_given_up.load(Ordering::Relaxed) {
            return Err(io::Error::other("an earlier write failed"));
        }
        if self.beginning.has_rows.load(Ordering::Relaxed)
            && let Err(refused) = self.file.start(bytes)
        {
            self.has_ended = true;
            return Err(refused);
        }
        if !self.file.has_content() {
            let checked = self.file.check_lately(self.written_bytes);
            self.has_ended |= checked.is_err();
            checked?;
        }
        let written = self.write_whole(&pending);
        if written.is_err() {
            self.end();
        }
        self.pending = pending;
        self.pending.clear();
        written
    }
}

#[cfg(test)]
mod tests {
    use super::super::opened::OtherContent;
    use super::super::read::RecordedRun;
    use super::*;
    use nalgebra::Vector3;
    use std::path::Path;

    fn with_scene(directory: &Path, parts: Vec<Vec<u8>>) -> PathBuf {
        let path = directory.join("r.mcap");
        let names = Names { fingers: vec!["f0".into()], ..Names::default() };
        let mut about = About::default();
        about.tell("period_ns", "1000000".into());
        let mut view = View::default();
        view.scene = parts.into();
        let file = Opened::recording(&path).expect("a file");
        let mut file = McapFile::create(file, names, 1_000_000, &about, view).expect("room");
        for run_tick in 0..3 {
            let row = Row { run_tick, ..Row::empty() };
            file.append(&row, (&[], &[]), &[]).expect("room");
        }
        assert_eq!(file.finish().expect("room"), 3);
        path
    }

    #[test]
    fn a_large_scene_goes_into_chunks_that_readers_take() {
        let directory = tempfile::tempdir().expect("a directory");
        let parts =
            vec![vec![0; MOST_CHUNK_BYTES - MESSAGE_HEAD_BYTES], vec![0; 20 << 20], vec![0; 20 << 20]];
        let path = with_scene(directory.path(), parts);
        let mut read = RecordedRun::open(&path).expect("sound");
        let mut rows = 0;
        while read.next_row().expect("sound").is_some() {
            rows += 1;
        }
        assert_eq!((rows, read.cut()), (3, None));
        let bytes = std::fs::read(&path).expect("there");
        let summary = mcap::Summary::read(&bytes).expect("sound").expect("whole");
        let most = summary.chunk_indexes.iter().map(|chunk| chunk.uncompressed_size).max();
        assert!(most.is_some_and(|most| most < 40 << 20), "{most:?}");
        for topic in ["/scene", "/scene/2", "/scene/3"] {
            assert!(summary.channels.values().any(|channel| channel.topic == topic), "{topic}");
        }
    }

    #[test]
    fn of_many_things_pictures_show_those_that_have_moved_and_all_once_in_a_chunk() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.mcap");
        let bodies: Vec<String> = (0..100).map(|body| format!("body{body}")).collect();
        let names = Names { entities: bodies.clone(), bodies, ..Names::default() };
        let scene = world::Scene::parse("[[finger]]\n", Path::new("scene.toml")).expect("a scene");
        let mut about = About::default();
        about.tell("period_ns", "1000000".into());
        let opened = Opened::recording(&path).expect("a file");
        let view = View::new(&scene, &[], true);
        let mut file = McapFile::create(opened, names, 1_000_000, &about, view).expect("room");
        let mut rows = vec![BodyRow::default(); 100];
        let all: Vec<u32> = (0..100).collect();
        for run_tick in 0..1000 {
            // One moves all the time, and one turns now and then.
            rows[17].position.x += 1e-3;
            rows[42].orientation.w = (run_tick / 100) as f64;
            let changed: &[u32] = if run_tick == 0 { &all } else { &[17, 42] };
            file.append(&Row { run_tick, ..Row::empty() }, (&rows, changed), &[]).expect("room");
            if run_tick % 500 == 499 {
                file.flush().expect("room");
            }
        }
        assert_eq!(file.finish().expect("room"), 1000);
        let bytes = std::fs::read(&path).expect("there");
        let all = mcap::MessageStream::new(&bytes).expect("sound").map(|message| message.expect("sound"));
        let frames = all.filter(|message| message.channel.topic == "/frames");
        let shown: Vec<usize> = frames
            .map(|message| message.data.windows(7).filter(|bytes| *bytes == b"object/").count())
            .collect();
        for (at, shown) in shown.iter().enumerate() {
            let expected = if at % 25 == 0 { 100 } else { 1 + usize::from(at % 5 == 0) };
            assert_eq!(*shown, expected, "picture {at}");
        }
        assert_eq!(shown.len(), 50);
    }

    /// All at once take more than a chunk has of changes.
    #[test]
    fn of_very_many_things_a_chunk_tells_all_of_them_once() {
        const COUNT: usize = 45_000;
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.mcap");
        let bodies: Vec<String> = (0..COUNT).map(|body| format!("b{body}")).collect();
        let names = Names { bodies, ..Names::default() };
        let mut about = About::default();
        about.tell("period_ns", "1000000".into());
        let opened = Opened::recording(&path).expect("a file");
        let mut file = McapFile::create(opened, names, 1_000_000, &about, View::default()).expect("room");
        let near = Vector3::repeat(0.1);
        let mut rows = vec![BodyRow { position: near, velocity: near, ..BodyRow::default() }; COUNT];
        for run_tick in 0..50 {
            rows[17].position.x += 1e-3;
            file.append(&Row { run_tick, ..Row::empty() }, (&rows, &[17]), &[]).expect("room");
        }
        assert_eq!(file.finish().expect("room"), 50);
        let bytes = std::fs::read(&path).expect("there");
        let all = mcap::MessageStream::new(&bytes).expect("sound").map(|message| message.expect("sound"));
        let large = all.filter(|message| message.data.len() > 50 * COUNT);
        let topics: Vec<String> = large.map(|message| message.channel.topic.clone()).collect();
        assert_eq!(topics, [TICK_TOPIC, "/frames"]);
    }

    #[test]
    fn what_an_order_moves_is_told_where_it_stands() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.mcap");
        let text =
            "[[finger]]\n[[entity]]\nname = \"plate\"\nshape = { kind = \"sphere\", radius_m = 0.05 }\n";
        let scene = world::Scene::parse(text, Path::new("scene.toml")).expect("a scene");
        let ball = haptics::Sphere::new(0.05).expect("a ball");
        let at = |y: f64| nalgebra::Isometry3::translation(0.0, y, 0.0);
        let entities = [haptics::Entity::new(ball, at(0.0), 1000.0).expect("stiff")];
        let view = View::new(&scene, &entities, true);
        let names = Names { fingers: vec!["f0".into()], ..Names::default() };
        let mut about = About::default();
        about.tell("period_ns", "1000000".into());
        let opened = Opened::recording(&path).expect("a file");
        let mut file = McapFile::create(opened, names, 1_000_000, &about, view.clone()).expect("room");
        for run_tick in 0..100 {
            let placed = [(0, at(if run_tick < 70 { 0.1 } else { 0.2 }))];
            let row = Row { run_tick, ..Row::empty() };
            file.append(&row, (&[], &[]), if run_tick < 30 { &[] } else { &placed }).expect("room");
        }
        assert_eq!(file.finish().expect("room"), 100);
        let bytes = std::fs::read(&path).expect("there");
        let of = |topic: &str| -> Vec<(u64, Vec<u8>)> {
            let all = mcap::MessageStream::new(&bytes).expect("sound").map(|message| message.expect("sound"));
            let all = all.filter(|message| message.channel.topic == topic);
            all.map(|message| (message.log_time / 1_000_000, message.data.to_vec())).collect()
        };
        let told = |ms: u64, y: f64| {
            let mut message = Message::new();
            view.moved(&mut message, ms * 1_000_000, &[(0, at(y))]);
            (ms, message.into_bytes())
        };
        assert_eq!(of("/frames/fixed"), [told(0, 0.0)]);
        // With the next of 50 pictures a second.
        assert_eq!(of("/frames/moved"), [told(40, 0.1), told(80, 0.2)]);
        let scenes = of("/scene");
        let frame = b"object/plate";
        assert!(scenes.len() == 1 && scenes[0].1.windows(frame.len()).any(|bytes| bytes == frame));
    }

    #[test]
    fn nothing_is_written_behind_a_write_that_did_not_fit() {
        let full = Opened::open(Path::new("/dev/full")).expect("a device");
        let mut full = WholeWrites::new(full, Arc::default());
        full.write_all(b"chunk").and_then(|()| full.flush()).expect_err("full");
        let directory = tempfile::tempdir().expect("a directory");
        // Room is there again, as on a disk from which the cut piece has gone.
        full.file = Opened::open(&directory.path().join("end")).expect("a file");
        full.write_all(b"end").and_then(|()| full.flush()).expect_err("ended");
        assert_eq!(full.file.file().metadata().expect("a file").len(), 0);
    }
    #[test]
    fn nothing_is_written_to_a_file_that_somebody_else_cut_or_wrote() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("chunks");
        // The last one is as long.
        for content in ["", "ch", "chunks", "chun\0"] {
            let opened = Opened::open(&path).expect("a file");
            let mut whole = WholeWrites::new(opened, Arc::default());
            whole.beginning.has_rows.store(true, Ordering::Relaxed);
            whole.write_all(b"chunk").and_then(|()| whole.flush()).expect("room");
            std::fs::write(&path, content).expect("room");
            for _ in 0..2 {
                whole.write_all(b"next").and_then(|()| whole.flush()).expect_err("another length");
            }
            whole.sync().expect_err("another length");
            assert_eq!(std::fs::read_to_string(&path).expect("there"), content);
            std::fs::remove_file(&path).expect("our own");
        }
        let opened = Opened::open(&path).expect("a file");
        let mut whole = WholeWrites::new(opened, Arc::default());
        whole.beginning.has_rows.store(true, Ordering::Relaxed);
        whole.write_all(b"chunk").and_then(|()| whole.flush()).expect("room");
        std::fs::write(&path, "").expect("room");
        assert!(OtherContent::of(&whole.sync().expect_err("another length")).is_some());
    }
}
