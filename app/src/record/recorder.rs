//! A recording on a thread of its own: whatever the disk does, nobody waits for it but the recording itself.
//!
//! Model: the slow side hands over rows through a bounded queue. In real time a row that finds no room, here or on its way to
//! the slow side, is left out, counted, and told in the file where the format has a place for that; on a clock that can wait, it waits
//! ([`backpressure`](super::backpressure)). A disk that takes no more is told at once, and the rows that follow are thrown
//! away: the run goes on. At the end the recorder has as long as it gets on; one that is stuck is given up. A reader of the
//! standard output who has seen enough is no failure: the recording ends, and so may the run.
//! Events are written behind the row of their tick, which is handed over behind them: where they fill their queue and no row
//! is there, the recorder takes them in, however many they are, or both ends would wait for each other.
//! Everything before the first row is written here, too, if it may have to wait for a reader.
//! Invariants: on a clock that waits, a recording that lacks a row lacks all behind it, and says so. A thread that was left
//! behind replaces no earlier content any more, which has been told as kept.

use super::backpressure::{Backpressure, Progress, Wait};
use super::changes::Changes;
use super::content::{Content, ContentState};
use super::destination::shown;
use super::on_disk::OnDisk;
use super::record_file::RecordFile;
use crate::displaced::Placed;
use crate::fast_loop::WhenFull;
use crate::progress::{SOON, StatusLine};
use crate::recording::RecordingError;
use crate::row::{BodyRow, Row};
use crate::row_queue::{ROW_QUEUE, RowReceiver, RowSender, untouched_row_queue_of};
use io_driver::device::run_time_s;
use io_driver::say::say;
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, Thread};
use std::time::{Duration, Instant};
use world::events::{Event, EventReceiver, EventSender, Subscriber, growing_event_queue};

/// Changed bodies that may wait, of all rows together.
const MOST_BODIES: usize = 1 << 20;
/// Events that may wait; whoever has more for it waits, too.
const MOST_EVENTS: usize = 8192;
/// In real time nobody waits: so many, since a world that ends may bring the ends of all that touched at once.
const MOST_EVENTS_AT_ONCE: usize = 1 << 17;
/// CSV goes to the file after so much of the run (ns), if not before.
const FLUSH_NS: u64 = 500_000_000;
/// How long the recorder sleeps when there is nothing to write.
const PAUSE: Duration = Duration::from_millis(10);

/// What files of events count.
const EVENTS: &str = "events";

/// What became of a recording.
#[derive(Debug)]
pub struct Recorded {
    /// Where it lies.
    pub path: PathBuf,
    /// Rows in it; or events, where there is nothing else.
    pub rows: u64,
    /// Which of the two.
    pub unit: &'static str,
    /// Of that unit, those that are missing.
    pub lost: u64,
    /// Its thread was left behind in the middle of a write: more of the rows may have reached it.
    pub is_left_behind: bool,
    /// Why it is not complete, if it is not; has been told.
    pub failure: Option<String>,
    /// The file has its earlier content: no tick came, or not even the first rows would fit.
    pub is_as_before: bool,
}

impl Recorded {
    /// A recording for which there is no file, or somebody else's.
    pub fn not_begun(error: &RecordingError) -> Self {
        let (path, failure) = (error.file().into(), Some(error.to_string()));
        Self { path, rows: 0, unit: "rows", lost: 0, is_left_behind: false, failure, is_as_before: false }
    }
}

/// Hands events to a recording, as [`Recorder::send`] does rows.
pub struct EventFeed {
    events: EventSender,
    /// So many may wait.
    most: usize,
    backpressure: Backpressure,
    shared: Arc<Shared>,
    thread: Thread,
}

impl Subscriber for EventFeed {
    /// One that was given up still counts what it loses.
    fn is_over(&self) -> bool {
        self.shared.is_closing.load(Ordering::Relaxed)
    }

    fn event(&mut self, event: &Event) {
        let progress = &self.shared.progress;
        let mut wait = Wait::begin(progress);
        while self.events.waiting() >= self.most
            && !self.events.is_abandoned()
            && wait.goes_on(progress, &self.backpressure, &self.thread)
        {}
        let is_sent = !progress.is_given_up() && self.events.waiting() < self.most;
        if is_sent {
            self.events.send(*event);
        } else {
            self.events.lose();
        }
        let count = if is_sent { &self.shared.events_sent } else { &self.shared.events_lost };
        count.fetch_add(1, Ordering::Relaxed);
    }
}

/// The slow side's end of a recording.
pub struct Recorder {
    path: PathBuf,
    unit: &'static str,
    rows: RowSender,
    /// Until somebody takes it.
    events: Option<EventFeed>,
    /// The bodies that the other end does not know as they are; and room for them.
    unknown: Changes,
    changed: Vec<(u32, BodyRow)>,
    /// Things that are no bodies and have been moved, as the other end knows them; and those that are not so.
    known_placed: Vec<Placed>,
    changed_placed: Vec<Placed>,
    backpressure: Backpressure,
    period_ns: u64,
    /// The row that was sent last.
    last_tick: u64,
    /// Rows that were handed over.
    sent: u64,
    lost: u64,
    /// Of these, those after the row that was sent last.
    untold: u64,
    /// Why it was given up, which has been told.
    given_up: Option<String>,
    shared: Arc<Shared>,
    content: Arc<ContentState>,
    thread: JoinHandle<Result<u64, RecordingError>>,
}

/// What both ends see.
#[derive(Debug, Default)]
struct Shared {
    /// No more rows will come.
    is_closing: AtomicBool,
    /// Rows that are missing: before which tick, and how many.
    gaps: Mutex<VecDeque<(u64, u64)>>,
    /// How far it is, and whether anybody still waits for it.
    progress: Progress,
    /// The file takes no more, which has been told.
    has_failed: AtomicBool,
    /// Nobody reads the standard output any more.
    reader_has_gone: AtomicBool,
    /// The file has its earlier content in the end.
    is_as_before: AtomicBool,
    /// The run did not begin, and the file is to be as it was.
    is_in_vain: AtomicBool,
    /// Events that were handed over, and those that found no room.
    events_sent: AtomicU64,
    events_lost: AtomicU64,
}

impl Recorder {
    /// Starts to record rows with so many bodies each.
    ///
    /// # Errors
    /// If there can be no thread.
    pub fn start(
        path: &Path,
        mut file: RecordFile,
        bodies: usize,
        period_ns: u64,
        backpressure: Backpressure,
    ) -> Result<Self, RecordingError> {
        let no_handle = |source| RecordingError::Create { file: shown(path), source };
        let no_thread = |source| RecordingError::NoThread { file: shown(path), source };
        let second_handle = file.take_second_handle().map_err(no_handle)?;
        let on_disk = second_handle.map(OnDisk::start).transpose().map_err(no_thread)?;
        let (rows, receiver) = untouched_row_queue_of(ROW_QUEUE, MOST_BODIES, bodies);
        let shared = Arc::new(Shared::default());
        let content = file.content();
        let unit = if matches!(file, RecordFile::Events(_)) { EVENTS } else { "rows" };
        let (events, event_ends) = growing_event_queue(MOST_EVENTS);
        let waits = backpressure.when_full == WhenFull::Wait;
        let writer = RecorderThread {
            path: path.into(),
            file: Some(file),
            on_disk,
            events: event_ends,
            taken_in: VecDeque::new(),
            waits,
            shared: shared.clone(),
            content: Arc::clone(&content),
            period_ns,
        };
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || writer.run(receiver))
            .map_err(no_thread)?;
        let (unknown, changed) = (Changes::all(bodies), Vec::with_capacity(bodies));
        let events = Some(EventFeed {
            events,
            most: if waits { MOST_EVENTS } else { MOST_EVENTS_AT_ONCE },
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
            unknown,
            changed,
            known_placed: Vec::new(),
            changed_placed: Vec::new(),
            backpressure,
            period_ns,
            last_tick: 0,
            lost: 0,
            sent: 0,
            untold: 0,
            given_up: None,
            shared,
            content,
            thread,
        })
    }

    /// Starts them all, or none: files of those that had been started are as they were.
    ///
    /// # Errors
    /// The first for which there can be no thread.
    pub fn start_all<'a>(
        files: impl Iterator<Item = (&'a PathBuf, RecordFile)>,
        mut start: impl FnMut(&Path, RecordFile) -> Result<Self, RecordingError>,
    ) -> Result<Vec<Self>, RecordingError> {
        let mut started = Vec::new();
        for (path, file) in files {
            match start(path, file) {
                Ok(recorder) => started.push(recorder),
                Err(error) => {
                    started.into_iter().for_each(Self::take_back);
                    return Err(error);
                }
            }
        }
        Ok(started)
    }

    /// Where to hand events over: those of a tick before its row.
    pub fn take_events(&mut self) -> Option<EventFeed> {
        self.events.take()
    }

    /// Hands a row over with all bodies, of which those of the numbers `changed` may not be as they were with the row before;
    /// `placed` is what is no body and has been moved, where it stands.
    pub fn send(&mut self, row: &Row, (bodies, changed): (&[BodyRow], &[u32]), placed: &[Placed]) {
        if self.is_given_up() {
            self.lost += 1;
            self.untold += 1;
            return;
        }
        // Before the row itself: whoever finds the row finds what is missing in front of it.
        if self.rows.has_room(0, 0) {
            self.tell_gap(row.run_tick);
        }
        self.unknown.note(changed);
        self.changed.clear();
        let unknown = self.unknown.sorted().iter();
        self.changed.extend(unknown.filter_map(|&number| Some((number, *bodies.get(number as usize)?))));
        self.note_placed(placed);
        if !self.hand_over(row) {
            self.leave_out();
            return;
        }
        self.last_tick = row.run_tick;
        self.sent += 1;
        self.unknown.forget();
    }

    /// So many rows are missing before the next one, which nobody had room for.
    pub fn miss(&mut self, rows: u64) {
        if !self.is_of_events() {
            self.lost += rows;
            self.untold += rows;
        }
    }

    /// True once it has got a row.
    pub fn has_begun(&self) -> bool {
        self.sent > 0
    }

    /// Changes go with the next row that is handed over.
    fn note_placed(&mut self, placed: &[Placed]) {
        if self.known_placed == placed {
            return;
        }
        let waiting = self.changed_placed.len();
        for (at, &now) in placed.iter().enumerate() {
            // Who was moved later is told behind the others.
            if self.known_placed.get(at) == Some(&now) {
                continue;
            }
            match self.changed_placed[..waiting].iter_mut().find(|(entity, _)| *entity == now.0) {
                Some(waits) => waits.1 = now.1,
                None => self.changed_placed.push(now),
            }
        }
        self.known_placed.clear();
        self.known_placed.extend_from_slice(placed);
    }

    /// `false`: there is no room, and will be none as long as somebody waits.
    fn hand_over(&mut self, row: &Row) -> bool {
        let mut wait = Wait::begin(&self.shared.progress);
        while !self.rows.send_with(*row, &self.changed, &mut self.changed_placed) {
            let thread = &self.thread;
            let progress = &self.shared.progress;
            if thread.is_finished() || !wait.goes_on(progress, &self.backpressure, thread.thread()) {
                return false;
            }
        }
        true
    }

    /// Counts a row that is missing.
    fn leave_out(&mut self) {
        self.lost += 1;
        self.untold += 1;
        if self.backpressure.when_full == WhenFull::Wait {
            self.shared.progress.give_up();
            self.is_given_up();
        }
    }

    /// Whether nobody waits for it any more; the first time that is told.
    fn is_given_up(&mut self) -> bool {
        let is_given_up = self.shared.progress.is_given_up();
        if is_given_up && self.given_up.is_none() {
            let why = format!(
                "cannot write the recording {}: nothing was written for {} s; the run goes on without it; {}",
                shown(&self.path).display(),
                self.backpressure.patience().as_secs(),
                self.has_until_now()
            );
            say(format_args!("phantom3: {why}"));
            self.given_up = Some(why);
        }
        is_given_up
    }

    /// Content of the file in words, while its thread is stuck.
    fn has_until_now(&self) -> String {
        match self.content.load() {
            Content::Earlier if self.content.is_left_behind() => "the file is as it was".into(),
            Content::Earlier => "so far the file is as it was".into(),
            Content::Noisy => {
                "its earlier content is there, perhaps with bytes behind it by which room was tried".into()
            }
            Content::BeingReplaced => "its earlier content may be lost".into(),
            Content::Lost => "its earlier content is lost".into(),
            Content::Replaced => {
                let until_s = run_time_s(self.last_tick.cast_signed(), self.period_ns);
                format!("what it has ends at t = {until_s:?} s at the latest")
            }
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

    /// How far it is.
    #[cfg(test)]
    pub(super) fn progress(&self) -> &Progress {
        &self.shared.progress
    }

    /// Where it goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file takes no more, which has been told.
    pub fn has_failed(&self) -> bool {
        self.shared.has_failed.load(Ordering::Relaxed) || self.given_up.is_some()
    }

    /// Whether it went to the standard output, which nobody reads any more.
    pub fn reader_has_gone(&self) -> bool {
        self.shared.reader_has_gone.load(Ordering::Relaxed)
    }

    /// Whether it is of events alone, whatever the scene is.
    pub fn is_of_events(&self) -> bool {
        self.unit == EVENTS
    }

    /// Of a run that did not begin: what was made is removed again.
    pub fn take_back(self) {
        self.shared.is_in_vain.store(true, Ordering::Relaxed);
        drop(self.finish());
    }

    /// Waits until everything is written.
    pub fn finish(mut self) -> Recorded {
        self.close();
        self.is_given_up();
        let mut wait = Wait::begin(&self.shared.progress);
        let (begun, mut line) = (Instant::now(), StatusLine::told_just_now());
        while !self.thread.is_finished() {
            let patience = self.backpressure.patience();
            if wait.is_in_vain(&self.shared.progress, patience) {
                line.end();
                return self.leave_behind();
            }
            if begun.elapsed() > SOON {
                line.show(|| {
                    let (path, for_s) = (shown(&self.path), wait.in_vain_for().as_secs());
                    let (path, most_s) = (path.display(), patience.as_secs());
                    format!(
                        "phantom3: finishing the recording {path} (nothing written for {for_s} s of {most_s})"
                    )
                });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        line.end();
        let (_, lost) = self.sent_and_lost();
        let Self { path, unit, thread, given_up, shared, .. } = self;
        let (rows, failure) = match thread.join() {
            Ok(Ok(rows)) => (rows, None),
            Ok(Err(error)) => {
                let rows = if let RecordingError::Write { rows, .. } = error.cause() { *rows } else { 0 };
                (rows, Some(error.to_string()))
            }
            Err(_) => (0, Some(panicked(&path))),
        };
        let is_as_before = shared.is_as_before.load(Ordering::Relaxed);
        let failure = failure.or(given_up);
        Recorded { path, rows, unit, lost, is_left_behind: false, failure, is_as_before }
    }

    /// Numbers of the unit that were handed over, and that found no room.
    pub(super) fn sent_and_lost(&self) -> (u64, u64) {
        if self.is_of_events() {
            let [sent, lost] = [&self.shared.events_sent, &self.shared.events_lost];
            (sent.load(Ordering::Relaxed), lost.load(Ordering::Relaxed))
        } else {
            (self.sent, self.lost)
        }
    }

    /// The thread ends with the process.
    fn leave_behind(self) -> Recorded {
        let (sent, lost) = self.sent_and_lost();
        self.content.leave_behind();
        let why = self.given_up.clone().unwrap_or_else(|| {
            let why = format!(
                "cannot finish the recording {}: nothing was written for {} s; {}",
                shown(&self.path).display(),
                self.backpressure.patience().as_secs(),
                self.has_until_now()
            );
            say(format_args!("phantom3: {why}"));
            why
        });
        let rows = self.shared.progress.written();
        // From now on that stays so.
        let is_as_before = self.content.load() == Content::Earlier;
        Recorded {
            path: self.path,
            rows,
            unit: self.unit,
            lost: lost + sent.saturating_sub(rows),
            is_left_behind: true,
            failure: Some(why),
            is_as_before,
        }
    }
}

impl Shared {
    /// Neither side is a real-time thread.
    fn gaps(&self) -> MutexGuard<'_, VecDeque<(u64, u64)>> {
        self.gaps.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Tells of a recorder that ended by itself.
fn panicked(path: &Path) -> String {
    let why = format!(
        "the recording {} ended by itself: its thread panicked, perhaps for lack of memory; what reached it before is \
         readable",
        shown(path).display()
    );
    say(format_args!("phantom3: {why}"));
    why
}

/// The recorder's own thread.
struct RecorderThread {
    path: PathBuf,
    /// `None` once it failed.
    file: Option<RecordFile>,
    /// `None` where there is no disk to reach, or once it failed.
    on_disk: Option<OnDisk>,
    events: EventReceiver,
    /// Events before those, whose row has not come yet.
    taken_in: VecDeque<Event>,
    /// True if others wait for it.
    waits: bool,
    shared: Arc<Shared>,
    content: Arc<ContentState>,
    period_ns: u64,
}

impl RecorderThread {
    fn run(mut self, mut rows: RowReceiver) -> Result<u64, RecordingError> {
        let mut result = Ok(0);
        let (mut flushed, mut last) = (0, 0);
        if let Err(error) = self.file.as_mut().map_or(Ok(()), RecordFile::begin) {
            result = self.abandon(error);
        }
        loop {
            // Looked at first: what was sent before is then in the queue.
            let is_closing = self.shared.is_closing.load(Ordering::Acquire);
            while let Some((row, _)) = rows.receive() {
                self.shared.progress.take();
                last = row.run_tick;
                let mut written = self.append(&row, (rows.bodies(), rows.changed()), rows.placed());
                if row.run_tick.saturating_sub(flushed).saturating_mul(self.period_ns) >= FLUSH_NS {
                    flushed = row.run_tick;
                    written = written.and_then(|()| self.file.as_mut().map_or(Ok(()), RecordFile::flush));
                }
                if let Err(error) = written {
                    result = self.abandon(error);
                }
                self.shared.progress.wrote(self.file.as_ref().map_or(0, RecordFile::rows));
                if let Err(error) = self.bring_to_disk(last) {
                    result = self.abandon(error);
                }
            }
            if let Err(error) = self.bring_to_disk(last) {
                result = self.abandon(error);
            }
            if is_closing {
                break;
            }
            if !self.take_in_events() {
                std::thread::park_timeout(PAUSE);
            }
        }
        self.tell_lost(last, u64::MAX);
        if let Err(error) = self.write_events(u64::MAX) {
            return self.abandon(error);
        }
        let Some(file) = self.file.take() else { return result };
        self.shared.is_as_before.store(file.is_as_before(), Ordering::Relaxed);
        if self.shared.is_in_vain.load(Ordering::Relaxed) && self.shared.progress.taken() == 0 {
            return Ok(0);
        }
        let finished = file.finish().and_then(|rows| {
            let ended = self.on_disk.take().map_or(Ok(()), OnDisk::end);
            ended.map(|()| rows).map_err(|source| self.refused(source, last, rows))
        });
        finished.or_else(|error| self.abandon(error))
    }

    /// Has what was written brought to the disk itself from time to time, up to this tick.
    fn bring_to_disk(&mut self, last: u64) -> Result<(), RecordingError> {
        let (Some(file), Some(on_disk)) = (&self.file, &mut self.on_disk) else { return Ok(()) };
        let rows = file.rows();
        on_disk.has_rows(rows).map_err(|source| self.refused(source, last, rows))
    }

    /// The disk did not take all of so many rows, of which the last is of this tick.
    fn refused(&self, source: io::Error, last: u64, rows: u64) -> RecordingError {
        let until_s = run_time_s(last.cast_signed(), self.period_ns);
        RecordingError::of_write(&shown(&self.path), source, &self.content, (until_s, rows))
    }

    /// Goes on without a file that takes no more; says how many rows it has, or what is wrong, which it tells.
    fn abandon(&mut self, error: RecordingError) -> Result<u64, RecordingError> {
        self.on_disk = None;
        if let Some(file) = self.file.take() {
            file.give_up();
        }
        // With the file went what could not be cut off of it, if that was possible by then.
        let error = if self.content.load() == Content::Earlier { error.without_noise() } else { error };
        if let RecordingError::Write { rows, .. } = error.cause()
            && error.is_of_a_reader_who_left()
        {
            self.shared.reader_has_gone.store(true, Ordering::Relaxed);
            return Ok(*rows);
        }
        if let RecordingError::NotBegun { .. } = error.cause() {
            self.shared.is_as_before.store(true, Ordering::Relaxed);
            if self.content.is_left_behind() {
                // Which has been told.
                return Err(error);
            }
        }
        say(format_args!("phantom3: {error}"));
        self.shared.has_failed.store(true, Ordering::Relaxed);
        Err(error)
    }

    fn append(
        &mut self,
        row: &Row,
        bodies: (&[BodyRow], &[u32]),
        placed: &[Placed],
    ) -> Result<(), RecordingError> {
        self.tell_lost(row.run_tick, row.run_tick);
        self.file.as_mut().map_or(Ok(()), |file| file.append(row, bodies, placed))?;
        self.write_events(row.run_tick)
    }

    /// Those up to this tick.
    fn write_events(&mut self, up_to: u64) -> Result<(), RecordingError> {
        while let Some(event) = self.next_event(up_to) {
            self.file.as_mut().map_or(Ok(()), |file| file.event(&event))?;
        }
        Ok(())
    }

    fn next_event(&mut self, up_to: u64) -> Option<Event> {
        match self.taken_in.front() {
            Some(event) if event.run_tick > up_to => None,
            Some(_) => self.taken_in.pop_front(),
            None => self.events.receive(up_to),
        }
    }

    /// Without a row at hand: makes room for who waits until there is some for the next event, before that row. Says whether it
    /// has made any.
    fn take_in_events(&mut self) -> bool {
        let is_needed = self.waits && self.events.waiting() >= MOST_EVENTS / 2;
        if is_needed {
            self.taken_in.extend(std::iter::from_fn(|| self.events.receive(u64::MAX)).take(MOST_EVENTS));
            self.shared.progress.take();
        }
        is_needed
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Names;
    use crate::record::Opened;
    use crate::recording::Recording;
    use rt_core::signals::StopSignals;

    /// The one thing moves in the rows that are left out, and rests from then on.
    #[test]
    fn what_changed_in_rows_that_found_no_room_comes_with_the_next_one() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("out.csv");
        let names = Names { bodies: vec!["ball".into()], ..Names::default() };
        let opened = Opened::recording(&path).expect("opened");
        let file = RecordFile::Csv(Box::new(Recording::begin(opened, names, 1_000_000).expect("room")));
        let how = Backpressure::new(WhenFull::Drop, &StopSignals::default());
        let mut recorder = Recorder::start(&path, file, 1, 1_000_000, how).expect("a thread");
        let shared = Arc::clone(&recorder.shared);
        // Its thread looks for gaps before each row, and has taken one by then.
        let standing_still = shared.gaps();
        let mut ball = BodyRow::default();
        let mut run_tick = 0;
        let mut send = |recorder: &mut Recorder, y: f64| {
            let changed: &[u32] = if ball.position.y == y && run_tick > 0 { &[] } else { &[0] };
            ball.position.y = y;
            recorder.send(&Row { run_tick, ..Row::empty() }, (&[ball], changed), &[]);
            run_tick += 1;
        };
        (0..ROW_QUEUE + 2).for_each(|_| send(&mut recorder, 0.0));
        (0..3).for_each(|_| send(&mut recorder, 0.5));
        drop(standing_still);
        patience::until("room", || recorder.rows.has_room(ROW_QUEUE, 0));
        send(&mut recorder, 0.5);
        let recorded = recorder.finish();
        assert!((3..=5).contains(&recorded.lost), "{}", recorded.lost);
        let table = std::fs::read_to_string(&path).expect("there");
        let last = table.lines().last().expect("rows");
        assert!(last.split(',').any(|cell| cell == "0.5"), "{last}");
    }

    /// As on a disk that stands still, and goes on while the run waits for another recording.
    #[test]
    fn a_recorder_that_goes_on_after_it_was_left_behind_leaves_the_earlier_recording() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("out.csv");
        std::fs::write(&path, "earlier rows").expect("room");
        let opened = Opened::recording(&path).expect("opened");
        let file = RecordFile::Csv(Box::new(
            Recording::begin(opened, Names::default(), 1_000_000).expect("nothing is written yet"),
        ));
        let patience = Duration::from_millis(100);
        let how = Backpressure { patience, ..Backpressure::new(WhenFull::Wait, &StopSignals::default()) };
        let mut recorder = Recorder::start(&path, file, 0, 1_000_000, how).expect("a thread");
        let shared = Arc::clone(&recorder.shared);
        // Its thread looks for gaps before each row.
        let standing_still = shared.gaps();
        for run_tick in 0..10 {
            recorder.send(&Row { run_tick, ..Row::empty() }, (&[], &[]), &[]);
        }
        let recorded = recorder.finish();
        assert!(recorded.is_left_behind && recorded.is_as_before);
        assert!(recorded.failure.is_some_and(|words| words.ends_with("the file is as it was")));
        drop(standing_still);
        patience::until("the end of the thread", || Arc::strong_count(&shared) == 1);
        assert_eq!(std::fs::read(&path).expect("there"), b"earlier rows");
    }
}
