//! The application's side of the socket: finding the driver and getting its memory.
//!
//! Every way in which this can fail has its own variant in [`AttachError`], whose message says what was
//! found and what to do.

use crate::far_address::FarAddress;
use crate::handshake::{self, Answer, Request, RequestKind, Verdict};
use crate::layout::{LAYOUT_HASH, MAGIC};
use crate::peer::{Peer, ProcessWords};
use crate::segment::{self, CommanderMemory, DriverView, SegmentError};
use crate::socket;
use crate::socket_file;
use crate::stop_socket::{self, Sent};
use rustix::io::Errno;
use rustix::net::sockopt::{Timeout, set_socket_timeout};
use rustix::net::{AddressFamily, SocketFlags, SocketType};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// A driver answers within microseconds; one that does not within this time is stopped or hung.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// What an application holds of the driver.
#[derive(Debug)]
pub struct Attachment {
    /// The driver's segment.
    pub driver: DriverView,
    /// The commander's segment; `None` for an observer.
    pub commander: Option<CommanderMemory>,
    /// Keep it: the lease ends when it is dropped.
    pub connection: Connection,
    /// Process id of the driver.
    pub driver_pid: u64,
}

/// The open connection, which *is* the lease.
#[derive(Debug)]
pub struct Connection(OwnedFd);

impl Connection {
    /// Whether the driver still lives; never blocks.
    pub fn is_open(&self) -> bool {
        socket::is_open(&self.0)
    }
}

/// Why there is no attachment.
#[derive(Debug, Error)]
pub enum AttachError {
    /// Nothing lies at the path.
    #[error(
        "no driver is running: {socket} does not exist; start one with `io-driver run --config FILE`, or name another socket"
    )]
    NoDriver {
        /// Where it was looked for.
        socket: PathBuf,
    },
    /// A socket lies there, and nobody listens.
    #[error(
        "the driver is gone: {socket} is left over from one that died; start it again with `io-driver run --config FILE` (it replaces the socket)"
    )]
    DriverGone {
        /// Where it was looked for.
        socket: PathBuf,
    },
    /// The file system does not let us in.
    #[error(
        "no permission to use {socket}: it has mode {mode:04o}, owner {owner} and group {}, and you are user {user}; join the group or ask for access",
        group_in_words(*group)
    )]
    NoPermission {
        /// Where it was looked for.
        socket: PathBuf,
        /// Permission bits of the socket, or of the directory that hides it.
        mode: u32,
        /// User id of its owner.
        owner: u32,
        /// Group id of its group.
        group: u32,
        /// Our own user id.
        user: u32,
    },
    /// Something else lies at the path.
    #[error("{socket} is not a driver's socket: {detail}; name another one")]
    NotADriver {
        /// Where it was looked for.
        socket: PathBuf,
        /// What was found.
        detail: String,
    },
    /// Whoever listens there took the request and closed the connection.
    #[error(
        "whoever listens at {socket} hung up without an answer, as a driver does that is just ending, and a program that is \
         none; ask again, or name another socket"
    )]
    HungUp {
        /// Socket that it listened at.
        socket: PathBuf,
    },
    /// It was asked, and its answer cannot be read here.
    #[error(
        "the driver at {socket} may have heard it, but its answer cannot be read: {source}; look how things stand \
         (`io-driver status`)"
    )]
    Unread {
        /// Socket that it listens at.
        socket: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The driver speaks another major version.
    #[error(
        "the driver speaks ABI version {found}, this program {expected}; install both from the same release"
    )]
    WrongVersion {
        /// The driver's.
        found: String,
        /// Ours.
        expected: String,
    },
    /// Same version, other layout.
    #[error(
        "the driver's memory layout is 0x{found:016x}, this program's 0x{expected:016x}, though both say ABI {version}; one of them is a modified build: rebuild both from the same source"
    )]
    WrongLayout {
        /// The driver's.
        found: u64,
        /// Ours.
        expected: u64,
        /// The version both claim.
        version: String,
    },
    /// Somebody commands already.
    #[error(
        "the devices are commanded by {} ({name}) already; end it, or its lease (`io-driver end-lease`), first; \
         `io-driver status --watch` looks on",
        ProcessWords(*pid)
    )]
    LeaseHeld {
        /// The holder's process id.
        pid: u64,
        /// Its name.
        name: String,
    },
    /// The driver listens and does not answer.
    #[error(
        "the driver at {socket} does not answer within {seconds} s; it may be stopped (see `ps`), continue or kill it"
    )]
    NoAnswer {
        /// Where it was asked.
        socket: PathBuf,
        /// How long.
        seconds: u64,
    },
    /// It is too old for what was asked.
    #[error(
        "the driver speaks version {found} of the shared-memory contract and does not know requests of kind \
         {kind}, this program speaks {expected}; start the driver that belongs to this program"
    )]
    UnknownRequest {
        /// The driver's version.
        found: String,
        /// The request's kind, as a number.
        kind: u64,
        /// Our version.
        expected: String,
    },
    /// Whoever asks has not the right to.
    #[error(
        "the driver at {socket} does not let user {user} {wish}: {allowed} may; ask one of these, or its administrator"
    )]
    NotAllowed {
        /// Where it was asked.
        socket: PathBuf,
        /// What was asked, as [`RequestKind::wish`] has it.
        wish: &'static str,
        /// Our own user id.
        user: u32,
        /// Who may.
        allowed: String,
    },
    /// The request is one that is answered, and hands over nothing.
    #[error("nobody attaches to {wish}, and nothing was sent; that request has a function of its own")]
    NothingToAttach {
        /// What was asked, as [`RequestKind::wish`] has it.
        wish: &'static str,
    },
    /// It refused for a reason of its own.
    #[error("the driver refused: {0}")]
    Refused(String),
    /// What it handed over is not usable.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// The system refused something else.
    #[error("cannot {what} at {socket}: {source}{}", segment::remedy(.source))]
    System {
        /// What was tried.
        what: &'static str,
        /// Where.
        socket: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
}

/// Attaches as an observer: any number may.
pub fn observe(socket: &Path, name: &str) -> Result<Attachment, AttachError> {
    attach(socket, &Request::new(RequestKind::Observe, name))
}

/// Attaches as *the* commander.
pub fn command(socket: &Path, name: &str) -> Result<Attachment, AttachError> {
    attach(socket, &Request::new(RequestKind::Command, name))
}

/// Asks the driver to stop. Returns its process id; it ends by itself soon after.
pub fn stop(socket: &Path, name: &str) -> Result<u64, AttachError> {
    exchange(socket, &Request::new(RequestKind::Stop, name)).map(|(answer, ..)| answer.driver_pid)
}

/// Asks the driver to leave its fault state.
pub fn clear_fault(socket: &Path, name: &str) -> Result<(), AttachError> {
    exchange(socket, &Request::new(RequestKind::ClearFault, name)).map(|_| ())
}

/// The same for somebody who asked at `asked_ns` (CLOCK_MONOTONIC), whatever went by since: no stop after that is undone.
pub fn clear_fault_as_of(asked_ns: u64, socket: &Path, name: &str) -> Result<(), AttachError> {
    let request = Request { asked_ns, ..Request::new(RequestKind::ClearFault, name) };
    exchange(socket, &request).map(|_| ())
}

/// Asks the driver to switch all motors off at once: by datagram, which a driver hears whose service is stuck and which is
/// sent before anything waits, and over a connection, by which the driver knows whose stop it is. They stay off until
/// [`clear_fault`]. That it was asked does not say that it was done: a frame tells, and a fault that is to be left is to be
/// waited for first.
///
/// # Errors
/// Why it could be asked in neither way. A queue that is full of datagrams, perhaps of others only, is no way.
pub fn emergency_stop(socket: &Path, name: &str) -> Result<(), AttachError> {
    let sent = stop_socket::send(socket);
    let asked = emergency_stop_over_connection(socket, name);
    if matches!(sent, Ok(Sent::Queued)) { Ok(()) } else { asked.map(drop) }
}

/// The same over a connection alone. The answer says that the driver has heard it, and, of a driver that tells, the tick
/// of its newest frame and whether that shows an emergency stop and no force ([`Answer::latest`]): whoever finds no place to
/// look from asks again until a later frame does.
pub fn emergency_stop_over_connection(socket: &Path, name: &str) -> Result<Answer, AttachError> {
    exchange(socket, &Request::new(RequestKind::EmergencyStop, name)).map(|(answer, ..)| answer)
}

/// Tells the driver that devices lie in their home pose now: bit `i` of `devices` means device `i`, 0 all of
/// them.
///
/// # Errors
/// [`AttachError::UnknownRequest`] from a driver of before 1.2, and whatever else may go wrong on the way. That it
/// was heard does not say that it was done: the driver's state and the devices' flags tell.
pub fn zero(socket: &Path, name: &str, devices: u64) -> Result<(), AttachError> {
    let request = Request { devices, ..Request::new(RequestKind::Zero, name) };
    exchange(socket, &request).map(|_| ())
}

/// Asks that the lease of whoever commands ends, that one stopped or hung though it be: its force ramps out, and
/// somebody else may command.
///
/// # Errors
/// [`AttachError::UnknownRequest`] from a driver of before 1.3, [`AttachError::NotAllowed`] without the right.
pub fn end_lease(socket: &Path, name: &str) -> Result<(), AttachError> {
    exchange(socket, &Request::new(RequestKind::EndLease, name)).map(|_| ())
}

/// Attaches with a request of any content; what [`observe`] and [`command`] do, and tests that lie. A request that
/// hands over nothing is not sent: it would be done, and look as if it had failed.
///
/// # Errors
/// Whatever stands in the way.
pub fn attach(socket: &Path, request: &Request) -> Result<Attachment, AttachError> {
    match RequestKind::from_word(request.kind) {
        None | Some(RequestKind::Observe | RequestKind::Command) => {}
        Some(other) => return Err(AttachError::NothingToAttach { wish: other.wish() }),
    }
    let (answer, fds, connection) = exchange(socket, request)?;
    let mut fds = fds.into_iter();
    let driver =
        fds.next().ok_or_else(|| AttachError::Refused("it granted and handed over nothing".into()))?;
    let driver = DriverView::map(driver.as_fd())?;
    let commander = fds.next().map(|fd| CommanderMemory::map(fd.as_fd())).transpose()?;
    if request.kind == RequestKind::Command as u64 && commander.is_none() {
        return Err(AttachError::Refused("it granted the lease and handed over no memory for it".into()));
    }
    Ok(Attachment { driver, commander, connection: Connection(connection), driver_pid: answer.driver_pid })
}

fn exchange(socket: &Path, request: &Request) -> Result<(Answer, Vec<OwnedFd>, OwnedFd), AttachError> {
    let socket = socket_file::without_end(socket);
    let connection = connect(socket)?;
    // A driver that has no place for us answers unasked and hangs up: its answer counts for more than our
    // broken pipe.
    match socket::send(connection.as_fd(), request, &[]) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => return Err(talk_error(socket, error)),
        _ => {}
    }
    let (mut answer, fds) =
        socket::receive::<Answer>(connection.as_fd(), ANSWER_TIMEOUT).map_err(|error| {
            match talk_error(socket, error) {
                AttachError::System { socket, source, .. } => AttachError::Unread { socket, source },
                told => told,
            }
        })?;
    number_as_here(&mut answer, &connection);
    judge(socket, request, &answer)?;
    Ok((answer, fds, connection))
}

/// A driver in a container tells numbers of processes that mean others here, or nobody; the kernel knows its own here.
fn number_as_here(answer: &mut Answer, connection: &OwnedFd) {
    let Ok(listener) = Peer::of(connection.as_fd()) else { return };
    if u64::from(listener.pid) != answer.driver_pid {
        answer.driver_pid = u64::from(listener.pid);
        answer.holder_pid = 0;
    }
}

/// Turns an answer into our error. The driver's own words are compared here too: it may be the older one
/// of the two and not know better.
fn judge(socket: &Path, request: &Request, answer: &Answer) -> Result<(), AttachError> {
    if answer.magic != MAGIC {
        let detail = format!("it answered with magic 0x{:016x}, expected 0x{MAGIC:016x}", answer.magic);
        return Err(AttachError::NotADriver { socket: socket.into(), detail });
    }
    let found = handshake::version_text(answer.abi_version);
    // What was claimed is what was refused: a test that lies must read its own lie.
    let expected = handshake::version_text(request.abi_version);
    let verdict = Verdict::from_word(answer.verdict);
    if !handshake::is_compatible(answer.abi_version) || verdict == Some(Verdict::WrongVersion) {
        return Err(AttachError::WrongVersion { found, expected });
    }
    if answer.layout_hash != LAYOUT_HASH || verdict == Some(Verdict::WrongLayout) {
        let found = answer.layout_hash;
        return Err(AttachError::WrongLayout { found, expected: request.layout_hash, version: expected });
    }
    match verdict {
        Some(Verdict::Granted) => Ok(()),
        Some(Verdict::LeaseHeld) => Err(AttachError::LeaseHeld {
            pid: answer.holder_pid,
            name: handshake::name_text(&answer.holder_name),
        }),
        Some(Verdict::Crowded) => {
            let why = "it has too many connections; end programs that look on or left without reading its answer";
            Err(AttachError::Refused(why.into()))
        }
        Some(Verdict::NoSegment) => {
            Err(AttachError::Refused("it could not create shared memory; see its log for the cause".into()))
        }
        Some(Verdict::Busy) => Err(AttachError::Refused(
            "its loop collects no requests; see with `io-driver status` whether its ticks go on".into(),
        )),
        Some(Verdict::Outdated) => Err(AttachError::Refused(
            "it heard this too late: an emergency stop came after it was asked, more than a second went by, or you are in another time namespace than \
             it; look \
             how things stand, then ask again"
                .into(),
        )),
        Some(Verdict::LeaseEnded) => Err(AttachError::Refused(
            "an administrator has ended your lease, and others come first for ten seconds; then ask again".into(),
        )),
        Some(Verdict::NotAllowed) => Err(not_allowed(socket, request, answer)),
        Some(Verdict::UnknownKind) => {
            Err(AttachError::UnknownRequest { found, kind: request.kind, expected })
        }
        Some(other) => Err(AttachError::Refused(format!("it did not understand the request ({other:?})"))),
        None => Err(AttachError::Refused(format!("it gave the unknown verdict {}", answer.verdict))),
    }
}

fn not_allowed(socket: &Path, request: &Request, answer: &Answer) -> AttachError {
    let user = rustix::process::geteuid().as_raw();
    AttachError::NotAllowed {
        socket: socket.into(),
        wish: RequestKind::from_word(request.kind).map_or("do this", RequestKind::wish),
        user,
        allowed: allowed_in_words(answer.allowed_group(), user),
    }
}

/// Those with a right that this user, who asked, has not, in words.
fn allowed_in_words(group: Option<u32>, user: u32) -> String {
    const OWNERS: &str = "root and the user that the driver runs as";
    match group {
        Some(group) => format!("members of group {}", group_in_words(group)),
        None if user == 0 => {
            format!("{OWNERS}, by the numbers of the driver's own user namespace,")
        }
        None => OWNERS.into(),
    }
}

/// Its number, and its name where the file of groups has one; no service of names is asked, which may be slow.
fn group_in_words(id: u32) -> String {
    let groups = std::fs::read_to_string("/etc/group").unwrap_or_default();
    let name = |line: &str| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(id)).then(|| name.to_owned())
    };
    groups.lines().find_map(name).map_or_else(|| id.to_string(), |name| format!("{id} ({name})"))
}

fn connect(path: &Path) -> Result<OwnedFd, AttachError> {
    let system = |what, errno: Errno| AttachError::System { what, socket: path.into(), source: errno.into() };
    let far = FarAddress::of(path).map_err(|errno| match errno {
        Errno::NAMETOOLONG => system("use the name", errno),
        other => connect_error(path, other),
    })?;
    let socket =
        rustix::net::socket_with(AddressFamily::UNIX, SocketType::STREAM, SocketFlags::CLOEXEC, None)
            .map_err(|errno| system("open a socket", errno))?;
    for timeout in [Timeout::Send, Timeout::Recv] {
        set_socket_timeout(&socket, timeout, Some(ANSWER_TIMEOUT))
            .map_err(|errno| system("set a time-out on the socket", errno))?;
    }
    rustix::io::retry_on_intr(|| rustix::net::connect(&socket, &far.address))
        .map_err(|errno| connect_error(path, errno))?;
    Ok(socket)
}

fn connect_error(path: &Path, errno: Errno) -> AttachError {
    let socket = path.to_path_buf();
    match errno {
        Errno::NOENT | Errno::NOTDIR => AttachError::NoDriver { socket },
        Errno::CONNREFUSED if is_socket(path) => AttachError::DriverGone { socket },
        Errno::CONNREFUSED => AttachError::NotADriver { socket, detail: "it is not a socket".into() },
        Errno::ACCESS | Errno::PERM => no_permission(path),
        Errno::AGAIN => AttachError::NoAnswer { socket, seconds: ANSWER_TIMEOUT.as_secs() },
        Errno::PROTOTYPE => AttachError::NotADriver { socket, detail: "it is not a stream socket".into() },
        other => AttachError::System { what: "connect", socket, source: other.into() },
    }
}

fn is_socket(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    std::fs::metadata(path).is_ok_and(|meta| meta.file_type().is_socket())
}

/// Names the first thing on the path that we can see: the socket, or the directory that hides it.
fn no_permission(path: &Path) -> AttachError {
    let seen = path.ancestors().find_map(|place| std::fs::metadata(place).ok().map(|meta| (place, meta)));
    let (socket, mode, owner, group) = match seen {
        Some((place, meta)) => {
            (place.to_path_buf(), meta.permissions().mode() & 0o7777, meta.uid(), meta.gid())
        }
        None => (path.to_path_buf(), 0, 0, 0),
    };
    AttachError::NoPermission { socket, mode, owner, group, user: rustix::process::geteuid().as_raw() }
}

impl AttachError {
    /// True if the driver may have done what it was asked.
    pub fn may_be_heard(&self) -> bool {
        matches!(self, Self::NoAnswer { .. } | Self::HungUp { .. } | Self::Unread { .. })
    }
}

/// A driver that was killed is gone by now, and one that ended has removed its socket; another call tells.
fn hung_up(socket: PathBuf) -> AttachError {
    match connect(&socket) {
        Err(gone @ (AttachError::NoDriver { .. } | AttachError::DriverGone { .. })) => gone,
        _ => AttachError::HungUp { socket },
    }
}

fn talk_error(path: &Path, error: io::Error) -> AttachError {
    let socket = path.to_path_buf();
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
            AttachError::NoAnswer { socket, seconds: ANSWER_TIMEOUT.as_secs() }
        }
        io::ErrorKind::UnexpectedEof | io::ErrorKind::ConnectionReset | io::ErrorKind::BrokenPipe => {
            hung_up(socket)
        }
        _ => AttachError::System { what: "talk to the driver", socket, source: error },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_not_root_is_told_of_root_in_its_own_numbers() {
        let owners = "root and the user that the driver runs as";
        assert_eq!(allowed_in_words(None, 1000), owners);
        assert_eq!(
            allowed_in_words(None, 0),
            format!("{owners}, by the numbers of the driver's own user namespace,")
        );
        assert_eq!(allowed_in_words(Some(0), 1000), "members of group 0 (root)");
    }
}
