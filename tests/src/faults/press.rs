//! A finger that rests 4 mm inside a table of 1000 N/m, so that whoever renders it applies 4 N.

use crate::driver::{Driver, HANG};
use crate::faults::process::{self, Running};
use crate::programs;
use rustix::process::Signal;
use shm_abi::client::{self, Attachment};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Stiffness times depth (N).
pub const FORCE_N: f64 = 4.0;
/// The device's peak (N).
pub const PEAK_N: f64 = 8.5;

const SCENE: &str = "\
[[finger]]
start_m = [0.0, -0.004, 0.0]
[[entity]]
name = \"table\"
shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }
stiffness_n_per_m = 1000.0
friction = { model = \"coulomb\", mu = 0.5 }
";

/// A driver's configuration: one such finger at 2 kHz, commands obeyed for 5 ticks, ramps of 40 ticks in and
/// 8 ticks out, no real-time rights. Replies may take most of the tick: tests share their CPUs.
pub fn config(clock: &str) -> String {
    format!(
        "rate_hz = 2000\nclock = \"{clock}\"\n\
         [real_time]\npriority = 0\nlock_memory = false\n\
         [reply]\nbudget_us = 400\n\
         [safety]\nmax_command_age_ticks = 5\nramp_in_ms = 20\nramp_out_ms = 4\n\
         [[device]]\nbackend = \"ideal\"\nstart_m = [0.0, -0.004, 0.0]\npeak_force_n = {PEAK_N}\n"
    )
}

/// Such a driver, and the scene for it.
#[derive(Debug)]
pub struct Press {
    /// The driver.
    pub driver: Driver,
    /// Looks on.
    pub observer: Attachment,
    /// Its clock.
    pub clock: &'static str,
    table: Table,
}

impl Press {
    /// Starts the driver.
    pub fn start(clock: &'static str) -> Self {
        let driver = Driver::start(&config(clock));
        let observer = driver.observe();
        let info = observer.driver.info();
        assert_eq!((info.max_command_age_ticks, info.ramp_in_ticks, info.ramp_out_ticks), (5, 40, 8));
        Self { driver, observer, clock, table: Table::new() }
    }

    /// `phantom3` that attaches to the driver and presses for a time that no test lasts.
    pub fn app(&self) -> Command {
        let mut command = self.table.app(self.clock);
        command.arg("--attach").arg(self.driver.socket());
        command
    }

    /// Starts it.
    pub fn start_app(&self) -> Running {
        Running::start(self.app().args(["--seconds", "80000"]))
    }

    /// Fails the test if the driver has ended.
    pub fn driver_must_live(&mut self) {
        assert_eq!(self.driver.child.try_wait().expect("our child"), None, "the driver stays");
    }

    /// Where a file of this name lies.
    pub fn path(&self, name: &str) -> PathBuf {
        self.table.path(name)
    }
}

/// The scene in a directory of its own, and another directory for what `phantom3` itself leaves there.
#[derive(Debug)]
pub struct Table {
    directory: TempDir,
    runtime: TempDir,
}

impl Table {
    /// Writes the scene.
    #[expect(clippy::new_without_default, reason = "it makes directories, which nobody expects of a default")]
    pub fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        std::fs::write(directory.path().join("press.toml"), SCENE).expect("the scene is written");
        Self { directory, runtime: tempfile::tempdir().expect("a directory") }
    }

    /// `phantom3 run` with the scene.
    pub fn app(&self, clock: &str) -> Command {
        let mut command = programs::phantom3();
        command
            .args(["run", "press.toml", "--headless", "--clock", clock])
            .current_dir(self.directory.path())
            .env("XDG_RUNTIME_DIR", self.runtime.path())
            .env("TMPDIR", self.runtime.path())
            .env_remove("RUNTIME_DIRECTORY")
            .env_remove("PHANTOM3_SOCKET");
        command
    }

    /// Where a file of this name lies.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// What lies among the temporary files of `phantom3`.
    pub fn left_behind(&self) -> Vec<PathBuf> {
        entries(self.runtime.path())
    }

    /// Waits until every process that `phantom3` started here has ended.
    pub fn wait_until_abandoned(&self) {
        let mark = format!("XDG_RUNTIME_DIR={}\0", self.runtime.path().display());
        let begun = Instant::now();
        while let Some(process) = process::with_environment(&mark) {
            assert!(begun.elapsed() < HANG, "process {process} lives on");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Looks on at the driver that `phantom3` started for itself.
    pub fn observe_child(&self) -> Attachment {
        let begun = Instant::now();
        loop {
            let sockets = self.left_behind().into_iter().map(|directory| directory.join("driver.sock"));
            if let Some(Ok(attachment)) =
                sockets.map(|socket| client::observe(&socket, "test")).find(Result::is_ok)
            {
                return attachment;
            }
            assert!(begun.elapsed() < HANG, "no driver below {:?}", self.left_behind());
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

fn entries(directory: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(directory).expect("a directory").flatten().map(|entry| entry.path()).collect()
}

/// Asks an app to end, and checks that it did so in order.
pub fn terminate(mut app: Running) {
    app.must_run();
    app.signal(Signal::TERM);
    let end = app.end();
    // 128 + 15, as a shell would say it.
    assert_eq!(end.status, Some(143), "{end:?}");
}
