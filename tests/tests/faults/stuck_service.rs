//! The driver's service is stuck in a system call, or each of its calls fails. The motors can be stopped all the same, and
//! the loop stops them by itself.

use crate::service::{PATIENT, check_ended, check_stopped, push, put_away, setup};
use patience::prelude::*;
use rt_core::epitaph::{self, EpitaphKind};
use rustix::process::Signal;
use shm_abi::{FaultReason, stop_socket};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;
use system_tests::faults::stand::{Setup, Stand};
use system_tests::faults::stuck::{Asking, Harm, Tracer, ask};

/// The service may not be silent for long.
const WATCHFUL: &str = "\n[process]\nservice_silence_ms = 500\n";
/// A call that is made to fail is none that the kernel's filter knows.
const WITHOUT_SANDBOX: &str = "\n[process]\nsandbox = false\nservice_silence_ms = 5000\n";

/// A driver whose service is harmed in a call.
struct Harmed {
    // Let go first: whom it holds does not die.
    _tracer: Tracer,
    _commander: Commander,
    stand: Stand,
    /// It was harmed under the commander's force.
    is_pushed: bool,
}

impl Drop for Harmed {
    fn drop(&mut self) {
        put_away(&self.stand);
    }
}

/// A driver that pushes until its service is harmed in each call of this name. Returns nothing if no life brings that call.
fn harmed(call: &str, harm: Harm, setup: Setup) -> Option<Harmed> {
    let stand = Stand::start(setup);
    let commander = push(&stand);
    let tracer = Tracer::harming(&stand, call, harm);
    for asking in Asking::LIFE {
        let asker = ask(&stand.socket(), asking);
        let begun = Instant::now();
        // Each takes some tenths of a second at most, the end of a driver a little more.
        let wait = Duration::from_millis(if asking == Asking::TheEnd { 4000 } else { 500 });
        while begun.elapsed() < wait {
            if tracer.calls().contains(call) {
                let pushes = |frame: shm_abi::Frame| frame.devices[0].force_on_user_n_applied != [0.0; 3];
                let is_pushed = asking == Asking::Nothing && stand.view().read_latest().is_some_and(pushes);
                if matches!(harm, Harm::Failure(_)) {
                    // Nobody leaves the fault that the test brings about.
                    asker.bounded_join().expect("it asked");
                }
                return Some(Harmed { stand, is_pushed, _tracer: tracer, _commander: commander });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    put_away(&stand);
    None
}

/// Every system call that the service thread makes in a whole life.
fn calls_of_a_life() -> BTreeSet<String> {
    let mut stand = Stand::start(Setup { talks: true, ..setup(PATIENT) });
    let tracer = Tracer::listening(&stand);
    let commander = push(&stand);
    drop(commander);
    for asking in Asking::LIFE {
        ask(&stand.socket(), asking).bounded_join().expect("it asked");
    }
    let end = stand.driver.end();
    assert_eq!(end.status, Some(0), "{end:?}");
    let mut calls = tracer.calls();
    // It returns to nobody who could be harmed.
    calls.remove("exit_group");
    calls
}

fn may_trace() -> bool {
    let works = Tracer::works();
    if !works {
        println!(
            "skipped: there is no strace that may attach; that a stuck service keeps nobody from stopping is tested \
             with a full standard error instead"
        );
    }
    works
}

fn traced() -> Option<BTreeSet<String>> {
    if !may_trace() {
        return None;
    }
    let calls = calls_of_a_life();
    println!("{} calls: {calls:?}", calls.len());
    for known in UNDER_FORCE.iter().chain(&["memfd_create"]) {
        assert!(calls.contains(*known), "{known} is not among {calls:?}");
    }
    Some(calls)
}

/// Calls that somebody who asks brings while another commands.
const UNDER_FORCE: [&str; 6] = ["ppoll", "accept4", "recvfrom", "sendmsg", "close", "getsockopt"];

/// Calls that the C library makes when it likes, and a wait for a loop that has yet to end: no other life is sure to bring them.
const NOW_AND_THEN: [&str; 8] =
    ["brk", "clock_nanosleep", "futex", "madvise", "mmap", "mprotect", "mremap", "munmap"];

/// Harms the service in each of these calls, every time that of another driver.
fn for_each_harmed(
    calls: &BTreeSet<String>,
    harm: Harm,
    process: &str,
    mut check: impl FnMut(&str, &mut Harmed),
) {
    let mut pushed = BTreeSet::new();
    for call in calls {
        let Some(mut harmed) = harmed(call, harm, setup(process)) else {
            assert!(NOW_AND_THEN.contains(&call.as_str()), "{call} was never made again");
            println!("{call}: not made again");
            continue;
        };
        if harmed.is_pushed {
            pushed.insert(call.as_str());
        }
        check(call, &mut harmed);
    }
    println!("harmed under force in {pushed:?}");
    let missed: Vec<_> = UNDER_FORCE.iter().filter(|call| !pushed.contains(**call)).collect();
    assert!(missed.is_empty(), "{missed:?} were not harmed under force");
}

#[test]
fn whatever_call_the_service_is_stuck_in_a_datagram_and_a_signal_stop_the_motors() {
    let Some(calls) = traced() else { return };
    for_each_harmed(&calls, Harm::Stall, PATIENT, |call, Harmed { stand, .. }| {
        let when = format!("stuck in {call}");
        // A service that was asked to end may have ended the loop before it got stuck, and removed the socket.
        let sent = stop_socket::send(&stand.socket());
        assert!(sent.is_ok() || stand.amplifiers.were_told_off(), "{when}: {sent:?}");
        wait_for(&when, || {
            let frame = stand.view().read_latest();
            stand.amplifiers.were_told_off()
                || frame.is_some_and(|frame| frame.fault == FaultReason::EmergencyStop as u64)
        });
        stand.driver.signal(Signal::TERM);
        check_ended(stand, &when);
    });
}

#[test]
fn whatever_call_the_service_is_stuck_in_the_first_signal_ends_the_loop() {
    let Some(calls) = traced() else { return };
    for_each_harmed(&calls, Harm::Stall, PATIENT, |call, Harmed { stand, .. }| {
        stand.driver.signal(Signal::TERM);
        check_ended(stand, &format!("SIGTERM while stuck in {call}"));
    });
}

#[test]
fn whatever_call_the_service_is_stuck_in_the_loop_stops_the_motors_by_itself() {
    let Some(calls) = traced() else { return };
    for_each_harmed(&calls, Harm::Stall, WATCHFUL, |call, Harmed { stand, is_pushed, .. }| {
        let when = format!("nobody asked while stuck in {call}");
        if *is_pushed {
            return check_stopped(stand, FaultReason::ServiceSilent, &when);
        }
        // Nobody commands: the force ramps out.
        wait_for(&when, || !stand.amplifiers.are_enabled());
        stand.amplifiers.settle();
        stand.amplifiers.check_off(&when);
    });
}

/// A panic of the service is one of its failures: `service.rs` tests that it is caught as one.
#[test]
fn a_service_that_fails_ends_the_loop_with_zero_last_words_and_status_3() {
    if !may_trace() {
        return;
    }
    let harm = Harm::Failure("ENOMEM");
    let mut harmed =
        harmed("ppoll", harm, setup(WITHOUT_SANDBOX)).expect("it waits for something all the time");
    let end = harmed.stand.driver.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = epitaph::read(&harmed.stand.view().epitaph).expect("last words");
    assert_eq!(words.kind, EpitaphKind::Fault);
    assert!(words.text.contains("cannot wait at the socket"), "{words}");
    assert!(harmed.stand.amplifiers.were_told_off());
    harmed.stand.amplifiers.settle();
    harmed.stand.amplifiers.check_off("a service that fails");
}

/// What a device may do, and what the loop makes of it.
const FAULTS: [(&str, FaultReason); 2] =
    [("nan", FaultReason::PositionNotFinite), ("unreadable", FaultReason::DeviceRead)];

/// The loop finds a fault of its own while the service is harmed in a call.
fn check_own_fault(call: &str, harm: Harm, (act, reason): (&str, FaultReason)) {
    let when = format!("{act} under {call}, {harm:?}");
    let process = if harm == Harm::Stall { PATIENT } else { WITHOUT_SANDBOX };
    let sabotaged = setup(process).sabotaged(&format!("{act}@button20"));
    let harmed = harmed(call, harm, sabotaged).unwrap_or_else(|| panic!("{call} was never made again"));
    assert!(harmed.is_pushed, "{when}");
    harmed.stand.amplifiers.press(1 << 20);
    check_stopped(&harmed.stand, reason, &when);
}

/// A wait that is made to fail ends the driver, but for the one that is interrupted.
fn failures_of(call: &str) -> Vec<Harm> {
    let ends = |error: &&str| call == "ppoll" && *error != "EINTR";
    errors_of(call).iter().filter(|error| !ends(error)).map(|error| Harm::Failure(error)).collect()
}

#[test]
fn a_loop_whose_service_is_stuck_finds_its_own_faults() {
    if !may_trace() {
        return;
    }
    for (index, call) in UNDER_FORCE.into_iter().enumerate() {
        check_own_fault(call, Harm::Stall, FAULTS[index % 2]);
    }
}

#[test]
fn a_loop_whose_service_fails_in_a_call_finds_its_own_faults() {
    if !may_trace() {
        return;
    }
    // Two drivers at a time: most of it is clients that wait for an answer.
    for pair in UNDER_FORCE.chunks(2) {
        patience::watched(2 * patience::limit(), "two drivers", || {
            std::thread::scope(|scope| {
                for (call, fault) in pair.iter().zip(FAULTS.into_iter().rev()) {
                    scope.spawn(move || check_own_fault(call, failures_of(call)[0], fault));
                }
            });
        });
    }
}

#[test]
#[ignore = "a minute: cargo test -p system-tests --test faults every_fault -- --ignored --nocapture"]
fn every_fault_of_the_loops_own_is_found_under_every_harm_of_the_service() {
    if !may_trace() {
        return;
    }
    let mut cases = 0;
    for call in UNDER_FORCE {
        for harm in failures_of(call).into_iter().chain([Harm::Stall]) {
            for fault in FAULTS {
                check_own_fault(call, harm, fault);
                cases += 1;
            }
        }
    }
    println!("{cases} faults were found");
}

/// Errors of a call that is harmed in earnest; of others EIO, which none of them has.
fn errors_of(call: &str) -> &'static [&'static str] {
    match call {
        "ppoll" => &["EIO", "EINTR"],
        "accept4" | "memfd_create" => &["EIO", "EMFILE"],
        "recvfrom" => &["EIO", "ECONNRESET", "EAGAIN"],
        "sendmsg" => &["EIO", "EPIPE"],
        "ftruncate" => &["EIO", "ENOSPC"],
        "mmap" => &["EIO", "ENOMEM"],
        _ => &["EIO"],
    }
}

#[test]
fn whatever_call_of_the_service_fails_the_motors_can_be_stopped_or_are_off() {
    let Some(calls) = traced() else { return };
    for (call, error) in calls.iter().flat_map(|call| errors_of(call).iter().map(move |error| (call, *error)))
    {
        let when = format!("{call} fails with {error}");
        let Some(mut harmed) = harmed(call, Harm::Failure(error), setup(WITHOUT_SANDBOX)) else {
            assert!(NOW_AND_THEN.contains(&call.as_str()), "{call} was never made again");
            continue;
        };
        let stand = &mut harmed.stand;
        let _ = stop_socket::send(&stand.socket());
        wait_for(&when, || stand.driver.has_ended() || !stand.amplifiers.are_enabled());
        stand.amplifiers.settle();
        stand.amplifiers.check_off(&when);
        if !stand.driver.has_ended() {
            stand.driver.signal(Signal::TERM);
            check_ended(stand, &when);
        }
    }
}
