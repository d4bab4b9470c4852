//! The slow thread's turn: take what the fast thread left and hand it to the recorders and to those who want events.

use crate::control::desk::{Coming, Desk};
use crate::record::{Files, Recorded, Recorder};
use crate::row::Row;
use crate::row_queue::RowReceiver;
use crate::snapshots::{Drawn, Snapshots};
use crate::spectator::Spectator;
use io_driver::say::say;
use std::fmt::Write;
use world::events::{Class, Filter, Hub};

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

    /// Takes everything that is there. A recording that cannot be written tells so itself, and the run goes on.
    pub fn step(&mut self) {
        self.desk.iter_mut().for_each(Desk::step);
        self.take_rows();
        while self.go_on_to_next_scene() {
            self.take_rows();
        }
        if let Some(spectator) = &mut self.spectator {
            spectator.step(self.desk.as_mut());
        }
    }

    /// Whether people closed the window.
    pub fn wants_end(&self) -> bool {
        self.spectator.as_ref().is_some_and(Spectator::wants_end)
    }

    fn take_rows(&mut self) {
        for _ in 0..self.rows.waiting() {
            let Some((row, _)) = self.rows.receive() else { break };
            let (bodies, placed) = (self.rows.bodies(), self.rows.placed());
            // A tick's events are there before its row is.
            self.events.deliver(row.run_tick);
            for recorder in &mut self.recorders {
                recorder.send(&row, bodies);
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

    /// Whether another scene has taken over, as its first row tells.
    fn go_on_to_next_scene(&mut self) -> bool {
        self.coming = self.coming.take().or_else(|| self.desk.as_mut()?.take_coming());
        let Some(coming) = self.coming.take_if(|coming| coming.rows.waiting() > 0) else { return false };
        // What came in before that row did.
        self.take_rows();
        self.scenes += 1;
        let (stay, end): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.recorders).into_iter().partition(Recorder::is_of_events);
        self.recorders = stay;
        let mut begun = self.begin_recordings(&coming);
        subscribe(&mut begun, &mut self.events);
        if let Some(first) = coming.rows.next_tick() {
            self.events.deliver(first);
        }
        self.closed.extend(end.into_iter().map(|mut recorder| {
            recorder.close();
            recorder
        }));
        self.recorders.extend(begun);
        if let Some(shown) = coming.shown {
            self.snapshots.iter_mut().for_each(|snapshots| snapshots.go_on(shown.clone()));
            self.spectator.iter_mut().for_each(|spectator| spectator.go_on(shown.clone()));
        }
        self.rows = coming.rows;
        self.newest = None;
        true
    }

    fn begin_recordings(&mut self, coming: &Coming) -> Vec<Recorder> {
        let Some(files) = self.files.as_ref().filter(|files| !files.record.is_empty()) else {
            return Vec::new();
        };
        match files.of_scene(&coming.rig, &coming.view, self.scenes) {
            Ok(begun) => {
                for recorder in &begun {
                    let scene = coming.rig.scene_file.display();
                    say(format_args!(
                        "phantom3: {scene} goes on; it is recorded in {}",
                        recorder.path().display()
                    ));
                }
                begun
            }
            Err(error) => {
                say(format_args!("phantom3: {error}"));
                let path = files.record[0].clone();
                let failure = Some(error.to_string());
                self.failed.push(Recorded { path, rows: 0, unit: "rows", lost: 0, failure });
                Vec::new()
            }
        }
    }

    /// Takes the rest, and closes the recordings.
    pub fn finish(mut self) -> SlowEnd {
        self.step();
        self.events.deliver(u64::MAX);
        let told = summary(&self.events);
        self.closed.append(&mut self.recorders);
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

/// How many events of each class there were, and how many are missing.
fn summary(events: &Hub) -> String {
    let mut line = String::new();
    for (class, word) in Class::ALL.into_iter().filter(|(class, _)| *class != Class::Lost) {
        if events.count(class) > 0 {
            let comma = if line.is_empty() { "" } else { ", " };
            // A string takes everything.
            let _ = write!(line, "{comma}{} {word}", events.count(class));
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
