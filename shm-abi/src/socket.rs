//! Messages with descriptors over a Unix stream socket.

use bytemuck::Pod;
use rustix::io::retry_on_intr;
use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage,
    SendFlags, recvmsg, sendmsg,
};
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::{Duration, Instant};

/// At most this many descriptors travel with a message.
const MAX_DESCRIPTORS: usize = 2;

/// Sends a message and descriptors in one go. The messages are far smaller than any socket buffer, so a
/// partial send means that the other side is not reading; it counts as an error.
pub(crate) fn send<M: Pod>(socket: BorrowedFd<'_>, message: &M, fds: &[BorrowedFd<'_>]) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    if !fds.is_empty() {
        control.push(SendAncillaryMessage::ScmRights(fds));
    }
    let bytes = bytemuck::bytes_of(message);
    let sent = retry_on_intr(|| sendmsg(socket, &[IoSlice::new(bytes)], &mut control, SendFlags::NOSIGNAL))?;
    if sent == bytes.len() { Ok(()) } else { Err(io::ErrorKind::WriteZero.into()) }
}

/// Receives one message of exactly `M`'s size, and the descriptors that came with it. Waits for `patience`
/// in all, and beyond that once as long as the socket's receive time-out allows: a sender that drips byte
/// after byte does not hold us for ever.
pub(crate) fn receive<M: Pod>(socket: BorrowedFd<'_>, patience: Duration) -> io::Result<(M, Vec<OwnedFd>)> {
    let started = Instant::now();
    let mut message = M::zeroed();
    let bytes = bytemuck::bytes_of_mut(&mut message);
    let mut fds = Vec::new();
    let mut filled = 0;
    while filled < bytes.len() {
        match receive_some(socket, &mut bytes[filled..], &mut fds)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            more => filled += more,
        }
        if filled < bytes.len() && started.elapsed() > patience {
            return Err(io::ErrorKind::TimedOut.into());
        }
    }
    Ok((message, fds))
}

fn receive_some(socket: BorrowedFd<'_>, into: &mut [u8], fds: &mut Vec<OwnedFd>) -> io::Result<usize> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    // With a time-out set, the kernel interrupts even for a stop and continue from the terminal.
    let received = retry_on_intr(|| {
        recvmsg(socket, &mut [IoSliceMut::new(into)], &mut control, RecvFlags::CMSG_CLOEXEC)
    })?;
    for message in control.drain() {
        if let RecvAncillaryMessage::ScmRights(arrived) = message {
            fds.extend(arrived);
        }
    }
    Ok(received.bytes)
}

/// Whether the other end is still there; never blocks.
pub(crate) fn is_open(socket: &impl AsFd) -> bool {
    let mut byte = [0u8; 1];
    match rustix::net::recv(socket, &mut byte, RecvFlags::PEEK | RecvFlags::DONTWAIT) {
        Ok((_, received)) => received > 0,
        Err(errno) => errno == rustix::io::Errno::AGAIN || errno == rustix::io::Errno::INTR,
    }
}
