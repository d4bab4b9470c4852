//! A server and its clients in one thread, and the plain sockets that talk to it.

use super::fake::receive;
use super::{directory, info, wait_until};
use bytemuck::Zeroable;
use patience::{limit, watched};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::server::{Server, ServerEvent};
use shm_abi::{CommanderMemory, DriverMemory};
use std::io::{Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// For a poll that need not wait for anything.
pub(crate) const SHORT: Duration = Duration::from_millis(10);

/// A server that is polled by hand, for what depends on the order of things.
pub(crate) struct Desk {
    pub(crate) memory: DriverMemory,
    pub(crate) server: Server,
    pub(crate) events: Vec<ServerEvent>,
    /// Removed with this value.
    _directory: tempfile::TempDir,
}

impl Desk {
    pub(crate) fn open() -> Self {
        let directory = directory();
        let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        Self {
            memory: DriverMemory::create(&info()).unwrap(),
            server,
            events: Vec::new(),
            _directory: directory,
        }
    }

    /// One that accepts without end, or waits for who does not come, would hold up the test for ever.
    pub(crate) fn poll(&mut self, timeout: Duration) {
        let Self { memory, server, events, .. } = self;
        watched(2 * limit(), "a turn of the server", || server.poll(memory, timeout, events)).unwrap();
    }

    /// Connects and lets the server accept.
    pub(crate) fn connect(&mut self) -> UnixStream {
        let stream = UnixStream::connect(self.server.path()).unwrap();
        self.poll(limit());
        stream
    }

    /// Asks for something that is granted, and maps what is handed over for commanding.
    pub(crate) fn granted(&mut self, kind: RequestKind) -> UnixStream {
        let (stream, offered) = self.offered(kind);
        if let Some(fd) = offered {
            let before = self.events.len();
            CommanderMemory::map(fd.as_fd()).unwrap();
            wait_until("the lease is in force", || {
                self.poll(limit());
                self.events.len() > before
            });
        }
        stream
    }

    /// Asks for something that is granted, and returns the commander's segment, unmapped.
    pub(crate) fn offered(&mut self, kind: RequestKind) -> (UnixStream, Option<OwnedFd>) {
        let mut stream = self.connect();
        stream.write_all(bytemuck::bytes_of(&Request::new(kind, "raw"))).unwrap();
        self.poll(limit());
        stream.set_read_timeout(Some(limit())).unwrap();
        let (answer, fds) = receive(&stream);
        assert_eq!(Verdict::from_word(answer.verdict), Some(Verdict::Granted));
        (stream, fds.into_iter().nth(1))
    }
}

/// The verdict of the answer that lies ready; `None` if the connection was closed without one.
pub(crate) fn verdict(stream: &mut UnixStream) -> Option<Verdict> {
    stream.set_read_timeout(Some(limit())).unwrap();
    let mut answer = Answer::zeroed();
    stream.read_exact(bytemuck::bytes_of_mut(&mut answer)).ok()?;
    Verdict::from_word(answer.verdict)
}

/// Whether the server has hung up; nothing else may lie ready.
pub(crate) fn is_closed(stream: &mut UnixStream) -> bool {
    stream.set_read_timeout(Some(limit())).unwrap();
    // With something of ours unread on the other side, the end comes as a reset.
    match stream.read(&mut [0; 1]) {
        Ok(read) => read == 0,
        Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
    }
}
