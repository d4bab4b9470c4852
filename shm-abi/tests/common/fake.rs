//! Drivers that lie: a socket on which the test itself answers.

use bytemuck::Zeroable;
use shm_abi::handshake::{Answer, Request};
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// Serves so many connections, each by `talk`, which closes it by returning.
pub(crate) fn fake_server(
    socket: &Path,
    connections: usize,
    talk: impl Fn(UnixStream) + Send + 'static,
) -> std::thread::JoinHandle<()> {
    let listener = UnixListener::bind(socket).unwrap();
    std::thread::spawn(move || listener.incoming().take(connections).for_each(|stream| talk(stream.unwrap())))
}

/// Waits for the whole request.
pub(crate) fn hear(stream: &mut UnixStream) {
    stream.read_exact(&mut [0; size_of::<Request>()]).unwrap();
}

/// Sends bytes and descriptors in one go, if the other side takes descriptors.
pub(crate) fn try_send(
    stream: &UnixStream,
    bytes: &[u8],
    fds: &[std::os::fd::BorrowedFd<'_>],
) -> std::io::Result<()> {
    use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags};
    let mut space = [std::mem::MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(4))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    assert!(control.push(SendAncillaryMessage::ScmRights(fds)));
    let sent =
        rustix::net::sendmsg(stream, &[std::io::IoSlice::new(bytes)], &mut control, SendFlags::empty())?;
    assert_eq!(sent, bytes.len());
    Ok(())
}

/// The same to somebody who takes them.
pub(crate) fn send(stream: &UnixStream, bytes: &[u8], fds: &[std::os::fd::BorrowedFd<'_>]) {
    try_send(stream, bytes, fds).unwrap();
}

/// Receives an answer and the descriptors that come with it.
pub(crate) fn receive(stream: &UnixStream) -> (Answer, Vec<OwnedFd>) {
    use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags};
    let mut space = [std::mem::MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(4))];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    let mut answer = Answer::zeroed();
    let mut into = [std::io::IoSliceMut::new(bytemuck::bytes_of_mut(&mut answer))];
    let received = rustix::net::recvmsg(stream, &mut into, &mut control, RecvFlags::CMSG_CLOEXEC).unwrap();
    assert_eq!(received.bytes, size_of::<Answer>());
    let fds = control.drain().filter_map(|message| match message {
        RecvAncillaryMessage::ScmRights(fds) => Some(fds),
        _ => None,
    });
    (answer, fds.flatten().collect())
}
