//! Places where no driver answers, and places that a driver may not take.

use crate::common::desk::Desk;
use crate::common::directory;
use crate::common::host::Host;
use shm_abi::client::{self, AttachError};
use shm_abi::server::{BindError, Server};
use std::fs::File;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

#[test]
fn a_missing_socket_means_that_no_driver_runs() {
    let directory = directory();
    let socket = directory.path().join("nothing.sock");
    assert_eq!(
        client::observe(&socket, "test").unwrap_err().to_string(),
        format!(
            "no driver is running: {} does not exist; start one with `io-driver run --config FILE`, or name \
             another socket",
            socket.display()
        )
    );
    let below_a_file = directory.path().join("file");
    File::create(&below_a_file).unwrap();
    let error = client::observe(&below_a_file.join("driver.sock"), "test").unwrap_err();
    assert!(matches!(error, AttachError::NoDriver { .. }), "{error:?}");
}

#[test]
fn a_file_at_the_sockets_place_is_no_driver_and_is_left_alone() {
    let directory = directory();
    let path = directory.path().join("results.csv");
    std::fs::write(&path, "precious").unwrap();
    assert_eq!(
        client::observe(&path, "test").unwrap_err().to_string(),
        format!("{} is not a driver's socket: it is not a socket; name another one", path.display())
    );
    assert_eq!(
        Server::bind(&path).unwrap_err().to_string(),
        format!(
            "cannot listen at {}: something that is not a socket lies there, and it is left alone; choose another \
             place with --socket or PHANTOM3_SOCKET",
            path.display()
        )
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
}

#[test]
fn somebody_elses_living_socket_is_not_taken_over() {
    let directory = directory();
    let path = directory.path().join("other.sock");
    let listener = UnixListener::bind(&path).unwrap();
    let error = Server::bind(&path).unwrap_err();
    assert!(matches!(error, BindError::AlreadyRunning { .. }), "{error:?}");
    UnixStream::connect(&path).unwrap();
    // Once it is dead, it may be replaced.
    drop(listener);
    Server::bind(&path).unwrap();
}

#[test]
fn a_second_driver_is_told_about_the_first() {
    let directory = directory();
    let host = Host::start(directory.path());
    assert_eq!(
        Server::bind(&host.socket).unwrap_err().to_string(),
        format!(
            "another driver is running at {}; stop it with `io-driver stop`, or use another socket",
            host.socket.display()
        )
    );
    client::observe(&host.socket, "test").unwrap();
    let left: Vec<_> = std::fs::read_dir(directory.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "the socket, its lock and nothing else: {left:?}");
}

#[test]
fn a_driver_that_ends_leaves_nothing_and_one_that_was_displaced_spares_its_successor() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    drop(Server::bind(&socket).unwrap());
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);

    let displaced = Server::bind(&socket).unwrap();
    // As if somebody had swept the runtime directory.
    for entry in std::fs::read_dir(directory.path()).unwrap() {
        std::fs::remove_file(entry.unwrap().path()).unwrap();
    }
    let _successor = Server::bind(&socket).unwrap();
    drop(displaced);
    UnixStream::connect(&socket).unwrap();
    let error = Server::bind(&socket).unwrap_err();
    assert!(matches!(error, BindError::AlreadyRunning { .. }), "the successor's lock is gone: {error:?}");
}

#[test]
fn the_socket_and_its_lock_are_no_wider_open_than_they_must_be() {
    let directory = directory();
    let socket = directory.path().join("new/driver.sock");
    let _server = Server::bind(&socket).unwrap();
    let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o7777;
    assert_eq!(mode(&socket), 0o660);
    assert_eq!(mode(&socket.with_file_name("driver.sock.lock")) & !0o600, 0);
    assert_eq!(mode(socket.parent().unwrap()) & !0o750, 0);
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let directory = directory();
    let file = directory.path().join("file");
    File::create(&file).unwrap();
    let message = Server::bind(&file.join("sub/driver.sock")).unwrap_err().to_string();
    assert!(message.starts_with("cannot create the directory "), "{message}");
    assert!(message.ends_with("; choose another place with --socket or PHANTOM3_SOCKET"), "{message}");
}

/// The flags of every socket of this process that is bound to `path`, as the kernel tells them.
fn flags_of_sockets_at(path: &Path) -> Vec<u32> {
    let table = std::fs::read_to_string("/proc/net/unix").unwrap();
    let at_path = |line: &&str| line.split_whitespace().nth(7).is_some_and(|name| Path::new(name) == path);
    let inodes = table.lines().filter(at_path).filter_map(|line| line.split_whitespace().nth(6));
    let links: Vec<String> = inodes.map(|inode| format!("socket:[{inode}]")).collect();
    let is_ours = |entry: &std::fs::DirEntry| {
        let link = std::fs::read_link(entry.path()).unwrap_or_default();
        links.iter().any(|known| link.as_os_str() == known.as_str())
    };
    let flags_of = |entry: std::fs::DirEntry| {
        let path = Path::new("/proc/self/fdinfo").join(entry.file_name());
        let text = std::fs::read_to_string(path).unwrap();
        let flags = text.lines().find_map(|line| line.strip_prefix("flags:")).unwrap().trim().to_string();
        u32::from_str_radix(&flags, 8).unwrap()
    };
    std::fs::read_dir("/proc/self/fd").unwrap().map(Result::unwrap).filter(is_ours).map(flags_of).collect()
}

#[test]
fn no_socket_of_the_server_can_block_its_thread_or_is_left_to_a_child() {
    let mut desk = Desk::open();
    // The kernel knows the listener by the name under which it was bound.
    let bound = std::fs::read_to_string("/proc/net/unix").unwrap();
    let place = desk.server.path().to_str().unwrap().to_string();
    let name =
        bound.lines().filter_map(|line| line.split_whitespace().nth(7)).find(|name| name.starts_with(&place));
    let name = Path::new(name.expect("the listener")).to_path_buf();
    let _talking = [desk.connect(), desk.connect()];
    let flags = flags_of_sockets_at(&name);
    assert_eq!(flags.len(), 3, "the listener and two connections");
    let needed = (rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::CLOEXEC).bits();
    assert!(flags.iter().all(|flags| flags & needed == needed), "{flags:?}");
}
