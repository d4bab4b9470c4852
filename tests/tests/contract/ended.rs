//! Runs and replays that a signal or a fault ends: status, report, and what is recorded until then.

use patience::prelude::*;
use patience::watched;
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Stdio};
use std::time::Duration;
use system_tests::recording::Table;
use system_tests::workplace::{Running, Workplace};

const DEVICE: &str = include_str!("../../../config/driver/devices/premium-1.5.toml");

/// Lines: the header and rows.
const READ_AT_FIRST: usize = 100;

/// With as many fingers as there may be, so that a pipe fills up fast.
fn workplace() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n".repeat(8));
    place
}

fn terminate(child: &Child) {
    kill_process(Pid::from_child(child), Signal::TERM).expect("our own child");
}

#[test]
fn a_signal_costs_a_reader_who_is_slow_no_row() {
    let place = workplace();
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "virtual", "--seconds", "40000", "--record", "-"]);
    program.stdout(Stdio::piped()).stderr(std::fs::File::create(place.path("said")).expect("a file"));
    let mut child = program.spawn().expect("it starts");
    let table = BufReader::new(child.stdout.take().expect("a pipe"));
    let (rest, rows) = watched(patience::limit(), "the end of a table that is read slowly", || {
        let (mut table, mut rest) = (table, Vec::new());
        let read: Result<Vec<String>, _> = table.by_ref().lines().take(READ_AT_FIRST).collect();
        let rows = read.expect("our own pipe").len() as u64 - 1;
        // Everything that holds rows is full by then: the pipe, the recorder's queue, the run's.
        std::thread::sleep(Duration::from_millis(500));
        terminate(&child);
        let mut piece = vec![0; 1 << 20];
        loop {
            std::thread::sleep(Duration::from_millis(20));
            match table.read(&mut piece).expect("our own pipe") {
                0 => break (rest, rows),
                count => rest.extend(&piece[..count]),
            }
        }
    });
    let status = child.bounded_wait().code();
    let said = std::fs::read_to_string(place.path("said")).expect("words");
    assert_eq!(status, Some(128 + 15), "{said}");
    assert!(!said.contains("LOST") && !said.contains("NOT COMPLETE"), "{said}");
    let times = rest.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).map(|line| {
        let cell = line.split(|byte| *byte == b',').next().unwrap_or_default();
        (String::from_utf8_lossy(cell).parse::<f64>().expect("a time") * 1e3).round() as u64
    });
    let all = rows + times.clone().count() as u64;
    assert!(times.eq(rows..all), "no row is missing");
    assert!(said.contains(&format!("the standard output ({all} rows)")), "{said}");
}

#[test]
fn a_replay_that_a_signal_ends_has_the_status_of_the_signal_and_tells_how_far_it_came() {
    let place = workplace();
    let said =
        place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "100", "--record", "long.mcap"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let mut program = place.phantom3();
    program.args(["replay", "long.mcap", "--record", "again.csv", "--expect-same"]);
    let running = Running::start(program);
    let begun = || std::fs::metadata(place.path("again.csv")).is_ok_and(|file| file.len() > 0);
    patience::until("a replay under way", begun);
    terminate(&running.child);
    let said = running.wait();
    assert_eq!(said.status, Some(128 + 15), "{}{}", said.out, said.err);
    assert!(said.err.contains("ended by signal 15 before its time"), "{}", said.err);
    let rows = Table::read(&place.path("again.csv")).len();
    assert!(rows < 100_000, "it was ended before its time: {rows}");
    assert!(said.out.contains(&format!("again.csv ({rows} rows)")), "{rows}: {}", said.out);
}

#[test]
fn a_run_on_the_virtual_clock_that_a_fault_ends_tells_what_it_recorded() {
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n");
    // A hand that goes faster than the device may.
    place.write("hand.csv", "t,f0_x,f0_y,f0_z\n0,0,0.1,0\n0.1,0,0.1,0\n0.2,0.05,0.1,0\n1,0.05,0.1,0\n");
    let slow = DEVICE.replace("\nspeed_limit_m_per_s = 2.0", "\nspeed_limit_m_per_s = 0.05");
    assert_ne!(slow, DEVICE);
    place.write("slow.toml", slow);
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--hand",
        "hand.csv",
        "--hand-mode",
        "impedance",
        "--device",
        "slow.toml",
        "--record",
        "out.csv",
    ]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("moved faster than it may"), "{}", said.err);
    let rows = Table::read(&place.path("out.csv")).len();
    assert!(said.out.contains(&format!("recording    out.csv ({rows} rows)")), "{rows}: {}", said.out);
    assert!(said.out.contains(" 1 fault") && said.out.contains("peak force   "), "{}", said.out);
}
