//! Description of a driver and its devices in the header of its segment.
//!
//! Invariant: it is written once, before the segment is handed over; what a reader finds is an allegation, with
//! impossible values cut to possible ones.

use super::text::{put_text, text_of};
use super::{get, put};
use crate::doorbell::WaitMode;
use crate::enumeration::from_word;
use crate::layout::{
    ABI_VERSION, DRIVER_COMMISSIONING, DeviceDescription, DriverSegment, LAYOUT_HASH, MAGIC, MAX_DEVICES,
};
use std::sync::atomic::{AtomicU64, Ordering};

/// Which clock moves the ticks.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockMode {
    /// CLOCK_MONOTONIC, two processes.
    Real = 0,
    /// Two processes; a tick ends when both have done their part.
    Lockstep = 1,
    /// One process, as fast as the machine allows.
    Virtual = 2,
}

from_word!(ClockMode { Real, Lockstep, Virtual });

impl ClockMode {
    /// The name a person reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "real",
            Self::Lockstep => "lockstep",
            Self::Virtual => "virtual",
        }
    }
}

/// What a driver says of itself once.
#[derive(Debug, Clone, PartialEq)]
pub struct DriverInfo {
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// How long it waits for a reply (ns); u64::MAX: for ever.
    pub reply_budget_ns: u64,
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: u64,
    /// Ticks from no force to all of it for a new lease.
    pub ramp_in_ticks: u64,
    /// Ticks from all force to none once commands fail.
    pub ramp_out_ticks: u64,
    /// Whether forces and speeds are cut to those of commissioning.
    pub is_commissioning: bool,
    /// Which clock moves the ticks.
    pub clock_mode: ClockMode,
    /// How it waits for a reply.
    pub wait_mode: WaitMode,
    /// The CPU of its loop.
    pub cpu: Option<usize>,
    /// The devices, [`MAX_DEVICES`] at most.
    pub devices: Vec<DeviceInfo>,
    /// Which real-time guarantees its loop obtained, a line each; cut to 4096 bytes.
    pub setup_report: String,
}

/// What a device is.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// Name from the driver's configuration; cut to 64 bytes.
    pub name: String,
    /// Kind, such as "premium".
    pub kind: String,
    /// The largest force (N); infinite: no limit.
    pub peak_force_n: f64,
    /// The force it can hold for ever (N).
    pub continuous_force_n: f64,
    /// Smallest corner of the workspace in the base frame D (m).
    pub workspace_min_m: [f64; 3],
    /// Its largest corner (m).
    pub workspace_max_m: [f64; 3],
    /// How fast a force may grow (N/s); infinite: no limit.
    pub slew_n_per_s: f64,
    /// The tip's speed that is a fault (m/s); infinite: none.
    pub speed_limit_m_per_s: f64,
}

impl DeviceInfo {
    pub(super) fn from_description(from: &DeviceDescription) -> Self {
        Self {
            name: text_of(&from.name),
            kind: text_of(&from.kind),
            peak_force_n: f64::from_bits(get(&from.peak_force_n)),
            continuous_force_n: f64::from_bits(get(&from.continuous_force_n)),
            workspace_min_m: from.workspace_min_m.each_ref().map(|word| f64::from_bits(get(word))),
            workspace_max_m: from.workspace_max_m.each_ref().map(|word| f64::from_bits(get(word))),
            slew_n_per_s: limit_of(&from.slew_n_per_s),
            speed_limit_m_per_s: limit_of(&from.speed_limit_m_per_s),
        }
    }

    fn write_to(&self, to: &DeviceDescription) {
        put_text(&to.name, &self.name);
        put_text(&to.kind, &self.kind);
        put(&to.peak_force_n, self.peak_force_n.to_bits());
        put(&to.continuous_force_n, self.continuous_force_n.to_bits());
        for axis in 0..3 {
            put(&to.workspace_min_m[axis], self.workspace_min_m[axis].to_bits());
            put(&to.workspace_max_m[axis], self.workspace_max_m[axis].to_bits());
        }
        put(&to.slew_n_per_s, self.slew_n_per_s.to_bits());
        put(&to.speed_limit_m_per_s, self.speed_limit_m_per_s.to_bits());
    }
}

/// A limit that a 1.0 driver does not tell is none.
fn limit_of(word: &AtomicU64) -> f64 {
    let limit = f64::from_bits(get(word));
    if limit == 0.0 { f64::INFINITY } else { limit }
}

/// Fills in the header and the devices, and says at last that they are there.
pub(super) fn describe(segment: &DriverSegment, info: &DriverInfo) {
    let header = &segment.header;
    put(&header.magic, MAGIC);
    put(&header.abi_version, ABI_VERSION);
    put(&header.layout_hash, LAYOUT_HASH);
    put(&header.segment_bytes, size_of::<DriverSegment>() as u64);
    put(&header.driver_pid, u64::from(std::process::id()));
    put(&header.period_ns, info.period_ns);
    put(&header.reply_budget_ns, info.reply_budget_ns);
    put(&header.max_command_age_ticks, info.max_command_age_ticks);
    put(&header.ramp_in_ticks, info.ramp_in_ticks);
    put(&header.ramp_out_ticks, info.ramp_out_ticks);
    put(&header.clock_mode, info.clock_mode as u64);
    put(&header.wait_mode, info.wait_mode as u64);
    put(&header.flags, if info.is_commissioning { DRIVER_COMMISSIONING } else { 0 });
    put(&header.cpu_plus_one, info.cpu.map_or(0, |cpu| cpu as u64 + 1));
    put(&header.device_count, info.devices.len() as u64);
    for (device, to) in info.devices.iter().zip(&segment.devices) {
        device.write_to(to);
    }
    put_text(&segment.setup_report, &info.setup_report);
    header.ready.store(1, Ordering::Release);
}

/// The devices of a driver; a count beyond the array is cut to it.
pub(super) fn device_count(segment: &DriverSegment) -> usize {
    usize::try_from(get(&segment.header.device_count)).unwrap_or(MAX_DEVICES).min(MAX_DEVICES)
}
