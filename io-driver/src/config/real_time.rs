//! `[real_time]`: what is asked of the operating system.

use super::ns_of_us;
use crate::toml_report::{Allowed, TomlReport, TomlText};
use rt_core::periodic::PeriodicConfig;
use serde::Deserialize;
use shm_abi::doorbell::WaitMode;
use toml::Spanned;

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
    /// Whether that phase may change, to step aside from what interrupts at the same phase.
    pub phase_steps_aside: bool,
    /// When sleeping turns into spinning.
    pub spin_margin: SpinMargin,
    /// What to do about deadlines that were missed.
    pub overrun: OverrunPolicy,
    /// How to wait for replies; `None`: whatever suits what was obtained.
    pub wait: Option<WaitMode>,
}

/// How long before the deadline sleeping turns into spinning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpinMargin {
    /// As long as this machine needs, measured when the loop's thread has been set up.
    Calibrated {
        /// But no longer than this (ns).
        at_most_ns: u64,
    },
    /// So long (ns).
    Fixed(u64),
}

/// What to do about deadlines that were missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OverrunPolicy {
    /// Leave them out; the next tick is on time.
    Skip,
    /// Do up to so many of them at once, one after another, as the thesis' driver would; leave out the rest.
    CatchUp(u64),
    /// Leave them out; more than so many in a row are a fault.
    Fault(u64),
}

impl RealTime {
    /// What is asked for if nobody says.
    pub fn usual(period_ns: u64, budget_ns: u64) -> Self {
        Self {
            cpu: None,
            priority: Some(80),
            lock_memory: true,
            phase_offset_ns: PeriodicConfig::hybrid(period_ns).phase_offset_ns % period_ns,
            phase_steps_aside: true,
            spin_margin: SpinMargin::Calibrated { at_most_ns: longest_spin_margin_ns(period_ns, budget_ns) },
            overrun: OverrunPolicy::Skip,
            wait: None,
        }
    }
}

/// The longest spin margin that a calibration may choose. However the replies fail, a tick then sleeps for at
/// least a quarter of what the budget leaves: a loop that spun until the budget's end and from there on to the
/// next deadline would never sleep, and the kernel would throttle it (5 % of each second) and starve all else on
/// its CPU.
pub fn longest_spin_margin_ns(period_ns: u64, budget_ns: u64) -> u64 {
    let rest_ns = period_ns.saturating_sub(budget_ns);
    LONGEST_SPIN_NS.min(period_ns / 2).min(rest_ns / 4 * 3)
}

/// No machine that is fit for real time wakes later than this, save now and then.
const LONGEST_SPIN_NS: u64 = 200_000;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRealTime {
    cpu: Option<Spanned<i64>>,
    priority: Option<Spanned<i64>>,
    lock_memory: Option<bool>,
    phase_offset_us: Option<Spanned<f64>>,
    spin_margin_us: Option<Spanned<f64>>,
    #[serde(default)]
    overruns: RawOverruns,
    wait: Option<RawWait>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawWait {
    Auto,
    Spin,
    Futex,
}

/// As many as an old command may drive the motors.
const USUAL_OVERRUN_TICKS: u64 = 5;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawOverruns {
    #[serde(default)]
    policy: RawPolicy,
    ticks: Option<Spanned<i64>>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
enum RawPolicy {
    #[default]
    Skip,
    CatchUp,
    Fault,
}

impl RawOverruns {
    fn validate(&self, toml: &TomlText<'_>) -> Result<OverrunPolicy, TomlReport> {
        let ticks = self.ticks.as_ref().map(|ticks| toml.integer(ticks, 0..=1000)).transpose()?;
        let ticks = ticks.map_or(USUAL_OVERRUN_TICKS, |ticks| ticks as u64);
        Ok(match self.policy {
            RawPolicy::Skip => OverrunPolicy::Skip,
            RawPolicy::CatchUp => OverrunPolicy::CatchUp(ticks),
            RawPolicy::Fault => OverrunPolicy::Fault(ticks),
        })
    }
}

impl RawRealTime {
    pub(super) fn validate(
        self,
        toml: &TomlText<'_>,
        period_ns: u64,
        budget_ns: u64,
    ) -> Result<RealTime, TomlReport> {
        let usual = RealTime::usual(period_ns, budget_ns);
        let within_period = Allowed { min: 0.0, max: period_ns as f64 / 1e3, unit: "us" };
        let us = |key: &Option<Spanned<f64>>| {
            key.as_ref().map(|number| toml.number(number, within_period).map(ns_of_us)).transpose()
        };
        let phase_offset_ns = us(&self.phase_offset_us)?;
        let spin_margin = us(&self.spin_margin_us)?.map_or(usual.spin_margin, SpinMargin::Fixed);
        let cpu = self.cpu.map(|cpu| toml.integer(&cpu, 0..=4095)).transpose()?;
        // 0 switches real-time scheduling off; 99 is left to the kernel's own threads.
        let priority =
            self.priority.map(|priority| toml.integer(&priority, 0..=98)).transpose()?.unwrap_or(80);
        Ok(RealTime {
            cpu: cpu.map(|cpu| cpu as usize),
            priority: (priority > 0).then_some(priority as u8),
            lock_memory: self.lock_memory.unwrap_or(true),
            phase_offset_ns: phase_offset_ns.unwrap_or(usual.phase_offset_ns),
            // Whoever names a phase means it.
            phase_steps_aside: phase_offset_ns.is_none(),
            spin_margin,
            overrun: self.overruns.validate(toml)?,
            wait: match self.wait.unwrap_or(RawWait::Auto) {
                RawWait::Auto => None,
                RawWait::Spin => Some(WaitMode::Spin),
                RawWait::Futex => Some(WaitMode::Futex),
            },
        })
    }
}
