//! Several want something of one driver: former holders that still write, others that want the lease, and
//! many that only look.

use bytemuck::Zeroable;
use patience::prelude::*;
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::{DriverView, Frame};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use system_tests::driver::Driver;
use system_tests::faults::commander::{Commander, answer};
use system_tests::faults::press::{Press, terminate};
use system_tests::faults::process::{Running, io_driver, is_alive, myself, role, send};
use system_tests::faults::ring::RingLog;

/// A former holder keeps its mapping and goes on answering every tick, under its own lease's number and under
/// its successor's. Nobody reads that memory any more.
fn a_late_writer(clock: &str) {
    let driver = Driver::start(&system_tests::faults::press::config(clock));
    let observer = driver.observe();
    let mut log = RingLog::begin(&observer.driver);
    let former = Commander::start(driver.command(), [0.0, 3.0, 0.0]);
    log.follow_to_force(&observer.driver);
    let former = former.retire();
    // Until the driver has noticed, the lease is in force.
    log.follow(&observer.driver, "the end of the lease and of its force", |told| {
        told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
    });
    log.check_promise(&observer.driver);
    let (stop, writes) = (AtomicBool::new(false), AtomicU64::new(0));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                let lease = former.lease() + writes.fetch_add(1, Ordering::Relaxed) % 2;
                answer(&observer.driver, &former, lease, [0.0, 3.0, 0.0]);
                std::thread::sleep(Duration::from_micros(50));
            }
        });
        let seen = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            // While nobody commands.
            log.forget();
            log.follow_for(&observer.driver, 200);
            log.check_silence_from(0);
            // While somebody else does.
            let successor = Commander::start(driver.command(), [1.0, 0.0, 0.0]);
            log.follow(&observer.driver, "the successor's force", |told| {
                told.iter().filter(|told| told.first_applied_n == [1.0, 0.0, 0.0]).count() > 200
            });
            for told in &log.told {
                let [_, y, z] = told.first_applied_n;
                assert_eq!((y, z), (0.0, 0.0), "{told:?}");
            }
            log.check_promise(&observer.driver);
            drop(successor);
        }));
        stop.store(true, Ordering::Relaxed);
        seen.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
    assert!(writes.load(Ordering::Relaxed) > 100);
    assert_eq!(observer.driver.counters.commands_refused.load(Ordering::Relaxed), 0, "nobody even looked");
}

#[test]
fn what_a_former_holder_writes_is_ignored_in_real_time() {
    a_late_writer("real");
}

#[test]
fn what_a_former_holder_writes_is_ignored_in_lockstep() {
    a_late_writer("lockstep");
}

#[test]
fn a_second_app_is_told_who_commands_and_the_first_goes_on() {
    for clock in ["real", "lockstep"] {
        let mut press = Press::start(clock);
        let holder = press.start_app();
        let mut log = RingLog::begin(&press.observer.driver);
        log.follow_to_force(&press.observer.driver);
        let end = Running::start(press.app().args(["--seconds", "1", "--record", "second.csv"])).end();
        assert_eq!(end.status, Some(2), "{end:?}");
        let message = format!("the devices are commanded by process {} (phantom3) already", holder.id());
        assert!(end.err.contains(&message), "{end:?}");
        assert!(!press.path("second.csv").exists(), "nothing was started");
        let counters = &press.observer.driver.counters;
        assert_eq!(counters.leases_refused.load(Ordering::Relaxed), 1);
        log.follow_to_force(&press.observer.driver);
        press.driver_must_live();
        terminate(holder);
    }
}

/// Reads frames as an observer would that draws them, as fast as it can without starving the others.
fn look_on(driver: &DriverView, stop: &AtomicBool) -> u64 {
    let mut frame = Frame::zeroed();
    let mut read = 0;
    while !stop.load(Ordering::Relaxed) {
        let latest = driver.latest_tick().unwrap_or(0);
        for tick in latest.saturating_sub(5)..=latest {
            if driver.read_frame(tick, &mut frame).is_ok() {
                assert_eq!(frame.tick, tick);
                read += 1;
            }
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    read
}

#[test]
fn any_number_of_observers_disturbs_nobody() {
    const OBSERVERS: usize = 20;
    let mut press = Press::start("lockstep");
    let observers: Vec<_> = (0..OBSERVERS).map(|_| press.driver.observe()).collect();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let looking: Vec<_> = observers.iter().map(|o| scope.spawn(|| look_on(&o.driver, &stop))).collect();
        let seen = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let mut app = Running::start(press.app().args(["--seconds", "10"]));
            // Others come and go meanwhile.
            for _ in 0..10 {
                let end = io_driver(&["status", "--json"], press.driver.socket());
                assert_eq!(end.status, Some(0), "{end:?}");
                let status: serde_json::Value = serde_json::from_str(&end.out).expect("JSON");
                assert_eq!(status["fault"], serde_json::Value::Null);
            }
            app.end()
        }));
        stop.store(true, Ordering::Relaxed);
        let end = seen.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        assert_eq!(end.status, Some(0), "{end:?}");
        for observer in looking {
            assert!(observer.bounded_join().expect("frames are what they should be") > 100);
        }
    });
    let counters = &press.observer.driver.counters;
    let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    // 10 s at 2 kHz, and the ramp: in lockstep every tick is answered.
    assert!(count(&counters.replies_fresh) >= 20_000);
    assert_eq!(count(&counters.replies_missed), 0);
    assert_eq!((count(&counters.commands_torn), count(&counters.commands_refused)), (0, 0));
    assert_eq!((count(&counters.faults), count(&counters.leases_granted)), (0, 1));
    press.driver_must_live();
}

const FORKED: &str = "leases::a_child_that_inherited_the_connection_of_a_dead_parent_does_not_keep_its_lease";

/// Commands, hands its connection down to a child that lives on, and ends.
fn leave_a_child(socket: &str) -> ! {
    use std::io::{Read, Write};
    let mut stream = std::os::unix::net::UnixStream::connect(socket).expect("it listens");
    stream.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Command, "parent"))).expect("it is heard");
    let mut answer = Answer::zeroed();
    stream.read_exact(bytemuck::bytes_of_mut(&mut answer)).expect("an answer");
    assert_eq!((answer.verdict, answer.lease), (Verdict::Granted as u64, 1));
    rustix::io::fcntl_setfd(&stream, rustix::io::FdFlags::empty()).expect("our own");
    let mut sleep = std::process::Command::new("sleep");
    // Nothing of ours but the connection: whoever reads our words waits for their end.
    sleep.arg("100").stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
    let child = sleep.spawn().expect("sleep runs");
    println!("child {}", child.id());
    std::process::exit(0)
}

#[test]
fn a_child_that_inherited_the_connection_of_a_dead_parent_does_not_keep_its_lease() {
    if let Some(socket) = role() {
        leave_a_child(&socket);
    }
    let driver = Driver::start(&system_tests::faults::press::config("real"));
    let socket = driver.socket().to_str().expect("plain").to_owned();
    let end = Running::start(&mut myself(FORKED, &socket)).end();
    assert_eq!(end.status, Some(0), "{end:?}");
    let child = end.out.split("child ").nth(1).and_then(|rest| rest.split_whitespace().next());
    let child: u32 = child.expect("its number").parse().expect("a number");
    assert!(is_alive(child), "it holds the connection");
    // It is refused as long as the lease is held.
    let attachment = driver.command();
    assert!(is_alive(child));
    drop(attachment);
    send(child, rustix::process::Signal::KILL);
}

#[test]
fn a_run_whose_lease_somebody_ended_says_so_and_does_not_come_back() {
    for clock in ["real", "lockstep"] {
        let mut press = Press::start(clock);
        let mut holder = press.start_app();
        let mut log = RingLog::begin(&press.observer.driver);
        log.follow_to_force(&press.observer.driver);
        let asked = io_driver(&["end-lease"], press.driver.socket());
        assert_eq!(asked.status, Some(0), "{asked:?}");
        assert_eq!(asked.out, "lease 1 is ended; its force ramps out\n");
        let end = holder.end();
        assert_eq!(end.status, Some(3), "{end:?}");
        assert!(end.err.contains("this run's lease has ended"), "{end:?}");
        assert!(end.out.contains("replies      "), "its report: {end:?}");
        log.follow(&press.observer.driver, "the end of the lease and of its force", |told| {
            told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
        });
        log.check_promise(&press.observer.driver);
        let asked_again = io_driver(&["end-lease"], press.driver.socket());
        assert_eq!((asked_again.status, &*asked_again.out), (Some(0), "nobody commanded the devices\n"));
        drop(Commander::start(press.driver.command(), [1.0, 0.0, 0.0]));
        press.driver_must_live();
    }
}

/// An application that has force.
fn pushed_app() -> (Press, Running) {
    let press = Press::start("real");
    let holder = press.start_app();
    RingLog::begin(&press.observer.driver).follow_to_force(&press.observer.driver);
    (press, holder)
}

/// A machine that stalls for some tenths of a second as the lease ends: what is there afterwards is the same driver.
#[test]
fn a_run_whose_lease_somebody_ended_does_not_come_back_to_a_driver_that_stood_still_meanwhile() {
    for pause_ms in [1, 2, 3, 4, 6] {
        let (mut press, mut holder) = pushed_app();
        let driver = press.driver.child.id();
        let signal = |signal| send(driver, signal);
        signal(rustix::process::Signal::STOP);
        let socket = press.driver.socket().to_path_buf();
        let asking = std::thread::spawn(move || shm_abi::client::end_lease(&socket, "test"));
        std::thread::sleep(Duration::from_millis(20));
        signal(rustix::process::Signal::CONT);
        // The service thread serves it within a turn of 20 ms; where it stops in between is chance.
        std::thread::sleep(Duration::from_millis(pause_ms));
        signal(rustix::process::Signal::STOP);
        std::thread::sleep(Duration::from_millis(300));
        signal(rustix::process::Signal::CONT);
        asking.bounded_join().expect("no panic").expect("it is granted");
        let end = holder.end();
        assert_eq!(end.status, Some(3), "{pause_ms}: {end:?}");
        assert!(end.err.contains("this run's lease has ended"), "{pause_ms}: {end:?}");
        press.driver_must_live();
    }
}

/// The request is served by a thread of its own; whether the loop took note, a frame tells.
#[test]
fn a_lease_is_not_told_as_ended_before_a_frame_shows_it() {
    let (mut press, mut holder) = pushed_app();
    let driver = press.driver.child.id();
    send(driver, rustix::process::Signal::STOP);
    let asked = io_driver(&["end-lease"], press.driver.socket());
    assert_eq!((asked.status, &*asked.out), (Some(3), ""), "{asked:?}");
    send(driver, rustix::process::Signal::CONT);
    let asked = io_driver(&["end-lease"], press.driver.socket());
    assert_eq!(asked.status, Some(0), "{asked:?}");
    assert_eq!(holder.end().status, Some(3));
    press.driver_must_live();
}

#[test]
fn a_commander_that_was_stopped_is_replaced_on_request() {
    let mut press = Press::start("real");
    let holder = press.start_app();
    let mut log = RingLog::begin(&press.observer.driver);
    log.follow_to_force(&press.observer.driver);
    holder.signal(rustix::process::Signal::STOP);
    let refused = shm_abi::client::command(press.driver.socket(), "newcomer");
    assert!(matches!(refused, Err(shm_abi::client::AttachError::LeaseHeld { .. })), "{refused:?}");
    let end = io_driver(&["end-lease"], press.driver.socket());
    assert_eq!(end.status, Some(0), "{end:?}");
    log.follow(&press.observer.driver, "the end of the lease and of its force", |told| {
        told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
    });
    log.check_promise(&press.observer.driver);
    let newcomer = Commander::start(press.driver.command(), [1.0, 0.0, 0.0]);
    log.follow(&press.observer.driver, "the newcomer's force", |told| {
        told.last().is_some_and(|last| last.first_applied_n == [1.0, 0.0, 0.0])
    });
    drop(newcomer);
    holder.signal(rustix::process::Signal::CONT);
    press.driver_must_live();
}
