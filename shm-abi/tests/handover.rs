//! Who gets which memory, and what is said to those who get none: the real server and client over a real
//! socket, with dead drivers, dead clients and liars on either side.

mod common;
#[path = "common/host.rs"]
mod host;

use common::{HANG, command, frame, info, is_frame, wait_until};
use host::Host;
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::server::{BindError, MAX_CONNECTIONS, MAX_OBSERVERS, PATIENCE, Server, ServerEvent};
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverView, Frame, LAYOUT_HASH};
use std::fs::{File, Permissions};
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::{FileExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bytemuck::Zeroable;

const SHORT: Duration = Duration::from_millis(10);

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn own_pid() -> u64 {
    u64::from(std::process::id())
}

/// A server that is polled by hand, for what depends on the order of things.
struct Desk {
    memory: DriverMemory,
    server: Server,
    events: Vec<ServerEvent>,
    /// Removed with this value.
    _directory: tempfile::TempDir,
}

impl Desk {
    fn open() -> Self {
        let directory = directory();
        let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        Self {
            memory: DriverMemory::create(&info()).unwrap(),
            server,
            events: Vec::new(),
            _directory: directory,
        }
    }

    fn poll(&mut self, timeout: Duration) {
        self.server.poll(&self.memory, timeout, &mut self.events).unwrap();
    }

    /// Connects and lets the server accept.
    fn connect(&mut self) -> UnixStream {
        let stream = UnixStream::connect(self.server.path()).unwrap();
        self.poll(HANG);
        stream
    }

    fn granted(&mut self, kind: RequestKind) -> UnixStream {
        let mut stream = self.connect();
        stream.write_all(bytemuck::bytes_of(&Request::new(kind, "raw"))).unwrap();
        self.poll(HANG);
        assert_eq!(verdict(&mut stream), Some(Verdict::Granted));
        stream
    }
}

/// The verdict of the answer that lies ready; `None` if the connection was closed without one.
fn verdict(stream: &mut UnixStream) -> Option<Verdict> {
    stream.set_read_timeout(Some(HANG)).unwrap();
    let mut answer = Answer::zeroed();
    stream.read_exact(bytemuck::bytes_of_mut(&mut answer)).ok()?;
    Verdict::from_word(answer.verdict)
}

fn is_closed(stream: &mut UnixStream) -> bool {
    stream.set_read_timeout(Some(HANG)).unwrap();
    // With something of ours unread on the other side, the end comes as a reset.
    match stream.read(&mut [0; 1]) {
        Ok(read) => read == 0,
        Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
    }
}

// ---- What is granted ----

#[test]
fn an_observer_gets_the_frames_and_no_command() {
    let directory = directory();
    let host = Host::start(directory.path());
    host.memory.write_frame(&frame(7));
    host.memory.ring(7, None);
    let attached = client::observe(&host.socket, "looker").unwrap();
    assert!(attached.commander.is_none());
    assert_eq!(attached.driver_pid, own_pid());
    assert_eq!(attached.driver.info(), info());
    assert!(attached.connection.is_open());
    assert!(is_frame(&attached.driver.read_latest().unwrap(), 7));
    assert!(host.events.try_recv().is_err(), "an observer is none of the loop's business");
}

#[test]
fn a_commander_gets_both_segments_and_the_driver_reads_its_commands() {
    let directory = directory();
    let host = Host::start(directory.path());
    let attached = client::command(&host.socket, "hand").unwrap();
    let ServerEvent::LeaseGranted { view, pid, name } = host.event() else { panic!("no lease") };
    let own = attached.commander.as_ref().unwrap();
    assert_eq!((pid, name.as_str(), view.lease(), own.lease()), (own_pid(), "hand", 1, 1));
    own.publish(&Command::zero(3, own.lease(), 2), &attached.driver);
    assert_eq!(view.latest_tick(), Some(3));
    let mut found = Command::zeroed();
    view.read_command(3, &mut found).unwrap();
    assert_eq!(found.validate(3, view.lease(), 2), Ok(()));
}

#[test]
fn stop_and_clear_fault_reach_the_loop_with_the_name_of_the_asker() {
    let directory = directory();
    let host = Host::start(directory.path());
    assert_eq!(client::stop(&host.socket, "test").unwrap(), own_pid());
    assert!(matches!(host.event(), ServerEvent::StopRequested { pid } if pid == own_pid()));
    client::clear_fault(&host.socket, "test").unwrap();
    assert!(matches!(host.event(), ServerEvent::ClearFaultRequested));
}

#[test]
fn a_second_commander_is_refused_with_pid_and_name_of_the_first() {
    let directory = directory();
    let host = Host::start(directory.path());
    let first = client::command(&host.socket, "first").unwrap();
    assert!(matches!(host.event(), ServerEvent::LeaseGranted { .. }));
    let refusal = client::command(&host.socket, "second").unwrap_err();
    assert_eq!(
        refusal.to_string(),
        format!(
            "the devices are commanded by process {} (first) already; end it first, or attach as an observer",
            own_pid()
        )
    );
    assert!(matches!(host.event(), ServerEvent::LeaseRefused));
    assert!(first.connection.is_open(), "the first is not disturbed");
}

#[test]
fn the_next_lease_has_the_next_number_and_a_memory_that_the_former_holder_cannot_reach() {
    let directory = directory();
    let host = Host::start(directory.path());
    let former = client::command(&host.socket, "former").unwrap();
    assert!(matches!(host.event(), ServerEvent::LeaseGranted { .. }));
    let (former_memory, driver) = (former.commander.unwrap(), former.driver);
    drop(former.connection);
    assert!(matches!(host.event(), ServerEvent::LeaseEnded { lease: 1 }));

    let next = client::command(&host.socket, "next").unwrap();
    let ServerEvent::LeaseGranted { view, .. } = host.event() else { panic!("no lease") };
    assert_eq!((view.lease(), next.commander.unwrap().lease()), (2, 2));
    former_memory.publish(&command(5), &driver);
    assert_eq!(view.latest_tick(), None, "the late write shows");
    let mut found = Command::zeroed();
    view.read_command(5, &mut found).unwrap();
    assert_eq!(found, Command::zeroed(), "the late write shows");
}

#[test]
fn a_successor_is_not_told_that_the_dead_holder_commands() {
    let mut desk = Desk::open();
    // Accepted first, and so looked at first.
    let mut successor = desk.connect();
    let holder = desk.granted(RequestKind::Command);
    drop(holder);
    successor.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Command, "heir"))).unwrap();
    desk.poll(HANG);
    assert_eq!(verdict(&mut successor), Some(Verdict::Granted));
    assert!(matches!(
        desk.events[..],
        [
            ServerEvent::LeaseGranted { .. },
            ServerEvent::LeaseEnded { lease: 1 },
            ServerEvent::LeaseGranted { .. }
        ]
    ));
    // The end is told once.
    desk.poll(SHORT);
    assert_eq!(desk.events.len(), 3);
}

#[test]
fn a_client_that_says_more_than_its_request_is_hung_up_on() {
    let mut desk = Desk::open();
    let mut stream = desk.granted(RequestKind::Command);
    stream.write_all(b"and another thing").unwrap();
    desk.poll(HANG);
    assert!(is_closed(&mut stream));
    assert!(matches!(
        desk.events[..],
        [ServerEvent::LeaseGranted { .. }, ServerEvent::LeaseEnded { lease: 1 }]
    ));
}

#[test]
fn a_connection_that_holds_itself_alive_does_not_hold_the_lease() {
    let mut desk = Desk::open();
    let stream = desk.granted(RequestKind::Command);
    // A copy of the client's end, on its way to a server that need not ever fetch it: nobody's death closes
    // this connection.
    send(&stream, b"x", &[stream.as_fd()]);
    drop(stream);
    desk.poll(HANG);
    assert!(matches!(desk.events.last(), Some(ServerEvent::LeaseEnded { lease: 1 })), "{:?}", desk.events);
}

// ---- What nobody may do to the memory ----

#[test]
fn whoever_is_handed_the_drivers_segment_can_neither_write_nor_resize_it() {
    let memory = DriverMemory::create(&info()).unwrap();
    let bytes = size_of::<shm_abi::DriverSegment>() as u64;
    let file = File::from(memory.fd().try_clone_to_owned().unwrap());
    let denied = |what: &str, result: std::io::Result<()>| {
        let error = result.expect_err(what);
        assert_eq!(error.raw_os_error(), Some(rustix::io::Errno::PERM.raw_os_error()), "{what}: {error}");
    };
    denied("map writable", memmap2::MmapOptions::new().len(4096).map_raw(&file).map(|_| ()));
    denied("write", file.write_at(&[1], 0).map(|_| ()));
    denied("shrink", file.set_len(bytes - 4096));
    denied("grow", file.set_len(bytes + 4096));
    let hole = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
    denied("punch a hole", rustix::fs::fallocate(&file, hole, 0, 4096).map_err(Into::into));
    let reopened = File::options()
        .read(true)
        .write(true)
        .open(format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&file)));
    denied("write through a new description", reopened.and_then(|file| file.write_at(&[1], 0)).map(|_| ()));
    denied("unseal", rustix::fs::fcntl_add_seals(&file, rustix::fs::SealFlags::WRITE).map_err(Into::into));
}

#[test]
fn a_read_only_mapping_of_the_drivers_segment_cannot_be_made_writable() {
    let memory = DriverMemory::create(&info()).unwrap();
    let map = memmap2::MmapOptions::new().len(4096).map_raw_read_only(&memory.fd()).unwrap();
    // SAFETY: the page is this test's own mapping; even if made writable, nothing refers to it.
    let changed =
        unsafe { rustix::mm::mprotect(map.as_mut_ptr().cast(), 4096, rustix::mm::MprotectFlags::WRITE) };
    assert_eq!(changed, Err(rustix::io::Errno::ACCESS));
}

#[test]
fn a_commander_that_punches_a_hole_into_its_memory_only_erases_its_commands() {
    let memory = DriverMemory::create(&info()).unwrap();
    let driver = DriverView::map(memory.fd()).unwrap();
    let (view, fd) = CommanderView::create(1).unwrap();
    let commander = CommanderMemory::map(fd.as_fd()).unwrap();
    commander.publish(&command(2), &driver);
    let hole = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
    rustix::fs::fallocate(&fd, hole, 0, size_of::<shm_abi::CommanderSegment>() as u64).unwrap();
    let mut found = command(9);
    view.read_command(2, &mut found).unwrap();
    assert_eq!((view.latest_tick(), found), (None, Command::zeroed()));
    assert_eq!(view.lease(), 1, "the driver's own knowledge");
    assert!(File::from(fd).set_len(0).is_err(), "but it cannot shrink it, which would be SIGBUS");
}

#[test]
fn what_the_driver_says_of_itself_is_cleaned_before_it_is_shown() {
    let mut odd = info();
    odd.devices[0].name = "a\u{1b}[2J".into();
    odd.devices[1].name = "ä".repeat(40);
    let memory = DriverMemory::create(&odd).unwrap();
    let devices = DriverView::map(memory.fd()).unwrap().info().devices;
    assert_eq!(devices[0].name, "a?[2J");
    assert_eq!(devices[1].name, "ä".repeat(32), "cut between characters");
    let order = std::sync::atomic::Ordering::Relaxed;
    memory.header.device_count.store(u64::MAX, order);
    memory.header.wait_mode.store(99, order);
    memory.header.period_ns.store(0, order);
    let info = DriverView::map(memory.fd()).unwrap().info();
    assert_eq!((info.devices.len(), info.period_ns), (shm_abi::MAX_DEVICES, 1));
}

// ---- Crowds, silence, garbage ----

#[test]
fn observers_in_any_number_leave_room_for_a_commander_and_a_stop() {
    let directory = directory();
    let host = Host::start(directory.path());
    let observers: Vec<_> =
        (0..MAX_OBSERVERS).map(|_| client::observe(&host.socket, "looker").unwrap()).collect();
    let refusal = client::observe(&host.socket, "one too many").unwrap_err();
    let crowded = "the driver refused: it has too many connections; close some observers";
    assert_eq!(refusal.to_string(), crowded);
    let commander = client::command(&host.socket, "hand").unwrap();
    client::stop(&host.socket, "test").unwrap();
    drop(observers);
    wait_until("a place is free again", || client::observe(&host.socket, "looker").is_ok());
    drop(commander);
}

#[test]
fn the_connection_after_the_last_is_told_so_even_before_it_asks() {
    let mut desk = Desk::open();
    let silent: Vec<_> = (0..MAX_CONNECTIONS).map(|_| desk.connect()).collect();
    let mut last = desk.connect();
    assert_eq!(verdict(&mut last), Some(Verdict::Crowded));
    assert!(is_closed(&mut last));
    drop(silent);
}

#[test]
fn an_answer_that_came_before_the_request_was_sent_counts() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    // Whether the client meets a closed connection when it sends is chance; many rounds, to meet it.
    const ROUNDS: usize = 2000;
    let server = fake_server(&socket, ROUNDS, |mut stream| {
        stream.write_all(bytemuck::bytes_of(&Answer::new(Verdict::Crowded))).unwrap();
    });
    for _ in 0..ROUNDS {
        let error = client::observe(&socket, "test").unwrap_err();
        assert!(matches!(error, AttachError::Refused(_)), "{error}");
    }
    server.join().unwrap();
}

#[test]
fn a_silent_client_is_dropped_when_patience_ends_however_long_the_poll_may_last() {
    let mut desk = Desk::open();
    let start = Instant::now();
    let mut silent = desk.connect();
    wait_until("it is dropped", || {
        desk.poll(Duration::MAX);
        start.elapsed() > PATIENCE
    });
    desk.poll(SHORT);
    assert!(is_closed(&mut silent));
    assert!(desk.events.is_empty());
}

#[test]
fn a_poll_without_end_waits_for_whoever_comes() {
    let mut desk = Desk::open();
    let mut stream = UnixStream::connect(desk.server.path()).unwrap();
    desk.poll(Duration::MAX);
    stream.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Observe, "raw"))).unwrap();
    desk.poll(Duration::MAX);
    assert_eq!(verdict(&mut stream), Some(Verdict::Granted));
}

#[test]
fn a_request_that_comes_byte_by_byte_is_a_request() {
    let mut desk = Desk::open();
    let mut stream = desk.connect();
    for byte in bytemuck::bytes_of(&Request::new(RequestKind::Observe, "slow")) {
        stream.write_all(&[*byte]).unwrap();
        desk.poll(SHORT);
    }
    assert_eq!(verdict(&mut stream), Some(Verdict::Granted));
}

#[test]
fn half_a_request_followed_by_the_end_is_forgotten() {
    let mut desk = Desk::open();
    let mut stream = desk.connect();
    stream.write_all(&bytemuck::bytes_of(&Request::new(RequestKind::Command, "half"))[..64]).unwrap();
    desk.poll(HANG);
    drop(stream);
    desk.poll(HANG);
    assert!(desk.events.is_empty());
    desk.granted(RequestKind::Command);
}

#[test]
fn garbage_is_answered_and_hung_up_on() {
    let mut desk = Desk::open();
    let mut stream = desk.connect();
    stream.write_all(&[b'G'; size_of::<Request>()]).unwrap();
    desk.poll(HANG);
    assert_eq!(verdict(&mut stream), Some(Verdict::WrongMagic));
    desk.poll(SHORT);
    assert!(is_closed(&mut stream));
}

#[test]
fn no_bytes_but_a_true_request_are_ever_granted() {
    use proptest::prelude::*;
    // The runner may call its check again and again, but not with a mutable capture.
    let desk = std::cell::RefCell::new(Desk::open());
    let true_head = bytemuck::bytes_of(&Request::new(RequestKind::Observe, ""))[..24].to_vec();
    // Nothing, or the beginning of a true request so that the later checks are reached, then anything.
    let bytes = (0usize..=24, prop::collection::vec(any::<u8>(), 0..300)).prop_map(move |(kept, noise)| {
        let mut bytes = true_head[..kept].to_vec();
        bytes.extend(noise);
        bytes
    });
    // The chance that noise makes a true kind of request is 2^-61.
    let config = ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = proptest::test_runner::TestRunner::new(config);
    runner
        .run(&(bytes, 1usize..200), |(bytes, piece)| {
            let mut desk = desk.borrow_mut();
            let mut stream = UnixStream::connect(desk.server.path()).unwrap();
            desk.poll(HANG);
            for piece in bytes.chunks(piece) {
                // The server may have hung up already.
                let _ = stream.write_all(piece);
                desk.poll(Duration::ZERO);
            }
            let _ = stream.shutdown(std::net::Shutdown::Write);
            desk.poll(Duration::ZERO);
            prop_assert_ne!(verdict(&mut stream), Some(Verdict::Granted));
            prop_assert!(desk.events.is_empty(), "{:?}", desk.events);
            Ok(())
        })
        .unwrap();
    // And it is none the worse for it.
    desk.into_inner().granted(RequestKind::Command);
}

// ---- Clients and drivers of different make ----

fn refusal_of(request: &Request) -> String {
    let directory = directory();
    let host = Host::start(directory.path());
    let error = client::attach(&host.socket, request).unwrap_err();
    assert!(host.events.try_recv().is_err(), "a refused client is none of the loop's business");
    error.to_string()
}

#[test]
fn a_driver_refuses_every_other_make_of_client_by_name() {
    let good = Request::new(RequestKind::Observe, "test");
    assert_eq!(
        refusal_of(&Request { abi_version: (3 << 32) | 4, ..good }),
        "the driver speaks ABI version 1.0, this program 3.4; install both from the same release"
    );
    assert_eq!(
        refusal_of(&Request { layout_hash: 0xbad, ..good }),
        format!(
            "the driver's memory layout is 0x{LAYOUT_HASH:016x}, this program's 0x0000000000000bad, though both \
             say ABI 1.0; one of them is a modified build: rebuild both from the same source"
        )
    );
    assert_eq!(
        refusal_of(&Request { kind: 77, ..good }),
        "the driver refused: it did not understand the request (UnknownKind)"
    );
    assert_eq!(
        refusal_of(&Request { magic: 1, ..good }),
        "the driver refused: it did not understand the request (WrongMagic)"
    );
}

#[test]
fn another_minor_version_is_no_reason_to_refuse() {
    let directory = directory();
    let host = Host::start(directory.path());
    let newer = Request {
        abi_version: shm_abi::ABI_VERSION + 1,
        ..Request::new(RequestKind::Observe, "newer by a minor version")
    };
    client::attach(&host.socket, &newer).unwrap();
    let older_driver = forged_driver(|header| header[8] += 1, SHRINK_AND_GROW);
    DriverView::map(older_driver.as_fd()).unwrap();
}

/// Serves so many connections, each by `talk`, which closes it by returning.
fn fake_server(
    socket: &Path,
    connections: usize,
    talk: impl Fn(UnixStream) + Send + 'static,
) -> std::thread::JoinHandle<()> {
    let listener = UnixListener::bind(socket).unwrap();
    std::thread::spawn(move || listener.incoming().take(connections).for_each(|stream| talk(stream.unwrap())))
}

/// What the client makes of a driver that answers like this.
fn error_about(talk: impl Fn(UnixStream) + Send + 'static) -> AttachError {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let server = fake_server(&socket, 1, talk);
    let error = client::command(&socket, "test").unwrap_err();
    server.join().unwrap();
    error
}

/// The same, in words; the socket's place is replaced by SOCKET.
fn message_about(answer: Answer) -> String {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let server = fake_server(&socket, 1, move |mut stream| {
        hear(&mut stream);
        stream.write_all(bytemuck::bytes_of(&answer)).unwrap();
    });
    let error = client::command(&socket, "test").unwrap_err();
    server.join().unwrap();
    error.to_string().replace(socket.to_str().unwrap(), "SOCKET")
}

fn hear(stream: &mut UnixStream) {
    stream.read_exact(&mut [0; size_of::<Request>()]).unwrap();
}

fn send(stream: &UnixStream, bytes: &[u8], fds: &[std::os::fd::BorrowedFd<'_>]) {
    use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags};
    let mut space = [std::mem::MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(4))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    assert!(control.push(SendAncillaryMessage::ScmRights(fds)));
    let sent =
        rustix::net::sendmsg(stream, &[std::io::IoSlice::new(bytes)], &mut control, SendFlags::empty());
    assert_eq!(sent, Ok(bytes.len()));
}

#[test]
fn a_client_refuses_every_other_make_of_driver_by_name() {
    let granted = Answer::new(Verdict::Granted);
    let cases = [
        (
            Answer { abi_version: (2 << 32) | 5, ..granted },
            "the driver speaks ABI version 2.5, this program 1.0; install both from the same release"
                .to_string(),
        ),
        (
            Answer { layout_hash: 0xbad, ..granted },
            format!(
                "the driver's memory layout is 0x0000000000000bad, this program's 0x{LAYOUT_HASH:016x}, though \
                 both say ABI 1.0; one of them is a modified build: rebuild both from the same source"
            ),
        ),
        (
            Answer { magic: 0x21, ..granted },
            "SOCKET is not a driver's socket: it answered with magic 0x0000000000000021, expected \
             0x334d4f544e414850; name another one"
                .into(),
        ),
        (Answer { verdict: 99, ..granted }, "the driver refused: it gave the unknown verdict 99".into()),
        (
            Answer::new(Verdict::NoSegment),
            "the driver refused: it could not create shared memory; see its log for the cause".into(),
        ),
        (granted, "the driver refused: it granted and handed over nothing".into()),
    ];
    for (answer, message) in cases {
        assert_eq!(message_about(answer), message);
    }
}

#[test]
fn a_socket_that_says_nothing_and_closes_is_no_drivers() {
    for talk in [|_: UnixStream| (), |mut stream: UnixStream| hear(&mut stream)] {
        let error = error_about(talk);
        assert!(matches!(error, AttachError::NotADriver { .. }), "{error:?}");
        let message = error.to_string();
        assert!(
            message.ends_with(
                "is not a driver's socket: it closed the connection without an answer; name another one"
            ),
            "{message}"
        );
    }
}

#[test]
fn a_driver_that_does_not_answer_is_reported_as_such() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    // Bound and never looked at, as by a stopped process.
    let _listener = UnixListener::bind(&socket).unwrap();
    let error = client::observe(&socket, "test").unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "the driver at {} does not answer within 2 s; it may be stopped (see `ps`), continue or kill it",
            socket.display()
        )
    );
}

#[test]
fn a_driver_that_drips_its_answer_does_not_hold_the_client_for_ever() {
    let error = error_about(|mut stream| {
        // Each byte comes in time; all of them would take a minute.
        let answer = Answer::new(Verdict::Granted);
        for byte in bytemuck::bytes_of(&answer) {
            if stream.write_all(&[*byte]).is_err() {
                return;
            }
            std::thread::sleep(Duration::from_millis(300));
        }
        panic!("the client waited for the whole of it");
    });
    assert!(matches!(error, AttachError::NoAnswer { .. }), "{error:?}");
}

const SHRINK_AND_GROW: rustix::fs::SealFlags =
    rustix::fs::SealFlags::SHRINK.union(rustix::fs::SealFlags::GROW);

/// A copy of a true driver's segment with its first bytes changed.
fn forged_driver(change: impl Fn(&mut [u8; 128]), seals: rustix::fs::SealFlags) -> File {
    let memory = DriverMemory::create(&info()).unwrap();
    let original = File::from(memory.fd().try_clone_to_owned().unwrap());
    let mut head = [0; 128];
    original.read_exact_at(&mut head, 0).unwrap();
    change(&mut head);
    let copy = memfd(size_of::<shm_abi::DriverSegment>() as u64, rustix::fs::SealFlags::empty());
    copy.write_all_at(&head, 0).unwrap();
    rustix::fs::fcntl_add_seals(&copy, seals).unwrap();
    copy
}

fn memfd(bytes: u64, seals: rustix::fs::SealFlags) -> File {
    let flags = rustix::fs::MemfdFlags::CLOEXEC | rustix::fs::MemfdFlags::ALLOW_SEALING;
    let file = File::from(rustix::fs::memfd_create(c"forged", flags).unwrap());
    file.set_len(bytes).unwrap();
    rustix::fs::fcntl_add_seals(&file, seals).unwrap();
    file
}

/// What the client makes of a driver that grants and hands these over.
fn message_about_files(files: Vec<File>) -> String {
    error_about(move |mut stream| {
        hear(&mut stream);
        let fds: Vec<_> = files.iter().map(AsFd::as_fd).collect();
        send(&stream, bytemuck::bytes_of(&Answer::new(Verdict::Granted)), &fds);
    })
    .to_string()
}

#[test]
fn a_descriptor_that_is_no_segment_is_refused_before_it_is_touched() {
    let bytes = size_of::<shm_abi::DriverSegment>() as u64;
    assert_eq!(
        message_about_files(vec![memfd(bytes, rustix::fs::SealFlags::SHRINK)]),
        "the segment handed over is not sealed (found 2, expected at least 6); do not trust this driver"
    );
    assert_eq!(
        message_about_files(vec![memfd(4096, SHRINK_AND_GROW)]),
        format!(
            "the segment handed over has 4096 bytes, expected {bytes}; rebuild both sides from one version"
        )
    );
    assert_eq!(
        message_about_files(vec![memfd(bytes, SHRINK_AND_GROW)]),
        "the segment's magic is 0x0, expected 0x334d4f544e414850; rebuild both sides from one version"
    );
    assert_eq!(
        message_about_files(vec![File::open("/dev/null").unwrap()]),
        "cannot read the seals of a shared segment: Invalid argument (os error 22)"
    );
    let wrong_header = |at: usize| {
        message_about_files(vec![forged_driver(move |header| header[at] ^= 0x40, SHRINK_AND_GROW)])
    };
    assert!(wrong_header(12).starts_with("the segment's ABI version is 0x4100000000, expected 0x100000000;"));
    assert!(wrong_header(16).starts_with("the segment's layout hash is 0x"));
    assert!(wrong_header(120).starts_with("the segment's ready word is 0x41, expected 0x1;"));
    assert_eq!(
        message_about_files(vec![forged_driver(|_| (), SHRINK_AND_GROW)]),
        "the driver refused: it granted the lease and handed over no memory for it"
    );
    let more_than_asked = (0..4).map(|_| memfd(bytes, rustix::fs::SealFlags::empty())).collect();
    assert!(message_about_files(more_than_asked).contains("is not sealed"));
}

// ---- Places where no driver answers ----

#[test]
fn a_missing_socket_means_that_no_driver_runs() {
    let directory = directory();
    let socket = directory.path().join("nothing.sock");
    assert_eq!(
        client::observe(&socket, "test").unwrap_err().to_string(),
        format!(
            "no driver is running: {} does not exist; start one with `io-driver run --config FILE`, or name \
             another socket",
            socket.display()
        )
    );
    let below_a_file = directory.path().join("file");
    File::create(&below_a_file).unwrap();
    let error = client::observe(&below_a_file.join("driver.sock"), "test").unwrap_err();
    assert!(matches!(error, AttachError::NoDriver { .. }), "{error:?}");
}

#[test]
fn a_file_at_the_sockets_place_is_no_driver_and_is_left_alone() {
    let directory = directory();
    let path = directory.path().join("results.csv");
    std::fs::write(&path, "precious").unwrap();
    assert_eq!(
        client::observe(&path, "test").unwrap_err().to_string(),
        format!("{} is not a driver's socket: it is not a socket; name another one", path.display())
    );
    assert_eq!(
        Server::bind(&path).unwrap_err().to_string(),
        format!(
            "cannot listen at {}: something that is not a socket lies there, and it is left alone; choose another \
             place with --socket or PHANTOM3_SOCKET",
            path.display()
        )
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
}

#[test]
fn somebody_elses_living_socket_is_not_taken_over() {
    let directory = directory();
    let path = directory.path().join("other.sock");
    let listener = UnixListener::bind(&path).unwrap();
    let error = Server::bind(&path).unwrap_err();
    assert!(matches!(error, BindError::AlreadyRunning { .. }), "{error:?}");
    UnixStream::connect(&path).unwrap();
    // Once it is dead, it may be replaced.
    drop(listener);
    Server::bind(&path).unwrap();
}

#[test]
fn a_second_driver_is_told_about_the_first() {
    let directory = directory();
    let host = Host::start(directory.path());
    assert_eq!(
        Server::bind(&host.socket).unwrap_err().to_string(),
        format!(
            "another driver is running at {}; stop it with `io-driver stop`, or use another socket",
            host.socket.display()
        )
    );
    client::observe(&host.socket, "test").unwrap();
    let left: Vec<_> = std::fs::read_dir(directory.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "the socket, its lock and nothing else: {left:?}");
}

#[test]
fn a_driver_that_ends_leaves_nothing_and_one_that_was_displaced_spares_its_successor() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    drop(Server::bind(&socket).unwrap());
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);

    let displaced = Server::bind(&socket).unwrap();
    // As if somebody had swept the runtime directory.
    for entry in std::fs::read_dir(directory.path()).unwrap() {
        std::fs::remove_file(entry.unwrap().path()).unwrap();
    }
    let _successor = Server::bind(&socket).unwrap();
    drop(displaced);
    UnixStream::connect(&socket).unwrap();
    let error = Server::bind(&socket).unwrap_err();
    assert!(matches!(error, BindError::AlreadyRunning { .. }), "the successor's lock is gone: {error:?}");
}

#[test]
fn the_socket_and_its_lock_are_no_wider_open_than_they_must_be() {
    let directory = directory();
    let socket = directory.path().join("new/driver.sock");
    let _server = Server::bind(&socket).unwrap();
    let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o7777;
    assert_eq!(mode(&socket), 0o660);
    assert_eq!(mode(&socket.with_file_name("driver.sock.lock")) & !0o600, 0);
    assert_eq!(mode(socket.parent().unwrap()) & !0o750, 0);
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let directory = directory();
    let file = directory.path().join("file");
    File::create(&file).unwrap();
    let message = Server::bind(&file.join("sub/driver.sock")).unwrap_err().to_string();
    assert!(message.starts_with("cannot create the directory "), "{message}");
    assert!(message.ends_with("; choose another place with --socket or PHANTOM3_SOCKET"), "{message}");
}

// ---- What needs a process of its own: it runs this binary again, with the test below and a variable ----

const BODY: &str = "SHM_ABI_TEST_BODY";
const SOCKET: &str = "SHM_ABI_TEST_SOCKET";

fn process(binary: &Path, body: &str, socket: &Path) -> std::process::Command {
    let mut command = std::process::Command::new(binary);
    command.args(["--exact", "body_of_another_process", "--nocapture"]);
    command.env(BODY, body).env(SOCKET, socket).stdout(std::process::Stdio::piped());
    command
}

fn own_binary() -> PathBuf {
    std::env::current_exe().unwrap()
}

#[test]
fn body_of_another_process() {
    let Some(socket) = std::env::var_os(SOCKET).map(PathBuf::from) else { return };
    match std::env::var(BODY).unwrap().as_str() {
        "driver" => {
            let _server = Server::bind(&socket).unwrap();
            println!("\nbound");
            std::thread::sleep(HANG);
        }
        "commander" => {
            let _attached = client::command(&socket, "doomed").unwrap();
            println!("\nattached");
            std::thread::sleep(HANG);
        }
        "observer" => match client::observe(&socket, "other") {
            Ok(_) => println!("\nattached"),
            Err(error) => println!("\nrefused: {error}"),
        },
        "driver without descriptors" => serve_without_descriptors(&socket),
        other => panic!("no such body: {other}"),
    }
}

/// The line that begins like this, of those that the other process prints.
fn line(child: &mut std::process::Child, beginning: &str) -> String {
    use std::io::BufRead;
    let output = std::io::BufReader::new(child.stdout.as_mut().unwrap());
    let found = output.lines().map(Result::unwrap).find(|line| line.starts_with(beginning));
    found.unwrap_or_else(|| panic!("the other process ended without saying {beginning}"))
}

#[test]
fn a_driver_killed_with_9_leaves_a_socket_that_clients_recognise_and_the_next_driver_replaces() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let mut driver = process(&own_binary(), "driver", &socket).spawn().unwrap();
    line(&mut driver, "bound");
    driver.kill().unwrap();
    driver.wait().unwrap();
    assert_eq!(
        client::observe(&socket, "test").unwrap_err().to_string(),
        format!(
            "the driver is gone: {} is left over from one that died; start it again with `io-driver run --config \
             FILE` (it replaces the socket)",
            socket.display()
        )
    );
    let host = Host::start(directory.path());
    client::observe(&host.socket, "test").unwrap();
}

#[test]
fn a_commander_killed_with_9_ends_its_lease() {
    let directory = directory();
    let host = Host::start(directory.path());
    let mut commander = process(&own_binary(), "commander", &host.socket).spawn().unwrap();
    line(&mut commander, "attached");
    let granted = host.event();
    assert!(matches!(&granted, ServerEvent::LeaseGranted { pid, name, .. }
        if *pid == u64::from(commander.id()) && name == "doomed"));
    commander.kill().unwrap();
    commander.wait().unwrap();
    assert!(matches!(host.event(), ServerEvent::LeaseEnded { lease: 1 }));
}

#[test]
fn a_client_that_is_stopped_and_continued_while_it_waits_attaches_all_the_same() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let memory = DriverMemory::create(&info()).unwrap();
    let listener = UnixListener::bind(&socket).unwrap();
    let mut client = process(&own_binary(), "observer", &socket).spawn().unwrap();
    let (mut stream, _) = listener.accept().unwrap();
    hear(&mut stream);
    let pid = rustix::process::Pid::from_child(&client);
    for signal in [rustix::process::Signal::STOP, rustix::process::Signal::CONT] {
        // To be asleep in the kernel when it comes. If this is too short, the test checks less, but holds.
        std::thread::sleep(Duration::from_millis(100));
        rustix::process::kill_process(pid, signal).unwrap();
    }
    std::thread::sleep(Duration::from_millis(100));
    send(&stream, bytemuck::bytes_of(&Answer::new(Verdict::Granted)), &[memory.fd()]);
    line(&mut client, "attached");
    client.wait().unwrap();
}

#[test]
fn a_user_without_permission_is_told_mode_owner_group_and_own_id() {
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65534;
    let directory = directory();
    let _host = Host::start(directory.path());
    let socket = directory.path().join("driver.sock");
    let message = |what: &Path, mode: u32, user: u32| {
        let meta = what.metadata().unwrap();
        format!(
            "no permission to use {}: it has mode {mode:04o}, owner {} and group {}, and you are user {user}; join \
             the group or ask for access",
            what.display(),
            meta.uid(),
            meta.gid()
        )
    };
    let own_uid = rustix::process::geteuid();
    if !own_uid.is_root() {
        // Without a second user: one's own socket, closed even to its owner.
        std::fs::set_permissions(&socket, Permissions::from_mode(0o000)).unwrap();
        let error = client::observe(&socket, "test").unwrap_err();
        assert_eq!(error.to_string(), message(&socket, 0, own_uid.as_raw()));
        println!("skipped: the view of another user, which needs root");
        return;
    }
    // Where the other user can run it.
    let binary = directory.path().join("test");
    std::fs::copy(own_binary(), &binary).unwrap();
    let refusal = |directory_mode: u32| {
        std::fs::set_permissions(directory.path(), Permissions::from_mode(directory_mode)).unwrap();
        let shared = tempfile::Builder::new().permissions(Permissions::from_mode(0o755)).tempdir().unwrap();
        let binary_outside = shared.path().join("test");
        std::fs::copy(&binary, &binary_outside).unwrap();
        let mut command = process(&binary_outside, "observer", &socket);
        let mut child = command.uid(NOBODY).gid(NOBODY).current_dir("/").spawn().unwrap();
        let line = line(&mut child, "refused: ");
        child.wait().unwrap();
        line
    };
    assert_eq!(refusal(0o755), format!("refused: {}", message(&socket, 0o660, NOBODY)));
    assert_eq!(refusal(0o700), format!("refused: {}", message(directory.path(), 0o700, NOBODY)));
}

/// Runs in a process of its own, for the limit is the whole process'.
fn serve_without_descriptors(socket: &Path) {
    use rustix::process::{Resource, Rlimit, setrlimit};
    let memory = DriverMemory::create(&info()).unwrap();
    let mut server = Server::bind(socket).unwrap();
    let mut events = Vec::new();
    // Beyond the numbers in use now there is room for a single one: the client's end.
    let next = std::os::fd::AsRawFd::as_raw_fd(&File::open("/dev/null").unwrap()) as u64;
    let limit = |current| {
        let maximum = rustix::process::getrlimit(Resource::Nofile).maximum;
        setrlimit(Resource::Nofile, Rlimit { current: Some(current), maximum }).unwrap();
    };
    limit(next + 1);
    let client = UnixStream::connect(socket).unwrap();
    let start = Instant::now();
    let mut polls = 0;
    while start.elapsed() < Duration::from_millis(500) {
        server.poll(&memory, Duration::from_millis(500), &mut events).unwrap();
        polls += 1;
    }
    // Two polls each rest of 100 ms: one that fails to accept, one that sleeps. A spinning server makes
    // hundreds of thousands.
    assert!(polls < 50, "it spins: {polls} polls");
    limit(next + 8);
    drop(client);
    let mut newcomer = UnixStream::connect(socket).unwrap();
    newcomer.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Stop, "late"))).unwrap();
    wait_until("the newcomer is served", || {
        server.poll(&memory, HANG, &mut events).unwrap();
        !events.is_empty()
    });
    println!("\nserved after {polls} polls");
}

#[test]
fn a_server_out_of_descriptors_rests_and_then_serves_again() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let mut server = process(&own_binary(), "driver without descriptors", &socket).spawn().unwrap();
    line(&mut server, "served");
    server.wait().unwrap();
}

#[test]
fn frames_of_a_dead_driver_can_still_be_read() {
    let directory = directory();
    let host = Host::start(directory.path());
    host.memory.write_frame(&frame(1));
    host.memory.ring(1, None);
    let attached = client::observe(&host.socket, "historian").unwrap();
    drop(host);
    wait_until("the end is noticed", || !attached.connection.is_open());
    let mut found = Frame::zeroed();
    attached.driver.read_frame(1, &mut found).unwrap();
    assert!(is_frame(&found, 1));
}
