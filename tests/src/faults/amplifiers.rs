//! An emulated card as a child process, whose amplifiers check every value that a driver ever writes.
//!
//! Model: the emulator judges each value as it comes; when it has ended, the queue in the shared file is judged
//! once more, by amplifiers in the test's own process. So values that nobody played for (a killed emulator) are
//! judged too. The arm rests at home, so that the second judge knows its pose.

use crate::driver::HANG;
use crate::faults::process::{End, Running};
use crate::programs;
use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::emulator::amplifier::{Amplifier, AmplifierSpec, Tally, Value};
use io_driver::emulator::card::{Card, QUEUE, STATUS_TRIPPED};
use io_driver::emulator::process::tally_of;
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Zero torque: the middle of twelve bits.
pub const ZERO_CODE: u32 = 2048;

/// What the amplifiers mind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest force (N).
    pub peak_n: f64,
    /// How fast a force may grow (N/s).
    pub slew_n_per_s: f64,
    /// Rate of the driver that is told so (Hz).
    pub rate_hz: f64,
    /// Silence that trips them (ms).
    pub watchdog_ms: u64,
}

impl Limits {
    /// How much a force may grow from one value to the next (N).
    pub fn step_n(&self) -> f64 {
        self.slew_n_per_s / self.rate_hz
    }

    /// The Premium's description with these limits.
    pub fn description(&self) -> String {
        let text = builtin("premium-1.5").expect("it is built in");
        let (peak, slew) = (self.peak_n, self.slew_n_per_s);
        let change = |line: &str| match line {
            _ if line.starts_with("peak_force_n") => format!("peak_force_n = {peak:?}\n"),
            _ if line.starts_with("slew_n_per_s") => format!("slew_n_per_s = {slew:?}\n"),
            _ if line.starts_with("continuous_force_n") => "continuous_force_n = 0.5\n".into(),
            _ => format!("{line}\n"),
        };
        text.lines().map(change).collect()
    }

    fn judge(&self) -> Amplifier {
        let arm_file = self.premium();
        Amplifier::new(AmplifierSpec {
            motors: arm_file.motors,
            kinematics: arm_file.mechanism,
            peak_n: self.peak_n,
            step_n: self.step_n(),
            watchdog_ns: u64::MAX,
        })
    }

    fn premium(&self) -> ArmFile {
        match DeviceFile::parse(&self.description(), Path::new("<test>")) {
            Ok(DeviceFile::Arm(arm_file)) => *arm_file,
            other => panic!("{other:?}"),
        }
    }
}

/// What became of all values of a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Seen {
    /// Values that were ever written.
    pub written: u64,
    /// What the amplifiers said, as far as they got.
    pub tally: Tally,
    /// Values that were judged once more afterwards.
    pub judged_again: u64,
}

/// The process, and the card as it shares it.
#[derive(Debug)]
pub struct Amplifiers {
    /// The emulator.
    pub process: Running,
    /// The registers.
    pub card: &'static Card,
    file: PathBuf,
    limits: Limits,
    rests: bool,
}

impl Amplifiers {
    /// Plays a card in `directory`, for an arm that rests.
    pub fn start(directory: &Path, limits: Limits) -> Self {
        Self::start_with(directory, limits, &[])
    }

    /// The same with further arguments, which may let the arm move.
    pub fn start_with(directory: &Path, limits: Limits, arguments: &[&str]) -> Self {
        let (file, description) = (directory.join("card"), directory.join("arm.toml"));
        std::fs::write(&description, limits.description()).expect("the description is written");
        // One that was killed leaves its card behind, and its successor should not wait to see whether it lives.
        let _ = std::fs::remove_file(&file);
        let mut command = emulate(&file);
        command.arg("--description").arg(&description).args(arguments);
        command.args(["--watchdog-ms", &limits.watchdog_ms.to_string()]);
        command.args(["--step-n", &limits.step_n().to_string()]);
        let mut process = Running::start(&mut command);
        let card = wait_for_card(&file, &mut process);
        Self { process, card, file, limits, rests: arguments.is_empty() }
    }

    /// The file of registers.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// What they have seen so far.
    pub fn tally(&self) -> Tally {
        tally_of(self.card)
    }

    /// How many values were written so far.
    pub fn written(&self) -> u64 {
        self.card.outputs.written.load(Ordering::Acquire)
    }

    /// How many values, and how long (ns), after the one that was written last at `time_ns` the first without any torque
    /// came; `None`: none yet.
    pub fn silence_after(&self, time_ns: u64) -> Option<(u64, u64)> {
        let written = self.written();
        let value = |number: u64| {
            let record = self.card.record(number)?;
            let packed = record.codes.load(Ordering::Relaxed);
            let is_zero = (0..3).all(|channel| (packed >> (16 * channel)) as u16 == ZERO_CODE as u16);
            Some((record.time_ns.load(Ordering::Relaxed), is_zero))
        };
        let is_before = |number: &u64| value(*number).is_some_and(|(at_ns, _)| at_ns <= time_ns);
        let last = (1..=written).rev().find(is_before)?;
        let from_ns = value(last)?.0;
        let first = (last + 1..=written).find(|number| value(*number).is_some_and(|(_, is_zero)| is_zero))?;
        Some((first - last, value(first)?.0 - from_ns))
    }

    /// Whether the register says that they are to be on.
    pub fn are_enabled(&self) -> bool {
        self.card.outputs.enable.load(Ordering::Acquire) == 1
    }

    /// Whether they have switched themselves off.
    pub fn have_tripped(&self) -> bool {
        self.card.inputs.status.load(Ordering::Acquire) & STATUS_TRIPPED != 0
    }

    /// What the converters' registers hold.
    pub fn codes(&self) -> [u32; 3] {
        [0, 1, 2].map(|channel| self.card.outputs.codes[channel].load(Ordering::Acquire))
    }

    /// Presses buttons, and lets go of the others.
    pub fn press(&self, buttons: u32) {
        self.card.inputs.buttons.store(buttons, Ordering::Release);
    }

    /// Whether the last value that was written says off.
    pub fn were_told_off(&self) -> bool {
        self.card.record(self.written()).is_some_and(|record| record.flags.load(Ordering::Acquire) & 1 == 0)
    }

    /// Waits until the emulator has done two rounds more, so that everything written before is in its tally.
    pub fn settle(&self) {
        let beat = || self.card.inputs.heartbeat.load(Ordering::Acquire);
        let from = beat();
        wait_for("the emulator's heartbeat", || beat() >= from + 2);
    }

    /// Zero torque in all registers, and off.
    pub fn check_off(&self, when: &str) {
        assert!(!self.are_enabled(), "{when}: the amplifiers are on, codes {:?}", self.codes());
        assert_eq!(self.codes(), [ZERO_CODE; 3], "{when}");
    }

    /// Waits until the amplifiers have switched themselves off since the tally was `before`.
    pub fn wait_for_trip(&self, before: Tally) {
        wait_for("the watchdog", || {
            self.tally().watchdog_trips > before.watchdog_trips && self.have_tripped()
        });
    }

    /// Ends the emulator once it has judged every value, and checks that all were good and none was lost. No
    /// driver may write any more.
    pub fn finish(mut self) -> Seen {
        let written = self.written();
        wait_for("every value's judgement", || {
            let tally = self.tally();
            tally.checked + tally.lost >= written
        });
        self.process.signal(Signal::TERM);
        let end = self.process.end();
        let tally = told(&end);
        assert_eq!((tally.wrong(), tally.lost), (0, 0), "{tally:?}{}", self.values_around(tally.first_wrong));
        assert_eq!(tally.checked, written, "checked and written: {tally:?}");
        assert_eq!(end.status, Some(0), "{end:?}");
        Seen { written, tally, judged_again: self.judge_again() }
    }

    /// The values before one that was wrong and after it, as far as they are still in the queue, a line each.
    fn values_around(&self, number: u64) -> String {
        let of = |number: u64| {
            let record = self.card.record(number)?;
            let (codes, flags) = (record.codes.load(Ordering::Relaxed), record.flags.load(Ordering::Relaxed));
            let codes = [0, 16, 32].map(|shift| (codes >> shift) as u16);
            Some(format!(
                "\n{number}: {} ns, codes {codes:?}, flags {flags:#x}",
                record.time_ns.load(Ordering::Relaxed)
            ))
        };
        (number.saturating_sub(4)..=number + 4).filter_map(of).collect()
    }

    /// What is left of an emulator that was killed: nobody judged its last values but the test. No driver may
    /// write any more.
    pub fn bury(self) -> Seen {
        let (written, tally) = (self.written(), self.tally());
        assert_eq!((tally.wrong(), tally.lost), (0, 0), "{tally:?}");
        let judged_again = self.judge_again();
        assert!(tally.checked + judged_again >= written, "{tally:?}: nobody saw all of {written} values");
        Seen { written, tally, judged_again }
    }

    /// Judges what is still in the queue; returns how many values that were.
    fn judge_again(&self) -> u64 {
        if !self.rests {
            return 0;
        }
        let arm_file = self.limits.premium();
        let mut judge = self.limits.judge();
        let written = self.written();
        let mut begun = written <= QUEUE as u64;
        let mut judged = 0;
        for number in written.saturating_sub(QUEUE as u64 - 1).max(1)..=written {
            let record = self.card.record(number).expect("nobody writes any more");
            let packed = record.codes.load(Ordering::Relaxed);
            let codes = arm_file.motors.channel.map(|channel| (packed >> (16 * u32::from(channel))) as u16);
            let enable = record.flags.load(Ordering::Relaxed) & 1 == 1;
            // The growth of a force is known from a value without any.
            begun |= codes == [ZERO_CODE as u16; 3];
            if begun {
                let time_ns = record.time_ns.load(Ordering::Relaxed);
                judge.take(Value { time_ns, codes, enable }, arm_file.encoders.home_joint_angles_rad);
                judged += 1;
            }
        }
        assert_eq!(judge.tally().wrong(), 0, "judged again: {:?}", judge.tally());
        judged
    }
}

/// `io-driver emulate` for that file, ready for further arguments.
pub fn emulate(file: &Path) -> std::process::Command {
    let mut command = programs::io_driver();
    command.arg("emulate").arg("--card").arg(file);
    command
}

/// What an emulator printed at its end.
pub fn told(end: &End) -> Tally {
    serde_json::from_str(end.out.trim()).unwrap_or_else(|error| panic!("{error}: {end:?}"))
}

fn wait_for_card(file: &Path, process: &mut Running) -> &'static Card {
    let begun = Instant::now();
    loop {
        process.must_run();
        // Before its length and its magic are there it is none yet. Each look maps it for good.
        let is_whole = std::fs::metadata(file).is_ok_and(|meta| meta.len() == size_of::<Card>() as u64);
        if let Some(Ok(card)) = is_whole.then(|| Card::open(file))
            && card.inputs.heartbeat.load(Ordering::Acquire) > 0
        {
            return card;
        }
        assert!(begun.elapsed() < HANG, "no card at {}", file.display());
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Waits for something that only a hang keeps from coming.
#[track_caller]
pub fn wait_for(what: &str, has_come: impl FnMut() -> bool) {
    patience::until(what, has_come);
}

/// A directory for cards: in memory, where there is such a place.
pub fn place_for_cards() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.or_else(|_| tempfile::tempdir()).expect("a directory")
}
