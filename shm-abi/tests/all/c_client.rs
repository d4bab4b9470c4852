//! A client in C, compiled against the committed headers, talks to the real server.

use crate::common::fake::{fake_server, hear, send};
use crate::common::{frame, info, wait_until};
use bytemuck::Zeroable;
use patience::prelude::*;
use patience::{limit, watched};
use shm_abi::handshake::{Answer, Verdict};
use shm_abi::server::{Server, ServerEvent};
use shm_abi::stop_socket::Sent;
use shm_abi::{Command, CommanderView, DriverMemory};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

const FLAGS: [&str; 6] = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-pedantic"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The C compiler, looking for today's headers; `None` if there is none.
fn compiler() -> Option<std::process::Command> {
    let mut compiler = crate::common::c_compiler::compiler()?;
    compiler.arg("-I").arg(root().join("include"));
    Some(compiler)
}

/// What finds errors of memory and undefined behaviour at run time, where the compiler has it.
const SANITIZERS: [&str; 4] =
    ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"];

/// Whether programs can be made with the sanitizers, and run: their library is a package of its own on some systems.
fn has_sanitizers(directory: &Path) -> bool {
    let (source, program) = (directory.join("probe.c"), directory.join("probe"));
    std::fs::write(&source, "int main(void) { return 0; }\n").unwrap();
    let compiled = compiler().is_some_and(|mut compiler| {
        let made = compiler.args(SANITIZERS).arg(&source).arg("-o").arg(&program).bounded_output();
        made.is_ok_and(|output| output.status.success())
    });
    let runs = compiled
        && std::process::Command::new(&program).bounded_status().is_ok_and(|status| status.success());
    if !runs {
        println!("skipped: sanitizers over the C client: this compiler has none");
    }
    runs
}

/// The program, sanitized where that can be had; made once.
fn compiled() -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    PROGRAM.get_or_init(|| compile(Path::new(env!("CARGO_TARGET_TMPDIR")))).as_deref()
}

fn compile(directory: &Path) -> Option<PathBuf> {
    let program = directory.join("c_client");
    let mut compiler = compiler()?;
    if has_sanitizers(directory) {
        compiler.args(SANITIZERS);
    }
    let source = root().join("tests/c_client.c");
    let compiled = compiler.args(FLAGS).arg(source).arg("-o").arg(&program).bounded_output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Some(program)
}

struct Driver {
    memory: DriverMemory,
    server: Server,
    events: Vec<ServerEvent>,
    directory: tempfile::TempDir,
}

impl Driver {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        Self { memory: DriverMemory::create(&info()).unwrap(), server, events: Vec::new(), directory }
    }

    /// `None` without a compiler.
    fn client(&self, arguments: &[&str]) -> Option<Child> {
        self.client_at(self.server.path(), arguments)
    }

    fn client_at(&self, socket: &Path, arguments: &[&str]) -> Option<Child> {
        let mut program = std::process::Command::new(compiled()?);
        program.arg(socket).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        Some(program.spawn().unwrap())
    }

    fn poll(&mut self) {
        let Self { memory, server, events, .. } = self;
        watched(limit(), "a turn of the server", || server.poll(memory, Duration::from_millis(1), events))
            .unwrap();
    }

    fn serve_until_it_ends(&mut self, mut client: Child) -> Output {
        wait_until("the client ends", || {
            self.poll();
            client.try_wait().unwrap().is_some()
        });
        client.bounded_output()
    }

    fn lease(&mut self) -> CommanderView {
        wait_until("the client commands", || {
            self.poll();
            !self.events.is_empty()
        });
        match self.events.remove(0) {
            ServerEvent::LeaseGranted { view, name, .. } => {
                assert_eq!(name, "c_client");
                view
            }
            other => panic!("{other:?}"),
        }
    }

    fn publish(&self, tick: u64, commander: Option<&CommanderView>) {
        self.memory.write_frame(&frame(tick));
        self.memory.ring(tick, commander);
    }
}

#[test]
fn a_c_commander_answers_every_tick_under_its_lease() {
    const TICKS: u64 = 6_000; // more than once round the ring of frames
    let mut driver = Driver::start();
    let Some(client) = driver.client(&["command", &TICKS.to_string()]) else { return };
    let view = driver.lease();
    let mut command = Command::zeroed();
    let begun = Instant::now();
    for tick in 0..TICKS {
        driver.publish(tick, Some(&view));
        // One limit for all of them: of sleepers that nobody wakes each sleeps to its end.
        wait_until("the answer is there", || {
            let newest = view.latest_tick();
            if newest != Some(tick) {
                let rest = limit().saturating_sub(begun.elapsed());
                assert!(!rest.is_zero(), "waited {:?} in vain for {TICKS} answers; {tick} came", limit());
                view.sleep_for_command(newest, &driver.memory, rest);
            }
            newest == Some(tick)
        });
        view.read_command(tick, &mut command).unwrap();
        command.validate(tick, view.lease(), 2).unwrap();
        for (device, found) in command.devices[..2].iter().enumerate() {
            let base = tick as f64 + 10.0 * device as f64;
            assert_eq!(found.force_on_user_n, [base, base + 1.0, base + 2.0]);
        }
    }
    drop(driver.server);
    let output = client.bounded_output();
    assert_eq!(String::from_utf8_lossy(&output.stdout), format!("{TICKS} ticks whole\n"), "{output:?}");
}

#[test]
fn a_c_observer_reads_frames_without_a_lease() {
    let mut driver = Driver::start();
    (0..10).for_each(|tick| driver.publish(tick, None));
    let Some(client) = driver.client(&["observe", "10"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "10 ticks whole\n", "{output:?}");
    assert!(driver.events.is_empty(), "{:?}", driver.events);
}

/// What the server is told when a C program asks for something, and how that program ends.
fn asked(what: &str) -> Option<(Driver, Output)> {
    let mut driver = Driver::start();
    let client = driver.client(&["ask", what])?;
    let output = driver.serve_until_it_ends(client);
    Some((driver, output))
}

#[test]
fn a_c_program_stops_the_driver_and_its_motors_clears_faults_and_zeroes() {
    type Expected = fn(&ServerEvent) -> bool;
    let cases: [(&str, Expected); 4] = [
        ("stop", |event| matches!(event, ServerEvent::StopRequested { .. })),
        ("emergency-stop", |event| matches!(event, ServerEvent::EmergencyStopRequested { .. })),
        ("clear-fault", |event| matches!(event, ServerEvent::ClearFaultRequested { .. })),
        ("zero", |event| matches!(event, ServerEvent::ZeroRequested { devices: 0b101, .. })),
    ];
    for (what, expected) in cases {
        let Some((driver, output)) = asked(what) else { return };
        assert!(output.status.success(), "{what}: {output:?}");
        assert!(matches!(&driver.events[..], [event] if expected(event)), "{what}: {:?}", driver.events);
    }
}

/// A stop socket at which nobody takes anything.
fn stops_beside(socket: &Path) -> UnixDatagram {
    let stops = UnixDatagram::bind(shm_abi::stop_socket::path_beside(socket)).unwrap();
    stops.set_nonblocking(true).unwrap();
    stops
}

fn is_stopped(events: &[ServerEvent]) -> bool {
    matches!(events, [ServerEvent::EmergencyStopRequested { .. }])
}

#[test]
fn a_c_program_stops_the_motors_by_datagram_and_over_a_connection() {
    let mut driver = Driver::start();
    let stops = stops_beside(driver.server.path());
    let Some(client) = driver.client(&["ask", "emergency-stop"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert!(output.status.success(), "{output:?}");
    assert!(stops.recv(&mut [0; 16]).is_ok(), "nothing came");
    assert!(is_stopped(&driver.events), "{:?}", driver.events);
}

#[test]
fn a_c_program_stops_a_driver_whose_service_is_stuck_by_datagram() {
    let driver = Driver::start();
    let stops = stops_beside(driver.server.path());
    let Some(client) = driver.client(&["ask", "emergency-stop"]) else { return };
    let output = client.bounded_output();
    assert!(output.status.success(), "{output:?}");
    assert!(stops.recv(&mut [0; 16]).is_ok(), "nothing came");
}

/// Else others alone could undo it.
#[test]
fn a_stop_of_a_c_program_that_the_queue_has_no_room_for_is_heard_over_the_connection() {
    let mut driver = Driver::start();
    let _stops = stops_beside(driver.server.path());
    while shm_abi::stop_socket::send(driver.server.path()).unwrap() == Sent::Queued {}
    let Some(client) = driver.client(&["ask", "emergency-stop"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert!(output.status.success() && is_stopped(&driver.events), "{output:?}: {:?}", driver.events);
    // Nobody answers.
    let Some(client) = driver.client(&["ask", "emergency-stop"]) else { return };
    assert_eq!(client.bounded_output().status.code(), Some(1));
}

#[test]
fn a_c_program_stops_a_driver_through_a_link_whoever_listens_beside_that() {
    let mut driver = Driver::start();
    let stops = stops_beside(driver.server.path());
    let link = driver.directory.path().join("elsewhere.sock");
    std::os::unix::fs::symlink(driver.server.path(), &link).unwrap();
    let stranger = stops_beside(&link);
    let Some(client) = driver.client_at(&link, &["ask", "emergency-stop"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert!(output.status.success() && is_stopped(&driver.events), "{output:?}: {:?}", driver.events);
    assert!(stops.recv(&mut [0; 16]).is_ok(), "nothing came");
    assert!(stranger.recv(&mut [0; 16]).is_ok(), "it may be the driver's as well");
}

/// Links to a driver's socket in `directory/a`, by names in `directory`.
fn links_to_a_driver(directory: &Path) -> Vec<PathBuf> {
    let deep = "deep/".repeat(30);
    std::fs::create_dir_all(directory.join(&deep)).unwrap();
    std::fs::create_dir(directory.join("b")).unwrap();
    let links = [
        ("absolute", directory.join("a/driver.sock").into_os_string()),
        ("relative", "a/driver.sock".into()),
        ("b/upwards", "../a/driver.sock".into()),
        ("chain", "b/upwards".into()),
        ("directory", "a".into()),
        ("through", "directory/driver.sock".into()),
        // Its own directory is reached by another name, and `..` is that of the directory itself.
        ("other", format!("{deep}x").into()),
        (&*format!("{deep}x"), "../".repeat(30).into()),
        (&*format!("{deep}long"), format!("{}a/driver.sock", "../".repeat(30)).into()),
        ("to-long", format!("{deep}long").into()),
    ];
    for (link, target) in &links {
        std::os::unix::fs::symlink(target, directory.join(link)).unwrap();
    }
    ["absolute", "relative", "b/upwards", "chain", "through", "other/relative", "to-long"]
        .map(|link| directory.join(link))
        .into()
}

#[test]
fn a_stop_of_a_c_program_goes_through_every_kind_of_link() {
    let Some(program) = compiled() else { return };
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("a")).unwrap();
    let stops = stops_beside(&directory.path().join("a/driver.sock"));
    let send = |place: &Path| {
        let mut client = std::process::Command::new(program);
        let output =
            client.current_dir(directory.path()).arg(place).arg("send-stop").bounded_output().unwrap();
        assert!(output.status.success(), "{}: {output:?}", place.display());
        (String::from_utf8(output.stdout).unwrap(), stops.recv(&mut [0; 16]).is_ok())
    };
    let links = links_to_a_driver(directory.path());
    for place in links.iter().map(PathBuf::as_path).chain([Path::new("chain"), Path::new("b/upwards")]) {
        assert_eq!(send(place), ("0\n".into(), true), "{}", place.display());
    }
    // Neither these nor a link that leads to itself hold it up.
    std::os::unix::fs::symlink("round", directory.path().join("round")).unwrap();
    std::os::unix::fs::symlink("nowhere", directory.path().join("dangling")).unwrap();
    for place in ["round", "dangling", "nobody", "b", "b/", "/"] {
        assert_eq!(send(Path::new(place)), ("-1\n".into(), false), "{place}");
    }
    // Names that no address has room for, of the socket itself and of a link.
    let deep = "deep/".repeat(30);
    for place in [format!("{deep}../"), format!("{}/{deep}", directory.path().display())] {
        let up = if place.ends_with("../") { 29 } else { 30 };
        let place = format!("{place}{}", "../".repeat(up));
        for name in ["a/driver.sock", "relative"] {
            let place = format!("{place}{name}");
            assert!(place.len() > 107);
            assert_eq!(send(Path::new(&place)), ("0\n".into(), true), "{place}");
        }
    }
}

#[test]
fn a_stop_of_a_c_program_that_a_stranger_hears_alone_is_not_told_as_sent() {
    let Some(program) = compiled() else { return };
    let directory = tempfile::tempdir().unwrap();
    let targets = [format!("{}driver.sock", "./".repeat(600)), "link1".into()];
    for (number, target) in targets.iter().enumerate() {
        let link = directory.path().join(format!("link{number}"));
        std::os::unix::fs::symlink(target, &link).unwrap();
        let stranger = stops_beside(&link);
        let output =
            std::process::Command::new(program).arg(&link).arg("send-stop").bounded_output().unwrap();
        assert_eq!(String::from_utf8(output.stdout).unwrap(), "-1\n", "{}", link.display());
        assert!(stranger.recv(&mut [0; 16]).is_ok(), "it may be the driver's as well");
    }
}

#[test]
fn a_c_program_without_a_path_asks_nobody_and_is_not_attached() {
    let Some(program) = compiled() else { return };
    let output = std::process::Command::new(program).arg("nothing").bounded_output().unwrap();
    assert_eq!(
        (output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()),
        (Some(0), "the path of the driver's socket is empty; name the socket\n")
    );
}

/// An address of all the room there is, empty, is an abstract one, and `.stop` a file of whoever owns the directory.
#[test]
fn a_c_program_that_names_no_socket_asks_nobody() {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixListener};
    let Some(program) = compiled() else { return };
    let directory = tempfile::tempdir().unwrap();
    let stops = stops_beside(&directory.path().join(""));
    let stranger = SocketAddr::from_abstract_name([0; 107])
        .and_then(|address| UnixListener::bind_addr(&address))
        .unwrap();
    stranger.set_nonblocking(true).unwrap();
    let run = |arguments: &[&str]| {
        let mut client = std::process::Command::new(program);
        client.current_dir(directory.path()).arg("").args(arguments).bounded_output().unwrap()
    };
    let asking = ["stop", "emergency-stop", "clear-fault", "zero", "end-lease"].map(|what| vec!["ask", what]);
    for arguments in asking.iter().map(Vec::as_slice).chain([&["observe", "1"][..], &["command", "1"]]) {
        let output = run(arguments);
        assert_eq!(
            (output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()),
            (Some(1), "the path of the driver's socket is empty; name the socket\n"),
            "{arguments:?}"
        );
    }
    assert_eq!(String::from_utf8(run(&["send-stop"]).stdout).unwrap(), "-1\n");
    let met = stranger.incoming().next().expect("it listens on");
    let met = met.map(drop).map_err(|error| error.kind());
    assert_eq!(met, Err(std::io::ErrorKind::WouldBlock), "a stranger was asked");
    assert!(stops.recv(&mut [0; 16]).is_err(), "whoever listens at .stop was asked");
}

#[test]
fn a_c_program_that_attaches_with_a_request_that_hands_over_nothing_sends_it_not() {
    for kind in 3..=7 {
        let mut driver = Driver::start();
        let Some(client) = driver.client(&["attach", &kind.to_string()]) else { return };
        let output = driver.serve_until_it_ends(client);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.starts_with(&format!(
                "a request of kind {kind} hands over nothing to attach to, and was not sent;"
            )),
            "{said}"
        );
        driver.poll();
        assert!(driver.events.is_empty(), "kind {kind}: {:?}", driver.events);
    }
}

#[test]
fn a_c_program_is_told_what_a_driver_of_an_older_version_does_not_know_and_who_may_what_it_may_not() {
    let user = rustix::process::geteuid().as_raw();
    let cases = [
        (
            Answer { abi_version: (1 << 32) | 2, ..Answer::new(Verdict::UnknownKind) },
            "the driver speaks version 1.2 and does not know requests of kind 7, this program speaks 1.3; start the \
             driver that belongs to this program\n"
                .to_string(),
        ),
        (
            Answer { allowed_group_plus_one: 989, ..Answer::new(Verdict::NotAllowed) },
            format!("the driver does not let user {user} ask for this (kind 7): members of group 988 may\n"),
        ),
        (
            Answer::new(Verdict::NotAllowed),
            format!("the driver does not let user {user} ask for this (kind 7): root and the user that it runs as may\n"),
        ),
        (
            Answer { driver_pid: std::process::id().into(), holder_pid: 42, ..Answer::new(Verdict::LeaseHeld) },
            "the devices are commanded by process 42 () already; end it first, or attach as an observer\n".into(),
        ),
        // A driver whose number here is another one tells numbers that mean nothing here.
        (
            Answer { driver_pid: 1, holder_pid: 42, ..Answer::new(Verdict::LeaseHeld) },
            "the devices are commanded by a process of another PID namespace () already; end it first, or attach as an \
             observer\n"
                .into(),
        ),
    ];
    for (answer, expected) in cases {
        let directory = crate::common::directory();
        let Some(program) = compiled() else { return };
        let socket = directory.path().join("driver.sock");
        let serving = fake_server(&socket, 1, move |mut stream| {
            hear(&mut stream);
            send(&stream, bytemuck::bytes_of(&answer), &[]);
        });
        let output = std::process::Command::new(program)
            .arg(&socket)
            .args(["ask", "end-lease"])
            .bounded_output()
            .unwrap();
        serving.bounded_join().unwrap();
        assert_eq!(
            (output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()),
            (Some(1), expected.as_str())
        );
    }
}

#[test]
fn a_c_program_refuses_a_driver_that_says_what_cannot_be() {
    for period_ns in [0, 1, 49_999] {
        let mut driver = Driver::start();
        driver.memory.header.period_ns.store(period_ns, std::sync::atomic::Ordering::Relaxed);
        let Some(client) = driver.client(&["observe", "1"]) else { return };
        let output = driver.serve_until_it_ends(client);
        assert_eq!(
            String::from_utf8_lossy(&output.stderr),
            format!(
                "the driver says of itself: period in nanoseconds: {period_ns}, expected 50000 to 10000000000; do not \
                 trust this driver, start the one that belongs to this program\n"
            )
        );
    }
}

#[test]
fn a_c_client_of_another_version_prints_both_versions_and_what_to_do() {
    let mut driver = Driver::start();
    let Some(client) = driver.client(&["version"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        format!(
            "the driver speaks ABI version {}, this program 99.7; install both from the same release\n",
            shm_abi::handshake::own_version_text()
        )
    );
}

#[test]
fn the_headers_compile_on_their_own_and_as_cpp() {
    for header in ["phantom3_shm.h", "phantom3_client.h"] {
        for language in [["-x", "c", "-std=c11"], ["-x", "c++", "-std=c++17"]] {
            let Some(mut compiler) = compiler() else { return };
            let output = compiler
                .args(language)
                .args(["-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-include"])
                .arg(root().join("include").join(header))
                .arg("/dev/null")
                .bounded_output()
                .unwrap();
            let errors = String::from_utf8_lossy(&output.stderr);
            if language[1] == "c++" && !output.status.success() && errors.contains("cc1plus") {
                println!("skipped: C++ check of {header}: this compiler has no C++ part");
                continue;
            }
            assert!(output.status.success(), "{header} as {}: {errors}", language[1]);
        }
    }
}

/// A byte each half a second would be an answer after minutes.
#[test]
fn a_c_program_does_not_wait_for_an_answer_that_drips() {
    let Some(program) = compiled() else { return };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("driver.sock");
    let server = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let begun = Instant::now();
    let client = std::process::Command::new(program)
        .args([path.as_os_str(), "observe".as_ref()])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let drips = std::thread::spawn(move || {
        let mut connection = patience::accepted(&server);
        patience::until("whoever waits has hung up", || {
            std::thread::sleep(Duration::from_millis(500));
            std::io::Write::write_all(&mut connection, &[0]).is_err()
        });
    });
    let output = client.bounded_output();
    drips.bounded_join().unwrap();
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(words.contains("gives no answer"), "{words}");
    assert_eq!(output.status.code(), Some(1));
    // Two seconds, rounded up, and as long for the last byte; a busy machine may take as much again.
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
}
