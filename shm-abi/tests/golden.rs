//! The bytes and the numbers that other builds rely on, as committed files.
//!
//! `tests/golden/VERSION/` holds each structure as its version's C header lays it out; today's types must read
//! every version to the values below and write the same bytes. The layout hash does not see the values of
//! enumerations and flags: `tests/golden/values.txt` does.
//!
//! The values are read from the committed C header, which `tests/c_header.rs` holds equal to the sources.
//!
//! A new minor version adds a directory and lines, by `PHANTOM3_BLESS=1 cargo test -p shm-abi --test golden`;
//! what stands there of an older version never changes.

mod common;

use bytemuck::Pod;
use common::c_header::{CHeader, current_version};
use common::golden::{DEVICES, Golden, NAME, STRUCTURES, path_of};
use shm_abi::doorbell::WaitMode;
use shm_abi::frame::{DeviceFrame, Outcome};
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict, name_bytes};
use shm_abi::layout::{CommanderSegment, DriverSegment, MAGIC, MAX_DEVICES};
use shm_abi::segment::{ClockMode, DeviceInfo, DriverInfo};
use shm_abi::{
    Command, DeviceCommand, DriverMemory, DriverState, DriverView, FaultReason, Frame, LAYOUT_HASH,
};
use std::fmt::Debug;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::atomic::Ordering;

/// Every version of the major one in force, with its minor number.
const VERSIONS: [(&str, u32); 4] = [("1.0", 0), ("1.1", 1), ("1.2", 2), ("1.3", 3)];

fn blesses() -> bool {
    std::env::var_os("PHANTOM3_BLESS").is_some()
}

#[test]
fn the_golden_bytes_are_what_the_header_of_their_version_gives() {
    assert_eq!(VERSIONS.last().unwrap().0, current_version(), "the version in force has golden bytes, too");
    for (version, _) in VERSIONS {
        for structure in STRUCTURES {
            let path = path_of(version, structure);
            let made = Golden::text(version, structure);
            if blesses() && (version == current_version() || !path.exists()) {
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(&path, &made).unwrap();
            }
            let committed = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(made == committed, "{} differs from the header of {version}", path.display());
        }
    }
}

/// The n-th word of a structure, counted from 1, as each type has it; see `common/golden.rs`.
const fn count(n: u64) -> u64 {
    1000 + n
}

const fn signed(n: i64) -> i64 {
    -1000 - n
}

fn real(n: usize) -> f64 {
    n as f64 + 0.5
}

fn reals<const N: usize>(first: usize) -> [f64; N] {
    std::array::from_fn(|index| real(first + index))
}

fn frame(minor: u32) -> Frame {
    Frame {
        tick: count(1),
        deadline_ns: count(2),
        read_ns: count(3),
        state: DriverState::Fault as u64,
        fault: if minor == 0 { FaultReason::Panic } else { FaultReason::Overrun } as u64,
        lease: count(6),
        authority: real(7),
        run_tick: signed(8),
        device_count: DEVICES,
        previous: Outcome {
            reply: count(10),
            command_tick: count(11),
            authority: real(12),
            round_trip_ns: count(13),
            written_ns: count(14),
        },
        inputs: if minor >= 1 { count(15) } else { 0 },
        devices: std::array::from_fn(|device| device_frame(minor, 16 + 40 * device)),
    }
}

fn device_frame(minor: u32, first: usize) -> DeviceFrame {
    let n = first as u64;
    DeviceFrame {
        flags: count(n),
        buttons: count(n + 1),
        encoder_counts: std::array::from_fn(|axis| signed((first + 2 + axis) as i64)),
        joint_angle_rad: reals(first + 8),
        position_m_measured: reals(first + 14),
        orientation_wxyz_measured: reals(first + 17),
        force_on_user_n_commanded: reals(first + 21),
        force_on_user_n_applied: reals(first + 24),
        motor_codes: std::array::from_fn(|axis| signed((first + 27 + axis) as i64)),
        velocity_m_per_s_estimated: if minor >= 1 { reals(first + 30) } else { [0.0; 3] },
        limits: if minor >= 1 { count(n + 33) } else { 0 },
        motor_heat: if minor >= 1 { real(first + 34) } else { 0.0 },
        joint_velocity_rad_per_s_estimated: if minor >= 2 { reals(first + 35) } else { [0.0; 3] },
        reserved: [0; 2],
    }
}

fn command() -> Command {
    let device = |index: usize| DeviceCommand { force_on_user_n: reals(5 + 4 * index), reserved: 0 };
    Command {
        tick: count(1),
        lease: count(2),
        device_count: DEVICES,
        reserved: 0,
        devices: std::array::from_fn(device),
    }
}

fn request(minor: u32) -> Request {
    Request {
        magic: MAGIC,
        abi_version: (1 << 32) | u64::from(minor),
        layout_hash: LAYOUT_HASH,
        kind: RequestKind::Command as u64,
        name: name_bytes(NAME),
        devices: if minor >= 2 { count(13) } else { 0 },
        asked_ns: if minor >= 3 { count(14) } else { 0 },
        reserved: [0; 2],
    }
}

fn answer(minor: u32) -> Answer {
    Answer {
        magic: MAGIC,
        abi_version: (1 << 32) | u64::from(minor),
        layout_hash: LAYOUT_HASH,
        driver_segment_bytes: size_of::<DriverSegment>() as u64,
        commander_segment_bytes: size_of::<CommanderSegment>() as u64,
        verdict: Verdict::Granted as u64,
        lease: count(7),
        driver_pid: count(8),
        holder_pid: count(9),
        holder_name: name_bytes(NAME),
        allowed_group_plus_one: if minor >= 3 { count(18) } else { 0 },
        latest_tick_plus_one: if minor >= 3 { count(19) } else { 0 },
        latest_is_stopped: if minor >= 3 { count(20) } else { 0 },
        reserved: [0; 4],
    }
}

fn assert_reads_and_writes<T: Pod + PartialEq + Debug>(value: &T, version: &str, structure: &str) {
    let golden = Golden::committed(version, structure);
    assert_eq!(bytemuck::pod_read_unaligned::<T>(&golden.bytes), *value, "{structure} {version} read");
    assert_eq!(bytemuck::bytes_of(value), golden.bytes, "{structure} {version} written");
}

#[test]
fn todays_frames_commands_and_messages_read_and_write_the_bytes_of_every_version() {
    for (version, minor) in VERSIONS {
        assert_reads_and_writes(&frame(minor), version, "PhantomFrame");
        assert_reads_and_writes(&command(), version, "PhantomCommand");
        assert_reads_and_writes(&request(minor), version, "PhantomRequest");
        assert_reads_and_writes(&answer(minor), version, "PhantomAnswer");
    }
    assert_eq!(request(0).check(), Ok(RequestKind::Command), "a request of 1.0 is understood");
}

fn driver_info(minor: u32) -> DriverInfo {
    let device = DeviceInfo {
        name: NAME.into(),
        kind: NAME.into(),
        peak_force_n: real(11),
        continuous_force_n: real(12),
        workspace_min_m: reals(13),
        workspace_max_m: reals(16),
        slew_n_per_s: if minor >= 1 { real(19) } else { 0.0 },
        speed_limit_m_per_s: if minor >= 1 { real(20) } else { 0.0 },
    };
    DriverInfo {
        period_ns: count(6),
        reply_budget_ns: count(7),
        max_command_age_ticks: count(8),
        ramp_out_ticks: count(9),
        ramp_in_ticks: count(10),
        clock_mode: ClockMode::Lockstep,
        wait_mode: WaitMode::Spin,
        cpu: Some(count(14) as usize - 1),
        is_commissioning: minor >= 1,
        devices: vec![device; MAX_DEVICES],
        setup_report: String::new(),
    }
}

#[test]
fn todays_driver_writes_the_header_and_the_descriptions_of_every_version_and_reads_them_again() {
    for (version, minor) in VERSIONS {
        let memory = DriverMemory::create(&driver_info(minor)).unwrap();
        // What is not the caller's to choose.
        memory.header.driver_pid.store(count(5), Ordering::Relaxed);
        memory.header.abi_version.store((1 << 32) | u64::from(minor), Ordering::Relaxed);
        let file = File::from(memory.fd().try_clone_to_owned().unwrap());
        let header = CHeader::of(version);
        for (structure, field) in [("PhantomDriverHeader", "header"), ("PhantomDeviceDescription", "devices")]
        {
            let golden = Golden::committed(version, structure).bytes;
            let mut found = vec![0; golden.len()];
            let offset = header.offset_of("PhantomDriverSegment", field) as u64;
            file.read_exact_at(&mut found, offset).unwrap();
            assert_eq!(found, golden, "{structure} {version}");
        }
        // No driver ticks as fast as the numbers of the golden header say.
        const PERIOD_NS: u64 = 1_001_006;
        memory.header.period_ns.store(PERIOD_NS, Ordering::Relaxed);
        let view = DriverView::map(memory.fd()).unwrap();
        let mut expected = DriverInfo { period_ns: PERIOD_NS, ..driver_info(minor) };
        if minor == 0 {
            // What a driver of 1.0 does not tell is no limit.
            for device in &mut expected.devices {
                (device.slew_n_per_s, device.speed_limit_m_per_s) = (f64::INFINITY, f64::INFINITY);
            }
        }
        assert_eq!((view.info(), view.abi_minor()), (expected, minor));
    }
}

#[test]
fn no_number_that_crosses_the_border_ever_changes_its_meaning() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/values.txt");
    let listed = std::fs::read_to_string(&path).unwrap_or_default();
    // Of today's constants only the version's own number may differ from one minor to the next.
    let is_value = |(name, _): &(String, String)| name != "PHANTOM_ABI_MINOR" && !name.ends_with("_H");
    let today: Vec<(String, String)> =
        CHeader::of(&current_version()).constants().into_iter().filter(is_value).collect();
    assert!(today.len() > 50, "the header was not understood: {today:?}");
    let today: Vec<String> = today.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    for line in listed.lines() {
        assert!(today.iter().any(|known| known == line), "{line:?} was published and is gone or changed");
    }
    for (version, _) in VERSIONS {
        for (name, value) in CHeader::of(version).constants().into_iter().filter(is_value) {
            let line = format!("{name} = {value}");
            assert!(today.contains(&line), "{line:?} was published with {version} and is gone or changed");
        }
    }
    let added: Vec<&String> =
        today.iter().filter(|known| !listed.lines().any(|line| line == *known)).collect();
    if blesses() {
        let more: String = added.iter().map(|line| format!("{line}\n")).collect();
        std::fs::write(&path, listed + &more).unwrap();
    } else {
        assert!(added.is_empty(), "add to {} (or run with PHANTOM3_BLESS=1): {added:?}", path.display());
    }
}

#[test]
fn no_two_values_of_an_enumeration_and_no_two_bits_of_a_word_of_flags_are_the_same() {
    let constants = CHeader::of(&current_version()).constants();
    for prefix in [
        "DRIVER_STATE_",
        "FAULT_REASON_",
        "REPLY_KIND_",
        "REQUEST_KIND_",
        "VERDICT_",
        "CLOCK_MODE_",
        "WAIT_MODE_",
        "INPUT_",
        "DEVICE_",
        "LIMIT_",
    ] {
        let prefix = format!("PHANTOM_{prefix}");
        let mut values: Vec<&String> =
            constants.iter().filter(|(name, _)| name.starts_with(&prefix)).map(|(_, value)| value).collect();
        let listed = values.len();
        values.sort();
        values.dedup();
        assert!(listed > 1 && values.len() == listed, "{prefix}: {listed} names, {} values", values.len());
    }
}
