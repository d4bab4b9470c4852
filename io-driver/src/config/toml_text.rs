//! Writes a configuration down as TOML.

use super::{Backend, DeviceConfig, DriverConfig, ReplyMode};
use shm_abi::doorbell::WaitMode;
use std::fmt::Write as _;
use toml::Value;

pub(super) fn write(config: &DriverConfig) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = head(&mut text, config);
    for device in &config.devices {
        let _ = write_device(&mut text, device);
    }
    text
}

fn head(text: &mut String, config: &DriverConfig) -> std::fmt::Result {
    let period_ms = config.period_ns as f64 / 1e6;
    writeln!(text, "rate_hz = {:?}", 1e9 / config.period_ns as f64)?;
    writeln!(text, "clock = {}", quoted(config.clock.name()))?;
    if let Some(socket) = &config.socket {
        writeln!(text, "socket = {}", quoted(&socket.to_string_lossy()))?;
    }
    let real_time = &config.real_time;
    writeln!(text, "[real_time]")?;
    if let Some(cpu) = real_time.cpu {
        writeln!(text, "cpu = {cpu}")?;
    }
    writeln!(text, "priority = {}", real_time.priority.unwrap_or(0))?;
    writeln!(text, "lock_memory = {}", real_time.lock_memory)?;
    writeln!(text, "phase_offset_us = {:?}", real_time.phase_offset_ns as f64 / 1e3)?;
    writeln!(text, "spin_margin_us = {:?}", real_time.spin_margin_ns as f64 / 1e3)?;
    writeln!(text, "wait = {}", quoted(real_time.wait.map_or("auto", WaitMode::name)))?;
    writeln!(text, "[reply]")?;
    writeln!(text, "mode = {}", quoted(mode_name(config.reply.mode)))?;
    writeln!(text, "budget_us = {:?}", config.reply.budget_ns as f64 / 1e3)?;
    writeln!(text, "[safety]")?;
    writeln!(text, "max_command_age_ticks = {}", config.safety.max_command_age_ticks)?;
    writeln!(text, "ramp_in_ms = {:?}", config.safety.ramp_in_ticks as f64 * period_ms)?;
    writeln!(text, "ramp_out_ms = {:?}", config.safety.ramp_out_ticks as f64 * period_ms)?;
    writeln!(text, "[process]\nsandbox = {}", config.process.sandbox)?;
    config.process.user.iter().try_for_each(|user| writeln!(text, "user = {}", quoted(user)))
}

fn write_device(text: &mut String, device: &DeviceConfig) -> std::fmt::Result {
    writeln!(text, "[[device]]\nname = {}", quoted(&device.name))?;
    if let Some(peak_force_n) = device.peak_force_n {
        writeln!(text, "peak_force_n = {peak_force_n:?}")?;
    }
    match &device.backend {
        Backend::Ideal { hand, start_m, base_in_world } => {
            writeln!(text, "backend = \"ideal\"")?;
            if let Some((hand, finger)) = hand {
                writeln!(text, "hand = {}\nfinger = {}", quoted(&hand.to_string_lossy()), quoted(finger))?;
            }
            let base = base_in_world.translation.vector;
            let turn = base_in_world.rotation.quaternion();
            writeln!(text, "start_m = {:?}", start_m.as_slice())?;
            writeln!(text, "base_position_m = {:?}", base.as_slice())?;
            writeln!(text, "base_orientation_wxyz = {:?}", [turn.w, turn.i, turn.j, turn.k])
        }
        Backend::Replay { description, trace } => {
            writeln!(text, "backend = \"replay\"")?;
            writeln!(text, "description = {}", quoted(&description.to_string_lossy()))?;
            writeln!(text, "trace = {}", quoted(&trace.to_string_lossy()))
        }
    }
}

fn mode_name(mode: ReplyMode) -> &'static str {
    match mode {
        ReplyMode::OnArrival => "same-tick",
        ReplyMode::FixedPhase => "fixed-phase",
        ReplyMode::NextTick => "next-tick",
    }
}

fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
