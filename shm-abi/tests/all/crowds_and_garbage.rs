//! Clients in any number, clients that say nothing, too much, too slowly or nonsense.

use crate::common::desk::{Desk, SHORT, is_closed, verdict};
use crate::common::fake::fake_server;
use crate::common::host::Host;
use crate::common::{directory, wait_until};
use bytemuck::Zeroable;
use patience::limit;
use patience::prelude::*;
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::server::{BATCH, COMMANDERS, MAX_ASKING, OBSERVERS, PATIENCE};
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

#[test]
fn observers_in_any_number_leave_room_for_a_commander_and_a_stop() {
    let directory = directory();
    let host = Host::start(directory.path());
    let observers: Vec<_> =
        (0..OBSERVERS.of_process).map(|_| client::observe(&host.socket, "looker").unwrap()).collect();
    let refusal = client::observe(&host.socket, "one too many").unwrap_err();
    let crowded = "the driver refused: it has too many connections; end programs that look on or left without reading its answer";
    assert_eq!(refusal.to_string(), crowded);
    let commander = client::command(&host.socket, "hand").unwrap();
    client::stop(&host.socket, "test").unwrap();
    drop(observers);
    wait_until("a place is free again", || client::observe(&host.socket, "looker").is_ok());
    drop(commander);
}

/// Descriptors that lie unread count against the driver's own limit of descriptors, though whoever asked for it has shut down.
#[test]
fn who_leaves_without_taking_what_was_handed_over_keeps_the_place() {
    let mut desk = Desk::open();
    let leave_behind = |desk: &mut Desk, kind| {
        let mut stream = desk.connect();
        stream.write_all(bytemuck::bytes_of(&Request::new(kind, "hoarder"))).unwrap();
        desk.poll(SHORT);
        stream.shutdown(Shutdown::Both).unwrap();
        desk.poll(SHORT);
        stream
    };
    let granted = |streams: &[UnixStream]| {
        streams.iter().filter(|stream| verdict_after_shutdown(stream) == Some(Verdict::Granted)).count()
    };
    // Neither takes the other's places, whichever asks first.
    for order in [[RequestKind::Observe, RequestKind::Command], [RequestKind::Command, RequestKind::Observe]]
    {
        let left = order.map(|kind| {
            let places = if kind == RequestKind::Observe { OBSERVERS } else { COMMANDERS }.of_process;
            let streams: Vec<_> = (0..places + 6).map(|_| leave_behind(&mut desk, kind)).collect();
            (streams, kind, places)
        });
        for (streams, kind, places) in &left {
            assert_eq!(granted(streams), *places, "{kind:?} in {order:?}");
        }
        // What was read holds nothing any more.
        desk.poll(SHORT);
        desk.poll(SHORT);
    }
    desk.granted(RequestKind::Observe);
}

#[test]
fn whoever_was_answered_in_the_same_turn_takes_no_place_of_an_observer() {
    let mut desk = Desk::open();
    let ask = |kind| {
        let mut stream = UnixStream::connect(desk.server.path()).unwrap();
        stream.write_all(bytemuck::bytes_of(&Request::new(kind, "crowd"))).unwrap();
        stream
    };
    // With the last one as many as are accepted in a turn.
    let _crowd: Vec<_> = (1..BATCH).map(|_| ask(RequestKind::ClearFault)).collect();
    let mut observer = ask(RequestKind::Observe);
    desk.poll(limit());
    assert_eq!(verdict(&mut observer), Some(Verdict::Granted));
}

/// Answer that lies there for one that has shut down its end.
fn verdict_after_shutdown(mut stream: &UnixStream) -> Option<Verdict> {
    let mut answer = Answer::zeroed();
    stream.read_exact(bytemuck::bytes_of_mut(&mut answer)).ok()?;
    Verdict::from_word(answer.verdict)
}

#[test]
fn the_oldest_of_too_many_silent_connections_gives_its_place_to_the_newcomer() {
    let mut desk = Desk::open();
    let mut silent: Vec<_> = (0..MAX_ASKING).map(|_| desk.connect()).collect();
    let mut newcomer = desk.connect();
    assert_eq!(verdict(&mut silent[0]), Some(Verdict::Crowded));
    assert!(is_closed(&mut silent[0]));
    // Whoever has said what he wants when he is let in needs no place at all.
    let mut prompt = UnixStream::connect(desk.server.path()).unwrap();
    prompt.write_all(bytemuck::bytes_of(&Request::new(RequestKind::EmergencyStop, "prompt"))).unwrap();
    desk.poll(limit());
    assert_eq!(verdict(&mut prompt), Some(Verdict::Granted));
    newcomer.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Observe, "raw"))).unwrap();
    desk.poll(limit());
    assert_eq!(verdict(&mut newcomer), Some(Verdict::Granted));
    assert_eq!(desk.events.len(), 1, "{:?}", desk.events);
}

#[test]
fn who_got_an_answer_and_has_nothing_to_keep_is_hung_up_on() {
    let mut desk = Desk::open();
    for kind in [
        RequestKind::ClearFault,
        RequestKind::EmergencyStop,
        RequestKind::Zero,
        RequestKind::EndLease,
        RequestKind::Stop,
    ] {
        // The client keeps its end open for ever.
        let mut stream = desk.granted(kind);
        assert!(is_closed(&mut stream), "{kind:?}");
    }
}

#[test]
fn descriptors_that_a_client_sends_are_refused_where_the_kernel_can() {
    let mut desk = Desk::open();
    let stream = desk.connect();
    let (end, _other) = UnixStream::pair().unwrap();
    match crate::common::fake::try_send(&stream, b"x", &[end.as_fd()]) {
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::PermissionDenied),
        Ok(()) => println!("skipped: this kernel is older than 6.16 and hands over descriptors unasked"),
    }
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
    server.bounded_join().unwrap();
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
    desk.poll(limit());
    drop(stream);
    desk.poll(limit());
    assert!(desk.events.is_empty());
    desk.granted(RequestKind::Command);
}

#[test]
fn garbage_is_answered_and_hung_up_on() {
    let mut desk = Desk::open();
    let mut stream = desk.connect();
    stream.write_all(&[b'G'; size_of::<Request>()]).unwrap();
    desk.poll(limit());
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
            desk.poll(limit());
            for piece in bytes.chunks(piece) {
                // The server may have hung up already.
                let _ = stream.write_all(piece);
                desk.poll(Duration::ZERO);
            }
            let _ = stream.shutdown(Shutdown::Write);
            desk.poll(Duration::ZERO);
            prop_assert_ne!(verdict(&mut stream), Some(Verdict::Granted));
            prop_assert!(desk.events.is_empty(), "{:?}", desk.events);
            Ok(())
        })
        .unwrap();
    // And it is none the worse for it.
    desk.into_inner().granted(RequestKind::Command);
}
