//! Waits at Unix sockets.

use std::io::ErrorKind;
use std::os::unix::net::{UnixListener, UnixStream};

use crate::{limit, until_some};

/// The next client of a listener, whose reads and writes are [patient].
#[track_caller]
pub fn accepted(listener: &UnixListener) -> UnixStream {
    listener.set_nonblocking(true).expect("our own socket");
    let stream = until_some("somebody connects", || match listener.accept() {
        Ok((stream, _)) => Some(stream),
        Err(error) if error.kind() == ErrorKind::WouldBlock => None,
        Err(error) => panic!("the listener fails: {error}"),
    });
    stream.set_nonblocking(false).expect("our own socket");
    patient(stream)
}

/// The same stream: reads and writes that take longer than [`limit`] fail.
pub fn patient(stream: UnixStream) -> UnixStream {
    stream.set_read_timeout(Some(limit())).expect("a limit above zero");
    stream.set_write_timeout(Some(limit())).expect("a limit above zero");
    stream
}
