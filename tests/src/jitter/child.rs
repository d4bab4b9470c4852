//! A child process that ends when it is dropped.

use rustix::process::{Pid, Signal, kill_process};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// A child that does not end by then, after being asked to, is killed.
const PATIENCE: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(2);

/// A running child.
#[derive(Debug)]
pub struct OwnChild {
    child: Child,
}

impl OwnChild {
    /// Starts it. Call it from the main thread: the child ends with the *thread* that started it.
    pub fn start(command: &mut Command) -> std::io::Result<Self> {
        command.spawn().map(|child| Self { child })
    }

    /// Process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its pipes, to be taken.
    pub fn pipes(&mut self) -> &mut Child {
        &mut self.child
    }

    /// How it ended, if it has.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().ok().flatten()
    }

    /// Asks it to end.
    pub fn signal(&self, signal: Signal) {
        if let Some(pid) = Pid::from_raw(self.child.id().cast_signed()) {
            // It may have ended already; it is ours until it is waited for, so the id is no other's.
            let _ = kill_process(pid, signal);
        }
    }

    /// Asks it to end, and kills it if it does not.
    pub fn end(&mut self) -> Option<ExitStatus> {
        if let Some(status) = self.ended() {
            return Some(status);
        }
        self.signal(Signal::TERM);
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(status) = self.ended() {
                return Some(status);
            }
            std::thread::sleep(PAUSE);
        }
        let _ = self.child.kill();
        self.child.wait().ok()
    }
}

impl Drop for OwnChild {
    fn drop(&mut self) {
        self.end();
    }
}
