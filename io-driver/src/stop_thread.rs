//! The thread that stops the motors whatever the others are stuck in.
//!
//! Model: it does two things only. It waits for emergency stops by datagram ([`StopSocket`]) and hands them to the
//! loop's word ([`Urgent`]); and it is the thread to which the kernel hands SIGTERM, SIGINT and SIGHUP, whose flag the
//! loop reads itself. It shares no lock, no queue and no descriptor with the thread that serves connections.
//! Cost: asleep until somebody stops; under a flood, a turn each [`REST`].

use crate::urgent::Urgent;
use rt_core::signals;
use shm_abi::stop_socket::StopSocket;
use std::io;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

/// Between two turns, so that a flood of stops, each of which is one too many, costs no CPU.
const REST: Duration = Duration::from_millis(1);
/// A receive and a handler of signals.
const STACK_BYTES: usize = 64 * 1024;

/// Starts it; from now on all other threads leave signals to it.
///
/// # Errors
/// What the system says to another thread, or to its signals.
pub(crate) fn start(socket: StopSocket, urgent: Urgent) -> io::Result<()> {
    signals::block_in_this_thread()?;
    let (begun, has_begun) = sync_channel::<()>(0);
    let thread = std::thread::Builder::new().name("stop".into()).stack_size(STACK_BYTES);
    thread.spawn(move || {
        drop(begun);
        run(socket, &urgent);
    })?;
    // The sandbox that is shut next knows nothing of the calls by which a thread begins.
    let _ = has_begun.recv();
    Ok(())
}

fn run(mut socket: StopSocket, urgent: &Urgent) {
    // If it fails, signals are as before: the service's thread does not block them for long, and polls.
    let _ = signals::receive_in_this_thread();
    loop {
        // A signal interrupts, which is no failure; of any other one the rest is a slower turn.
        let _ = socket.wait(|user| urgent.stop(user));
        std::thread::sleep(REST);
    }
}
