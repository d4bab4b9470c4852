//! The way to stop the motors that needs no connection.

use patience::prelude::*;
use patience::{limit, watched};
use shm_abi::client::{self, AttachError};
use shm_abi::server::Server;
use shm_abi::stop_socket::{self, Sent, StopSocket, path_beside};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A driver's place with a thread that hears stops; each is told with the user who sent it.
fn listening() -> (tempfile::TempDir, Server, Receiver<Option<u32>>) {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
    let (mut socket, file) = StopSocket::bind(server.path()).unwrap();
    let (tell, told) = channel();
    std::thread::spawn(move || {
        let _file = file;
        let drain = socket.drain().unwrap();
        while let Ok(user) = socket.hear()
            && tell.send(user).is_ok()
        {
            drain.take();
        }
    });
    (directory, server, told)
}

#[test]
fn whatever_is_sent_is_a_stop_and_the_kernel_tells_whose() {
    let (_directory, server, told) = listening();
    let own = Some(rustix::process::geteuid().as_raw());
    stop_socket::send(server.path()).unwrap();
    assert_eq!(told.recv_timeout(limit()).unwrap(), own);
    let stranger = UnixDatagram::unbound().unwrap();
    for words in [&b""[..], b"help", &[0; 4096]] {
        stranger.send_to(words, path_beside(server.path())).unwrap();
        assert_eq!(told.recv_timeout(limit()).unwrap(), own);
    }
}

/// Told once for each: it waits for the next one, and until then the first is there for whoever asks.
#[test]
fn a_stop_is_heard_until_it_is_taken_and_then_waited_for() {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
    let (mut socket, _file) = StopSocket::bind(server.path()).unwrap();
    let drain = socket.drain().unwrap();
    stop_socket::send(server.path()).unwrap();
    let own = Some(rustix::process::geteuid().as_raw());
    let twice = watched(limit(), "the same stop", || [socket.hear().unwrap(), socket.hear().unwrap()]);
    assert_eq!(twice, [own, own]);
    drain.take();
    let (tell, told) = channel();
    let hearing = std::thread::spawn(move || tell.send(socket.hear().unwrap()).unwrap());
    assert!(told.recv_timeout(Duration::from_millis(100)).is_err(), "nothing was sent");
    stop_socket::send(server.path()).unwrap();
    assert_eq!(told.recv_timeout(limit()).unwrap(), own);
    hearing.bounded_join().unwrap();
}

#[test]
fn sending_never_waits_and_a_full_queue_is_a_stop_on_its_way() {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
    // Nobody listens to this one.
    let (_socket, _file) = StopSocket::bind(server.path()).unwrap();
    watched(limit(), "ten thousand stops that nobody takes", || {
        let sent: Vec<_> = (0..10_000).map(|_| stop_socket::send(server.path()).unwrap()).collect();
        assert_eq!((sent[0], sent[9_999]), (Sent::Queued, Sent::QueueFull));
    });
}

#[test]
fn a_driver_is_stopped_through_a_link_to_its_socket() {
    let (directory, server, told) = listening();
    let link = directory.path().join("elsewhere.sock");
    std::os::unix::fs::symlink(server.path(), &link).unwrap();
    assert_eq!(stop_socket::send(&link).unwrap(), Sent::Queued);
    assert!(told.recv_timeout(limit()).is_ok());
    // What a driver that died left beside the link is in nobody's way.
    drop(UnixDatagram::bind(path_beside(&link)).unwrap());
    assert_eq!(stop_socket::send(&link).unwrap(), Sent::Queued);
    assert!(told.recv_timeout(limit()).is_ok());
    std::fs::remove_file(path_beside(&link)).unwrap();
    // Nor is a stranger who listens there.
    let stranger = UnixDatagram::bind(path_beside(&link)).unwrap();
    assert_eq!(stop_socket::send(&link).unwrap(), Sent::Queued);
    assert!(told.recv_timeout(limit()).is_ok());
    drop(stranger);
    std::fs::remove_file(path_beside(&link)).unwrap();
    std::fs::remove_file(&link).unwrap();
    std::os::unix::fs::symlink(directory.path().join("nobody.sock"), &link).unwrap();
    assert_eq!(stop_socket::send(&link).unwrap_err().kind(), std::io::ErrorKind::NotFound);
}

/// Names that no address has room for: of the socket itself, and of a link to it.
#[test]
fn a_driver_is_stopped_and_asked_by_a_path_of_any_length() {
    let (directory, server, told) = listening();
    let deep = "deep/".repeat(30);
    std::fs::create_dir_all(directory.path().join(&deep)).unwrap();
    let link = directory.path().join(&deep).join("link");
    std::os::unix::fs::symlink(server.path(), &link).unwrap();
    let name = server.path().file_name().unwrap();
    let around = directory.path().join(&deep).join("../".repeat(30)).join(name);
    for path in [&link, &around] {
        assert_eq!(stop_socket::send(path).unwrap(), Sent::Queued, "{}", path.display());
        assert!(told.recv_timeout(limit()).is_ok());
        // It is reached, and hangs up or says nothing: nobody serves connections here.
        let refused = client::stop(path, "test").unwrap_err();
        assert!(!refused.to_string().contains("too long"), "{refused}");
    }
    let nobody = directory.path().join(&deep).join("nobody");
    assert!(matches!(client::stop(&nobody, "test").unwrap_err(), AttachError::NoDriver { .. }));
    assert!(client::stop(&nobody.join("further"), "test").is_err());
}

#[test]
fn it_lies_beside_the_drivers_socket_for_the_same_people_and_goes_with_it() {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
    assert!(stop_socket::send(server.path()).is_err(), "nobody is there");
    let (socket, file) = StopSocket::bind(server.path()).unwrap();
    assert_eq!(file.path(), directory.path().join("driver.sock.stop"));
    let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(file.path()), mode(server.path()));
    // One that was left over by a driver that died is replaced.
    let (_again, file_again) = StopSocket::bind(server.path()).unwrap();
    drop((socket, file));
    assert!(file_again.path().exists(), "it is another driver's now");
    drop(file_again);
    assert!(!path_beside(server.path()).exists());
}

#[test]
fn a_file_at_its_place_is_left_alone() {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("run")).unwrap();
    let file = directory.path().join("run.stop");
    std::fs::write(&file, "precious").unwrap();
    let refused = StopSocket::bind(server.path()).unwrap_err().to_string();
    assert!(refused.contains("run.stop: something that is not a socket lies there"), "{refused}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "precious");
}

/// A driver whose service is stuck accepts connections, by its backlog, and answers none.
#[test]
fn a_program_that_stops_a_driver_whose_service_is_stuck_is_heard() {
    let (_directory, server, told) = listening();
    client::emergency_stop(server.path(), "test").unwrap();
    assert!(told.recv_timeout(limit()).is_ok());
}

/// Else others alone could undo it.
#[test]
fn a_stop_that_the_queue_has_no_room_for_counts_only_when_the_driver_has_heard_it() {
    let directory = tempfile::tempdir().unwrap();
    let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
    let (_socket, _file) = StopSocket::bind(server.path()).unwrap();
    while stop_socket::send(server.path()).unwrap() == Sent::Queued {}
    assert!(matches!(client::emergency_stop(server.path(), "test"), Err(AttachError::NoAnswer { .. })));
}
