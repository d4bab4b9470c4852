//! Another user of the machine gets nothing of the driver: not its socket, not its memory, not its life.

use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use system_tests::driver::{Driver, resting};
use system_tests::faults::process::{End, Running, role};
use system_tests::programs::io_driver;
use system_tests::strangers::{Stranger, can_be_others, directory_of_nobody, open_directory};

const TEST: &str = "strangers::another_user_gets_nothing_of_the_driver";

/// The driver as root and as an ordinary user; the stranger is another ordinary one.
#[test]
fn another_user_gets_nothing_of_the_driver() {
    if let Some(role) = role() {
        play(&role);
    }
    if !can_be_others() {
        return;
    }
    let thief = Stranger::of(&std::env::current_exe().expect("own path"));
    let roots = Driver::start(&resting("real", 1));
    let open = open_directory();
    let socket = open.path().join("driver.sock");
    // Everybody may go as far as to the socket's name.
    let roots_in_the_open = Driver::start_at(&resting("real", 1), io_driver(), open, socket);
    for driver in [&roots, &roots_in_the_open] {
        check(&thief, driver);
    }
    // An ordinary user's, whose directory is that user's alone.
    let config = resting("real", 1).replace("[real_time]", "[process]\nuser = \"4711:4711\"\n[real_time]");
    let directory = open_directory();
    let socket = directory.path().join("made/driver.sock");
    check(&thief, &Driver::start_at(&config, io_driver(), directory, socket));
}

fn check(thief: &Stranger, driver: &Driver) {
    let observer = driver.observe();
    // An address in the driver that can be read: its own stack's line in its map.
    let maps = std::fs::read_to_string(format!("/proc/{}/maps", driver.child.id())).unwrap_or_default();
    let stack = maps.lines().find(|line| line.ends_with("[stack]")).and_then(|line| line.split('-').next());
    let address = stack.unwrap_or("0");
    let target = format!("{} {address} {}", driver.child.id(), driver.socket().display());
    let mut command = thief.with(["--exact", TEST, "--nocapture", "--test-threads", "1"]);
    let end = Running::start(command.env("PHANTOM3_TEST_ROLE", target)).end();
    assert_eq!(end.status, Some(0), "{end:?}");
    assert_eq!(end.out.matches("refused: ").count(), ATTEMPTS, "{end:?}");
    drop(observer);
    driver.observe();
}

const ATTEMPTS: usize = 11;

fn play(target: &str) -> ! {
    let mut words = target.splitn(3, ' ');
    let pid: u32 = words.next().expect("a process").parse().expect("its id");
    let address = usize::from_str_radix(words.next().expect("an address"), 16).expect("in hexadecimal");
    let socket = PathBuf::from(words.next().expect("a socket"));
    let attempts: [(&str, std::io::Result<()>); ATTEMPTS] = [
        ("connect", UnixStream::connect(&socket).map(drop)),
        ("remove the socket", std::fs::remove_file(&socket)),
        ("open the lock", File::open(socket.with_extension("sock.lock")).map(drop)),
        ("list its files", std::fs::read_dir(format!("/proc/{pid}/fd")).map(drop)),
        ("open its memory file", open_writable(&format!("/proc/{pid}/fd/4"))),
        ("open its memory", File::open(format!("/proc/{pid}/mem")).map(drop)),
        ("see its map", std::fs::read(format!("/proc/{pid}/maps")).map(drop)),
        ("reach its mappings", std::fs::read_dir(format!("/proc/{pid}/map_files")).map(drop)),
        ("read its memory", read_memory(pid, address)),
        ("trace it", attach(pid)),
        (
            "stop it",
            kill_process(Pid::from_raw(pid.cast_signed()).expect("an id"), Signal::STOP).map_err(Into::into),
        ),
    ];
    for (what, result) in attempts {
        match result {
            Err(error) if is_refusal(&error) => println!("\nrefused: {what}: {error}"),
            other => println!("\ngranted: {what}: {other:?}"),
        }
    }
    std::process::exit(0)
}

/// Not a failure for another reason.
fn is_refusal(error: &std::io::Error) -> bool {
    matches!(error.raw_os_error(), Some(libc::EPERM | libc::EACCES))
}

fn open_writable(path: &str) -> std::io::Result<()> {
    File::options().read(true).write(true).open(path).map(drop)
}

fn read_memory(pid: u32, address: usize) -> std::io::Result<()> {
    let mut byte = [0_u8];
    let here = libc::iovec { iov_base: byte.as_mut_ptr().cast(), iov_len: 1 };
    let there = libc::iovec { iov_base: std::ptr::without_provenance_mut(address), iov_len: 1 };
    // SAFETY: one byte of ours is written; the other address is only looked at in the other process.
    let read =
        unsafe { libc::process_vm_readv(pid.cast_signed(), &raw const here, 1, &raw const there, 1, 0) };
    if read < 0 { Err(std::io::Error::last_os_error()) } else { Ok(()) }
}

fn attach(pid: u32) -> std::io::Result<()> {
    let none = std::ptr::null_mut::<libc::c_void>();
    // SAFETY: touches no memory of ours.
    let result = unsafe { libc::ptrace(libc::PTRACE_ATTACH, pid.cast_signed(), none, none) };
    if result < 0 { Err(std::io::Error::last_os_error()) } else { Ok(()) }
}

/// What keeps others out, looked at by whoever runs the tests.
#[test]
fn the_drivers_files_are_closed_to_others() {
    let driver = Driver::start(&resting("real", 1));
    let mode = |path: &Path| path.metadata().expect("there").permissions().mode() & 0o7777;
    assert_eq!(mode(driver.socket()) & 0o007, 0);
    assert_eq!(mode(&driver.socket().with_extension("sock.lock")) & 0o077, 0);
    for (file, others) in [("mem", 0o077), ("maps", 0o000), ("fd", 0o077), ("map_files", 0o077)] {
        let path = PathBuf::from(format!("/proc/{}/{file}", driver.child.id()));
        assert_eq!(mode(&path) & others, 0, "{file}");
    }
    let directory = directory_mode();
    assert_eq!(directory & 0o007, 0, "a directory that the driver makes is not for others");
}

fn directory_mode() -> u32 {
    let outer = open_directory();
    let socket = outer.path().join("made/driver.sock");
    let driver = Driver::start_at(&resting("real", 1), io_driver(), outer, socket);
    driver.socket().parent().expect("a directory").metadata().expect("there").permissions().mode()
}

/// Nobody's own driver is nobody else's either: its owner may trace it, the next ordinary user may not.
#[test]
fn an_ordinary_users_driver_is_closed_to_the_next_ordinary_user() {
    if role().is_some() || !can_be_others() {
        return;
    }
    let stranger = Stranger::of(Path::new(io_driver().get_program()));
    let directory = directory_of_nobody();
    let socket = directory.path().join("driver.sock");
    let driver = Driver::start_at(&resting("real", 1), stranger.command(&[]), directory, socket);
    let pid = driver.child.id();
    let mut look = Command::new("setpriv");
    look.args(["--reuid=4711", "--regid=4711", "--clear-groups", "ls", &format!("/proc/{pid}/fd")]);
    let end = Running::start(&mut look).end();
    assert!(end.status != Some(0) && end.err.contains("Permission denied"), "{end:?}");
}

/// A driver whose sockets everybody reaches, and people who ask it for something.
struct Asked {
    driver: Driver,
    program: Stranger,
}

impl Asked {
    fn with(access: &str) -> Self {
        Self::started_by(io_driver(), access)
    }

    fn started_by(command: Command, access: &str) -> Self {
        let config = resting("real", 1).replace("[real_time]", &format!("{access}[real_time]"));
        let open = open_directory();
        let socket = open.path().join("driver.sock");
        let driver = Driver::start_at(&config, command, open, socket.clone());
        for path in [socket.clone(), shm_abi::stop_socket::path_beside(&socket)] {
            std::fs::set_permissions(path, PermissionsExt::from_mode(0o666)).expect("root may");
        }
        Self { driver, program: Stranger::of(Path::new(io_driver().get_program())) }
    }

    fn ask(&self, user: u32, groups: &[u32], what: &str) -> End {
        let mut command = self.program.as_user(user, groups);
        Running::start(command.arg(what).arg("--socket").arg(self.driver.socket())).end()
    }

    fn denied(&self, user: u32, groups: &[u32], what: &str, who_may: &str) {
        let end = self.ask(user, groups, what);
        assert_eq!(end.status, Some(2), "{what}: {end:?}");
        assert!(end.err.contains(&format!("{who_may} may")), "{what}: {end:?}");
    }

    fn granted(&self, user: u32, groups: &[u32], what: &str) {
        let end = self.ask(user, groups, what);
        assert_eq!(end.status, Some(0), "{what}: {end:?}");
    }
}

/// Three groups, a user in each, and one in none.
#[test]
fn who_may_look_may_stop_and_no_more_and_only_administrators_undo_the_stop_of_others() {
    if role().is_some() || !can_be_others() {
        return;
    }
    let mut asked = Asked::with("[access]\nlook = \"4100\"\ncommand = \"4200\"\nadminister = \"4300\"\n");
    let [lookers, commanders, administrators] =
        [4100, 4200, 4300].map(|group| format!("members of group {group}"));
    let (nobody, looker, commander, other, administrator) = (4000, 4001, 4002, 4003, 4004);
    asked.denied(nobody, &[], "status", &lookers);
    asked.granted(looker, &[4100], "status");
    asked.granted(looker, &[4100], "emergency-stop");
    asked.denied(looker, &[4100], "clear-fault", &commanders);
    asked.denied(commander, &[4200], "clear-fault", &administrators);
    asked.granted(administrator, &[4300], "clear-fault");
    // One's own.
    asked.granted(commander, &[4200], "emergency-stop");
    asked.denied(other, &[4200], "clear-fault", &administrators);
    asked.granted(commander, &[4200], "clear-fault");
    // The lease of somebody else.
    let lease = asked.driver.command();
    asked.denied(commander, &[4200], "end-lease", &administrators);
    assert!(lease.connection.is_open());
    asked.granted(administrator, &[4300], "end-lease");
    asked.denied(commander, &[4200], "stop", &administrators);
    asked.granted(administrator, &[4300], "stop");
    assert_eq!(asked.driver.wait().code(), Some(0));
}

/// Neither was the socket moved, nor may they end the driver.
#[test]
fn a_stranger_who_asks_for_an_emergency_stop_is_told_that_others_may() {
    if role().is_some() || !can_be_others() {
        return;
    }
    let asked = Asked::with("");
    for path in [asked.driver.socket().to_owned(), shm_abi::stop_socket::path_beside(asked.driver.socket())] {
        std::fs::set_permissions(path, PermissionsExt::from_mode(0o600)).expect("root may");
    }
    let end = asked.ask(4001, &[], "emergency-stop");
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = ["no permission", "the motors may still be on", "ask one who may"];
    assert!(words.iter().all(|word| end.err.contains(word)), "{end:?}");
    assert!(!end.err.contains("moved or deleted") && !end.err.contains("kill"), "{end:?}");
}

/// As an installed driver begins: its configuration names no groups.
#[test]
fn without_groups_a_stop_of_others_is_for_root_and_the_drivers_user_to_undo() {
    if role().is_some() || !can_be_others() {
        return;
    }
    let mut asked = Asked::with("");
    let (ann, bob, root) = (4001, 4002, 0);
    let those = "root and the user that the driver runs as";
    asked.granted(ann, &[], "emergency-stop");
    asked.denied(bob, &[], "clear-fault", those);
    asked.granted(ann, &[], "clear-fault");
    asked.granted(ann, &[], "emergency-stop");
    asked.granted(root, &[], "clear-fault");
    let lease = asked.driver.command();
    asked.denied(bob, &[], "end-lease", those);
    assert!(lease.connection.is_open());
    asked.denied(bob, &[], "stop", those);
    asked.granted(root, &[], "stop");
    assert_eq!(asked.driver.wait().code(), Some(0));
}

/// As in a container without root's rights: there all users from outside have one number.
#[test]
fn a_stop_of_a_user_whom_the_driver_cannot_tell_from_others_is_for_administrators_to_undo() {
    if role().is_some() || !can_be_others() {
        return;
    }
    let contained = |program: &str| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", program]);
        command
    };
    if !contained("true").stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success()) {
        println!("skipped: no user namespaces here");
        return;
    }
    let program = io_driver();
    let mut asked = Asked::started_by(contained(&program.get_program().to_string_lossy()), "");
    let (ann, bob, root) = (4001, 4002, 0);
    let those = "root and the user that the driver runs as";
    asked.granted(ann, &[], "emergency-stop");
    asked.denied(bob, &[], "clear-fault", those);
    asked.denied(ann, &[], "clear-fault", those);
    asked.granted(root, &[], "clear-fault");
    let lease = asked.driver.command();
    asked.denied(bob, &[], "end-lease", those);
    assert!(lease.connection.is_open());
    asked.granted(root, &[], "stop");
    assert_eq!(asked.driver.wait().code(), Some(0));
}
