//! No descriptors: for the driver, for the application, and because of a crowd.

use patience::prelude::*;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use shm_abi::server::MAX_OBSERVERS_OF_PROCESS;
use shm_abi::{DriverState, client, stop_socket};
use std::time::Duration;
use system_tests::driver::HANG;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::flood::Flood;
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

/// As many as it has open. The loop needs none; who knocks waits, and is served once there are some.
#[test]
fn a_driver_whose_descriptors_are_exhausted_goes_on_with_its_app_and_serves_again_when_it_can() {
    let mut stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let id = stand.driver.id();
    let open = std::fs::read_dir(format!("/proc/{id}/fd")).expect("our own child").flatten();
    let highest: u64 = open.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).max().expect("some");
    let pid = Pid::from_raw(id.cast_signed());
    let limit =
        |current| prlimit(pid, Resource::Nofile, Rlimit { current: Some(current), maximum: Some(1024) });
    limit(highest + 1).expect("our own child");
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
    limit(1024).expect("our own child");
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

/// However many look on or say nothing, the one who commands goes on, and somebody can stop the driver.
#[test]
fn a_crowd_of_clients_disturbs_nobody_and_leaves_room_for_stopping() {
    let stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let observers: Vec<_> =
        std::iter::from_fn(|| client::observe(&stand.socket(), "crowd").ok()).take(100).collect();
    // The stand itself is one of this process.
    assert_eq!(observers.len() + 1, MAX_OBSERVERS_OF_PROCESS);
    let refused = client::observe(&stand.socket(), "crowd").expect_err("no more");
    assert!(refused.to_string().contains("the driver refused"), "{refused}");
    let mut log = RingLog::begin(stand.view());
    log.follow_for(stand.view(), 200);
    log.check_promise(stand.view());
    assert!(log.told.iter().any(Told::is_pushing));
    drop(app);
    // Stopping, which the stand does now, needs a connection too.
    stand.finish();
    drop(observers);
}

/// CPU time of a process's first thread (s).
fn cpu_of_service(process: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/task/{process}/stat")).expect("it lives");
    let fields = text[text.rfind(')').expect("a name") + 2..].split(' ').collect::<Vec<_>>();
    let ticks = |field: usize| fields[field].parse::<f64>().expect("a number");
    // Fields 14 and 15, user and system; the first two are cut off. In hundredths of a second on every Linux.
    (ticks(11) + ticks(12)) / 100.0
}

fn wait_for_state(stand: &Stand, is_fault: bool) {
    wait_for("what was asked for under a flood", || {
        let frame = stand.view().read_latest();
        frame.is_some_and(|frame| (frame.state == DriverState::Fault as u64) == is_fault)
    });
}

/// Fewer attempts are no flood (1/s): a machine that is busy with other tests makes several thousand of the ten.
const LEAST_FLOOD_PER_S: f64 = 1000.0;
/// Of a CPU, for one attempt (s): 25 us were measured.
const MOST_ATTEMPT_S: f64 = 75e-6;
/// Of a CPU, for what the stops ask.
const REST_SHARE: f64 = 0.1;

/// Attempts to connect without an end, ten thousand a second where the machine has time for so many; whoever stops the motors
/// meanwhile, over a connection or by datagram, is served.
fn stops_under_a_flood(duration: Duration) {
    let stand = Stand::start(Setup::new("real"));
    let (cpu, ticks) = (cpu_of_service(stand.driver.id()), stand.view().latest_tick().unwrap_or(0));
    let overruns = || stand.view().counters.overruns.load(std::sync::atomic::Ordering::Relaxed);
    let overruns_before = overruns();
    let begun = std::time::Instant::now();
    let flood = Flood::start(&stand.socket(), 10_000);
    let (mut stops, mut slowest) = (0, Duration::ZERO);
    while begun.elapsed() < duration {
        let asked = std::time::Instant::now();
        if stops % 2 == 0 {
            client::emergency_stop_over_connection(&stand.socket(), "test").expect("it is served");
        } else {
            stop_socket::send(&stand.socket()).expect("it is heard");
        }
        wait_for_state(&stand, true);
        slowest = slowest.max(asked.elapsed());
        client::clear_fault(&stand.socket(), "test").expect("it is served");
        wait_for_state(&stand, false);
        // Commanding is served as well.
        drop(stand.command());
        stops += 1;
        std::thread::sleep(Duration::from_millis(20));
    }
    let seconds = begun.elapsed().as_secs_f64();
    let attempts = flood.attempts() as f64 / seconds;
    drop(flood);
    let share = (cpu_of_service(stand.driver.id()) - cpu) / seconds;
    let ticks = stand.view().latest_tick().unwrap_or(0) - ticks;
    let told = format!(
        "{attempts:.0} attempts a second, {stops} stops, slowest {slowest:?}; service {:.0} % of a CPU; \
         {} of {ticks} ticks skipped",
        100.0 * share,
        overruns() - overruns_before
    );
    println!("{told}");
    assert!(stops > 0 && attempts > LEAST_FLOOD_PER_S, "{told}");
    // A service that did not sleep between attempts would take all of a CPU.
    assert!(share < REST_SHARE + attempts * MOST_ATTEMPT_S, "{told}");
    stand.finish();
}

#[test]
fn stops_are_served_under_a_flood_of_connections() {
    stops_under_a_flood(Duration::from_secs(3));
}

#[test]
#[ignore = "a minute: cargo test -p system-tests --test faults flood -- --ignored --nocapture"]
fn stops_are_served_under_a_flood_of_connections_for_a_minute() {
    stops_under_a_flood(Duration::from_secs(60));
}
