//! No descriptors: for the driver and for the application.

use patience::prelude::*;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use shm_abi::{FaultReason, client, stop_socket};
use std::time::Duration;
use system_tests::driver::HANG;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;
use system_tests::faults::knock;
use system_tests::faults::process::Running;
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::scarcity::limited;
use system_tests::faults::stand::{Setup, Stand};

/// Each number of descriptors is enough, or is refused with a message; none leaves a driver that hangs or
/// amplifiers that are on.
#[test]
fn a_driver_starts_with_enough_descriptors_or_says_why_not() {
    let mut stand = Stand::start(Setup::new("real"));
    stand.stop_driver();
    let (mut refused, mut ran) = (0, 0);
    for descriptors in 4..24 {
        let mut driver = Running::start(&mut limited(&stand.driver_command(), &format!("-n {descriptors}")));
        let begun = std::time::Instant::now();
        // One that listens may still have none for a connection: then it is asked by a signal.
        while !driver.has_ended() && !stand.socket().exists() {
            assert!(begun.elapsed() < HANG, "neither up nor down with {descriptors} descriptors");
            std::thread::sleep(Duration::from_millis(1));
        }
        if driver.has_ended() {
            let end = driver.end();
            // 127: not even the dynamic linker could open what it needs.
            assert!(matches!(end.status, Some(2 | 127)), "{descriptors}: {end:?}");
            assert!(!end.err.is_empty(), "{descriptors}: {end:?}");
            assert!(!end.err.contains("choose another place"), "{descriptors}: {end:?}");
            refused += 1;
        } else {
            std::thread::sleep(Duration::from_millis(5));
            driver.signal(rustix::process::Signal::TERM);
            let end = driver.end();
            // It listens before all of its threads are there.
            let is_refused = end.status == Some(2) && !end.err.is_empty();
            assert!(is_refused || end.status == Some(0), "{descriptors}: {end:?}");
            *(if is_refused { &mut refused } else { &mut ran }) += 1;
        }
        stand.amplifiers.check_off("after a driver with few descriptors");
    }
    assert!(refused > 0 && ran > 0, "{refused} refused, {ran} ran");
    stand.restart_driver();
    stand.finish();
}

#[test]
fn an_app_with_few_descriptors_says_so_or_works_and_the_driver_goes_on() {
    let mut stand = Stand::start(Setup::new("real"));
    let (mut refused, mut worked) = (0, 0);
    for descriptors in 4..16 {
        let mut app = Running::start(&mut limited(&stand.app(), &format!("-n {descriptors}")));
        let mut log = RingLog::begin(stand.view());
        log.follow(stand.view(), "an end or a force", |told| {
            app.has_ended() || told.last().is_some_and(Told::is_pushing)
        });
        if app.has_ended() {
            let end = app.end();
            assert!(matches!(end.status, Some(2 | 127)), "{descriptors}: {end:?}");
            assert!(!end.err.is_empty(), "{descriptors}: {end:?}");
            refused += 1;
        } else {
            worked += 1;
            app.kill();
        }
        log.check_promise(stand.view());
        stand.driver.must_run();
    }
    assert!(refused > 0 && worked > 0, "{refused} refused, {worked} worked");
    stand.finish();
}

/// Leaves the driver as many descriptors as it has open.
fn exhaust(stand: &Stand) {
    let id = stand.driver.id();
    let open = std::fs::read_dir(format!("/proc/{id}/fd")).expect("our own child").flatten();
    let highest: u64 = open.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).max().expect("some");
    limit(stand, highest + 1);
}

fn limit(stand: &Stand, descriptors: u64) {
    let limits = Rlimit { current: Some(descriptors), maximum: Some(1024) };
    prlimit(Pid::from_raw(stand.driver.id().cast_signed()), Resource::Nofile, limits).expect("our own child");
}

#[test]
fn an_emergency_stop_by_datagram_is_heard_without_a_free_descriptor() {
    let stand = Stand::start(Setup::new("real"));
    let commander = Commander::start(stand.command(), [0.0, 1.0, 0.0]);
    RingLog::begin(stand.view()).follow_to_force(stand.view());
    exhaust(&stand);
    // They take whatever is left of the queues before it.
    let crowd = knock::crowd(&stand.socket(), 30);
    stop_socket::send(&stand.socket()).expect("it is heard");
    let fault_of = |frame: Option<shm_abi::Frame>| frame.map_or(0, |frame| frame.fault);
    wait_for("the stop", || fault_of(stand.view().read_latest()) == FaultReason::EmergencyStop as u64);
    stand.amplifiers.settle();
    stand.amplifiers.check_off("a stop without descriptors");
    limit(&stand, 1024);
    drop((crowd, commander));
    wait_for("the end of the fault", || {
        let _ = client::clear_fault(&stand.socket(), "test");
        fault_of(stand.view().read_latest()) == 0
    });
    stand.finish();
}

/// As many as it has open. The loop needs none; who knocks waits, and is served once there are some.
#[test]
fn a_driver_whose_descriptors_are_exhausted_goes_on_with_its_app_and_serves_again_when_it_can() {
    let mut stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let id = stand.driver.id();
    exhaust(&stand);
    let knocking = {
        let socket = stand.socket();
        std::thread::spawn(move || client::observe(&socket, "test").map(|found| found.driver_pid))
    };
    let crowd = knock::crowd(&stand.socket(), 30);
    let mut log = RingLog::begin(stand.view());
    log.follow_for(stand.view(), 400);
    log.check_promise(stand.view());
    assert!(log.told.iter().any(Told::is_pushing));
    drop(crowd);
    limit(&stand, 1024);
    // Whether it had the patience is its affair; the next one is served.
    let _ = knocking.bounded_join().expect("it does not panic");
    assert_eq!(stand.try_to_observe().map(|seen| seen.driver_pid), Some(u64::from(id)));
    drop(app);
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.driver.must_run();
    stand.finish();
}
