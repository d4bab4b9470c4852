//! Emergency stop by datagram: the way to stop the motors that needs no connection.
//!
//! Problem: a connection has to be accepted, needs a free descriptor and waits for the thread that serves all others.
//! Model: a second socket lies beside the driver's, named like it with `.stop` behind. Whatever is sent to it, even
//! nothing, is an emergency stop; the kernel tells which user sent it. Whoever may connect to the driver may send. A
//! queue that is full holds stops that are on their way, so sending never waits; whoever wants a stop to be his own, which
//! nobody else may undo, asks over a connection then.
//! Invariants: the receiver acts on a datagram before anybody takes it, and takes it in another thread ([`Drain`]):
//! before Linux 6.16 descriptors that come with it take as long to close as their sender likes (a TCP connection that
//! lingers). It needs neither memory nor descriptors for it.

use crate::far_address::FarAddress;
use crate::socket_file::{self, BindError, SocketFile};
use crate::users::known_user;
use crate::{peer, users};
use nix::cmsg_space;
use nix::libc::ucred;
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg};
use rustix::net::{AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType};
use std::io::{self, IoSliceMut};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

const SUFFIX: &str = ".stop";

/// Where the stop socket of the driver at `socket` lies.
pub fn path_beside(socket: &Path) -> PathBuf {
    socket_file::suffixed(socket, SUFFIX)
}

/// Outcome of sending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sent {
    /// It is in the queue.
    Queued,
    /// The queue is full of stops, which are on their way and may all be others'.
    QueueFull,
}

/// Asks the driver at `socket` for an emergency stop; never waits. Where that is a symbolic link, the driver is asked at what it
/// leads to as well, which alone counts: beside the link may be what a dead driver has left, or a stranger.
///
/// # Errors
/// If there is no driver, or the kernel does not let us send. That it was sent does not say that it was done: a frame
/// tells.
pub fn send(socket: &Path) -> io::Result<Sent> {
    let sent = send_beside(socket);
    if !socket.is_symlink() {
        return sent;
    }
    std::fs::canonicalize(socket).and_then(|target| send_beside(&target))
}

fn send_beside(socket: &Path) -> io::Result<Sent> {
    let far = FarAddress::of(&path_beside(socket))?;
    let sender =
        rustix::net::socket_with(AddressFamily::UNIX, SocketType::DGRAM, SocketFlags::CLOEXEC, None)?;
    match rustix::net::sendto(&sender, b"stop", SendFlags::DONTWAIT | SendFlags::NOSIGNAL, &far.address) {
        Ok(_) => Ok(Sent::Queued),
        Err(rustix::io::Errno::AGAIN) => Ok(Sent::QueueFull),
        Err(errno) => Err(errno.into()),
    }
}

/// The driver's end.
#[derive(Debug)]
pub struct StopSocket {
    socket: UnixDatagram,
    control: Vec<u8>,
}

impl StopSocket {
    /// Listens beside `socket`, which must be held already: whoever holds it may replace what lies beside it. Its name
    /// goes with the second value.
    ///
    /// # Errors
    /// What the file system says.
    pub fn bind(socket: &Path) -> Result<(Self, SocketFile), BindError> {
        users::look();
        let tell_sender = |socket: &UnixDatagram| {
            peer::refuse_descriptors(socket);
            Ok(rustix::net::sockopt::set_socket_passcred(socket, true)?)
        };
        let (socket, file) =
            SocketFile::make(&path_beside(socket), |path| UnixDatagram::bind(path), tell_sender)?;
        Ok((Self { socket, control: cmsg_space!(ucred) }, file))
    }

    /// Another hold on the socket, for the thread that takes what was heard.
    ///
    /// # Errors
    /// If there is no descriptor left.
    pub fn drain(&self) -> io::Result<Drain> {
        self.socket.try_clone().map(Drain)
    }

    /// Waits for a datagram and tells which user sent it (`None`: the kernel did not say). It stays the first one until
    /// it is [taken](Drain::take).
    ///
    /// # Errors
    /// What the kernel says, an interruption by a signal included.
    pub fn hear(&mut self) -> io::Result<Option<u32>> {
        let mut byte = [0];
        let mut parts = [IoSliceMut::new(&mut byte)];
        let fd = self.socket.as_raw_fd();
        let received = recvmsg::<()>(fd, &mut parts, Some(&mut self.control), MsgFlags::MSG_PEEK)?;
        let sender = received.cmsgs().into_iter().flatten().find_map(|message| match message {
            ControlMessageOwned::ScmCredentials(credentials) => known_user(credentials.uid()),
            _ => None,
        });
        Ok(sender)
    }
}

/// The end of the queue.
#[derive(Debug)]
pub struct Drain(UnixDatagram);

impl Drain {
    /// Takes the first datagram, if there is one. Takes as long as whatever came with it takes to close.
    pub fn take(&self) {
        let mut nothing = [0; 1];
        let _ = rustix::net::recv(&self.0, &mut nothing, RecvFlags::DONTWAIT);
    }
}
