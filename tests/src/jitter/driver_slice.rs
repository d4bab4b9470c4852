//! The real driver and the real application as two processes, or a driver that runs already.

use crate::jitter::bank::Bank;
use crate::jitter::child::OwnChild;
use crate::jitter::circumstances::Subject;
use crate::jitter::error::JitterError;
use crate::jitter::observer::Observer;
use crate::jitter::proc_books::find_thread;
use crate::jitter::roles::{Role, command_on};
use io_driver::config::DriverConfig;
use shm_abi::DriverView;
use shm_abi::client::{self, Attachment, Connection};
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A start that takes longer has failed.
const START_LIMIT: Duration = Duration::from_secs(30);
const PAUSE: Duration = Duration::from_millis(5);
/// Longer than any slice may be.
const SECONDS: &str = "86000";
/// What the driver calls its loop's thread, and the application its answering one.
const LOOP: &str = "driver-loop";
const FAST: &str = "fast";

/// What is observed in a slice.
#[derive(Debug)]
pub struct DriverSlice {
    // Ends before the driver does.
    application: Option<Watched>,
    driver: Option<Watched>,
    connection: Connection,
    observer: Observer,
    _directory: Option<TempDir>,
}

/// A child with its last words.
#[derive(Debug)]
struct Watched {
    name: &'static str,
    child: OwnChild,
    said: File,
}

impl DriverSlice {
    /// Starts both and waits until the application commands with full authority.
    ///
    /// # Errors
    /// If one of them does not start; with what it said.
    pub fn start(
        config: &DriverConfig,
        scene: &Path,
        cpus: &[usize],
        go_on: &dyn Fn() -> bool,
    ) -> Result<Self, JitterError> {
        let directory = tempfile::Builder::new().prefix("jitter-").tempdir();
        let directory =
            directory.map_err(|error| JitterError::fault("make a directory for the socket", error))?;
        let socket = directory.path().join("driver.sock");
        let mut driver = start_driver(config, &socket, cpus)?;
        let Attachment { driver: view, connection, driver_pid, .. } = attach(&socket, &mut driver, go_on)?;
        let mut application = start_application(&socket, scene, cpus)?;
        let both = &mut [&mut driver, &mut application];
        wait_until("the application did not get full authority", both, go_on, || {
            view.read_latest().is_some_and(|frame| frame.run_tick >= 0)
        })?;
        let cpu = view.info().cpu;
        let fast = find_thread(application.child.id(), FAST);
        let fast = fast.map(|tid| Subject { pid: application.child.id(), tid, cpu: None });
        let observer = Observer::new(view, subject(driver_pid, cpu), fast);
        let (application, driver) = (Some(application), Some(driver));
        Ok(Self { application, driver, connection, observer, _directory: Some(directory) })
    }

    /// Looks on at a driver that runs already.
    ///
    /// # Errors
    /// If there is none, or it does not let us.
    pub fn attach(socket: &Path) -> Result<Self, JitterError> {
        let attached =
            client::observe(socket, "jitter").map_err(|error| JitterError::Usage(error.to_string()))?;
        let Attachment { driver: view, connection, driver_pid, .. } = attached;
        let cpu = view.info().cpu;
        let observer = Observer::new(view, subject(driver_pid, cpu), None);
        Ok(Self { application: None, driver: None, connection, observer, _directory: None })
    }

    /// The driver's memory.
    pub fn view(&self) -> &DriverView {
        self.observer.view()
    }

    /// Begins anew with the next frame: what came until now is not measured.
    pub fn forget(&mut self) {
        let mut nobody = Bank::new(crate::jitter::origin::Origin::now(), 0);
        self.observer.poll(&mut nobody);
    }

    /// Measures what has come since the last call.
    ///
    /// # Errors
    /// If one of the two is gone; with what it said.
    pub fn poll(&mut self, bank: &mut Bank) -> Result<(), JitterError> {
        self.observer.poll(bank);
        for child in [&mut self.application, &mut self.driver].into_iter().flatten() {
            if let Some(words) = child.last_words() {
                return Err(JitterError::Fault(words));
            }
        }
        if !self.connection.is_open() {
            let words = rt_core::epitaph::read(&self.observer.view().epitaph);
            let words = words.map_or_else(|| "without last words".to_owned(), |words| words.to_string());
            return Err(JitterError::Fault(format!("the driver is gone: {words}")));
        }
        Ok(())
    }
}

impl Watched {
    fn start(name: &'static str, command: &mut std::process::Command) -> Result<Self, JitterError> {
        let failed = |error: std::io::Error| JitterError::fault(&format!("start the {name}"), error);
        let said = tempfile::tempfile().map_err(failed)?;
        command.stderr(said.try_clone().map_err(failed)?);
        Ok(Self { name, child: OwnChild::start(command).map_err(failed)?, said })
    }

    /// If it has ended: how, and the end of what it said.
    fn last_words(&mut self) -> Option<String> {
        let status = self.child.ended()?;
        let mut said = String::new();
        let _ = self.said.rewind().and_then(|()| self.said.read_to_string(&mut said));
        let lines: Vec<&str> = said.lines().collect();
        let last = lines[lines.len().saturating_sub(4)..].join(" | ");
        Some(format!("the {} ended ({status}): {last}", self.name))
    }
}

fn start_driver(config: &DriverConfig, socket: &Path, cpus: &[usize]) -> Result<Watched, JitterError> {
    let failed = |error: std::io::Error| JitterError::fault("start the driver", error);
    let mut command = command_on(Role::Phantom3, cpus).map_err(failed)?;
    command
        .args(["driver", "run", "--config", "-", "--quiet", "--parent"])
        .arg(std::process::id().to_string());
    command.arg("--socket").arg(socket).stdin(Stdio::piped());
    let mut driver = Watched::start("driver", &mut command)?;
    if let Some(mut input) = driver.child.pipes().stdin.take() {
        // One that died already says so when it is attached to.
        let _ = input.write_all(config.to_toml().as_bytes());
    }
    Ok(driver)
}

fn start_application(socket: &Path, scene: &Path, cpus: &[usize]) -> Result<Watched, JitterError> {
    let failed = |error: std::io::Error| JitterError::fault("start the application", error);
    let mut command = command_on(Role::Phantom3, cpus).map_err(failed)?;
    command.args(["run", "--headless", "--seconds", SECONDS, "--attach"]).arg(socket).arg(scene);
    Watched::start("application", &mut command)
}

fn attach(socket: &Path, driver: &mut Watched, go_on: &dyn Fn() -> bool) -> Result<Attachment, JitterError> {
    let mut attachment = None;
    wait_until("the driver does not listen", &mut [driver], go_on, || {
        attachment = client::observe(socket, "jitter").ok();
        attachment.is_some()
    })?;
    attachment.ok_or_else(|| JitterError::Fault("the driver does not listen".into()))
}

fn wait_until(
    failure: &str,
    children: &mut [&mut Watched],
    go_on: &dyn Fn() -> bool,
    mut done: impl FnMut() -> bool,
) -> Result<(), JitterError> {
    let begun = Instant::now();
    while !done() {
        if let Some(words) = children.iter_mut().find_map(|child| child.last_words()) {
            return Err(JitterError::Fault(words));
        }
        if begun.elapsed() > START_LIMIT || !go_on() {
            return Err(JitterError::Fault(format!(
                "{failure} within {:.1} s",
                begun.elapsed().as_secs_f64()
            )));
        }
        std::thread::sleep(PAUSE);
    }
    Ok(())
}

/// A driver of another user shows its thread's name but not all of its books; what is missing is left out.
fn subject(driver_pid: u64, cpu: Option<usize>) -> Subject {
    let pid = u32::try_from(driver_pid).unwrap_or(0);
    Subject { pid, tid: find_thread(pid, LOOP).unwrap_or(pid), cpu }
}

/// The default scene and the driver's configuration for it, in a directory of their own.
#[derive(Debug)]
pub struct DefaultScene {
    directory: TempDir,
}

impl DefaultScene {
    /// Unpacks them.
    ///
    /// # Errors
    /// If there is no room for temporary files.
    pub fn unpack() -> Result<Self, JitterError> {
        let make = || {
            let directory = tempfile::Builder::new().prefix("jitter-scene-").tempdir()?;
            std::fs::write(
                directory.path().join("scene.toml"),
                include_str!("../../../config/scenes/default.toml"),
            )?;
            std::fs::write(
                directory.path().join("hand.csv"),
                include_str!("../../../config/hands/default.csv"),
            )?;
            Ok(directory)
        };
        let made: std::io::Result<TempDir> = make();
        made.map(|directory| Self { directory })
            .map_err(|error| JitterError::fault("unpack the default scene", error))
    }

    /// The scene.
    pub fn scene(&self) -> PathBuf {
        self.directory.path().join("scene.toml")
    }

    /// Two ideal devices that follow the scene's hand.
    pub fn driver_toml(&self, rate_hz: f64) -> String {
        let device = format!(
            "[[device]]\nbackend = \"ideal\"\nhand = {:?}\npeak_force_n = 8.5\n",
            self.directory.path().join("hand.csv")
        );
        format!("rate_hz = {rate_hz:?}\n{}", device.repeat(2))
    }
}
