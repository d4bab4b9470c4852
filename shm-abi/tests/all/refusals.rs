//! Clients and drivers of different make: whoever is refused reads what was found and what to do.

use crate::common::fake::{fake_server, hear, send};
use crate::common::host::Host;
use crate::common::{directory, info, own_pid};
use patience::prelude::*;
use patience::{accepted, limit, watched};
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::server::ServerEvent;
use shm_abi::{DriverMemory, DriverView, LAYOUT_HASH};
use std::fs::File;
use std::io::Write;
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

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
        "the driver speaks ABI version 1.3, this program 3.4; install both from the same release"
    );
    assert_eq!(
        refusal_of(&Request { layout_hash: 0xbad, ..good }),
        format!(
            "the driver's memory layout is 0x{LAYOUT_HASH:016x}, this program's 0x0000000000000bad, though both \
             say ABI 1.3; one of them is a modified build: rebuild both from the same source"
        )
    );
    assert_eq!(
        refusal_of(&Request { kind: 77, ..good }),
        "the driver speaks version 1.3 of the shared-memory contract and does not know requests of kind 77, this \
         program speaks 1.3; start the driver that belongs to this program"
    );
    assert_eq!(
        refusal_of(&Request { magic: 1, ..good }),
        "the driver refused: it did not understand the request (WrongMagic)"
    );
}

#[test]
fn a_driver_that_tells_another_number_of_itself_is_told_by_the_number_it_has_here() {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let answers = [Verdict::Granted, Verdict::LeaseHeld].map(|verdict| {
        let holder_pid = if verdict == Verdict::LeaseHeld { 8 } else { 0 };
        Answer { driver_pid: 7, holder_pid, ..Answer::new(verdict) }
    });
    let next = AtomicU64::new(0);
    let server = fake_server(&socket, answers.len(), move |mut stream| {
        hear(&mut stream);
        send(&stream, bytemuck::bytes_of(&answers[next.fetch_add(1, Ordering::Relaxed) as usize]), &[]);
    });
    assert_eq!(client::stop(&socket, "test").unwrap(), own_pid());
    // Whose number that is here, nobody knows.
    let refusal = client::command(&socket, "test").unwrap_err();
    assert!(matches!(refusal, AttachError::LeaseHeld { pid: 0, .. }), "{refusal:?}");
    server.bounded_join().unwrap();
}

#[test]
fn only_who_has_sent_a_request_may_have_been_heard() {
    let socket = || Path::new("driver.sock").to_path_buf();
    for heard in
        [AttachError::NoAnswer { socket: socket(), seconds: 1 }, AttachError::HungUp { socket: socket() }]
    {
        assert!(heard.may_be_heard(), "{heard:?}");
    }
    for unheard in [AttachError::NoDriver { socket: socket() }, AttachError::DriverGone { socket: socket() }]
    {
        assert!(!unheard.may_be_heard(), "{unheard:?}");
    }
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

/// What the client makes of a driver that answers like this.
fn error_about(talk: impl Fn(UnixStream) + Send + 'static) -> AttachError {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let server = fake_server(&socket, 1, talk);
    let error = watched(limit(), "the client's end", || client::command(&socket, "test").unwrap_err());
    server.bounded_join().unwrap();
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
    server.bounded_join().unwrap();
    error.to_string().replace(socket.to_str().unwrap(), "SOCKET")
}

#[test]
fn a_client_refuses_every_other_make_of_driver_by_name() {
    let granted = Answer::new(Verdict::Granted);
    let cases = [
        (
            Answer { abi_version: (2 << 32) | 5, ..granted },
            "the driver speaks ABI version 2.5, this program 1.3; install both from the same release"
                .to_string(),
        ),
        (
            Answer { layout_hash: 0xbad, ..granted },
            format!(
                "the driver's memory layout is 0x0000000000000bad, this program's 0x{LAYOUT_HASH:016x}, though \
                 both say ABI 1.3; one of them is a modified build: rebuild both from the same source"
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

/// Error of a client whose connection is closed after `before_it_closes` of the listener and its place.
fn error_after_hanging_up(before_it_closes: fn(UnixListener, &Path) -> Option<UnixListener>) -> AttachError {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let listener = UnixListener::bind(&socket).unwrap();
    let place = socket.clone();
    let server = std::thread::spawn(move || {
        let mut stream = accepted(&listener);
        hear(&mut stream);
        before_it_closes(listener, &place)
    });
    let error = watched(limit(), "the client's end", || client::command(&socket, "test").unwrap_err());
    drop(server.bounded_join().unwrap());
    error
}

#[test]
fn a_listener_that_hangs_up_is_no_driver_or_one_that_ends() {
    let error = error_after_hanging_up(|listener, _| Some(listener));
    assert!(matches!(error, AttachError::HungUp { .. }), "{error:?}");
    let message = error.to_string();
    assert!(message.contains("hung up without an answer, as a driver does that is just ending"), "{message}");
}

#[test]
fn a_driver_that_ends_before_it_answers_is_gone() {
    let killed = error_after_hanging_up(|_, _| None);
    assert!(matches!(killed, AttachError::DriverGone { .. }), "{killed:?}");
    let stopped = error_after_hanging_up(|_, place| {
        std::fs::remove_file(place).unwrap();
        None
    });
    assert!(matches!(stopped, AttachError::NoDriver { .. }), "{stopped:?}");
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
fn a_commanders_segment_that_lacks_a_seal_is_refused() {
    let bytes = size_of::<shm_abi::layout::CommanderSegment>() as u64;
    let half_sealed = memfd(bytes, rustix::fs::SealFlags::SHRINK);
    assert_eq!(
        shm_abi::CommanderMemory::map(half_sealed.as_fd()).unwrap_err().to_string(),
        "the segment handed over is not sealed (found 2, expected at least 6); do not trust this driver"
    );
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
    assert!(wrong_header(12).starts_with("the segment's ABI version is 0x4100000003, expected 0x100000003;"));
    assert!(wrong_header(16).starts_with("the segment's layout hash is 0x"));
    assert!(wrong_header(120).starts_with("the segment's ready word is 0x41, expected 0x1;"));
    assert_eq!(
        message_about_files(vec![forged_driver(|_| (), SHRINK_AND_GROW)]),
        "the driver refused: it granted the lease and handed over no memory for it"
    );
    let more_than_asked = (0..4).map(|_| memfd(bytes, rustix::fs::SealFlags::empty())).collect();
    assert!(message_about_files(more_than_asked).contains("is not sealed"));
}

#[test]
fn a_driver_that_says_what_cannot_be_is_refused_with_found_and_expected() {
    type Word = fn(&shm_abi::layout::DriverHeader) -> &AtomicU64;
    let lies: [(Word, u64, &str); 11] = [
        (|h| &h.period_ns, 0, "period in nanoseconds: 0, expected 50000 to 10000000000"),
        (|h| &h.period_ns, 1, "period in nanoseconds: 1, expected 50000 to 10000000000"),
        (|h| &h.period_ns, 49_999, "period in nanoseconds: 49999, expected 50000 to 10000000000"),
        (
            |h| &h.period_ns,
            u64::MAX,
            "period in nanoseconds: 18446744073709551615, expected 50000 to 10000000000",
        ),
        (|h| &h.reply_budget_ns, 0, "reply budget in nanoseconds: 0, expected 1 to 18446744073709551615"),
        (|h| &h.ramp_in_ticks, 0, "ramp in in ticks: 0, expected 1 to 4294967296"),
        (|h| &h.ramp_out_ticks, 0, "ramp out in ticks: 0, expected 1 to 4294967296"),
        (
            |h| &h.ramp_out_ticks,
            u64::MAX,
            "ramp out in ticks: 18446744073709551615, expected 1 to 4294967296",
        ),
        (
            |h| &h.max_command_age_ticks,
            1 << 33,
            "age of a command in ticks: 8589934592, expected 0 to 4294967296",
        ),
        (|h| &h.device_count, 9, "number of devices: 9, expected 0 to 8"),
        (|h| &h.segment_bytes, 8, "segment of so many bytes: 8, expected 11041024 to 11041024"),
    ];
    for (word, lie, expected) in lies {
        let directory = directory();
        let host = Host::start(directory.path());
        word(&host.memory.header).store(lie, Ordering::Relaxed);
        let error = client::command(&host.socket, "test").unwrap_err();
        let expected = format!(
            "the driver says of itself: {expected}; do not trust this driver, start the one that belongs to this program"
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn a_request_that_hands_over_nothing_is_not_sent_by_attaching_with_it() {
    use RequestKind::{ClearFault, EmergencyStop, EndLease, Stop, Zero};
    let directory = directory();
    let host = Host::start(directory.path());
    for kind in [Stop, ClearFault, EmergencyStop, Zero, EndLease] {
        let error = client::attach(&host.socket, &Request::new(kind, "test")).unwrap_err();
        assert!(matches!(error, AttachError::NothingToAttach { .. }), "{error}");
    }
    // Whatever had been sent would have been heard before this.
    let _commander = client::command(&host.socket, "test").unwrap();
    assert!(matches!(host.event(), ServerEvent::LeaseGranted { .. }));
}
