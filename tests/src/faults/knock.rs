//! Clients that a driver's socket must not be hurt by: of other versions, with other manners, too many.

use bytemuck::Zeroable;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::{ABI_MAJOR, ABI_MINOR, ABI_VERSION, LAYOUT_HASH};
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// Somebody who asks for the lease, and the verdict that is due.
#[derive(Debug, Clone, Copy)]
pub struct Foreigner {
    /// Who.
    pub name: &'static str,
    /// What it says.
    pub request: Request,
    /// What it is told.
    pub verdict: Verdict,
}

/// Everybody who cannot share memory with this driver.
pub fn foreigners() -> [Foreigner; 6] {
    let good = Request::new(RequestKind::Command, "foreigner");
    let version = |major: u32, minor: u32| u64::from(major) << 32 | u64::from(minor);
    let foreigner = |name, request, verdict| Foreigner { name, request, verdict };
    let newer = Request { abi_version: version(ABI_MAJOR + 1, 0), ..good };
    let older = Request { abi_version: version(ABI_MAJOR - 1, 9), ..good };
    let other_minor =
        Request { abi_version: version(ABI_MAJOR, ABI_MINOR + 1), layout_hash: LAYOUT_HASH ^ 1, ..good };
    [
        foreigner("a newer major version", newer, Verdict::WrongVersion),
        foreigner("an older major version", older, Verdict::WrongVersion),
        foreigner("another minor version with another layout", other_minor, Verdict::WrongLayout),
        foreigner("another layout", Request { layout_hash: !LAYOUT_HASH, ..good }, Verdict::WrongLayout),
        foreigner("another protocol", Request { magic: 0x5048, ..good }, Verdict::WrongMagic),
        foreigner("a request of the future", Request { kind: 99, ..good }, Verdict::UnknownKind),
    ]
}

/// Says this to a driver and hears its answer.
///
/// # Errors
/// If there is no driver, or it does not answer.
pub fn ask(socket: &Path, request: &Request) -> io::Result<Answer> {
    let mut stream = UnixStream::connect(socket)?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.write_all(bytemuck::bytes_of(request))?;
    let mut answer = Answer::zeroed();
    stream.read_exact(bytemuck::bytes_of_mut(&mut answer))?;
    Ok(answer)
}

/// Each foreigner, one after the other; whether the answers are `checked`.
///
/// # Panics
/// If a checked answer is another than the one that is due.
pub fn all_foreigners(socket: &Path, checked: bool) {
    for foreigner in foreigners() {
        match ask(socket, &foreigner.request) {
            Ok(answer) => check(&foreigner, &answer),
            Err(error) => {
                assert!(!checked, "{}: {error}", foreigner.name);
                return;
            }
        }
    }
}

/// The verdict, both versions, and nothing handed over.
///
/// # Panics
/// If the answer is another than the one that is due.
pub fn check(foreigner: &Foreigner, answer: &Answer) {
    let name = foreigner.name;
    assert_eq!(Verdict::from_word(answer.verdict), Some(foreigner.verdict), "{name}");
    assert_eq!((answer.abi_version, answer.layout_hash), (ABI_VERSION, LAYOUT_HASH), "{name}");
    assert_eq!(answer.lease, 0, "{name}");
}

/// So many clients: some say nothing, some half of what they should, some too much, some want to look on. They
/// stay until they are dropped; whoever is not let in any more is not among them.
pub fn crowd(socket: &Path, clients: usize) -> Vec<UnixStream> {
    let observe = Request::new(RequestKind::Observe, "crowd");
    let bytes = bytemuck::bytes_of(&observe);
    let mut crowd = Vec::new();
    for index in 0..clients {
        let Ok(mut stream) = connect_at_once(socket) else { continue };
        // Whether it is heard is the driver's affair.
        let _ = match index % 4 {
            0 => Ok(()),
            1 => stream.write_all(&bytes[..bytes.len() / 2]),
            2 => stream.write_all(&[0x5a; 1000]),
            _ => stream.write_all(bytes),
        };
        crowd.push(stream);
    }
    crowd
}

/// Does not wait where the queue of newcomers is full, as that of a stopped driver.
fn connect_at_once(socket: &Path) -> io::Result<UnixStream> {
    let address = SocketAddrUnix::new(socket)?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let stream = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    connect(&stream, &address)?;
    Ok(stream.into())
}
