//! Messages with descriptors over a Unix stream socket.

use bytemuck::Pod;
use rustix::io::{Errno, retry_on_intr};
use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, ReturnFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, recvmsg, sendmsg,
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
    // The kernel leaves out descriptors for which this process has no room, and says nothing else.
    if received.flags.contains(ReturnFlags::CTRUNC) {
        return Err(Errno::MFILE.into());
    }
    Ok(received.bytes)
}

/// Whether the other end is still there; never blocks.
pub(crate) fn is_open(socket: &impl AsFd) -> bool {
    let mut byte = [0u8; 1];
    match rustix::net::recv(socket, &mut byte, RecvFlags::PEEK | RecvFlags::DONTWAIT) {
        Ok((_, received)) => received > 0,
        Err(errno) => errno == Errno::AGAIN || errno == Errno::INTR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;
    use std::io::{Read, Write};
    use std::os::unix::net::UnixStream;

    type Message = [u8; 256];

    /// What comes of a message that is sent in parts with pauses between them.
    fn received(parts: usize, pause: Duration, patience: Duration) -> io::Result<Message> {
        let (mut far, near) = UnixStream::pair()?;
        let sender = std::thread::spawn(move || {
            for part in [7; size_of::<Message>()].chunks(size_of::<Message>() / parts) {
                // The receiver may have hung up.
                let _ = far.write_all(part);
                std::thread::sleep(pause);
            }
        });
        let received = receive::<Message>(near.as_fd(), patience).map(|(message, _)| message);
        drop(near);
        sender.bounded_join().expect("the sender ends");
        received
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn a_message_that_is_whole_needs_no_patience() {
        assert_eq!(received(1, Duration::ZERO, Duration::ZERO).expect("whole"), [7; 256]);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn a_message_in_parts_is_waited_for() {
        let (pause, patience) = (Duration::from_millis(20), Duration::from_secs(600));
        assert_eq!(received(4, pause, patience).expect("patience enough"), [7; 256]);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn a_message_that_drips_is_given_up() {
        let error = received(256, Duration::from_millis(2), Duration::from_millis(20)).expect_err("too slow");
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn half_a_message_is_none() {
        let (mut far, near) = UnixStream::pair().expect("sockets");
        far.write_all(&[7; 128]).expect("room for it");
        drop(far);
        let error = receive::<Message>(near.as_fd(), Duration::from_secs(600)).expect_err("half");
        assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn an_end_is_open_until_the_other_one_is_closed() {
        let (mut far, mut near) = UnixStream::pair().expect("sockets");
        let look = near.try_clone().expect("a descriptor");
        assert!(std::thread::spawn(move || is_open(&look)).bounded_join().expect("it never blocks"));
        far.write_all(&[7]).expect("room for it");
        assert!(is_open(&near), "something lies ready");
        near.set_nonblocking(true).expect("a socket");
        let mut byte = [0];
        assert_eq!(near.read(&mut byte).expect("what lay ready was left there"), 1);
        drop(far);
        assert!(!is_open(&near));
    }

    /// What was never read there comes back as a reset.
    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn an_end_that_was_reset_is_not_open() {
        let (far, mut near) = UnixStream::pair().expect("sockets");
        near.write_all(&[7]).expect("room for it");
        drop(far);
        assert!(!is_open(&near));
    }
}
