//! Stops that have to find their driver: a socket of a dead one comes first, nobody says where it is, its file is gone,
//! there are no threads, or the loop waits for somebody who has stopped.

use bytemuck::Zeroable;
use patience::prelude::*;
use rustix::process::Signal;
use shm_abi::{DriverState, FaultReason, Frame, client, stop_socket};
use std::fs::File;
use std::io::Write;
use std::os::unix::net::{UnixDatagram, UnixListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use system_tests::driver::{Driver, resting};
use system_tests::faults::press::Table;
use system_tests::faults::process::{End, Running, io_driver};
use system_tests::programs;
use tempfile::TempDir;

/// Of each thread's stack (bytes): more than any machine has addresses for.
const ENDLESS: &str = "100000000000000";

/// This machine has a driver of its own, which nobody here may stop.
fn has_own_driver() -> bool {
    let socket = Path::new("/run/phantom3/driver.sock");
    let has = socket.exists() || stop_socket::path_beside(socket).exists();
    if has {
        println!("skipped: {} is this machine's", socket.display());
    }
    has
}

/// Two of the usual places, without a driver.
struct Places(TempDir);

impl Places {
    fn new() -> Self {
        let places = Self(tempfile::tempdir().expect("a directory"));
        for place in [places.first(), places.second()] {
            std::fs::create_dir_all(place.parent().expect("a directory")).expect("it is made");
        }
        places
    }

    fn first(&self) -> PathBuf {
        self.0.path().join("service/driver.sock")
    }

    fn second(&self) -> PathBuf {
        self.0.path().join("user/phantom3/driver.sock")
    }

    /// Remains of a driver that is killed.
    fn leave_sockets_of_a_dead_driver(&self) {
        drop(UnixListener::bind(self.first()).expect("a socket"));
        drop(UnixDatagram::bind(stop_socket::path_beside(&self.first())).expect("a socket"));
    }

    /// `io-driver`, which is told no socket.
    fn ask(&self, arguments: &[&str]) -> End {
        self.run(programs::io_driver().args(arguments))
    }

    fn run(&self, command: &mut Command) -> End {
        command.env_remove("PHANTOM3_SOCKET");
        command.env("RUNTIME_DIRECTORY", self.0.path().join("service"));
        command.env("XDG_RUNTIME_DIR", self.0.path().join("user"));
        Running::start(command).end()
    }
}

fn driver_at(socket: PathBuf) -> Driver {
    let nothing = tempfile::tempdir().expect("a directory");
    Driver::start_at(&resting("real", 1), programs::io_driver(), nothing, socket)
}

fn is_stopped(driver: &Driver) -> bool {
    let frame = driver.observe().driver.read_latest().unwrap_or_else(Frame::zeroed);
    frame.state == DriverState::Fault as u64 && frame.fault == FaultReason::EmergencyStop as u64
}

#[test]
fn a_socket_of_a_dead_driver_does_not_keep_a_stop_from_the_one_that_lives() {
    if has_own_driver() {
        return;
    }
    let places = Places::new();
    places.leave_sockets_of_a_dead_driver();
    let mut driver = driver_at(places.second());
    let passed = format!("passed over, left over from one that died: {}", places.first().display());
    let status = places.ask(&["status"]);
    assert!(status.status == Some(0) && status.err.contains(&passed), "{status:?}");
    let table = Table::new();
    let run = places.run(table.app("real").args(["--seconds", "0.2", "--attach"]));
    assert!(run.status == Some(0) && run.err.contains(&passed), "{run:?}");
    let stop = places.ask(&["emergency-stop"]);
    assert_eq!(stop.status, Some(0), "{stop:?}");
    assert!(stop.out.contains(&*places.second().to_string_lossy()), "it says which: {stop:?}");
    assert!(is_stopped(&driver));
    let end = places.ask(&["stop"]);
    assert_eq!(end.status, Some(0), "{end:?}");
    assert_eq!(driver.wait().code(), Some(0));
}

#[test]
fn an_emergency_stop_stops_the_drivers_of_all_places_and_a_stop_names_the_one_that_goes_on() {
    if has_own_driver() {
        return;
    }
    let places = Places::new();
    let (mut first, second) = (driver_at(places.first()), driver_at(places.second()));
    let stop = places.ask(&["emergency-stop"]);
    assert_eq!(stop.status, Some(0), "{stop:?}");
    assert!(is_stopped(&first) && is_stopped(&second), "{stop:?}");
    let end = places.ask(&["stop"]);
    assert_eq!(end.status, Some(0), "{end:?}");
    assert_eq!(first.wait().code(), Some(0));
    let words = format!("another driver, process {}, goes on", second.child.id());
    assert!(end.err.contains(&words), "{end:?}");
}

#[test]
fn a_stop_that_finds_nobody_names_the_drivers_that_live_elsewhere() {
    if has_own_driver() {
        return;
    }
    let places = Places::new();
    places.leave_sockets_of_a_dead_driver();
    let driver = Driver::start(&resting("real", 1));
    let words = format!("process {} is a driver at {}", driver.child.id(), driver.socket().display());
    for command in ["emergency-stop", "stop"] {
        let end = places.ask(&[command]);
        assert_eq!(end.status, Some(3), "{end:?}");
        assert!(end.err.contains(&words) && end.err.contains("the motors may still be on"), "{end:?}");
        // Whoever named another socket is at least told.
        let end = io_driver(&[command], &places.first());
        assert!(end.status == Some(2) && end.err.contains(&words), "{end:?}");
    }
}

#[test]
fn a_driver_whose_sockets_file_is_gone_is_found_however_its_path_is_written() {
    let place = tempfile::tempdir().expect("a directory");
    let directory = place.path().join("here");
    std::fs::create_dir(&directory).expect("a directory");
    std::os::unix::fs::symlink(&directory, place.path().join("link")).expect("a link");
    std::fs::write(place.path().join("driver.toml"), resting("real", 1)).expect("it is written");
    // The driver's own words, relative and absolute.
    for told in [PathBuf::from("link/driver.sock"), directory.join("driver.sock")] {
        let mut command = programs::io_driver();
        command.args(["run", "--quiet", "--config", "driver.toml", "--socket"]).arg(told);
        let mut driver = Running::start(command.current_dir(place.path()));
        let socket = directory.join("driver.sock");
        patience::until("it listens", || client::observe(&socket, "test").is_ok());
        for file in [socket.clone(), stop_socket::path_beside(&socket)] {
            std::fs::rename(&file, file.with_extension("moved")).expect("its file");
        }
        let words = format!("process {} listens there", driver.id());
        let absolute = place.path().join("here/../link/driver.sock");
        for path in ["here/driver.sock", "./link/driver.sock", &absolute.to_string_lossy()] {
            for command in ["emergency-stop", "stop"] {
                let mut asking = programs::io_driver();
                asking.args([command, "--socket", path]).current_dir(place.path());
                let end = Running::start(&mut asking).end();
                driver.must_run();
                assert_eq!(end.status, Some(3), "{path}: {end:?}");
                assert!(end.err.contains(&words), "{path}: {end:?}");
            }
        }
        driver.kill();
        for file in std::fs::read_dir(&directory).expect("a directory").flatten() {
            std::fs::remove_file(file.path()).expect("what it left");
        }
    }
}

/// Anybody may bind a socket that is named by a driver's number, and have it say whatever he likes.
#[test]
fn a_socket_that_a_stranger_names_by_a_drivers_number_is_not_told_as_its() {
    if has_own_driver() {
        return;
    }
    let places = Places::new();
    let driver = Driver::start(&resting("real", 1));
    let elsewhere = tempfile::tempdir().expect("a directory");
    let decoy = elsewhere.path().join("decoy");
    let _decoy = UnixListener::bind(decoy.with_extension(driver.child.id().to_string())).expect("a socket");
    let end = places.ask(&["emergency-stop"]);
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = format!("use --socket {}", driver.socket().display());
    assert!(end.err.contains(&words) && !end.err.contains(&*decoy.to_string_lossy()), "{end:?}");
}

/// A line of the kernel's table says that the driver's socket has another name: of a name with an end of a line in it.
#[test]
fn what_others_write_of_a_drivers_socket_is_not_believed_where_its_own_sockets_tell() {
    if !rustix::process::geteuid().is_root() {
        println!("skipped: sockets of other processes, which need root");
        return;
    }
    let (places, elsewhere) = (Places::new(), tempfile::tempdir().expect("a directory"));
    let driver = driver_at(places.second());
    let name = format!("{}.{}", places.second().display(), driver.child.id());
    let table = std::fs::read_to_string("/proc/net/unix").expect("the table");
    let line =
        table.lines().find(|line| line.ends_with(&name) && line.contains(" 00010000 ")).expect("a line");
    let number = line.split_whitespace().nth(6).expect("a number");
    let forged = format!("x\n0 0 0 10000 0001 0 {number} {}.7", places.first().display());
    let forged = elsewhere.path().join(forged);
    std::fs::create_dir_all(forged.parent().expect("a directory")).expect("it is made");
    let _forged = UnixDatagram::bind(&forged).expect("a socket");
    let end = places.ask(&["emergency-stop"]);
    assert_eq!((end.status, end.err.as_str()), (Some(0), ""), "{end:?}");
    assert!(is_stopped(&driver));
}

/// At another place somebody takes the request, and answers nothing.
#[test]
fn an_emergency_stop_that_one_driver_shows_and_another_does_not_answer_is_not_done() {
    let places = Places::new();
    let driver = driver_at(places.first());
    std::fs::create_dir_all(places.second().parent().expect("a directory")).expect("it is made");
    let _silent = UnixListener::bind(places.second()).expect("a socket");
    let end = places.ask(&["emergency-stop"]);
    assert!(is_stopped(&driver) && end.out.contains("shows the fault and no force"), "{end:?}");
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains(&format!("cut their power ({})", places.second().display())), "{end:?}");
}

/// Whoever looks out of a container sees nobody outside, and has another number there than here.
#[test]
fn a_driver_in_a_container_is_found_by_its_number_here_and_calls_nobody_process_0() {
    let contained = |command: &str| {
        let mut unshare = Command::new("unshare");
        unshare.args(["--user", "--map-root-user", "--pid", "--fork", "--kill-child", command]);
        unshare
    };
    if !contained("true").stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success()) {
        println!("skipped: no namespaces here");
        return;
    }
    let program = programs::io_driver();
    let driver = Driver::start_as(&resting("real", 1), contained(&program.get_program().to_string_lossy()));
    let _commander = driver.command_in_force();
    let refusal = client::command(driver.socket(), "second").expect_err("it is commanded").to_string();
    assert!(refusal.contains("commanded by a process of another PID namespace (test)"), "{refusal}");
    let told = driver.observe().driver_pid;
    for file in [driver.socket().to_path_buf(), stop_socket::path_beside(driver.socket())] {
        std::fs::rename(&file, file.with_extension("moved")).expect("its file");
    }
    let end = io_driver(&["emergency-stop"], driver.socket());
    assert_eq!(end.status, Some(3), "{end:?}");
    let number = end.err.split("but process ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok());
    assert_eq!(number, Some(told), "{end:?}");
    let status = std::fs::read_to_string(format!("/proc/{told}/status")).expect("it lives here");
    assert!(status.contains(&format!("\nNSpid:\t{told}\t")), "{status}");
}

#[test]
fn leaving_a_fault_undoes_no_stop_that_came_after_it_was_typed_however_late_it_gets_through() {
    let driver = Driver::start(&resting("real", 1));
    assert_eq!(io_driver(&["emergency-stop"], driver.socket()).status, Some(0));
    let pid = rustix::process::Pid::from_child(&driver.child);
    rustix::process::kill_process(pid, Signal::STOP).expect("our own child");
    let mut typed = programs::io_driver();
    typed.args(["clear-fault", "--socket"]).arg(driver.socket());
    let mut typed = Running::start(&mut typed);
    let descriptors = format!("/proc/{}/fd", typed.id());
    patience::until("it asks the driver for a place to look from", || {
        let open = std::fs::read_dir(&descriptors).into_iter().flatten().flatten();
        let mut links = open.filter_map(|entry| std::fs::read_link(entry.path()).ok());
        links.any(|link| link.to_string_lossy().starts_with("socket:"))
    });
    stop_socket::send(driver.socket()).expect("it is heard when it goes on");
    rustix::process::kill_process(pid, Signal::CONT).expect("our own child");
    let end = typed.end();
    assert!(end.status == Some(2) && end.err.contains("it heard this too late"), "{end:?}");
    assert!(is_stopped(&driver));
}

/// A pipe that is full, and nobody drains it. Whoever drops its reading end breaks it.
fn full_pipe() -> (Stdio, std::io::PipeReader) {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    let path = format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&writer));
    let flags = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();
    let mut options = File::options();
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, flags);
    let mut filling = options.write(true).open(path).expect("our own");
    while filling.write(b"\n").is_ok() {}
    (writer.into(), reader)
}

/// It tells of the directory that it makes before it has a thread that writes.
#[test]
fn a_driver_that_starts_while_nobody_reads_what_it_says_is_stopped_and_ends_as_any_other() {
    let directory = tempfile::tempdir().expect("a directory");
    let [config, socket, taken] =
        ["driver.toml", "made/driver.sock", "driver.toml/x.sock"].map(|name| directory.path().join(name));
    std::fs::write(&config, resting("real", 1)).expect("room");
    let start = |socket: &Path| {
        let (err, reader) = full_pipe();
        let mut command = programs::io_driver();
        (
            Running::start_saying_to(
                command.arg("run").arg("--config").arg(&config).arg("--socket").arg(socket),
                err,
            ),
            reader,
        )
    };
    let (mut driver, _reader) = start(&socket);
    patience::until("the driver answers", || io_driver(&["status"], &socket).status == Some(0));
    assert_eq!(io_driver(&["emergency-stop"], &socket).status, Some(0));
    driver.signal(Signal::TERM);
    assert_eq!(driver.end().status, Some(0));
    let (mut refused, _reader) = start(&taken);
    assert_eq!(refused.end().status, Some(2));
}

fn without_threads(command: &str, driver: &Driver) -> Command {
    let mut asking = programs::io_driver();
    asking.env("RUST_MIN_STACK", ENDLESS).args([command, "--socket"]).arg(driver.socket());
    asking
}

#[test]
fn a_stop_that_gets_no_thread_asks_before_it_says_a_word() {
    let mut driver = Driver::start(&resting("real", 1));
    let (err, _reader) = full_pipe();
    let _asking = Running::start_saying_to(&mut without_threads("emergency-stop", &driver), err);
    patience::until("the emergency stop", || is_stopped(&driver));
    let end = Running::start(&mut without_threads("stop", &driver)).end();
    assert_eq!(end.status, Some(0), "{end:?}");
    assert!(end.out.contains("the motors were written zero"), "{end:?}");
    assert_eq!(driver.wait().code(), Some(0));
}

/// Stops come faster than a log can be read.
#[test]
fn a_stop_that_stands_is_logged_once_however_often_and_by_whichever_way_it_is_asked_for() {
    let directory = tempfile::tempdir().expect("a directory");
    let [config, socket] = ["driver.toml", "driver.sock"].map(|name| directory.path().join(name));
    std::fs::write(&config, resting("real", 1)).expect("room");
    let mut command = programs::io_driver();
    let mut driver =
        Running::start(command.arg("run").arg("--config").arg(&config).arg("--socket").arg(&socket));
    driver.hear("listening at");
    const TIMES: usize = 3;
    for _ in 0..TIMES {
        for _ in 0..20 {
            // Over a connection, and by datagram.
            assert_eq!(io_driver(&["emergency-stop"], &socket).status, Some(0));
        }
        assert_eq!(io_driver(&["clear-fault"], &socket).status, Some(0));
    }
    assert_eq!(io_driver(&["stop"], &socket).status, Some(0));
    let end = driver.end();
    assert_eq!(end.err.matches("emergency stop, asked for by").count(), TIMES, "{end:?}");
}

/// Nobody answers the loop, so that it tells no newer frame.
#[test]
fn a_second_emergency_stop_of_a_driver_in_lockstep_that_waits_for_its_commander_is_seen() {
    let driver = Driver::start(&resting("lockstep", 1));
    let _silent = driver.command_in_force();
    for _ in 0..2 {
        let end = io_driver(&["emergency-stop"], driver.socket());
        assert_eq!(end.status, Some(0), "{end:?}");
        assert!(end.out.contains("shows the fault and no force"), "{end:?}");
    }
    assert!(is_stopped(&driver));
}

/// A frame that stands in lockstep counts only once the driver has answered.
#[test]
fn a_driver_in_lockstep_that_is_stopped_itself_is_not_believed() {
    let driver = Driver::start(&resting("lockstep", 1));
    let _silent = driver.command_in_force();
    assert_eq!(io_driver(&["emergency-stop"], driver.socket()).status, Some(0));
    let pid = rustix::process::Pid::from_child(&driver.child);
    rustix::process::kill_process(pid, Signal::STOP).expect("our own child");
    let end = io_driver(&["emergency-stop"], driver.socket());
    rustix::process::kill_process(pid, Signal::CONT).expect("our own child");
    assert_eq!(end.status, Some(3), "{end:?}");
}
