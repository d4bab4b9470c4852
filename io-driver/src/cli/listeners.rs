//! Driver processes that listen, whatever became of their sockets' files.
//!
//! Model: processes of a driver's name are looked through, those of root and our own user first. Where these listen their own
//! [sockets](held_sockets) tell root, and others where the system lets them trace their own processes. Else the kernel's table
//! of sockets is read ([`socket_table`](super::socket_table)): with the numbers of the sockets that a process holds, if we may
//! see them, or by the names under which sockets were made, which for a driver's end with the process's number. A driver with
//! a network of its own, as a service has, is in that network's table alone.
//! Trust: anybody may give a process that name, make sockets for it, write lines into the table, and change what a name leads
//! to. So a driver is *certain* to listen at a path only if whoever is connected to there is that process, as the kernel says, and
//! of root or our own user, for a socket outlives the process by which it was made to listen; no other path is to be used. And whoever is neither root, nor we, nor the owner of the place that is asked about, nor of the group
//! that may make files there, does not listen there. A process whose users differ, as that of a program with its owner's rights,
//! is that of whoever started it.
//! Bound: whoever stops motors waits for the search, and for comparing names of each place, [`PATIENCE`]; and is told
//! that it was cut short. Directories are compared in full, without symbolic links and detours.

use std::cell::Cell;
use std::collections::HashMap;
use std::fs::{File, Metadata};
use std::io::Read;
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use shm_abi::peer::Peer;
use shm_abi::socket_file::whole_path;
use shm_abi::users::known_user;

use super::held_sockets;
use super::socket_table::{Table, Whose, made_as};

/// Names of a driver's program: by itself, or within the application.
const PROGRAMS: [&str; 2] = ["io-driver", "phantom3"];
/// Longest search.
const PATIENCE: Duration = Duration::from_secs(1);

/// A driver's process and a socket of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listener {
    pub(super) pid: u32,
    pub(super) owner: Owner,
    pub(super) socket: PathBuf,
    pub(super) there: There,
}

/// Who is reached at a listener's path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum There {
    /// The listener: that is certain.
    Itself,
    /// Nobody, or nobody has looked: somebody has, or had, a socket of that name.
    Nobody,
    /// Somebody else: the name is that of another mount namespace, was taken over, or was made up.
    Other,
}

/// Whose a process is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Owner {
    /// None: one of those who cannot be told apart.
    pub(super) user: Option<u32>,
    groups: Vec<u32>,
}

impl Owner {
    /// By its status, proc(5).
    fn of(status: &str) -> Option<Self> {
        let numbers = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().map(|number| number.parse().ok()).collect::<Option<Vec<u32>>>()
        };
        let users = numbers("Uid:").filter(|users| !users.is_empty())?;
        let user = users.iter().copied().find(|user| *user != 0).unwrap_or(0);
        let groups = ["Gid:", "Groups:"].into_iter().filter_map(numbers).flatten().collect();
        Some(Self { user: known_user(user), groups })
    }

    /// Root, or our own user: no stranger.
    fn is_ours(&self) -> bool {
        self.user.is_some_and(|user| user == 0 || user == own_uid())
    }

    /// No stranger, or one who may make files in this directory as its owner or by its group.
    fn may_be_in(&self, directory: Option<&Metadata>) -> bool {
        let may_make = |directory: &Metadata| {
            let is_of_group = directory.mode() & 0o020 != 0 && self.groups.contains(&directory.gid());
            self.user.is_some_and(|user| known_user(directory.uid()) == Some(user) || is_of_group)
        };
        self.is_ours() || directory.is_some_and(may_make)
    }
}

impl Listener {
    /// It is no stranger's.
    pub(super) fn is_ours(&self) -> bool {
        self.owner.is_ours()
    }

    /// With who is there.
    fn looked_at(self) -> Self {
        let is_itself = |peer: Peer| {
            let is_ours = peer.user().is_some_and(|user| user == 0 || user == own_uid());
            is_ours && peer.pid == self.pid
        };
        let there = match peer_at(&self.socket).map(is_itself) {
            Some(true) => There::Itself,
            Some(false) => There::Other,
            None => There::Nobody,
        };
        Self { there, ..self }
    }
}

/// Drivers of this machine that we can see.
#[derive(Debug, Default)]
pub(super) struct Listeners {
    /// Those of root and of our own user first, and of these the certain ones.
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
        let mut found = Self::default();
        let is_time_left = || {
            let is_left = begun.elapsed() <= patience;
            found.is_cut_short.set(found.is_cut_short.get() || !is_left);
            is_left
        };
        let mut all = Vec::new();
        let mut tables = HashMap::new();
        for (pid, status, owner) in drivers(is_time_left) {
            if !is_time_left() {
                break;
            }
            let directory = std::fs::read_link(format!("/proc/{pid}/cwd")).unwrap_or_default();
            let mut add = |name: &Path| {
                let (owner, socket) = (owner.clone(), directory.join(made_as(name)));
                let listener = Listener { pid, owner, socket, there: There::Nobody };
                let may_look = listener.is_ours() && listener.socket.is_absolute();
                all.push(if may_look { listener.looked_at() } else { listener });
            };
            // What a stranger holds says no more than what he calls it.
            let told = if owner.is_ours() { held_sockets::listening(pid, is_time_left).ok() } else { None };
            if let Some(names) = told {
                names.iter().take_while(|_| is_time_left()).for_each(|name| add(name));
                continue;
            }
            // A network has one file of this number; a process that has ended has none.
            let path = format!("/proc/{pid}/net/unix");
            let Ok(network) = std::fs::metadata(&path).map(|found| found.ino()) else { continue };
            let table: &mut Table = tables.entry(network).or_default();
            let held = if owner.is_ours() { held_sockets::numbers(pid, is_time_left) } else { None };
            let whose = held.map_or_else(|| Whose::Named(own_number(&status).unwrap_or(pid)), Whose::Held);
            let names = table.sockets_of(&whose, || read_within(&path, is_time_left));
            names.take_while(|_| is_time_left()).for_each(add);
        }
        all.sort_by_key(|listener| (!listener.is_ours(), listener.there));
        found.all = all;
        found
    }

    /// The process that listens at this path, or at what that leads to.
    pub(super) fn at(&self, place: &Path) -> Option<u32> {
        let begun = Instant::now();
        let wanted =
            [std::path::absolute(place).ok(), Some(whole_path(place)), std::fs::canonicalize(place).ok()];
        let directory = directory_of(place);
        let mut others = self
            .all
            .iter()
            .take_while(|_| {
                let is_late = begun.elapsed() > PATIENCE;
                self.is_cut_short.set(self.is_cut_short.get() || is_late);
                !is_late
            })
            .filter(|listener| listener.socket.is_absolute() && listener.owner.may_be_in(directory.as_ref()));
        // Names first, for paths take time.
        let is_named =
            |listener: &&Listener| wanted.iter().flatten().any(|wanted| is_told_as(wanted, &listener.socket));
        if let Some(listener) = others.clone().find(is_named) {
            return Some(listener.pid);
        }
        others
            .find(|listener| wanted.contains(&Some(whole_path(&listener.socket))))
            .map(|listener| listener.pid)
    }

    /// There may be others.
    pub(super) fn is_cut_short(&self) -> bool {
        self.is_cut_short.get()
    }
}

/// True for a path, and for the name by which the kernel's table tells of it: a line of that ends at the first end of a line.
fn is_told_as(path: &Path, name: &Path) -> bool {
    let bytes = path.as_os_str().as_bytes();
    path == name || bytes.split(|byte| *byte == b'\n').next() == Some(name.as_os_str().as_bytes())
}

/// Who listens at a path, or began to, as the kernel tells whoever connects. Never waits.
fn peer_at(path: &Path) -> Option<Peer> {
    let address = SocketAddrUnix::new(path).ok()?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let asking = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None).ok()?;
    connect(&asking, &address).ok()?;
    // None that is visible here has the number 0, which no process of ours has.
    Peer::of(asking.as_fd()).ok()
}

/// The text of a table, or its whole lines as far as there was time.
fn read_within(path: &str, is_time_left: impl Fn() -> bool) -> Option<Vec<u8>> {
    let mut file = File::open(path).ok()?;
    let (mut text, mut piece) = (Vec::new(), vec![0; PIECE_BYTES]);
    while is_time_left() {
        match file.read(&mut piece) {
            Ok(0) => return Some(text),
            Ok(more) => text.extend_from_slice(&piece[..more]),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(_) => return None,
        }
    }
    let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
    text.truncate(whole);
    Some(text)
}

/// As much as the kernel tells at once of a table.
const PIECE_BYTES: usize = 1 << 16;

fn own_uid() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// The directory of a place, or the part of the way there that is left.
fn directory_of(place: &Path) -> Option<Metadata> {
    let place = std::path::absolute(place).ok()?;
    place.ancestors().skip(1).find_map(|directory| std::fs::metadata(directory).ok())
}

/// All processes that have the driver's name, with status and owner: those of root and of our own user first.
fn drivers(is_time_left: impl Fn() -> bool) -> Vec<(u32, String, Owner)> {
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten().take_while(|_| is_time_left());
    let pids = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let mut drivers: Vec<_> = pids
        .filter(|pid: &u32| {
            let name = std::fs::read(format!("/proc/{pid}/comm")).unwrap_or_default();
            PROGRAMS.iter().any(|program| name.starts_with(program.as_bytes()))
        })
        .filter_map(|pid| {
            let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
            let owner = Owner::of(&status)?;
            Some((pid, status, owner))
        })
        .collect();
    drivers.sort_by_key(|(_, _, owner)| !owner.is_ours());
    drivers
}

/// A process's number where it lives, proc(5): in a container it names its socket by that.
fn own_number(status: &str) -> Option<u32> {
    status.lines().find_map(|line| line.strip_prefix("NSpid:"))?.split_whitespace().next_back()?.parse().ok()
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
        patience::until("its name", || drivers(|| true).iter().any(|(pid, ..)| *pid == child.id()));
        assert!(Listeners::find_within(Duration::ZERO).is_cut_short());
        child.kill().expect("it is sent");
        child.bounded_wait();
    }

    #[test]
    fn a_status_tells_number_and_user() {
        assert_eq!(own_number("Name:\tio-driver\nPid:\t4711\nNSpid:\t4711\t23\t1\n"), Some(1));
        assert_eq!(own_number("Pid:\t4711\nNSpid:\t4711\n"), Some(4711));
        assert_eq!(own_number("Pid:\t4711\n"), None);
        let user = |line: &str| Owner::of(&format!("Tgid:\t1\n{line}\n")).map(|owner| owner.user);
        assert_eq!(user("Uid:\t1001\t1001\t1001\t1001"), Some(Some(1001)));
        assert_eq!(user("Uid:\t0\t0\t0\t0"), Some(Some(0)));
        assert_eq!(user("Uid:\t1001\t0\t0\t0"), Some(Some(1001)), "as su that somebody has started");
        assert_eq!([user("Uid:"), user("Uid:\tx")], [None; 2]);
    }

    #[test]
    fn our_own_sockets_are_known_by_our_descriptors() {
        let directory = tempfile::tempdir().expect("a directory");
        let listener = UnixListener::bind(directory.path().join("s")).expect("a socket");
        let held = held_sockets::numbers(std::process::id(), || true).expect("our own");
        let text = std::fs::read("/proc/self/net/unix").expect("the table");
        let whose = Whose::Held(held);
        let mut table = Table::default();
        let mut sockets = table.sockets_of(&whose, || Some(text.clone()));
        assert!(sockets.any(|socket| socket == directory.path().join("s")));
        drop(listener);
    }

    #[test]
    fn a_stranger_listens_nowhere_but_in_his_own_directory() {
        let directory = tempfile::tempdir().expect("a directory");
        let (own, place) = (own_uid(), directory.path().join("gone/driver.sock"));
        assert_eq!(
            directory_of(&place).map(|left| left.uid()),
            Some(own),
            "of what is left of the way there"
        );
        let of_group = |uid: u32, groups: &[u32], place: &Path| {
            let owner = Owner { user: Some(uid), groups: groups.to_vec() };
            let listener = Listener { pid: 1, owner, socket: place.to_path_buf(), there: There::Nobody };
            Listeners { all: vec![listener], ..Listeners::default() }.at(place)
        };
        let at = |uid: u32, place: &Path| of_group(uid, &[], place);
        assert_eq!([at(own, &place), at(0, &place)], [Some(1); 2]);
        assert_eq!(at(own + 1, &place), None);
        // The directory is given away, which takes root.
        if own == 0 {
            std::os::unix::fs::chown(directory.path(), Some(1), None).expect("root may");
            assert_eq!([at(1, &place), at(2, &place)], [Some(1), None]);
            // To a group that may make files there.
            std::os::unix::fs::chown(directory.path(), Some(0), Some(7)).expect("root may");
            let groups = [vec![], vec![7]].map(|groups| move |place: &Path| of_group(2, &groups, place));
            assert_eq!(groups.each_ref().map(|at| at(&place)), [None; 2]);
            let rights = std::os::unix::fs::PermissionsExt::from_mode(0o770);
            std::fs::set_permissions(directory.path(), rights).expect("root may");
            assert_eq!(groups.each_ref().map(|at| at(&place)), [None, Some(1)]);
        }
    }

    /// Lines of the table may be written by anybody, by a name with an end of a line in it.
    #[test]
    fn a_driver_is_certain_only_where_it_is_reached_and_found_by_names_of_two_lines() {
        let directory = tempfile::tempdir().expect("a directory");
        let [own, gone] = ["own", "gone"].map(|name| directory.path().join(name));
        let _listening = UnixListener::bind(&own).expect("a socket");
        let listener = |pid: u32, socket: &Path| {
            let owner = Owner { user: Some(own_uid()), groups: Vec::new() };
            Listener { pid, owner, socket: socket.into(), there: There::Nobody }.looked_at()
        };
        let us = std::process::id();
        let there = [(us, &own), (us, &gone), (1, &own)].map(|(pid, socket)| listener(pid, socket).there);
        assert_eq!(there, [There::Itself, There::Nobody, There::Other]);
        let all = vec![listener(us, &gone)];
        let two_lines = PathBuf::from(format!("{}\n0 0", gone.display()));
        let found = Listeners { all, ..Listeners::default() };
        assert_eq!([found.at(&two_lines), found.at(&own)], [Some(us), None]);
    }

    /// A socket goes on telling the number of the process that made it listen, when that has ended and another one has the number.
    #[test]
    fn a_socket_of_another_users_is_no_drivers_whatever_number_it_tells() {
        if own_uid() != 0 {
            println!("skipped: sockets of other users, which need root");
            return;
        }
        let directory = tempfile::tempdir().expect("a directory");
        let rights = std::os::unix::fs::PermissionsExt::from_mode(0o777);
        std::fs::set_permissions(directory.path(), rights).expect("our own");
        let socket = directory.path().join("s");
        let bind = || {
            let user = rustix::process::Uid::from_raw(1);
            rustix::thread::set_thread_uid(user).expect("root may");
            UnixListener::bind(&socket).expect("a socket")
        };
        let _listening = std::thread::scope(|scope| scope.spawn(bind).bounded_join()).expect("no panic");
        let owner = Owner { user: Some(0), groups: Vec::new() };
        let listener = Listener { pid: std::process::id(), owner, socket, there: There::Nobody };
        assert_eq!(listener.looked_at().there, There::Other);
    }

    #[test]
    fn a_table_that_there_is_no_time_to_read_ends_with_a_whole_line() {
        let reads = Cell::new(0);
        let text = read_within("/proc/self/net/unix", || true).expect("the table");
        assert!(text.starts_with(b"Num"));
        let some = read_within("/proc/kallsyms", || {
            reads.set(reads.get() + 1);
            reads.get() < 3
        });
        assert!(some.is_none_or(|some| some.is_empty() || some.ends_with(b"\n")));
        assert_eq!(read_within("/proc/self/net/unix", || false), Some(Vec::new()));
    }
}
