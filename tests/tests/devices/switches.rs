//! Emergency stop and dead-man's switch, pressed on the card of a real driver with a force on.

use bytemuck::Zeroable;
use rustix::process::Signal;
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::{DriverState, FaultReason};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::process::io_driver;
use system_tests::faults::stand::{Setup, Stand, end_app};

/// False as long as there is no frame.
fn is_in_fault(stand: &Stand) -> bool {
    let (state, fault) = (DriverState::Fault as u64, FaultReason::EmergencyStop as u64);
    stand.view().read_latest().is_some_and(|frame| (frame.state, frame.fault) == (state, fault))
}

#[test]
fn an_emergency_stop_on_the_card_switches_off_and_only_a_request_switches_on_again() {
    let config = "emergency_stop = { device = \"f0\", button = 1, normally_closed = true }\n";
    let stand = Stand::start(Setup { config: config.into(), ..Setup::new("real") });
    wait_for("the open circuit", || is_in_fault(&stand));
    stand.amplifiers.press(0b10);
    assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
    let app = stand.start_app();
    // The application ends over a fault that is there, so it comes after.
    stand.wait_for_force();
    stand.amplifiers.press(0);
    wait_for("the emergency stop", || is_in_fault(&stand));
    stand.amplifiers.settle();
    stand.amplifiers.check_off("with the emergency stop pressed");
    let status = io_driver(&["status"], &stand.socket());
    assert!(status.out.contains("emergency stop pressed"), "{status:?}");
    let energised = stand.amplifiers.tally().energised;
    let end = io_driver(&["clear-fault"], &stand.socket());
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("all the same: an emergency stop was pressed"), "{end:?}");
    stand.amplifiers.settle();
    assert!(is_in_fault(&stand), "while it is pressed");
    assert_eq!(stand.amplifiers.tally().energised, energised);
    drop(app);
    stand.finish();
}

#[test]
fn an_emergency_stop_over_the_socket_switches_off_whoever_commands() {
    let mut stand = Stand::start(Setup::new("real"));
    let mut app = stand.start_app();
    stand.wait_for_force();
    assert_eq!(io_driver(&["emergency-stop"], &stand.socket()).status, Some(0));
    wait_for("the emergency stop", || is_in_fault(&stand));
    stand.amplifiers.settle();
    stand.amplifiers.check_off("after an emergency stop over the socket");
    let end = app.end();
    assert_eq!(end.status, Some(3), "the application tells and ends: {end:?}");
    assert!(end.err.contains("an emergency stop was pressed"), "{end:?}");
    assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
    let app = stand.start_app();
    stand.wait_for_force();
    end_app(app);
    stand.driver.must_run();
    stand.finish();
}

/// It lay in the socket of a service that was stuck, and was heard when the stop had long been seen.
#[test]
fn a_request_to_leave_a_fault_that_was_asked_before_an_emergency_stop_does_not_undo_it() {
    let stand = Stand::start(Setup::new("real"));
    let request = Request::new(RequestKind::ClearFault, "late");
    assert_eq!(io_driver(&["emergency-stop"], &stand.socket()).status, Some(0));
    let mut driver = UnixStream::connect(stand.socket()).expect("it listens");
    driver.set_read_timeout(Some(system_tests::driver::HANG)).expect("a time-out");
    driver.write_all(bytemuck::bytes_of(&request)).expect("it reads");
    let mut answer = Answer::zeroed();
    driver.read_exact(bytemuck::bytes_of_mut(&mut answer)).expect("it answers");
    assert_eq!(Verdict::from_word(answer.verdict), Some(Verdict::Outdated));
    stand.amplifiers.settle();
    assert!(is_in_fault(&stand));
    assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
    stand.finish();
}

#[test]
fn force_comes_with_the_dead_mans_switch_and_goes_with_it() {
    let config = "dead_man = { device = \"f0\", button = 0 }\n";
    let stand = Stand::start(Setup { config: config.into(), ..Setup::new("real") });
    let app = stand.start_app();
    wait_for("unattended ticks", || {
        stand.view().counters.ticks_unattended.load(std::sync::atomic::Ordering::Relaxed) > 50
    });
    assert_eq!(stand.amplifiers.tally().energised, 0, "nobody holds it");
    for _ in 0..3 {
        stand.amplifiers.press(1);
        stand.wait_for_force();
        stand.amplifiers.press(0);
        wait_for("the end of the force", || !stand.amplifiers.are_enabled());
        stand.amplifiers.settle();
        stand.amplifiers.check_off("with the dead-man's switch let go");
        let frame = stand.view().read_latest().expect("a frame");
        assert_eq!(
            (frame.state, frame.fault),
            (DriverState::Idle as u64, FaultReason::None as u64),
            "it is no fault"
        );
    }
    app.signal(Signal::TERM);
    drop(app);
    stand.finish();
}
