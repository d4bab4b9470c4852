//! The threads that stop the motors whatever the others are stuck in.
//!
//! Model: the first does two things only. It waits for emergency stops by datagram ([`StopSocket`]) and hands them to
//! the loop's word ([`Urgent`]), or performs the last act where a loop that hangs does not take one; and it is the thread
//! to which the kernel hands SIGTERM, SIGINT and SIGHUP, whose flag the loop reads itself. It shares no lock and no
//! descriptor with the thread that serves connections. The second takes what the first has heard, which may take long
//! ([`Drain`]).
//! Invariant: while the second is stuck the first goes on hearing, and hears the same stop again and again: the fault
//! stays.
//! Cost: both asleep until somebody stops; under a flood, a turn each [`REST`].

use crate::say::say;
use crate::urgent::Urgent;
use rt_core::clock::monotonic_ns;
use rt_core::last_act;
use rt_core::privileges::{Keep, reduce_thread};
use rt_core::setup::{Guarantee, promote_beside};
use rt_core::signals;
use shm_abi::stop_socket::{Drain, StopSocket};
use shm_abi::users::UserWords;
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// Between two turns, so that a flood of stops, each of which is one too many, costs no CPU.
const REST: Duration = Duration::from_millis(1);
/// Taking a datagram takes less, unless something came with it that is slow to close.
const TAKEN_WITHIN: Duration = Duration::from_millis(5);
/// A receive, a line of the log and a handler of signals.
const STACK_BYTES: usize = 64 * 1024;

/// The first of them, which waits for its socket. Like the loop's it is there before rights are given up, as its priority is
/// its own.
pub(crate) struct Starter {
    send: SyncSender<Order>,
    begun: Receiver<io::Result<()>>,
    /// Its priority as obtained; `None`: the loop has no real time either.
    pub(crate) guarantee: Option<Guarantee>,
}

/// Next task of it.
enum Order {
    /// Give up its rights, which only it can, and drop the sender when that is done.
    GiveUpRights(Keep, SyncSender<()>),
    /// Hear stops.
    Run(Box<Stops>),
}

/// Source of stops, and their destination.
struct Stops {
    socket: StopSocket,
    queue: Queue,
    urgent: Urgent,
    is_quiet: bool,
}

impl Starter {
    /// Starts it; from now on all other threads leave signals to it. It has the loop's priority: programs of real time that
    /// fill all CPUs, and leave the loop its own, keep no stop waiting.
    ///
    /// # Errors
    /// Refusal of another thread by the system, or of what is asked for the signals of this one.
    pub(crate) fn spawn(loop_priority: Option<u8>) -> io::Result<Self> {
        signals::block_in_this_thread()?;
        let (send, orders) = sync_channel(1);
        let (tell_begun, begun) = sync_channel(1);
        let (tell_guarantee, guarantee) = sync_channel(1);
        let thread = std::thread::Builder::new().name("stop".into()).stack_size(STACK_BYTES);
        thread.spawn(move || {
            let _ = tell_guarantee.send(loop_priority.map(|priority| promote_beside("stops", priority)));
            for order in orders {
                match order {
                    Order::GiveUpRights(keep, _done) => reduce_thread(keep),
                    Order::Run(stops) => {
                        let receives = signals::receive_in_this_thread();
                        let is_ready = receives.is_ok();
                        let _ = tell_begun.send(receives);
                        if is_ready {
                            stops.hear();
                        }
                    }
                }
            }
        })?;
        let guarantee = guarantee.recv().map_err(|_| ended())?;
        Ok(Self { send, begun, guarantee })
    }

    pub(crate) fn give_up_rights(&self, keep: Keep) {
        let (send_done, done) = sync_channel(0);
        // Both fail only if the thread is gone, which starting it tells.
        let _ = self.send.send(Order::GiveUpRights(keep, send_done));
        let _ = done.recv();
    }

    /// Has it hear stops.
    ///
    /// # Errors
    /// Refusal of the second thread by the system, or of what is asked for the signals of the first.
    pub(crate) fn start(self, socket: StopSocket, urgent: Urgent, is_quiet: bool) -> io::Result<()> {
        let queue = Queue::start(socket.drain()?)?;
        let stops = Stops { socket, queue, urgent, is_quiet };
        let _ = self.send.send(Order::Run(Box::new(stops)));
        // The sandbox that is shut next knows nothing of the calls by which threads begin.
        self.begun.recv().unwrap_or_else(|_| Err(ended()))
    }
}

fn ended() -> io::Error {
    io::Error::other("it ended at once")
}

impl Stops {
    fn hear(self) {
        let Self { mut socket, mut queue, urgent, is_quiet } = self;
        loop {
            let may_take = queue.is_taken();
            // A signal interrupts, which is no failure; of any other one the rest is a slower turn.
            if let Ok(user) = socket.hear() {
                let is_new = urgent.stop(user, monotonic_ns());
                if may_take {
                    queue.take();
                }
                if is_new && !is_quiet {
                    let user = UserWords(user);
                    say(format_args!("io-driver: emergency stop, asked for by {user} by datagram"));
                }
                switch_off_if_unheard(&urgent);
            }
            std::thread::sleep(REST);
        }
    }
}

/// Waits until the loop has taken the stop; if it hangs, the motors are switched off behind its back. The service then ends
/// the process.
fn switch_off_if_unheard(urgent: &Urgent) {
    while urgent.is_waiting() {
        if urgent.is_unheard() {
            return last_act::perform();
        }
        std::thread::sleep(REST);
    }
}

/// The first thread's end of the second.
struct Queue {
    heard: SyncSender<()>,
    taken: Receiver<()>,
    /// One that was heard and is not taken yet.
    is_taking: bool,
}

impl Queue {
    fn start(drain: Drain) -> io::Result<Self> {
        let (heard, hear) = sync_channel(1);
        let (tell_taken, taken) = sync_channel(1);
        let (tell_begun, begun) = sync_channel::<()>(0);
        let thread = std::thread::Builder::new().name("stops-taken".into()).stack_size(STACK_BYTES);
        thread.spawn(move || {
            drop(tell_begun);
            for () in hear {
                drain.take();
                let _ = tell_taken.send(());
            }
        })?;
        let _ = begun.recv();
        Ok(Self { heard, taken, is_taking: false })
    }

    /// Whether the first in the queue is one that nobody is about to take.
    fn is_taken(&mut self) -> bool {
        self.is_taking &= self.taken.try_recv().is_err();
        !self.is_taking
    }

    /// Has the first one taken, which was acted on, and waits for that unless it takes long.
    fn take(&mut self) {
        let _ = self.heard.try_send(());
        self.is_taking = self.taken.recv_timeout(TAKEN_WITHIN).is_err();
    }
}
