//! The driver's configuration file: which devices, how often, how safe, how punctual.
//!
//! Problem: a laboratory's start-up has to be reproducible from one file, and a mistake in it must be found
//! before anything is half-started.
//! Model: TOML. Relative paths are relative to the file. Everything but the devices has a default.
//! Units: in the names of the keys; SI.

mod access;
mod device;
mod process;
mod real_time;
mod reply;
mod safety;
mod toml_text;
mod zeroing;

pub use access::AccessConfig;
pub use device::{Backend, DeviceConfig, HandChoice, HandSource, Wish};
pub use process::ProcessConfig;
pub use real_time::{OverrunPolicy, RealTime, SpinMargin, longest_spin_margin_ns};
pub use reply::{ReplyConfig, ReplyMode};
pub use safety::{Commissioning, SafetyConfig};
pub use zeroing::Zeroing;

use crate::toml_report::{Allowed, MAX_TOML_BYTES, TomlReport, TomlText};
use device::RawDevice;
use process::RawProcess;
use real_time::RawRealTime;
use reply::RawReply;
use rt_core::input_file;
use safety::RawSafety;
use serde::Deserialize;
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
    /// Who may do what.
    pub access: AccessConfig,
    /// The devices, in the order of the frame.
    pub devices: Vec<DeviceConfig>,
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
        let text = input_file::read_text(file, MAX_TOML_BYTES)
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
        let text = input_file::read_all(io::stdin(), MAX_TOML_BYTES)
            .and_then(input_file::text)
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
        let devices = device::devices(&raw.device, &toml, directory)?;
        refuse_slow_registers(raw.rate_hz.as_ref(), &devices, &toml)?;
        Ok(Self {
            period_ns,
            clock: clock(raw.clock.as_ref(), &devices, &toml)?,
            socket: raw.socket.map(|path| directory.join(path)),
            real_time: raw.real_time.validate(&toml, period_ns, reply.budget_ns)?,
            reply,
            safety: raw.safety.validate(&toml, period_ns, &devices)?,
            process: raw.process.validate(&toml)?,
            access: raw.access,
            devices,
        })
    }
}

/// The whole number of nanoseconds nearest to a rate's period.
pub fn period_of(rate_hz: f64) -> u64 {
    (1e9 / rate_hz).round() as u64
}

/// Of two milliseconds a tick: with the age of a command and the ramp, well within what a hand may bear.
const LEAST_RATE_OF_REGISTERS_HZ: f64 = 500.0;

const RATE: Allowed = Allowed { min: 10.0, max: 20_000.0, unit: "Hz" };

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    rate_hz: Option<Spanned<f64>>,
    clock: Option<Spanned<RawClock>>,
    socket: Option<PathBuf>,
    #[serde(default)]
    real_time: RawRealTime,
    #[serde(default)]
    reply: RawReply,
    #[serde(default)]
    safety: RawSafety,
    #[serde(default)]
    process: RawProcess,
    #[serde(default)]
    access: AccessConfig,
    device: Spanned<Vec<Spanned<RawDevice>>>,
}

/// Motors hold what was written until the next tick: in a slow one a command would outlive its age.
fn refuse_slow_registers(
    rate: Option<&Spanned<f64>>,
    devices: &[DeviceConfig],
    toml: &TomlText<'_>,
) -> Result<(), TomlReport> {
    let Some(rate) = rate.filter(|rate| *rate.get_ref() < LEAST_RATE_OF_REGISTERS_HZ) else { return Ok(()) };
    let Some(device) = devices.iter().find(|device| device.backend.has_registers()) else { return Ok(()) };
    Err(toml.refuse(
        rate.span(),
        format_args!("{} Hz with device \"{}\", which has registers", rate.get_ref(), device.name),
        "500 to 20000 Hz: motors hold their force until the next tick",
    ))
}

/// Where ticks are as short as two programs make them, seconds of ramps and guards would be over in a moment.
fn clock(
    raw: Option<&Spanned<RawClock>>,
    devices: &[DeviceConfig],
    toml: &TomlText<'_>,
) -> Result<ClockMode, TomlReport> {
    let Some(clock) = raw.filter(|clock| matches!(clock.get_ref(), RawClock::Lockstep)) else {
        return Ok(ClockMode::Real);
    };
    match devices.iter().find(|device| device.backend.has_registers()) {
        None => Ok(ClockMode::Lockstep),
        Some(device) => Err(toml.refuse(
            clock.span(),
            format_args!("\"lockstep\" with device \"{}\", which has registers", device.name),
            "\"real\": motors know no other time; lockstep is for ideal and simulated devices and for traces",
        )),
    }
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
enum RawClock {
    Real,
    Lockstep,
}

fn ns_of_us(us: f64) -> u64 {
    (us * 1e3).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Quaternion, UnitQuaternion};

    fn parse(text: &str) -> Result<DriverConfig, String> {
        DriverConfig::parse(text, Path::new("lab/driver.toml")).map_err(|report| report.to_string())
    }

    #[test]
    fn the_fastest_that_can_be_configured_is_the_fastest_that_is_believed() {
        let fastest = format!("rate_hz = {}\n[[device]]\nbackend = \"ideal\"\n", RATE.max);
        let config = parse(&fastest).expect("the fastest");
        assert_eq!(config.period_ns, shm_abi::segment::SHORTEST_PERIOD_NS);
    }

    #[test]
    fn a_device_is_enough() {
        let config = parse("[[device]]\nbackend = \"ideal\"\n").expect("the defaults");
        assert_eq!(config.period_ns, 1_000_000);
        assert_eq!(config.clock, ClockMode::Real);
        assert_eq!(config.reply, ReplyConfig { mode: ReplyMode::OnArrival, budget_ns: 500_000 });
        assert_eq!(config.safety, SafetyConfig::usual(1_000_000));
        let SafetyConfig { max_command_age_ns, ramp_in_ns, ramp_out_ns, .. } = config.safety;
        assert_eq!((max_command_age_ns, ramp_in_ns, ramp_out_ns), (4_000_000, 200_000_000, 5_000_000));
        assert_eq!(config.real_time.spin_margin, SpinMargin::Calibrated { at_most_ns: 200_000 });
        assert_eq!(config.devices[0].name, "f0");
    }

    #[test]
    fn paths_are_relative_to_the_file_and_built_in_descriptions_are_names() {
        let config = parse(
            "[[device]]\nbackend = \"ideal\"\nhand = \"h.csv\"\n\
             [[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"t.csv\"\n",
        )
        .expect("good");
        let Backend::Ideal(Wish { hand: HandSource::Script { file: path, finger }, .. }) =
            &config.devices[0].backend
        else {
            panic!()
        };
        assert_eq!((path.as_path(), finger.as_str()), (Path::new("lab/h.csv"), "f0"));
        let Backend::Replay { description, trace, .. } = &config.devices[1].backend else { panic!() };
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
            (
                "[safety]\ndead_man = { device = \"f0\", button = 0, normally_closed = true }\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `safety.dead_man.normally_closed`: found true, allowed: false: held has to close the circuit, or a cut wire would hold it",
            ),
            (
                "rate_hz = 1000\n[device]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `device`: found a single table, as `[device]` makes it, allowed: a list of tables, each under its own [[device]]: write it with two brackets, even if there is only one",
            ),
            (
                "socket = /run/x\n[[device]]\nbackend = ideal",
                "lab/driver.toml:1: `socket`: found /run/x without quotes; text stands in quotes, as in \"/run/x\"",
            ),
            (
                "[[device]]\nbackend = ideal",
                "lab/driver.toml:2: `device[0].backend`: found ideal without quotes; text stands in quotes, as in \"ideal\"",
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
                "[[device]]\nbackend = \"ideal\"\nfinger = \"f9\"",
                "lab/driver.toml:3: `device[0].finger`: found `finger` without `hand`, allowed: both, or `start_m`",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\nhand = \"h.csv\"\nlive_hand = \"h\"",
                "lab/driver.toml:4: `device[0].live_hand`: found `live_hand` beside `hand`, allowed: one of the two",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\nlive_finger = 1",
                "lab/driver.toml:3: `device[0].live_finger`: found `live_finger` without `live_hand`, allowed: both",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\nlive_hand = \"h\"\nlive_finger = 8",
                "lab/driver.toml:4: `device[0].live_finger`: found 8, allowed: a whole number from 0 to 7",
            ),
            (
                "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\nhand_model = \"nobody\"\nfirmness = \"firm\"",
                "lab/driver.toml:5: `device[0].firmness`: found `firmness` of a hand that is nobody's, allowed: not there",
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
            (
                "[safety]\ndead_man = { device = \"foot\", button = 0 }\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `safety.dead_man.device`: found no device \"foot\", allowed: f0",
            ),
            (
                "[safety]\nemergency_stop = { device = \"f0\", button = 32 }\n[[device]]\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"c\"",
                "lab/driver.toml:2: `safety.emergency_stop.button`: found 32, allowed: a whole number from 0 to 31",
            ),
            (
                "[safety]\nemergency_stop = { device = \"f0\", button = 0 }\n[[device]]\nbackend = \"ideal\"",
                "lab/driver.toml:2: `safety.emergency_stop.device`: found device \"f0\", which has no buttons, allowed: a device with the switch on its card, or a script with a column of buttons",
            ),
            (
                "clock = \"lockstep\"\n[[device]]\nbackend = \"ideal\"\n[[device]]\nname = \"arm\"\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"c\"",
                "lab/driver.toml:1: `clock`: found \"lockstep\" with device \"arm\", which has registers, allowed: \"real\": motors know no other time; lockstep is for ideal and simulated devices and for traces",
            ),
            (
                "rate_hz = 499\n[[device]]\nbackend = \"ideal\"\n[[device]]\nname = \"arm\"\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"c\"",
                "lab/driver.toml:1: `rate_hz`: found 499 Hz with device \"arm\", which has registers, allowed: 500 to 20000 Hz: motors hold their force until the next tick",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\nslew_n_per_s = 2e4",
                "lab/driver.toml:3: `device[0].slew_n_per_s`: found 20000, allowed: 10 to 10000 N/s",
            ),
            (
                "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\nslew_n_per_s = inf",
                "lab/driver.toml:4: `device[0].slew_n_per_s`: found inf, allowed: 10 to 10000 N/s",
            ),
            (
                "[[device]]\nbackend = \"emulated\"\ndescription = \"premium-1.5\"",
                "lab/driver.toml:1: `device[0]`: found no key `card` in an emulated device, allowed: `card = \"FILE\"`",
            ),
            (
                "[[device]]\nbackend = \"ideal\"\ngravity_compensation = true",
                "lab/driver.toml:3: `device[0].gravity_compensation`: found `gravity_compensation` in a device of backend \"ideal\", allowed: not there",
            ),
            (
                "[[device]]\nbackend = \"replay\"\nbase_position_m = [0, 0, 0.1]",
                "lab/driver.toml:3: `device[0].base_position_m`: found `base_position_m` in a device of backend \"replay\", allowed: `base_orientation_wxyz` alone, by which its weight pulls; where it stands is a layout's matter",
            ),
            (
                "[[device]]\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"c\"\nbase_orientation_wxyz = [0, 0, 0, 0]",
                "lab/driver.toml:5: `device[0].base_orientation_wxyz`: found a quaternion of length 0.000, allowed: w, x, y, z of a rotation, whose squares add up to 1",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(parse(text).expect_err(text), expected);
        }
    }

    #[test]
    fn ages_and_ramps_are_bounded_as_times_at_every_rate() {
        let safety = |rate_hz: u64, line: &str| {
            parse(&format!("rate_hz = {rate_hz}\n[safety]\n{line}\n[[device]]\nbackend = \"ideal\"\n"))
                .map(|config| config.safety)
        };
        let twenty = "found 21 ticks of 1 ms, allowed: 0 to 20 ticks at this rate, which is 20 ms";
        let refused = [
            (
                10,
                "max_command_age_ticks = 1",
                "found 1 ticks of 100 ms, allowed: 0 to 0 ticks at this rate, which is 20 ms",
            ),
            (1000, "max_command_age_ticks = 21", twenty),
            (1000, "max_command_age_ticks = -1", &twenty.replace("found 21", "found -1")),
            (1000, "max_command_age_ms = 20.1", "found 20.1, allowed: 0 to 20 ms"),
            (
                1000,
                "max_command_age_ms = 1\nmax_command_age_ticks = 1",
                "found `max_command_age_ticks` beside `max_command_age_ms`, allowed: one of the two",
            ),
            (1000, "ramp_in_ms = 0", "found 0, allowed: 20 to 10000 ms"),
            (1000, "ramp_in_ms = 10001", "found 10001, allowed: 20 to 10000 ms"),
            (1000, "ramp_out_ms = 50.5", "found 50.5, allowed: 0 to 50 ms"),
        ];
        for (rate_hz, line, words) in refused {
            let said = safety(rate_hz, line).expect_err(line);
            assert!(said.starts_with("lab/driver.toml:") && said.ends_with(words), "{said}");
        }
        let times = |rate_hz, line| {
            let SafetyConfig { max_command_age_ns, ramp_in_ns, ramp_out_ns, .. } =
                safety(rate_hz, line).unwrap();
            (max_command_age_ns, ramp_in_ns, ramp_out_ns)
        };
        assert_eq!(times(2000, "max_command_age_ticks = 40").0, 20_000_000);
        assert_eq!(times(1000, "max_command_age_ms = 2.5").0, 2_500_000);
        // Ramps take whole ticks: in no fewer than asked for, out no more, and one at least.
        let of_ramps = "ramp_in_ms = 25\nramp_out_ms = 7";
        assert_eq!(times(250, of_ramps), (4_000_000, 28_000_000, 4_000_000));
        assert_eq!(times(10, "ramp_out_ms = 0"), (4_000_000, 200_000_000, 100_000_000));
        // A third of a millisecond, rounded to a nanosecond: fifteen ticks all the same.
        assert_eq!(times(3000, "").2, 15 * 333_333);
    }

    #[test]
    fn nine_devices_are_too_many_and_unknown_keys_are_refused() {
        let nine = "[[device]]\nbackend = \"ideal\"\n".repeat(9);
        assert!(parse(&nine).expect_err("nine").contains("found 9 devices, allowed: 1 to 8"));
        let unknown = parse("rate = 5\n[[device]]\nbackend = \"ideal\"").expect_err("unknown");
        assert!(unknown.starts_with("lab/driver.toml:1: `rate`: unknown field `rate`"), "{unknown}");
    }

    /// `run --commissioning`, as the safety page says, with a file that asks for less than usual.
    #[test]
    fn a_trial_that_the_command_line_asks_for_is_as_weak_and_slow_as_the_file_says() {
        let limits = "commissioning_force_n = 0.1\ncommissioning_speed_m_per_s = 0.05";
        let text = |safety: &str| ["[safety]\n", safety, "\n[[device]]\nbackend = \"ideal\"\n"].concat();
        let mut config = parse(&text(limits)).expect("good");
        assert_eq!(config.safety.commissioning, None);
        assert_eq!(parse(&config.to_toml()).expect("good as well"), config);
        config.safety.begin_trial();
        let expected = Commissioning { force_n: 0.1, speed_m_per_s: 0.05 };
        assert_eq!(config.safety.commissioning, Some(expected));
        let both = parse(&text(&["commissioning = true\n", limits].concat())).expect("good");
        assert_eq!(both.safety, config.safety);
        let mut usual = parse(&text("")).expect("good");
        usual.safety.begin_trial();
        assert_eq!(usual.safety.commissioning, Some(Commissioning::USUAL));
    }

    #[test]
    fn what_is_written_down_is_read_back_the_same() {
        let text = "rate_hz = 3000\nsocket = \"/run/x\"\n\
            [real_time]\ncpu = 1\npriority = 0\nlock_memory = false\nphase_offset_us = 12.345\nwait = \"spin\"\n\
            overruns = { policy = \"catch-up\", ticks = 3 }\n\
            [reply]\nmode = \"next-tick\"\nbudget_us = 99.5\n\
            [safety]\nmax_command_age_ms = 7.1\nramp_in_ms = 33.3\nramp_out_ms = 4\n\
            workspace_margin_mm = 12.5\ncommissioning = true\ncommissioning_force_n = 0.4\n\
            emergency_stop = { device = \"b\", button = 3, normally_closed = true }\n\
            dead_man = { device = \"b\", button = 0 }\n\
            [[device]]\nname = \"a \\\"quoted\\\" name\"\nbackend = \"ideal\"\nhand = \"/h.csv\"\nfinger = \"thumb\"\n\
            start_m = [0.1, -0.2, 1e-9]\nbase_position_m = [1, 2, 3]\nbase_orientation_wxyz = [0.6, 0.8, 0, 0]\n\
            peak_force_n = 8.5\nslew_n_per_s = inf\n\
            [[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"/t.csv\"\nslew_n_per_s = 400\n\
            [[device]]\nname = \"b\"\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"/c\"\ngravity_compensation = true\n\
            base_orientation_wxyz = [0.892399101, -0.099045761, 0.239117618, -0.369643811]\n";
        let config = parse(text).expect("good");
        assert_eq!(parse(&config.to_toml()).expect("good as well"), config);
        let plain = parse("clock = \"lockstep\"\n[[device]]\nbackend = \"ideal\"\n").expect("good");
        assert_eq!(plain.clock, ClockMode::Lockstep);
        assert_eq!(parse(&plain.to_toml()).expect("good as well"), plain);
    }

    #[test]
    fn the_longest_and_shortest_times_of_every_rate_are_read_back_the_same() {
        let extreme = "[safety]\nmax_command_age_ms = 20\nramp_in_ms = 20\nramp_out_ms = 50";
        for rate_hz in (10..=120).chain([524, 700, 999, 1000, 3000, 6000, 7777, 10_000]) {
            let most_ticks = rate_hz * 20 / 1000;
            let by_ticks = format!("[safety]\nmax_command_age_ticks = {most_ticks}\nramp_in_ms = 10000");
            for safety in ["", extreme, &by_ticks] {
                let text = format!("rate_hz = {rate_hz}\n{safety}\n[[device]]\nbackend = \"ideal\"\n");
                let config = parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
                assert_eq!(parse(&config.to_toml()).as_ref(), Ok(&config), "{text}");
                // What a hand does not hold in less: a thousandth of a tick is the period's own rounding.
                let least_ns = 20e6 - 1e-3 * config.period_ns as f64;
                assert!(config.safety.ramp_in_ns as f64 >= least_ns, "{text}");
            }
        }
    }

    #[test]
    fn a_live_hand_has_the_devices_own_finger_unless_told_and_is_read_back_the_same() {
        let live = "[[device]]\nbackend = \"ideal\"\n[[device]]\nbackend = \"ideal\"\nlive_hand = \"h\"\n";
        for (more, number) in [("", 1), ("live_finger = 7\n", 7)] {
            let config = parse(&format!("{live}{more}")).expect("good");
            let hand = &config.devices[1].backend.wish().expect("an ideal device has one").hand;
            assert_eq!(*hand, HandSource::Live { file: "lab/h".into(), finger: number });
            let written = config.to_toml().replace("\"lab/h\"", "\"h\"");
            assert_eq!(parse(&written).expect("good as well"), config);
        }
    }

    #[test]
    fn an_arm_with_counters_may_lean_and_stands_upright_unless_told() {
        let arm = |backend: &str, more: &str| {
            let text = format!(
                "[[device]]\nbackend = \"{backend}\"\ndescription = \"premium-1.5\"\n\
                 {}\n{more}\n",
                match backend {
                    "replay" => "trace = \"t.csv\"",
                    "emulated" => "card = \"c\"",
                    _ => "",
                }
            );
            parse(&text).map(|config| config.devices[0].backend.base_orientation())
        };
        let leaning = UnitQuaternion::new_normalize(Quaternion::new(0.6, 0.0, 0.0, 0.8));
        for backend in ["replay", "emulated", "simulated"] {
            assert_eq!(arm(backend, ""), Ok(UnitQuaternion::identity()), "{backend}");
            let told = arm(backend, "base_orientation_wxyz = [0.6, 0, 0, 0.8]").expect("allowed");
            // Lengths of (0.6, 0.8) to a rounding.
            assert!(told.angle_to(&leaning) < 1e-15, "{backend}");
            // Degrees, another order, a digit too few: never what an arm should be held up by.
            let wrong = arm(backend, "base_orientation_wxyz = [0.6, 0, 0, 0.6]").expect_err("refused");
            assert!(wrong.contains("found a quaternion of length 0.849"), "{wrong}");
        }
    }

    #[test]
    fn an_orientation_that_was_written_down_is_read_back_bit_for_bit() {
        for step in 0..200 {
            let t = 0.031 * f64::from(step);
            let [w, x, y, z] =
                [t.cos(), t.sin() * 0.6, t.sin() * 0.64, t.sin() * 0.48].map(|n| (n * 1e6).round() / 1e6);
            let text = format!(
                "[[device]]\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"/c\"\n\
                 base_orientation_wxyz = [{w:?}, {x:?}, {y:?}, {z:?}]\n"
            );
            let config = parse(&text).expect("six digits are enough");
            assert_eq!(parse(&config.to_toml()).expect("good as well"), config, "{step}");
        }
    }
}
