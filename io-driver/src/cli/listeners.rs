//! Driver processes that listen, whatever became of their sockets' files.
//!
//! Model: processes of a driver's name are looked through. Which listening sockets are theirs the kernel tells of those whose
//! descriptors we may see: for root all, else our own. Of others it only tells the name under which a socket was made, which for a
//! driver's ends with the process's number, and which anybody may have given: such a socket is *alleged*. A driver with a
//! network of its own, as a service has, is in that network's table alone; so the table of each network in which such a
//! process lives is read. The kernel tells it in pieces, and leaves a socket out where another of its bucket is closed
//! between two of them: it is read again for one who is not in it, up to [`READINGS`] times.
//! Trust: anybody may give a process that name, make sockets for it, and change what a relative name leads to. So whoever is
//! neither root, nor we, nor the owner of the place that is asked about does not listen there.
//! Bound: whoever stops motors waits for the search, and for comparing paths, [`PATIENCE`] each, but for one table, one path;
//! and is told that it was cut short. Directories are compared in full, without symbolic links and detours.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
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

/// Who owns the directory of a place, or what is left of the way there.
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

/// How the sockets of a process are known.
enum Whose {
    /// It has those of these numbers.
    Held(BTreeSet<u64>),
    /// They were named by this number of a process.
    Named(u32),
}

/// The listening sockets that a network's table tells of, by their numbers: each once, for a connection that was taken has a
/// line with the same name and another number.
#[derive(Default)]
struct Table {
    sockets: BTreeMap<u64, Vec<u8>>,
    readings: usize,
}

impl Table {
    /// Names of the sockets of a process; the table is read as long as it tells of none, or only by names.
    fn sockets_of(
        &mut self,
        whose: &Whose,
        read: impl Fn() -> Option<Vec<u8>>,
    ) -> impl Iterator<Item = &Path> {
        let is_its = |number: u64, name: &[u8]| match whose {
            Whose::Held(held) => held.contains(&number),
            Whose::Named(pid) => process_of(name) == Some(*pid),
        };
        while self.readings < READINGS {
            let is_known = self.sockets.iter().any(|(number, name)| is_its(*number, name));
            if is_known && matches!(whose, Whose::Held(_)) {
                break;
            }
            let Some(text) = read() else { break };
            self.readings += 1;
            self.sockets.extend(text.split(|byte| *byte == b'\n').filter_map(socket_of));
        }
        let its = self.sockets.iter().filter(move |(number, name)| is_its(**number, name));
        its.map(|(_, name)| Path::new(OsStr::from_bytes(without_number(name))))
    }
}

/// Number and name of the listening socket that a line of the table tells of.
fn socket_of(line: &[u8]) -> Option<(u64, Vec<u8>)> {
    /// Of a stream, and that it listens.
    const TYPE_STREAM: &[u8] = b"0001";
    const FLAG_LISTENS: u32 = 0x1_0000;
    let mut rest = line;
    // Address, references, protocol, flags, type, state and number come before the name, which may have blanks.
    let fields = [(); 7].map(|()| {
        rest = rest.trim_ascii_start();
        let (field, after) = rest.split_at(rest.iter().position(|byte| *byte == b' ').unwrap_or(rest.len()));
        rest = after;
        field
    });
    let [_, _, _, flags, kind, _, number] = fields;
    let flags = u32::from_str_radix(str::from_utf8(flags).ok()?, 16).ok()?;
    let number = str::from_utf8(number).ok()?.parse().ok()?;
    let name = rest.strip_prefix(b" ")?;
    let is_of_a_file = !name.is_empty() && !name.starts_with(b"@");
    let is_one = kind == TYPE_STREAM && flags & FLAG_LISTENS != 0 && is_of_a_file;
    is_one.then(|| (number, name.to_vec()))
}

/// The number of the process that is to have made a socket of this name.
fn process_of(name: &[u8]) -> Option<u32> {
    let number = &name[without_number(name).len()..];
    str::from_utf8(number.strip_prefix(b".")?).ok()?.parse().ok()
}

/// A name without the number behind it.
fn without_number(name: &[u8]) -> &[u8] {
    match name.iter().rposition(|byte| *byte == b'.') {
        Some(at) if !name[at + 1..].is_empty() && name[at + 1..].iter().all(u8::is_ascii_digit) => {
            &name[..at]
        }
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use patience::prelude::*;

    use super::*;

    fn line(number: u64, name: &str) -> String {
        format!("0000000000000000: 00000002 00000000 00010000 0001 01 {number} {name}\n")
    }

    #[test]
    fn a_line_of_the_table_names_the_socket_that_listens() {
        let told = line(114_705, "/run/a b/driver.sock.77");
        let name = b"/run/a b/driver.sock.77".to_vec();
        assert_eq!(socket_of(told.trim_end().as_bytes()), Some((114_705, name.clone())));
        assert_eq!((process_of(&name), without_number(&name)), (Some(77), &b"/run/a b/driver.sock"[..]));
        let stop = b"/run/x.stop.77";
        assert_eq!((process_of(stop), without_number(stop)), (Some(77), &b"/run/x.stop"[..]));
        for other in [&b"/run/driver.sock"[..], b"/run/driver.", b"/run/driver.7a", b""] {
            assert_eq!((process_of(other), without_number(other)), (None, other));
        }
        for other in [
            "Num       RefCount Protocol Flags    Type St Inode Path",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114707",
            "0000000000000000: 00000002 00000000 00000000 0002 01 114706 /run/driver.sock.stop.77",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114709 /run/driver.sock.77",
            "0000000000000000: 00000002 00000000 00010000 0001 01 114705 @hidden.77",
            "",
        ] {
            assert_eq!(socket_of(other.as_bytes()), None, "{other}");
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

    fn names(table: &mut Table, whose: &Whose, text: &str) -> Vec<String> {
        let read = || Some(text.as_bytes().to_vec());
        table.sockets_of(whose, read).map(|path| path.display().to_string()).collect()
    }

    /// Whoever names a socket by another process's number does not give it to that one.
    #[test]
    fn a_process_has_the_sockets_that_it_holds_and_not_those_of_its_number() {
        let text =
            line(5, "/run/driver.sock.77") + &line(6, "/tmp/decoy.77") + &line(7, "/run/other.sock.78");
        let held = |numbers: &[u64]| Whose::Held(numbers.iter().copied().collect());
        assert_eq!(names(&mut Table::default(), &held(&[5, 9]), &text), ["/run/driver.sock"]);
        assert!(names(&mut Table::default(), &held(&[9]), &text).is_empty());
        // Of one whose descriptors we may not see, both.
        assert_eq!(
            names(&mut Table::default(), &Whose::Named(77), &text),
            ["/run/driver.sock", "/tmp/decoy"]
        );
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
    fn a_driver_that_a_reading_left_out_is_found_by_the_next() {
        let readings = Cell::new(0);
        let text = |number: u64| line(number, &format!("/run/{number}.sock.{number}")).into_bytes();
        let read = || {
            readings.set(readings.get() + 1);
            Some(if readings.get() == 1 { text(77) } else { text(78) })
        };
        let of = |number: u64| Whose::Held([number].into());
        let mut table = Table::default();
        assert_eq!(table.sockets_of(&of(78), read).collect::<Vec<_>>(), [Path::new("/run/78.sock")]);
        assert_eq!(table.sockets_of(&of(77), read).count(), 1, "of an earlier reading");
        assert_eq!(readings.get(), 2);
        // Many who have no socket cost no more than one.
        for number in 0..5 {
            assert_eq!(table.sockets_of(&of(number), read).count(), 0);
        }
        assert_eq!(readings.get(), READINGS);
        // Of a process that has ended there is nothing to read, which says nothing of others.
        let mut table = Table::default();
        assert_eq!(table.sockets_of(&of(78), || None).count(), 0);
        assert_eq!(table.sockets_of(&of(78), || Some(text(78))).count(), 1);
        // A name that anybody may give ends no search.
        let (mut table, readings) = (Table::default(), Cell::new(0));
        let read = || {
            readings.set(readings.get() + 1);
            Some(text(78))
        };
        assert_eq!((table.sockets_of(&Whose::Named(78), read).count(), readings.get()), (1, READINGS));
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
