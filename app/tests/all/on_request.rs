//! Recordings that begin and end while a run goes on.

use patience::prelude::*;
use phantom3::book::Book;
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::on_request::OnRequest;
use phantom3::record::read::RecordedRun;
use phantom3::record::{About, Backpressure, Files, View};
use phantom3::recording::Recording;
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue;
use phantom3::slow::SlowSide;
use phantom3::virtual_clock::VirtualDriver;
use rt_core::signals::StopSignals;
use shm_abi::segment::ClockMode;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use world::Scene;
use world::events::{Hub, event_queue};

/// Ticks between two turns of the slow side.
const TURN: u64 = 10;

/// Two fingers that lift an object.
fn rig() -> Rig {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/scenes/lift.toml");
    Rig::new(&file, Scene::load(&file).expect("a scene"), None, None, HandMode::Kinematic, 1_000_000)
        .expect("a rig")
}

/// A run that is recorded as a whole in `whole.csv`, and on request here.
struct Run {
    place: TempDir,
    driver: VirtualDriver,
    fast: FastLoop,
    slow: SlowSide,
    tick: u64,
}

impl Run {
    fn new(directory: Option<&str>) -> Self {
        let place = tempfile::tempdir().expect("room");
        let rig = rig();
        let driver = VirtualDriver::open(&rig.driver_config(ClockMode::Virtual)).expect("devices");
        let step = rig.fast_step().expect("a step");
        let view = View::new(&rig.scene, step.entities(), true);
        let files = Files {
            record: vec![place.path().join("whole.csv")],
            events: Vec::new(),
            extras: driver.extras(),
            period_ns: rig.period_ns,
            backpressure: Backpressure::new(WhenFull::Wait, &StopSignals::default()),
            taken: Vec::new(),
            book: Book::default(),
            about: About::of_run(&rig, ClockMode::Virtual, rig.period_ns, 0),
        };
        let recorders = files.first(&rig, &view).expect("a recording");
        let (rows, taken) = row_queue(step.bodies().len());
        let (events, event_ends) = event_queue(1024);
        let fast = FastLoop::new(step, rows, WhenFull::Wait, u64::MAX, rig.period_ns).with_events(events);
        let directory = directory.map_or(place.path().into(), |name| place.path().join(name));
        let on_request = OnRequest::new(Some(directory), rig, view);
        let slow = SlowSide::new(taken, Hub::new(vec![event_ends]), recorders)
            .with_desk(None, files)
            .with_requests(Some(on_request));
        Self { place, driver, fast, slow, tick: 0 }
    }

    /// Goes on until the slow side has the rows of so many ticks; the next tick is answered, too.
    fn go_on_to(&mut self, run_tick: u64) {
        let most_ticks = self.tick + 10 * run_tick + 10_000;
        while self.fast.run_ticks() < run_tick {
            assert!(
                self.tick < most_ticks,
                "tick {} and no more than {} of the run",
                self.tick,
                self.fast.run_ticks()
            );
            self.tick += 1;
            let turn = self.driver.tick(self.tick, &mut self.fast);
            assert!(!matches!(turn, Turn::Fault(_)), "{turn:?}");
            if self.tick.is_multiple_of(TURN) {
                self.slow.step();
            }
        }
        self.slow.step();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place.path().join(name)
    }
}

/// The lines of a table behind its header.
fn lines(file: &Path) -> Vec<String> {
    std::fs::read_to_string(file).expect("a table").lines().skip(1).map(String::from).collect()
}

/// The same of a recording as MCAP, written as a table.
fn as_table(file: &Path) -> PathBuf {
    let mut recorded = RecordedRun::open(file).expect("a recording");
    let table = file.with_extension("csv");
    let mut written =
        Recording::create(&table, recorded.names().clone(), recorded.period_ns()).expect("room");
    while let Some((row, bodies)) = recorded.next_row().expect("whole") {
        written.append(&row, &bodies).expect("room");
    }
    written.finish().expect("room");
    table
}

fn said_path(said: &str) -> PathBuf {
    said.strip_prefix("recording ").expect(said).into()
}

#[test]
fn what_is_recorded_in_the_middle_is_to_the_byte_what_the_whole_recording_has_of_it() {
    let mut run = Run::new(None);
    run.go_on_to(500);
    let table = run.path("middle.csv");
    assert_eq!(run.slow.record_in(&table), format!("recording {}", table.display()));
    run.go_on_to(900);
    assert_eq!(run.slow.record(false), format!("recorded {}", table.display()));
    run.go_on_to(1000);
    let first = said_path(&run.slow.record(true));
    run.go_on_to(1300);
    assert_eq!(run.slow.record(true), format!("recording {}", first.display()), "it goes on");
    run.slow.record(false);
    run.go_on_to(1400);
    let second = said_path(&run.slow.record(true));
    assert_ne!(first, second);
    run.go_on_to(2000);
    let whole = run.path("whole.csv");
    let Run { slow, place, .. } = run;
    let ends = slow.finish().recordings;
    assert!(ends.iter().all(|recorded| recorded.failure.is_none() && recorded.lost == 0), "{ends:?}");
    assert_eq!(ends.len(), 4);
    let whole = lines(&whole);
    let expected = [(table, 500..900), (as_table(&first), 1000..1300), (as_table(&second), 1400..2000)];
    for (file, ticks) in expected {
        let found = lines(&file);
        assert_eq!(found.len(), ticks.len(), "{}", file.display());
        assert!(found == whole[ticks], "{}", file.display());
    }
    drop(place);
}

#[test]
fn a_recording_from_the_middle_says_where_it_begins_and_is_not_replayed() {
    let mut run = Run::new(None);
    run.go_on_to(300);
    let file = said_path(&run.slow.record(true));
    run.go_on_to(400);
    let Run { slow, place, .. } = run;
    slow.finish();
    let recorded = RecordedRun::open(&file).expect("a recording");
    let about = recorded.about().expect("facts");
    assert_eq!(about.begins_tick(), Some(300));
    assert!(about.file("scene").is_some() && !about.follows());
    let said = std::process::Command::new(env!("CARGO_BIN_EXE_phantom3"))
        .args([Path::new("replay"), &file])
        .bounded_output()
        .expect("a program");
    let words = String::from_utf8_lossy(&said.stderr);
    assert_eq!(said.status.code(), Some(2), "{words}");
    assert!(words.contains("begins at t = 0.3 s of its run"), "{words}");
    drop(place);
}

#[test]
fn a_directory_that_is_not_there_is_told_and_the_run_goes_on() {
    let mut run = Run::new(Some("nowhere"));
    run.go_on_to(100);
    let said = run.slow.record(true);
    assert!(said.starts_with("cannot create the recording") && said.contains("nowhere"), "{said}");
    assert_eq!(run.slow.record(false), "nothing was being recorded");
    run.go_on_to(200);
    let whole = run.path("whole.csv");
    let Run { slow, place, .. } = run;
    assert_eq!(slow.finish().recordings.len(), 1);
    assert_eq!(lines(&whole).len(), 200);
    drop(place);
}
