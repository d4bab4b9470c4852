//! What the running driver may still do, by the kernel's word about each of its threads.
//!
//! However it got its real-time rights (root, capabilities, limits, not at all), it keeps no capability, and
//! everything that it has to do later works without.

use patience::prelude::*;
use rustix::process::Signal;
use shm_abi::segment::ClockMode;
use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::Ordering;
use system_tests::driver::{Driver, HANG};
use system_tests::faults::commander::Commander;
use system_tests::faults::process::{Running, is_alive, myself, role, send};
use system_tests::faults::ring::RingLog;
use system_tests::programs::{io_driver, said};
use system_tests::strangers::{NOBODY, Stranger, can_be_others, directory_of_nobody, open_directory};

/// A driver that asks for everything it can ask for, and uses as little of the machine as possible.
const ASKING: &str = "[real_time]\npriority = 1\nlock_memory = true\n";
const DEVICE: &str = "[[device]]\nbackend = \"ideal\"\npeak_force_n = 8.5\n";

fn asking(process: &str) -> String {
    format!("{ASKING}{process}{DEVICE}")
}

type Status = BTreeMap<String, String>;

/// `/proc/PID/task/*/status`.
fn threads_of(pid: u32) -> Vec<Status> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).expect("it lives");
    let read = |path: &Path| std::fs::read_to_string(path.join("status")).expect("readable for everybody");
    let parse = |text: String| {
        let fields = text.lines().filter_map(|line| line.split_once(':'));
        fields.map(|(key, value)| (key.to_owned(), value.trim().to_owned())).collect()
    };
    tasks.flatten().map(|task| parse(read(&task.path()))).collect()
}

fn check_rights(driver: &Driver) {
    let threads = threads_of(driver.child.id());
    // The main thread, which serves, has the program's name.
    let others = threads.iter().filter(|status| status["Pid"] != status["Tgid"]);
    let names: BTreeSet<_> = others.map(|status| status["Name"].as_str()).collect();
    let mut expected = BTreeSet::from(["driver-loop", "log", "sealer", "stop", "stops-taken"]);
    // Without deadlines the loop wakes commanders itself.
    if driver.observe().driver.info().clock_mode == ClockMode::Real {
        expected.insert("bell");
    }
    assert_eq!(names, expected);
    for status in threads {
        for set in ["CapInh", "CapPrm", "CapEff", "CapAmb"] {
            assert_eq!(status[set], "0000000000000000", "{set} of {}", status["Name"]);
        }
        assert_eq!(
            (status["NoNewPrivs"].as_str(), status["Seccomp"].as_str()),
            ("1", "2"),
            "{}",
            status["Name"]
        );
    }
    let report = driver.observe().driver.info().setup_report;
    assert!(report.contains("  obtained  privileges: no capability, no new ones, user "), "{report}");
    assert!(report.contains("  obtained  system calls: "), "{report}");
}

/// As many as a laboratory's day: each is a fresh memory file that is mapped, used and unmapped.
fn check_leases(driver: &Driver, count: u64) {
    let observer = driver.observe();
    for _ in 0..count {
        drop(driver.command_in_force());
    }
    let _commander = Commander::start(driver.command(), [0.0, 3.0, 0.0]);
    let mut log = RingLog::begin(&observer.driver);
    log.follow_to_force(&observer.driver);
    assert_eq!(observer.driver.counters.leases_granted.load(Ordering::Relaxed), count + 1);
}

fn item<'a>(report: &'a str, name: &str) -> &'a str {
    report.lines().find(|line| line.contains(&format!("{name}: "))).unwrap_or("")
}

#[test]
fn a_running_driver_has_no_capability_and_can_get_none() {
    for config in [asking(""), format!("clock = \"lockstep\"\n{DEVICE}")] {
        let driver = Driver::start(&config);
        check_rights(&driver);
        if rustix::process::geteuid().is_root() {
            assert!(
                threads_of(driver.child.id()).iter().all(|status| status["CapBnd"] == "0000000000000000")
            );
        }
    }
}

/// Without the sandbox too.
#[test]
fn a_driver_without_sandbox_has_no_capability_either() {
    let driver = Driver::start(&asking("[process]\nsandbox = false\n"));
    for status in threads_of(driver.child.id()) {
        assert_eq!((status["CapPrm"].as_str(), status["NoNewPrivs"].as_str()), ("0000000000000000", "1"));
        assert_eq!(status["Seccomp"], "0");
    }
}

/// Locked memory counts against a limit once the capability is gone.
#[test]
fn hundreds_of_leases_in_a_row_find_memory_without_the_capability_to_lock_it() {
    let driver = Driver::start(&asking(""));
    let report = driver.observe().driver.info().setup_report;
    println!("{}\n{}", item(&report, "memory locked"), item(&report, "later memory locked"));
    check_leases(&driver, 300);
}

/// Real-time priority and scheduling policy (1: SCHED_FIFO) of the thread of this name.
fn policy_of(process: u32, name: &str) -> Option<[u64; 2]> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).ok()?;
    threads.flatten().find_map(|thread| {
        let stat = std::fs::read_to_string(thread.path().join("stat")).ok()?;
        let (_, rest) = stat.split_once(&format!("({name}) "))?;
        // proc(5): behind the name comes the third field.
        let fields: Vec<&str> = rest.split_whitespace().collect();
        Some([fields.get(37)?.parse().ok()?, fields.get(38)?.parse().ok()?])
    })
}

/// Ordinary threads wait for those of real time on all CPUs: the thread that takes stops is none, unlike the service.
fn check_stops_are_real_time(driver: &Driver) {
    let process = driver.child.id();
    let report = driver.observe().driver.info().setup_report;
    assert!(report.contains("obtained  stops: SCHED_FIFO 1\n"), "{report}");
    assert_eq!(policy_of(process, "stop"), Some([1, 1]));
    let name = std::fs::read_to_string(format!("/proc/{process}/comm")).expect("it lives");
    assert_eq!(policy_of(process, name.trim_end()), Some([0, 0]));
}

/// As after `setcap`, or with AmbientCapabilities= in a systemd unit.
#[test]
fn capabilities_give_real_time_and_are_given_up() {
    if !can_be_others() {
        return;
    }
    let stranger = Stranger::of(Path::new(io_driver().get_program()));
    let directory = directory_of_nobody();
    let socket = directory.path().join("driver.sock");
    let command = stranger.command(&["sys_nice", "ipc_lock"]);
    let driver = Driver::start_at(&asking(""), command, directory, socket);
    check_rights(&driver);
    let report = driver.observe().driver.info().setup_report;
    assert!(report.contains("obtained  scheduling: SCHED_FIFO 1"), "{report}");
    assert!(report.contains("obtained  memory locked: "), "{report}");
    check_stops_are_real_time(&driver);
    assert!(threads_of(driver.child.id()).iter().all(|status| status["Uid"].starts_with("65534")));
    check_leases(&driver, 300);
}

/// Where the limits can be raised they give real time too; where not, it runs without.
#[test]
fn a_driver_that_never_had_a_capability_runs_by_its_limits() {
    if !can_be_others() {
        return;
    }
    let stranger = Stranger::of(Path::new(io_driver().get_program()));
    let plain = stranger.command(&[]);
    let mut limited = std::process::Command::new("prlimit");
    limited.args(["--rtprio=1:1", "--memlock=unlimited:unlimited", "--"]);
    limited.arg(plain.get_program()).args(plain.get_args()).current_dir("/");
    let raises = std::process::Command::new("prlimit")
        .args(["--rtprio=1:1", "--memlock=unlimited:unlimited", "--", "true"])
        .stderr(Stdio::null())
        .bounded_status()
        .is_ok_and(|status| status.success());
    let directory = directory_of_nobody();
    let socket = directory.path().join("driver.sock");
    let driver = Driver::start_at(&asking(""), if raises { limited } else { plain }, directory, socket);
    check_rights(&driver);
    let report = driver.observe().driver.info().setup_report;
    if raises {
        assert!(report.contains("obtained  scheduling: SCHED_FIFO 1"), "{report}");
        assert!(report.contains("obtained  memory locked: "), "{report}");
        check_stops_are_real_time(&driver);
    } else {
        println!(
            "skipped: this machine does not let root raise limits; it runs without real-time rights instead"
        );
        assert!(report.contains("MISSING   scheduling: "), "{report}");
    }
    check_leases(&driver, 300);
}

#[test]
fn a_driver_started_by_root_becomes_the_user_that_it_is_told() {
    if !can_be_others() {
        return;
    }
    let directory = open_directory();
    // Below a directory that only root may write to: the driver makes its own and gives it to the user.
    let socket = directory.path().join("made/driver.sock");
    let mut driver =
        Driver::start_at(&asking("[process]\nuser = \"65534:65534\"\n"), io_driver(), directory, socket);
    check_rights(&driver);
    for status in threads_of(driver.child.id()) {
        let ids = ["65534"; 4].join("\t");
        assert_eq!((&status["Uid"], &status["Gid"], status["Groups"].as_str()), (&ids, &ids, "65534"));
    }
    let report = driver.observe().driver.info().setup_report;
    assert!(report.contains("privileges: no capability, no new ones, user 65534\n"), "{report}");
    assert!(report.contains("obtained  memory locked: "), "{report}");
    check_stops_are_real_time(&driver);
    let owner = |path: &Path| path.metadata().map(|meta| (meta.uid(), meta.gid())).expect("there");
    assert_eq!(owner(driver.socket()), (NOBODY, NOBODY));
    assert_eq!(owner(driver.socket().parent().expect("a directory")), (NOBODY, NOBODY));
    check_leases(&driver, 100);
    send(driver.child.id(), Signal::TERM);
    assert_eq!(driver.wait().code(), Some(0));
    assert!(!driver.socket().exists(), "it may remove its socket");
}

#[test]
fn a_user_that_cannot_be_had_is_refused_before_anything_is_started() {
    let refusal = |user: &str, command: std::process::Command| {
        let directory = open_directory();
        let config = directory.path().join("driver.toml");
        std::fs::write(&config, asking(&format!("[process]\nuser = \"{user}\"\n"))).expect("written");
        let socket = directory.path().join("made/driver.sock");
        let mut command = command;
        command.args(["run", "--quiet", "--config"]).arg(&config).arg("--socket").arg(&socket);
        let (status, _, err) = said(&command.bounded_output().expect("it runs"));
        assert_eq!(status, Some(2), "{err}");
        assert!(!socket.exists());
        err
    };
    let unknown = refusal("no such user", io_driver());
    assert!(
        unknown.starts_with("io-driver: `user` in [process]: there is no user \"no such user\""),
        "{unknown}"
    );
    assert!(
        refusal("root", io_driver())
            .contains("\"root\" is root, and running as root is what this is to avoid")
    );
    let without_rights = if can_be_others() {
        let stranger = Stranger::of(Path::new(io_driver().get_program()));
        refusal("4711:4711", stranger.command(&[]))
    } else if rustix::process::geteuid().is_root() {
        return;
    } else {
        refusal("4711:4711", io_driver())
    };
    assert!(
        without_rights.contains("cannot become user \"4711:4711\" (uid 4711, gid 4711)"),
        "{without_rights}"
    );
}

#[test]
fn root_without_a_user_is_told_so_in_one_line() {
    if !rustix::process::geteuid().is_root() {
        println!("skipped: this is not root");
        return;
    }
    let directory = open_directory();
    let config = directory.path().join("driver.toml");
    std::fs::write(&config, format!("clock = \"lockstep\"\n{DEVICE}")).expect("written");
    let mut command = io_driver();
    command.args(["run", "--config"]).arg(&config).arg("--socket").arg(directory.path().join("driver.sock"));
    let mut driver = Running::start(&mut command);
    driver.hear("listening at ");
    driver.signal(Signal::TERM);
    let end = driver.end();
    let lines: Vec<_> = end.err.lines().filter(|line| line.contains("root")).collect();
    let warnings = lines.iter().filter(|line| line.contains("started as root")).count();
    assert_eq!(warnings, 1, "{end:?}");
}

const PARENT_TEST: &str = "rights::a_driver_that_changed_its_user_still_ends_with_its_parent";

/// The kernel forgets that request when the user changes.
#[test]
fn a_driver_that_changed_its_user_still_ends_with_its_parent() {
    if role().is_some() {
        play_parent();
    }
    if !can_be_others() {
        return;
    }
    let mut parent = Running::start(&mut myself(PARENT_TEST, "parent"));
    parent.hear("driver is up: ");
    parent.signal(Signal::KILL);
    let end = parent.end();
    let line = end.err.lines().find_map(|line| line.strip_prefix("driver is up: ")).expect("heard");
    let driver: u32 = line.parse().expect("a process id");
    let begun = std::time::Instant::now();
    while is_alive(driver) {
        if begun.elapsed() > HANG {
            send(driver, Signal::KILL);
            panic!("the driver outlives its parent");
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

fn play_parent() -> ! {
    let directory = open_directory();
    let socket = directory.path().join("made/driver.sock");
    let config = directory.path().join("driver.toml");
    std::fs::write(&config, asking("[process]\nuser = \"65534:65534\"\n")).expect("written");
    let mut command = io_driver();
    command.args(["run", "--quiet", "--parent", &std::process::id().to_string(), "--config"]).arg(&config);
    // Its end must not hold the pipes that the test reads.
    command.arg("--socket").arg(&socket).stdout(Stdio::null()).stderr(Stdio::null());
    let driver = command.spawn().expect("it starts");
    patience::until("the driver", || shm_abi::client::observe(&socket, "parent").is_ok());
    // What is killed cannot tidy up.
    drop(directory);
    // In one piece.
    io_driver::say::say(format_args!("driver is up: {}", driver.id()));
    std::thread::sleep(HANG);
    std::process::exit(1)
}
