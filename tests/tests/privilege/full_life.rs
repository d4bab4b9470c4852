//! Everything that can happen to a driver happens to it under the filter, and what it called meanwhile is on the
//! list: nothing less, and nothing more without a reason.

use io_driver::config::ProcessConfig;
use io_driver::sandbox;
use io_driver::sandbox::allowed_calls::ALLOWED_CALLS;
use patience::prelude::*;
use rustix::process::Signal;
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::{Request, RequestKind};
use std::collections::BTreeSet;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG};
use system_tests::faults::commander::Commander;
use system_tests::faults::hosted::Hosted;
use system_tests::faults::press;
use system_tests::faults::process::{Running, io_driver, myself, role, send};
use system_tests::faults::puppet::{Call, Mood, Strings};
use system_tests::faults::ring::RingLog;
use system_tests::programs;

/// Calls that a life without violence on this kind of machine does not show, and where else they show.
const RARE: &[&str] = &[
    "clock_gettime",   // only where the vDSO cannot read the clock
    "restart_syscall", // only after stop and continue, and not in every kernel
    "pidfd_open",      // only before Linux 6.5
    "sched_yield",     // only when two threads meet
    "writev",          // only when the C library finds the heap corrupted
    "brk",             // depends on how the heap happens to grow
    "mprotect",        // the same for the loop's thread
    "mremap",          // the same for large blocks
    "munmap",
    "madvise",      // depends on the stack of the ending thread
    "write",        // this driver is told to be quiet; that of `rights` talks
    "rmdir",        // only for a driver that an application started as its child
    "unlinkat",     // the same on architectures without rmdir
    "rt_sigaction", // violent ends: `other_violent_ends_are_not_taken_for_forbidden_calls`
    "rt_sigreturn",
    "getpid",
    "gettid",
    "tgkill",
];

/// Clients of all kinds; the driver must outlive them all.
fn live(driver: &mut Driver) {
    let observer = driver.observe();
    let mut log = RingLog::begin(&observer.driver);
    for _ in 0..100 {
        drop(driver.observe());
        drop(driver.command_in_force());
    }
    let commander = Commander::start(driver.command(), [0.0, 3.0, 0.0]);
    log.follow_to_force(&observer.driver);
    be_refused(driver);
    let status = io_driver(&["status", "--json"], driver.socket());
    assert_eq!(status.status, Some(0), "{status:?}");
    for asked in ["emergency-stop", "clear-fault"] {
        let said = io_driver(&[asked], driver.socket());
        assert_eq!(said.status, Some(0), "{asked}: {said:?}");
    }
    // While it is stopped its waits are interrupted, and go on.
    send(driver.child.id(), Signal::STOP);
    send(driver.child.id(), Signal::CONT);
    log.forget();
    log.follow_to_force(&observer.driver);
    drop(commander);
    log.forget();
    log.follow(&observer.driver, "silence", |told| told.last().is_some_and(|told| !told.is_pushing()));
    assert_eq!(driver.child.try_wait().expect("our child"), None, "it lives on");
    assert_eq!(observer.driver.counters.leases_granted.load(Ordering::Relaxed), 101);
}

/// Everybody whom a driver refuses, and some who do not know what they want.
fn be_refused(driver: &Driver) {
    let second = client::command(driver.socket(), "second");
    assert!(matches!(second, Err(AttachError::LeaseHeld { .. })), "{second:?}");
    let good = Request::new(RequestKind::Observe, "liar");
    for lie in
        [Request { magic: 1, ..good }, Request { layout_hash: 1, ..good }, Request { kind: 99, ..good }]
    {
        assert!(client::attach(driver.socket(), &lie).is_err());
    }
    let mut babbler = UnixStream::connect(driver.socket()).expect("it listens");
    let _ = babbler.write_all(&[0; 4096]);
    let crowd: Vec<_> = (0..100).map_while(|_| client::observe(driver.socket(), "crowd").ok()).collect();
    assert!(crowd.len() < 100, "somebody was one too many");
}

#[test]
fn a_driver_lives_through_everything_under_the_filter_and_ends_in_order() {
    for clock in ["real", "lockstep"] {
        let mut driver = Driver::start(&press::config(clock));
        live(&mut driver);
        send(driver.child.id(), Signal::TERM);
        assert_eq!(driver.wait().code(), Some(0), "{clock}");
        assert!(!driver.socket().exists());
    }
}

/// A device that this process simulates moves between the calls and makes none.
const SIMULATED: &str =
    "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\ngravity_compensation = true\n";

#[test]
fn a_driver_that_simulates_its_arms_needs_no_call_that_others_do_not() {
    for clock in ["real", "lockstep"] {
        let mut driver = Driver::start(&format!("{}{}", press::config(clock), SIMULATED.repeat(2)));
        live(&mut driver);
        let frame = driver.observe().driver.read_latest().expect("a frame");
        assert_eq!(frame.device_count, 3);
        send(driver.child.id(), Signal::TERM);
        assert_eq!(driver.wait().code(), Some(0), "{clock}");
    }
}

/// With real-time rights as far as there are any, and told to stop over the socket.
#[test]
fn an_allowed_call_is_one_that_a_driver_makes_or_is_rare_for_a_reason() {
    let directory = tempfile::tempdir().expect("a directory");
    let trace = directory.path().join("trace");
    let Some(command) = traced(&programs::io_driver(), &trace) else { return };
    let config = press::config("real").replace("priority = 0\nlock_memory = false", "priority = 1");
    let mut driver = Driver::start_as(&config, command);
    live(&mut driver);
    assert_eq!(io_driver(&["stop"], driver.socket()).status, Some(0));
    // The tracer, which ends as the traced one does.
    assert_eq!(driver.wait().code(), Some(0));
    let made = calls_under_the_filter(&trace);
    println!("made: {made:?}");
    for call in ALLOWED_CALLS {
        let seen = made.contains(call.name);
        println!("{} {}: {}", if seen { "made" } else { "rare" }, call.name, call.reason);
        assert!(seen || RARE.contains(&call.name), "{} is allowed and neither made nor rare", call.name);
    }
    let unlisted: Vec<_> =
        made.iter().filter(|name| !ALLOWED_CALLS.iter().any(|call| call.name == *name)).collect();
    assert!(unlisted.is_empty(), "{unlisted:?}");
}

fn traced(program: &Command, trace: &Path) -> Option<Command> {
    let tried =
        Command::new("strace").args(["-o", "/dev/null", "true"]).stderr(Stdio::null()).bounded_status();
    if !tried.is_ok_and(|status| status.success()) {
        println!(
            "skipped: there is no strace that may trace; that nothing is missing is tested elsewhere here"
        );
        return None;
    }
    let mut command = Command::new("strace");
    command.args(["-f", "-o"]).arg(trace).arg(program.get_program());
    Some(command)
}

/// Names of the calls after the filter was installed, with the one that installed it left out.
fn calls_under_the_filter(trace: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(trace).expect("a trace");
    let lines = text.lines().skip_while(|line| !line.contains("SECCOMP_SET_MODE_FILTER")).skip(1);
    let call = |line: &str| {
        let behind_thread = line.split_once(' ')?.1.trim_start();
        let name = behind_thread.strip_prefix("<... ").unwrap_or(behind_thread).split(['(', ' ']).next()?;
        name.starts_with(|c: char| c.is_ascii_lowercase()).then(|| name.to_owned())
    };
    lines.filter_map(call).filter(|name| name != "seccomp").collect()
}

const FAULTY_TEST: &str = "full_life::faults_and_panics_of_the_loop_are_dealt_with_under_the_filter";

/// With devices that fail when told to: in a process of its own, which has the filter for good.
#[test]
fn faults_and_panics_of_the_loop_are_dealt_with_under_the_filter() {
    if let Some(mood) = role() {
        play(if mood == "panic" { Mood::PanicsWhenRead } else { Mood::Unreadable });
    }
    for mood in ["fault", "panic"] {
        // It may remove no directory: what it leaves lies in this one.
        let directory = tempfile::tempdir().expect("a directory");
        let mut child = myself(FAULTY_TEST, mood);
        let end = Running::start(child.env("RUST_BACKTRACE", "full").env("TMPDIR", directory.path())).end();
        assert_eq!((end.status, end.signal), (Some(0), None), "{mood}: {end:?}");
        assert_eq!(end.err.contains("a puppet that panics when it is read"), mood == "panic", "{end:?}");
        assert!(!end.err.contains("stack backtrace"), "{end:?}");
    }
}

fn play(mood: Mood) -> ! {
    let strings = Strings::default();
    let hosted =
        Hosted::start("rate_hz = 2000\n[[device]]\nbackend = \"ideal\"\n", vec![strings.device("p", 8.5)]);
    let observer = client::observe(hosted.socket(), "test").expect("it listens");
    let attachment = client::command(hosted.socket(), "test").expect("the lease");
    // The commander's thread too must be there before: none can be started afterwards.
    let _commander = Commander::start(attachment, [0.0, 3.0, 0.0]);
    let mut log = RingLog::begin(&observer.driver);
    log.follow_to_force(&observer.driver);
    sandbox::say_panics_plainly();
    let guarantee = sandbox::shut(&ProcessConfig::default());
    assert!(guarantee.obtained, "{guarantee}");
    log.forget();
    log.follow_to_force(&observer.driver);
    strings.set(mood);
    let begun = Instant::now();
    while strings.last_call() != Some(Call::Release) {
        assert!(begun.elapsed() < HANG, "the motors stay on");
        std::thread::sleep(Duration::from_millis(1));
    }
    // A panic ends the loop; a fault does not.
    log.forget();
    if mood == Mood::Unreadable {
        log.follow_for(&observer.driver, 10);
        log.check_silence_from(log.told.last().map_or(0, |told| told.tick));
    }
    std::process::exit(0)
}
