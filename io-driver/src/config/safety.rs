//! `[safety]`: ages, ramps, switches, commissioning.
//!
//! Ages and ramps are times, whatever the rate, and bounded as such. The usual ones let a force stay for less than 10 ms
//! after the last reply at 1 kHz: 4 ms held, 5 ms ramped out, and half a millisecond of waiting for a reply that does
//! not come. A ramp takes whole ticks, so that it ends in one: in by no fewer than asked for, out by no more.

use super::DeviceConfig;
use crate::safety::switches::{Switch, Switches};
use crate::toml_report::{Allowed, TomlReport, TomlText};
use serde::Deserialize;
use toml::Spanned;

/// Ages, ramps, switches, and whether somebody is trying the device for the first time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyConfig {
    /// How old a command may be that still drives the motors (ns).
    pub max_command_age_ns: u64,
    /// From no force to all of it for a new lease (ns); whole ticks.
    pub ramp_in_ns: u64,
    /// From all force to none once commands fail (ns); whole ticks.
    pub ramp_out_ns: u64,
    /// Beyond its workspace a device's force fades out over this distance (m).
    pub workspace_margin_m: f64,
    /// Emergency stop and dead-man's switch.
    pub switches: Switches,
    /// Little force and little speed, if somebody tries the devices for the first time.
    pub commissioning: Option<Commissioning>,
    /// Limits of a first trial, whoever asks for one.
    pub(crate) trial: Commissioning,
}

/// Limits of the first trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commissioning {
    /// No more force than this on any device (N).
    pub force_n: f64,
    /// A fault above this speed (m/s).
    pub speed_m_per_s: f64,
}

impl Commissioning {
    /// A force that a finger holds easily, and a speed from which 100 g are stopped by a touch.
    pub const USUAL: Self = Self { force_n: 0.5, speed_m_per_s: 0.25 };
}

impl SafetyConfig {
    /// `max_command_age_ms`, `ramp_in_ms` and `ramp_out_ms` that are read back as these: a ramp of whole ticks may be
    /// longer than what may be asked for.
    pub(super) fn times_ms(&self) -> [f64; 3] {
        let ms = |ns: u64, Allowed { min, max, .. }: Allowed| (ns as f64 / 1e6).clamp(min, max);
        [ms(self.max_command_age_ns, AGE), ms(self.ramp_in_ns, RAMP_IN), ms(self.ramp_out_ns, RAMP_OUT)]
    }

    /// What holds if nobody says.
    pub fn usual(period_ns: u64) -> Self {
        Self {
            max_command_age_ns: ns_of_ms(4.0),
            ramp_in_ns: ramp_in_ns(200.0, period_ns),
            ramp_out_ns: ramp_out_ns(5.0, period_ns),
            workspace_margin_m: 0.02,
            switches: Switches::default(),
            commissioning: None,
            trial: Commissioning::USUAL,
        }
    }

    /// Little force and little speed, as little as the file says.
    pub(crate) fn begin_trial(&mut self) {
        self.commissioning = Some(self.trial);
    }
}

fn ns_of_ms(ms: f64) -> u64 {
    (ms * 1e6).round() as u64
}

/// A period is rounded to a nanosecond, which must not cost a tick.
const ROUNDING_TICKS: f64 = 1e-3;

fn ramp_in_ns(ms: f64, period_ns: u64) -> u64 {
    let ticks = (ms * 1e6 / period_ns as f64 - ROUNDING_TICKS).ceil() as u64;
    ticks.max(1) * period_ns
}

fn ramp_out_ns(ms: f64, period_ns: u64) -> u64 {
    let ticks = (ms * 1e6 / period_ns as f64 + ROUNDING_TICKS).floor() as u64;
    ticks.max(1) * period_ns
}

/// Longer than most stalls of a shared machine; 8.5 N on the 250 g of a hand with an arm make 0.7 m/s and 7 mm of it.
const AGE: Allowed = Allowed { min: 0.0, max: 20.0, unit: "ms" };
/// A hand's first reflex takes 20 ms: what is there sooner meets one that does not hold.
const RAMP_IN: Allowed = Allowed { min: 20.0, max: 10_000.0, unit: "ms" };
const RAMP_OUT: Allowed = Allowed { min: 0.0, max: 50.0, unit: "ms" };

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSafety {
    max_command_age_ms: Option<Spanned<f64>>,
    max_command_age_ticks: Option<Spanned<i64>>,
    ramp_in_ms: Option<Spanned<f64>>,
    ramp_out_ms: Option<Spanned<f64>>,
    workspace_margin_mm: Option<Spanned<f64>>,
    emergency_stop: Option<RawSwitch>,
    dead_man: Option<RawSwitch>,
    #[serde(default)]
    commissioning: bool,
    commissioning_force_n: Option<Spanned<f64>>,
    commissioning_speed_m_per_s: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSwitch {
    device: Spanned<String>,
    button: Spanned<i64>,
    normally_closed: Option<Spanned<bool>>,
}

impl RawSafety {
    pub(super) fn validate(
        self,
        toml: &TomlText<'_>,
        period_ns: u64,
        devices: &[DeviceConfig],
    ) -> Result<SafetyConfig, TomlReport> {
        let usual = SafetyConfig::usual(period_ns);
        let number = |key: &Option<Spanned<f64>>, min: f64, max: f64, unit: &'static str| {
            key.as_ref().map(|number| toml.number(number, Allowed { min, max, unit })).transpose()
        };
        let time = |key: &Option<Spanned<f64>>, allowed: Allowed| {
            key.as_ref().map(|ms| toml.number(ms, allowed)).transpose()
        };
        let switch =
            |raw: &Option<RawSwitch>| raw.as_ref().map(|switch| switch.validate(toml, devices)).transpose();
        let age_ns = self.command_age_ns(toml, period_ns)?;
        let ramp_in_ms = time(&self.ramp_in_ms, RAMP_IN)?;
        let ramp_out_ms = time(&self.ramp_out_ms, RAMP_OUT)?;
        let margin_mm = number(&self.workspace_margin_mm, 0.1, 1000.0, "mm")?;
        let force_n = number(&self.commissioning_force_n, 0.0, 2.0, "N")?;
        let speed_m_per_s = number(&self.commissioning_speed_m_per_s, 0.01, 2.0, "m/s")?;
        let trial = Commissioning {
            force_n: force_n.unwrap_or(Commissioning::USUAL.force_n),
            speed_m_per_s: speed_m_per_s.unwrap_or(Commissioning::USUAL.speed_m_per_s),
        };
        Ok(SafetyConfig {
            max_command_age_ns: age_ns.unwrap_or(usual.max_command_age_ns),
            ramp_in_ns: ramp_in_ms.map_or(usual.ramp_in_ns, |ms| ramp_in_ns(ms, period_ns)),
            ramp_out_ns: ramp_out_ms.map_or(usual.ramp_out_ns, |ms| ramp_out_ns(ms, period_ns)),
            workspace_margin_m: margin_mm.map_or(usual.workspace_margin_m, |mm| mm / 1e3),
            switches: Switches {
                emergency_stop: switch(&self.emergency_stop)?,
                dead_man: self
                    .dead_man
                    .as_ref()
                    .map(|raw| raw.validate_dead_man(toml, devices))
                    .transpose()?,
            },
            commissioning: self.commissioning.then_some(trial),
            trial,
        })
    }
}

impl RawSafety {
    /// By its time, or by ticks, whose time is bounded alike.
    fn command_age_ns(&self, toml: &TomlText<'_>, period_ns: u64) -> Result<Option<u64>, TomlReport> {
        match (&self.max_command_age_ms, &self.max_command_age_ticks) {
            (None, None) => Ok(None),
            (Some(ms), None) => Ok(Some(ns_of_ms(toml.number(ms, AGE)?))),
            (None, Some(ticks)) => {
                let most = (AGE.max * 1e6 / period_ns as f64 + ROUNDING_TICKS).floor() as i64;
                let count = *ticks.get_ref();
                if (0..=most).contains(&count) {
                    return Ok(Some((count.unsigned_abs() * period_ns).min(ns_of_ms(AGE.max))));
                }
                let found = format_args!("{count} ticks of {} ms", period_ns as f64 / 1e6).to_string();
                let allowed = format!("0 to {most} ticks at this rate, which is {} ms", AGE.max);
                Err(toml.refuse(ticks.span(), found, allowed))
            }
            (Some(_), Some(ticks)) => Err(toml.refuse(
                ticks.span(),
                "`max_command_age_ticks` beside `max_command_age_ms`",
                "one of the two",
            )),
        }
    }
}

impl RawSwitch {
    /// Held is what closes the circuit: else a wire that is cut would hold the switch for ever.
    fn validate_dead_man(&self, toml: &TomlText<'_>, devices: &[DeviceConfig]) -> Result<Switch, TomlReport> {
        match &self.normally_closed {
            Some(key) if *key.get_ref() => {
                let allowed = "false: held has to close the circuit, or a cut wire would hold it".to_owned();
                Err(toml.refuse(key.span(), "true".to_owned(), allowed))
            }
            _ => self.validate(toml, devices),
        }
    }

    fn validate(&self, toml: &TomlText<'_>, devices: &[DeviceConfig]) -> Result<Switch, TomlReport> {
        let name = self.device.get_ref();
        let Some(device) = devices.iter().position(|device| device.name == *name) else {
            let names: Vec<&str> = devices.iter().map(|device| device.name.as_str()).collect();
            let found = format_args!("no device \"{name}\"").to_string();
            return Err(toml.refuse(self.device.span(), found, names.join(", ")));
        };
        let Some(buttons) = devices[device].backend.buttons() else {
            let found = format_args!("device \"{name}\", which has no buttons").to_string();
            let allowed = "a device with the switch on its card, or a script with a column of buttons";
            return Err(toml.refuse(self.device.span(), found, allowed));
        };
        let button = toml.integer(&self.button, 0..=buttons - 1)? as u32;
        Ok(Switch {
            device,
            button,
            normally_closed: self.normally_closed.as_ref().is_some_and(|key| *key.get_ref()),
        })
    }
}
