//! Backpressure of a recording: whoever has a row for it waits, or leaves the row out.
//!
//! Model: in real time a row that finds no room is left out, and later ones follow. On a clock that can wait it is waited
//! for as long as the recorder gets on, also after a request to stop, so that a slow reader gets every row; one that reads
//! nothing has less time from then on. The first wait in vain is the last: what the recording has is whole up to there, and
//! nothing follows.

use crate::fast_loop::WhenFull;
use rt_core::signals::StopSignals;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

/// A recorder that has not written anything for so long will not any more.
pub(crate) const STUCK: Duration = Duration::from_secs(30);
/// Nor will one that has not for so long after somebody wanted the end.
const STUCK_AT_THE_END: Duration = Duration::from_secs(3);

/// How a recorder treats whoever has more than there is room for.
#[derive(Debug, Clone)]
pub struct Backpressure {
    /// Whether they wait.
    pub when_full: WhenFull,
    /// For how long without any progress, at most.
    pub patience: Duration,
    /// Signals that ask for the end.
    pub signals: StopSignals,
}

impl Backpressure {
    /// With the usual patience.
    pub fn new(when_full: WhenFull, signals: &StopSignals) -> Self {
        Self { when_full, patience: STUCK, signals: signals.clone() }
    }

    /// Longest wait without any progress, as things are.
    pub(super) fn patience(&self) -> Duration {
        let most = if self.signals.requested().is_some() { STUCK_AT_THE_END } else { self.patience };
        self.patience.min(most)
    }
}

/// How far a recorder is, as both of its ends see it.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    /// Rows taken from the queue so far, or steps of what is slower than rows.
    taken: AtomicU64,
    /// Rows that have reached the file.
    written: AtomicU64,
    /// How many there were when a wait was in vain, and one; 0: none was.
    stuck: AtomicU64,
    /// Nobody who waits has anything more for it.
    is_given_up: AtomicBool,
}

impl Progress {
    /// One more is taken.
    pub(crate) fn take(&self) {
        self.taken.fetch_add(1, Ordering::Relaxed);
    }

    /// Rows taken.
    pub(crate) fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// So many rows have reached the file.
    pub(super) fn wrote(&self, rows: u64) {
        self.written.store(rows, Ordering::Relaxed);
    }

    /// Rows that have reached it.
    pub(super) fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Ends it for whoever waits, for good.
    pub(super) fn give_up(&self) {
        self.is_given_up.store(true, Ordering::Relaxed);
    }

    /// Whether it was.
    pub(super) fn is_given_up(&self) -> bool {
        self.is_given_up.load(Ordering::Relaxed)
    }
}

/// A wait for the recorder's thread, which ends if that is stuck.
pub(crate) struct Wait {
    taken: u64,
    since: Instant,
}

impl Wait {
    pub(crate) fn begin(progress: &Progress) -> Self {
        Self { taken: progress.taken(), since: Instant::now() }
    }

    /// Lets the thread go on for a moment; whether that makes sense.
    pub(super) fn goes_on(&mut self, progress: &Progress, how: &Backpressure, thread: &Thread) -> bool {
        if how.when_full == WhenFull::Drop {
            return false;
        }
        if progress.is_given_up() || self.is_in_vain(progress, how.patience()) {
            progress.give_up();
            return false;
        }
        thread.unpark();
        std::thread::sleep(Duration::from_micros(200));
        true
    }

    /// The time since anything was taken, as far as this wait knows.
    pub(super) fn in_vain_for(&self) -> Duration {
        self.since.elapsed()
    }

    /// Whether nothing was taken for long, in this wait or one before.
    pub(crate) fn is_in_vain(&mut self, progress: &Progress, patience: Duration) -> bool {
        let taken = progress.taken();
        if taken != self.taken {
            *self = Self::begin(progress);
        }
        if self.since.elapsed() > patience {
            progress.stuck.store(taken + 1, Ordering::Relaxed);
        }
        progress.stuck.load(Ordering::Relaxed) == taken + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::book::Book;
    use crate::columns::Names;
    use crate::record::{EventsFile, Opened, RecordFile, Recorded, Recorder};
    use crate::recording::Recording;
    use crate::report::recording_line;
    use crate::row::Row;
    use patience::prelude::*;
    use rustix::fs::OFlags;
    use std::fs::{File, OpenOptions};
    use std::io::{self, Read};
    use std::os::unix::fs::OpenOptionsExt;
    use std::path::Path;
    use world::events::{Event, Kind, Subscriber};

    const PERIOD_NS: u64 = 1_000_000;

    /// A recorder into a pipe, and the pipe's other end.
    fn piped(pipe: &Path, patience: Duration) -> (Recorder, File) {
        piped_as(pipe, patience, |file| {
            let table = Recording::begin(file, Names::default(), PERIOD_NS);
            RecordFile::Csv(Box::new(table.expect("a table")))
        })
    }

    fn piped_as(
        pipe: &Path,
        patience: Duration,
        begin: impl FnOnce(Opened) -> RecordFile,
    ) -> (Recorder, File) {
        let (kind, mode) = (rustix::fs::FileType::Fifo, rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR);
        rustix::fs::mknodat(rustix::fs::CWD, pipe, kind, mode, 0).expect("a pipe");
        let without_waiting = OFlags::NONBLOCK.bits().cast_signed();
        let reader =
            OpenOptions::new().read(true).custom_flags(without_waiting).open(pipe).expect("a reader");
        let file = begin(Opened::recording(pipe).expect("a pipe that is read"));
        let how = Backpressure { patience, ..Backpressure::new(WhenFull::Wait, &StopSignals::default()) };
        let recorder = Recorder::start(pipe, file, 0, PERIOD_NS, how);
        (recorder.expect("a thread"), reader)
    }

    /// Everything that comes until the other end is closed.
    fn read_to_the_end(mut reader: File) -> String {
        let mut all = Vec::new();
        let mut piece = vec![0; 1 << 16];
        let begun = Instant::now();
        loop {
            assert!(begun.elapsed() < patience::limit(), "nobody closes it; so far {} bytes", all.len());
            match reader.read(&mut piece) {
                Ok(0) => return String::from_utf8(all).expect("a table"),
                Ok(count) => all.extend(&piece[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Err(error) => panic!("{error}"),
            }
        }
    }

    /// A write into a pipe does not say how much of it has got there.
    #[test]
    fn of_a_table_that_nobody_reads_no_row_is_counted_that_has_not_reached_the_pipe() {
        let directory = tempfile::tempdir().expect("a directory");
        let (mut recorder, mut reader) = piped(&directory.path().join("pipe"), Duration::from_millis(300));
        let mut sent = 0;
        while !recorder.has_failed() && sent < 100_000 {
            recorder.send(&Row { run_tick: sent, ..Row::empty() }, (&[], &[]), &[]);
            sent += 1;
        }
        let Recorded { rows, lost, is_left_behind, .. } = recorder.finish();
        assert!(is_left_behind && rows + lost == sent, "{rows} {lost} of {sent}");
        let mut piece = vec![0; 1 << 16];
        let count = reader.read(&mut piece).expect("what is in the pipe");
        let lines = piece[..count].iter().filter(|byte| **byte == b'\n').count() as u64;
        // One is the header.
        assert!(lines > 1000 && rows < lines, "{rows} of {lines}");
    }

    #[test]
    fn of_events_that_nobody_reads_events_are_counted_and_no_ticks() {
        let directory = tempfile::tempdir().expect("a directory");
        let pipe = directory.path().join("pipe.jsonl");
        let (mut recorder, _reader) = piped_as(&pipe, Duration::from_millis(300), |file| {
            let events = EventsFile::create(file, Names::default(), PERIOD_NS, Book::default());
            RecordFile::Events(Box::new(events.expect("a pipe")))
        });
        let mut feed = recorder.take_events().expect("nobody has taken it");
        // An event has thirty bytes at least, a pipe 64 KiB, the queue 8192 events, the file's own buffer 256 KiB.
        let most = 50_000;
        for tick in 0..most {
            feed.event(&Event { run_tick: tick, kind: Kind::Reset });
            // Of a hundred ticks each.
            if tick % 100 == 0 {
                recorder.send(&Row { run_tick: tick, ..Row::empty() }, (&[], &[]), &[]);
            }
        }
        let (handed_over, lost) = recorder.sent_and_lost();
        assert!(lost > 0 && handed_over + lost == most, "{handed_over} {lost}");
        let recorded = recorder.finish();
        assert_eq!((recorded.unit, recorded.rows + recorded.lost), ("events", most));
        let line = recording_line(&recorded);
        let told = format!(
            "({} events at least, {} LOST at most: its reader was too slow)",
            recorded.rows, recorded.lost
        );
        assert!(line.contains(&told), "{line}");
    }

    /// The row of a tick comes behind all of its events.
    #[test]
    fn on_a_clock_that_waits_no_event_of_a_tick_is_lost_however_many_it_has() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("events.jsonl");
        let opened = Opened::recording(&path).expect("opened");
        let events = EventsFile::create(opened, Names::default(), PERIOD_NS, Book::default());
        let file = RecordFile::Events(Box::new(events.expect("a file")));
        let how = Backpressure::new(WhenFull::Wait, &StopSignals::default());
        let how = Backpressure { patience: Duration::from_secs(2), ..how };
        let mut recorder = Recorder::start(&path, file, 0, PERIOD_NS, how).expect("a thread");
        let mut feed = recorder.take_events().expect("nobody has taken it");
        let (in_a_tick, ticks) = (20_000, 3);
        for run_tick in 0..ticks {
            (0..in_a_tick).for_each(|_| feed.event(&Event { run_tick, kind: Kind::Reset }));
            recorder.send(&Row { run_tick, ..Row::empty() }, (&[], &[]), &[]);
        }
        let Recorded { rows, lost, failure, .. } = recorder.finish();
        assert_eq!((rows, lost, failure), (ticks * in_a_tick, 0, None));
        let text = std::fs::read_to_string(&path).expect("events");
        let ticks_told = text.lines().map(|line| line.split([':', ',']).nth(1).expect("a tick").to_owned());
        assert!(ticks_told.eq((0..ticks).flat_map(|tick| (0..in_a_tick).map(move |_| tick.to_string()))));
    }

    #[test]
    fn a_reader_who_comes_back_too_late_finds_a_table_without_a_gap_and_the_recording_is_not_complete() {
        let directory = tempfile::tempdir().expect("a directory");
        let (mut recorder, reader) = piped(&directory.path().join("pipe"), Duration::from_millis(300));
        let row = |run_tick| Row { run_tick, ..Row::empty() };
        // A row has eight bytes at least, a pipe 64 KiB, the queue 8192 rows, the table's own buffer 256 KiB.
        let most = 100_000;
        let given_up = (0..most).find(|tick| {
            recorder.send(&row(*tick), (&[], &[]), &[]);
            recorder.has_failed()
        });
        let given_up = given_up.expect("nobody reads");
        let table = std::thread::spawn(move || read_to_the_end(reader));
        patience::until("an empty queue", || recorder.progress().taken() == given_up);
        for tick in given_up + 1..given_up + 1000 {
            recorder.send(&row(tick), (&[], &[]), &[]);
        }
        let Recorded { rows, lost, failure, .. } = recorder.finish();
        assert_eq!((rows, lost), (given_up, 1000));
        let failure = failure.expect("rows are missing");
        assert!(failure.contains("nothing was written for"), "{failure}");
        let table = table.bounded_join().expect("a table");
        let times = table.lines().skip(1).map(|line| line.split(',').next().unwrap_or_default().to_owned());
        let without_gap = (0..given_up).map(|tick| format!("{:?}", tick as f64 / 1e3));
        assert!(times.eq(without_gap), "{given_up} rows");
    }
}
