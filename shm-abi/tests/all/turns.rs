//! Turns of the server: how long each waits, and when a request was asked.

use crate::common::desk::{Desk, verdict};
use patience::limit;
use rustix::time::{ClockId, clock_gettime};
use shm_abi::handshake::{Request, RequestKind, Verdict};
use shm_abi::server::{BATCH, MAX_ASKING, PATIENCE, ServerEvent};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    (now.tv_sec * 1_000_000_000 + now.tv_nsec).cast_unsigned()
}

/// Duration of a turn with this time-out.
fn turn(desk: &mut Desk, timeout: Duration) -> Duration {
    let began = Instant::now();
    desk.poll(timeout);
    began.elapsed()
}

#[test]
fn a_silent_client_costs_no_turn_until_its_patience_ends() {
    let mut desk = Desk::open();
    let mut silent = desk.connect();
    let short = PATIENCE / 20;
    assert!(turn(&mut desk, short) >= short, "nothing was to do");
    // Nobody else says anything: the end of its patience alone ends this turn.
    silent.set_nonblocking(true).unwrap();
    while silent.read(&mut [0; 1]).is_err() {
        let waited = turn(&mut desk, limit());
        assert!(waited < limit() / 2, "{waited:?}");
    }
}

/// As many silent clients as there are places for, and one that has long got what it asked for: nobody has to go.
#[test]
fn an_observer_takes_no_place_of_those_who_have_not_asked_yet() {
    let mut desk = Desk::open();
    let observer = desk.granted(RequestKind::Observe);
    let silent: Vec<_> = (0..MAX_ASKING).map(|_| desk.connect()).collect();
    for mut stream in silent.into_iter().chain([observer]) {
        stream.set_nonblocking(true).unwrap();
        assert_eq!(stream.read(&mut [0; 1]).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);
    }
}

/// It is looked for the mapping every millisecond, not in a loop without a pause.
#[test]
fn an_offer_that_nobody_maps_is_looked_at_with_pauses() {
    let mut desk = Desk::open();
    let _offered = desk.offered(RequestKind::Command);
    let waited: Duration = (0..20).map(|_| turn(&mut desk, limit())).sum();
    assert!(waited >= Duration::from_millis(20), "{waited:?}");
}

#[test]
fn who_knocks_in_a_flood_is_let_in_when_the_listener_has_rested() {
    let mut desk = Desk::open();
    let _batch: Vec<_> = (0..BATCH).map(|_| UnixStream::connect(desk.server.path()).unwrap()).collect();
    let mut next = UnixStream::connect(desk.server.path()).unwrap();
    next.write_all(bytemuck::bytes_of(&Request::new(RequestKind::EmergencyStop, "next"))).unwrap();
    desk.poll(limit());
    assert!(desk.events.is_empty(), "one batch a turn");
    // Neither do the silent ones end this turn, whose patience is much longer.
    let waited = turn(&mut desk, limit());
    assert!(waited < PATIENCE / 2, "{waited:?}");
    desk.poll(limit());
    assert_eq!(verdict(&mut next), Some(Verdict::Granted));
}

/// When a stop was asked that says this of it, and the time before the turn in which it came in, before it was
/// written, and after it was heard.
fn asked(claimed_ns: impl FnOnce() -> u64) -> (u64, [u64; 3]) {
    asked_for(RequestKind::EmergencyStop, claimed_ns)
}

fn asked_for(kind: RequestKind, claimed_ns: impl FnOnce() -> u64) -> (u64, [u64; 3]) {
    let mut desk = Desk::open();
    let before_turn = monotonic_ns();
    let mut stream = desk.connect();
    let before = monotonic_ns();
    let request = Request { asked_ns: claimed_ns(), ..Request::new(kind, "test") };
    stream.write_all(bytemuck::bytes_of(&request)).unwrap();
    desk.poll(limit());
    let [
        ServerEvent::EmergencyStopRequested { asked_ns, .. }
        | ServerEvent::ClearFaultRequested { asked_ns, .. }
        | ServerEvent::ZeroRequested { asked_ns, .. },
    ] = desk.events[..]
    else {
        panic!("{:?}", desk.events);
    };
    (asked_ns, [before_turn, before, monotonic_ns()])
}

#[test]
fn a_request_was_asked_when_its_client_says_and_never_later_than_it_was_heard() {
    let mut told = 0;
    let (asked_ns, _) = asked(|| {
        told = monotonic_ns();
        told
    });
    assert_eq!(asked_ns, told);
    let (asked_ns, [_, before, heard]) = asked(|| u64::MAX);
    assert!((before..=heard).contains(&asked_ns), "{asked_ns}: {before} to {heard}");
}

/// Clocks of other time namespaces are ahead or behind.
#[test]
fn whoever_asks_by_a_clock_that_is_ahead_undoes_no_stop() {
    for kind in [RequestKind::ClearFault, RequestKind::Zero] {
        let (asked_ns, _) = asked_for(kind, || monotonic_ns() + 1_000_000_000_000);
        assert_eq!(asked_ns, 0, "{kind:?}: as long ago as can be");
    }
}

#[test]
fn a_client_that_tells_no_time_asked_when_the_turn_before_began() {
    let (asked_ns, [before_turn, before, _]) = asked(|| 0);
    assert!((before_turn..=before).contains(&asked_ns), "{asked_ns}: {before_turn} to {before}");
}
