//! Fuzz targets of the application: recordings, orders, and whole scenes that are made ready to run.

use crate::check_message;
use phantom3::control::words;
use phantom3::record::read::RecordedRun;
use phantom3::rig::{HandMode, Rig};
use std::cell::RefCell;
use std::path::Path;
use tempfile::TempDir;
use world::{Scene, ShapeSpec};

/// Lines of orders, with and without their times.
pub fn orders(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for line in text.lines() {
        let order = match words::split_time(line) {
            Ok(order) => order.map_or(line, |(at_s, order)| {
                assert!(at_s.is_finite() && at_s >= 0.0, "{line}: at {at_s} s");
                order
            }),
            Err(error) => {
                check_message(&error);
                line
            }
        };
        if let Err(error) = words::parse(order) {
            check_message(&error);
        }
    }
}

/// A recording as a table.
pub fn replay_csv(bytes: &[u8]) {
    read_through(bytes, "fuzz.csv");
}

/// A recording as MCAP.
pub fn replay_mcap(bytes: &[u8]) {
    read_through(bytes, "fuzz.mcap");
}

/// A scene with everything but files, ready to run, and a few ticks of it.
pub fn rig(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let file = Path::new("/nowhere/at/all/scene.toml");
    let Ok(scene) = Scene::parse(text, file) else { return };
    if scene.entities.len() > MOST_ENTITIES || scene.entities.iter().any(|entity| in_a_file(&entity.shape)) {
        return;
    }
    match Rig::new(file, Scene { hand: None, ..scene }, None, None, HandMode::Kinematic, 1_000_000) {
        Ok(rig) => drop(rig.fast_step()),
        Err(error) => check_message(&error.to_string()),
    }
}

fn in_a_file(shape: &ShapeSpec) -> bool {
    matches!(shape, ShapeSpec::Mesh(_) | ShapeSpec::Nurbs(_))
}

/// Rows until the end or the first that is wrong.
fn read_through(bytes: &[u8], name: &str) {
    let file = DIRECTORY.with_borrow(|directory| directory.path().join(name));
    std::fs::write(&file, bytes).expect("our own directory");
    let mut recorded = match RecordedRun::open(&file) {
        Ok(recorded) => recorded,
        Err(error) => return check_message(&error.to_string()),
    };
    let mut last = None;
    loop {
        match recorded.next_row() {
            Ok(Some((row, _))) => {
                assert!(last < Some(row.run_tick), "ticks rise");
                last = Some(row.run_tick);
            }
            Ok(None) => return,
            Err(error) => return check_message(&error.to_string()),
        }
    }
}

thread_local! {
    /// In memory, where there is such a place: a run of the fuzzer writes a million files.
    static DIRECTORY: RefCell<TempDir> = RefCell::new(
        tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a directory"),
    );
}

/// More are a matter of time only.
const MOST_ENTITIES: usize = 200;
