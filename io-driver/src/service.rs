//! The driver's socket thread: who comes and goes, what the loop has to know of it, the log, the end.
//!
//! Model: it waits at the socket, passes on as mail what concerns the loop, writes down what the loop logged,
//! tells the service manager that both live, and looks for a reason to stop.

use crate::driver::{RunError, RunOptions, TICK};
use crate::mail::{Letter, Sender};
use crate::meter::bump;
use crate::real_loop::{Ended, Shared};
use crate::say;
use crate::supervisor::Supervisor;
use crate::zeroing::DeviceSet;
use rt_core::epitaph::{EpitaphKind, EpitaphRef};
use rt_core::log::{LogLevel, LogLine, RtLogDrain};
use rt_core::signals::StopSignals;
use shm_abi::DriverMemory;
use shm_abi::server::{Server, ServerEvent};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A loop that was asked to end does so within a tick. A stall of the machine is shorter than this, and so is the
/// patience of whoever stops a driver whose motors push.
const PATIENCE: Duration = Duration::from_secs(2);
const HUNG: &str = "the loop hangs; the motors were switched off behind its back";
/// How often the socket's thread looks at signals and at the log when nothing else happens.
const POLL: Duration = Duration::from_millis(20);

/// The socket's thread.
pub(crate) struct Service<'a> {
    pub(crate) server: Server,
    pub(crate) sender: Sender,
    pub(crate) drain: RtLogDrain,
    pub(crate) memory: Arc<DriverMemory>,
    pub(crate) signals: StopSignals,
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
    fn serve(&mut self) -> Result<String, RunError> {
        let mut events = Vec::new();
        loop {
            self.server
                .poll(&self.memory, POLL, &mut events)
                .map_err(|source| RunError::System { what: "wait at the socket", source })?;
            for event in events.drain(..) {
                if let Some(reason) = self.pass_on(event) {
                    return Ok(reason);
                }
            }
            self.sender.clear_waste();
            self.write_log();
            self.supervisor.turn(TICK.load(Ordering::Relaxed), || status_line(&self.memory));
            if let Some(signal) = self.signals.requested() {
                return Ok(format!("signal {signal}"));
            }
            if self.shared.ended.load(Ordering::Acquire) {
                return Ok("the loop ended".into());
            }
        }
    }

    /// Returns why to stop, if the event says so.
    fn pass_on(&mut self, event: ServerEvent) -> Option<String> {
        match event {
            ServerEvent::LeaseGranted { view, pid, name } => {
                bump(&self.memory.counters.leases_granted);
                say(self.options, format_args!("lease {} to process {pid} ({name})", view.lease()));
                self.post(Letter::Grant(view));
            }
            ServerEvent::LeaseEnded { lease } => {
                say(self.options, format_args!("lease {lease} ended"));
                self.post(Letter::End(lease));
            }
            ServerEvent::LeaseRefused => bump(&self.memory.counters.leases_refused),
            ServerEvent::ClearFaultRequested => self.post(Letter::ClearFault),
            ServerEvent::EmergencyStopRequested { pid } => {
                say(self.options, format_args!("emergency stop, asked for by process {pid}"));
                self.post(Letter::EmergencyStop);
            }
            ServerEvent::ZeroRequested { pid, devices } => {
                say(self.options, format_args!("process {pid} asks to zero devices (bits {devices:#x})"));
                self.post(Letter::Zero(DeviceSet(devices)));
            }
            ServerEvent::Trouble { message } => say::say(format_args!("io-driver: {message}")),
            ServerEvent::StopRequested { pid } => return Some(format!("request of process {pid}")),
        }
        None
    }

    /// The loop collects its mail every tick; if the queue is full it has stood still for long, and waiting
    /// here is all that is left.
    fn post(&mut self, letter: Letter) {
        let mut letter = letter;
        while let Err(returned) = self.sender.post(letter) {
            if self.shared.ended.load(Ordering::Acquire) {
                return;
            }
            letter = returned;
            std::thread::sleep(POLL);
        }
    }

    fn write_log(&mut self) {
        let quiet = self.options.quiet;
        self.drain.drain(|line: LogLine| {
            if !quiet || line.level > LogLevel::Info {
                say::say(format_args!("io-driver: tick {}: {}", line.tick, line.text));
            }
        });
        self.memory.counters.log_dropped.store(self.drain.lost(), Ordering::Relaxed);
    }

    /// Ends the loop, writes the last words and says how it was.
    fn finish(mut self, thread: JoinHandle<Ended>, served: Result<String, RunError>) -> Result<(), RunError> {
        self.supervisor.stopping(served.as_deref().unwrap_or("a fault of the socket"));
        self.shared.stop.store(true, Ordering::Relaxed);
        let has_ended = wait_for_end(&thread);
        if !has_ended {
            // It will not do it any more, and must not undo it.
            rt_core::last_act::perform();
        }
        self.write_log();
        tidy_up(self.server, self.options);
        let reason = served?;
        if !has_ended {
            let tick = TICK.load(Ordering::Relaxed);
            EpitaphRef::new(&self.memory.epitaph).write(EpitaphKind::Fault, tick, HUNG);
            return Err(RunError::Hung(tick));
        }
        match thread.join() {
            Ok(Ended::Stopped) => {
                let tick = TICK.load(Ordering::Relaxed);
                EpitaphRef::new(&self.memory.epitaph).write(EpitaphKind::Stopped, tick, &reason);
                say(self.options, format_args!("stopped in tick {tick}: {reason}; motors were written zero"));
                Ok(())
            }
            Ok(Ended::Panicked) | Err(_) => {
                let words = rt_core::epitaph::read(&self.memory.epitaph);
                Err(RunError::Panicked(words.map_or_else(String::new, |words| words.to_string())))
            }
        }
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
fn caught(serve: impl FnOnce() -> Result<String, RunError>) -> Result<String, RunError> {
    let result = catch_unwind(AssertUnwindSafe(serve));
    result.unwrap_or_else(|_| Err(RunError::Panicked("the socket's thread panicked".into())))
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

/// Removes the socket, and with it what a parent that was killed cannot remove.
fn tidy_up(server: Server, options: &RunOptions) {
    let path = server.path().to_path_buf();
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
        assert!(end.is_err_and(|error| error.is_fault()));
        assert_eq!(caught(|| Ok("asked to".into())).ok().as_deref(), Some("asked to"));
    }
}
