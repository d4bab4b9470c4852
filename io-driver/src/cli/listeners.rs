//! Driver processes that listen, whatever became of their sockets' files.
//!
//! Model: the kernel keeps the name under which a socket was made, which for a driver's ends with the process's number.
//! A driver with a network of its own, as a service has, is in that network's table alone; so the table of each network
//! in which a process of a driver's name lives is read, and again for one who is not in it: the kernel tells the table in
//! pieces, and leaves a socket out where another of its bucket is closed between two of them. Directories are compared in full, without symbolic links and
//! detours.
//! Bound: anybody may give a process that name, and fill a table. Whoever stops motors waits no longer than [`PATIENCE`] for
//! the search, but for one table, and is told that it was cut short.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use shm_abi::socket_file::whole_path;

/// Names of a driver's program: by itself, or within the application.
const PROGRAMS: [&str; 2] = ["io-driver", "phantom3"];
/// Longest search.
const PATIENCE: Duration = Duration::from_secs(1);
/// Times that a network's table is read at most. Under a user who does nothing but close sockets, one reading of 300 had left
/// out one of 150.
const READINGS: usize = 3;

/// A driver's process and the socket that it made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listener {
    pub(super) pid: u32,
    pub(super) socket: PathBuf,
}

/// Drivers of this machine that we can see.
#[derive(Debug, Default)]
pub(super) struct Listeners {
    pub(super) all: Vec<Listener>,
    /// There was no time to look at all processes.
    pub(super) is_cut_short: bool,
}

impl Listeners {
    /// Looks for them.
    pub(super) fn find() -> Self {
        Self::find_within(PATIENCE)
    }

    fn find_within(patience: Duration) -> Self {
        let begun = Instant::now();
        let mut found = Self::default();
        let mut tables = HashMap::new();
        for pid in drivers() {
            if begun.elapsed() > patience {
                found.is_cut_short = true;
                break;
            }
            // A network has one file of this number; a process that has ended has none.
            let path = format!("/proc/{pid}/net/unix");
            let Ok(network) = std::fs::metadata(&path).map(|found| found.ino()) else { continue };
            let table: &mut Table = tables.entry(network).or_default();
            let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
            let own = own_number(&status).unwrap_or(pid);
            let directory = || std::fs::read_link(format!("/proc/{pid}/cwd")).unwrap_or_default();
            // None of a process that has ended; a name in it may be any bytes.
            let read = || Some(String::from_utf8_lossy(&std::fs::read(&path).ok()?).into_owned());
            let sockets = table.sockets_of(own, read).map(|socket| directory().join(socket));
            found.all.extend(sockets.map(|socket| Listener { pid, socket }));
        }
        found
    }

    /// The process that listens at this path, or at what that leads to.
    pub(super) fn at(&self, socket: &Path) -> Option<u32> {
        let wanted = [Some(whole_path(socket)), std::fs::canonicalize(socket).ok()];
        let is_it = |listener: &&Listener| wanted.contains(&Some(whole_path(&listener.socket)));
        self.all.iter().find(is_it).map(|listener| listener.pid)
    }
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

/// The sockets that a network's table tells of, by the number of the process that made each; each once: a connection that was
/// taken has a line with the same name.
#[derive(Default)]
struct Table {
    sockets: BTreeMap<u32, BTreeSet<String>>,
    readings: usize,
}

impl Table {
    /// Sockets of a process; the table is read as long as it tells of none.
    fn sockets_of(&mut self, pid: u32, read: impl Fn() -> Option<String>) -> impl Iterator<Item = &str> {
        while self.readings < READINGS && !self.sockets.contains_key(&pid) {
            let Some(text) = read() else { break };
            self.readings += 1;
            for (pid, socket) in text.lines().filter_map(socket_of) {
                self.sockets.entry(pid).or_default().insert(socket.to_owned());
            }
        }
        self.sockets.get(&pid).into_iter().flatten().map(String::as_str)
    }
}

/// The driver's socket that a line of the table tells of, and the number of the process that made it.
fn socket_of(line: &str) -> Option<(u32, &str)> {
    // Address, references, protocol, flags, type, state and inode come before the name.
    let name = (0..7).try_fold(line, |rest, _| Some(rest.trim_start().split_once(' ')?.1))?;
    let (socket, number) = name.rsplit_once('.')?;
    let is_stop_socket = socket.ends_with(".stop");
    let pid = number.parse().ok()?;
    (!is_stop_socket && !socket.starts_with('@')).then_some((pid, socket))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use patience::prelude::*;

    use super::*;

    #[test]
    fn a_line_of_the_table_names_the_socket_of_the_process_that_made_it() {
        let line = "0000000000000000: 00000002 00000000 00010000 0001 01 114705 /run/a b/driver.sock.77";
        assert_eq!(socket_of(line), Some((77, "/run/a b/driver.sock")));
        let stop = "0000000000000000: 00000002 00000000 00000000 0002 01 114706 /run/a b/driver.sock.stop.77";
        assert_eq!(socket_of(stop), None);
        for other in [
            "Num       RefCount Protocol Flags    Type St Inode Path",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114707",
            "0000000000000000: 00000002 00000000 00010000 0001 01 114705 @hidden.77",
        ] {
            assert_eq!(socket_of(other), None);
        }
    }

    /// Anybody may call a process so, and many of them.
    #[test]
    fn a_search_that_takes_too_long_is_cut_short_and_says_so() {
        let directory = tempfile::tempdir().expect("a directory");
        let program = directory.path().join("io-driver-not");
        std::fs::copy("/bin/sleep", &program).expect("a copy");
        let mut child = std::process::Command::new(&program).arg("60").spawn().expect("a process");
        patience::until("its name", || drivers().any(|pid| pid == child.id()));
        assert!(Listeners::find_within(Duration::ZERO).is_cut_short);
        child.kill().expect("it is sent");
        child.bounded_wait();
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
        let read = || Some(table.to_owned());
        let mut table = Table::default();
        assert_eq!(table.sockets_of(77, read).collect::<Vec<_>>(), ["/run/driver.sock"]);
        assert_eq!(table.sockets_of(7, read).count(), 0);
    }

    #[test]
    fn a_driver_that_a_reading_left_out_is_found_by_the_next() {
        let line = |pid: u32| {
            format!("0000000000000000: 00000002 00000000 00010000 0001 01 {pid} /run/{pid}.sock.{pid}\n")
        };
        let readings = Cell::new(0);
        let read = || {
            readings.set(readings.get() + 1);
            Some(if readings.get() == 1 { line(77) } else { line(78) })
        };
        let mut table = Table::default();
        assert_eq!(table.sockets_of(78, read).collect::<Vec<_>>(), ["/run/78.sock"]);
        assert_eq!(table.sockets_of(77, read).collect::<Vec<_>>(), ["/run/77.sock"], "of an earlier reading");
        assert_eq!(readings.get(), 2);
        // Many who have no socket cost no more than one.
        for pid in 0..5 {
            assert_eq!(table.sockets_of(pid, read).count(), 0);
        }
        assert_eq!(readings.get(), READINGS);
        // Of a process that has ended there is nothing to read, which says nothing of others.
        let mut table = Table::default();
        assert_eq!(table.sockets_of(78, || None).count(), 0);
        assert_eq!(table.sockets_of(78, || Some(line(78))).count(), 1);
    }
}
