//! Sockets that another process holds, by its descriptors.
//!
//! Model: whoever may trace a process gets its descriptors (pidfd_getfd(2)), and each socket tells itself under which name it was
//! made and whether it listens: nobody else has a say in that. Whoever may only look at the process learns the numbers of its
//! sockets, which the kernel's table ([`socket_table`](super::socket_table)) has names for.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType, getsockname, sockopt};
use rustix::process::{Pid, PidfdFlags, PidfdGetfdFlags, pidfd_getfd, pidfd_open};

/// Names of the sockets at which a process listens, as far as there is time.
///
/// # Errors
/// Its descriptors cannot be had.
pub(super) fn listening(pid: u32, is_time_left: impl Fn() -> bool) -> io::Result<Vec<PathBuf>> {
    let process = Pid::from_raw(pid.cast_signed()).ok_or(Errno::SRCH)?;
    let process = pidfd_open(process, PidfdFlags::empty())?;
    let mut names = Vec::new();
    for (descriptor, _) in sockets(pid)?.take_while(|_| is_time_left()) {
        match pidfd_getfd(&process, descriptor, PidfdGetfdFlags::empty()) {
            Ok(socket) => names.extend(name_of_listening(&socket)),
            // Closed meanwhile.
            Err(Errno::BADF) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(names)
}

/// Numbers of the sockets that a process has; `None`: we may not see them, or there is no time.
pub(super) fn numbers(pid: u32, is_time_left: impl Fn() -> bool) -> Option<BTreeSet<u64>> {
    let mut numbers = BTreeSet::new();
    for (_, number) in sockets(pid).ok()? {
        numbers.insert(number);
        if !is_time_left() {
            return None;
        }
    }
    Some(numbers)
}

/// Descriptor and number of each socket of a process, proc_pid_fd(5).
fn sockets(pid: u32) -> io::Result<impl Iterator<Item = (i32, u64)>> {
    let entries = std::fs::read_dir(format!("/proc/{pid}/fd"))?;
    Ok(entries.flatten().filter_map(|entry| {
        let link = std::fs::read_link(entry.path()).ok()?;
        let number = link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok()?;
        Some((entry.file_name().to_str()?.parse().ok()?, number))
    }))
}

/// The name of a stream socket that listens, if it is one and has one in the file system.
fn name_of_listening(socket: &OwnedFd) -> Option<PathBuf> {
    let socket = socket.as_fd();
    let is_one = sockopt::socket_domain(socket) == Ok(AddressFamily::UNIX)
        && sockopt::socket_type(socket) == Ok(SocketType::STREAM)
        && sockopt::socket_acceptconn(socket) == Ok(true);
    let address = SocketAddrUnix::try_from(getsockname(socket).ok().filter(|_| is_one)?).ok()?;
    address.path_bytes().map(|name| Path::new(OsStr::from_bytes(name)).to_path_buf())
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};

    use super::*;

    #[test]
    fn a_process_tells_itself_where_it_listens() {
        let directory = tempfile::tempdir().expect("a directory");
        let [listens, two_lines, datagram] =
            ["s", "t\n0: 2 0 10000 1 1 7 x.7", "d"].map(|name| directory.path().join(name));
        let listening_there = [&listens, &two_lines].map(|path| UnixListener::bind(path).expect("a socket"));
        let _other = UnixDatagram::bind(&datagram).expect("a socket");
        // A connection that was taken has the name, too.
        let _connected = UnixStream::connect(&listens).expect("it listens");
        let _taken = patience::accepted(&listening_there[0]);
        let names = listening(std::process::id(), || true).expect("our own");
        let own: Vec<_> = names.into_iter().filter(|name| name.starts_with(directory.path())).collect();
        assert!(own.len() == 2 && own.contains(&listens) && own.contains(&two_lines), "{own:?}");
        assert_eq!(listening(std::process::id(), || false).expect("our own"), Vec::<PathBuf>::new());
        assert!(listening(u32::MAX >> 1, || true).is_err(), "no process has this number");
        assert_eq!(numbers(std::process::id(), || false), None, "no time");
    }
}
