//! `play`, and the program without a command: what they say where nobody could see the hand. Where somebody can, it is tried
//! on a screen that nobody sees.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};
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
