//! Who gets which memory: the real server and client over a real socket, and the one lease.

use crate::common::desk::{Desk, SHORT, is_closed, verdict};
use crate::common::fake::{receive, try_send};
use crate::common::host::Host;
use crate::common::{command, directory, frame, info, is_frame, own_pid, wait_until};
use bytemuck::Zeroable;
use patience::limit;
use shm_abi::client;
use shm_abi::handshake::{Request, RequestKind, Verdict};
use shm_abi::server::{Recipient, ServerEvent};
use shm_abi::{Command, CommanderMemory};
use std::io::Write;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;

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
    client::emergency_stop(&host.socket, "test").unwrap();
    assert!(matches!(host.event(), ServerEvent::EmergencyStopRequested { pid, .. } if pid == own_pid()));
    client::clear_fault(&host.socket, "test").unwrap();
    assert!(matches!(host.event(), ServerEvent::ClearFaultRequested { .. }));
}

#[test]
fn what_was_asked_for_earlier_is_told_as_of_then() {
    let directory = directory();
    let host = Host::start(directory.path());
    client::clear_fault_as_of(7, &host.socket, "test").unwrap();
    assert!(matches!(host.event(), ServerEvent::ClearFaultRequested { asked_ns: 7, .. }));
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
            "the devices are commanded by process {} (first) already; end it, or its lease (`io-driver end-lease`), \
             first; `io-driver status --watch` looks on",
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
    desk.poll(limit());
    assert_eq!(verdict(&mut successor), Some(Verdict::Granted));
    assert!(matches!(
        desk.events[..],
        [ServerEvent::LeaseGranted { .. }, ServerEvent::LeaseEnded { lease: 1 }]
    ));
    // The end is told once.
    desk.poll(SHORT);
    assert_eq!(desk.events.len(), 2);
}

#[test]
fn a_client_that_says_more_than_its_request_is_hung_up_on() {
    let mut desk = Desk::open();
    let mut stream = desk.granted(RequestKind::Command);
    stream.write_all(b"and another thing").unwrap();
    desk.poll(limit());
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
    // this connection. Where the kernel refuses that, it ends as any other.
    let _ = try_send(&stream, b"x", &[stream.as_fd()]);
    drop(stream);
    desk.poll(limit());
    assert!(matches!(desk.events.last(), Some(ServerEvent::LeaseEnded { lease: 1 })), "{:?}", desk.events);
}

#[test]
fn a_lease_is_in_force_once_its_memory_is_mapped_and_not_before() {
    let mut desk = Desk::open();
    let (stream, offered) = desk.offered(RequestKind::Command);
    for _ in 0..20 {
        desk.poll(SHORT);
    }
    assert!(desk.events.is_empty(), "{:?}", desk.events);
    let mut rival = desk.connect();
    rival.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Command, "rival"))).unwrap();
    desk.poll(limit());
    assert_eq!(verdict(&mut rival), Some(Verdict::LeaseHeld), "it is taken all the same");
    assert!(matches!(desk.events.pop(), Some(ServerEvent::LeaseRefused)));
    let commander = CommanderMemory::map(offered.unwrap().as_fd()).unwrap();
    wait_until("it is in force", || {
        desk.poll(limit());
        !desk.events.is_empty()
    });
    let Some(ServerEvent::LeaseGranted { view, .. }) = desk.events.pop() else { panic!("no lease") };
    assert_eq!(view.lease(), commander.lease());
    drop(stream);
    desk.poll(limit());
    assert!(matches!(desk.events[..], [ServerEvent::LeaseEnded { lease: 1 }]), "{:?}", desk.events);
}

#[test]
fn a_lease_that_was_never_in_force_ends_without_a_word_to_the_loop() {
    let mut desk = Desk::open();
    let offered = desk.offered(RequestKind::Command);
    drop(offered);
    for _ in 0..20 {
        desk.poll(SHORT);
    }
    assert!(desk.events.is_empty(), "{:?}", desk.events);
    desk.granted(RequestKind::Command);
}

#[test]
fn a_commander_that_seals_its_memory_is_hung_up_on_and_the_next_one_commands() {
    let mut desk = Desk::open();
    let (mut stream, offered) = desk.offered(RequestKind::Command);
    let offered = offered.unwrap();
    rustix::fs::fcntl_add_seals(&offered, rustix::fs::SealFlags::SEAL).unwrap();
    let _mapped = CommanderMemory::map(offered.as_fd()).unwrap();
    wait_until("it is found out", || {
        desk.poll(limit());
        !desk.events.is_empty()
    });
    let Some(ServerEvent::Trouble { message }) = desk.events.pop() else { panic!("no trouble") };
    assert!(message.contains("(raw) gets no lease: cannot seal a shared segment"), "{message}");
    desk.poll(SHORT);
    assert!(is_closed(&mut stream));
    desk.granted(RequestKind::Command);
}

#[test]
fn the_lease_of_somebody_who_does_nothing_any_more_ends_on_request() {
    let mut desk = Desk::open();
    let mut holder = desk.granted(RequestKind::Command);
    desk.events.clear();
    let mut asker = desk.connect();
    asker.write_all(bytemuck::bytes_of(&Request::new(RequestKind::EndLease, "raw"))).unwrap();
    desk.poll(limit());
    assert_eq!(verdict(&mut asker), Some(Verdict::Granted));
    assert!(matches!(desk.events[..], [ServerEvent::LeaseEnded { lease: 1 }]), "{:?}", desk.events);
    assert!(is_closed(&mut holder));
    desk.granted(RequestKind::Command);
}

/// Whoever passes events on may have no room for one.
struct Full;

impl Recipient for Full {
    fn take(&mut self, _: ServerEvent) -> Result<(), Verdict> {
        Err(Verdict::Busy)
    }
}

#[test]
fn a_request_that_the_loop_does_not_take_is_refused_instead_of_waited_for() {
    let mut desk = Desk::open();
    let mut stream = desk.connect();
    stream.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Zero, "raw"))).unwrap();
    desk.server.poll(&desk.memory, limit(), &mut Full).unwrap();
    assert_eq!(verdict(&mut stream), Some(Verdict::Busy));
    assert!(is_closed(&mut stream));
    desk.granted(RequestKind::Command);
}

/// Whoever asked was stopped (Ctrl-Z, a debugger) between the driver's answer and the mapping.
#[test]
fn a_lease_that_nobody_maps_is_given_to_somebody_else_within_seconds() {
    let directory = directory();
    let host = Host::start(directory.path());
    let mut stopped = UnixStream::connect(&host.socket).unwrap();
    stopped.write_all(bytemuck::bytes_of(&Request::new(RequestKind::Command, "stopped"))).unwrap();
    let (answer, fds) = receive(&stopped);
    assert_eq!((answer.lease, fds.len()), (1, 2));
    let refused = client::command(&host.socket, "next").unwrap_err().to_string();
    assert!(refused.contains("(stopped)"), "{refused}");
    let mut next = None;
    wait_until("the offer is withdrawn", || {
        next = client::command(&host.socket, "next").ok();
        next.is_some()
    });
    assert!(is_closed(&mut stopped), "and is told so");
}
