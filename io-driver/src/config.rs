//! The driver's configuration file: which devices, how often, how safe, how punctual.
//!
//! Problem: a laboratory's start-up has to be reproducible from one file, and a mistake in it must be found
//! before anything is half-started.
//! Model: TOML. Relative paths are relative to the file. Everything but the devices has a default.
//! Units: in the names of the keys; SI.

mod toml_text;

use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use shm_abi::MAX_DEVICES;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::ClockMode;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml::Spanned;

/// What a driver is to do, validated.
#[derive(Debug, Clone, PartialEq)]
pub struct DriverConfig {
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// Which clock moves the ticks.
    pub clock: ClockMode,
    /// Where to listen; `None`: the usual place.
    pub socket: Option<PathBuf>,
    /// How punctual to be.
    pub real_time: RealTime,
    /// How to wait for replies.
    pub reply: ReplyConfig,
    /// How to be safe.
    pub safety: SafetyConfig,
    /// What the process may do.
    pub process: ProcessConfig,
    /// The devices, in the order of the frame.
    pub devices: Vec<DeviceConfig>,
}

/// What is asked of the operating system.
#[derive(Debug, Clone, PartialEq)]
pub struct RealTime {
    /// CPU of the loop; `None`: the last one, if there are several.
    pub cpu: Option<usize>,
    /// SCHED_FIFO priority of the loop; `None`: no real-time scheduling.
    pub priority: Option<u8>,
    /// Lock all memory.
    pub lock_memory: bool,
    /// Phase of the tick against whole periods of the clock (ns).
    pub phase_offset_ns: u64,
    /// How long before the deadline sleeping turns into spinning (ns).
    pub spin_margin_ns: u64,
    /// How to wait for replies; `None`: whatever suits what was obtained.
    pub wait: Option<WaitMode>,
}

/// When the motors are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyMode {
    /// As soon as the reply to this tick is there.
    OnArrival,
    /// At a fixed time after the tick began, so that the application's jitter stays out of the loop delay.
    FixedPhase,
    /// At once, with the reply to the tick before, as the thesis does.
    NextTick,
}

/// How to wait for replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReplyConfig {
    /// When the motors are written.
    pub mode: ReplyMode,
    /// How long after the tick's deadline a reply is still in time (ns).
    pub budget_ns: u64,
}

/// Ages and ramps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SafetyConfig {
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: u64,
    /// From no force to all of it for a new lease (ticks).
    pub ramp_in_ticks: u64,
    /// From all force to none once commands fail (ticks).
    pub ramp_out_ticks: u64,
}

/// What the process may do once it is set up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessConfig {
    /// Shut out all system calls that are not needed.
    pub sandbox: bool,
    /// Whom a driver that root started becomes: `NAME` or `UID`, with `:GROUP` if it is not the user's own.
    pub user: Option<String>,
}

impl Default for ProcessConfig {
    fn default() -> Self {
        Self { sandbox: true, user: None }
    }
}

/// One device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceConfig {
    /// Its name in reports.
    pub name: String,
    /// How it is reached.
    pub backend: Backend,
    /// Overrides the peak of its description (N).
    pub peak_force_n: Option<f64>,
}

/// How a device is reached.
#[derive(Debug, Clone, PartialEq)]
pub enum Backend {
    /// No mechanism: the scripted hand's position goes straight through.
    Ideal {
        /// The hand file and the finger in it.
        hand: Option<(PathBuf, String)>,
        /// Where the tip rests without a script, in the world W (m).
        start_m: Vector3<f64>,
        /// X_WD, where the base stands.
        base_in_world: Isometry3<f64>,
    },
    /// A recorded encoder trace through a described mechanism.
    Replay {
        /// The description: a built-in's name or a file.
        description: PathBuf,
        /// The trace.
        trace: PathBuf,
    },
}

/// Why there is no configuration.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {file}: {source}")]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something in it is wrong.
    #[error(transparent)]
    Wrong(#[from] TomlReport),
}

impl DriverConfig {
    /// Reads a file.
    ///
    /// # Errors
    /// Says which file, line and key, what was found and what is allowed.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| ConfigError::Unreadable { file: file.into(), source })?;
        Ok(Self::parse(&text, file)?)
    }

    /// Reads standard input, which a parent process may use instead of a file; paths in it are relative to
    /// the current directory.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_from_stdin() -> Result<Self, ConfigError> {
        let file = Path::new("<standard input>");
        let text = io::read_to_string(io::stdin())
            .map_err(|source| ConfigError::Unreadable { file: file.into(), source })?;
        Ok(Self::parse(&text, file)?)
    }

    /// Writes it down so that [`parse`](Self::parse) gives the same back.
    pub fn to_toml(&self) -> String {
        toml_text::write(self)
    }

    /// Reads a text; `file` is named in reports, and its directory resolves relative paths.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(text: &str, file: &Path) -> Result<Self, TomlReport> {
        let toml = TomlText::new(text, file);
        let raw: RawConfig = toml.read()?;
        let rate_hz = raw.rate_hz.as_ref().map_or(Ok(1000.0), |rate| toml.number(rate, RATE))?;
        let period_ns = period_of(rate_hz);
        let directory = file.parent().unwrap_or(Path::new("."));
        let reply = raw.reply.validate(&toml, period_ns)?;
        Ok(Self {
            period_ns,
            clock: match raw.clock.unwrap_or(RawClock::Real) {
                RawClock::Real => ClockMode::Real,
                RawClock::Lockstep => ClockMode::Lockstep,
            },
            socket: raw.socket.map(|path| directory.join(path)),
            real_time: raw.real_time.validate(&toml, period_ns, reply.budget_ns)?,
            reply,
            safety: raw.safety.validate(&toml, period_ns)?,
            process: raw.process.validate(),
            devices: devices(&raw.device, &toml, directory)?,
        })
    }
}

/// The whole number of nanoseconds nearest to a rate's period.
pub fn period_of(rate_hz: f64) -> u64 {
    (1e9 / rate_hz).round() as u64
}

/// The spin margin if nobody says. However the replies fail, a tick then sleeps for at least a quarter of
/// what the budget leaves: a loop that spun until the budget's end and from there on to the next deadline would
/// never sleep, and the kernel would throttle it (5 % of each second) and starve all else on its CPU.
pub fn usual_spin_margin_ns(period_ns: u64, budget_ns: u64) -> u64 {
    let rest_ns = period_ns.saturating_sub(budget_ns);
    rt_core::periodic::PeriodicConfig::hybrid(period_ns).spin_margin_ns.min(rest_ns / 4 * 3)
}

const RATE: Allowed = Allowed { min: 10.0, max: 20_000.0, unit: "Hz" };

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    rate_hz: Option<Spanned<f64>>,
    clock: Option<RawClock>,
    socket: Option<PathBuf>,
    #[serde(default)]
    real_time: RawRealTime,
    #[serde(default)]
    reply: RawReply,
    #[serde(default)]
    safety: RawSafety,
    #[serde(default)]
    process: RawProcess,
    device: Spanned<Vec<Spanned<RawDevice>>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawClock {
    Real,
    Lockstep,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawRealTime {
    cpu: Option<Spanned<i64>>,
    priority: Option<Spanned<i64>>,
    lock_memory: Option<bool>,
    phase_offset_us: Option<Spanned<f64>>,
    spin_margin_us: Option<Spanned<f64>>,
    wait: Option<RawWait>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawWait {
    Auto,
    Spin,
    Futex,
}

impl RawRealTime {
    fn validate(self, toml: &TomlText<'_>, period_ns: u64, budget_ns: u64) -> Result<RealTime, TomlReport> {
        let usual = rt_core::periodic::PeriodicConfig::hybrid(period_ns);
        let within_period = Allowed { min: 0.0, max: period_ns as f64 / 1e3, unit: "us" };
        let us = |key: &Option<Spanned<f64>>, default_ns: u64| match key {
            Some(number) => toml.number(number, within_period).map(ns_of_us),
            None => Ok(default_ns),
        };
        let phase_offset_ns = us(&self.phase_offset_us, usual.phase_offset_ns % period_ns)?;
        let spin_margin_ns = us(&self.spin_margin_us, usual_spin_margin_ns(period_ns, budget_ns))?;
        let cpu = self.cpu.map(|cpu| toml.integer(&cpu, 0..=4095)).transpose()?;
        // 0 switches real-time scheduling off; 99 is left to the kernel's own threads.
        let priority =
            self.priority.map(|priority| toml.integer(&priority, 0..=98)).transpose()?.unwrap_or(80);
        Ok(RealTime {
            cpu: cpu.map(|cpu| cpu as usize),
            priority: (priority > 0).then_some(priority as u8),
            lock_memory: self.lock_memory.unwrap_or(true),
            phase_offset_ns,
            spin_margin_ns,
            wait: match self.wait.unwrap_or(RawWait::Auto) {
                RawWait::Auto => None,
                RawWait::Spin => Some(WaitMode::Spin),
                RawWait::Futex => Some(WaitMode::Futex),
            },
        })
    }
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawReply {
    mode: Option<RawReplyMode>,
    budget_us: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawReplyMode {
    SameTick,
    FixedPhase,
    NextTick,
}

impl RawReply {
    fn validate(self, toml: &TomlText<'_>, period_ns: u64) -> Result<ReplyConfig, TomlReport> {
        let within_period = Allowed { min: 1.0, max: 0.9 * period_ns as f64 / 1e3, unit: "us" };
        let budget_ns = match self.budget_us {
            Some(number) => ns_of_us(toml.number(&number, within_period)?),
            None => period_ns / 2,
        };
        let mode = match self.mode.unwrap_or(RawReplyMode::SameTick) {
            RawReplyMode::SameTick => ReplyMode::OnArrival,
            RawReplyMode::FixedPhase => ReplyMode::FixedPhase,
            RawReplyMode::NextTick => ReplyMode::NextTick,
        };
        Ok(ReplyConfig { mode, budget_ns })
    }
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawSafety {
    max_command_age_ticks: Option<Spanned<i64>>,
    ramp_in_ms: Option<Spanned<f64>>,
    ramp_out_ms: Option<Spanned<f64>>,
}

impl RawSafety {
    fn validate(self, toml: &TomlText<'_>, period_ns: u64) -> Result<SafetyConfig, TomlReport> {
        let ticks = |key: &Option<Spanned<f64>>, default_ms: f64, max: f64| {
            let ms = key
                .as_ref()
                .map_or(Ok(default_ms), |ms| toml.number(ms, Allowed { min: 0.0, max, unit: "ms" }))?;
            Ok::<u64, TomlReport>(((ms * 1e6 / period_ns as f64).round() as u64).max(1))
        };
        let age = self.max_command_age_ticks.map(|age| toml.integer(&age, 0..=100)).transpose()?;
        Ok(SafetyConfig {
            max_command_age_ticks: age.map_or(5, |age| age as u64),
            ramp_in_ticks: ticks(&self.ramp_in_ms, 200.0, 10_000.0)?,
            ramp_out_ticks: ticks(&self.ramp_out_ms, 10.0, 1000.0)?,
        })
    }
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawProcess {
    sandbox: Option<bool>,
    user: Option<String>,
}

impl RawProcess {
    /// Whether there is such a user is found out at the start, on the machine that it starts on.
    fn validate(self) -> ProcessConfig {
        let usual = ProcessConfig::default();
        ProcessConfig { sandbox: self.sandbox.unwrap_or(usual.sandbox), user: self.user }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDevice {
    name: Option<Spanned<String>>,
    backend: Spanned<RawBackend>,
    description: Option<Spanned<PathBuf>>,
    trace: Option<Spanned<PathBuf>>,
    hand: Option<Spanned<PathBuf>>,
    finger: Option<Spanned<String>>,
    start_m: Option<SpannedList>,
    base_position_m: Option<SpannedList>,
    base_orientation_wxyz: Option<SpannedList>,
    peak_force_n: Option<Spanned<f64>>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
enum RawBackend {
    Ideal,
    Replay,
}

fn devices(
    raw: &Spanned<Vec<Spanned<RawDevice>>>,
    toml: &TomlText<'_>,
    directory: &Path,
) -> Result<Vec<DeviceConfig>, TomlReport> {
    let list = raw.get_ref();
    if list.is_empty() || list.len() > MAX_DEVICES {
        let allowed = format!("1 to {MAX_DEVICES}");
        return Err(toml.refuse(raw.span(), format_args!("{} devices", list.len()), allowed));
    }
    let mut devices: Vec<DeviceConfig> = Vec::with_capacity(list.len());
    for (index, item) in list.iter().enumerate() {
        let device = item.get_ref().validate(index, item.span(), toml, directory)?;
        if devices.iter().any(|other| other.name == device.name) {
            let span = item.get_ref().name.as_ref().map_or(item.span(), Spanned::span);
            return Err(toml.refuse(
                span,
                format_args!("the name \"{}\" twice", device.name),
                "each name once",
            ));
        }
        devices.push(device);
    }
    Ok(devices)
}

impl RawDevice {
    fn validate(
        &self,
        index: usize,
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<DeviceConfig, TomlReport> {
        let name = self.name.as_ref().map_or_else(|| format!("f{index}"), |name| name.get_ref().clone());
        let backend = match self.backend.get_ref() {
            RawBackend::Ideal => self.ideal(&name, toml, directory)?,
            RawBackend::Replay => self.replay(span, toml, directory)?,
        };
        let peak_force_n = self.peak_force_n.as_ref().map(|peak| toml.number(peak, PEAK)).transpose()?;
        Ok(DeviceConfig { name, backend, peak_force_n })
    }

    fn ideal(&self, name: &str, toml: &TomlText<'_>, directory: &Path) -> Result<Backend, TomlReport> {
        self.refuse_foreign(
            "ideal",
            &[("description", span_of(&self.description)), ("trace", span_of(&self.trace))],
            toml,
        )?;
        let finger = self.finger.as_ref().map_or_else(|| name.to_owned(), |finger| finger.get_ref().clone());
        let start = self.start_m.as_ref().map_or(Ok([0.0; 3]), |list| toml.numbers(list, PLACE))?;
        Ok(Backend::Ideal {
            hand: self.hand.as_ref().map(|hand| (directory.join(hand.get_ref()), finger)),
            start_m: Vector3::from(start),
            base_in_world: self.base(toml)?,
        })
    }

    fn replay(
        &self,
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<Backend, TomlReport> {
        let foreign = [
            ("hand", span_of(&self.hand)),
            ("finger", span_of(&self.finger)),
            ("start_m", span_of(&self.start_m)),
            ("base_position_m", span_of(&self.base_position_m)),
            ("base_orientation_wxyz", span_of(&self.base_orientation_wxyz)),
        ];
        self.refuse_foreign("replay", &foreign, toml)?;
        let needed = |key: &Option<Spanned<PathBuf>>, name: &str| {
            key.as_ref().map(|path| path.get_ref().clone()).ok_or_else(|| {
                let found = format!("no key `{name}` in a replay device");
                toml.refuse(span.clone(), found, format_args!("`{name} = \"FILE\"`"))
            })
        };
        let description = needed(&self.description, "description")?;
        let description = match crate::device_file::builtin(&description.to_string_lossy()) {
            Some(_) => description,
            None => directory.join(description),
        };
        Ok(Backend::Replay { description, trace: directory.join(needed(&self.trace, "trace")?) })
    }

    fn refuse_foreign(
        &self,
        backend: &str,
        keys: &[(&str, Option<std::ops::Range<usize>>)],
        toml: &TomlText<'_>,
    ) -> Result<(), TomlReport> {
        match keys.iter().find_map(|(key, span)| span.clone().map(|span| (*key, span))) {
            Some((key, span)) => Err(toml.refuse(
                span,
                format_args!("`{key}` in a device of backend \"{backend}\""),
                "not there",
            )),
            None => Ok(()),
        }
    }

    fn base(&self, toml: &TomlText<'_>) -> Result<Isometry3<f64>, TomlReport> {
        let position =
            self.base_position_m.as_ref().map_or(Ok([0.0; 3]), |list| toml.numbers(list, PLACE))?;
        let rotation = match &self.base_orientation_wxyz {
            None => UnitQuaternion::identity(),
            Some(list) => {
                let [w, x, y, z] = toml.numbers(list, QUATERNION)?;
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).ok_or_else(|| {
                    toml.refuse(list.span(), "a quaternion of no length", "w, x, y, z of a rotation")
                })?
            }
        };
        Ok(Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation))
    }
}

fn span_of<T>(key: &Option<Spanned<T>>) -> Option<std::ops::Range<usize>> {
    key.as_ref().map(Spanned::span)
}

fn ns_of_us(us: f64) -> u64 {
    (us * 1e3).round() as u64
}

const PLACE: Allowed = Allowed { min: -100.0, max: 100.0, unit: "m" };
const QUATERNION: Allowed = Allowed { min: -2.0, max: 2.0, unit: "(w, x, y, z)" };
const PEAK: Allowed = Allowed { min: 0.0, max: 1000.0, unit: "N" };

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<DriverConfig, String> {
        DriverConfig::parse(text, Path::new("lab/driver.toml")).map_err(|report| report.to_string())
    }

    #[test]
    fn a_device_is_enough() {
        let config = parse("[[device]]\nbackend = \"ideal\"\n").expect("the defaults");
        assert_eq!(config.period_ns, 1_000_000);
        assert_eq!(config.clock, ClockMode::Real);
        assert_eq!(config.reply, ReplyConfig { mode: ReplyMode::OnArrival, budget_ns: 500_000 });
        let SafetyConfig { max_command_age_ticks, ramp_in_ticks, ramp_out_ticks } = config.safety;
        assert_eq!((max_command_age_ticks, ramp_in_ticks, ramp_out_ticks), (5, 200, 10));
        assert_eq!(config.devices[0].name, "f0");
    }

    #[test]
    fn paths_are_relative_to_the_file_and_built_in_descriptions_are_names() {
        let config = parse(
            "[[device]]\nbackend = \"ideal\"\nhand = \"h.csv\"\n\
             [[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"t.csv\"\n",
        )
        .expect("good");
        let Backend::Ideal { hand: Some((path, finger)), .. } = &config.devices[0].backend else { panic!() };
        assert_eq!((path.as_path(), finger.as_str()), (Path::new("lab/h.csv"), "f0"));
        let Backend::Replay { description, trace } = &config.devices[1].backend else { panic!() };
        assert_eq!(
            (description.as_path(), trace.as_path()),
            (Path::new("premium-1.5"), Path::new("lab/t.csv"))
        );
    }

    #[test]
    fn each_mistake_names_file_line_key_found_and_allowed() {
        let cases = [
            (
                "rate_hz = 5\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:1: `rate_hz`: found 5, allowed: 10 to 20000 Hz",
            ),
            (
                "rate_hz = nan\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:1: `rate_hz`: found NaN, allowed: 10 to 20000 Hz",
            ),
            ("device = []", "lab/driver.toml:1: `device`: found 0 devices, allowed: 1 to 8"),
            (
                "[[device]]\nbackend = \"replay\"\ntrace = \"t\"",
                "lab/driver.toml:1: `device[0]`: found no key `description` in a replay device, allowed: `description = \"FILE\"`",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\ntrace = \"t\"",
                "lab/driver.toml:3: `device[0].trace`: found `trace` in a device of backend \"ideal\", allowed: not there",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\nname = \"a\"\n[[device]]\nbackend = \"ideal\"\nname = \"a\"",
                "lab/driver.toml:6: `device[1].name`: found the name \"a\" twice, allowed: each name once",
            ),
            (
                "[reply]\nbudget_us = 1000\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `reply.budget_us`: found 1000, allowed: 1 to 900 us",
            ),
            (
                "[real_time]\npriority = 99\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `real_time.priority`: found 99, allowed: a whole number from 0 to 98",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(parse(text).expect_err(text), expected);
        }
    }

    #[test]
    fn nine_devices_are_too_many_and_unknown_keys_are_refused() {
        let nine = "[[device]]\nbackend = \"ideal\"\n".repeat(9);
        assert!(parse(&nine).expect_err("nine").contains("found 9 devices, allowed: 1 to 8"));
        let unknown = parse("rate = 5\n[[device]]\nbackend = \"ideal\"").expect_err("unknown");
        assert!(unknown.starts_with("lab/driver.toml:1: `rate`: unknown field `rate`"), "{unknown}");
    }

    #[test]
    fn what_is_written_down_is_read_back_the_same() {
        let text = "rate_hz = 3000\nclock = \"lockstep\"\nsocket = \"/run/x\"\n\
            [real_time]\ncpu = 1\npriority = 0\nlock_memory = false\nphase_offset_us = 12.345\nwait = \"spin\"\n\
            [reply]\nmode = \"next-tick\"\nbudget_us = 99.5\n\
            [safety]\nmax_command_age_ticks = 7\nramp_in_ms = 33.3\nramp_out_ms = 4\n\
            [process]\nsandbox = false\nuser = \"lab:audio\"\n\
            [[device]]\nname = \"a \\\"quoted\\\" name\"\nbackend = \"ideal\"\nhand = \"/h.csv\"\nfinger = \"thumb\"\n\
            start_m = [0.1, -0.2, 1e-9]\nbase_position_m = [1, 2, 3]\nbase_orientation_wxyz = [0.6, 0.8, 0, 0]\n\
            peak_force_n = 8.5\n\
            [[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"/t.csv\"\n";
        let config = parse(text).expect("good");
        assert_eq!(parse(&config.to_toml()).expect("good as well"), config);
        let plain = parse("[[device]]\nbackend = \"ideal\"\n").expect("good");
        assert_eq!(parse(&plain.to_toml()).expect("good as well"), plain);
    }
}
