//! What several of the tests need: an example driver, and values that betray a mixture.

#![allow(dead_code, reason = "each test binary uses its own part")]

pub(crate) mod c_compiler;
pub(crate) mod c_header;
pub(crate) mod desk;
pub(crate) mod fake;
pub(crate) mod golden;
pub(crate) mod host;

use bytemuck::Zeroable;
use patience::limit;
use shm_abi::doorbell::WaitMode;
use shm_abi::frame::DeviceFrame;
use shm_abi::layout::{COMMAND_WORDS, FRAME_WORDS};
use shm_abi::segment::{ClockMode, DeviceInfo, DriverInfo};
use shm_abi::{Command, Frame};
use std::time::Instant;

/// How many devices [`info`] has.
pub(crate) const DEVICES: usize = 2;

/// A driver with two devices.
pub(crate) fn info() -> DriverInfo {
    DriverInfo {
        period_ns: 1_000_000,
        reply_budget_ns: 300_000,
        max_command_age_ticks: 5,
        ramp_in_ticks: 200,
        ramp_out_ticks: 50,
        clock_mode: ClockMode::Real,
        wait_mode: WaitMode::Futex,
        is_commissioning: false,
        cpu: Some(1),
        devices: vec![device("thumb"), device("index")],
        setup_report: "  obtained  cpu: CPU 1\n  MISSING   kernel: wanted PREEMPT_RT\n".into(),
    }
}

/// A driver with so many devices.
pub(crate) fn info_of(devices: usize) -> DriverInfo {
    DriverInfo { devices: (0..devices).map(|index| device(&format!("device {index}"))).collect(), ..info() }
}

fn device(name: &str) -> DeviceInfo {
    DeviceInfo {
        name: name.into(),
        kind: "ideal".into(),
        peak_force_n: 8.5,
        continuous_force_n: 1.4,
        workspace_min_m: [-0.2, -0.1, -0.1],
        workspace_max_m: [0.2, 0.3, 0.1],
        slew_n_per_s: f64::INFINITY,
        speed_limit_m_per_s: f64::INFINITY,
    }
}

/// A frame whose every word is a function of its tick, those of devices that do not exist included.
pub(crate) fn frame(tick: u64) -> Frame {
    let mut frame = Frame::zeroed();
    let words: &mut [u64; FRAME_WORDS] = bytemuck::cast_mut(&mut frame);
    fill(words, tick);
    frame
}

/// Whether every word of `found` is that of frame `tick` of a driver as [`info`] describes it.
pub(crate) fn is_frame(found: &Frame, tick: u64) -> bool {
    is_frame_of(found, tick, DEVICES)
}

/// Whether `found` is frame `tick` of a driver with so many devices, and zero behind them.
pub(crate) fn is_frame_of(found: &Frame, tick: u64, devices: usize) -> bool {
    let words: &[u64; FRAME_WORDS] = bytemuck::cast_ref(found);
    let existing = (std::mem::offset_of!(Frame, devices) + devices * size_of::<DeviceFrame>()) / 8;
    is_filled(&words[..existing], tick) && words[existing..].iter().all(|word| *word == 0)
}

/// A command whose every word is a function of its tick.
pub(crate) fn command(tick: u64) -> Command {
    let mut command = Command::zeroed();
    let words: &mut [u64; COMMAND_WORDS] = bytemuck::cast_mut(&mut command);
    fill(words, tick);
    command
}

/// Whether every word of `found` is that of command `tick`.
pub(crate) fn is_command(found: &Command, tick: u64) -> bool {
    let words: &[u64; COMMAND_WORDS] = bytemuck::cast_ref(found);
    is_filled(words, tick)
}

fn fill(words: &mut [u64], tick: u64) {
    for (place, word) in words.iter_mut().enumerate() {
        *word = word_of(tick, place);
    }
}

fn is_filled(words: &[u64], tick: u64) -> bool {
    words.iter().enumerate().all(|(place, word)| *word == word_of(tick, place))
}

/// Differs between any two ticks at every place; the first word is the tick itself.
fn word_of(tick: u64, place: usize) -> u64 {
    tick.wrapping_mul(2 * place as u64 + 1) ^ (place as u64) << 48
}

/// A directory for a socket; it goes with the value.
pub(crate) fn directory() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Both sides' process id, where they are one process.
pub(crate) fn own_pid() -> u64 {
    u64::from(std::process::id())
}

/// Calls `done` until it says so; panics after [`limit`].
pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < limit(), "waited {:?} in vain until {what}", limit());
        std::thread::yield_now();
    }
}
