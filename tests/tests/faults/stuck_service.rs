//! The driver's service is stuck in a system call, or each of its calls fails. The motors can be stopped all the same, and
//! the loop stops them by itself.

use crate::service::{PATIENT, check_ended, check_stopped, push, put_away, setup};
use Asking::{Nothing, TheEnd};
use patience::prelude::*;
use rt_core::epitaph::{self, EpitaphKind};
use rustix::process::Signal;
use shm_abi::{FaultReason, stop_socket};
use std::collections::BTreeSet;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;
use system_tests::faults::process::io_driver;
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
    /// Request that brought the call.
    asking: Asking,
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
        let wait = Duration::from_millis(if asking == TheEnd { 4000 } else { 500 });
        while begun.elapsed() < wait {
            if tracer.calls().contains(call) {
                let pushes = |frame: shm_abi::Frame| frame.devices[0].force_on_user_n_applied != [0.0; 3];
                let is_pushed = asking == Nothing && stand.view().read_latest().is_some_and(pushes);
                if matches!(harm, Harm::Failure(_)) {
                    // Nobody leaves the fault that the test brings about.
                    asker.bounded_join().expect("it asked");
                }
                return Some(Harmed { stand, asking, is_pushed, _tracer: tracer, _commander: commander });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    put_away(&stand);
    None
}

/// So that a tracer that sees half of them is found out.
const SURELY_UNDER_FORCE: [&str; 6] = ["ppoll", "accept4", "recvfrom", "sendmsg", "close", "getsockopt"];

/// System calls of the service thread.
struct Calls {
    /// Of a whole life.
    all: BTreeSet<String>,
    /// Of the time in which somebody asks while another commands.
    under_force: BTreeSet<String>,
}

impl Calls {
    fn of_a_life() -> Self {
        let mut stand = Stand::start(Setup { talks: true, ..setup(PATIENT) });
        let commander = push(&stand);
        let tracer = Tracer::listening(&stand);
        ask(&stand.socket(), Nothing).bounded_join().expect("it asked");
        // The service puts the last connection away after its answer. If it takes longer, less is asked for below.
        wait_for("all known calls in what the tracer wrote", || {
            let calls = tracer.calls();
            SURELY_UNDER_FORCE.iter().all(|call| calls.contains(*call))
        });
        std::thread::sleep(Duration::from_millis(200));
        let under_force = tracer.calls();
        drop(commander);
        for asking in Asking::LIFE {
            ask(&stand.socket(), asking).bounded_join().expect("it asked");
        }
        let end = stand.driver.end();
        assert_eq!(end.status, Some(0), "{end:?}");
        let mut all = tracer.calls();
        // It returns to nobody who could be harmed.
        all.remove("exit_group");
        Self { all, under_force }
    }

    /// Those that another life brings under force, too.
    fn surely_under_force(&self) -> Vec<&str> {
        self.under_force.iter().map(String::as_str).filter(|call| !NOW_AND_THEN.contains(call)).collect()
    }
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

fn traced() -> Option<Calls> {
    if !may_trace() {
        return None;
    }
    let calls = Calls::of_a_life();
    println!("{} calls: {:?}, under force {:?}", calls.all.len(), calls.all, calls.under_force);
    assert!(calls.all.contains("memfd_create"), "no lease began: {:?}", calls.all);
    Some(calls)
}

/// Calls that the C library makes when it likes, and a wait for a loop that has yet to end: no other life is sure to bring them.
const NOW_AND_THEN: [&str; 8] =
    ["brk", "clock_nanosleep", "futex", "madvise", "mmap", "mprotect", "mremap", "munmap"];

/// Harms the service in each of these calls, every time that of another driver.
fn for_each_harmed(calls: &Calls, harm: Harm, process: &str, mut check: impl FnMut(&str, &mut Harmed)) {
    let mut pushed = BTreeSet::new();
    for call in &calls.all {
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
    let missed: Vec<_> =
        calls.surely_under_force().into_iter().filter(|call| !pushed.contains(call)).collect();
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

/// The loop finds a fault of its own while the service is harmed in a call: under force, or while a lease begins or ends.
/// `None`: the call was not made again.
fn check_own_fault(call: &str, harm: Harm, (act, reason): (&str, FaultReason)) -> Option<Found> {
    let when = format!("{act} under {call}, {harm:?}");
    let process = if harm == Harm::Stall { PATIENT } else { WITHOUT_SANDBOX };
    let sabotaged = setup(process).sabotaged(&format!("{act}@button20"));
    let Some(mut harmed) = harmed(call, harm, sabotaged) else {
        assert!(NOW_AND_THEN.contains(&call), "{call} was never made again");
        return None;
    };
    let Harmed { stand, asking, is_pushed, .. } = &mut harmed;
    if *asking == TheEnd {
        // There may be no loop any more that could find anything.
        stand.driver.signal(Signal::TERM);
        check_ended(stand, &when);
        return Some(Found::TheEnd);
    }
    stand.amplifiers.press(1 << 20);
    check_stopped(stand, reason, &when);
    Some(if *is_pushed { Found::UnderForce } else { Found::WithoutForce })
}

/// When a fault was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    UnderForce,
    WithoutForce,
    /// None was, since the loop was ending.
    TheEnd,
}

/// A wait that is made to fail ends the driver, but for the one that is interrupted.
fn failures_of(call: &str) -> Vec<Harm> {
    let ends = |error: &&str| call == "ppoll" && *error != "EINTR";
    errors_of(call).iter().filter(|error| !ends(error)).map(|error| Harm::Failure(error)).collect()
}

/// All calls made under force are harmed there, and those of a beginning lease while one begins.
fn check_found(calls: &Calls, found: &[(&str, Option<Found>)]) {
    println!("{found:?}");
    for (call, found) in found {
        if calls.surely_under_force().contains(call) {
            assert_eq!(*found, Some(Found::UnderForce), "{call}");
        }
    }
    let without_force = found.iter().filter(|(_, found)| *found == Some(Found::WithoutForce)).count();
    assert!(without_force > 0, "no call of a beginning lease was harmed");
}

#[test]
fn a_loop_whose_service_is_stuck_finds_its_own_faults() {
    let Some(calls) = traced() else { return };
    let found: Vec<_> = calls
        .all
        .iter()
        .zip(FAULTS.into_iter().cycle())
        .map(|(call, fault)| (call.as_str(), check_own_fault(call, Harm::Stall, fault)))
        .collect();
    check_found(&calls, &found);
}

#[test]
fn a_loop_whose_service_fails_in_a_call_finds_its_own_faults() {
    let Some(calls) = traced() else { return };
    let cases: Vec<_> = calls.all.iter().map(String::as_str).zip(FAULTS.into_iter().rev().cycle()).collect();
    let found = Mutex::new(Vec::new());
    // Two drivers at a time: most of it is clients that wait for an answer.
    for pair in cases.chunks(2) {
        patience::watched(2 * patience::limit(), "two drivers", || {
            std::thread::scope(|scope| {
                for &(call, fault) in pair {
                    let found = &found;
                    scope.spawn(move || {
                        let one = check_own_fault(call, failures_of(call)[0], fault);
                        found.lock().expect("nobody panicked").push((call, one));
                    });
                }
            });
        });
    }
    let found = found.into_inner().expect("nobody panicked");
    check_found(&calls, &found);
}

#[test]
#[ignore = "minutes: cargo test -p system-tests --test faults every_fault -- --ignored --nocapture"]
fn every_fault_of_the_loops_own_is_found_under_every_harm_of_the_service() {
    let Some(calls) = traced() else { return };
    let mut cases = 0;
    for call in &calls.all {
        for harm in failures_of(call).into_iter().chain([Harm::Stall]) {
            for fault in FAULTS {
                let found = check_own_fault(call, harm, fault);
                cases += u32::from(found.is_some_and(|found| found != Found::TheEnd));
            }
        }
    }
    println!("{cases} faults were found");
}

/// The datagram stops the motors at once, and no frame can be looked at: the command does not claim what it has not seen.
#[test]
fn an_emergency_stop_of_a_driver_whose_service_is_stuck_stops_the_motors_and_says_that_it_cannot_see_it() {
    let Some(calls) = traced() else { return };
    // Two at a time: most of it is the command that waits for an answer.
    for pair in calls.surely_under_force().chunks(2) {
        patience::watched(2 * patience::limit(), "two drivers", || {
            std::thread::scope(|scope| {
                for call in pair {
                    scope.spawn(move || check_command(call));
                }
            });
        });
    }
}

fn check_command(call: &str) {
    let when = format!("emergency-stop, stuck in {call}");
    let harmed = harmed(call, Harm::Stall, setup(PATIENT)).expect("it is made under force");
    assert!(harmed.is_pushed, "{when}");
    let end = io_driver(&["emergency-stop"], &harmed.stand.socket());
    assert_eq!((end.status, end.out.as_str()), (Some(3), ""), "{when}: {end:?}");
    for words in
        ["not confirmed within 100 ms: the motors may still be on; cut their power", "no frame has shown it"]
    {
        assert!(end.err.contains(words), "{when}: {end:?}");
    }
    check_stopped(&harmed.stand, FaultReason::EmergencyStop, &when);
}

/// Errors of a call that is harmed in earnest; of others EIO, which none of them has.
fn errors_of(call: &str) -> &'static [&'static str] {
    match call {
        "ppoll" => &["EIO", "EINTR"],
        "accept4" | "memfd_create" | "pipe2" => &["EIO", "EMFILE"],
        "splice" => &["EIO", "EAGAIN"],
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
    for (call, error) in
        calls.all.iter().flat_map(|call| errors_of(call).iter().map(move |error| (call, *error)))
    {
        let when = format!("{call} fails with {error}");
        let Some(mut harmed) = harmed(call, Harm::Failure(error), setup(WITHOUT_SANDBOX)) else {
            assert!(NOW_AND_THEN.contains(&call.as_str()), "{call} was never made again");
            continue;
        };
        let stand = &mut harmed.stand;
        let _ = stop_socket::send(&stand.socket());
        // Amplifiers are off for a moment, too, where a starved commander's replies are late.
        wait_for(&when, || {
            let latest = stand.view().read_latest();
            stand.driver.has_ended()
                || latest.is_some_and(|frame| frame.fault == FaultReason::EmergencyStop as u64)
        });
        stand.amplifiers.settle();
        stand.amplifiers.check_off(&when);
        if !stand.driver.has_ended() {
            stand.driver.signal(Signal::TERM);
            check_ended(stand, &when);
        }
    }
}
