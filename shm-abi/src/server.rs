//! The driver's side of the socket: who may see the segments, and who commands.
//!
//! Model: one thread, which is not the real-time loop, polls the listening socket and all connections.
//! Exactly one connection holds the lease; it ends when the connection does, however that happens. For
//! each lease a fresh commander's segment is made, so that a former holder that still writes writes into
//! memory nobody reads; the loop is given it once it is mapped and sealed ([`LeaseOffer`]). What happens is returned
//! as [`ServerEvent`]s, for the owner to pass to the loop.
//!
//! Invariant: nothing a client sends or withholds blocks the thread; a client that connects and says
//! nothing is dropped after [`PATIENCE`], and one that says more than its request, at once: what nobody
//! reads may hold a copy of the connection itself, and so a lease that its holder's death does not end.

use crate::handshake::{self, Answer, Request, RequestKind, Verdict};
use crate::segment::{CommanderView, DriverMemory, LeaseOffer};
use crate::socket;
use bytemuck::Zeroable;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::FlockOperation;
use rustix::io::Errno;
use rustix::net::{AddressFamily, RecvFlags, SocketAddrUnix, SocketFlags, SocketType};
use std::fs::{File, Metadata, Permissions};
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use thiserror::Error;

/// Connections at once, the commander's included.
pub const MAX_CONNECTIONS: usize = 64;
/// Of these, observers: however many look on, somebody can still command, stop and clear a fault.
pub const MAX_OBSERVERS: usize = 60;
/// How long a new connection may take to say what it wants.
pub const PATIENCE: Duration = Duration::from_secs(1);
/// After a failed accept (no descriptors left, say) the listener rests this long instead of spinning.
const ACCEPT_REST: Duration = Duration::from_millis(100);
/// How often it is looked whether a commander has mapped its segment.
const OFFER_LOOK: Duration = Duration::from_millis(1);
/// Owner and group may use the socket.
const SOCKET_MODE: u32 = 0o660;

/// What the driver's loop has to know.
#[derive(Debug)]
pub enum ServerEvent {
    /// A new commander; read its segment from now on.
    LeaseGranted {
        /// Its segment.
        view: CommanderView,
        /// Its process id.
        pid: u64,
        /// Its name.
        name: String,
    },
    /// The commander's connection ended.
    LeaseEnded {
        /// Number of its lease.
        lease: u64,
    },
    /// A would-be commander was refused because somebody commands already.
    LeaseRefused,
    /// Somebody asks the driver to stop.
    StopRequested {
        /// Who.
        pid: u64,
    },
    /// Somebody asks the driver to leave its fault state.
    ClearFaultRequested,
    /// Somebody asks for all motors off, now.
    EmergencyStopRequested {
        /// Who.
        pid: u64,
    },
    /// Somebody says that devices lie in their home pose now.
    ZeroRequested {
        /// Who.
        pid: u64,
        /// Bit `i`: device `i` does; 0: all do.
        devices: u64,
    },
    /// A segment for a lease could not be made.
    Trouble {
        /// Why.
        message: String,
    },
}

/// Why the driver cannot listen.
#[derive(Debug, Error)]
pub enum BindError {
    /// Another driver does.
    #[error("another driver is running at {socket}; stop it with `io-driver stop`, or use another socket")]
    AlreadyRunning {
        /// Where.
        socket: PathBuf,
    },
    /// The file system refused.
    #[error("cannot {what} {path}: {source}; choose another place with --socket or {variable}", variable = crate::endpoint::SOCKET_VARIABLE)]
    System {
        /// What was tried.
        what: &'static str,
        /// On what.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
}

/// The listening driver.
#[derive(Debug)]
pub struct Server {
    listener: UnixListener,
    path: PathBuf,
    /// Which file `path` named when it was made.
    identity: Option<Identity>,
    /// Held as long as the driver lives; the kernel lets go of it however the driver dies.
    lock: File,
    connections: Vec<Connection>,
    next_lease: u64,
    accept_after: Option<Instant>,
}

#[derive(Debug)]
struct Connection {
    stream: UnixStream,
    pid: u64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// Has sent so many bytes of its request.
    Asking { bytes: [u8; size_of::<Request>()], filled: usize, since: Instant },
    /// Got the driver's segment.
    Observing,
    /// Got an answer and nothing to keep.
    Served,
    /// Holds the lease; with an offer, the loop knows nothing of it yet.
    Commanding { lease: u64, name: String, offer: Option<LeaseOffer> },
    /// To be forgotten.
    Gone,
}

impl Server {
    /// Listens at `path`. A socket left over from a driver that died is replaced.
    pub fn bind(path: &Path) -> Result<Self, BindError> {
        let failed = |what, path: &Path| {
            let path = path.to_path_buf();
            move |source| BindError::System { what, path, source }
        };
        if let Some(directory) = path.parent().filter(|directory| !directory.as_os_str().is_empty()) {
            std::fs::DirBuilder::new()
                .recursive(true)
                .mode(0o750)
                .create(directory)
                .map_err(failed("create the directory", directory))?;
        }
        let lock = lock(path)?;
        make_sure_nobody_listens(path)?;
        // The socket gets its mode before it gets its name: there is no moment at which it is too open.
        let unnamed = suffixed(path, &format!(".{}", std::process::id()));
        let _ = std::fs::remove_file(&unnamed);
        let listener = UnixListener::bind(&unnamed).map_err(failed("listen at", &unnamed))?;
        let ready = std::fs::set_permissions(&unnamed, Permissions::from_mode(SOCKET_MODE))
            .and_then(|()| listener.set_nonblocking(true))
            .and_then(|()| std::fs::rename(&unnamed, path));
        if let Err(source) = ready {
            let _ = std::fs::remove_file(&unnamed);
            return Err(failed("listen at", path)(source));
        }
        let path = path.to_path_buf();
        let identity = std::fs::symlink_metadata(&path).ok().map(|meta| identity_of(&meta));
        let connections = Vec::new();
        Ok(Self { listener, path, identity, lock, connections, next_lease: 1, accept_after: None })
    }

    /// Where it listens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Waits up to `timeout` for something to happen, deals with it and appends what the loop must know.
    pub fn poll(
        &mut self,
        memory: &DriverMemory,
        timeout: Duration,
        events: &mut Vec<ServerEvent>,
    ) -> io::Result<()> {
        let (newcomer, talking) = self.wait(timeout)?;
        for index in talking {
            self.listen_to(index, memory, events);
        }
        self.grant_what_is_mapped(events);
        self.drop_the_silent();
        self.connections.retain(|connection| !matches!(connection.stage, Stage::Gone));
        if newcomer {
            self.accept();
        }
        Ok(())
    }

    fn wait(&self, timeout: Duration) -> io::Result<(bool, Vec<usize>)> {
        let timeout = timespec(self.next_duty().map_or(timeout, |duty| duty.min(timeout)));
        let accepting = self.accept_after.is_none_or(|after| Instant::now() >= after);
        let mut fds: Vec<PollFd<'_>> = self
            .connections
            .iter()
            .map(|c| PollFd::new(&c.stream, PollFlags::IN | PollFlags::RDHUP))
            .collect();
        if accepting {
            fds.push(PollFd::new(&self.listener, PollFlags::IN));
        }
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok((false, Vec::new())),
            Err(errno) => return Err(errno.into()),
        }
        let newcomer = accepting && fds.pop().is_some_and(|fd| !fd.revents().is_empty());
        let talking =
            fds.iter().enumerate().filter(|(_, fd)| !fd.revents().is_empty()).map(|(index, _)| index);
        Ok((newcomer, talking.collect()))
    }

    /// How long until something has to be done though nobody says anything.
    fn next_duty(&self) -> Option<Duration> {
        let now = Instant::now();
        let silence_ends = self.connections.iter().filter_map(|connection| match connection.stage {
            Stage::Asking { since, .. } => Some(since + PATIENCE),
            Stage::Commanding { offer: Some(_), .. } => Some(now + OFFER_LOOK),
            _ => None,
        });
        let rest_ends = self.accept_after.filter(|after| *after > now);
        silence_ends.chain(rest_ends).min().map(|duty| duty.saturating_duration_since(now))
    }

    fn accept(&mut self) {
        self.accept_after = None;
        // Not the standard library's: it takes an `ioctl` more to make the connection non-blocking, and a driver
        // in its sandbox has none.
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let accepted = rustix::io::retry_on_intr(|| rustix::net::accept_with(&self.listener, flags));
        let stream = match accepted {
            Ok(stream) => UnixStream::from(stream),
            // Whoever knocked has left again.
            Err(Errno::AGAIN | Errno::CONNABORTED) => return,
            Err(_) => {
                self.accept_after = Some(Instant::now() + ACCEPT_REST);
                return;
            }
        };
        let pid = peer_pid(&stream);
        if self.connections.len() >= MAX_CONNECTIONS {
            let _ = socket::send(stream.as_fd(), &Answer::new(Verdict::Crowded), &[]);
            return;
        }
        let stage = Stage::Asking { bytes: [0; size_of::<Request>()], filled: 0, since: Instant::now() };
        self.connections.push(Connection { stream, pid, stage });
    }

    /// Reads what a connection has to say; the end of a lease shows here too.
    fn listen_to(&mut self, index: usize, memory: &DriverMemory, events: &mut Vec<ServerEvent>) {
        let connection = &mut self.connections[index];
        match connection.receive() {
            Heard::Nothing => {}
            Heard::End => {
                connection.end(events);
            }
            Heard::Request(request) => {
                let stage = self.serve(index, &request, memory, events);
                self.connections[index].stage = stage;
            }
        }
    }

    fn serve(
        &mut self,
        index: usize,
        request: &Request,
        memory: &DriverMemory,
        events: &mut Vec<ServerEvent>,
    ) -> Stage {
        let kind = match request.check() {
            Ok(kind) => kind,
            Err(verdict) => return self.refuse(index, verdict),
        };
        let pid = self.connections[index].pid;
        match kind {
            RequestKind::Observe => self.let_observe(index, memory),
            RequestKind::Command => self.lease_to(index, request, memory, events),
            RequestKind::Stop => {
                events.push(ServerEvent::StopRequested { pid });
                self.answer(index, &Answer::new(Verdict::Granted), &[])
            }
            RequestKind::ClearFault => {
                events.push(ServerEvent::ClearFaultRequested);
                self.answer(index, &Answer::new(Verdict::Granted), &[])
            }
            RequestKind::EmergencyStop => {
                events.push(ServerEvent::EmergencyStopRequested { pid });
                self.answer(index, &Answer::new(Verdict::Granted), &[])
            }
            RequestKind::EndLease => self.refuse(index, Verdict::UnknownKind),
            RequestKind::Zero => {
                events.push(ServerEvent::ZeroRequested { pid, devices: request.devices });
                self.answer(index, &Answer::new(Verdict::Granted), &[])
            }
        }
    }

    fn let_observe(&self, index: usize, memory: &DriverMemory) -> Stage {
        let observers = self.connections.iter().filter(|c| matches!(c.stage, Stage::Observing)).count();
        if observers >= MAX_OBSERVERS {
            return self.refuse(index, Verdict::Crowded);
        }
        match self.answer(index, &Answer::new(Verdict::Granted), &[memory.fd()]) {
            Stage::Served => Stage::Observing,
            failed => failed,
        }
    }

    fn lease_to(
        &mut self,
        index: usize,
        request: &Request,
        memory: &DriverMemory,
        events: &mut Vec<ServerEvent>,
    ) -> Stage {
        self.end_lease_of_the_dead(events);
        if self.holder().is_some() {
            events.push(ServerEvent::LeaseRefused);
            return self.refuse(index, Verdict::LeaseHeld);
        }
        let lease = self.next_lease;
        let offer = match LeaseOffer::create(lease, request.abi_version) {
            Ok(offer) => offer,
            Err(error) => {
                events.push(ServerEvent::Trouble { message: error.to_string() });
                return self.refuse(index, Verdict::NoSegment);
            }
        };
        let answer = Answer { lease, ..Answer::new(Verdict::Granted) };
        match self.answer(index, &answer, &[memory.fd(), offer.fd()]) {
            Stage::Served => {
                self.next_lease += 1;
                Stage::Commanding { lease, name: handshake::name_text(&request.name), offer: Some(offer) }
            }
            failed => failed,
        }
    }

    /// Puts into force what was offered, once nobody can take its memory away any more.
    fn grant_what_is_mapped(&mut self, events: &mut Vec<ServerEvent>) {
        for connection in &mut self.connections {
            let Stage::Commanding { name, offer, .. } = &mut connection.stage else { continue };
            let Some(mapped) = offer.take_if(|offer| offer.is_mapped()) else { continue };
            let (pid, name) = (connection.pid, name.clone());
            match mapped.seal() {
                Ok(view) => events.push(ServerEvent::LeaseGranted { view, pid, name }),
                Err(error) => {
                    let message =
                        format!("process {pid} ({name}) gets no lease, it sealed its memory: {error}");
                    events.push(ServerEvent::Trouble { message });
                    connection.stage = Stage::Gone;
                }
            }
        }
    }

    fn refuse(&self, index: usize, verdict: Verdict) -> Stage {
        let mut answer = Answer::new(verdict);
        if let Some((pid, name)) = self.holder() {
            answer.holder_pid = pid;
            answer.holder_name = handshake::name_bytes(name);
        }
        self.answer(index, &answer, &[]);
        Stage::Gone
    }

    /// Between two looks at all connections a holder may have died and its successor asked already: the
    /// successor must not be told that the dead one commands.
    fn end_lease_of_the_dead(&mut self, events: &mut Vec<ServerEvent>) {
        for connection in &mut self.connections {
            if matches!(connection.stage, Stage::Commanding { .. }) && connection.is_over() {
                connection.end(events);
            }
        }
    }

    /// Answers, and says what becomes of the connection.
    fn answer(&self, index: usize, answer: &Answer, fds: &[BorrowedFd<'_>]) -> Stage {
        match socket::send(self.connections[index].stream.as_fd(), answer, fds) {
            Ok(()) => Stage::Served,
            Err(_) => Stage::Gone,
        }
    }

    fn holder(&self) -> Option<(u64, &str)> {
        self.connections.iter().find_map(|connection| match &connection.stage {
            Stage::Commanding { name, .. } => Some((connection.pid, name.as_str())),
            _ => None,
        })
    }

    fn drop_the_silent(&mut self) {
        for connection in &mut self.connections {
            if matches!(connection.stage, Stage::Asking { since, .. } if since.elapsed() > PATIENCE) {
                connection.stage = Stage::Gone;
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        remove_if(&self.path, self.identity);
        let lock = self.lock.metadata().ok().map(|meta| identity_of(&meta));
        remove_if(&suffixed(&self.path, LOCK_SUFFIX), lock);
    }
}

enum Heard {
    Nothing,
    Request(Request),
    End,
}

impl Connection {
    fn receive(&mut self) -> Heard {
        let Stage::Asking { bytes, filled, .. } = &mut self.stage else {
            // Nothing is expected any more: this is the end, or a client that does not keep to the protocol.
            return Heard::End;
        };
        match rustix::net::recv(&self.stream, &mut bytes[*filled..], RecvFlags::empty()) {
            Ok((_, 0)) => return Heard::End,
            Ok((_, more)) => *filled += more,
            Err(errno) => return heard_error(errno),
        }
        if *filled < bytes.len() {
            return Heard::Nothing;
        }
        let mut request = Request::zeroed();
        bytemuck::bytes_of_mut(&mut request).copy_from_slice(bytes);
        Heard::Request(request)
    }

    /// Forgets it, and tells the loop if that knew of its lease.
    fn end(&mut self, events: &mut Vec<ServerEvent>) {
        if let Stage::Commanding { lease, offer: None, .. } = self.stage {
            events.push(ServerEvent::LeaseEnded { lease });
        }
        self.stage = Stage::Gone;
    }

    /// Whether the other end hung up; never blocks.
    fn is_over(&self) -> bool {
        let mut fds = [PollFd::new(&self.stream, PollFlags::RDHUP)];
        poll(&mut fds, Some(&timespec(Duration::ZERO))).is_ok_and(|ready| ready > 0)
    }
}

fn heard_error(errno: Errno) -> Heard {
    if errno == Errno::AGAIN || errno == Errno::INTR { Heard::Nothing } else { Heard::End }
}

fn timespec(duration: Duration) -> Timespec {
    Timespec {
        tv_sec: i64::try_from(duration.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: duration.subsec_nanos().into(),
    }
}

fn peer_pid(stream: &UnixStream) -> u64 {
    rustix::net::sockopt::socket_peercred(stream).map_or(0, |cred| cred.pid.as_raw_nonzero().get() as u64)
}

const LOCK_SUFFIX: &str = ".lock";

/// Takes the lock that says a driver lives here. The lock file may be removed and remade by a driver that
/// is just ending, so that the name is compared again after the lock was taken.
fn lock(path: &Path) -> Result<File, BindError> {
    let name = suffixed(path, LOCK_SUFFIX);
    let failed = |source| BindError::System { what: "lock", path: name.clone(), source };
    const TRIES: usize = 16;
    for _ in 0..TRIES {
        // The owner's alone: whoever could open it could hold the lock and keep every driver from starting.
        let mut options = File::options();
        let file =
            options.create(true).truncate(false).write(true).mode(0o600).open(&name).map_err(failed)?;
        match rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => {
                return Err(BindError::AlreadyRunning { socket: path.to_path_buf() });
            }
            Err(errno) => return Err(failed(errno.into())),
        }
        let held = identity_of(&file.metadata().map_err(failed)?);
        if std::fs::symlink_metadata(&name).is_ok_and(|named| identity_of(&named) == held) {
            return Ok(file);
        }
    }
    Err(BindError::AlreadyRunning { socket: path.to_path_buf() })
}

/// The lock keeps our own kind apart; this also spares whatever else lies at the path: a file that somebody
/// named by mistake, and a living socket whose lock file was swept away.
fn make_sure_nobody_listens(path: &Path) -> Result<(), BindError> {
    let system = |source| BindError::System { what: "listen at", path: path.to_path_buf(), source };
    match std::fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(system(error)),
        Ok(meta) if !meta.file_type().is_socket() => {
            let found = "something that is not a socket lies there, and it is left alone";
            return Err(system(io::Error::new(io::ErrorKind::AlreadyExists, found)));
        }
        Ok(_) => {}
    }
    let address = SocketAddrUnix::new(path).map_err(|errno| system(errno.into()))?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let probe = rustix::net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)
        .map_err(|errno| system(errno.into()))?;
    match rustix::net::connect(&probe, &address) {
        Err(Errno::CONNREFUSED | Errno::NOENT) => Ok(()),
        // A full queue belongs to somebody who lives but does not look.
        Ok(()) | Err(Errno::AGAIN) => Err(BindError::AlreadyRunning { socket: path.to_path_buf() }),
        Err(errno) => Err(system(errno.into())),
    }
}

/// Device and inode: the same file, whatever its name.
type Identity = (u64, u64);

fn identity_of(meta: &Metadata) -> Identity {
    (meta.dev(), meta.ino())
}

/// Removes a name only while it still names our file: another driver may have taken the place since.
fn remove_if(path: &Path, ours: Option<Identity>) {
    if std::fs::symlink_metadata(path).is_ok_and(|meta| Some(identity_of(&meta)) == ours) {
        let _ = std::fs::remove_file(path);
    }
}

fn suffixed(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(suffix);
    PathBuf::from(name)
}
