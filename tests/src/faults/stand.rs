//! A test stand: an emulated card with amplifiers, a driver on it, and a finger that is pressed into a table.
//!
//! The table has 1000 N/m and the finger, which rests at the arm's home, is 1.2 mm inside. 1.2 N need less than
//! the continuous current, so that no test grows too warm, however long it lasts.

use crate::driver::HANG;
use crate::faults::amplifiers::{Amplifiers, Limits, Seen, place_for_cards};
use crate::faults::process::{End, Running};
use crate::faults::ring::{RingLog, Told};
use crate::faults::saboteur::SABOTAGE_VARIABLE;
use crate::programs;
use rustix::process::Signal;
use shm_abi::client::{self, Attachment};
use shm_abi::{DriverState, DriverView};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Stiffness times depth (N).
pub const FORCE_N: f64 = 1.2;
/// Rate of the driver (Hz).
pub const RATE_HZ: f64 = 2000.0;
/// The converters' steps over the arm's levers, half of one on each joint: 5.5 A / 2048 * 23.4 mN m/A * 13.5 / 2
/// over 0.17 m, thrice (N).
pub const CODE_N: f64 = 0.01;

/// A watchdog (ms): a stall of a loaded virtual machine must not trip it, a dead driver must.
pub const WATCHDOG_MS: u64 = 500;

const SCENE: &str = "\
[[finger]]
start_m = [0.0, 0.0, 0.0]
[[entity]]
name = \"table\"
shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0012 }
stiffness_n_per_m = 1000.0
friction = { model = \"coulomb\", mu = 0.5 }
";

/// How a stand is set up.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// `real`: a card has no other.
    pub clock: &'static str,
    /// What the amplifiers mind.
    pub limits: Limits,
    /// What goes wrong in the driver's loop; see [`crate::faults::saboteur`].
    pub sabotage: String,
    /// How long a force stays and how it comes and goes: lines of `[safety]`; none: the driver's own defaults.
    pub safety: &'static str,
    /// Further lines of the driver's configuration, before its device.
    pub config: String,
    /// How the arm, which is at home, learns that it is.
    pub zeroing: &'static str,
    /// Further arguments of the emulator.
    pub emulator: Vec<&'static str>,
    /// Whether the driver says what it does, on standard error.
    pub talks: bool,
}

impl Setup {
    /// The usual one.
    pub fn new(clock: &'static str) -> Self {
        // 0.2 N a value: the honest force never grows faster, and a mad one always would.
        let limits = Limits { peak_n: 8.5, slew_n_per_s: 400.0, rate_hz: RATE_HZ, watchdog_ms: WATCHDOG_MS };
        Self {
            clock,
            limits,
            sabotage: String::new(),
            safety: PATIENT,
            config: String::new(),
            zeroing: "at-start",
            emulator: Vec::new(),
            talks: false,
        }
    }

    /// The same with this sabotage.
    pub fn sabotaged(self, plan: &str) -> Self {
        Self { sabotage: plan.into(), ..self }
    }
}

/// It.
#[derive(Debug)]
pub struct Stand {
    /// How it was set up.
    pub setup: Setup,
    /// The card and its judge.
    pub amplifiers: Amplifiers,
    /// The driver; it may have ended.
    pub driver: Running,
    /// Looks on at the driver that was started last.
    pub observer: Attachment,
    place: TempDir,
}

impl Stand {
    /// Starts emulator and driver.
    pub fn start(setup: Setup) -> Self {
        let place = place_for_cards();
        std::fs::write(place.path().join("press.toml"), SCENE).expect("the scene is written");
        let amplifiers = Amplifiers::start_with(place.path(), setup.limits, &setup.emulator);
        let mut driver = Running::start(&mut driver_at(&setup, place.path()));
        let observer = observe(&place.path().join("driver.sock"), &mut driver);
        Self { setup, amplifiers, driver, observer, place }
    }

    /// Rewires the arm: its counters, motors and amplifiers stay, what the driver believes of them changes, and it starts
    /// anew.
    pub fn describe_otherwise(&mut self, table: &str, from: &str, to: &str) {
        let file = self.path("arm.toml");
        let text = std::fs::read_to_string(&file).expect("the description");
        let (before, after) = text.split_at(text.find(table).expect("the table is there"));
        assert!(after.contains(from), "no `{from}` in {table}");
        self.stop_driver();
        std::fs::write(&file, format!("{before}{}", after.replacen(from, to, 1))).expect("it is written");
        self.restart_driver();
    }

    /// Where the driver listens.
    pub fn socket(&self) -> PathBuf {
        self.path("driver.sock")
    }

    /// Where a file of this name lies.
    pub fn path(&self, name: &str) -> PathBuf {
        self.place.path().join(name)
    }

    /// The driver's shared memory.
    pub fn view(&self) -> &DriverView {
        &self.observer.driver
    }

    /// `phantom3` that attaches to the driver and presses for a time that no test lasts.
    pub fn app(&self) -> Command {
        self.prepare_app(programs::phantom3())
    }

    /// The same of another copy of `phantom3`.
    pub fn prepare_app(&self, program: Command) -> Command {
        self.prepare_app_for(program, "80000")
    }

    /// `phantom3` that presses for so long (s).
    pub fn app_for(&self, seconds: &str) -> Command {
        self.prepare_app_for(programs::phantom3(), seconds)
    }

    fn prepare_app_for(&self, program: Command, seconds: &str) -> Command {
        let mut command = program;
        command
            .args(["run", "press.toml", "--headless", "--seconds", seconds, "--clock", self.setup.clock])
            .arg("--attach")
            .arg(self.socket())
            .current_dir(self.place.path())
            .env("XDG_RUNTIME_DIR", self.place.path())
            .env("TMPDIR", self.place.path())
            .env_remove("RUNTIME_DIRECTORY")
            .env_remove("PHANTOM3_SOCKET");
        command
    }

    /// Starts it.
    pub fn start_app(&self) -> Running {
        Running::start(&mut self.app())
    }

    /// `io-driver run` for this stand.
    pub fn driver_command(&self) -> Command {
        driver_at(&self.setup, self.place.path())
    }

    /// Starts a driver after the former one has ended, and looks on at it.
    pub fn restart_driver(&mut self) {
        self.driver = Running::start(&mut self.driver_command());
        self.observer = observe(&self.socket(), &mut self.driver);
    }

    /// The same with a standard error of one's own.
    pub fn restart_driver_saying_to(&mut self, err: impl Into<Stdio>) {
        self.driver = Running::start_saying_to(&mut self.driver_command(), err);
        self.observer = observe(&self.socket(), &mut self.driver);
    }

    /// Looks on at the present driver, if it listens.
    pub fn try_to_observe(&self) -> Option<Attachment> {
        let attachment = client::observe(&self.socket(), "test").ok()?;
        // Not one that died a moment ago.
        (attachment.driver_pid == u64::from(self.driver.id())).then_some(attachment)
    }

    /// Plays a card again after the former emulator was killed. No driver may live.
    pub fn restart_amplifiers(&mut self) -> Seen {
        let again = Amplifiers::start_with(self.place.path(), self.setup.limits, &self.setup.emulator);
        std::mem::replace(&mut self.amplifiers, again).bury()
    }

    /// The lease for the test itself.
    pub fn command(&self) -> Attachment {
        let begun = Instant::now();
        loop {
            match client::command(&self.socket(), "test") {
                Err(client::AttachError::LeaseHeld { .. }) if begun.elapsed() < HANG => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                other => return other.expect("the lease"),
            }
        }
    }

    /// Waits for the whole force; returns what was told meanwhile.
    pub fn wait_for_force(&self) -> RingLog {
        let mut log = RingLog::begin(self.view());
        log.follow(self.view(), "the whole force", |told| told.iter().any(is_whole));
        log
    }

    /// Asks the driver to stop, and checks that it does so in order: motors off, nothing tripped.
    pub fn stop_driver(&mut self) -> End {
        let before = self.amplifiers.tally();
        client::stop(&self.socket(), "test").expect("it is told");
        let end = self.driver.end();
        assert_eq!(end.status, Some(0), "{end:?}");
        self.amplifiers.settle();
        self.amplifiers.check_off("after an orderly stop");
        assert!(self.amplifiers.were_told_off(), "released by a value that says so");
        assert_eq!(self.amplifiers.tally().switched_off, before.switched_off, "no last act was needed");
        end
    }

    /// Stops everything; every value that was ever written must have been good.
    pub fn finish(mut self) -> Seen {
        self.stop_driver();
        self.amplifiers.finish()
    }

    /// The same after the driver has ended in a way of its own.
    pub fn finish_after_death(self) -> Seen {
        self.amplifiers.finish()
    }
}

/// The whole force: the spring's law but for the converters' steps.
pub fn is_whole(told: &Told) -> bool {
    told.authority == 1.0 && told.state == DriverState::Active && (told.applied_n - FORCE_N).abs() < CODE_N
}

/// Asks an app to end and waits for it.
pub fn end_app(mut app: Running) -> End {
    app.must_run();
    app.signal(Signal::TERM);
    let end = app.end();
    // 128 + 15, as a shell would say it.
    assert_eq!(end.status, Some(143), "{end:?}");
    end
}

/// Commands are obeyed for 40 ticks, 20 ms, so that most stalls of a shared machine do not show; ramps take 40
/// ticks in and 8 ticks out.
const PATIENT: &str = "max_command_age_ticks = 40\nramp_in_ms = 20\nramp_out_ms = 4";

/// Without real-time rights. Replies may take four fifths of a tick at most.
fn config(setup: &Setup) -> String {
    format!(
        "rate_hz = {}\nclock = \"{}\"\n\
         [real_time]\npriority = 0\nlock_memory = false\nspin_margin_us = 0\n\
         [reply]\nbudget_us = 400\n\
         [safety]\n{}\n{}\n\
         [[device]]\nbackend = \"emulated\"\ndescription = \"arm.toml\"\ncard = \"card\"\nzeroing = \"{}\"\n",
        setup.limits.rate_hz, setup.clock, setup.safety, setup.config, setup.zeroing
    )
}

fn driver_at(setup: &Setup, place: &Path) -> Command {
    let file = place.join("driver.toml");
    std::fs::write(&file, config(setup)).expect("the configuration is written");
    let mut command = programs::io_driver();
    command.args(["run", "--config"]).arg(&file).args((!setup.talks).then_some("--quiet"));
    command.arg("--socket").arg(place.join("driver.sock"));
    command.env(SABOTAGE_VARIABLE, &setup.sabotage);
    command
}

fn observe(socket: &Path, driver: &mut Running) -> Attachment {
    let begun = Instant::now();
    loop {
        driver.must_run();
        match client::observe(socket, "test") {
            // Not one that died a moment ago.
            Ok(attachment) if attachment.driver_pid == u64::from(driver.id()) => return attachment,
            _ => {}
        }
        assert!(begun.elapsed() < HANG, "the driver does not listen");
        std::thread::sleep(Duration::from_millis(2));
    }
}
