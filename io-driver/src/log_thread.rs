//! The one thread of a running driver, or of an application's run, that writes to standard error.
//!
//! Problem: whoever holds the other end of standard error decides how long a write takes, and the thread that writes
//! can do nothing else meanwhile: no stop, no lease.
//! Model: everybody else queues lines ([`say`]) or records ([`rt_core::log`]), both bounded; this thread writes
//! them, and says how many were dropped as soon as it can write again.
//! Invariant: nobody ever waits for this thread but [`say::flush`], which waits for a bounded time.

use crate::say::{self, Entry};
use rt_core::log::{LogLevel, LogLine, RtLogDrain};
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often it looks at the loop's records when nobody else says anything.
const POLL: Duration = Duration::from_millis(20);
/// Formatting, and little else.
const STACK_BYTES: usize = 128 * 1024;

struct LogThread {
    program: &'static str,
    entries: Receiver<Entry>,
    /// The loop's records, if this process has one.
    drain: Option<RtLogDrain>,
    quiet: bool,
    dropped_told: u64,
}

/// Starts it for an application's run. From now on nothing that is said waits for standard error; a second run says it the
/// same way.
///
/// # Errors
/// What the system says to another thread.
pub fn start(program: &'static str) -> io::Result<()> {
    begin(program, None, false)
}

/// Starts it for a driver.
pub(crate) fn start_for_driver(drain: RtLogDrain, quiet: bool) -> io::Result<()> {
    begin("io-driver", Some(drain), quiet)
}

fn begin(program: &'static str, drain: Option<RtLogDrain>, quiet: bool) -> io::Result<()> {
    // A process has one driver; the lines of a second one go the way of the first one's.
    let Some(entries) = say::queue() else { return Ok(()) };
    let log = LogThread { program, entries, drain, quiet, dropped_told: 0 };
    let here = Arc::new(Mutex::new(Some(log)));
    let there = Arc::clone(&here);
    let take = |log: &Mutex<Option<LogThread>>| log.lock().unwrap_or_else(PoisonError::into_inner).take();
    let (begun, has_begun) = sync_channel::<()>(0);
    let thread = std::thread::Builder::new().name("log".into()).stack_size(STACK_BYTES);
    let started = thread.spawn(move || {
        drop(begun);
        if let Some(log) = take(&there) {
            log.run();
        }
    });
    if let Err(error) = started {
        // What has been said until now, perhaps why nothing can be started.
        if let Some(log) = take(&here) {
            log.write_what_waits();
        }
        return Err(error);
    }
    // The sandbox that is shut next knows nothing of the calls by which a thread begins.
    let _ = has_begun.recv();
    Ok(())
}

impl LogThread {
    fn run(mut self) {
        loop {
            let next = self.entries.recv_timeout(POLL);
            self.write_records();
            match next {
                Ok(Entry::Line(line) | Entry::Status(line)) => say::write(&line),
                Ok(Entry::Flush(done)) => drop(done),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            self.tell_dropped();
        }
    }

    fn write_what_waits(self) {
        for entry in self.entries.try_iter() {
            if let Entry::Line(line) | Entry::Status(line) = entry {
                say::write_if_taken(&line);
            }
        }
    }

    fn write_records(&mut self) {
        let (quiet, program) = (self.quiet, self.program);
        let Some(drain) = &mut self.drain else { return };
        drain.drain(|line: LogLine| {
            if !quiet || line.level > LogLevel::Info {
                say::write(&format!("{program}: tick {}: {}\n", line.tick, line.text));
            }
        });
    }

    fn tell_dropped(&mut self) {
        let dropped = say::dropped();
        if dropped > self.dropped_told {
            let lines = dropped - self.dropped_told;
            let program = self.program;
            say::write(&format!("{program}: {lines} lines were dropped: standard error took none\n"));
            self.dropped_told = dropped;
        }
    }
}
