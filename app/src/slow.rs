//! The slow thread's turn: take what the fast thread left and hand it to the recorders and to those who want events.

use crate::control::desk::{Coming, Desk};
use crate::on_request::OnRequest;
use crate::record::{Beginning, Files, Recorded, Recorder};
use crate::row::Row;
use crate::row_queue::RowReceiver;
use crate::snapshots::{Drawn, Snapshots};
use crate::spectator::{Loss, Spectator};
use io_driver::say::say;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};
use world::events::{Class, Filter, Hub};

/// Until whoever watches a run as well looks at that again.
const A_WHILE: Duration = Duration::from_millis(50);

/// The slow side of a run.
pub struct SlowSide {
    rows: RowReceiver,
    recorders: Vec<Recorder>,
    /// Those of scenes that are over.
    closed: Vec<Recorder>,
    /// What could not be begun.
    failed: Vec<Recorded>,
    /// How recordings of other scenes are made.
    files: Option<Files>,
    /// Scenes that took over.
    scenes: u32,
    /// The one that will.
    coming: Option<Coming>,
    /// Who takes orders, if anybody gives them.
    desk: Option<Desk>,
    /// Who takes pictures, if anybody does.
    snapshots: Option<Snapshots>,
    /// Who looks on at a window, if anybody does.
    spectator: Option<Spectator>,
    /// The hand that moved the fingers is gone.
    has_lost_its_hand: bool,
    /// Who records when people ask for it, if they may.
    on_request: Option<OnRequest>,
    /// Who else wants to know what happens.
    pub events: Hub,
    /// The newest row, for whoever wants to look.
    pub newest: Option<Row>,
}

impl SlowSide {
    /// Takes rows and events from their queues into the recordings, if there are any.
    pub fn new(rows: RowReceiver, events: Hub, recorders: Vec<Recorder>) -> Self {
        let (mut recorders, mut events) = (recorders, events);
        subscribe(&mut recorders, &mut events);
        Self {
            rows,
            recorders,
            closed: Vec::new(),
            failed: Vec::new(),
            files: None,
            scenes: 0,
            coming: None,
            desk: None,
            snapshots: None,
            spectator: None,
            has_lost_its_hand: false,
            on_request: None,
            events,
            newest: None,
        }
    }

    /// With somebody who takes orders, and with recordings of other scenes than the first made so.
    #[must_use]
    pub fn with_desk(self, desk: Option<Desk>, files: Files) -> Self {
        Self { desk, files: Some(files), ..self }
    }

    /// With pictures.
    #[must_use]
    pub fn with_snapshots(self, snapshots: Option<Snapshots>) -> Self {
        Self { snapshots, ..self }
    }

    /// With a window.
    #[must_use]
    pub fn with_spectator(self, spectator: Option<Spectator>) -> Self {
        Self { spectator, ..self }
    }

    /// With recordings that people may ask for.
    #[must_use]
    pub fn with_requests(self, on_request: Option<OnRequest>) -> Self {
        Self { on_request, ..self }
    }

    /// From now on people at the window, if there are any, see how the loop of the driver goes that listens here.
    pub fn watch_driver(&mut self, socket: &Path) {
        if let Some(spectator) = &mut self.spectator {
            spectator.watch_driver(socket.into());
        }
    }

    /// Takes everything that is there. A recording that cannot be written tells so itself, and the run goes on.
    pub fn step(&mut self) {
        self.step_until(None);
    }

    /// The same for some milliseconds at most, whatever waits: whoever calls has something else to look at.
    pub fn step_a_while(&mut self) {
        self.step_until(Some(Instant::now() + A_WHILE));
    }

    fn step_until(&mut self, until: Option<Instant>) {
        self.desk.iter_mut().for_each(Desk::step);
        self.take_rows(until);
        while self.go_on_to_next_scene() {
            self.take_rows(until);
        }
        self.end_what_failed();
        self.leave_what_shows_nothing();
        let Some(spectator) = &mut self.spectator else { return };
        let recording = self.on_request.as_ref().and_then(OnRequest::path);
        spectator.step(recording, self.desk.as_mut());
        if let Some(wanted) = spectator.take_record() {
            let said = self.record(wanted);
            self.tell(said);
        }
    }

    /// A display that is gone ends a run only if the hand was moved there.
    fn leave_what_shows_nothing(&mut self) {
        match self.spectator.as_ref().and_then(Spectator::loss) {
            None => {}
            Some(Loss::Window) => {
                say(format_args!("phantom3: the display is gone; the run goes on without a window"));
                self.spectator = None;
            }
            Some(Loss::Hand) => {
                say(format_args!("phantom3: the display is gone, and with it the hand; the run ends"));
                self.spectator = None;
                self.has_lost_its_hand = true;
            }
        }
    }

    /// Begins a recording with the next row, or ends the one that is under way; says in words what was done.
    pub fn record(&mut self, wanted: bool) -> String {
        let Some(on_request) = &mut self.on_request else { return "nothing can be recorded here".into() };
        if wanted && on_request.path().is_none() {
            let path = on_request.next_path();
            return self.record_in(&path);
        }
        if let (true, Some(path)) = (wanted, on_request.path()) {
            return format!("recording {}", path.display());
        }
        let ended = on_request.end();
        let said = ended.as_ref().map(|recorder| format!("recorded {}", recorder.path().display()));
        self.closed.extend(ended);
        said.unwrap_or_else(|| "nothing was being recorded".into())
    }

    /// Begins a recording in this file with the next row, and ends any other that people asked for; says in words what was
    /// done.
    pub fn record_in(&mut self, path: &Path) -> String {
        let beginning = Beginning {
            run_tick: self.newest.map_or(0, |row| row.run_tick + 1),
            ordered: self.spectator.as_ref().map(Spectator::ordered).unwrap_or_default(),
        };
        let (Some(on_request), Some(files)) = (&mut self.on_request, &self.files) else {
            return "nothing can be recorded here".into();
        };
        self.closed.extend(on_request.end());
        match on_request.begin(files, path, &beginning) {
            Ok(recorder) => {
                subscribe(std::slice::from_mut(recorder), &mut self.events);
                format!("recording {}", path.display())
            }
            Err(error) => error.to_string(),
        }
    }

    /// A full disk ends what people asked for; the recorder has said so.
    fn end_what_failed(&mut self) {
        if self.on_request.as_ref().is_some_and(OnRequest::has_failed) {
            let said = self.record(false);
            self.tell(format!("{said} not to its end: the disk takes no more"));
        }
    }

    fn tell(&mut self, words: String) {
        if let Some(spectator) = &mut self.spectator {
            spectator.tell(words);
        }
    }

    /// Whether nobody looks on any more: people closed the window, or stopped to read the standard output, and nothing else
    /// is recorded.
    pub fn wants_end(&self) -> bool {
        let is_unread = !self.recorders.is_empty() && self.recorders.iter().all(Recorder::reader_has_gone);
        self.has_lost_its_hand || is_unread || self.spectator.as_ref().is_some_and(Spectator::wants_end)
    }

    fn take_rows(&mut self, until: Option<Instant>) {
        for _ in 0..self.rows.waiting() {
            if until.is_some_and(|until| Instant::now() >= until) {
                break;
            }
            self.tell_lost();
            let Some((row, _)) = self.rows.receive() else { break };
            let (bodies, changed, placed) = (self.rows.bodies(), self.rows.changed(), self.rows.placed());
            // A tick's events are there before its row is.
            self.events.deliver(row.run_tick);
            let requested = self.on_request.as_mut().and_then(OnRequest::recorder);
            for recorder in self.recorders.iter_mut().chain(requested) {
                recorder.send(&row, (bodies, changed), placed);
            }
            if let Some(snapshots) = &mut self.snapshots {
                snapshots.look(&row, bodies, placed);
            }
            if let Some(spectator) = &mut self.spectator {
                spectator.look(&row);
            }
            self.newest = Some(row);
        }
        if let (Some(spectator), Some(row)) = (&mut self.spectator, &self.newest) {
            spectator.see(row, self.rows.bodies(), self.rows.placed());
        }
    }

    /// Tells the recordings of rows that the fast side had no room for, before the next row or at the end.
    fn tell_lost(&mut self) {
        let lost = self.rows.take_lost();
        let requested = self.on_request.as_mut().and_then(OnRequest::recorder);
        for recorder in self.recorders.iter_mut().chain(requested.filter(|recorder| recorder.has_begun())) {
            recorder.miss(lost);
        }
    }

    /// Whether another scene has taken over, as its first row tells.
    fn go_on_to_next_scene(&mut self) -> bool {
        self.coming = self.coming.take().or_else(|| self.desk.as_mut()?.take_coming());
        let Some(coming) = self.coming.take_if(|coming| coming.rows.waiting() > 0) else { return false };
        // What came in before that row did.
        self.take_rows(None);
        self.tell_lost();
        self.scenes += 1;
        let (stay, end): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.recorders).into_iter().partition(Recorder::is_of_events);
        self.recorders = stay;
        let mut begun = self.begin_recordings(&coming);
        subscribe(&mut begun, &mut self.events);
        let requested = self.on_request.as_mut().and_then(|all| all.go_on_with(&coming, self.scenes));
        let goes_on = requested.is_some();
        if let Some(first) = coming.rows.next_tick() {
            self.events.deliver(first);
        }
        self.closed.extend(end.into_iter().chain(requested).map(|mut recorder| {
            recorder.close();
            recorder
        }));
        self.recorders.extend(begun);
        if let Some(shown) = coming.shown {
            self.snapshots.iter_mut().for_each(|snapshots| snapshots.go_on(shown.clone()));
            self.spectator.iter_mut().for_each(|spectator| spectator.go_on(shown.clone()));
        }
        self.rows = coming.rows;
        if goes_on {
            let said = self.record(true);
            self.tell(said);
        }
        self.newest = None;
        true
    }

    fn begin_recordings(&mut self, coming: &Coming) -> Vec<Recorder> {
        let Some(files) = self.files.as_mut().filter(|files| !files.record.is_empty()) else {
            return Vec::new();
        };
        let mut begun = Vec::new();
        for recorder in files.of_scene(&coming.rig, &coming.view, self.scenes) {
            match recorder {
                Ok(recorder) => {
                    let (scene, path) = (coming.rig.scene_file.display(), recorder.path().display());
                    say(format_args!("phantom3: {scene} goes on; it is recorded in {path}"));
                    begun.push(recorder);
                }
                Err(error) => {
                    say(format_args!("phantom3: {error}"));
                    self.failed.push(Recorded::not_begun(&error));
                }
            }
        }
        begun
    }

    /// Of a run that did not begin: its files are as they were.
    pub fn take_back(self) {
        self.recorders.into_iter().for_each(Recorder::take_back);
    }

    /// Takes the rest, and closes the recordings.
    pub fn finish(mut self) -> SlowEnd {
        self.step();
        self.tell_lost();
        self.events.deliver(u64::MAX);
        let told = summary(&self.events);
        self.closed.append(&mut self.recorders);
        self.closed.extend(self.on_request.as_mut().and_then(OnRequest::end));
        // All before any is waited for, whose reader may be slow.
        self.closed.iter_mut().for_each(Recorder::close);
        self.failed.extend(self.closed.into_iter().map(Recorder::finish));
        let pictures = self.snapshots.map(Snapshots::finish);
        SlowEnd { recordings: self.failed, events: told, pictures }
    }
}

/// What the slow side leaves.
pub struct SlowEnd {
    /// What became of the recordings.
    pub recordings: Vec<Recorded>,
    /// What has happened, in words.
    pub events: String,
    /// What became of the pictures, if any were wanted.
    pub pictures: Option<Drawn>,
}

/// The recordings want all events.
pub fn subscribe(recorders: &mut [Recorder], events: &mut Hub) {
    for feed in recorders.iter_mut().filter_map(Recorder::take_events) {
        events.subscribe(Filter::ALL, Box::new(feed));
    }
}

/// How much of each class has happened or begun, and how many events are missing.
fn summary(events: &Hub) -> String {
    let mut line = String::new();
    for (class, word) in Class::ALL.into_iter().filter(|(class, _)| *class != Class::Lost) {
        let count = events.count(class);
        if count > 0 {
            let comma = if line.is_empty() { "" } else { ", " };
            let word = if count == 1 { word.trim_end_matches('s') } else { word };
            // A string takes everything.
            let _ = write!(line, "{comma}{count} {word}");
        }
    }
    if line.is_empty() {
        line.push_str("none");
    }
    if events.lost() > 0 {
        let _ = write!(line, ", {} LOST: nobody took them in time", events.lost());
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Names;
    use crate::fast_loop::WhenFull;
    use crate::record::{About, Backpressure, McapFile, Opened, RecordFile, View};
    use crate::recording::Recording;
    use crate::row_queue::{RowSender, row_queue_of};
    use rt_core::signals::StopSignals;
    use world::events::event_queue;

    fn send(sender: &mut RowSender, ticks: std::ops::Range<u64>) {
        for run_tick in ticks {
            if !sender.send(Row { run_tick, ..Row::empty() }, &[]) {
                sender.lose();
            }
        }
    }

    #[test]
    fn rows_that_found_no_room_on_their_way_are_missing_in_the_recordings() {
        let directory = tempfile::tempdir().expect("a directory");
        let start = |name: &str, begin: fn(Opened) -> RecordFile| {
            let path = directory.path().join(name);
            let file = begin(Opened::recording(&path).expect("opened"));
            let how = Backpressure::new(WhenFull::Drop, &StopSignals::default());
            Recorder::start(&path, file, 0, 1_000_000, how).expect("a thread")
        };
        let table = |file| {
            let table = Recording::begin(file, Names::default(), 1_000_000);
            RecordFile::Csv(Box::new(table.expect("a table")))
        };
        let mcap = |file| {
            let scene = world::Scene::parse("[[finger]]\n", Path::new("scene.toml")).expect("a scene");
            let view = View::new(&scene, &[], false);
            let file = McapFile::create(file, Names::default(), 1_000_000, &About::default(), view);
            RecordFile::Mcap(Box::new(file.expect("a file")))
        };
        let (mut sender, rows) = row_queue_of(4, 0, 0);
        let hub = Hub::new(vec![event_queue(4).1]);
        let mut slow = SlowSide::new(rows, hub, vec![start("a.csv", table), start("b.mcap", mcap)]);
        send(&mut sender, 0..4);
        slow.step();
        // Seven find no room, and three of them no row behind them.
        send(&mut sender, 4..12);
        slow.step();
        send(&mut sender, 12..19);
        for recorded in slow.finish().recordings {
            assert_eq!((recorded.rows, recorded.lost), (12, 7));
        }
        let bytes = std::fs::read(directory.path().join("b.mcap")).expect("there");
        let all = mcap::MessageStream::new(&bytes).expect("sound").map(|message| message.expect("sound"));
        let lost = all.filter(|message| message.channel.topic == "/events");
        // Before tick 12, and behind the last one.
        assert_eq!(lost.map(|message| message.log_time / 1_000_000).collect::<Vec<_>>(), [12, 15]);
    }

    #[test]
    fn a_while_ends_before_all_rows_are_taken_and_the_end_takes_them() {
        let (mut sender, rows) = row_queue_of(4, 0, 0);
        let mut slow = SlowSide::new(rows, Hub::new(vec![event_queue(4).1]), Vec::new());
        send(&mut sender, 0..4);
        slow.step_until(Some(Instant::now()));
        assert_eq!((slow.rows.waiting(), slow.newest), (4, None));
        slow.step_a_while();
        assert_eq!(slow.rows.waiting(), 0);
    }
}
