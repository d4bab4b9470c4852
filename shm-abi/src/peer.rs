//! Credentials of the other end of a Unix socket, as the kernel tells: user, groups, process.
//!
//! Model: a connection keeps the credentials that its client had when it connected (SO_PEERCRED, SO_PEERGROUPS). Its
//! process is held by a descriptor (SO_PEERPIDFD, else pidfd_open(2)), which no other process can inherit by getting
//! the same number.
//! Invariant: nothing here waits for the other end.

use crate::users::known_user;
use nix::libc;
use nix::sys::socket::{getsockopt, sockopt};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use std::fmt;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};

/// The client of a connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Peer {
    /// Its process id; 0: it has none that is visible here.
    pub pid: u32,
    /// Its user.
    pub uid: u32,
    /// That user's first group.
    pub gid: u32,
}

impl Peer {
    /// The client of this connection.
    ///
    /// # Errors
    /// If the kernel does not tell.
    pub fn of(connection: BorrowedFd<'_>) -> io::Result<Self> {
        let credentials = getsockopt(&connection, sockopt::PeerCredentials)?;
        let (uid, gid) = (credentials.uid(), credentials.gid());
        Ok(Self { pid: credentials.pid().cast_unsigned(), uid, gid })
    }

    /// Its user, if that can be told from others.
    pub fn user(&self) -> Option<u32> {
        known_user(self.uid)
    }

    /// All groups of the client's user when it made this connection.
    pub fn groups(&self, connection: BorrowedFd<'_>) -> Vec<u32> {
        let mut groups = supplementary_groups(connection).unwrap_or_default();
        groups.push(self.gid);
        groups
    }
}

/// Number of a process in words; 0: that of one in another PID namespace is not known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProcessWords(pub u64);

impl fmt::Display for ProcessWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("a process of another PID namespace"),
            pid => write!(f, "process {pid}"),
        }
    }
}

/// A process, as something to wait for.
#[derive(Debug)]
pub(crate) enum Process {
    /// Readable when it has ended.
    Alive(OwnedFd),
    /// It has ended.
    Ended,
    /// It cannot be held: it lives where this process sees none, or the kernel is older than 5.3.
    Unknown,
}

impl Process {
    /// The process that made this connection.
    pub(crate) fn of(connection: BorrowedFd<'_>, peer: &Peer) -> Self {
        if let Ok(fd) = getsockopt(&connection, sockopt::PeerPidfd) {
            return Self::Alive(fd);
        }
        let Some(pid) = Pid::from_raw(peer.pid.cast_signed()) else { return Self::Unknown };
        match pidfd_open(pid, PidfdFlags::empty()) {
            Ok(fd) => Self::Alive(fd),
            Err(rustix::io::Errno::SRCH) => Self::Ended,
            Err(_) => Self::Unknown,
        }
    }

    pub(crate) fn fd(&self) -> Option<BorrowedFd<'_>> {
        match self {
            Self::Alive(fd) => Some(fd.as_fd()),
            Self::Ended | Self::Unknown => None,
        }
    }
}

/// Since Linux 6.16: descriptors that a client sends are refused at its side. Closing the last descriptor of some files
/// takes as long as their owner likes (SO_LINGER of a TCP connection), and who receives them closes them.
pub(crate) fn refuse_descriptors(socket: &impl AsFd) {
    /// Not in libc yet; include/uapi/asm-generic/socket.h.
    const SO_PASSRIGHTS: libc::c_int = 83;
    let no: libc::c_int = 0;
    // SAFETY: the pointer is to an int of the length that is told, and lives as long as the call.
    let _older_kernels_refuse = unsafe {
        libc::setsockopt(
            socket.as_fd().as_raw_fd(),
            libc::SOL_SOCKET,
            SO_PASSRIGHTS,
            (&raw const no).cast(),
            size_of::<libc::c_int>() as libc::socklen_t,
        )
    };
}

/// True while the other end holds something of ours that it has not read. Descriptors that were sent count
/// against this process until then, though the other end be shut down.
pub(crate) fn has_unread(connection: BorrowedFd<'_>) -> bool {
    /// Not in libc for every target; include/uapi/linux/sock_diag.h: which of the words counts what was sent.
    const SK_MEMINFO_WMEM_ALLOC: usize = 2;
    let mut words = [0_u32; 16];
    let mut length = size_of_val(&words) as libc::socklen_t;
    // SAFETY: the pointers are to `length` bytes of words and to `length` itself, which outlive the call.
    let result = unsafe {
        libc::getsockopt(
            connection.as_raw_fd(),
            libc::SOL_SOCKET,
            libc::SO_MEMINFO,
            words.as_mut_ptr().cast(),
            &raw mut length,
        )
    };
    result == 0
        && length as usize > SK_MEMINFO_WMEM_ALLOC * size_of::<u32>()
        && words[SK_MEMINFO_WMEM_ALLOC] > 0
}

/// As many as the kernel allows a process.
const MAX_GROUPS: usize = 65_536;

/// `None`: the kernel is older than 4.13, or something failed.
fn supplementary_groups(connection: BorrowedFd<'_>) -> Option<Vec<u32>> {
    let mut groups = vec![0; 64];
    loop {
        let room = size_of_val(groups.as_slice());
        let mut length = libc::socklen_t::try_from(room).ok()?;
        // SAFETY: the pointers are to `length` bytes of groups and to `length` itself, which outlive the call.
        let result = unsafe {
            libc::getsockopt(
                connection.as_raw_fd(),
                libc::SOL_SOCKET,
                libc::SO_PEERGROUPS,
                groups.as_mut_ptr().cast(),
                &raw mut length,
            )
        };
        let found = length as usize / size_of::<u32>();
        match result {
            0 => {
                groups.truncate(found);
                return Some(groups);
            }
            // Too small; it said how much it takes.
            _ if found > groups.len() && found <= MAX_GROUPS => groups.resize(found, 0),
            _ => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;
    use std::os::unix::net::UnixStream;

    #[test]
    fn the_kernel_tells_user_groups_and_process_of_a_client() {
        let (ours, _theirs) = UnixStream::pair().unwrap();
        let peer = Peer::of(ours.as_fd()).unwrap();
        assert_eq!((peer.pid, peer.uid), (std::process::id(), rustix::process::geteuid().as_raw()));
        let groups = peer.groups(ours.as_fd());
        assert!(groups.contains(&rustix::process::getegid().as_raw()));
        for group in rustix::process::getgroups().unwrap() {
            assert!(groups.contains(&group.as_raw()), "{groups:?}");
        }
        let process = Process::of(ours.as_fd(), &peer);
        let fd = process.fd().expect("we live");
        let mut polled = [rustix::event::PollFd::new(&fd, rustix::event::PollFlags::IN)];
        let now = rustix::event::Timespec { tv_sec: 0, tv_nsec: 0 };
        assert_eq!(rustix::event::poll(&mut polled, Some(&now)).unwrap(), 0, "not readable while we live");
    }

    /// More than there is room for at first, too. To the kernel groups belong to a thread; to change them takes root.
    #[test]
    fn all_supplementary_groups_are_told_however_many() {
        if !rustix::process::geteuid().is_root() {
            println!("skipped: groups of our own choice, which need root");
            return;
        }
        for count in [0, 3, 64, 65, 200] {
            let expected: Vec<u32> = (5000..5000 + count).collect();
            let own = expected.iter().map(|id| rustix::fs::Gid::from_raw(*id)).collect::<Vec<_>>();
            let told = std::thread::spawn(move || {
                rustix::thread::set_thread_groups(&own).unwrap();
                let (ours, _theirs) = UnixStream::pair().unwrap();
                let peer = Peer::of(ours.as_fd()).unwrap();
                (supplementary_groups(ours.as_fd()), peer.groups(ours.as_fd()))
            });
            let (supplementary, all) = told.bounded_join().unwrap();
            assert_eq!(supplementary.as_ref(), Some(&expected));
            let own = rustix::process::getegid().as_raw();
            assert_eq!(all, [&expected[..], &[own]].concat(), "those and the first group");
        }
    }

    /// A kernel that refuses leaves the length as it was: that must not be taken for "make more room" again and again.
    #[test]
    fn who_cannot_be_asked_for_groups_has_none() {
        let no_socket = std::fs::File::open("/dev/null").unwrap();
        let asked = std::thread::spawn(move || supplementary_groups(no_socket.as_fd()));
        assert_eq!(asked.bounded_join().unwrap(), None);
    }

    #[test]
    fn who_refuses_descriptors_gets_none_where_the_kernel_can() {
        let release = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap();
        let mut numbers = release.split(['.', '-']).map_while(|part| part.parse::<u32>().ok());
        let version = (numbers.next(), numbers.next());
        if version < (Some(6), Some(16)) {
            println!("skipped: Linux {release} passes descriptors to everybody");
            return;
        }
        let (ours, theirs) = UnixStream::pair().unwrap();
        crate::socket::send(theirs.as_fd(), &0_u64, &[theirs.as_fd()]).unwrap();
        refuse_descriptors(&ours);
        let refused = crate::socket::send(theirs.as_fd(), &0_u64, &[theirs.as_fd()]).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::PermissionDenied);
        crate::socket::send(theirs.as_fd(), &0_u64, &[]).unwrap();
    }
}
