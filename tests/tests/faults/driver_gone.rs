//! The driver is killed, asked to stop, or not alone: the application says so, waits if it was told to, and
//! its recording is complete up to there.

use bytemuck::Zeroable;
use rt_core::epitaph::{self, EpitaphKind};
use rustix::process::Signal;
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::{Answer, Request, Verdict};
use shm_abi::{ABI_MAJOR, ABI_MINOR, DriverView, Frame};
use std::io::{Read, Write};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use system_tests::faults::press::{self, FORCE_N, Press, Table, terminate};
use system_tests::faults::process::{self, Running, children_of, io_driver};
use system_tests::faults::ring::RingLog;
use system_tests::programs;
use system_tests::recording;

/// Ticks of a run that are waited for before something happens to it.
const SOME: i64 = 200;

/// Waits until a run has lasted some ticks.
fn wait_for_some_run(driver: &DriverView) {
    let started = |frame: &Frame| frame.run_tick >= SOME;
    RingLog::begin(driver).follow(driver, "t = 0", |_| driver.read_latest().as_ref().is_some_and(started));
}

/// The times of all rows, which must be whole and in order, each with the whole force computed.
fn checked_times(path: &std::path::Path) -> Vec<f64> {
    let table = recording::Table::read(path);
    let t = table.numbers("t");
    for (row, pair) in t.windows(2).enumerate() {
        assert!(pair[0] < pair[1], "row {row}: {pair:?}");
    }
    // The spring's law is rounded twice.
    assert!(table.vectors("f0_force").iter().all(|force| (force.norm() - FORCE_N).abs() < 1e-12));
    t
}

#[test]
fn an_app_whose_own_driver_is_killed_says_so_and_its_recording_is_complete() {
    for clock in ["real", "lockstep"] {
        let table = Table::new();
        let mut app = Running::start(table.app(clock).args(["--seconds", "80000", "--record", "out.csv"]));
        let observer = table.observe_child();
        wait_for_some_run(&observer.driver);
        let children = children_of(app.id());
        assert_eq!(children.len(), 1);
        process::send(children[0], Signal::KILL);
        let end = app.end();
        assert_eq!(end.status, Some(3), "{end:?}");
        let message = "the driver is gone: it hung up without last words: it was killed, crashed, or stands still (signal: 9";
        assert!(end.err.contains(message), "{end:?}");
        assert_eq!(table.left_behind(), Vec::<PathBuf>::new());
        table.wait_until_abandoned();
        let t = checked_times(&table.path("out.csv"));
        let told = published_run_ticks(&observer.driver);
        let rows = t.len() as u64;
        // A row is complete once the frame after it has told what the motors did: the last frame is none.
        match clock {
            // No frame is missed, but the last may have come when the end had been noticed already.
            "lockstep" => assert!(rows == told || rows + 1 == told, "{rows} rows, {told} ticks"),
            _ => assert!(rows > 0 && rows <= told, "{rows} rows, {told} ticks"),
        }
    }
}

/// How many ticks of the run had passed when the last frame was published.
fn published_run_ticks(driver: &DriverView) -> u64 {
    let mut frame = Frame::zeroed();
    driver.read_frame(driver.latest_tick().expect("frames"), &mut frame).expect("nobody writes any more");
    frame.run_tick.unsigned_abs()
}

#[test]
fn a_run_goes_on_when_its_driver_is_killed_and_restarted() {
    // A restart takes some 20 ms: the real run is long enough to be there, the other one passes faster.
    for (clock, seconds) in [("real", "3"), ("lockstep", "60")] {
        let mut press = Press::start(clock);
        let mut app =
            Running::start(press.app().args(["--seconds", seconds, "--record", "out.csv", "--grace", "10"]));
        wait_for_some_run(&press.observer.driver);
        let first_pid = press.driver.child.id();
        press.driver.child.kill().expect("our own child");
        press.driver.wait();
        let before = published_run_ticks(&press.observer.driver);
        app.hear("waiting up to 10s for its return");
        press.driver.restart(&press::config(clock));
        let second = press.driver.observe();
        let end = app.end();
        assert_eq!(end.status, Some(0), "{end:?}");
        assert!(end.err.contains("the driver is gone") && end.err.contains("the driver is back"), "{end:?}");
        assert!(end.err.contains(&format!("process {}", press.driver.child.id())), "{end:?}");
        let t = checked_times(&press.path("out.csv"));
        let after = t.iter().filter(|t| **t * 2000.0 > before as f64).count();
        assert!(after > 0, "{clock}: nothing after {before} ticks, {:?}", t.last());
        // The last tick of the run, less what may be missed in real time.
        let length: f64 = seconds.parse().expect("a number");
        assert!(t.last().is_some_and(|last| *last < length && *last > 0.9 * length), "{:?}", t.last());
        let commanded = second.driver.counters.ticks_commanded.load(Ordering::Relaxed);
        assert!(commanded >= after as u64, "{commanded} ticks, {after} rows");
        // The report is of both drivers. The second may count on until it notices that nobody answers any more.
        let first = press.observer.driver.counters.ticks_commanded.load(Ordering::Relaxed);
        let told = reported_ticks(&end.out);
        assert!(
            (first + after as u64..=first + commanded).contains(&told),
            "{first} + {commanded}:\n{}",
            end.out
        );
        for pid in [first_pid, press.driver.child.id()] {
            assert!(end.out.contains(&format!("process {pid}, was running")), "{pid}:\n{}", end.out);
        }
        assert!(end.out.contains("figures are of these 2 drivers together"), "{}", end.out);
    }
}

/// Ticks under the lease, as the report tells them.
fn reported_ticks(report: &str) -> u64 {
    let line = report.lines().find_map(|line| line.strip_prefix("ticks ")).expect("a line of ticks");
    let (ticks, _) = line.trim_start().split_once(" under our lease").expect("its words");
    ticks.parse().expect("a number")
}

#[test]
fn a_driver_that_does_not_come_back_in_time_ends_the_run() {
    let mut press = Press::start("real");
    let mut app =
        Running::start(press.app().args(["--seconds", "80000", "--record", "out.csv", "--grace", "0.2"]));
    wait_for_some_run(&press.observer.driver);
    press.driver.child.kill().expect("our own child");
    press.driver.wait();
    let end = app.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    let gone = "the driver is gone: it hung up without last words: it was killed, crashed, or stands still";
    assert!(end.err.contains(&format!("{gone}; waiting up to 200ms for its return")), "{end:?}");
    assert!(end.err.contains(&format!("{gone}; after 200ms: the driver is gone:")), "{end:?}");
    assert!(!checked_times(&press.path("out.csv")).is_empty());
}

/// A run whose driver was killed, and which waits for its return.
fn waiting_for_its_driver() -> (Press, Running) {
    let mut press = Press::start("real");
    let mut app =
        Running::start(press.app().args(["--seconds", "80000", "--record", "out.csv", "--grace", "3600"]));
    wait_for_some_run(&press.observer.driver);
    press.driver.child.kill().expect("our own child");
    press.driver.wait();
    app.hear("waiting up to 3600s for its return");
    (press, app)
}

/// Nobody may go on with a driver whose ticks or devices are others: the run's time and its fingers are made of them.
#[test]
fn a_driver_that_comes_back_as_another_one_ends_the_run_and_both_are_told() {
    let before = press::config("real");
    let cases = [
        (before.replace("rate_hz = 2000", "rate_hz = 1000"), ["1000000 ns", "500000 ns"]),
        (press::config("lockstep"), ["its clock is lockstep", "began with real"]),
        (before.clone() + "name = \"thumb\"\n", ["its device 0 is thumb (ideal)", "began with f0 (ideal)"]),
    ];
    for (after, expected) in cases {
        let (mut press, app) = waiting_for_its_driver();
        press.driver.restart(&after);
        check_that_it_is_refused(app, &press, &expected);
        press.driver_must_live();
    }
}

fn check_that_it_is_refused(mut app: Running, press: &Press, expected: &[&str]) {
    let end = app.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("not the one that this run began with: "), "{end:?}");
    assert!(expected.iter().all(|words| end.err.contains(words)), "{expected:?}: {end:?}");
    assert!(!end.err.contains("the run goes on"), "{end:?}");
    assert!(!checked_times(&press.path("out.csv")).is_empty());
}

#[test]
fn a_driver_of_another_contract_that_comes_in_the_place_of_the_first_ends_the_run() {
    let (press, app) = waiting_for_its_driver();
    std::fs::remove_file(press.driver.socket()).expect("nobody took it away");
    let listener = UnixListener::bind(press.driver.socket()).expect("a socket");
    let answer = Answer {
        abi_version: u64::from(ABI_MAJOR + 1) << 32,
        verdict: Verdict::WrongVersion as u64,
        ..Answer::new(Verdict::Granted)
    };
    let mut stream = patience::accepted(&listener);
    stream.read_exact(bytemuck::bytes_of_mut(&mut Request::zeroed())).expect("a request");
    stream.write_all(bytemuck::bytes_of(&answer)).expect("it is told");
    let (theirs, ours) = (format!("version {}.0", ABI_MAJOR + 1), format!("{ABI_MAJOR}.{ABI_MINOR}"));
    check_that_it_is_refused(app, &press, &[&theirs, &ours]);
}

/// While it waits for the driver's return, it still listens.
#[test]
fn an_app_that_waits_for_its_driver_can_be_asked_to_end() {
    let (press, mut app) = waiting_for_its_driver();
    app.signal(Signal::TERM);
    let end = app.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("; a signal ended the wait for its return"), "{end:?}");
    assert!(!checked_times(&press.path("out.csv")).is_empty());
}

#[test]
fn a_driver_that_is_asked_to_stop_leaves_last_words_and_nothing_else() {
    type Ask = fn(&Press) -> String;
    let signals: [Ask; 4] = [
        |press| ask_by_signal(press, Signal::TERM),
        |press| ask_by_signal(press, Signal::INT),
        |press| ask_by_signal(press, Signal::HUP),
        |press| {
            let end = io_driver(&["stop"], press.driver.socket());
            assert_eq!(end.status, Some(0), "{end:?}");
            assert!(end.out.starts_with(&format!("driver (process {}) stops\n", press.driver.child.id())));
            assert!(end.out.contains("the motors were written zero"), "done means that it was seen: {end:?}");
            "request of process ".into()
        },
    ];
    for clock in ["real", "lockstep"] {
        for ask in signals {
            let mut press = Press::start(clock);
            let mut app = Running::start(press.app().args([
                "--seconds",
                "80000",
                "--record",
                "out.csv",
                "--grace",
                "0",
            ]));
            wait_for_some_run(&press.observer.driver);
            let reason = ask(&press);
            assert_eq!(press.driver.wait().code(), Some(0));
            let words = epitaph::read(&press.observer.driver.epitaph).expect("last words");
            assert_eq!((words.kind, words.complete), (EpitaphKind::Stopped, true));
            assert!(words.text.starts_with(&reason), "{words}");
            let last = press.observer.driver.latest_tick().expect("frames");
            // The tick that it was waiting for when it was asked, or the one it was in.
            assert!(words.tick >= last, "{words}, last frame {last}");
            assert!(!press.driver.socket().exists());
            let directory = press.driver.socket().parent().expect("a directory");
            assert_eq!(std::fs::read_dir(directory).expect("a directory").count(), 0);
            let end = app.end();
            assert_eq!(end.status, Some(3), "{end:?}");
            assert!(
                end.err.contains(&format!("the driver is gone: stopped in tick {}", words.tick)),
                "{end:?}"
            );
            assert!(!checked_times(&press.path("out.csv")).is_empty());
        }
    }
}

fn ask_by_signal(press: &Press, signal: Signal) -> String {
    process::send(press.driver.child.id(), signal);
    format!("signal {}", signal.as_raw())
}

#[test]
fn a_second_driver_at_the_same_socket_is_refused_and_the_first_goes_on() {
    let mut press = Press::start("real");
    let app = press.start_app();
    let mut log = RingLog::begin(&press.observer.driver);
    log.follow_to_force(&press.observer.driver);
    let file = press.path("driver.toml");
    std::fs::write(&file, press::config("real")).expect("a configuration");
    let mut second = programs::io_driver();
    second.args(["run", "--config"]).arg(&file).arg("--socket").arg(press.driver.socket());
    let end = Running::start(&mut second).end();
    assert_eq!(end.status, Some(2), "{end:?}");
    let message = format!("another driver is running at {}", press.driver.socket().display());
    assert!(end.err.contains(&message), "{end:?}");
    log.follow_to_force(&press.observer.driver);
    press.driver_must_live();
    terminate(app);
    let answer = client::observe(press.driver.socket(), "test").expect("the first one still listens");
    assert_eq!(answer.driver_pid, u64::from(press.driver.child.id()));
}

#[test]
fn what_a_killed_driver_leaves_is_told_to_clients_and_does_not_hinder_the_next() {
    let mut press = Press::start("real");
    press.driver.child.kill().expect("our own child");
    press.driver.wait();
    assert!(press.driver.socket().exists(), "nobody took it away");
    let found = client::observe(press.driver.socket(), "test").err();
    assert!(matches!(found, Some(AttachError::DriverGone { .. })), "{found:?}");
    let end = Running::start(press.app().args(["--seconds", "1"])).end();
    assert_eq!(end.status, Some(2), "{end:?}");
    let message =
        format!("the driver is gone: {} is left over from one that died", press.driver.socket().display());
    assert!(end.err.contains(&message), "{end:?}");
    for arguments in [&["stop"][..], &["status"], &["clear-fault"]] {
        let end = io_driver(arguments, press.driver.socket());
        assert_eq!(end.status, Some(2), "{end:?}");
        assert!(end.err.contains("is left over from one that died"), "{end:?}");
    }
    press.driver.restart(&press::config("real"));
    press.observer = press.driver.observe();
    let app = press.start_app();
    RingLog::begin(&press.observer.driver).follow_to_force(&press.observer.driver);
    terminate(app);
}
