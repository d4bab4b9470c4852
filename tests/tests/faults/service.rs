//! The driver's standard error takes nothing, an emergency stop finds no socket or gets no threads: the motors can be
//! stopped all the same, or whoever asked is told that they may still be on.

use rustix::process::Signal;
use shm_abi::{DriverState, FaultReason, client, stop_socket};
use std::fs::File;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::time::{Duration, Instant};
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;
use system_tests::faults::process::{Running, io_driver};
use system_tests::faults::ring::RingLog;
use system_tests::faults::stand::{Setup, Stand};
use system_tests::faults::terminal::Terminal;
use system_tests::programs;

const PUSH: [f64; 3] = [0.0, 1.0, 0.0];

/// The service may be silent for longer than a test takes until it has stopped the motors in another way.
pub(crate) const PATIENT: &str = "\n[process]\nservice_silence_ms = 5000\n";

pub(crate) fn setup(process: &str) -> Setup {
    Setup { config: process.into(), ..Setup::new("real") }
}

pub(crate) fn push(stand: &Stand) -> Commander {
    let commander = Commander::start(stand.command(), PUSH);
    RingLog::begin(stand.view()).follow_to_force(stand.view());
    commander
}

/// By the driver's frames and by the registers of the amplifiers.
pub(crate) fn check_stopped(stand: &Stand, why: FaultReason, when: &str) {
    wait_for(when, || {
        stand.view().read_latest().is_some_and(|frame| {
            frame.state == DriverState::Fault as u64
                && frame.fault == why as u64
                && frame.devices[0].force_on_user_n_applied == [0.0; 3]
        })
    });
    stand.amplifiers.settle();
    stand.amplifiers.check_off(when);
}

/// The loop has ended and told the amplifiers so, whatever the rest of the process does.
pub(crate) fn check_ended(stand: &Stand, when: &str) {
    wait_for(when, || {
        let last = stand.view().latest_tick();
        // Many ticks at 2 kHz, if there were any.
        std::thread::sleep(Duration::from_millis(50));
        stand.amplifiers.were_told_off() && stand.view().latest_tick() == last
    });
    stand.amplifiers.settle();
    stand.amplifiers.check_off(when);
}

/// What a test left of a driver that may hang: it is killed.
pub(crate) fn put_away(stand: &Stand) {
    if stand.driver.id() > 0 {
        let _ = rustix::process::Pid::from_raw(stand.driver.id().cast_signed())
            .map(|pid| rustix::process::kill_process(pid, Signal::KILL));
    }
}

/// Fills the pipe that is the driver's standard error, by a description of our own that does not wait.
fn fill_standard_error_of(stand: &Stand) {
    let path = format!("/proc/{}/fd/2", stand.driver.id());
    let flags = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();
    let mut pipe = File::options().write(true).custom_flags(flags).open(path).expect("our own child's");
    while pipe.write(&[b'\n'; 4096]).is_ok() {}
    while pipe.write(b"\n").is_ok() {}
}

/// The driver and a test that holds its standard error: full, and nobody takes anything.
fn with_a_full_pipe() -> Stand {
    let stand = Stand::start(Setup { talks: true, ..setup(PATIENT) });
    fill_standard_error_of(&stand);
    stand
}

#[test]
fn a_driver_whose_standard_error_is_full_is_stopped_over_the_socket_and_by_datagram() {
    let mut stand = with_a_full_pipe();
    for by_datagram in [false, true] {
        let commander = push(&stand);
        if by_datagram {
            stop_socket::send(&stand.socket()).expect("it lies there");
        } else {
            let end = io_driver(&["emergency-stop"], &stand.socket());
            assert_eq!(end.status, Some(0), "{end:?}");
            assert!(end.out.contains("shows the fault and no force"), "{end:?}");
            let frame = stand.view().read_latest().expect("frames");
            assert_eq!(frame.fault, FaultReason::EmergencyStop as u64, "done means that a frame shows it");
        }
        check_stopped(&stand, FaultReason::EmergencyStop, "a stop with standard error full");
        drop(commander);
        assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
        wait_for("the end of the fault", || {
            stand.view().read_latest().is_some_and(|frame| frame.fault == FaultReason::None as u64)
        });
    }
    assert_eq!(io_driver(&["status"], &stand.socket()).status, Some(0));
    // It says something about each stop that begins, and the queue has an end: 1024 lines.
    wait_for("dropped lines", || {
        for _ in 0..50 {
            client::emergency_stop_over_connection(&stand.socket(), "test").expect("it is heard");
            // Refused where the loop has not taken the stop yet.
            let _ = client::clear_fault(&stand.socket(), "test");
        }
        stand.view().counters.log_dropped.load(std::sync::atomic::Ordering::Relaxed) > 0
    });
    wait_for("the end of the fault", || {
        // A stop that is still on its way outlasts a request to leave the fault.
        client::clear_fault(&stand.socket(), "test").expect("it is heard");
        stand.view().read_latest().is_some_and(|frame| frame.fault == FaultReason::None as u64)
    });
    let _commander = push(&stand);
    stand.driver.signal(Signal::TERM);
    check_ended(&stand, "the first SIGTERM with standard error full");
    let begun = Instant::now();
    while !stand.driver.has_ended() {
        assert!(begun.elapsed() < Duration::from_secs(20), "nobody holds the end of the process either");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// As somebody does who types Ctrl-S to read what went by.
#[test]
fn a_driver_whose_terminal_is_held_is_stopped_all_the_same() {
    let mut stand = Stand::start(Setup { talks: true, ..setup(PATIENT) });
    stand.stop_driver();
    let terminal = Terminal::open();
    stand.restart_driver_saying_to(terminal.end());
    terminal.hold();
    let _commander = push(&stand);
    let end = io_driver(&["emergency-stop"], &stand.socket());
    assert_eq!(end.status, Some(0), "{end:?}");
    check_stopped(&stand, FaultReason::EmergencyStop, "a stop with the terminal held");
    stand.driver.signal(Signal::TERM);
    check_ended(&stand, "SIGTERM with the terminal held");
    put_away(&stand);
}

#[test]
fn an_emergency_stop_that_finds_no_socket_tells_of_the_driver_that_made_it() {
    let stand = Stand::start(Setup::new("real"));
    let commander = push(&stand);
    for file in [stand.socket(), stop_socket::path_beside(&stand.socket())] {
        std::fs::rename(&file, file.with_extension("moved")).expect("its file");
    }
    let end = io_driver(&["emergency-stop"], &stand.socket());
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = format!("process {} listens there", stand.driver.id());
    assert!(end.err.contains(&words) && end.err.contains("motors may still be on"), "{end:?}");
    drop(commander);
    put_away(&stand);
}

#[test]
fn an_emergency_stop_that_gets_no_threads_stops_and_looks_all_the_same() {
    /// Of each thread's stack (bytes): more than any machine has addresses for.
    const ENDLESS: &str = "100000000000000";
    let stand = Stand::start(Setup::new("real"));
    let commander = push(&stand);
    let mut stop = programs::io_driver();
    stop.env("RUST_MIN_STACK", ENDLESS).args(["emergency-stop", "--socket"]).arg(stand.socket());
    let end = Running::start(&mut stop).end();
    assert_eq!(end.status, Some(0), "{end:?}");
    check_stopped(&stand, FaultReason::EmergencyStop, "no threads");
    drop(commander);
    put_away(&stand);
}
