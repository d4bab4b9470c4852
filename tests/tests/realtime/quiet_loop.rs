//! The steady loops ask nothing of the kernel but to be woken: no other system call, no page fault.
//!
//! The driver spins for replies here, as it does on a CPU of its own with real-time rights, though it may
//! have neither: then it is late more often, and what it asks of the kernel is the same.

use crate::in_turn;
use patience::Raised;
use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use shm_abi::client::Attachment;
use shm_abi::{Command, DriverView, doorbell};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command as Process, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG, wait_or_kill};
use system_tests::faults::commander::Commander;
use system_tests::programs;
use system_tests::threads::{PageFaults, ThreadOf};

/// A driver of three resting devices, one of them simulated, that spins for replies, without real-time rights.
const SPINNING: &str = "\
[real_time]
priority = 0
lock_memory = false
wait = \"spin\"
[[device]]
backend = \"ideal\"
[[device]]
backend = \"ideal\"
[[device]]
backend = \"simulated\"
description = \"premium-1.5\"
";

/// Ways in which a commander waits for the next frame.
#[derive(Clone, Copy)]
enum Waits {
    Spinning,
    Asleep,
}

/// Answers every frame until told to stop.
fn answer(attachment: &Attachment, waits: Waits, stop: &AtomicBool) {
    let commander = attachment.commander.as_ref().expect("the lease");
    let mut seen = None;
    while !stop.load(Ordering::Relaxed) {
        let latest = attachment.driver.latest_tick();
        if let Some(tick) = latest.filter(|_| latest != seen) {
            commander.publish(&Command::zero(tick, commander.lease(), 3), &attachment.driver);
            seen = latest;
        }
        match waits {
            Waits::Spinning => std::hint::spin_loop(),
            Waits::Asleep => attachment.driver.sleep_for_frame(seen, commander, Duration::from_millis(5)),
        }
    }
}

/// Runs `f` while somebody commands.
fn with_commander(driver: &Driver, waits: Waits, f: impl FnOnce(&DriverView)) {
    let attachment = driver.command();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // If `f` panics the answering must end too, or the scope never would.
        let _stop_at_the_end = Raised(&stop);
        scope.spawn(|| answer(&attachment, waits, &stop));
        f(&attachment.driver);
    });
}

/// Ticks answered in time.
fn fresh(seen: &DriverView) -> u64 {
    seen.counters.replies_fresh.load(Ordering::Relaxed)
}

/// Ticks done.
fn done(seen: &DriverView) -> u64 {
    seen.counters.ticks.load(Ordering::Relaxed)
}

/// Waits until a count has grown by `more`.
fn wait_for(count: impl Fn() -> u64, more: u64) {
    let (start, begun) = (count(), Instant::now());
    while count() < start + more {
        assert!(begun.elapsed() < HANG, "{} of {more} in {HANG:?}", count() - start);
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Ticks of a window in which something is watched.
const WINDOW: u64 = 2000;

/// Watches the driver for a window. Returns whether it was steady: a driver that gets no reply for 5 ms, which
/// a busy machine brings about, sleeps for replies during the next second instead of spinning.
fn in_a_window(seen: &DriverView, watch: impl FnOnce()) -> bool {
    let missed = || seen.counters.replies_missed.load(Ordering::Relaxed);
    let before = missed();
    // That second, for what may have been before.
    wait_for(|| done(seen), 1100);
    watch();
    missed() - before < 5
}

/// Watches window after window until one was steady, three at most; `check` gets what was seen in each and
/// whether the window was steady.
fn in_steady_windows<T>(seen: &DriverView, watch: impl Fn() -> Option<T>, check: impl Fn(T, bool)) {
    for _ in 0..3 {
        let mut watched = None;
        let is_steady = in_a_window(seen, || watched = watch());
        let Some(watched) = watched else { return };
        check(watched, is_steady);
        if is_steady {
            return;
        }
    }
    println!("the machine is too busy for a steady window: what follows a missed reply was allowed for");
}

#[test]
fn in_spin_mode_the_timed_wait_is_the_drivers_only_system_call() {
    let _turn = in_turn();
    let driver = Driver::start(SPINNING);
    let thread = ThreadOf::find(driver.child.id(), "driver-loop");
    with_commander(&driver, Waits::Spinning, |seen| {
        check_calls("commanded", thread.tid, seen, &["clock_nanosleep"]);
    });
    let seen = driver.observe().driver;
    check_calls("idle", thread.tid, &seen, &["clock_nanosleep"]);
}

/// Whoever sleeps or wakes by futex waits for all sleepers in the same bucket of the kernel's table, of whatever process.
#[test]
fn the_loop_neither_sleeps_nor_wakes_a_commander_by_futex() {
    let _turn = in_turn();
    let driver = Driver::start(&SPINNING.replace("\"spin\"", "\"futex\""));
    let thread = ThreadOf::find(driver.child.id(), "driver-loop");
    with_commander(&driver, Waits::Asleep, |seen| {
        check_calls("before one that sleeps", thread.tid, seen, &["clock_nanosleep", "write"]);
    });
}

/// With rights it sleeps until shortly before the frame is due, else on the doorbell; and it wakes the
/// driver where that sleeps.
#[test]
fn the_applications_fast_thread_calls_nothing_but_waits_and_wakes() {
    let _turn = in_turn();
    let (driver, mut phantom3) = both_programs(true, IDEAL);
    let thread = ThreadOf::find(phantom3.id(), "fast");
    let seen = driver.observe().driver;
    wait_for(|| fresh(&seen), 100);
    check_calls("fast thread", thread.tid, &seen, &["clock_nanosleep", "futex"]);
    phantom3.end();
}

/// Traces a thread while the driver does a window of ticks.
fn check_calls(what: &str, tid: u32, seen: &DriverView, allowed: &[&str]) {
    let watch = || {
        let directory = tempfile::tempdir().expect("a directory");
        let trace = directory.path().join("trace");
        let mut strace = attach_strace(tid, &trace)?;
        wait_for(|| done(seen), WINDOW);
        detach_strace(&mut strace);
        Some(calls_in(&trace))
    };
    in_steady_windows(seen, watch, |calls, _| {
        println!("{what}: system calls in some {WINDOW} ticks: {calls:?}");
        // A tick that is late by most of a period does not sleep; being traced costs 50 us and more each.
        assert!(calls.values().sum::<u64>() > WINDOW / 10, "strace did not watch: {calls:?}");
        assert!(
            calls.keys().all(|name| allowed.contains(&name.as_str())),
            "{what}: beside {allowed:?}: {calls:?}"
        );
    });
}

/// `None`, and why, where nothing can be traced.
fn attach_strace(tid: u32, trace: &Path) -> Option<Child> {
    let strace = Process::new("strace")
        .arg("-o")
        .arg(trace)
        .args(["-p", &tid.to_string()])
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut strace) = strace else {
        println!("skipped: strace is not installed; the kernel's own counters are tested elsewhere here");
        return None;
    };
    let begun = Instant::now();
    while std::fs::metadata(trace).map_or(0, |file| file.len()) == 0 {
        if strace.try_wait().expect("our child").is_some() {
            println!("skipped: strace may not trace; the kernel's own counters are tested elsewhere here");
            return None;
        }
        assert!(begun.elapsed() < HANG, "strace sees nothing");
        std::thread::sleep(Duration::from_millis(5));
    }
    Some(strace)
}

fn detach_strace(strace: &mut Child) {
    kill_process(Pid::from_child(strace), Signal::INT).expect("our child");
    wait_or_kill(strace);
}

/// How often each system call stands in a trace; the last line may be cut. The call that attaching
/// interrupted is gone on with by the kernel under the name `restart_syscall`: it is none of the thread's own.
fn calls_in(trace: &Path) -> BTreeMap<String, u64> {
    let mut calls = BTreeMap::new();
    for line in std::fs::read_to_string(trace).expect("a trace").lines() {
        if let Some((name, _)) = line.split_once('(').filter(|(name, _)| *name != "restart_syscall") {
            *calls.entry(name.to_owned()).or_insert(0) += 1;
        }
    }
    calls
}

#[test]
fn in_spin_mode_the_driver_sleeps_once_a_tick_and_neither_reads_nor_writes() {
    let _turn = in_turn();
    let driver = Driver::start(SPINNING);
    let thread = ThreadOf::find(driver.child.id(), "driver-loop");
    with_commander(&driver, Waits::Spinning, |seen| {
        let watch = || {
            let (sleeps, io, ticks) = (thread.sleeps(), thread.reads_and_writes(), done(seen));
            wait_for(|| done(seen), WINDOW);
            assert_eq!(thread.reads_and_writes(), io, "it read or wrote a file");
            Some((thread.sleeps() - sleeps, done(seen) - ticks))
        };
        in_steady_windows(seen, watch, |(sleeps, ticks), is_steady| {
            println!("{sleeps} sleeps in {ticks} ticks");
            // One more or less at either end, where the counters are not read at the same moment.
            assert!(!is_steady || sleeps <= ticks + 2, "something beside the timed wait sleeps");
        });
    });
}

/// Where it blocks, it blocks in one and the same system call.
#[test]
fn in_spin_mode_the_driver_blocks_in_no_other_call_than_the_timed_wait() {
    let _turn = in_turn();
    let driver = Driver::start(SPINNING);
    let thread = ThreadOf::find(driver.child.id(), "driver-loop");
    let mut blocked = BTreeMap::new();
    // Without a commander the loop sleeps most of the time: each sample is a fair one.
    let begun = Instant::now();
    while blocked.values().sum::<u64>() < 500 && begun.elapsed() < HANG / 10 {
        if let Some(call) = thread.blocked_in() {
            *blocked.entry(call).or_insert(0) += 1;
        }
        std::thread::sleep(Duration::from_micros(313));
    }
    if blocked.is_empty() {
        println!("skipped: the kernel does not tell in which call a thread is blocked");
        return;
    }
    println!("blocked in (number of the call: samples): {blocked:?}");
    assert_eq!(blocked.len(), 1, "{blocked:?}");
}

/// A fast thread that always finds the next frame there must look at requests to stop all the same.
#[test]
fn a_run_ends_when_asked_though_every_frame_comes_in_time() {
    let _turn = in_turn();
    let (driver, mut phantom3) = both_programs(true, IDEAL);
    let seen = driver.observe().driver;
    wait_for(|| fresh(&seen), 500);
    let before = fresh(&seen);
    kill_process(Pid::from_child(&phantom3), Signal::TERM).expect("our child");
    assert_eq!(wait_or_kill(&mut phantom3).code(), Some(128 + Signal::TERM.as_raw()));
    let after = fresh(&seen) - before;
    println!("{after} ticks were answered after the signal");
    // The slow thread looks every 10 ms, which is ten ticks, and gets the CPU within some more on a busy
    // machine.
    assert!(after < 500, "{after} ticks were still answered");
}

/// Both programs as they are used, with locked memory if the machine allows it.
#[test]
fn the_loops_of_both_programs_fault_no_page_once_warm() {
    let _turn = in_turn();
    for (lock, backend) in [(true, IDEAL), (false, IDEAL), (true, SIMULATED), (false, SIMULATED)] {
        let (driver, mut phantom3) = both_programs(lock, backend);
        let threads =
            [ThreadOf::find(driver.child.id(), "driver-loop"), ThreadOf::find(phantom3.id(), "fast")];
        let seen = driver.observe().driver;
        wait_for(|| fresh(&seen), 1000);
        for thread in &threads {
            check_that_nothing_faults(thread, || fresh(&seen));
        }
        phantom3.end();
    }
}

/// Observers that sleep on the bell that all share, as any process that looks on may.
const SLEEPERS: usize = 200;

/// Neither frames nor commands wake them: a wake of as many would take the loop, which rings, hundreds of microseconds.
#[test]
fn a_crowd_asleep_on_the_shared_bell_is_never_woken_and_the_loop_faults_no_page() {
    let _turn = in_turn();
    let driver = Driver::start(&format!(
        "[real_time]\nlock_memory = false\nwait = \"futex\"\n[[device]]\n{IDEAL}\n[[device]]\n{IDEAL}\n"
    ));
    let seen = driver.observe().driver;
    // It sleeps for every frame, so that the loop has somebody to wake in each tick.
    let commander = Commander::start(driver.command(), [0.0; 3]);
    wait_for(|| fresh(&seen), 1000);
    let (begun, woken) = (AtomicUsize::new(0), AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for _ in 0..SLEEPERS {
            scope.spawn(|| sleep_on(&seen.bell.doorbell, &begun, &woken));
        }
        patience::until("they sleep", || begun.load(Ordering::Relaxed) == SLEEPERS);
        // From there to the kernel's queue. If this is too short, the last line fails.
        std::thread::sleep(Duration::from_millis(500));
        let unheard = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let before = fresh(&seen);
            check_that_nothing_faults(&ThreadOf::find(driver.child.id(), "driver-loop"), || fresh(&seen));
            assert!(fresh(&seen) > before, "commands go on");
            woken.load(Ordering::Relaxed)
        }));
        // All of them, still: nobody has woken any, and they end.
        let asleep = doorbell::wake(&seen.bell);
        assert_eq!(unheard.unwrap_or_else(|panic| std::panic::resume_unwind(panic)), 0, "were woken");
        assert_eq!(asleep, SLEEPERS, "slept to the end");
    });
    drop(commander);
}

/// Sleeps there once, for as long as it takes somebody to wake it.
fn sleep_on(word: &AtomicU32, begun: &AtomicUsize, woken: &AtomicUsize) {
    use rustix::thread::{Timespec, futex};
    // Longer than the test.
    let timeout = Timespec { tv_sec: HANG.as_secs().cast_signed(), tv_nsec: 0 };
    begun.fetch_add(1, Ordering::Relaxed);
    // The word changes with every frame: whoever has read it before that one asks again.
    while futex::wait(word, futex::Flags::empty(), word.load(Ordering::Relaxed), Some(&timeout))
        == Err(rustix::io::Errno::AGAIN)
    {}
    woken.fetch_add(1, Ordering::Relaxed);
}

const IDEAL: &str = "backend = \"ideal\"";
const SIMULATED: &str = "backend = \"simulated\"\ndescription = \"premium-1.5\"\ngravity_compensation = true";

/// The default scene and hand, with as much of the usual set-up as there are rights for.
fn both_programs(lock: bool, backend: &str) -> (Driver, Child) {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let hand = config.join("hands/default.csv");
    let device = format!("[[device]]\n{backend}\nhand = {:?}\n", hand.to_str().expect("UTF-8"));
    let driver = Driver::start(&format!("[real_time]\nlock_memory = {lock}\n{}", device.repeat(2)));
    let phantom3 = programs::phantom3()
        .args(["run", "--attach"])
        .arg(driver.socket())
        .arg(config.join("scenes/default.toml"))
        .args(["--seconds", "600"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    (driver, phantom3.expect("the application starts"))
}

/// With locked memory no page may fault. Without, a page may be taken away and come back: once, not in
/// each of three windows as a loop's own fault does.
fn check_that_nothing_faults(thread: &ThreadOf, ticks: impl Fn() -> u64) {
    let locked = thread.locked_kib() > 0;
    if !locked {
        println!("memory is not locked: one quiet window of three will do");
    }
    let mut windows = Vec::new();
    for _ in 0..if locked { 1 } else { 3 } {
        let before = thread.page_faults();
        wait_for(&ticks, WINDOW);
        let after = thread.page_faults();
        windows.push(PageFaults { minor: after.minor - before.minor, major: after.major - before.major });
        if windows.last() == Some(&PageFaults { minor: 0, major: 0 }) {
            println!("thread {}, locked {locked}: no page fault in {WINDOW} ticks", thread.tid);
            return;
        }
    }
    panic!("page faults in windows of {WINDOW} ticks, locked {locked}: {windows:?}");
}
