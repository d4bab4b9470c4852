//! A device fails in the middle of a tick: all motors are off at once, and stay off until somebody asks.

use io_driver::real_loop::Ended;
use nalgebra::Vector3;
use patience::prelude::*;
use shm_abi::client;
use shm_abi::segment::ClockMode;
use shm_abi::{DriverState, DriverView, FaultReason, Frame};
use std::sync::atomic::Ordering;
use system_tests::driver::HANG;
use system_tests::faults::amplifiers::Amplifiers;
use system_tests::faults::commander::Commander;
use system_tests::faults::hosted::Hosted;
use system_tests::faults::press::{PEAK_N, Table};
use system_tests::faults::process::{Running, io_driver};
use system_tests::faults::puppet::{Call, Mood, Strings};
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::stand::{Setup, Stand};
use system_tests::recording;

const FORCE: [f64; 3] = [0.0, 2.0, 0.0];

/// Two puppets under a commander, at full force.
struct Stage {
    driver: Hosted,
    view: DriverView,
    strings: [Strings; 2],
    commander: Commander,
    log: RingLog,
}

impl Stage {
    fn at_full_force(clock: &str) -> Self {
        let strings = [Strings::default(), Strings::default()];
        let driver = hosted(clock, &strings);
        let view = client::observe(driver.socket(), "test").expect("an observer's place").driver;
        let commander = Commander::start(client::command(driver.socket(), "test").expect("the lease"), FORCE);
        let mut log = RingLog::begin(&view);
        log.follow(&view, "the whole force", |told| told.iter().any(is_whole));
        Self { driver, view, strings, commander, log }
    }

    fn faults(&self) -> u64 {
        self.view.counters.faults.load(Ordering::Relaxed)
    }
}

fn hosted(clock: &str, strings: &[Strings]) -> Hosted {
    let config = format!(
        "rate_hz = 2000\nclock = \"{clock}\"\n[reply]\nbudget_us = 400\n\
         [safety]\nmax_command_age_ticks = 5\nramp_in_ms = 20\nramp_out_ms = 4\n\
         [[device]]\nbackend = \"ideal\"\n"
    );
    Hosted::start(&config, strings.iter().map(|strings| strings.device("puppet", PEAK_N)).collect())
}

fn is_whole(told: &Told) -> bool {
    told.authority == 1.0 && told.first_applied_n == FORCE
}

/// What was asked of a device after it was last read.
fn calls_after_last_read(strings: &Strings) -> Vec<Call> {
    let calls = strings.calls();
    let last = calls.iter().rposition(|call| matches!(call, Call::Read(_))).expect("it was read");
    calls[last + 1..].to_vec()
}

#[test]
fn a_device_that_panics_when_it_is_read_ends_the_loop_with_all_motors_off() {
    for clock in ["real", "lockstep"] {
        let Stage { driver, view, strings, commander, .. } = Stage::at_full_force(clock);
        strings[1].set(Mood::PanicsWhenRead);
        assert_eq!(driver.end(), Ended::Panicked);
        assert_eq!(view.counters.faults.load(Ordering::Relaxed), 1);
        for strings in &strings {
            // Nothing more was written in that tick; released at once, and once more by whoever throws it away.
            let calls = calls_after_last_read(strings);
            assert!(!calls.is_empty() && calls.iter().all(|call| *call == Call::Release), "{calls:?}");
        }
        drop(commander);
    }
}

#[test]
fn a_device_that_panics_when_it_is_written_ends_the_loop_with_all_motors_off() {
    for clock in ["real", "lockstep"] {
        let Stage { driver, strings, commander, .. } = Stage::at_full_force(clock);
        strings[1].set(Mood::PanicsWhenWritten);
        assert_eq!(driver.end(), Ended::Panicked);
        // The first had been written in that tick already.
        assert!(matches!(calls_after_last_read(&strings[0])[..], [Call::Write(_), Call::Release, ..]));
        for strings in &strings {
            assert_eq!(strings.last_call(), Some(Call::Release));
        }
        drop(commander);
    }
}

#[test]
fn a_loop_that_is_stopped_releases_every_motor_after_its_last_write() {
    for clock in ["real", "lockstep"] {
        let Stage { driver, strings, commander, .. } = Stage::at_full_force(clock);
        assert_eq!(driver.stop(), Ended::Stopped);
        for strings in &strings {
            assert_eq!(strings.last_call(), Some(Call::Release));
        }
        drop(commander);
    }
}

/// One device fails in a way; the fault, its reason and zero force are told, until somebody clears it.
fn a_failing_device(clock: &str, mood: Mood, reason: FaultReason) {
    let mut stage = Stage::at_full_force(clock);
    let observer = client::observe(stage.driver.socket(), "test").expect("an observer's place");
    stage.log.catch_up(&stage.view);
    stage.log.forget();
    stage.strings[1].set(mood);
    stage
        .log
        .follow(&stage.view, "the fault", |told| told.iter().any(|told| told.state == DriverState::Fault));
    stage.log.follow_for(&stage.view, 100);
    let first = stage.log.told.iter().position(|told| told.state == DriverState::Fault).expect("just seen");
    // The frame that tells the fault tells of the tick before it too, which may have been at full force.
    for told in &stage.log.told[first + 1..] {
        assert_eq!((told.state, told.is_pushing()), (DriverState::Fault, false), "{told:?}");
    }
    assert_eq!(stage.faults(), 1, "once, not in every tick");
    assert_eq!(read_latest(&stage.view).fault, reason as u64);
    check_zero_in_the_same_tick(&stage, mood);
    // Cleared while the device still fails, it faults again before anything is let through.
    let end = io_driver(&["clear-fault"], stage.driver.socket());
    assert_eq!(end.status, Some(3), "{end:?}");
    wait_until(|| stage.faults() == 2);
    // And cleared when it does not, the commander, who has never ceased, gets its force back.
    stage.strings[1].set(Mood::Good);
    stage.log.catch_up(&stage.view);
    stage.log.forget();
    stage.log.follow_for(&stage.view, 100);
    stage.log.check_silence_from(0);
    // It looks on for longer than the ring of frames goes back.
    let socket = stage.driver.socket().to_path_buf();
    let clearing = std::thread::spawn(move || io_driver(&["clear-fault"], &socket));
    stage.log.follow(&stage.view, "the whole force again", |told| told.iter().any(is_whole));
    let end = clearing.bounded_join().expect("no panic");
    assert_eq!(end.status, Some(0), "{end:?}");
    check_ramp(&stage.log.told);
    // On a busy machine the commander may be late in the latest frame.
    let whole = stage.log.told.iter().find(|told| is_whole(told)).expect("just seen");
    assert_eq!(whole.state, DriverState::Active);
    assert!(observer.connection.is_open());
    drop(stage.commander);
}

fn read_latest(view: &DriverView) -> Frame {
    view.read_latest().expect("frames")
}

fn wait_until(mut pleases: impl FnMut() -> bool) {
    let begun = std::time::Instant::now();
    while !pleases() {
        assert!(begun.elapsed() < HANG, "it does not come");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// From the failure on, the good device is written nothing but zero.
fn check_zero_in_the_same_tick(stage: &Stage, mood: Mood) {
    let calls = stage.strings[0].calls();
    let released = calls.iter().position(|call| *call == Call::Release).expect("motors off at once");
    let forces = |calls: &[Call]| -> Vec<Vector3<f64>> {
        let force = |call: &Call| if let Call::Write(force) = call { Some(*force) } else { None };
        calls.iter().filter_map(force).collect()
    };
    assert!(forces(&calls[released..]).iter().all(|force| *force == Vector3::zeros()));
    if stage.view.info().clock_mode == ClockMode::Lockstep {
        // In real time replies may have been late, and the force on its way down or up.
        assert_eq!(forces(&calls[..released]).last(), Some(&Vector3::from(FORCE)));
    }
    if mood != Mood::Unwritable {
        // A reading that fails is known before anything is written: the tick itself is at zero.
        assert!(matches!(calls[released - 1], Call::Read(_)), "{:?}", calls[released - 1]);
    }
}

/// The force never jumps up: 10 ticks in.
fn check_ramp(told: &[Told]) {
    for pair in told.windows(2) {
        // One level of ten, and two roundings.
        assert!(pair[1].authority - pair[0].authority <= 0.1 + 1e-15, "{pair:?}");
    }
}

#[test]
fn a_device_that_cannot_be_read_means_no_force_anywhere_until_somebody_clears_the_fault() {
    for clock in ["real", "lockstep"] {
        a_failing_device(clock, Mood::Unreadable, FaultReason::DeviceRead);
    }
}

#[test]
fn a_device_that_is_nowhere_means_no_force_anywhere_until_somebody_clears_the_fault() {
    for clock in ["real", "lockstep"] {
        a_failing_device(clock, Mood::Astray, FaultReason::PositionNotFinite);
    }
}

#[test]
fn a_device_that_cannot_be_written_means_no_force_anywhere_until_somebody_clears_the_fault() {
    for clock in ["real", "lockstep"] {
        // Every write fails, those of zero too, so that a cleared fault comes back.
        a_failing_device(clock, Mood::Unwritable, FaultReason::DeviceWrite);
    }
}

#[test]
fn an_app_whose_driver_faults_says_why_with_its_report_and_what_it_wrote_is_complete() {
    for clock in ["real", "lockstep"] {
        let strings = [Strings::default()];
        let driver = hosted(clock, &strings);
        let view = client::observe(driver.socket(), "test").expect("an observer's place").driver;
        let table = Table::new();
        let mut app = table.app(clock);
        app.args(["--seconds", "80000", "--record", "out.csv", "--events", "out.jsonl", "--attach"]);
        app.arg(driver.socket());
        let mut app = Running::start(&mut app);
        let runs = |frame: Frame| frame.run_tick > 100;
        wait_until(|| view.read_latest().is_some_and(runs));
        strings[0].set(Mood::Unreadable);
        let end = app.end();
        assert_eq!(end.status, Some(3), "{end:?}");
        let message = "the driver is in its fault state: a device could not be read; the motors are off";
        assert!(end.err.contains(message), "{end:?}");
        let rows = recording::Table::read(&table.path("out.csv")).len();
        assert!(rows > 0);
        let told = [
            format!("recording    out.csv ({rows} rows)"),
            " 1 fault".into(),
            "faults       1 of the driver".into(),
        ];
        assert!(told.iter().all(|words| end.out.contains(words)), "{end:?}");
        let events = std::fs::read_to_string(table.path("out.jsonl")).expect("events");
        let last: serde_json::Value =
            serde_json::from_str(events.lines().last().expect("the fault")).expect("JSON");
        assert_eq!((&last["kind"], &last["number"]), (&"fault".into(), &1.into()), "{last}");
        assert_eq!(last["text"], "a device could not be read", "{last}");
        // The driver lives on, in its fault state.
        assert_eq!(read_latest(&view).state, DriverState::Fault as u64);
        assert_eq!(driver.stop(), Ended::Stopped);
    }
}

/// The driver holds the registers of the card that was there when it started.
#[test]
fn a_card_that_was_started_anew_needs_a_new_driver_and_clear_fault_says_so() {
    let mut stand = Stand::start(Setup::new("real"));
    let place = stand.socket().parent().expect("a directory").to_path_buf();
    let again = Amplifiers::start(&place, stand.setup.limits);
    drop(std::mem::replace(&mut stand.amplifiers, again));
    patience::until("the fault", || {
        stand.view().read_latest().is_some_and(|frame| frame.fault == FaultReason::DeviceRead as u64)
    });
    let end = io_driver(&["clear-fault"], &stand.socket());
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(
        end.err.contains("a device could not be read; ") && end.err.contains("start the driver anew"),
        "{end:?}"
    );
    assert_eq!(io_driver(&["stop"], &stand.socket()).status, Some(0));
    stand.driver.end();
    stand.restart_driver();
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.finish();
}
