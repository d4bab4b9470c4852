//! A driver as a child process with a socket of its own.

use crate::{programs, workplace};
use patience::prelude::*;
use shm_abi::client::{self, AttachError, Attachment};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

pub use patience::HANG;

/// A driver that is killed when dropped.
#[derive(Debug)]
pub struct Driver {
    /// The process.
    pub child: Child,
    socket: PathBuf,
    _directory: TempDir,
}

impl Driver {
    /// Starts one with this configuration and waits until it listens.
    pub fn start(config: &str) -> Self {
        Self::start_as(config, programs::io_driver())
    }

    /// The same with a command line, environment or starter of its own, behind which the usual arguments come.
    pub fn start_as(config: &str, command: Command) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("driver.sock");
        Self::start_at(config, command, directory, socket)
    }

    /// The same at a socket of one's own, which lies in or below the directory.
    pub fn start_at(config: &str, command: Command, directory: TempDir, socket: PathBuf) -> Self {
        let child = spawn_as(config, &socket, command);
        let driver = Self { child, socket, _directory: directory };
        driver.wait_until_it_listens();
        driver
    }

    /// Starts another one at the same socket, after this one has ended.
    pub fn restart(&mut self, config: &str) {
        self.child = spawn(config, &self.socket);
        self.wait_until_it_listens();
    }

    /// Where it listens.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Takes the lease, waiting for a former holder's end to be noticed.
    pub fn command(&self) -> Attachment {
        let begun = Instant::now();
        loop {
            match client::command(&self.socket, "test") {
                Err(AttachError::LeaseHeld { .. }) if begun.elapsed() < HANG => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                other => return other.expect("the lease"),
            }
        }
    }

    /// Attaches as the commander, and waits until the driver's loop obeys the lease.
    pub fn command_in_force(&self) -> Attachment {
        let attachment = self.command();
        let lease = attachment.commander.as_ref().expect("a commander's memory").lease();
        patience::until("the lease is in force", || {
            attachment.driver.read_latest().is_some_and(|frame| frame.lease == lease)
        });
        attachment
    }

    /// Looks on.
    pub fn observe(&self) -> Attachment {
        client::observe(&self.socket, "test").expect("an observer's place")
    }

    /// Waits for its end.
    pub fn wait(&mut self) -> ExitStatus {
        wait_or_kill(&mut self.child)
    }

    fn wait_until_it_listens(&self) {
        patience::until("the driver listens", || client::observe(&self.socket, "test").is_ok());
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.child.end();
    }
}

fn spawn(config: &str, socket: &Path) -> Child {
    spawn_as(config, socket, programs::io_driver())
}

fn spawn_as(config: &str, socket: &Path, command: Command) -> Child {
    let mut command = command;
    command.args(["run", "--config", "-", "--quiet", "--socket"]).arg(socket).stdin(Stdio::piped());
    let mut child = workplace::spawn(&mut command);
    child.stdin.take().expect("piped").write_all(config.as_bytes()).expect("it reads its configuration");
    child
}

/// Waits for a child's end; one that hangs is killed and fails the test.
pub fn wait_or_kill(child: &mut Child) -> ExitStatus {
    wait_or_kill_after(child, patience::limit())
}

/// The same for one that may take longer.
pub fn wait_or_kill_after(child: &mut Child, patience: Duration) -> ExitStatus {
    child.wait_within(patience)
}

/// A configuration of `devices` resting ideal devices with a peak of 8.5 N, without real-time rights, so
/// that tests may run side by side.
pub fn resting(clock: &str, devices: usize) -> String {
    let device = "[[device]]\nbackend = \"ideal\"\npeak_force_n = 8.5\n";
    format!("clock = \"{clock}\"\n[real_time]\npriority = 0\nlock_memory = false\n{}", device.repeat(devices))
}
