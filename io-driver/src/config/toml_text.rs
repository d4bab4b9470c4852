//! Writes a configuration down as TOML.

use super::{
    Backend, Commissioning, DeviceConfig, DriverConfig, HandChoice, HandSource, OverrunPolicy, ReplyMode,
    SpinMargin, Wish,
};
use crate::safety::switches::{Switch, Switches};
use nalgebra::UnitQuaternion;
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
    if !real_time.phase_steps_aside {
        writeln!(text, "phase_offset_us = {:?}", real_time.phase_offset_ns as f64 / 1e3)?;
    }
    if let SpinMargin::Fixed(ns) = real_time.spin_margin {
        writeln!(text, "spin_margin_us = {:?}", ns as f64 / 1e3)?;
    }
    let (policy, ticks) = match real_time.overrun {
        OverrunPolicy::Skip => ("skip", None),
        OverrunPolicy::CatchUp(ticks) => ("catch-up", Some(ticks)),
        OverrunPolicy::Fault(ticks) => ("fault", Some(ticks)),
    };
    let ticks = ticks.map_or_else(String::new, |ticks| format!(", ticks = {ticks}"));
    writeln!(text, "overruns = {{ policy = {}{ticks} }}", quoted(policy))?;
    writeln!(text, "wait = {}", quoted(real_time.wait.map_or("auto", WaitMode::name)))?;
    writeln!(text, "[reply]")?;
    writeln!(text, "mode = {}", quoted(mode_name(config.reply.mode)))?;
    writeln!(text, "budget_us = {:?}", config.reply.budget_ns as f64 / 1e3)?;
    writeln!(text, "[safety]")?;
    let [age_ms, in_ms, out_ms] = config.safety.times_ms();
    writeln!(text, "max_command_age_ms = {age_ms:?}\nramp_in_ms = {in_ms:?}\nramp_out_ms = {out_ms:?}")?;
    writeln!(text, "workspace_margin_mm = {:?}", config.safety.workspace_margin_m * 1e3)?;
    let Switches { emergency_stop, dead_man } = &config.safety.switches;
    for (key, switch) in [("emergency_stop", emergency_stop), ("dead_man", dead_man)] {
        if let Some(Switch { device, button, normally_closed }) = switch {
            let device = quoted(&config.devices[*device].name);
            let wiring = format_args!("normally_closed = {normally_closed}").to_string();
            writeln!(text, "{key} = {{ device = {device}, button = {button}, {wiring} }}")?;
        }
    }
    let Commissioning { force_n, speed_m_per_s } = config.safety.trial;
    writeln!(text, "commissioning = {}", config.safety.commissioning.is_some())?;
    writeln!(text, "commissioning_force_n = {force_n:?}\ncommissioning_speed_m_per_s = {speed_m_per_s:?}")?;
    writeln!(text, "[process]\nsandbox = {}", config.process.sandbox)?;
    writeln!(text, "service_silence_ms = {:?}", config.process.service_silence_ns as f64 / 1e6)?;
    config.process.user.iter().try_for_each(|user| writeln!(text, "user = {}", quoted(user)))?;
    writeln!(text, "[access]")?;
    config.access.groups().try_for_each(|(key, group)| writeln!(text, "{key} = {}", quoted(group)))
}

fn write_device(text: &mut String, device: &DeviceConfig) -> std::fmt::Result {
    writeln!(text, "[[device]]\nname = {}", quoted(&device.name))?;
    if let Some(peak_force_n) = device.peak_force_n {
        writeln!(text, "peak_force_n = {peak_force_n:?}")?;
    }
    if let Some(slew_n_per_s) = device.slew_n_per_s {
        writeln!(text, "slew_n_per_s = {slew_n_per_s:?}")?;
    }
    if device.compensates_gravity {
        writeln!(text, "gravity_compensation = true")?;
    }
    if !matches!(device.backend, Backend::Ideal { .. }) {
        writeln!(text, "zeroing = {}", quoted(device.zeroing.name()))?;
    }
    match &device.backend {
        Backend::Ideal(wish) => {
            writeln!(text, "backend = \"ideal\"")?;
            write_wish(text, wish)
        }
        Backend::Simulated { description, wish, holder, seed } => {
            writeln!(text, "backend = \"simulated\"")?;
            writeln!(text, "description = {}", quoted(&description.to_string_lossy()))?;
            match holder {
                None => writeln!(text, "hand_model = \"nobody\"")?,
                Some(HandChoice { model, firmness, trembles }) => {
                    writeln!(text, "hand_model = {}", quoted(&model.to_string_lossy()))?;
                    writeln!(text, "firmness = {}\ntremor = {trembles}", quoted(firmness.name()))?;
                }
            }
            writeln!(text, "seed = {seed}")?;
            write_wish(text, wish)
        }
        Backend::Replay { description, trace, base_orientation } => {
            writeln!(text, "backend = \"replay\"")?;
            writeln!(text, "description = {}", quoted(&description.to_string_lossy()))?;
            writeln!(text, "trace = {}", quoted(&trace.to_string_lossy()))?;
            write_orientation(text, base_orientation)
        }
        Backend::Emulated { description, card, base_orientation } => {
            writeln!(text, "backend = \"emulated\"")?;
            writeln!(text, "description = {}", quoted(&description.to_string_lossy()))?;
            writeln!(text, "card = {}", quoted(&card.to_string_lossy()))?;
            write_orientation(text, base_orientation)
        }
    }
}

fn write_wish(text: &mut String, wish: &Wish) -> std::fmt::Result {
    match &wish.hand {
        HandSource::Nobody => {}
        HandSource::Script { file, finger } => {
            writeln!(text, "hand = {}\nfinger = {}", quoted(&file.to_string_lossy()), quoted(finger))?;
        }
        HandSource::Live { file, finger } => {
            writeln!(text, "live_hand = {}\nlive_finger = {finger}", quoted(&file.to_string_lossy()))?;
        }
    }
    writeln!(text, "start_m = {:?}", wish.start_m.as_slice())?;
    writeln!(text, "base_position_m = {:?}", wish.base_in_world.translation.vector.as_slice())?;
    write_orientation(text, &wish.base_in_world.rotation)
}

fn write_orientation(text: &mut String, orientation: &UnitQuaternion<f64>) -> std::fmt::Result {
    let turn = orientation.quaternion();
    writeln!(text, "base_orientation_wxyz = {:?}", [turn.w, turn.i, turn.j, turn.k])
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
