//! `[safety]`: ages, ramps, switches, commissioning.

use super::DeviceConfig;
use crate::safety::switches::{Switch, Switches};
use crate::toml_report::{Allowed, TomlReport, TomlText};
use serde::Deserialize;
use toml::Spanned;

/// Ages, ramps, switches, and whether somebody is trying the device for the first time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyConfig {
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: u64,
    /// From no force to all of it for a new lease (ticks).
    pub ramp_in_ticks: u64,
    /// From all force to none once commands fail (ticks).
    pub ramp_out_ticks: u64,
    /// Beyond its workspace a device's force fades out over this distance (m).
    pub workspace_margin_m: f64,
    /// Emergency stop and dead-man's switch.
    pub switches: Switches,
    /// Little force and little speed, if somebody tries the devices for the first time.
    pub commissioning: Option<Commissioning>,
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
    /// What holds if nobody says.
    pub fn usual(period_ns: u64) -> Self {
        Self {
            max_command_age_ticks: 5,
            ramp_in_ticks: ticks_of_ms(200.0, period_ns),
            ramp_out_ticks: ticks_of_ms(10.0, period_ns),
            workspace_margin_m: 0.02,
            switches: Switches::default(),
            commissioning: None,
        }
    }
}

/// At least one.
fn ticks_of_ms(ms: f64, period_ns: u64) -> u64 {
    ((ms * 1e6 / period_ns as f64).round() as u64).max(1)
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSafety {
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
        let ticks = |key: &Option<Spanned<f64>>, usual: u64, max_ms: f64| {
            let ms = number(key, 0.0, max_ms, "ms")?;
            Ok::<u64, TomlReport>(ms.map_or(usual, |ms| ticks_of_ms(ms, period_ns)))
        };
        let switch =
            |raw: &Option<RawSwitch>| raw.as_ref().map(|switch| switch.validate(toml, devices)).transpose();
        let age = self.max_command_age_ticks.as_ref().map(|age| toml.integer(age, 0..=100)).transpose()?;
        let margin_mm = number(&self.workspace_margin_mm, 0.1, 1000.0, "mm")?;
        let force_n = number(&self.commissioning_force_n, 0.0, 2.0, "N")?;
        let speed_m_per_s = number(&self.commissioning_speed_m_per_s, 0.01, 2.0, "m/s")?;
        Ok(SafetyConfig {
            max_command_age_ticks: age.map_or(usual.max_command_age_ticks, |age| age as u64),
            ramp_in_ticks: ticks(&self.ramp_in_ms, usual.ramp_in_ticks, 10_000.0)?,
            ramp_out_ticks: ticks(&self.ramp_out_ms, usual.ramp_out_ticks, 1000.0)?,
            workspace_margin_m: margin_mm.map_or(usual.workspace_margin_m, |mm| mm / 1e3),
            switches: Switches {
                emergency_stop: switch(&self.emergency_stop)?,
                dead_man: self
                    .dead_man
                    .as_ref()
                    .map(|raw| raw.validate_dead_man(toml, devices))
                    .transpose()?,
            },
            commissioning: self.commissioning.then(|| Commissioning {
                force_n: force_n.unwrap_or(Commissioning::USUAL.force_n),
                speed_m_per_s: speed_m_per_s.unwrap_or(Commissioning::USUAL.speed_m_per_s),
            }),
        })
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
