//! The driver's socket thread: who comes and goes, what the loop has to know of it, the end.
//!
//! Model: it waits at the socket, passes on as mail what concerns the loop, tells the service manager that both live, and
//! looks for a reason to stop.
//! Invariants: it waits for nobody: not for whoever reads the log ([`say`] queues), nor for the loop (mail that finds no
//! room is dropped or refused). It posts first and speaks after. The loop does not wait for it either: it reads the
//! flag of signals itself, and [`stop_thread`](crate::stop_thread) can stop the motors without it.

use crate::bell_thread::BellRope;
use crate::driver::{RunError, RunOptions, TICK};
use crate::heartbeat::Heartbeat;
use crate::mail::{Letter, Sender};
use crate::meter::bump;
use crate::real_loop::{Ended, Shared};
use crate::say;
use crate::supervisor::Supervisor;
use crate::urgent::{NotCleared, StoppedBy};
use crate::zeroing::DeviceSet;
use rt_core::clock::monotonic_ns;
use rt_core::epitaph::{EpitaphKind, EpitaphRef};
use rt_core::log::LostCount;
use rt_core::signals::StopSignals;
use shm_abi::DriverMemory;
use shm_abi::handshake::Verdict;
use shm_abi::peer::ProcessWords;
use shm_abi::server::{Recipient, Server, ServerEvent};
use shm_abi::socket_file::SocketFile;
use shm_abi::users::UserWords;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A loop that was asked to end does so within a tick. A stall of the machine is shorter than this, and so is the
/// patience of whoever stops a driver whose motors push.
const PATIENCE: Duration = Duration::from_secs(2);
/// Who said that an arm is in its zeroing pose held it there, and who asked to leave a fault looked at the arms; what is
/// heard later than this may be true no more.
const IN_TIME_NS: u64 = 1_000_000_000;
const UNHEARD: &str =
    "the loop hung when an emergency stop came; the motors were switched off behind its back";
const HUNG: &str = "the loop hangs; the motors were switched off behind its back";
/// How often the socket's thread looks at signals when nothing else happens.
const POLL: Duration = Duration::from_millis(20);

/// The socket's thread.
pub(crate) struct Service<'a> {
    pub(crate) server: Server,
    /// Removed at the end.
    pub(crate) stop_file: SocketFile,
    pub(crate) sender: Sender,
    /// Of who wakes commanders; in lockstep there is none.
    pub(crate) rope: Option<Arc<BellRope>>,
    /// Of the loop's own log.
    pub(crate) lost: LostCount,
    pub(crate) memory: Arc<DriverMemory>,
    pub(crate) signals: StopSignals,
    /// The loop watches it.
    pub(crate) heartbeat: Heartbeat,
    pub(crate) shared: Shared,
    pub(crate) options: &'a RunOptions,
    pub(crate) supervisor: Supervisor,
}

impl Service<'_> {
    /// Serves to the end, and sees to it that the loop writes zero then.
    pub(crate) fn run(mut self, thread: JoinHandle<Ended>) -> Result<(), RunError> {
        let served = caught(|| self.serve());
        self.finish(thread, served)
    }

    /// Serves until something asks the driver to stop; returns what.
    fn serve(&mut self) -> Result<String, String> {
        loop {
            self.heartbeat.beat();
            let Self { server, sender, rope, memory, options, .. } = self;
            let mut desk = Desk { sender, rope: rope.as_deref(), memory, options, stop: None };
            let polled = server.poll(memory, POLL, &mut desk);
            if let Some(reason) = desk.stop {
                return Ok(reason);
            }
            polled.map_err(|error| format!("cannot wait at the socket: {error}"))?;
            if self.sender.urgent.is_unheard() {
                rt_core::last_act::perform();
                return Err(UNHEARD.into());
            }
            self.sender.clear_waste();
            self.count_what_the_log_dropped();
            self.supervisor.turn(TICK.load(Ordering::Relaxed), || status_line(&self.memory));
            if let Some(signal) = self.signals.requested() {
                return Ok(format!("signal {signal}"));
            }
            if self.shared.ended.load(Ordering::Acquire) {
                return Ok("the loop ended".into());
            }
        }
    }

    fn count_what_the_log_dropped(&self) {
        let dropped = self.lost.get() + say::dropped();
        self.memory.counters.log_dropped.store(dropped, Ordering::Relaxed);
    }

    /// Ends the loop, writes the last words and says how it was.
    fn finish(self, thread: JoinHandle<Ended>, served: Result<String, String>) -> Result<(), RunError> {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.supervisor.stopping(served.as_deref().unwrap_or("a fault of the service"));
        let has_ended = wait_for_end(&thread);
        if !has_ended {
            // It will not do it any more, and must not undo it.
            rt_core::last_act::perform();
        }
        self.count_what_the_log_dropped();
        let end = self.write_last_words(thread, has_ended, served);
        // Whoever waits for the end reads the last words when its connection closes.
        tidy_up(self.server, self.stop_file, self.options);
        end
    }

    fn write_last_words(
        &self,
        thread: JoinHandle<Ended>,
        has_ended: bool,
        served: Result<String, String>,
    ) -> Result<(), RunError> {
        let tick = TICK.load(Ordering::Relaxed);
        let epitaph = EpitaphRef::new(&self.memory.epitaph);
        if !has_ended {
            epitaph.write(EpitaphKind::Fault, tick, HUNG);
            return Err(RunError::Hung(tick));
        }
        match (thread.join(), served) {
            (Ok(Ended::Stopped), Ok(reason)) => {
                epitaph.write(EpitaphKind::Stopped, tick, &reason);
                say(self.options, format_args!("stopped in tick {tick}: {reason}; motors were written zero"));
                Ok(())
            }
            (Ok(Ended::Stopped), Err(why)) => {
                epitaph.write(EpitaphKind::Fault, tick, &why);
                Err(RunError::ServiceFailed(why))
            }
            (Ok(Ended::Panicked) | Err(_), _) => {
                let words = rt_core::epitaph::read(&self.memory.epitaph);
                Err(RunError::Panicked(words.map_or_else(String::new, |words| words.to_string())))
            }
        }
    }
}

/// Passes on to the loop what clients ask for: first that, then the words.
struct Desk<'a> {
    sender: &'a mut Sender,
    /// Place to say whom to wake.
    rope: Option<&'a BellRope>,
    memory: &'a DriverMemory,
    options: &'a RunOptions,
    /// Why to stop.
    stop: Option<String>,
}

impl Recipient for Desk<'_> {
    fn take(&mut self, event: ServerEvent) -> Result<(), Verdict> {
        match event {
            ServerEvent::LeaseGranted { view, pid, name } => {
                let lease = view.lease();
                if let Some(rope) = self.rope {
                    rope.wakes(view.sleeper());
                }
                self.post(Letter::Grant(view))?;
                bump(&self.memory.counters.leases_granted);
                say(self.options, format_args!("lease {lease} to {} ({name})", ProcessWords(pid)));
            }
            ServerEvent::LeaseEnded { lease } => {
                self.sender.urgent.end_lease(lease);
                say(self.options, format_args!("lease {lease} ended"));
            }
            ServerEvent::LeaseRefused => bump(&self.memory.counters.leases_refused),
            ServerEvent::ClearFaultRequested { asked_ns, .. }
            | ServerEvent::ZeroRequested { asked_ns, .. }
                if monotonic_ns() - asked_ns > IN_TIME_NS =>
            {
                return Err(Verdict::Outdated);
            }
            ServerEvent::ClearFaultRequested { user, is_administrator, asked_ns } => {
                let is_own =
                    |by| by == StoppedBy::Nobody || user.is_some_and(|uid| by == StoppedBy::User(uid));
                let cleared = self.sender.urgent.clear_fault(asked_ns, |by| is_administrator || is_own(by));
                cleared.map_err(|why| match why {
                    NotCleared::Outdated => Verdict::Outdated,
                    NotCleared::NotAllowed => Verdict::NotAllowed,
                })?;
            }
            ServerEvent::EmergencyStopRequested { pid, user, .. } => {
                // As of now: who asked before to leave a fault did not know of it, whatever the clock of who stops says.
                let is_new = self.sender.urgent.stop(user, monotonic_ns());
                let by = (ProcessWords(pid), UserWords(user));
                if is_new {
                    say(self.options, format_args!("emergency stop, asked for by {} of {}", by.0, by.1));
                }
            }
            ServerEvent::ZeroRequested { pid, devices, .. } => {
                self.post(Letter::Zero(DeviceSet(devices)))?;
                say(
                    self.options,
                    format_args!("{} asks to zero devices (bits {devices:#x})", ProcessWords(pid)),
                );
            }
            ServerEvent::Trouble { message } => say::say(format_args!("io-driver: {message}")),
            ServerEvent::StopRequested { pid } => {
                self.stop = Some(format!("request of {}", ProcessWords(pid)));
            }
        }
        Ok(())
    }
}

impl Desk<'_> {
    /// The loop collects its mail every tick; if the queue is full it has stood still for long, and whoever asked is
    /// none the better for our waiting.
    fn post(&mut self, letter: Letter) -> Result<(), Verdict> {
        self.sender.post(letter).map_err(|_| Verdict::Busy)
    }
}

/// Whether the loop ended in time.
fn wait_for_end(thread: &JoinHandle<Ended>) -> bool {
    let begun = Instant::now();
    while !thread.is_finished() && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    thread.is_finished()
}

/// A panic here is an ending like any other: unwound further it would end the process, and the loop in the middle of
/// a tick.
fn caught(serve: impl FnOnce() -> Result<String, String>) -> Result<String, String> {
    let result = catch_unwind(AssertUnwindSafe(serve));
    result.unwrap_or_else(|_| Err("it panicked".into()))
}

/// For the service manager; the rest is told by `io-driver status`.
fn status_line(memory: &DriverMemory) -> String {
    let get = |word: &AtomicU64| word.load(Ordering::Relaxed);
    let c = &memory.counters;
    let [ticks, overruns, leases, faults] = [&c.ticks, &c.overruns, &c.leases_granted, &c.faults].map(get);
    format!("{ticks} ticks, {overruns} overruns, {leases} leases granted, {faults} faults")
}

/// Unless it is to be quiet.
pub(crate) fn say(options: &RunOptions, message: std::fmt::Arguments<'_>) {
    if !options.quiet {
        say::say(format_args!("io-driver: {message}"));
    }
}

/// Removes the sockets, and with them what a parent that was killed cannot remove.
fn tidy_up(server: Server, stop_file: SocketFile, options: &RunOptions) {
    let path = server.path().to_path_buf();
    // In this order: whoever takes the place once the lock is gone has a stop socket of its own.
    drop(stop_file);
    drop(server);
    if options.parent.is_some() {
        remove_directory_of(&path);
    }
}

/// The directory that a parent made for its child's socket, and nothing else.
pub(crate) fn remove_directory_of(socket: &Path) {
    if let Some(directory) = socket.parent() {
        // It fails, rightly, if anything lies in it.
        let _ = std::fs::remove_dir(directory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_the_service_is_an_end_that_still_stops_the_loop() {
        let end = caught(|| panic!("no room for a line of the log"));
        assert_eq!(end, Err("it panicked".into()));
        assert_eq!(caught(|| Ok("asked to".into())).ok().as_deref(), Some("asked to"));
    }
}
