//! Driver processes that listen, whatever became of their sockets' files.
//!
//! Model: the kernel keeps the name under which a socket was made, which for a driver's ends with the process's number.
//! A driver with a network of its own, as a service has, is in that network's table alone; so each process's own table
//! is read. Directories are compared in full, without symbolic links and detours.
//! Cost: a table for each process that is called like a driver; only for who found no driver to ask.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use shm_abi::socket_file::whole_path;

/// Names of a driver's program: by itself, or within the application.
const PROGRAMS: [&str; 2] = ["io-driver", "phantom3"];

/// A driver's process and the socket that it made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listener {
    pub(super) pid: u32,
    pub(super) socket: PathBuf,
}

/// The process that listens at this path.
pub(super) fn at(socket: &Path) -> Option<u32> {
    let wanted = whole_path(socket);
    all().find(|listener| whole_path(&listener.socket) == wanted).map(|listener| listener.pid)
}

/// All drivers of this machine that we can see.
pub(super) fn all() -> impl Iterator<Item = Listener> {
    drivers().flat_map(|pid| {
        // A name in it may be any bytes.
        let table = std::fs::read(format!("/proc/{pid}/net/unix")).unwrap_or_default();
        let table = String::from_utf8_lossy(&table).into_owned();
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        let own = own_number(&status).unwrap_or(pid);
        let directory = || std::fs::read_link(format!("/proc/{pid}/cwd")).unwrap_or_default();
        let sockets = sockets_of(own, &table).into_iter().map(|socket| directory().join(socket));
        sockets.collect::<Vec<PathBuf>>().into_iter().map(move |socket| Listener { pid, socket })
    })
}

/// All processes that have the driver's name.
fn drivers() -> impl Iterator<Item = u32> {
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|pid: &u32| {
        let name = std::fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
        PROGRAMS.iter().any(|program| name.starts_with(program))
    })
}

/// A process's number where it lives, proc(5): in a container it names its socket by that.
fn own_number(status: &str) -> Option<u32> {
    status.lines().find_map(|line| line.strip_prefix("NSpid:"))?.split_whitespace().next_back()?.parse().ok()
}

/// The driver's sockets that a table tells of, each once: a connection that was taken has a line with the same name.
fn sockets_of(pid: u32, table: &str) -> BTreeSet<&str> {
    table.lines().filter_map(|line| socket_of(pid, line)).collect()
}

/// The driver's socket that a line of the table tells of, if this process made it.
fn socket_of(pid: u32, line: &str) -> Option<&str> {
    // Address, references, protocol, flags, type, state and inode come before the name.
    let name = (0..7).try_fold(line, |rest, _| Some(rest.trim_start().split_once(' ')?.1))?;
    let (socket, number) = name.rsplit_once('.')?;
    let is_stop_socket = socket.ends_with(".stop");
    (number == pid.to_string() && !is_stop_socket && !socket.starts_with('@')).then_some(socket)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_table_names_the_socket_of_the_process_that_made_it() {
        let line = "0000000000000000: 00000002 00000000 00010000 0001 01 114705 /run/a b/driver.sock.77";
        assert_eq!(socket_of(77, line), Some("/run/a b/driver.sock"));
        assert_eq!(socket_of(7, line), None);
        let stop = "0000000000000000: 00000002 00000000 00000000 0002 01 114706 /run/a b/driver.sock.stop.77";
        assert_eq!(socket_of(77, stop), None);
        for other in [
            "Num       RefCount Protocol Flags    Type St Inode Path",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114707",
            "0000000000000000: 00000002 00000000 00010000 0001 01 114705 @hidden.77",
        ] {
            assert_eq!(socket_of(77, other), None);
        }
    }

    #[test]
    fn a_driver_in_a_container_has_a_number_of_its_own_there() {
        assert_eq!(own_number("Name:\tio-driver\nPid:\t4711\nNSpid:\t4711\t23\t1\n"), Some(1));
        assert_eq!(own_number("Pid:\t4711\nNSpid:\t4711\n"), Some(4711));
        assert_eq!(own_number("Pid:\t4711\n"), None);
    }

    #[test]
    fn a_driver_that_serves_somebody_is_told_once() {
        let table = "0000000000000000: 00000002 00000000 00010000 0001 01 114705 /run/driver.sock.77\n\
                     0000000000000000: 00000003 00000000 00000000 0001 03 114709 /run/driver.sock.77";
        assert_eq!(sockets_of(77, table), BTreeSet::from(["/run/driver.sock"]));
    }
}
