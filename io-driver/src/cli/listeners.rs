//! Driver processes that listen, whatever became of their sockets' files.
//!
//! Model: processes of a driver's name are looked through. Which listening sockets are theirs the kernel tells of those whose
//! descriptors we may see: for root all, else our own. Of others it only tells the name under which a socket was made, which for a
//! driver's ends with the process's number, and which anybody may have given: such a socket is *alleged*. A driver with a
//! network of its own, as a service has, is in that network's table alone; so the table of each network in which such a
//! process lives is read ([`socket_table`](super::socket_table)).
//! Trust: anybody may give a process that name, make sockets for it, and change what a relative name leads to. So whoever is
//! neither root, nor we, nor the owner of the place that is asked about does not listen there.
//! Bound: whoever stops motors waits for the search, and for comparing paths, [`PATIENCE`] each, but for one table, one path;
//! and is told that it was cut short. Directories are compared in full, without symbolic links and detours.

use std::cell::Cell;
use std::collections::{BTreeSet, HashMap};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::socket_table::{Table, Whose};
use shm_abi::socket_file::whole_path;

/// Names of a driver's program: by itself, or within the application.
const PROGRAMS: [&str; 2] = ["io-driver", "phantom3"];
/// Longest search.
const PATIENCE: Duration = Duration::from_secs(1);
/// Of a process: a driver has one.
const MOST_SOCKETS: usize = 4;

/// A driver's process and the socket that it made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listener {
    pub(super) pid: u32,
    /// Its user.
    pub(super) uid: u32,
    pub(super) socket: PathBuf,
    /// It has that socket; else somebody has one of that name.
    pub(super) is_certain: bool,
}

impl Listener {
    /// It is root's, or our own user's: no stranger's.
    pub(super) fn is_ours(&self) -> bool {
        self.uid == 0 || self.uid == own_uid()
    }

    /// No stranger's, or that of the owner of the directory of this place.
    fn may_be_at(&self, place: &Path) -> bool {
        self.is_ours() || owner_of_place(place) == Some(self.uid)
    }
}

/// Drivers of this machine that we can see.
#[derive(Debug, Default)]
pub(super) struct Listeners {
    /// Those of root and of our own user first.
    pub(super) all: Vec<Listener>,
    /// There was no time to look at all processes, or to compare all places.
    is_cut_short: Cell<bool>,
}

impl Listeners {
    /// Looks for them.
    pub(super) fn find() -> Self {
        Self::find_within(PATIENCE)
    }

    fn find_within(patience: Duration) -> Self {
        let begun = Instant::now();
        let is_time_left = || begun.elapsed() <= patience;
        let mut found = Self::default();
        let mut tables = HashMap::new();
        for pid in drivers() {
            if !is_time_left() {
                found.is_cut_short.set(true);
                break;
            }
            // A network has one file of this number; a process that has ended has none.
            let path = format!("/proc/{pid}/net/unix");
            let Ok(network) = std::fs::metadata(&path).map(|found| found.ino()) else { continue };
            let table: &mut Table = tables.entry(network).or_default();
            let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
            let Some(uid) = user(&status) else { continue };
            let whose = match held_sockets(pid, is_time_left) {
                Some(held) => Whose::Held(held),
                None => Whose::Named(own_number(&status).unwrap_or(pid)),
            };
            // None of a process that has ended.
            let read = || is_time_left().then(|| std::fs::read(&path).ok()).flatten();
            let directory = || std::fs::read_link(format!("/proc/{pid}/cwd")).unwrap_or_default();
            let is_certain = matches!(whose, Whose::Held(_));
            let sockets = table.sockets_of(&whose, read).take(MOST_SOCKETS);
            found.all.extend(sockets.map(|name| Listener {
                pid,
                uid,
                socket: directory().join(name),
                is_certain,
            }));
        }
        found.all.sort_by_key(|listener| !listener.is_ours());
        found
    }

    /// The process that listens at this path, or at what that leads to.
    pub(super) fn at(&self, place: &Path) -> Option<u32> {
        let begun = Instant::now();
        let wanted = [Some(whole_path(place)), std::fs::canonicalize(place).ok()];
        for listener in self.all.iter().filter(|listener| listener.may_be_at(place)) {
            if begun.elapsed() > PATIENCE {
                self.is_cut_short.set(true);
                break;
            }
            if wanted.contains(&Some(whole_path(&listener.socket))) {
                return Some(listener.pid);
            }
        }
        None
    }

    /// There may be others.
    pub(super) fn is_cut_short(&self) -> bool {
        self.is_cut_short.get()
    }
}

fn own_uid() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Owner of the directory of a place, or of the part of the way there that is left.
fn owner_of_place(place: &Path) -> Option<u32> {
    let directory = std::path::absolute(place).ok()?;
    directory
        .ancestors()
        .skip(1)
        .find_map(|directory| std::fs::metadata(directory).ok())
        .map(|found| found.uid())
}

/// All processes that have the driver's name.
fn drivers() -> impl Iterator<Item = u32> {
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|pid: &u32| {
        let name = std::fs::read(format!("/proc/{pid}/comm")).unwrap_or_default();
        PROGRAMS.iter().any(|program| name.starts_with(program.as_bytes()))
    })
}

/// A process's number where it lives, proc(5): in a container it names its socket by that.
fn own_number(status: &str) -> Option<u32> {
    status.lines().find_map(|line| line.strip_prefix("NSpid:"))?.split_whitespace().next_back()?.parse().ok()
}

/// Its effective user.
fn user(status: &str) -> Option<u32> {
    status.lines().find_map(|line| line.strip_prefix("Uid:"))?.split_whitespace().nth(1)?.parse().ok()
}

/// Numbers of the sockets that a process has; `None`: we may not see them, or there is no time.
fn held_sockets(pid: u32, is_time_left: impl Fn() -> bool) -> Option<BTreeSet<u64>> {
    let mut held = BTreeSet::new();
    for entry in std::fs::read_dir(format!("/proc/{pid}/fd")).ok()? {
        let link = std::fs::read_link(entry.ok()?.path()).unwrap_or_default();
        let number: Option<u64> =
            link.to_str().and_then(|link| link.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok());
        held.extend(number);
        if !is_time_left() {
            return None;
        }
    }
    Some(held)
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use patience::prelude::*;

    use super::*;

    /// Anybody may call a process so, and many of them.
    #[test]
    fn a_search_that_takes_too_long_is_cut_short_and_says_so() {
        let directory = tempfile::tempdir().expect("a directory");
        let program = directory.path().join("io-driver-not");
        std::fs::copy("/bin/sleep", &program).expect("a copy");
        let mut child = std::process::Command::new(&program).arg("60").spawn().expect("a process");
        patience::until("its name", || drivers().any(|pid| pid == child.id()));
        assert!(Listeners::find_within(Duration::ZERO).is_cut_short());
        child.kill().expect("it is sent");
        child.bounded_wait();
    }

    #[test]
    fn a_status_tells_number_and_user() {
        assert_eq!(own_number("Name:\tio-driver\nPid:\t4711\nNSpid:\t4711\t23\t1\n"), Some(1));
        assert_eq!(own_number("Pid:\t4711\nNSpid:\t4711\n"), Some(4711));
        assert_eq!(own_number("Pid:\t4711\n"), None);
        assert_eq!(user("Tgid:\t1\nUid:\t1000\t1001\t1002\t1003\n"), Some(1001));
        assert_eq!(user("Uid:\n"), None);
    }

    #[test]
    fn our_own_sockets_are_known_by_our_descriptors() {
        let directory = tempfile::tempdir().expect("a directory");
        let listener = UnixListener::bind(directory.path().join("s")).expect("a socket");
        let held = held_sockets(std::process::id(), || true).expect("our own");
        let text = std::fs::read("/proc/self/net/unix").expect("the table");
        let whose = Whose::Held(held);
        let mut table = Table::default();
        let mut sockets = table.sockets_of(&whose, || Some(text.clone()));
        assert!(sockets.any(|socket| socket == directory.path().join("s")));
        drop(listener);
        assert_eq!(held_sockets(std::process::id(), || false), None, "no time");
    }

    #[test]
    fn a_stranger_listens_nowhere_but_in_his_own_directory() {
        let directory = tempfile::tempdir().expect("a directory");
        let (own, place) = (own_uid(), directory.path().join("gone/driver.sock"));
        assert_eq!(owner_of_place(&place), Some(own), "of what is left of the way there");
        let at = |uid: u32, place: &Path| {
            let listener = Listener { pid: 1, uid, socket: place.to_path_buf(), is_certain: false };
            Listeners { all: vec![listener], ..Listeners::default() }.at(place)
        };
        assert_eq!([at(own, &place), at(0, &place)], [Some(1); 2]);
        assert_eq!(at(own + 1, &place), None);
        // The directory is given away, which takes root.
        if own == 0 {
            std::os::unix::fs::chown(directory.path(), Some(1), None).expect("root may");
            assert_eq!([at(1, &place), at(2, &place)], [Some(1), None]);
        }
    }
}
