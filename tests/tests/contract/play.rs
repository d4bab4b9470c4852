//! `play`, and the program without a command: what they say where nobody could see the hand. Where somebody can, it is tried
//! on a screen that nobody sees.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use system_tests::recording::Table;
use system_tests::screen::Screen;
use system_tests::workplace::{Running, Workplace};

#[test]
fn play_without_a_display_starts_nothing_and_says_what_is_missing() {
    let place = Workplace::new();
    let said = place.run(["play"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("neither WAYLAND_DISPLAY nor DISPLAY is set"), "{}", said.err);
    assert!(said.err.contains("phantom3 run --help"), "{}", said.err);
    let headless = place.run(["play", "--headless"]);
    assert_eq!(headless.status, Some(2), "{}", headless.err);
    assert!(headless.err.contains("play and --headless exclude each other"), "{}", headless.err);
    let mut program = place.phantom3();
    program.args(["play", "no-scene.toml"]).env("DISPLAY", ":4094");
    let missing = Running::start(program).wait();
    assert_eq!(missing.status, Some(2), "{}", missing.err);
    assert!(missing.err.contains("no-scene.toml"), "{}", missing.err);
}

#[test]
fn play_on_a_display_that_does_not_answer_leaves_no_process_and_no_file() {
    let place = Workplace::new();
    let before = files_in_memory();
    let mut program = place.phantom3();
    program.args(["play", "--record", "play.csv"]).env("DISPLAY", ":4094");
    let said = Running::start(program).wait();
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("no window: "), "{}", said.err);
    assert_eq!(place.processes(), Vec::<u32>::new());
    // What other tests have there meanwhile goes as soon as their drivers have it.
    let begun = Instant::now();
    while !files_in_memory().is_subset(&before) {
        assert!(begun.elapsed() < Duration::from_secs(20), "the hand's file: {:?}", files_in_memory());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Those of hands that have no hardware.
fn files_in_memory() -> BTreeSet<PathBuf> {
    let Ok(entries) = std::fs::read_dir("/dev/shm") else { return BTreeSet::new() };
    entries.flatten().map(|entry| entry.path()).filter(|path| path.join("hand").exists()).collect()
}

#[test]
fn play_goes_on_until_its_time_is_over_and_records_as_runs_do() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let mut program = place.phantom3();
    program.args(["play", "--seconds", "2", "--record", "play.csv"]);
    program.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1");
    let begun = Instant::now();
    let said = Running::start(program).wait();
    if said.err.contains("no window: ") {
        println!("skipped: {}", said.err);
        return;
    }
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(begun.elapsed() > Duration::from_secs(2));
    assert!(said.out.contains("devices: simulated, simulated, simulated"), "{}", said.out);
    let recorded = std::fs::read_to_string(place.path("play.csv")).expect("a recording");
    for column in ["thumb_hip_x", "middle_force_z", "cube_y"] {
        assert!(recorded.lines().next().is_some_and(|head| head.contains(column)), "{column}");
    }
}

#[test]
fn fingers_that_a_scene_puts_into_a_thing_begin_beside_it_which_is_told_and_feel_nothing() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "[[finger]]\nname = \"thumb\"\nstart_m = [0.0, 0.02, 0.0]\n[[finger]]\nname = \"index\"\nstart_m = [0.1, 0.1, 0.0]\n\
         [[entity]]\nname = \"crate\"\nshape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] }\n",
    );
    let mut program = place.phantom3();
    program.args(["play", "scene.toml", "--seconds", "1", "--record", "play.csv"]);
    program.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1");
    let said = Running::start(program).wait();
    if said.err.contains("no window: ") {
        println!("skipped: {}", said.err);
        return;
    }
    assert_eq!(said.status, Some(0), "{}", said.err);
    let lines: Vec<&str> = said.err.lines().filter(|line| line.contains("fingers begin elsewhere")).collect();
    assert!(
        matches!(lines[..], [line] if line.contains("thumb at ") && line.contains("inside of crate")),
        "{lines:?}"
    );
    assert!(!lines[0].contains("index"), "{lines:?}");
    let table = Table::read(&place.path("play.csv"));
    for finger in ["thumb", "index"] {
        let samples = table.finger(finger);
        assert!(samples.iter().all(|sample| !sample.touches()), "{finger} touches something");
    }
    let (thumb, index) = (&table.finger("thumb")[0], &table.finger("index")[0]);
    // As far as a simulated arm that a light hand holds stays where it is put.
    assert!((0.05..0.065).contains(&thumb.hip.y), "above its lid: {}", thumb.hip);
    assert!((index.hip - nalgebra::Vector3::new(0.1, 0.1, 0.0)).norm() < 3e-3, "{}", index.hip);
}
