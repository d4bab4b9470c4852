//! A recording on a thread of its own: whatever the disk does, nobody waits for it but the recording itself.
//!
//! Model: the slow side hands over rows through a bounded queue. In real time a row that finds no room is left out,
//! counted, and told in the file where the format has a place for that; on a clock that can wait, it waits, but neither
//! for a recorder that is stuck nor after a request to stop. A disk that takes no more is told at once, and the rows that
//! follow are thrown away: the run goes on. At the end the recorder has as long as it gets on; one that is stuck is given
//! up. A reader of the standard output who has seen enough is no failure:
//! the recording ends, and so may the run.

use super::destination::shown;
use super::events_file::EventsFile;
use super::mcap_file::McapFile;
use crate::fast_loop::WhenFull;
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use crate::row_queue::{ROW_QUEUE, RowReceiver, RowSender, row_queue_of};
use io_driver::say::say;
use rt_core::signals::StopSignals;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, Thread};
use std::time::{Duration, Instant};
use world::events::{Event, EventReceiver, EventSender, Subscriber, event_queue};

/// Bodies that may wait, of all rows together.
const MOST_BODIES: usize = 1 << 18;
/// Events that may wait; more than a tick has.
const MOST_EVENTS: usize = 8192;
/// CSV goes to the file after so much of the run (ns), if not before.
const FLUSH_NS: u64 = 500_000_000;
/// How long the recorder sleeps when there is nothing to write.
const PAUSE: Duration = Duration::from_millis(10);
/// A recorder that has not written anything for so long will not any more.
const STUCK: Duration = Duration::from_secs(30);

/// What files of events count.
const EVENTS: &str = "events";

/// A recording in one of its formats.
pub enum RecordFile {
    /// A table.
    Csv(Box<Recording>),
    /// Everything.
    Mcap(Box<McapFile>),
    /// Events alone.
    Events(Box<EventsFile>),
}

impl RecordFile {
    fn append(&mut self, row: &Row, bodies: &[BodyRow]) -> Result<(), RecordingError> {
        match self {
            Self::Csv(file) => file.append(row, bodies),
            Self::Mcap(file) => file.append(row, bodies),
            Self::Events(_) => Ok(()),
        }
    }

    fn flush(&mut self) -> Result<(), RecordingError> {
        match self {
            Self::Csv(file) => file.flush(),
            // Its chunks are its own, and the same on every clock.
            Self::Mcap(_) => Ok(()),
            Self::Events(file) => file.flush(),
        }
    }

    fn event(&mut self, event: &Event) -> Result<(), RecordingError> {
        match self {
            // Rows alone.
            Self::Csv(_) => {}
            Self::Mcap(file) => file.event(event),
            Self::Events(file) => file.event(event)?,
        }
        Ok(())
    }

    fn tell_lost(&mut self, run_tick: u64, count: u64) {
        if let Self::Mcap(file) = self {
            file.tell_lost(run_tick, count);
        }
    }

    fn finish(self) -> Result<u64, RecordingError> {
        match self {
            Self::Csv(file) => file.finish(),
            Self::Mcap(file) => file.finish(),
            Self::Events(file) => file.finish(),
        }
    }
}

/// What became of a recording.
#[derive(Debug)]
pub struct Recorded {
    /// Where it lies.
    pub path: PathBuf,
    /// Rows in it; or events, where there is nothing else.
    pub rows: u64,
    /// Which of the two.
    pub unit: &'static str,
    /// Rows that the recorder had no room for.
    pub lost: u64,
    /// Why it is not complete, if it is not; has been told.
    pub failure: Option<String>,
}

/// How a recorder treats whoever has more than there is room for.
#[derive(Debug, Clone)]
pub struct Backpressure {
    /// Whether they wait.
    pub when_full: WhenFull,
    /// What ends waiting.
    pub signals: StopSignals,
}

/// Hands events to a recording, as [`Recorder::send`] does rows.
pub struct EventFeed {
    events: EventSender,
    backpressure: Backpressure,
    shared: Arc<Shared>,
    thread: Thread,
}

impl Subscriber for EventFeed {
    fn is_over(&self) -> bool {
        self.shared.is_closing.load(Ordering::Relaxed)
    }

    fn event(&mut self, event: &Event) {
        let mut wait = Wait::begin(&self.shared);
        while self.events.is_full()
            && !self.events.is_abandoned()
            && wait.goes_on(&self.shared, &self.backpressure, &self.thread)
        {}
        self.events.send(*event);
    }
}

/// The slow side's end of a recording.
pub struct Recorder {
    path: PathBuf,
    unit: &'static str,
    rows: RowSender,
    /// Until somebody takes it.
    events: Option<EventFeed>,
    /// The bodies as the other end knows them; `None`: it does not know any.
    known: Vec<Option<BodyRow>>,
    /// Those that are not so, by their numbers.
    changed: Vec<(u32, BodyRow)>,
    backpressure: Backpressure,
    lost: u64,
    /// Of these, those after the row that was sent last.
    untold: u64,
    shared: Arc<Shared>,
    thread: JoinHandle<Result<u64, RecordingError>>,
}

/// What both ends see.
#[derive(Debug, Default)]
struct Shared {
    /// No more rows will come.
    is_closing: AtomicBool,
    /// Rows that are missing: before which tick, and how many.
    gaps: Mutex<VecDeque<(u64, u64)>>,
    /// Rows taken from the queue so far.
    taken: AtomicU64,
    /// How many there were when nobody waited for it any more, and one; 0: somebody does.
    stuck: AtomicU64,
    /// The file takes no more, which has been told.
    has_failed: AtomicBool,
    /// Nobody reads the standard output any more.
    reader_has_gone: AtomicBool,
}

impl Recorder {
    /// Starts to record rows with so many bodies each.
    ///
    /// # Errors
    /// If there can be no thread.
    pub fn start(
        path: &Path,
        file: RecordFile,
        bodies: usize,
        period_ns: u64,
        backpressure: Backpressure,
    ) -> Result<Self, RecordingError> {
        let places = MOST_BODIES.checked_div(bodies).map_or(ROW_QUEUE, |places| places.clamp(64, ROW_QUEUE));
        let (rows, receiver) = row_queue_of(places, bodies);
        let shared = Arc::new(Shared::default());
        let unit = if matches!(file, RecordFile::Events(_)) { EVENTS } else { "rows" };
        let (events, event_ends) = event_queue(MOST_EVENTS);
        let writer =
            RecorderThread { file: Some(file), events: event_ends, shared: shared.clone(), period_ns };
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || writer.run(receiver))
            .map_err(|source| RecordingError::Create { file: path.into(), source })?;
        let (known, changed) = (vec![None; bodies], Vec::with_capacity(bodies));
        let events = Some(EventFeed {
            events,
            backpressure: backpressure.clone(),
            shared: shared.clone(),
            thread: thread.thread().clone(),
        });
        let path = path.into();
        Ok(Self {
            path,
            unit,
            rows,
            events,
            known,
            changed,
            backpressure,
            lost: 0,
            untold: 0,
            shared,
            thread,
        })
    }

    /// Where to hand events over: those of a tick before its row.
    pub fn take_events(&mut self) -> Option<EventFeed> {
        self.events.take()
    }

    /// Hands a row over.
    pub fn send(&mut self, row: &Row, bodies: &[BodyRow]) {
        // Before the row itself: whoever finds the row finds what is missing in front of it.
        if !self.rows.is_full() {
            self.tell_gap(row.run_tick);
        }
        self.changed.clear();
        let numbered = (0..).zip(bodies.iter().copied()).zip(&self.known);
        self.changed.extend(numbered.filter(|((_, is), was)| Some(*is) != **was).map(|(body, _)| body));
        let mut wait = Wait::begin(&self.shared);
        while !self.rows.send(*row, &self.changed) {
            let thread = &self.thread;
            if thread.is_finished() || !wait.goes_on(&self.shared, &self.backpressure, thread.thread()) {
                self.lost += 1;
                self.untold += 1;
                return;
            }
        }
        for (known, body) in self.known.iter_mut().zip(bodies) {
            *known = Some(*body);
        }
    }

    /// Rows are missing in front of this tick.
    fn tell_gap(&mut self, before: u64) {
        if self.untold > 0 {
            self.shared.gaps().push_back((before, std::mem::take(&mut self.untold)));
        }
    }

    /// Nothing more comes: it ends by itself, and [`Self::finish`] says what became of it.
    pub fn close(&mut self) {
        self.tell_gap(u64::MAX);
        self.shared.is_closing.store(true, Ordering::Release);
        self.thread.thread().unpark();
    }

    /// Where it goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file takes no more, which has been told.
    pub fn has_failed(&self) -> bool {
        self.shared.has_failed.load(Ordering::Relaxed)
    }

    /// Whether it went to the standard output, which nobody reads any more.
    pub fn reader_has_gone(&self) -> bool {
        self.shared.reader_has_gone.load(Ordering::Relaxed)
    }

    /// Whether it is of events alone, whatever the scene is.
    pub fn is_of_events(&self) -> bool {
        self.unit == EVENTS
    }

    /// Waits until everything is written.
    pub fn finish(mut self) -> Recorded {
        self.close();
        let mut wait = Wait::begin(&self.shared);
        while !self.thread.is_finished() {
            if wait.is_in_vain(&self.shared) {
                return self.give_up(wait.taken);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let Self { path, unit, lost, thread, .. } = self;
        match thread.join() {
            Ok(Ok(rows)) => Recorded { path, rows, unit, lost, failure: None },
            Ok(Err(error)) => {
                let rows = if let RecordingError::Write { rows, .. } = error { rows } else { 0 };
                Recorded { path, rows, unit, lost, failure: Some(error.to_string()) }
            }
            Err(_) => Recorded { path, rows: 0, unit, lost, failure: Some("the recorder panicked".into()) },
        }
    }

    /// The thread ends with the process.
    fn give_up(self, taken: u64) -> Recorded {
        let why = format!(
            "cannot finish the recording {}: nothing was written for {} s; what reached it until now is readable",
            shown(&self.path).display(),
            STUCK.as_secs()
        );
        say(format_args!("phantom3: {why}"));
        Recorded { path: self.path, rows: taken, unit: self.unit, lost: self.lost, failure: Some(why) }
    }
}

/// A wait for the recorder's thread, which ends if that is stuck.
struct Wait {
    taken: u64,
    since: Instant,
}

impl Wait {
    fn begin(shared: &Shared) -> Self {
        Self { taken: shared.taken.load(Ordering::Relaxed), since: Instant::now() }
    }

    /// Lets the thread go on for a moment; whether that makes sense.
    fn goes_on(&mut self, shared: &Shared, how: &Backpressure, thread: &Thread) -> bool {
        if how.when_full == WhenFull::Drop || how.signals.requested().is_some() || self.is_in_vain(shared) {
            return false;
        }
        thread.unpark();
        std::thread::sleep(Duration::from_micros(200));
        true
    }

    /// Whether nothing was taken for long, in this wait or one before.
    fn is_in_vain(&mut self, shared: &Shared) -> bool {
        let taken = shared.taken.load(Ordering::Relaxed);
        if taken != self.taken {
            *self = Self::begin(shared);
        }
        if self.since.elapsed() > STUCK {
            shared.stuck.store(taken + 1, Ordering::Relaxed);
        }
        shared.stuck.load(Ordering::Relaxed) == taken + 1
    }
}

impl Shared {
    /// Neither side is a real-time thread.
    fn gaps(&self) -> MutexGuard<'_, VecDeque<(u64, u64)>> {
        self.gaps.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The recorder's own thread.
struct RecorderThread {
    /// `None` once it failed.
    file: Option<RecordFile>,
    events: EventReceiver,
    shared: Arc<Shared>,
    period_ns: u64,
}

impl RecorderThread {
    fn run(mut self, mut rows: RowReceiver) -> Result<u64, RecordingError> {
        let mut result = Ok(0);
        let (mut flushed, mut last) = (0, 0);
        loop {
            // Looked at first: what was sent before is then in the queue.
            let is_closing = self.shared.is_closing.load(Ordering::Acquire);
            while let Some((row, bodies)) = rows.receive() {
                self.shared.taken.fetch_add(1, Ordering::Relaxed);
                last = row.run_tick;
                let mut written = self.append(&row, bodies);
                if row.run_tick.saturating_sub(flushed).saturating_mul(self.period_ns) >= FLUSH_NS {
                    flushed = row.run_tick;
                    written = written.and_then(|()| self.file.as_mut().map_or(Ok(()), RecordFile::flush));
                }
                if let Err(error) = written {
                    result = self.abandon(error);
                }
            }
            if is_closing {
                break;
            }
            std::thread::park_timeout(PAUSE);
        }
        self.tell_lost(last, u64::MAX);
        if let Err(error) = self.write_events(u64::MAX) {
            return self.abandon(error);
        }
        let Some(file) = self.file.take() else { return result };
        file.finish().or_else(|error| self.abandon(error))
    }

    /// Goes on without a file that takes no more; says how many rows it has, or what is wrong, which it tells.
    fn abandon(&mut self, error: RecordingError) -> Result<u64, RecordingError> {
        self.file = None;
        if let RecordingError::Write { rows, .. } = &error
            && error.is_of_a_reader_who_left()
        {
            self.shared.reader_has_gone.store(true, Ordering::Relaxed);
            return Ok(*rows);
        }
        say(format_args!("phantom3: {error}"));
        self.shared.has_failed.store(true, Ordering::Relaxed);
        Err(error)
    }

    fn append(&mut self, row: &Row, bodies: &[BodyRow]) -> Result<(), RecordingError> {
        self.tell_lost(row.run_tick, row.run_tick);
        self.file.as_mut().map_or(Ok(()), |file| file.append(row, bodies))?;
        self.write_events(row.run_tick)
    }

    /// Those up to this tick.
    fn write_events(&mut self, up_to: u64) -> Result<(), RecordingError> {
        while let Some(event) = self.events.receive(up_to) {
            self.file.as_mut().map_or(Ok(()), |file| file.event(&event))?;
        }
        Ok(())
    }

    /// Tells of rows that are missing up to here.
    fn tell_lost(&mut self, run_tick: u64, up_to: u64) {
        let mut gaps = self.shared.gaps();
        while gaps.front().is_some_and(|(before, _)| *before <= up_to) {
            let Some((_, count)) = gaps.pop_front() else { break };
            if let Some(file) = &mut self.file {
                file.tell_lost(run_tick, count);
            }
        }
    }
}
