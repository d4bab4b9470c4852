//! The application stands still for a while, or is asked to end: the force goes, and comes back if it may.

use rustix::process::{Pid, Signal, kill_process};
use shm_abi::DriverState;
use std::sync::atomic::Ordering;
use std::time::Duration;
use system_tests::faults::press::{FORCE_N, Press, Table, terminate};
use system_tests::faults::process::{Running, io_driver};
use system_tests::faults::ring::{RingLog, Told};
use system_tests::recording;

/// The whole force: the spring's law is rounded twice.
fn is_whole(told: &Told) -> bool {
    told.authority == 1.0 && (told.applied_n - FORCE_N).abs() < 1e-12
}

#[test]
fn a_stopped_app_loses_its_force_in_time_and_gets_it_back_when_it_goes_on() {
    let mut press = Press::start("real");
    let mut app = press.start_app();
    let observer = &press.observer.driver;
    let mut log = RingLog::begin(observer);
    log.follow(observer, "the whole force", |told| told.iter().any(is_whole));
    let lease = log.told.last().expect("frames").lease;
    for stop in 0..10 {
        app.signal(Signal::STOP);
        // All its threads stand still soon after; then nothing answers any more, and the force is gone
        // after the age and the ramp, 5 + 8 ticks. 100 frames are a stop of 50 ms.
        log.follow(observer, "silence", |told| {
            told.len() > 100 && told[told.len() - 100..].iter().all(|told| !told.is_pushing())
        });
        log.check_promise(observer);
        let last = *log.told.last().expect("frames");
        assert_eq!((last.state, last.lease), (DriverState::Idle, lease), "stop {stop}: the lease is kept");
        log.forget();
        app.signal(Signal::CONT);
        log.follow(observer, "the whole force again", |told| told.iter().any(is_whole));
        log.check_promise(observer);
        assert!(log.told.iter().any(|told| told.state == DriverState::Active && told.lease == lease));
        app.must_run();
    }
    assert_eq!(observer.counters.faults.load(Ordering::Relaxed), 0);
    assert_eq!(observer.counters.leases_granted.load(Ordering::Relaxed), 1);
    press.driver_must_live();
    terminate(app);
}

/// A laptop that was closed, or a group of processes that was frozen: nobody was silent, though the clock went on.
#[test]
fn an_app_that_stood_still_with_its_driver_for_long_goes_on_with_it() {
    let mut press = Press::start("real");
    let mut app = press.start_app();
    let driver = Pid::from_child(&press.driver.child);
    let mut log = RingLog::begin(&press.observer.driver);
    log.follow(&press.observer.driver, "the whole force", |told| told.iter().any(is_whole));
    kill_process(driver, Signal::STOP).expect("our own child");
    app.signal(Signal::STOP);
    // Longer than a driver may be silent.
    std::thread::sleep(Duration::from_millis(5500));
    app.signal(Signal::CONT);
    std::thread::sleep(Duration::from_millis(200));
    app.must_run();
    kill_process(driver, Signal::CONT).expect("our own child");
    let observer = &press.observer.driver;
    let mut log = RingLog::begin(observer);
    log.follow(observer, "the whole force again", |told| told.iter().any(is_whole));
    app.must_run();
    press.driver_must_live();
    terminate(app);
}

/// In lockstep a tick has no other end than the answer, so a stopped application stops time; but not the
/// driver's obedience.
#[test]
fn in_lockstep_a_stopped_app_stops_time_and_the_driver_can_still_be_stopped() {
    let mut press = Press::start("lockstep");
    let app = press.start_app();
    let mut log = RingLog::begin(&press.observer.driver);
    log.follow_to_force(&press.observer.driver);
    app.signal(Signal::STOP);
    let stands = |press: &Press| {
        let before = press.observer.driver.latest_tick();
        // A tick takes some 10 us as long as both go on.
        std::thread::sleep(Duration::from_millis(50));
        press.observer.driver.latest_tick() == before
    };
    // The signal takes its time to reach all threads.
    patience::until("time stands still", || stands(&press));
    app.signal(Signal::CONT);
    log.catch_up(&press.observer.driver);
    log.follow_for(&press.observer.driver, 1000);
    app.signal(Signal::STOP);
    patience::until("time stands still", || stands(&press));
    let end = io_driver(&["stop"], press.driver.socket());
    assert_eq!(end.status, Some(0), "{end:?}");
    assert_eq!(press.driver.wait().code(), Some(0));
    app.kill();
}

#[test]
fn an_app_that_is_asked_to_end_gives_the_lease_back_and_completes_its_recording() {
    for clock in ["real", "lockstep"] {
        for signal in [Signal::TERM, Signal::INT, Signal::HUP] {
            let mut press = Press::start(clock);
            let mut app = Running::start(press.app().args(["--seconds", "80000", "--record", "out.csv"]));
            let observer = &press.observer.driver;
            let mut log = RingLog::begin(observer);
            log.follow(observer, "the whole force", |told| {
                told.iter().filter(|told| is_whole(told)).count() > 50
            });
            app.signal(signal);
            let end = app.end();
            assert_eq!(end.status, Some(128 + signal.as_raw()), "{end:?}");
            assert!(end.err.contains(&format!("ended by signal {}", signal.as_raw())), "{end:?}");
            log.follow(observer, "the end of the lease", |told| {
                told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
            });
            log.check_promise(observer);
            assert_eq!(observer.counters.leases_granted.load(Ordering::Relaxed), 1);
            assert_eq!(observer.counters.faults.load(Ordering::Relaxed), 0);
            let last = log.told.iter().rev().find(|told| told.lease == 1).expect("it had the lease");
            check_recording(&press, last.run_tick.unsigned_abs());
            press.driver_must_live();
            let next = press.start_app();
            log.follow_to_force(&press.observer.driver);
            terminate(next);
        }
    }
}

/// Every row is whole, in order, and tells the whole force; `run_tick` is that of the lease's last frame.
fn check_recording(press: &Press, run_tick: u64) {
    let table = recording::Table::read(&press.path("out.csv"));
    let rows = table.len() as u64;
    assert!(rows >= 40 && rows <= run_tick, "{rows} rows, {run_tick} ticks");
    let t = table.numbers("t");
    assert!(t.windows(2).all(|pair| pair[0] < pair[1]));
    if press.clock == "lockstep" {
        // No frame is missed; the last may have come too late to complete the row of the tick before it.
        assert!(rows + 1 >= run_tick, "{rows} rows, {run_tick} ticks");
        // 2 kHz from t = 0, none missing: the correctly rounded quotient.
        let expected = |row: usize| row as f64 * 500_000.0 / 1e9;
        assert!(t.iter().enumerate().all(|(row, t)| *t == expected(row)));
        assert!(table.vectors("f0_applied").iter().all(|force| (force.norm() - FORCE_N).abs() < 1e-12));
    }
    assert!(table.vectors("f0_force").iter().all(|force| (force.norm() - FORCE_N).abs() < 1e-12));
}

#[test]
fn an_app_that_is_asked_to_end_stops_its_own_driver_and_leaves_nothing_behind() {
    for clock in ["real", "lockstep"] {
        let table = Table::new();
        let mut app = Running::start(table.app(clock).args(["--seconds", "80000", "--record", "out.csv"]));
        let observer = table.observe_child();
        RingLog::begin(&observer.driver)
            .follow(&observer.driver, "the whole force", |told| told.iter().any(is_whole));
        app.signal(Signal::TERM);
        let end = app.end();
        assert_eq!(end.status, Some(143), "{end:?}");
        let words = rt_core::epitaph::read(&observer.driver.epitaph).expect("the driver's last words");
        assert_eq!((words.kind, words.text.as_str()), (rt_core::epitaph::EpitaphKind::Stopped, "signal 15"));
        assert_eq!(table.left_behind(), Vec::<std::path::PathBuf>::new());
        table.wait_until_abandoned();
        recording::Table::read(&table.path("out.csv"));
    }
}
