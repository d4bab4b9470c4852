//! Addresses of sockets by paths that are longer than an address has room for.
//!
//! Model: the socket is named within its directory, which is held open: `/proc/self/fd/N/NAME`.
//! Limit: a name of some ninety bytes has no room there either.

use rustix::fs::{CWD, Mode, OFlags, openat};
use rustix::io::Errno;
use rustix::net::SocketAddrUnix;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::Path;

/// An address, as long as this is held.
#[derive(Debug)]
pub(crate) struct FarAddress {
    pub(crate) address: SocketAddrUnix,
    _directory: Option<OwnedFd>,
}

impl FarAddress {
    /// Of this path.
    ///
    /// # Errors
    /// If it is too long all the same, or its directory cannot be opened.
    pub(crate) fn of(path: &Path) -> Result<Self, Errno> {
        let (directory, name) = match (SocketAddrUnix::new(path), path.parent(), path.file_name()) {
            (Err(Errno::NAMETOOLONG), Some(directory), Some(name)) => (directory, name),
            (address, ..) => return Ok(Self { address: address?, _directory: None }),
        };
        let as_place = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
        let held = openat(CWD, directory, as_place, Mode::empty())?;
        let near = Path::new("/proc/self/fd").join(held.as_raw_fd().to_string()).join(name);
        Ok(Self { address: SocketAddrUnix::new(&near)?, _directory: Some(held) })
    }
}
