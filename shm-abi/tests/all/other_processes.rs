//! What needs a process of its own: death by signal, another user, a limit of the whole process. Each test
//! runs this binary again, with the body below and a variable that says which part of it.

use crate::common::fake::{hear, send};
use crate::common::host::Host;
use crate::common::{directory, frame, info, is_frame, wait_until};
use bytemuck::Zeroable;
use patience::limit;
use patience::prelude::*;
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::server::{Server, ServerEvent};
use shm_abi::{DriverMemory, Frame};
use shm_abi::{client, endpoint};
use std::fs::{File, Permissions};
use std::io::Write;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const BODY: &str = "SHM_ABI_TEST_BODY";
const SOCKET: &str = "SHM_ABI_TEST_SOCKET";

fn process(binary: &Path, body: &str, socket: &Path) -> std::process::Command {
    let mut command = std::process::Command::new(binary);
    command.args(["--exact", "other_processes::body_of_another_process", "--nocapture"]);
    command.env(BODY, body).env(SOCKET, socket).stdout(std::process::Stdio::piped());
    command
}

fn own_binary() -> PathBuf {
    std::env::current_exe().unwrap()
}

/// By a process of its own: a child of another test would hold what is written here, and it could not be run.
fn copy_own_binary(to: &Path) {
    let copied = std::process::Command::new("cp").arg(own_binary()).arg(to).bounded_status().unwrap();
    assert!(copied.success());
}

#[test]
fn body_of_another_process() {
    let Some(socket) = std::env::var_os(SOCKET).map(PathBuf::from) else { return };
    match std::env::var(BODY).unwrap().as_str() {
        "driver" => {
            let _server = Server::bind(&socket).unwrap();
            println!("\nbound");
            std::thread::sleep(limit());
        }
        "commander" => {
            let _attached = client::command(&socket, "doomed").unwrap();
            println!("\nattached");
            std::thread::sleep(limit());
        }
        "observer" => match client::observe(&socket, "other") {
            Ok(_) => println!("\nattached"),
            Err(error) => println!("\nrefused: {error}"),
        },
        "endpoint" => {
            println!("\nplaces: {:?}", endpoint::candidates());
            println!("for a driver: {:?}, named: {:?}", endpoint::for_driver(), endpoint::named());
            println!("for an application: {:?}", endpoint::for_application());
        }
        "driver without descriptors" => serve_without_descriptors(&socket),
        other => panic!("no such body: {other}"),
    }
}

/// The line that begins like this, of those that the other process prints.
fn line(child: &mut std::process::Child, beginning: &str) -> String {
    use std::io::BufRead;
    let output = std::io::BufReader::new(child.stdout.as_mut().unwrap());
    let find = || output.lines().map(Result::unwrap).find(|line| line.starts_with(beginning));
    let found = patience::watched(limit(), &format!("the other process says {beginning}"), find);
    found.unwrap_or_else(|| panic!("the other process ended without saying {beginning}"))
}

#[test]
fn a_driver_killed_with_9_leaves_a_socket_that_clients_recognise_and_the_next_driver_replaces() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let mut driver = process(&own_binary(), "driver", &socket).spawn().unwrap();
    line(&mut driver, "bound");
    driver.end();
    assert_eq!(
        client::observe(&socket, "test").unwrap_err().to_string(),
        format!(
            "the driver is gone: {} is left over from one that died; start it again with `io-driver run --config \
             FILE` (it replaces the socket)",
            socket.display()
        )
    );
    let host = Host::start(directory.path());
    client::observe(&host.socket, "test").unwrap();
}

#[test]
fn a_commander_killed_with_9_ends_its_lease() {
    let directory = directory();
    let host = Host::start(directory.path());
    let mut commander = process(&own_binary(), "commander", &host.socket).spawn().unwrap();
    line(&mut commander, "attached");
    let granted = host.event();
    assert!(matches!(&granted, ServerEvent::LeaseGranted { pid, name, .. }
        if *pid == u64::from(commander.id()) && name == "doomed"));
    commander.end();
    assert!(matches!(host.event(), ServerEvent::LeaseEnded { lease: 1 }));
}

#[test]
fn a_client_that_is_stopped_and_continued_while_it_waits_attaches_all_the_same() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let memory = DriverMemory::create(&info()).unwrap();
    let listener = UnixListener::bind(&socket).unwrap();
    let mut client = process(&own_binary(), "observer", &socket).spawn().unwrap();
    let mut stream = patience::accepted(&listener);
    hear(&mut stream);
    let pid = rustix::process::Pid::from_child(&client);
    for signal in [rustix::process::Signal::STOP, rustix::process::Signal::CONT] {
        // To be asleep in the kernel when it comes. If this is too short, the test checks less, but holds.
        std::thread::sleep(Duration::from_millis(100));
        rustix::process::kill_process(pid, signal).unwrap();
    }
    std::thread::sleep(Duration::from_millis(100));
    send(&stream, bytemuck::bytes_of(&Answer::new(Verdict::Granted)), &[memory.fd()]);
    line(&mut client, "attached");
    client.bounded_wait();
}

/// By the system's own services of names.
fn group_in_words(id: u32) -> String {
    let found = nix::unistd::Group::from_gid(id.into()).expect("groups can be read");
    found.map_or_else(|| id.to_string(), |group| format!("{id} ({})", group.name))
}

#[test]
fn a_user_without_permission_is_told_mode_owner_group_and_own_id() {
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65534;
    let directory = directory();
    let _host = Host::start(directory.path());
    let socket = directory.path().join("driver.sock");
    let message = |what: &Path, mode: u32, user: u32| {
        let meta = what.metadata().unwrap();
        format!(
            "no permission to use {}: it has mode {mode:04o}, owner {} and group {}, and you are user {user}; join \
             the group or ask for access",
            what.display(),
            meta.uid(),
            group_in_words(meta.gid())
        )
    };
    let own_uid = rustix::process::geteuid();
    if !own_uid.is_root() {
        // Without a second user: one's own socket, closed even to its owner.
        std::fs::set_permissions(&socket, Permissions::from_mode(0o000)).unwrap();
        let error = client::observe(&socket, "test").unwrap_err();
        assert_eq!(error.to_string(), message(&socket, 0, own_uid.as_raw()));
        println!("skipped: the view of another user, which needs root");
        return;
    }
    let refusal = |directory_mode: u32| {
        std::fs::set_permissions(directory.path(), Permissions::from_mode(directory_mode)).unwrap();
        let shared = tempfile::Builder::new().permissions(Permissions::from_mode(0o755)).tempdir().unwrap();
        // Where the other user can run it.
        let binary = shared.path().join("test");
        copy_own_binary(&binary);
        let mut command = process(&binary, "observer", &socket);
        let mut child = command.uid(NOBODY).gid(NOBODY).current_dir("/").spawn().unwrap();
        let line = line(&mut child, "refused: ");
        child.bounded_wait();
        line
    };
    assert_eq!(refusal(0o755), format!("refused: {}", message(&socket, 0o660, NOBODY)));
    assert_eq!(refusal(0o700), format!("refused: {}", message(directory.path(), 0o700, NOBODY)));
}

/// Runs in a process of its own, for the limit is the whole process'.
fn serve_without_descriptors(socket: &Path) {
    use rustix::process::{Resource, Rlimit, setrlimit};
    let memory = DriverMemory::create(&info()).unwrap();
    let mut server = Server::bind(socket).unwrap();
    let mut events = Vec::new();
    // Beyond the numbers in use now there is room for a single one: the client's end.
    let next = std::os::fd::AsRawFd::as_raw_fd(&File::open("/dev/null").unwrap()) as u64;
    let limit_files = |current| {
        let maximum = rustix::process::getrlimit(Resource::Nofile).maximum;
        setrlimit(Resource::Nofile, Rlimit { current: Some(current), maximum }).unwrap();
    };
    limit_files(next + 1);
    let client = UnixStream::connect(socket).unwrap();
    let start = Instant::now();
    let mut polls = 0;
    while start.elapsed() < Duration::from_millis(500) {
        server.poll(&memory, Duration::from_millis(500), &mut events).unwrap();
        polls += 1;
    }
    // Two polls each rest of 100 ms: one that fails to accept, one that sleeps. A spinning server makes
    // hundreds of thousands.
    assert!(polls < 50, "it spins: {polls} polls");
    limit_files(next + 8);
    drop(client);
    let mut newcomer = UnixStream::connect(socket).unwrap();
    newcomer.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Stop, "late"))).unwrap();
    wait_until("the newcomer is served", || {
        server.poll(&memory, limit(), &mut events).unwrap();
        !events.is_empty()
    });
    println!("\nserved after {polls} polls");
}

#[test]
fn a_server_out_of_descriptors_rests_and_then_serves_again() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let mut server = process(&own_binary(), "driver without descriptors", &socket).spawn().unwrap();
    line(&mut server, "served");
    server.bounded_wait();
}

#[test]
fn frames_of_a_dead_driver_can_still_be_read() {
    let directory = directory();
    let host = Host::start(directory.path());
    host.memory.write_frame(&frame(1));
    host.memory.ring(1, None);
    let attached = client::observe(&host.socket, "historian").unwrap();
    drop(host);
    wait_until("the end is noticed", || !attached.connection.is_open());
    let mut found = Frame::zeroed();
    attached.driver.read_frame(1, &mut found).unwrap();
    assert!(is_frame(&found, 1));
}

/// What a process of ours in this environment says of the driver's place.
fn places_told(binary: &Path, variables: &[(&str, &Path)], user: Option<u32>) -> String {
    use std::os::unix::process::CommandExt;
    let mut command = process(binary, "endpoint", Path::new("unused"));
    for variable in ["PHANTOM3_SOCKET", "RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"] {
        command.env_remove(variable);
    }
    if let Some(user) = user {
        command.uid(user);
    }
    let output = command.current_dir("/").envs(variables.iter().copied()).bounded_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let is_told = |line: &&str| line.starts_with("places: ") || line.starts_with("for a");
    text.lines().filter(is_told).collect::<Vec<_>>().join("; ")
}

#[test]
fn the_drivers_place_is_the_one_that_the_environment_names() {
    let [named, user] = ["/a/b", "/x"].map(Path::new);
    assert_eq!(
        places_told(&own_binary(), &[("PHANTOM3_SOCKET", named), ("XDG_RUNTIME_DIR", user)], None),
        "places: [\"/a/b\"]; for a driver: \"/a/b\", named: Some(\"/a/b\"); for an application: \"/a/b\""
    );
    let told = places_told(&own_binary(), &[("XDG_RUNTIME_DIR", user)], None);
    let expected = "places: [\"/x/phantom3/driver.sock\", \"/run/phantom3/driver.sock\"]; for a driver: \
                    \"/x/phantom3/driver.sock\", named: None; for an application: ";
    assert!(told.starts_with(expected), "{told}");
}

/// The permission is what gets reported, and not that nothing is in another place.
#[test]
fn an_application_goes_for_the_place_that_is_hidden_from_it() {
    const NOBODY: u32 = 65534;
    let directory = directory();
    let [absent, hidden] = ["absent", "hidden"].map(|name| directory.path().join(name));
    std::fs::create_dir(&hidden).unwrap();
    // Where another user can run it.
    let shared = tempfile::Builder::new().permissions(Permissions::from_mode(0o755)).tempdir().unwrap();
    let binary = shared.path().join("test");
    copy_own_binary(&binary);
    std::fs::set_permissions(directory.path(), Permissions::from_mode(0o755)).unwrap();
    std::fs::set_permissions(&hidden, Permissions::from_mode(0o000)).unwrap();
    let user = rustix::process::geteuid().is_root().then_some(NOBODY);
    let told = places_told(&binary, &[("RUNTIME_DIRECTORY", &absent), ("XDG_RUNTIME_DIR", &hidden)], user);
    let expected = format!("for an application: {:?}", hidden.join("phantom3/driver.sock"));
    assert!(told.ends_with(&expected), "{told}; expected {expected}");
}
