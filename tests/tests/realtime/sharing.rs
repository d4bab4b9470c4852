//! Driver and application on one CPU, where a loop that spins would starve the one it waits for.
//!
//! On a machine of several CPUs the programs are confined to one, as `taskset`, a container or a small
//! computer would. Nothing here depends on how fast they are: only that both get on, in every combination of
//! who is confined.

use crate::in_turn;
use patience::prelude::*;
use shm_abi::doorbell::WaitMode;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG, wait_or_kill};
use system_tests::programs;
use system_tests::recording::Table;
use system_tests::threads::{ThreadOf, last_cpu, pinned_to};

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/scenes/default.toml")
}

const TWO_DEVICES: &str = "[[device]]\nbackend = \"ideal\"\n[[device]]\nbackend = \"ideal\"\n";

/// An application that is killed when dropped.
struct Application(Child);

impl Application {
    fn start(driver: &Driver) -> Self {
        let child = programs::phantom3()
            .args(["run", "--attach"])
            .arg(driver.socket())
            .arg(scene())
            .args(["--seconds", "600"])
            .stdout(Stdio::null())
            .spawn();
        Self(child.expect("the application starts"))
    }
}

impl Drop for Application {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// What a driver has counted while so many ticks went by under a lease.
struct Counted {
    ticks: u64,
    fresh: u64,
    /// Replies that took longer than this many nanoseconds.
    slow: Box<dyn Fn(u64) -> u64>,
}

/// Waits for `ticks` more ticks under a lease, once the first have been answered.
fn count(driver: &Driver, ticks: u64) -> Counted {
    let seen = driver.observe();
    let counters = &seen.driver.counters;
    let commanded = || counters.ticks_commanded.load(Ordering::Relaxed);
    let fresh = || counters.replies_fresh.load(Ordering::Relaxed);
    wait_until(|| fresh() > 0);
    let before = (commanded(), fresh(), io_driver::meter::read(&seen.driver.round_trip_ns));
    wait_until(|| commanded() >= before.0 + ticks);
    let counted = (commanded() - before.0, fresh() - before.1);
    let trips = io_driver::meter::since(&before.2, &io_driver::meter::read(&seen.driver.round_trip_ns));
    let slow = move |limit_ns| {
        let first = rt_core::histogram::bucket_of(limit_ns);
        trips.counts()[first..].iter().sum()
    };
    Counted { ticks: counted.0, fresh: counted.1, slow: Box::new(slow) }
}

fn wait_until(condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < HANG, "nothing goes on");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// More than half: whoever is starved by the other, or sleeps through its wake-ups, answers hardly any tick
/// in time, and both programs together need far less than half a tick. A busy machine takes some away.
fn assert_mostly_fresh(what: &str, counted: &Counted) {
    println!("{what}: {} of {} replies in time", counted.fresh, counted.ticks);
    assert!(2 * counted.fresh > counted.ticks, "{what}: {} of {} in time", counted.fresh, counted.ticks);
}

#[test]
fn two_sleeping_programs_on_one_cpu_answer_each_other_in_time() {
    let _turn = in_turn();
    let cpu = last_cpu();
    let config = format!(
        "rate_hz = 4000.0\n[real_time]\npriority = 0\nlock_memory = false\nwait = \"futex\"\n{TWO_DEVICES}"
    );
    pinned_to(cpu, || {
        let driver = Driver::start(&config);
        let _application = Application::start(&driver);
        assert_mostly_fresh("4 kHz on one CPU, both sleeping", &count(&driver, 10_000));
    });
}

/// In lockstep each side sleeps until the other has rung, for ten or twenty milliseconds at most: a wake-up
/// that is lost shows as a tick that took ten or more.
#[test]
fn no_wake_up_is_lost_between_two_programs_on_one_cpu() {
    const NAP_NS: u64 = 10_000_000;
    const TICKS: u64 = 10_000;
    let _turn = in_turn();
    let cpu = last_cpu();
    pinned_to(cpu, || {
        let driver = Driver::start(&format!("clock = \"lockstep\"\n{TWO_DEVICES}"));
        let _application = Application::start(&driver);
        let counted = count(&driver, TICKS);
        // A tick not yet answered may be among them at either end.
        assert!(counted.fresh + 2 >= counted.ticks, "{} of {}", counted.fresh, counted.ticks);
        let slow = (counted.slow)(NAP_NS);
        println!(
            "lockstep on one CPU: {} ticks, {slow} of them longer than {} ms",
            counted.ticks,
            NAP_NS / 1_000_000
        );
        // Both ring twenty thousand times here. Others who want the CPU may take a time slice or two away
        // from a few ticks; losing wake-ups by a race would cost a share of all ticks.
        assert!(slow <= TICKS / 100, "{slow} ticks waited for a time-out");
    });
}

/// The file says which CPU, and it is the only one: with real-time rights, and told to choose for itself,
/// the driver must not spin there.
#[test]
fn a_driver_on_the_only_cpu_sleeps_for_replies_though_it_may_be_real_time() {
    let _turn = in_turn();
    let cpu = last_cpu();
    pinned_to(cpu, || {
        let driver = Driver::start(&format!("[real_time]\ncpu = {cpu}\n{TWO_DEVICES}"));
        assert_eq!(driver.observe().driver.info().wait_mode, WaitMode::Futex);
        let _application = Application::start(&driver);
        assert_mostly_fresh("driver and application confined to one CPU", &count(&driver, 1000));
    });
}

/// A driver without rights that is told to spin costs its CPU and nothing else, while the application has
/// another one.
#[test]
fn an_application_keeps_off_the_cpu_of_a_spinning_driver() {
    let _turn = in_turn();
    let cpu = last_cpu();
    if cpu == 0 {
        println!("skipped: there is one CPU; the same programs are tested on one CPU elsewhere here");
        return;
    }
    let driver = Driver::start(&format!(
        "[real_time]\ncpu = {cpu}\npriority = 0\nlock_memory = false\nwait = \"spin\"\n{TWO_DEVICES}"
    ));
    let _application = Application::start(&driver);
    assert_mostly_fresh("spinning driver, application on another CPU", &count(&driver, 1000));
}

/// With real-time rights the driver would not let the application run at all before its budget ends; without,
/// hardly. It gives up spinning for a second each time that nothing has come for 5 ms.
#[test]
fn an_application_confined_to_a_spinning_drivers_cpu_is_warned_and_answered_for_all_the_same() {
    let _turn = in_turn();
    let cpu = last_cpu();
    for priority in [80, 0] {
        let driver = Driver::start(&format!(
            "[real_time]\ncpu = {cpu}\npriority = {priority}\nlock_memory = false\nwait = \"spin\"\n{TWO_DEVICES}"
        ));
        let mut application = programs::phantom3();
        application.args(["run", "--attach"]).arg(driver.socket()).arg(scene()).args(["--seconds", "3"]);
        let (status, report, error) = pinned_to(cpu, || run_to_its_end(&mut application));
        assert_eq!(status, Some(0), "{error}");
        assert!(error.contains(&format!("spins on CPU {cpu}, the only one open to this program")), "{error}");
        assert_mostly_in_time(&report);
    }
}

/// Stopped by Ctrl-Z or a debugger, say. Spinning until the budget's end, half a tick, and from shortly before
/// the next one, the driver would burn two thirds of its CPU, and of a faster one all.
#[test]
fn a_driver_whose_commander_stalls_stops_spinning_for_it() {
    const TICKS: u64 = 1000;
    const WINDOWS: usize = 6;
    let _turn = in_turn();
    let config = "[real_time]\npriority = 0\nlock_memory = false\nwait = \"spin\"\n";
    let driver = Driver::start(&format!("{config}{TWO_DEVICES}"));
    let thread = ThreadOf::find(driver.child.id(), "driver-loop");
    let stalled = driver.command();
    let ticks = || stalled.driver.counters.ticks.load(Ordering::Relaxed);
    // It answers until one of its answers comes in time, and never again.
    let commander = stalled.commander.as_ref().expect("the lease");
    wait_until(|| {
        let tick = stalled.driver.latest_tick().unwrap_or(0);
        commander.publish(&shm_abi::Command::zero(tick, commander.lease(), 2), &stalled.driver);
        stalled.driver.counters.replies_fresh.load(Ordering::Relaxed) > 0
    });
    let begun = ticks();
    wait_until(|| ticks() > begun + 100);
    // What else the machine does only adds to it.
    let mut least = f64::INFINITY;
    for _ in 0..WINDOWS {
        let (before, Some(cpu_ns)) = (ticks(), thread.cpu_ns()) else {
            println!("skipped: the kernel does not tell how long a thread has run");
            return;
        };
        wait_until(|| ticks() > before + TICKS);
        let cpu_ns = thread.cpu_ns().expect("as before") - cpu_ns;
        least = least.min(cpu_ns as f64 / ((ticks() - before) as f64 * 1e6));
    }
    println!("a stalled commander costs the driver {:.0} % of a CPU", 100.0 * least);
    // At most 15 % are the margin before each tick, and 5 ms of spinning in each second come to it. The
    // whole budget would be 50 %, and more with the margin.
    assert!(least < 0.4, "{least}");
}

/// The first thing that anybody does, on the smallest machine.
#[test]
fn phantom3_without_arguments_runs_on_a_single_cpu() {
    let _turn = in_turn();
    let directory = tempfile::tempdir().expect("a directory");
    let mut application = programs::phantom3();
    application.current_dir(directory.path()).env("PHANTOM3_SOCKET", directory.path().join("nobody.sock"));
    let (status, report, error) = pinned_to(last_cpu(), || run_to_its_end(&mut application));
    assert_eq!(status, Some(0), "{error}");
    let rows = Table::read(&directory.path().join("phantom3-demo.csv")).len();
    // Ten seconds at 1 kHz. A row is a tick that was answered, in time or not.
    assert!(rows > 5_000, "{rows} of 10000 ticks were rendered: {report}");
    assert_mostly_in_time(&report);
}

/// What it said; one that hangs is killed and fails the test.
fn run_to_its_end(application: &mut Command) -> (Option<i32>, String, String) {
    let mut child =
        application.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the application starts");
    // A report is shorter than a pipe is long, so nobody waits for a reader.
    wait_or_kill(&mut child);
    programs::said(&child.bounded_output())
}

/// As [`assert_mostly_fresh`], from the application's report.
fn assert_mostly_in_time(report: &str) {
    let replies = report.lines().find(|line| line.starts_with("replies")).expect("a line about the replies");
    println!("{replies}");
    let numbers: Vec<u64> = replies.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [in_time, missed, ..] = numbers[..] else { panic!("{replies}") };
    assert!(in_time > missed, "most replies come in time: {replies}");
}
