//! What somebody meets who has just built the program: the demonstration, the help, Ctrl-C.

use rustix::process::{Pid, Signal, kill_process};
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG, resting};
use system_tests::recording::Table;
use system_tests::workplace::{Running, Workplace};

#[test]
fn without_arguments_the_default_scene_is_felt_for_ten_seconds() {
    let place = Workplace::new();
    let said = Running::start(place.phantom3()).wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("no driver is running; starting one of our own"), "{}", said.err);
    let lines = [
        "clock",
        "driver",
        "ticks",
        "overruns",
        "wake error",
        "round trip",
        "peak force",
        "guarantees",
        "recording",
    ];
    assert!(said.out.contains("devices: simulated, simulated"), "{}", said.out);
    for line in lines {
        assert!(said.out.lines().any(|found| found.starts_with(line)), "no line `{line}` in:\n{}", said.out);
    }
    assert!(said.out.lines().all(|line| !line.trim().is_empty()), "no empty lines:\n{}", said.out);
    let table = Table::read(&place.path("phantom3-demo.csv"));
    assert!(said.out.contains(&format!("phantom3-demo.csv ({} rows", table.len())), "{}", said.out);
    // Ten seconds at 1 kHz, less what a loaded machine without rights loses.
    assert!((1_000..=10_000).contains(&table.len()), "{} rows\n{}", table.len(), said.out);
    for finger in ["f0", "f1"] {
        let friction = table.texts(&format!("{finger}_friction"));
        for state in ["free", "stick", "slip"] {
            assert!(friction.contains(&state), "{finger} is never in {state}");
        }
    }
    assert_nothing_is_left(&place, &["phantom3-demo.csv"]);
}

fn assert_nothing_is_left(place: &Workplace, files: &[&str]) {
    assert_eq!(place.processes(), Vec::<u32>::new());
    let expected: Vec<_> = files.iter().map(|file| place.path(file)).collect();
    assert_eq!(place.snapshot().into_keys().collect::<Vec<_>>(), expected);
}

#[test]
fn a_driver_that_runs_already_is_used_and_left_running() {
    let place = Workplace::new();
    let mut driver = Driver::start(&resting("real", 2));
    let mut program = place.phantom3();
    program.env("PHANTOM3_SOCKET", driver.socket());
    let said = Running::start(program).wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("using the driver at"), "{}", said.err);
    assert!(said.out.contains(&format!("process {}, was running", driver.child.id())), "{}", said.out);
    assert!(driver.child.try_wait().expect("our child").is_none(), "the driver has ended");
    let table = Table::read(&place.path("phantom3-demo.csv"));
    // Its devices rest at the origin, which lies on the table: they are the fingers, not the scene's hand.
    assert!(table.vectors("f1_hip").iter().all(|hip| hip.norm() == 0.0));
    assert_nothing_is_left(&place, &["phantom3-demo.csv"]);
    drop(driver.command());
}

#[test]
fn help_names_everything_that_can_be_asked() {
    let place = Workplace::new();
    let shown = |arguments: &[&str], words: &[&str]| {
        let said = place.run(arguments);
        assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{arguments:?}");
        for word in words {
            assert!(said.out.contains(word), "{arguments:?} does not mention {word}:\n{}", said.out);
        }
        assert!(said.out.lines().all(|line| line.chars().count() <= 120), "{}", said.out);
    };
    shown(
        &["--help"],
        &["run", "driver", "--version", "ten seconds", "Exit status: 0", "2 bad usage", "3 a fault"],
    );
    let options =
        ["<SCENE>", "--hand ", "--hand-mode", "kinematic", "impedance", "--clock", "virtual", "lockstep"];
    let more = [
        "--headless",
        "--record",
        "--seconds",
        "--rate-hz",
        "--seed",
        "--layout",
        "--attach",
        "--grace",
        "--orders",
    ];
    shown(&["run", "--help"], &[&options[..], &more[..]].concat());
    shown(&["run", "-h"], &["--record", "[default: 1000]"]);
    shown(&["driver", "--help"], &["run", "status", "stop", "clear-fault"]);
    shown(&["driver", "run", "--help"], &["--config", "--strict", "--quiet", "--socket"]);
    shown(&["driver", "status", "--help"], &["--json", "--watch"]);
    shown(&["--version"], &["phantom3 0."]);
    let said = place.run(["driver"]);
    assert_eq!(said.status, Some(2), "a driver must be told what to do");
    assert!(said.err.contains("clear-fault"), "{}", said.err);
}

/// Starts a run and waits until rows of it are on disk.
fn started(place: &Workplace, clock: &str) -> Running {
    place.write("scene.toml", "[[finger]]\n".repeat(8));
    let mut program = place.phantom3();
    // 86400 s of virtual time take minutes: nobody waits for them.
    program.args(["run", "scene.toml", "--clock", clock, "--seconds", "86400", "--record", "out.csv"]);
    let running = Running::start(program);
    let begun = Instant::now();
    // The header of eight fingers has some 2 kB.
    while std::fs::metadata(place.path("out.csv")).map_or(0, |file| file.len()) < 10_000 {
        assert!(begun.elapsed() < HANG, "nothing is recorded");
        std::thread::sleep(Duration::from_millis(5));
    }
    running
}

#[test]
fn a_signal_ends_a_run_in_order_on_every_clock() {
    for (clock, signal) in
        [("real", Signal::INT), ("virtual", Signal::INT), ("lockstep", Signal::TERM), ("real", Signal::HUP)]
    {
        let place = Workplace::new();
        let running = started(&place, clock);
        kill_process(Pid::from_child(&running.child), signal).expect("it runs");
        let said = running.wait();
        assert_eq!(said.status, Some(128 + signal.as_raw()), "{clock}: {}", said.err);
        assert!(said.err.contains(&format!("ended by signal {}", signal.as_raw())), "{clock}: {}", said.err);
        assert!(said.out.contains("recording    out.csv"), "the report is made all the same: {}", said.out);
        let table = Table::read(&place.path("out.csv"));
        assert!(
            said.out.contains(&format!("({} rows", table.len())),
            "{clock}: {} rows\n{}",
            table.len(),
            said.out
        );
        let first_s: f64 = table.texts("t")[0].parse().expect("a number");
        // In real time a busy machine may be late for the first ticks already.
        assert!(first_s == 0.0 || clock == "real" && first_s < 1.0, "{clock}: {first_s}");
        assert_nothing_is_left(&place, &["out.csv", "scene.toml"]);
    }
}
