//! The driver's side of the socket: who may see the segments, and who commands.
//!
//! Model: one thread, which is not the real-time loop, polls the listening socket and all connections.
//! Exactly one connection holds the lease; it ends when the connection does, however that happens, and when the process
//! that asked for it does, whoever inherited the connection. For each lease a fresh commander's segment is made, so that
//! a former holder that still writes writes into memory nobody reads; the loop is given it once it is mapped and sealed
//! ([`LeaseOffer`]). What happens is handed to the owner as
//! [`ServerEvent`]s, for the loop, before whoever asked gets an answer.
//!
//! Who got an answer and has nothing to keep is hung up on at once; observers and silent newcomers have bounded places
//! (`server/places.rs`), and whoever leaves without having read the descriptors that it was sent keeps its place.
//! Newcomers are taken in bounded batches, and a flood of them makes the listener rest.
//!
//! Invariant: nothing a client sends or withholds blocks the thread; a client that connects and says
//! nothing is dropped after [`PATIENCE`], and one that says more than its request, at once: what nobody
//! reads may hold a copy of the connection itself, and so a lease that its holder's death does not end.
//! Cost: some twenty microseconds a connection (22 were measured, `docs/testing.md`); at most [`BATCH`] of them in each
//! [`FLOOD_REST`].

mod connection;
mod lapsed;
mod places;
mod sealer;

use crate::handshake::{self, Answer, Request, RequestKind, Verdict};
use crate::peer::{Peer, Process, ProcessWords, refuse_descriptors};
use crate::rights::{Right, Rights};
use crate::segment::{CommanderView, DriverMemory, LeaseOffer, SegmentError};
use crate::socket_file::{Lock, SocketFile, make_sure_nobody_listens, without_end};
use crate::{socket, users};
use connection::{Connection, Heard, Offer, Stage, timespec};
use lapsed::{Lapsed, Rival};
use places::Purpose;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use rustix::net::SocketFlags;
use sealer::Sealer;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::DirBuilderExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::{Duration, Instant};

pub use crate::socket_file::BindError;
pub use places::{COMMANDERS, MAX_ASKING, MAX_CONNECTIONS, OBSERVERS, Places};

/// How long a new connection may take to say what it wants.
pub const PATIENCE: Duration = Duration::from_secs(1);
/// Connections that are accepted in one turn.
pub const BATCH: usize = 32;
/// How long the listener rests after a turn that brought so many.
pub const FLOOD_REST: Duration = Duration::from_millis(2);
/// Connections that may wait to be accepted: as long as it takes for a batch of them, or a few.
const BACKLOG: i32 = 64;
/// After a failed accept (no descriptors left, say) the listener rests this long instead of spinning.
const ACCEPT_REST: Duration = Duration::from_millis(100);
/// How often it is looked whether a commander has mapped its segment.
const OFFER_LOOK: Duration = Duration::from_millis(1);
/// Time between two looks whether those who have left still hold what they were handed.
const UNREAD_LOOK: Duration = Duration::from_millis(100);

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
    /// The commander is gone, or somebody who may asked for the end of its lease.
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
    ClearFaultRequested {
        /// Whose process it is, if that is known.
        user: Option<u32>,
        /// Whether he may undo what others did.
        is_administrator: bool,
        /// When it was asked, by CLOCK_MONOTONIC (ns); no later than it was.
        asked_ns: u64,
    },
    /// Somebody asks for all motors off, now.
    EmergencyStopRequested {
        /// Who.
        pid: u64,
        /// Whose process it is, if that is known.
        user: Option<u32>,
        /// When it was asked, by CLOCK_MONOTONIC (ns); no later than it was.
        asked_ns: u64,
    },
    /// Somebody says that devices lie in their home pose now.
    ZeroRequested {
        /// Who.
        pid: u64,
        /// Bit `i`: device `i` does; 0: all do.
        devices: u64,
        /// When it was asked, by CLOCK_MONOTONIC (ns); no later than it was.
        asked_ns: u64,
    },
    /// A segment for a lease could not be made.
    Trouble {
        /// Why.
        message: String,
    },
}

/// Whoever passes events on to the loop; or keeps them all.
pub trait Recipient {
    /// Acts on an event.
    ///
    /// # Errors
    /// The verdict that the asker gets instead of what he asked for.
    fn take(&mut self, event: ServerEvent) -> Result<(), Verdict>;
}

impl Recipient for Vec<ServerEvent> {
    fn take(&mut self, event: ServerEvent) -> Result<(), Verdict> {
        self.push(event);
        Ok(())
    }
}

/// The listening driver.
#[derive(Debug)]
pub struct Server {
    listener: UnixListener,
    /// Removed with this value, before the lock.
    file: SocketFile,
    _lock: Lock,
    rights: Rights,
    sealer: Sealer,
    connections: Vec<Connection>,
    next_lease: u64,
    lapsed: Lapsed,
    accept_after: Option<Instant>,
    /// When the last two turns began, the older first (CLOCK_MONOTONIC, ns).
    turns_ns: [u64; 2],
}

impl Server {
    /// Listens at `path`, for whoever can connect. A socket left over from a driver that died is replaced.
    ///
    /// # Errors
    /// If another driver does, or the file system refuses.
    pub fn bind(path: &Path) -> Result<Self, BindError> {
        Self::bind_for(path, Rights::open())
    }

    /// The same for those who have these rights.
    ///
    /// # Errors
    /// As [`bind`](Self::bind).
    pub fn bind_for(path: &Path, rights: Rights) -> Result<Self, BindError> {
        users::look();
        let path = without_end(path);
        if let Some(directory) = path.parent().filter(|directory| !directory.as_os_str().is_empty()) {
            std::fs::DirBuilder::new()
                .recursive(true)
                .mode(0o750)
                .create(directory)
                .map_err(|source| BindError::system("create the directory", directory, source))?;
        }
        let lock = Lock::take(path)?;
        make_sure_nobody_listens(path)?;
        let prepare = |listener: &UnixListener| {
            refuse_descriptors(listener);
            rustix::net::listen(listener, BACKLOG)?;
            listener.set_nonblocking(true)
        };
        let (listener, file) = SocketFile::make(path, |path| UnixListener::bind(path), prepare)?;
        let connections = Vec::with_capacity(MAX_CONNECTIONS);
        let sealer = Sealer::start().map_err(BindError::NoThread)?;
        Ok(Self {
            listener,
            file,
            _lock: lock,
            rights,
            sealer,
            connections,
            next_lease: 1,
            lapsed: Lapsed::default(),
            accept_after: None,
            turns_ns: [handshake::monotonic_ns(); 2],
        })
    }

    /// Where it listens.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Waits up to `timeout` for something to happen, deals with it and hands over what the loop must know.
    ///
    /// # Errors
    /// If the kernel does not let it wait.
    pub fn poll(
        &mut self,
        memory: &DriverMemory,
        timeout: Duration,
        to: &mut impl Recipient,
    ) -> io::Result<()> {
        self.turns_ns = [self.turns_ns[1], handshake::monotonic_ns()];
        let (newcomer, talking) = self.wait(timeout)?;
        for index in talking {
            self.listen_to(index, memory, to);
        }
        self.grant_what_is_mapped(to);
        self.drop_the_silent(to);
        self.forget_the_gone();
        if newcomer {
            self.accept_batch(memory, to);
            self.forget_the_gone();
        }
        Ok(())
    }

    /// Whether there are newcomers, and whose connection or process has something to tell.
    fn wait(&self, timeout: Duration) -> io::Result<(bool, Vec<usize>)> {
        let timeout = timespec(self.next_duty().map_or(timeout, |duty| duty.min(timeout)));
        let accepting = self.accept_after.is_none_or(|after| Instant::now() >= after);
        let mut fds = Vec::with_capacity(self.connections.len() + 2);
        let heard: Vec<usize> =
            (0..self.connections.len()).filter(|i| !self.connections[*i].is_gone()).collect();
        let stream = |index: &usize| &self.connections[*index].stream;
        fds.extend(heard.iter().map(|index| PollFd::new(stream(index), PollFlags::IN | PollFlags::RDHUP)));
        let holder = self.holder();
        let process = holder.and_then(|(_, holder)| holder.process());
        fds.extend(process.map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN)));
        if accepting {
            fds.push(PollFd::new(&self.listener, PollFlags::IN));
        }
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok((false, Vec::new())),
            Err(errno) => return Err(errno.into()),
        }
        let is_ready = |fd: &PollFd<'_>| !fd.revents().is_empty();
        let newcomer = accepting && fds.pop().is_some_and(|fd| is_ready(&fd));
        let has_ended = process.is_some() && fds.pop().is_some_and(|fd| is_ready(&fd));
        let ended = holder.filter(|_| has_ended).map(|(index, _)| index);
        let talking = heard.into_iter().zip(&fds);
        let talking = talking.filter(|(index, fd)| is_ready(fd) || ended == Some(*index));
        Ok((newcomer, talking.map(|(index, _)| index).collect()))
    }

    /// How long until something has to be done though nobody says anything.
    fn next_duty(&self) -> Option<Duration> {
        let now = Instant::now();
        let silence_ends = self.connections.iter().filter_map(|connection| match connection.stage {
            Stage::Asking { since, .. } => Some(since + PATIENCE),
            Stage::Commanding { offer: Some(_), .. } => Some(now + OFFER_LOOK),
            Stage::Gone => Some(now + UNREAD_LOOK),
            _ => None,
        });
        let rest_ends = self.accept_after.filter(|after| *after > now);
        silence_ends.chain(rest_ends).min().map(|duty| duty.saturating_duration_since(now))
    }

    fn accept_batch(&mut self, memory: &DriverMemory, to: &mut impl Recipient) {
        self.accept_after = None;
        for _ in 0..BATCH {
            match self.accept() {
                Ok(stream) => self.welcome(stream, memory, to),
                // Whoever knocked has left again.
                Err(Errno::CONNABORTED) => {}
                Err(Errno::AGAIN) => return,
                Err(_) => return self.rest(ACCEPT_REST),
            }
        }
        self.rest(FLOOD_REST);
    }

    fn rest(&mut self, time: Duration) {
        self.accept_after = Some(Instant::now() + time);
    }

    /// Not the standard library's: it takes an `ioctl` more to make the connection non-blocking, and a driver
    /// in its sandbox has none.
    fn accept(&self) -> Result<UnixStream, Errno> {
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        rustix::io::retry_on_intr(|| rustix::net::accept_with(&self.listener, flags)).map(UnixStream::from)
    }

    /// Who has said already what he wants gets it at once, before any other newcomer can take his place.
    fn welcome(&mut self, stream: UnixStream, memory: &DriverMemory, to: &mut impl Recipient) {
        // Without its credentials nobody knows what it may do.
        let Ok(peer) = Peer::of(stream.as_fd()) else { return };
        self.connections.push(Connection::new(stream, peer));
        self.listen_to(self.connections.len() - 1, memory, to);
        self.make_place();
    }

    fn make_place(&mut self) {
        let silent = || self.connections.iter().enumerate().filter(|(_, connection)| connection.is_asking());
        if silent().count() <= MAX_ASKING {
            return;
        }
        let owners: Vec<_> = silent().map(|(_, connection)| connection.owner()).collect();
        let evicted = places::to_evict(&owners).and_then(|place| silent().nth(place)).map(|(index, _)| index);
        if let Some(index) = evicted {
            self.refuse(index, Verdict::Crowded);
            self.connections.remove(index);
        }
    }

    /// Reads what a connection has to say; the end of a lease shows here too.
    fn listen_to(&mut self, index: usize, memory: &DriverMemory, to: &mut impl Recipient) {
        match self.connections[index].receive() {
            Heard::Nothing => {}
            Heard::End => self.hang_up(index, to),
            Heard::Request(request) => {
                let stage = self.serve(index, &request, memory, to);
                self.connections[index].served(stage);
            }
        }
    }

    fn hang_up(&mut self, index: usize, to: &mut impl Recipient) {
        let former = std::mem::replace(&mut self.connections[index].stage, Stage::Gone);
        if matches!(former, Stage::Commanding { offer: Some(_), .. }) {
            self.lapsed.note_handed_back(self.rival(index));
        }
        // With an offer, the loop knows nothing of it yet.
        if let Stage::Commanding { lease, offer: None, .. } = former {
            // There is always room for this.
            let _ = to.take(ServerEvent::LeaseEnded { lease });
        }
    }

    fn serve(
        &mut self,
        index: usize,
        request: &Request,
        memory: &DriverMemory,
        to: &mut impl Recipient,
    ) -> Stage {
        let kind = match request.check() {
            Ok(kind) => kind,
            Err(verdict) => return self.refuse(index, verdict),
        };
        if let Err(group) = self.check(index, Right::for_request(kind)) {
            return self.deny(index, group);
        }
        let peer = &self.connections[index].peer;
        let (pid, user) = (u64::from(peer.pid), peer.user());
        let asked_ns = self.asked_ns(request, kind);
        match kind {
            RequestKind::Observe => self.let_observe(index, memory),
            RequestKind::Command => self.lease_to(index, request, memory, to),
            RequestKind::EndLease => self.end_lease(index, to),
            RequestKind::Stop => self.pass_on(index, ServerEvent::StopRequested { pid }, to),
            RequestKind::ClearFault => {
                let is_administrator = self.check(index, Right::Administer).is_ok();
                self.pass_on(index, ServerEvent::ClearFaultRequested { user, is_administrator, asked_ns }, to)
            }
            RequestKind::EmergencyStop => {
                match to.take(ServerEvent::EmergencyStopRequested { pid, user, asked_ns }) {
                    // Whoever finds no place to look from sees in the answers what becomes of it.
                    Ok(()) => self.part(index, &Answer::to_emergency_stop(memory.read_latest().as_ref())),
                    Err(verdict) => self.refuse(index, verdict),
                }
            }
            RequestKind::Zero => self.pass_on(
                index,
                ServerEvent::ZeroRequested { pid, devices: request.devices, asked_ns },
                to,
            ),
        }
    }

    /// When it was asked. Clients of before 1.3 do not tell; what they say is heard in the turn after they said it, unless
    /// there is a crowd. A time that is still to come is that of another clock, as time namespaces have: then a stop was
    /// asked for now, and everything else long ago, so that it undoes no stop.
    fn asked_ns(&self, request: &Request, kind: RequestKind) -> u64 {
        let now_ns = handshake::monotonic_ns();
        match request.asked_ns {
            0 => self.turns_ns[0],
            told if told <= now_ns => told,
            _ if kind == RequestKind::EmergencyStop => now_ns,
            _ => 0,
        }
    }

    /// Done first, answered then: whatever becomes of the answer, it is done.
    fn pass_on(&self, index: usize, event: ServerEvent, to: &mut impl Recipient) -> Stage {
        match to.take(event) {
            Ok(()) => self.part(index, &Answer::new(Verdict::Granted)),
            Err(Verdict::NotAllowed) => {
                let group = self.check(index, Right::Administer).err().flatten();
                self.deny(index, group)
            }
            Err(verdict) => self.refuse(index, verdict),
        }
    }

    /// Answers one who has nothing to keep.
    fn part(&self, index: usize, answer: &Answer) -> Stage {
        let _ = self.answer(index, answer, &[]);
        Stage::Gone
    }

    /// The group that has it, if there is one, if this client has it not.
    fn check(&self, index: usize, right: Right) -> Result<(), Option<u32>> {
        let connection = &self.connections[index];
        self.rights.check(right, connection.peer.user(), || connection.groups())
    }

    fn has_place(&self, index: usize, purpose: Purpose) -> bool {
        let others = self.connections.iter().filter(|other| other.has_place(purpose)).map(Connection::owner);
        let is_administrator = self.check(index, Right::Administer).is_ok();
        places::has_place(purpose, self.connections[index].owner(), is_administrator, others)
    }

    fn let_observe(&self, index: usize, memory: &DriverMemory) -> Stage {
        if !self.has_place(index, Purpose::Observe) {
            return self.refuse(index, Verdict::Crowded);
        }
        match self.answer(index, &Answer::new(Verdict::Granted), &[memory.fd()]) {
            Ok(()) => Stage::Observing,
            Err(_) => Stage::Gone,
        }
    }

    fn lease_to(
        &mut self,
        index: usize,
        request: &Request,
        memory: &DriverMemory,
        to: &mut impl Recipient,
    ) -> Stage {
        self.end_lease_of_the_dead(to);
        let connection = &self.connections[index];
        let process = Process::of(connection.stream.as_fd(), &connection.peer);
        if matches!(process, Process::Ended) {
            return Stage::Gone;
        }
        if self.lapsed.must_wait(self.rival(index)) {
            return self.refuse(index, Verdict::LeaseEnded);
        }
        // Whoever gets nothing himself takes nothing away.
        let has_place = self.has_place(index, Purpose::Command);
        if has_place {
            self.displace_offer(index, to);
        }
        if self.holder().is_some() {
            let _ = to.take(ServerEvent::LeaseRefused);
            return self.refuse(index, Verdict::LeaseHeld);
        }
        if !has_place {
            return self.refuse(index, Verdict::Crowded);
        }
        let lease = self.next_lease;
        let offer = match LeaseOffer::create(lease, request.abi_version) {
            Ok(offer) => offer,
            Err(error) => {
                let _ = to.take(ServerEvent::Trouble { message: error.to_string() });
                return self.refuse(index, Verdict::NoSegment);
            }
        };
        let answer = Answer { lease, ..Answer::new(Verdict::Granted) };
        if self.answer(index, &answer, &[memory.fd(), offer.fd()]).is_err() {
            return Stage::Gone;
        }
        self.next_lease += 1;
        Stage::Commanding {
            lease,
            name: handshake::name_text(&request.name),
            process,
            offer: Some(Offer::Made(offer)),
        }
    }

    /// Has sealed what was offered and mapped, and puts into force what is sealed: nobody can take its memory away any more.
    fn grant_what_is_mapped(&mut self, to: &mut impl Recipient) {
        let Self { connections, sealer, .. } = self;
        for connection in connections.iter_mut() {
            let Stage::Commanding { lease, offer, .. } = &mut connection.stage else { continue };
            let is_mapped = |offer: &mut Offer| matches!(offer, Offer::Made(made) if made.is_mapped());
            let Some(Offer::Made(mapped)) = offer.take_if(is_mapped) else { continue };
            *offer = Some(match sealer.begin(*lease, mapped) {
                Ok(()) => Offer::Sealing { since: Instant::now() },
                Err(mapped) => Offer::Made(mapped),
            });
        }
        while let Some((lease, result)) = self.sealer.result() {
            self.grant(lease, result, to);
        }
    }

    /// Puts this lease into force, if it is still wanted.
    fn grant(&mut self, lease: u64, sealed: Result<CommanderView, SegmentError>, to: &mut impl Recipient) {
        let is_it = |stage: &Stage| matches!(stage, Stage::Commanding { lease: held, .. } if *held == lease);
        let Some(index) = self.connections.iter().position(|c| is_it(&c.stage)) else { return };
        let connection = &mut self.connections[index];
        let pid = u64::from(connection.peer.pid);
        let Stage::Commanding { name, offer, .. } = &mut connection.stage else { return };
        *offer = None;
        let name = name.clone();
        match sealed {
            Ok(view) => {
                if to.take(ServerEvent::LeaseGranted { view, pid, name }).is_err() {
                    connection.stage = Stage::Gone;
                }
            }
            // He kept his memory from being sealed, perhaps to keep others from commanding meanwhile.
            Err(error) => {
                connection.stage = Stage::Gone;
                let rival = self.rival(index);
                if !self.lapsed.contains(rival.user) {
                    let message = format!("{} ({name}) gets no lease: {error}", ProcessWords(pid));
                    let _ = to.take(ServerEvent::Trouble { message });
                }
                self.lapsed.note(rival);
            }
        }
    }

    /// For the holder's own user, and for administrators.
    fn end_lease(&mut self, index: usize, to: &mut impl Recipient) -> Stage {
        if let Some((holder, connection)) = self.holder() {
            let asker = &self.connections[index];
            let may =
                self.rights.check_end_of_lease(connection.peer.user(), asker.peer.user(), || asker.groups());
            match may {
                Err(group) => return self.deny(index, group),
                Ok(()) => {
                    let [holds, asks] = [holder, index].map(|index| self.rival(index));
                    if asks.is_administrator && !holds.is_administrator {
                        self.lapsed.note_ended(holds);
                    }
                    self.hang_up(holder, to);
                }
            }
        }
        self.part(index, &Answer::new(Verdict::Granted))
    }

    fn deny(&self, index: usize, group: Option<u32>) -> Stage {
        self.part(index, &Answer::not_allowed(group))
    }

    fn refuse(&self, index: usize, verdict: Verdict) -> Stage {
        let mut answer = Answer::new(verdict);
        if let Some((_, holder)) = self.holder()
            && let Stage::Commanding { name, .. } = &holder.stage
        {
            answer.holder_pid = holder.peer.pid.into();
            answer.holder_name = handshake::name_bytes(name);
        }
        self.part(index, &answer)
    }

    /// Between two looks at all connections a holder may have died and its successor asked already: the
    /// successor must not be told that the dead one commands.
    fn end_lease_of_the_dead(&mut self, to: &mut impl Recipient) {
        let dead = self.holder().filter(|(_, holder)| holder.is_over()).map(|(index, _)| index);
        if let Some(index) = dead {
            self.hang_up(index, to);
        }
    }

    /// Takes an offer that gives way to this newcomer back from its holder, and says so, but not again and again of one who lets
    /// every offer lapse.
    fn displace_offer(&mut self, newcomer: usize, to: &mut impl Recipient) {
        let Some((holder, connection)) = self.holder() else { return };
        let Stage::Commanding { offer: Some(offer), name, .. } = &connection.stage else { return };
        let rivals = [self.rival(holder), self.rival(newcomer)];
        if !self.lapsed.gives_way(rivals[0], rivals[1], offer.is_idle()) {
            return;
        }
        let [held_by, asked_by] =
            [holder, newcomer].map(|index| ProcessWords(self.connections[index].peer.pid.into()));
        let message = format!(
            "{held_by} ({name}) has not taken the lease that it was offered, and loses it to {asked_by}"
        );
        if !self.lapsed.contains(rivals[0].user) {
            let _ = to.take(ServerEvent::Trouble { message });
        }
        // One of whom an administrator wants it has done nothing wrong.
        if !rivals[1].is_administrator {
            self.lapsed.note(rivals[0]);
        }
        self.connections[holder].stage = Stage::Gone;
    }

    fn rival(&self, index: usize) -> Rival {
        let is_administrator = self.check(index, Right::Administer).is_ok();
        Rival { user: self.connections[index].owner().user, is_administrator }
    }

    fn answer(&self, index: usize, answer: &Answer, fds: &[BorrowedFd<'_>]) -> io::Result<()> {
        socket::send(self.connections[index].stream.as_fd(), answer, fds)
    }

    /// The connection that holds the lease.
    fn holder(&self) -> Option<(usize, &Connection)> {
        let mut all = self.connections.iter().enumerate();
        all.find(|(_, connection)| matches!(connection.stage, Stage::Commanding { .. }))
    }

    fn drop_the_silent(&mut self, to: &mut impl Recipient) {
        for index in 0..self.connections.len() {
            let connection = &self.connections[index];
            match &connection.stage {
                Stage::Asking { since, .. } if since.elapsed() > PATIENCE => {}
                // The loop knows nothing of this lease yet.
                Stage::Commanding { offer: Some(offer), name, .. } if offer.is_overdue() => {
                    let (process, why) = (ProcessWords(connection.peer.pid.into()), offer.why_overdue());
                    let message = format!("{process} ({name}) gets no lease: {why}");
                    let _ = to.take(ServerEvent::Trouble { message });
                    if !offer.waits_for_others() {
                        self.lapsed.note(self.rival(index));
                    }
                }
                _ => continue,
            }
            self.connections[index].stage = Stage::Gone;
        }
    }

    fn forget_the_gone(&mut self) {
        self.connections.retain(|connection| !connection.is_gone() || connection.left_descriptors());
    }
}

#[cfg(test)]
mod tests {
    use super::lapsed::MAPPED_WITHIN;
    use super::*;
    use crate::doorbell::WaitMode;
    use crate::segment::{ClockMode, DriverInfo};
    use bytemuck::Zeroable;
    use std::io::{Read, Write};

    /// One that belongs to no group of this process.
    const GROUP: u32 = 4242;

    /// Sends a request as this user; the answer.
    fn ask(server: &mut Server, memory: &DriverMemory, uid: u32, kind: RequestKind) -> (UnixStream, Verdict) {
        ask_and_hear(server, memory, uid, kind, &mut Vec::new())
    }

    /// The same, with what the driver is told.
    fn ask_and_hear(
        server: &mut Server,
        memory: &DriverMemory,
        uid: u32,
        kind: RequestKind,
        events: &mut Vec<ServerEvent>,
    ) -> (UnixStream, Verdict) {
        let (mut far, near) = UnixStream::pair().unwrap();
        near.set_nonblocking(true).unwrap();
        let peer = Peer { uid, ..Peer::of(far.as_fd()).unwrap() };
        server.connections.push(Connection::new(near, peer));
        far.write_all(bytemuck::bytes_of(&Request::new(kind, "test"))).unwrap();
        server.listen_to(server.connections.len() - 1, memory, events);
        server.forget_the_gone();
        let mut answer = Answer::zeroed();
        far.read_exact(bytemuck::bytes_of_mut(&mut answer)).unwrap();
        (far, Verdict::from_word(answer.verdict).unwrap())
    }

    fn driver_info() -> DriverInfo {
        DriverInfo {
            period_ns: 1_000_000,
            reply_budget_ns: 300_000,
            max_command_age_ticks: 5,
            ramp_in_ticks: 200,
            ramp_out_ticks: 50,
            is_commissioning: false,
            clock_mode: ClockMode::Virtual,
            wait_mode: WaitMode::Futex,
            cpu: None,
            devices: Vec::new(),
            setup_report: String::new(),
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn an_offer_that_nobody_takes_gives_way_to_other_users_and_at_once_to_administrators() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let memory = DriverMemory::create(&driver_info()).unwrap();
        let owner = server.rights.owner;
        let [one, other] = [owner + 1, owner + 2];
        let mut command = |uid| ask(&mut server, &memory, uid, RequestKind::Command);
        let [(_first, granted), (_refused, held)] = [one, other].map(&mut command);
        // He may still be about to map it.
        assert_eq!([granted, held], [Verdict::Granted, Verdict::LeaseHeld]);
        let (_second, granted) = command(owner);
        assert_eq!(granted, Verdict::Granted, "an administrator");
        std::thread::sleep(MAPPED_WITHIN + Duration::from_millis(20));
        assert_eq!(command(one).1, Verdict::LeaseHeld, "an administrator's");
        assert_eq!(command(owner).1, Verdict::LeaseHeld, "it is his own");
        server.connections.clear();
        let mut command = |uid| ask(&mut server, &memory, uid, RequestKind::Command);
        let (_third, granted) = command(one);
        assert_eq!(granted, Verdict::Granted);
        std::thread::sleep(MAPPED_WITHIN + Duration::from_millis(20));
        let (_fourth, granted) = command(other);
        assert_eq!(granted, Verdict::Granted, "time enough");
        // Who lets one lapse gets none from others until they had time enough.
        assert_eq!(command(one).1, Verdict::LeaseHeld);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn whose_lease_an_administrator_ends_does_not_have_it_again_at_once() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let memory = DriverMemory::create(&driver_info()).unwrap();
        let owner = server.rights.owner;
        let [one, other] = [1, 2].map(|more| owner + more);
        let mut asks = |uid, kind| ask(&mut server, &memory, uid, kind);
        let (command, end) = (RequestKind::Command, RequestKind::EndLease);
        let (_holds, granted) = asks(one, command);
        // One who ends his own may begin again.
        assert_eq!([granted, asks(one, end).1], [Verdict::Granted; 2]);
        let (_holds, granted) = asks(one, command);
        assert_eq!([granted, asks(owner, end).1], [Verdict::Granted; 2]);
        assert_eq!(asks(one, command).1, Verdict::LeaseEnded);
        assert_eq!(asks(other, command).1, Verdict::Granted);
        assert_eq!(asks(owner, command).1, Verdict::Granted, "takes the other's offer");
    }

    /// His memory is sealed against sealing.
    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn who_keeps_his_memory_from_being_sealed_has_lapsed_and_is_told_once() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let memory = DriverMemory::create(&driver_info()).unwrap();
        let owner = server.rights.owner;
        let [one, other] = [1, 2].map(|more| owner + more);
        let mut events = Vec::new();
        for _ in 0..2 {
            let (_holds, granted) =
                ask_and_hear(&mut server, &memory, one, RequestKind::Command, &mut events);
            assert_eq!(granted, Verdict::Granted);
            let lease = server.next_lease - 1;
            server.grant(lease, Err(SegmentError::NotSealed { found: 0, expected: 1 }), &mut events);
            server.forget_the_gone();
        }
        let troubles = events.iter().filter(|event| matches!(event, ServerEvent::Trouble { .. })).count();
        assert_eq!(troubles, 1, "{events:?}");
        let (_holds, granted) = ask(&mut server, &memory, one, RequestKind::Command);
        assert_eq!(granted, Verdict::Granted);
        assert_eq!(ask(&mut server, &memory, other, RequestKind::Command).1, Verdict::Granted, "at once");
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn an_offer_that_was_taken_away_is_told_but_not_again_of_who_lets_every_one_lapse() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let memory = DriverMemory::create(&driver_info()).unwrap();
        let owner = server.rights.owner;
        let [one, other, third] = [1, 2, 3].map(|more| owner + more);
        let mut far = Vec::new();
        // Who asks, whether the one before had time enough, whether it is told, and who has lapsed by then.
        let steps = [
            (one, false, false, vec![]),
            (other, true, true, vec![one]),
            (one, true, true, vec![one, other]),
            (other, true, false, vec![one, other]),
            (owner, false, false, vec![one, other]),
        ];
        for (number, (uid, waits, is_told, lapsed)) in steps.into_iter().enumerate() {
            if waits {
                std::thread::sleep(MAPPED_WITHIN + Duration::from_millis(20));
            }
            let mut events = Vec::new();
            let (stream, granted) =
                ask_and_hear(&mut server, &memory, uid, RequestKind::Command, &mut events);
            far.push(stream);
            assert_eq!(granted, Verdict::Granted, "{number}");
            let words = "has not taken the lease that it was offered, and loses it to";
            let tells = |event: &ServerEvent| matches!(event, ServerEvent::Trouble { message } if message.contains(words));
            assert_eq!(events.iter().any(tells), is_told, "{number}: {events:?}");
            let has_lapsed: Vec<_> = [one, other, third, owner]
                .into_iter()
                .filter(|uid| server.lapsed.contains(Some(*uid)))
                .collect();
            assert_eq!(has_lapsed, lapsed, "{number}");
        }
        // Of whom an administrator takes it that is told, and he has done nothing wrong.
        server.connections.clear();
        let (_third, granted) = ask(&mut server, &memory, third, RequestKind::Command);
        assert_eq!(granted, Verdict::Granted);
        let mut events = Vec::new();
        let (_owner, granted) = ask_and_hear(&mut server, &memory, owner, RequestKind::Command, &mut events);
        assert_eq!((granted, events.len()), (Verdict::Granted, 1));
        assert!(!server.lapsed.contains(Some(third)));
    }

    /// One that was not mapped has lapsed; one that was, and only waits for another's to be sealed, has not.
    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn an_offer_that_is_overdue_has_lapsed_but_for_one_that_waits_for_others() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let users = [1, 2].map(|more| server.rights.owner + more);
        let mut kept = Vec::new();
        for (uid, is_mapped) in users.into_iter().zip([false, true]) {
            let (far, near) = UnixStream::pair().unwrap();
            let peer = Peer { uid, ..Peer::of(far.as_fd()).unwrap() };
            let offer = LeaseOffer::create(1, crate::layout::ABI_VERSION).unwrap();
            let memory = is_mapped.then(|| crate::CommanderMemory::map(offer.fd()).unwrap());
            let mut connection = Connection::new(near, peer);
            let (process, offer) = (Process::Unknown, Some(Offer::Made(offer)));
            connection.served(Stage::Commanding { lease: 1, name: "test".into(), process, offer });
            server.connections.push(connection);
            kept.push((far, memory));
        }
        std::thread::sleep(crate::segment::TAKEN_WITHIN + Duration::from_millis(50));
        let mut events = Vec::new();
        server.drop_the_silent(&mut events);
        assert_eq!(events.len(), 2, "{events:?}");
        assert!(server.connections.iter().all(Connection::is_gone));
        assert_eq!(users.map(|uid| server.lapsed.contains(Some(uid))), [true, false]);
    }

    /// Sends requests to command as two users, one of whom has no place to command from.
    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn who_gets_no_lease_himself_takes_no_offer_from_others() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let memory = DriverMemory::create(&driver_info()).unwrap();
        let [one, other] = [server.rights.owner + 1, server.rights.owner + 2];
        // Their other ends leave unread what they were sent.
        let far: Vec<_> = (0..COMMANDERS.of_process)
            .map(|_| {
                let (far, near) = UnixStream::pair().unwrap();
                let peer = Peer { uid: other, ..Peer::of(far.as_fd()).unwrap() };
                let mut gone = Connection::new(near, peer);
                let offer = LeaseOffer::create(1, crate::layout::ABI_VERSION).unwrap();
                socket::send(gone.stream.as_fd(), &Answer::new(Verdict::Granted), &[memory.fd(), offer.fd()])
                    .unwrap();
                let made = Stage::Commanding {
                    lease: 1,
                    name: "test".into(),
                    process: Process::Unknown,
                    offer: Some(Offer::Made(offer)),
                };
                gone.served(made);
                gone.stage = Stage::Gone;
                server.connections.push(gone);
                far
            })
            .collect();
        let (_offered, granted) = ask(&mut server, &memory, one, RequestKind::Command);
        assert_eq!(granted, Verdict::Granted);
        server.lapsed.note(Rival { user: Some(one), is_administrator: false });
        assert_eq!(ask(&mut server, &memory, other, RequestKind::Command).1, Verdict::LeaseHeld);
        assert!(matches!(server.holder(), Some((_, holder)) if holder.owner().user == Some(one)));
        // With a place again he gets it: the holder has lapsed.
        drop(far);
        server.connections.retain(|connection| !connection.is_gone());
        assert_eq!(ask(&mut server, &memory, other, RequestKind::Command).1, Verdict::Granted);
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets are the system's")]
    fn a_right_is_looked_up_for_the_user_and_the_groups_of_the_connection() {
        let directory = tempfile::tempdir().unwrap();
        let mut server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        let owner = server.rights.owner;
        let _far = [(owner, GROUP + 1), (owner + 1, GROUP + 1), (owner + 1, GROUP)].map(|(uid, gid)| {
            let (far, near) = UnixStream::pair().unwrap();
            let peer = Peer { uid, gid, ..Peer::of(far.as_fd()).unwrap() };
            server.connections.push(Connection::new(near, peer));
            far
        });
        let found = |server: &Server, right| [0, 1, 2].map(|index| server.check(index, right));
        assert_eq!(found(&server, Right::Command), [Ok(()); 3]);
        assert_eq!(found(&server, Right::Administer), [Ok(()), Err(None), Err(None)]);
        server.rights.administer = Some(GROUP);
        assert_eq!(found(&server, Right::Administer), [Ok(()), Err(Some(GROUP)), Ok(())]);
    }
}
