//! `io-driver zero`.
//!
//! Model: says what the zeroing pose is, waits until the counters rest, asks the driver, and watches its frames: a
//! zero that was granted shows as a device that is not valid and then valid, one that was refused shows as nothing.
//! The driver judges rest, and whether somebody commands, by itself; what is looked at here is for better words.
//! Invariants: no exit status of 0 without frames that show the zero. A driver that does not show within [`PROMPT`] what
//! is waited for is told of then, whatever we wait in.

use super::enter::{Entered, wait_for_enter};
use super::places::SocketArgs;
use super::prompt::{PROMPT, PromptWords, say_if_late};
use super::{EXIT_FAULT, EXIT_USAGE, fail};
use crate::device_file::home_pose;
use crate::print::print_line;
use crate::safety::elapsed::Elapsed;
use crate::safety::stillness::Stillness;
use crate::say::say as warn;
use bytemuck::Zeroable;
use clap::Args;
use rt_core::signals::StopSignals;
use shm_abi::client::{self, AttachError, Attachment};
use shm_abi::frame::{DEVICE_NOT_ZEROED, DEVICE_POSITION_VALID};
use shm_abi::peer::ProcessWords;
use shm_abi::{DeviceFrame, DriverState, DriverView, FaultReason, Frame};
use std::borrow::Cow;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use thiserror::Error;

/// Arguments of `zero`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct ZeroArgs {
    /// Which device; repeat it for several [default: those that have to be zeroed]
    #[arg(long, value_name = "NAME")]
    device: Vec<String>,
    /// Wait so long for the arms to stand still
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    wait: f64,
    /// Do not wait for Enter
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    socket: SocketArgs,
}

const AFTER_HELP: &str = "Counters know how far joints turned, not where they were: a device is told once in which \
pose it is.\nA zero taken in another pose makes every position, force and limit wrong by as much: look twice.\n\
Exit status: 0 zeroed; 2 bad usage, or refused at once; 3 it did not stand still, or the driver refused, did not answer \
or did not show the zero.";

/// Why nothing was zeroed, or is known to be.
#[derive(Debug, Error)]
pub(super) enum ZeroError {
    #[error(transparent)]
    Attach(#[from] AttachError),
    #[error("cannot catch signals: {0}")]
    Signals(#[source] std::io::Error),
    #[error(
        "the driver speaks version 1.{0} of the shared-memory contract and cannot be asked to zero; start the driver \
         that belongs to this program"
    )]
    TooOld(u32),
    #[error("no device \"{found}\"; --device one of {allowed}")]
    NoSuchDevice { found: String, allowed: String },
    #[error("device {0} has no counters: it always knows where it is")]
    Innate(String),
    #[error("every device knows where it is; name those that are to be zeroed anew: --device one of {0}")]
    NothingToDo(String),
    #[error("--wait: found {0}, allowed: 0 to 86400 s")]
    Wait(f64),
    #[error("the devices are commanded by {0}; end it first, then zero")]
    Commanded(String),
    #[error("the driver has told nothing for {0} s; it may be stopped (see `ps`)")]
    Silent(u64),
    #[error("the driver has ended")]
    DriverGone,
    #[error("interrupted; nothing was zeroed")]
    Interrupted,
    #[error("standard input has ended; --yes goes on without it")]
    NoInput,
    #[error(
        "device {device} did not stand still for half a second within {seconds} s; hold it, or let it rest"
    )]
    Moving { device: String, seconds: f64 },
    #[error("the driver refused, and nothing has changed: {0}; its log says more")]
    Refused(String),
    #[error(
        "zeroed, but the process that holds the lease has not answered since, and until it has seen that the pose is \
         another one the device stays not valid; end that process, or let it go on"
    )]
    Unseen,
    #[error(
        "{0}; it was asked to zero by then, and may have: look at its devices (`io-driver status`) before they are used"
    )]
    Unknown(String),
}

impl ZeroError {
    fn is_usage(&self) -> bool {
        !matches!(
            self,
            Self::Attach(
                AttachError::NoAnswer { .. } | AttachError::HungUp { .. } | AttachError::Unread { .. }
            ) | Self::Silent(_)
                | Self::DriverGone
                | Self::Interrupted
                | Self::Moving { .. }
                | Self::Refused(_)
                | Self::Unseen
                | Self::Unknown(_)
        )
    }
}

/// A driver tells a frame in each tick.
const SILENCE: Duration = Duration::from_secs(5);
/// So long the driver is asked: it counts readings instead of time, and one that misses ticks takes longer to believe
/// that an arm rests.
const ANSWER: Duration = Duration::from_secs(5);
/// How long each time; it collects its mail in each tick.
const TURN: Duration = Duration::from_millis(200);
/// How often the frames are looked at for rest.
const LOOK: Duration = Duration::from_millis(10);
const NAME: &str = "io-driver zero";

/// Runs it.
pub(super) fn run(args: &ZeroArgs) -> ExitCode {
    let zero = || {
        let signals = StopSignals::install().map_err(ZeroError::Signals)?;
        let socket = args.socket.path();
        let mut zeroing = Zeroing::attach(&socket, &signals)?;
        let devices = zeroing.choose(&args.device)?;
        zeroing.zero(&devices, args.wait, args.yes)
    };
    match zero() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&error, if error.is_usage() { EXIT_USAGE } else { EXIT_FAULT }),
    }
}

/// Somebody who zeroes devices of a running driver.
pub(super) struct Zeroing<'a> {
    socket: &'a Path,
    attachment: Attachment,
    signals: &'a StopSignals,
    names: Vec<String>,
    frame: Frame,
}

impl<'a> Zeroing<'a> {
    pub(super) fn attach(socket: &'a Path, signals: &'a StopSignals) -> Result<Self, ZeroError> {
        let words = format!("the driver has not answered within {PromptWords}; nothing is zeroed");
        let attachment = say_if_late(&words, || client::observe(socket, NAME))?;
        let names = attachment.driver.info().devices.into_iter().map(|device| device.name).collect();
        let mut zeroing = Self { socket, attachment, signals, names, frame: Frame::zeroed() };
        if zeroing.driver().abi_minor() < 2 {
            return Err(ZeroError::TooOld(zeroing.driver().abi_minor()));
        }
        zeroing.next_frame(0)?;
        Ok(zeroing)
    }

    /// Whether the driver says that a device has to be zeroed.
    pub(super) fn needs(&self, device: usize) -> bool {
        self.device(device).flags & DEVICE_NOT_ZEROED != 0
    }

    fn choose(&self, asked: &[String]) -> Result<Vec<usize>, ZeroError> {
        let info = self.driver().info();
        let counts = |index: &usize| info.devices[*index].kind != "ideal";
        let all = || (0..self.names.len()).filter(counts);
        if asked.is_empty() {
            let needed: Vec<usize> = all().filter(|index| self.needs(*index)).collect();
            let names: Vec<&str> = all().map(|index| self.names[index].as_str()).collect();
            return match (needed.is_empty(), names.is_empty()) {
                (false, _) => Ok(needed),
                (true, false) => Err(ZeroError::NothingToDo(names.join(", "))),
                (true, true) => Err(ZeroError::Innate(self.names.join(", "))),
            };
        }
        let find = |name: &String| {
            let unknown = || ZeroError::NoSuchDevice { found: name.clone(), allowed: self.names.join(", ") };
            let index = self.names.iter().position(|other| other == name).ok_or_else(unknown)?;
            if counts(&index) { Ok(index) } else { Err(ZeroError::Innate(name.clone())) }
        };
        asked.iter().map(find).collect()
    }

    /// From the words about the pose to those about the tip.
    pub(super) fn zero(&mut self, devices: &[usize], wait_s: f64, yes: bool) -> Result<(), ZeroError> {
        if !(0.0..=86_400.0).contains(&wait_s) {
            return Err(ZeroError::Wait(wait_s));
        }
        self.refuse_if_commanded()?;
        let info = self.driver().info();
        for index in devices {
            let device = &info.devices[*index];
            let pose = home_pose(&device.kind);
            say(&format!("{}: bring it into its zeroing pose and hold it still: {pose}", device.name));
        }
        if !yes {
            say("Press Enter when it is there.");
            match wait_for_enter(self.signals) {
                Ok(Entered::Line) => {}
                Ok(Entered::Stopped) => return Err(ZeroError::Interrupted),
                Ok(Entered::NoInput) | Err(_) => return Err(ZeroError::NoInput),
            }
        }
        self.wait_for_rest(devices, wait_s)?;
        let before = self.frame;
        let words = format!(
            "the zero is not confirmed within {PromptWords}: positions may be those of before or wrong"
        );
        say_if_late(&words, || self.ask(devices))?;
        for index in devices {
            say(&told(&self.names[*index], &before.devices[*index], self.device(*index)));
        }
        self.tell_what_is_left();
        Ok(())
    }

    pub(super) fn driver(&self) -> &DriverView {
        &self.attachment.driver
    }

    fn device(&self, index: usize) -> &DeviceFrame {
        &self.frame.devices[index]
    }

    fn refuse_if_commanded(&self) -> Result<(), ZeroError> {
        if self.frame.state != DriverState::Active as u64 && self.frame.authority == 0.0 {
            return Ok(());
        }
        let words = format!("the driver has not told within {PromptWords} who commands");
        match say_if_late(&words, || client::command(self.socket, NAME)) {
            Err(AttachError::LeaseHeld { pid, name }) => {
                Err(ZeroError::Commanded(format!("{} ({name})", ProcessWords(pid))))
            }
            // It has just ended; the driver judges by itself.
            _ => Ok(()),
        }
    }

    /// Waits for a frame of a tick after `tick`.
    fn next_frame(&mut self, tick: u64) -> Result<(), ZeroError> {
        let begun = Instant::now();
        let mut is_warned = false;
        loop {
            if self.signals.requested().is_some() {
                return Err(ZeroError::Interrupted);
            }
            if let Some(frame) = self.driver().read_latest().filter(|frame| frame.tick > tick) {
                self.frame = frame;
                return Ok(());
            }
            if !self.attachment.connection.is_open() {
                return Err(ZeroError::DriverGone);
            }
            if !is_warned && begun.elapsed() > PROMPT {
                is_warned = true;
                warn(format_args!("io-driver: the driver has told nothing for {PromptWords}; looking on"));
            }
            if begun.elapsed() > SILENCE {
                return Err(ZeroError::Silent(SILENCE.as_secs()));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn wait_for_rest(&mut self, devices: &[usize], wait_s: f64) -> Result<(), ZeroError> {
        let begun = Instant::now();
        let mut rests = vec![Stillness::default(); devices.len()];
        // One reading in each look, however many ticks that is.
        let look_ns = LOOK.as_nanos() as u64;
        let elapsed = Elapsed::new(look_ns, look_ns);
        let mut live = LiveLine::new();
        loop {
            self.next_frame(self.frame.tick)?;
            for (rest, index) in rests.iter_mut().zip(devices) {
                rest.observe(self.device(*index).encoder_counts, elapsed);
            }
            live.show(devices.iter().zip(&rests).map(|(index, rest)| {
                let counts = counts_of(self.device(*index));
                let word = if rest.is_still() { "still" } else { "moving" };
                format!("{} {word}, counts {counts}", self.names[*index])
            }));
            let Some(moving) = rests.iter().position(|rest| !rest.is_still()) else { return Ok(()) };
            if begun.elapsed().as_secs_f64() > wait_s {
                let device = self.names[devices[moving]].clone();
                return Err(ZeroError::Moving { device, seconds: wait_s });
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Asks, and says of what kept it from looking that the driver may have zeroed by then.
    fn ask(&mut self, devices: &[usize]) -> Result<(), ZeroError> {
        let mut was_asked = false;
        self.ask_and_look(devices, &mut was_asked).map_err(|error| match error {
            ZeroError::Interrupted if was_asked => ZeroError::Unknown("interrupted".into()),
            ZeroError::Attach(_) | ZeroError::Silent(_) if was_asked => ZeroError::Unknown(error.to_string()),
            other => other,
        })
    }

    /// Looks at every frame after that. A zero that was refused changed nothing, so that it may be asked for again.
    fn ask_and_look(&mut self, devices: &[usize], was_asked: &mut bool) -> Result<(), ZeroError> {
        let bits = devices.iter().fold(0, |bits, index| bits | 1 << index);
        let mut seen = self.driver().latest_tick().unwrap_or(0);
        let mut was_withheld = vec![false; devices.len()];
        let (began, mut asked) = (Instant::now(), None);
        while began.elapsed() < ANSWER {
            let is_due = asked.is_none_or(|asked: Instant| asked.elapsed() > TURN);
            if is_due && !self.was_granted(devices, &was_withheld) {
                let answer = client::zero(self.socket, NAME, bits);
                // What was not answered may have been heard.
                *was_asked |= answer.as_ref().map_or_else(AttachError::may_be_heard, |()| true);
                answer?;
                asked = Some(Instant::now());
            }
            self.next_frame(seen)?;
            let latest = self.frame;
            for tick in seen + 1..=latest.tick {
                if self.attachment.driver.read_frame(tick, &mut self.frame).is_ok() {
                    for (was_withheld, index) in was_withheld.iter_mut().zip(devices) {
                        *was_withheld |= self.device(*index).flags & DEVICE_POSITION_VALID == 0;
                    }
                }
            }
            seen = latest.tick;
            self.frame = latest;
            let is_fault = latest.state == DriverState::Fault as u64;
            let is_valid = |index: &usize| is_fault || self.device(*index).flags & DEVICE_POSITION_VALID != 0;
            if self.was_granted(devices, &was_withheld) && devices.iter().all(is_valid) {
                return Ok(());
            }
        }
        Err(self.why_not(self.was_granted(devices, &was_withheld)))
    }

    /// Not valid since it was asked, and knowing where they are.
    fn was_granted(&self, devices: &[usize], was_withheld: &[bool]) -> bool {
        was_withheld.iter().all(|was| *was) && !devices.iter().any(|index| self.needs(*index))
    }

    fn why_not(&self, was_granted: bool) -> ZeroError {
        if let Err(commanded) = self.refuse_if_commanded() {
            return commanded;
        }
        if was_granted && self.frame.lease != 0 {
            return ZeroError::Unseen;
        }
        ZeroError::Refused("a device moved in that moment, or could not be read".into())
    }

    fn tell_what_is_left(&self) {
        let left: Vec<&str> = (0..self.names.len())
            .filter(|index| self.needs(*index))
            .map(|index| self.names[index].as_str())
            .collect();
        if !left.is_empty() {
            say(&format!("Still to be zeroed, and no force until then: {}", left.join(", ")));
        }
        if self.frame.state == DriverState::Fault as u64 {
            let why: Cow<'static, str> = FaultReason::sentence_for(self.frame.fault);
            say(&format!("The driver is in its fault state: {why}. Next: io-driver clear-fault"));
        }
    }
}

/// How it was and how it is.
fn told(name: &str, before: &DeviceFrame, after: &DeviceFrame) -> String {
    let tip = |device: &DeviceFrame| {
        let [x, y, z] = device.position_m_measured.map(|m| m * 1e3);
        format!("({x:.1}, {y:.1}, {z:.1}) mm")
    };
    let was = if before.flags & DEVICE_POSITION_VALID != 0 { tip(before) } else { "not known".into() };
    format!("{name}: zeroed at counts {}; its tip was {was}, and is {}", counts_of(after), tip(after))
}

/// The gimbal's only where there is one that counts.
fn counts_of(device: &DeviceFrame) -> String {
    let shown = if device.encoder_counts[3..] == [0; 3] { 3 } else { 6 };
    let words: Vec<String> = device.encoder_counts[..shown].iter().map(i64::to_string).collect();
    words.join(" ")
}

/// A line that is written over and over, for a person who looks.
struct LiveLine {
    is_seen: bool,
    shown: Option<Instant>,
}

impl LiveLine {
    fn new() -> Self {
        Self { is_seen: std::io::stderr().is_terminal(), shown: None }
    }

    fn show(&mut self, parts: impl Iterator<Item = String>) {
        let is_due = self.shown.is_none_or(|shown| shown.elapsed() > Duration::from_millis(100));
        if self.is_seen && is_due {
            self.shown = Some(Instant::now());
            let line = parts.collect::<Vec<_>>().join(" | ");
            let _ = write!(std::io::stderr(), "\r\u{1b}[K{line}");
        }
    }
}

impl Drop for LiveLine {
    fn drop(&mut self) {
        if self.shown.is_some() {
            let _ = writeln!(std::io::stderr());
        }
    }
}

fn say(text: &str) {
    print_line(text);
}
