//! The driver as this program's own child process.
//!
//! Model: this very program is started again as `phantom3 driver run`, its configuration goes in through
//! standard input, and its socket lies in a directory that only this user can enter, beside a copy of the hand file as it
//! was read and checked here. The child ends with its parent, however that ends.

use crate::outcome::RunFailure;
use crate::rig::HandFile;
use io_driver::config::{DriverConfig, HandSource};
use rt_core::limits;
use rustix::process::{Pid, Signal, kill_process};
use shm_abi::client::{self, AttachError, Attachment};
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A child that does not listen by then has a problem that it could not tell.
const START_LIMIT: Duration = Duration::from_secs(20);
/// A child that has not ended by then, after being asked to, is killed.
const STOP_LIMIT: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(5);

/// A running child; ends when dropped.
#[derive(Debug)]
pub struct DriverChild {
    child: Child,
    socket: PathBuf,
    _directory: TempDir,
}

impl DriverChild {
    /// Starts a driver, whose devices follow this hand as far as the configuration names it.
    ///
    /// Call it from the main thread: the child ends with the *thread* that started it.
    ///
    /// # Errors
    /// If the process cannot be started.
    pub fn start(mut config: DriverConfig, hand: Option<&HandFile>) -> Result<Self, RunFailure> {
        let failed = |what: &str, error: std::io::Error| {
            RunFailure::Start(format!("cannot {what}: {}", limits::with_remedy(&error)))
        };
        let directory =
            private_directory().map_err(|error| failed("make a directory for the driver's socket", error))?;
        if let Some(hand) = hand {
            let copy = directory.path().join("hand.csv");
            std::fs::write(&copy, &hand.bytes)
                .map_err(|error| failed("copy the hand for the driver", error))?;
            follow(&mut config, &hand.path, &copy);
        }
        let socket = directory.path().join("driver.sock");
        let program = std::env::current_exe().map_err(|error| failed("find this program", error))?;
        let mut child = Command::new(&program)
            .args(["driver", "run", "--config", "-", "--quiet"])
            .arg("--parent")
            .arg(std::process::id().to_string())
            .arg("--socket")
            .arg(&socket)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            // Ctrl-C in a terminal is for the parent, which ends the child in order.
            .process_group(0)
            .spawn()
            .map_err(|error| {
                RunFailure::Start(format!("cannot start the driver: {}", limits::no_process(&error)))
            })?;
        if let Some(mut input) = child.stdin.take() {
            // A child that died already says so itself, and `attach` notices.
            let _ = input.write_all(config.to_toml().as_bytes());
        }
        Ok(Self { child, socket, _directory: directory })
    }

    /// Where it listens.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until it listens, and takes the lease.
    ///
    /// # Errors
    /// If it ends instead, or does not get ready.
    pub fn attach(&mut self, name: &str) -> Result<Attachment, RunFailure> {
        let started = Instant::now();
        loop {
            match client::command(&self.socket, name) {
                Err(AttachError::NoDriver { .. } | AttachError::DriverGone { .. }) => {}
                Ok(attachment) => return Ok(attachment),
                // One that ends while it is asked has said why.
                Err(error) => return Err(self.end().map_or_else(|| error.into(), did_not_start)),
            }
            if let Ok(Some(status)) = self.child.try_wait() {
                return Err(did_not_start(status));
            }
            if started.elapsed() > START_LIMIT {
                return Err(RunFailure::Start(format!(
                    "the driver did not get ready within {START_LIMIT:?}"
                )));
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// How it ended, if it has, within a short while.
    pub fn end(&mut self) -> Option<ExitStatus> {
        wait_at_most(&mut self.child, Duration::from_millis(500))
    }
}

/// Has the devices that follow a hand file follow its copy.
fn follow(config: &mut DriverConfig, hand: &Path, copy: &Path) {
    for wish in config.devices.iter_mut().filter_map(|device| device.backend.wish_mut()) {
        if let HandSource::Script { file, .. } = &mut wish.hand
            && file == hand
        {
            *file = copy.into();
        }
    }
}

fn did_not_start(status: ExitStatus) -> RunFailure {
    RunFailure::Start(format!("the driver did not start ({status}); see its message above"))
}

impl Drop for DriverChild {
    fn drop(&mut self) {
        if let (Ok(None), Some(pid)) = (self.child.try_wait(), Pid::from_raw(self.child.id().cast_signed())) {
            let _ = kill_process(pid, Signal::TERM);
        }
        if wait_at_most(&mut self.child, STOP_LIMIT).is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

fn wait_at_most(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status),
            Err(_) => return None,
            Ok(None) if started.elapsed() > limit => return None,
            Ok(None) => std::thread::sleep(PAUSE),
        }
    }
}

/// In the user's runtime directory where there is one, else among the temporary files; mode 0700.
pub(crate) fn private_directory() -> std::io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("phantom3-");
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    let wanted =
        runtime.into_iter().chain([std::env::temp_dir()]).filter(|place| leaves_room_for_a_socket(place));
    let made = wanted.map(|place| builder.tempdir_in(place)).find_map(Result::ok);
    made.map_or_else(|| builder.tempdir_in("/tmp"), Ok)
}

/// The kernel takes 107 bytes of a socket's name; the longest is the stop socket's, before it is renamed.
fn leaves_room_for_a_socket(place: &Path) -> bool {
    place.as_os_str().len() + "/phantom3-123456/driver.sock.stop.4194304".len() <= 107
}
