//! Programs of one minor version and drivers of another.
//!
//! The old program is C, compiled with the headers as they were released (`tests/frozen`); the old driver is
//! forged from the golden bytes of its version, laid out as its header says. Neither knows today's Rust types.

use crate::common::c_compiler::reader_of;
use crate::common::c_header::{CHeader, current_version};
use crate::common::fake::{fake_server, hear, send};
use crate::common::golden::Golden;
use crate::common::host::Host;
use crate::common::{directory, info_of, own_pid, wait_until};
use bytemuck::Zeroable;
use patience::limit;
use patience::prelude::*;
use shm_abi::client::AttachError;
use shm_abi::handshake::{Answer, Verdict};
use shm_abi::segment::DriverInfo;
use shm_abi::server::ServerEvent;
use shm_abi::{
    Command, CommanderView, DriverMemory, DriverState, FaultReason, Frame, LAYOUT_HASH, MAX_DEVICES, client,
};
use std::fs::File;
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};

/// The versions before the one in force.
const OLDER: [&str; 3] = ["1.0", "1.1", "1.2"];
/// The tick in the golden frame.
const TICK: u64 = 1001;

fn start(program: &Path, socket: &Path, arguments: &[&str]) -> Child {
    std::process::Command::new(program)
        .arg(socket)
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// What the program printed, once it has ended well.
fn printed(child: Child) -> String {
    let output = child.bounded_output();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Whether the program, built for `reader`, has read every number that its headers know as the golden driver of
/// `driver` has written it; numbers that this driver does not know are zero. An older one's ticks are [`PERIOD_NS`] long.
fn assert_read(printed: &str, reader: &str, driver: &str) {
    let mut compared = 0;
    for structure in ["PhantomFrame", "PhantomDriverHeader", "PhantomDeviceDescription", "PhantomCounters"] {
        let golden = Golden::committed(driver, structure);
        for leaf in CHeader::of(reader).leaves(structure) {
            let is_period = driver != current_version() && leaf.path == "period_ns";
            let value = if is_period { PERIOD } else { golden.value(&leaf.path).unwrap_or("0") };
            let line = format!("{structure}.{} = {value}", leaf.path);
            assert!(printed.lines().any(|found| found == line), "expected {line:?} in\n{printed}");
            compared += 1;
        }
    }
    assert!(compared > 250, "only {compared} numbers");
}

/// Of the older drivers: the golden one is shorter than that of any driver.
const PERIOD_NS: u64 = 1_001_006;
/// As it is printed.
const PERIOD: &str = "1001006";

fn golden_frame(version: &str) -> Frame {
    bytemuck::pod_read_unaligned(&Golden::committed(version, "PhantomFrame").bytes)
}

/// Makes the memory of a driver of today say what the golden one says.
fn speak_gold(memory: &DriverMemory) {
    let version = current_version();
    let fill = |structure: &str, words: &[&AtomicU64]| {
        let bytes = Golden::committed(&version, structure).bytes;
        assert_eq!(bytes.len(), words.len() * 8, "{structure}: every word");
        for (word, value) in words.iter().zip(bytes.chunks_exact(8)) {
            word.store(u64::from_le_bytes(value.try_into().unwrap()), Ordering::Relaxed);
        }
    };
    let h = &memory.header;
    fill(
        "PhantomDriverHeader",
        &[
            &h.magic,
            &h.abi_version,
            &h.layout_hash,
            &h.segment_bytes,
            &h.driver_pid,
            &h.period_ns,
            &h.reply_budget_ns,
            &h.max_command_age_ticks,
            &h.ramp_out_ticks,
            &h.ramp_in_ticks,
            &h.device_count,
            &h.clock_mode,
            &h.wait_mode,
            &h.cpu_plus_one,
            &h.flags,
            &h.ready,
        ],
    );
    let c = &memory.counters;
    fill(
        "PhantomCounters",
        &[
            &c.ticks,
            &c.overruns,
            &c.ticks_commanded,
            &c.replies_fresh,
            &c.replies_missed,
            &c.commands_torn,
            &c.commands_refused,
            &c.forces_limited,
            &c.leases_granted,
            &c.leases_refused,
            &c.faults,
            &c.log_dropped,
            &c.forces_slewed,
            &c.forces_derated,
            &c.forces_faded,
            &c.ticks_unattended,
        ],
    );
    let d = &memory.devices[0];
    let single = [&d.peak_force_n, &d.continuous_force_n];
    let late = [&d.slew_n_per_s, &d.speed_limit_m_per_s];
    let words: Vec<&AtomicU64> = (d.name.iter().chain(&d.kind).chain(single))
        .chain(d.workspace_min_m.iter().chain(&d.workspace_max_m).chain(late).chain(&d.reserved))
        .collect();
    fill("PhantomDeviceDescription", &words);
}

/// A driver of today in the background, which publishes the golden frame.
fn golden_host(directory: &Path) -> Host {
    let host = Host::start_with(directory, &info_of(MAX_DEVICES));
    speak_gold(&host.memory);
    host.memory.write_frame(&golden_frame(&current_version()));
    host.memory.ring(TICK, None);
    host
}

#[test]
fn an_observer_built_with_older_headers_reads_every_field_it_knows_from_a_driver_of_today() {
    for old in OLDER {
        let directory = directory();
        let Some(program) = reader_of(old, directory.path()) else { return };
        let host = golden_host(directory.path());
        let printed = printed(start(&program, &host.socket, &["observe", &TICK.to_string()]));
        assert!(printed.starts_with(&format!("built for {old}\n")), "{printed}");
        assert_read(&printed, old, &current_version());
        // A reason that 1.0 does not list: a fault it is all the same.
        assert!(printed.contains(&format!("PhantomFrame.state = {}\n", DriverState::Fault as u64)));
        assert!(
            printed.ends_with(&format!("a fault of kind {}\n", FaultReason::Overrun as u64)),
            "{printed}"
        );
    }
}

#[test]
fn a_commander_built_with_older_headers_gets_the_lease_and_its_commands_are_believed() {
    OLDER.iter().for_each(|old| command_as(old));
}

fn command_as(old: &str) {
    const COUNT: u64 = 50;
    let directory = directory();
    let Some(program) = reader_of(old, directory.path()) else { return };
    let host = golden_host(directory.path());
    let child = start(&program, &host.socket, &["command", &TICK.to_string(), &COUNT.to_string()]);
    let ServerEvent::LeaseGranted { view, name, .. } = host.event() else { panic!("no lease") };
    assert_eq!(name, "c_reader");
    for tick in TICK..TICK + COUNT {
        let frame = Frame { tick, ..golden_frame(&current_version()) };
        host.memory.write_frame(&frame);
        host.memory.ring(tick, Some(&view));
        assert_answer(&view, &host.memory, &frame);
    }
    drop(host);
    assert!(printed(child).starts_with(&format!("built for {old}\n")));
}

/// Waits for the answer to `frame`; it must be believed and command the position as force.
fn assert_answer(view: &CommanderView, memory: &DriverMemory, frame: &Frame) {
    wait_until("the answer is there", || {
        let newest = view.latest_tick();
        if newest != Some(frame.tick) {
            view.sleep_for_command(newest, memory, limit());
        }
        newest == Some(frame.tick)
    });
    let mut command = Command::zeroed();
    view.read_command(frame.tick, &mut command).unwrap();
    command.validate(frame.tick, view.lease(), frame.device_count).unwrap();
    for (commanded, device) in command.devices.iter().zip(&frame.devices) {
        assert_eq!(commanded.force_on_user_n, device.position_m_measured);
    }
}

/// The two segments of a driver of an older version, forged.
struct OldDriver {
    version: &'static str,
    header: CHeader,
    driver: File,
    commander: File,
}

impl OldDriver {
    fn forge(version: &'static str) -> Self {
        let header = CHeader::of(version);
        let driver = memfd(header.size_of("PhantomDriverSegment"));
        let at = |field| header.offset_of("PhantomDriverSegment", field) as u64;
        let golden = |structure| Golden::committed(version, structure).bytes;
        let put = |offset: u64, bytes: &[u8]| driver.write_all_at(bytes, offset).unwrap();
        put(at("header"), &golden("PhantomDriverHeader"));
        let period = header.offset_of("PhantomDriverHeader", "period_ns") as u64;
        put(at("header") + period, &PERIOD_NS.to_le_bytes());
        put(at("counters"), &golden("PhantomCounters"));
        let description = golden("PhantomDeviceDescription");
        for device in 0..header.number("PHANTOM_MAX_DEVICES") {
            put(at("devices") + device * description.len() as u64, &description);
        }
        let slot = at("frames")
            + TICK % header.number("PHANTOM_RING_FRAMES") * header.size_of("PhantomFrameSlot") as u64;
        put(slot + header.offset_of("PhantomFrameSlot", "sequence") as u64, &(2 * TICK + 2).to_le_bytes());
        put(slot + header.offset_of("PhantomFrameSlot", "words") as u64, &golden("PhantomFrame"));
        put(
            at("bell") + header.offset_of("PhantomBell", "latest_plus_one") as u64,
            &(TICK + 1).to_le_bytes(),
        );
        put(
            at("bell") + header.offset_of("PhantomBell", "doorbell") as u64,
            &(TICK as u32 + 1).to_le_bytes(),
        );
        let commander = memfd(header.size_of("PhantomCommanderSegment"));
        let answer = golden("PhantomAnswer");
        let words = [
            ("magic", shm_abi::layout::MAGIC),
            ("abi_version", (1 << 32) | minor_of(version)),
            ("layout_hash", LAYOUT_HASH),
        ];
        for (field, word) in words {
            let offset = header.offset_of("PhantomCommanderHeader", field) as u64;
            commander.write_all_at(&word.to_le_bytes(), offset).unwrap();
        }
        let lease = header.offset_of("PhantomAnswer", "lease");
        let offset = header.offset_of("PhantomCommanderHeader", "lease") as u64;
        commander.write_all_at(&answer[lease..lease + 8], offset).unwrap();
        Self { version, header, driver, commander }
    }

    /// Hands both segments to so many clients, whatever they ask for.
    fn serve(&self, socket: &Path, clients: usize) -> std::thread::JoinHandle<()> {
        let (driver, commander) = (self.driver.try_clone().unwrap(), self.commander.try_clone().unwrap());
        let answer = Golden::committed(self.version, "PhantomAnswer").bytes;
        fake_server(socket, clients, move |mut stream| {
            hear(&mut stream);
            send(&stream, &answer, &[driver.as_fd(), commander.as_fd()]);
        })
    }

    /// The command that stands in the slot of a tick, whole.
    fn command(&self, tick: u64) -> Vec<u8> {
        let header = &self.header;
        let slot = header.offset_of("PhantomCommanderSegment", "commands")
            + (tick % header.number("PHANTOM_RING_COMMANDS")) as usize * header.size_of("PhantomCommandSlot");
        let mut sequence = [0; 8];
        self.commander.read_exact_at(&mut sequence, slot as u64).unwrap();
        assert_eq!(u64::from_le_bytes(sequence), 2 * tick + 2);
        let mut bytes = vec![0; header.size_of("PhantomCommand")];
        let words = slot + header.offset_of("PhantomCommandSlot", "words");
        self.commander.read_exact_at(&mut bytes, words as u64).unwrap();
        bytes
    }
}

fn minor_of(version: &str) -> u64 {
    version.split_once('.').unwrap().1.parse().unwrap()
}

fn memfd(bytes: usize) -> File {
    use rustix::fs::{MemfdFlags, SealFlags};
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let file = File::from(rustix::fs::memfd_create(c"forged", flags).unwrap());
    file.set_len(bytes as u64).unwrap();
    rustix::fs::fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW).unwrap();
    file
}

#[test]
fn a_rust_client_of_today_reads_sensible_values_from_an_older_driver_and_commands_it() {
    OLDER.into_iter().for_each(command_older);
}

fn command_older(version: &'static str) {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let old = OldDriver::forge(version);
    let serving = old.serve(&socket, 1);
    let attached = client::command(&socket, "today").unwrap();
    serving.bounded_join().unwrap();

    let minor = minor_of(version);
    assert_eq!(u64::from(attached.driver.abi_minor()), minor);
    let is_first = minor == 0;
    let DriverInfo { devices, is_commissioning, period_ns, .. } = attached.driver.info();
    assert_eq!((devices.len(), period_ns, is_commissioning), (MAX_DEVICES, PERIOD_NS, !is_first));
    for device in &devices {
        assert_eq!((device.name.as_str(), device.peak_force_n), ("golden", 11.5));
        assert_eq!(device.slew_n_per_s.is_infinite(), is_first, "not told");
        assert_eq!(device.speed_limit_m_per_s.is_infinite(), is_first, "not told");
    }
    let frame = attached.driver.read_latest().unwrap();
    assert_eq!(frame, golden_frame(version));
    assert_eq!(frame.inputs == 0, is_first, "no switches");
    let fault = if is_first { FaultReason::Panic } else { FaultReason::Overrun };
    assert_eq!(FaultReason::from_word(frame.fault), Some(fault));
    for device in frame.present_devices() {
        let absent = (device.velocity_m_per_s_estimated, device.limits, device.motor_heat);
        assert_eq!(absent == ([0.0; 3], 0, 0.0), is_first);
        assert_eq!(device.joint_velocity_rad_per_s_estimated == [0.0; 3], minor < 2, "since 1.2");
    }
    let commander = attached.commander.unwrap();
    let mut command: Command =
        bytemuck::pod_read_unaligned(&Golden::committed(version, "PhantomCommand").bytes);
    command.tick = TICK;
    command.lease = commander.lease();
    commander.publish(&command, &attached.driver);
    assert_eq!(old.command(TICK), bytemuck::bytes_of(&command));
    assert_eq!(commander.lease(), 1007, "the one in the old driver's words");
}

#[test]
fn a_c_client_of_today_reads_zero_where_an_older_driver_says_nothing_and_commands_it() {
    OLDER.into_iter().for_each(command_older_from_c);
}

fn command_older_from_c(version: &'static str) {
    let directory = directory();
    let Some(program) = reader_of(&current_version(), directory.path()) else { return };
    let socket = directory.path().join("driver.sock");
    let old = OldDriver::forge(version);
    // This server hangs up at once, so that a commander ends by itself.
    let serving = old.serve(&socket, 2);
    let printed_by = |what: &str| printed(start(&program, &socket, &[what, &TICK.to_string()]));
    let observed = printed_by("observe");
    assert!(observed.starts_with(&format!("built for {}\n", current_version())));
    assert_read(&observed, &current_version(), version);
    let is_silent = observed.contains("PhantomFrame.devices[0].joint_velocity_rad_per_s_estimated[0] = 0\n");
    assert_eq!(is_silent, minor_of(version) < 2, "since 1.2");
    assert_read(&printed_by("command"), &current_version(), version);
    serving.bounded_join().unwrap();
    let command: Command = bytemuck::pod_read_unaligned(&old.command(TICK));
    assert_eq!(command.validate(TICK, 1007, MAX_DEVICES as u64), Ok(()));
    assert_eq!(command.devices[7].force_on_user_n, golden_frame(version).devices[7].position_m_measured);
}

#[test]
fn asking_a_driver_for_what_a_later_version_added_is_refused_with_both_versions() {
    type Ask = fn(&Path) -> Result<(), AttachError>;
    let later: [(u64, u64, Ask); 2] = [
        (1, 6, |socket| client::zero(socket, "today", 0)),
        (2, 7, |socket| client::end_lease(socket, "today")),
    ];
    for (minor, kind, ask) in later {
        let abi_version = (1 << 32) | minor;
        let refusal = refused_with(Answer { abi_version, ..Answer::new(Verdict::UnknownKind) }, ask);
        let expected = format!(
            "the driver speaks version 1.{minor} of the shared-memory contract and does not know requests of kind \
             {kind}, this program speaks {}; start the driver that belongs to this program",
            current_version()
        );
        assert_eq!(refusal.to_string(), expected);
    }
}

/// What a client says of such an answer.
fn refused_with(answer: Answer, ask: fn(&Path) -> Result<(), AttachError>) -> AttachError {
    let directory = directory();
    let socket = directory.path().join("driver.sock");
    let serving = fake_server(&socket, 1, move |mut stream| {
        hear(&mut stream);
        send(&stream, bytemuck::bytes_of(&answer), &[]);
    });
    let refusal = ask(&socket).unwrap_err();
    serving.bounded_join().unwrap();
    refusal
}

#[test]
fn who_may_not_is_told_who_may() {
    let user = rustix::process::geteuid().as_raw();
    let owners = match user {
        0 => "root and the user that the driver runs as, by the numbers of the driver's own user namespace,",
        _ => "root and the user that the driver runs as",
    };
    for (allowed_group_plus_one, allowed) in
        [(0, owners), (1, "members of group 0 (root)"), (4_000_000_001, "members of group 4000000000")]
    {
        let answer = Answer { allowed_group_plus_one, ..Answer::new(Verdict::NotAllowed) };
        let refusal = refused_with(answer, |socket| client::end_lease(socket, "today")).to_string();
        let expected = format!(
            "does not let user {user} end the lease of whoever commands: {allowed} may; ask one of these, or its \
             administrator"
        );
        assert!(refusal.ends_with(&expected), "{refusal}");
    }
}

#[test]
fn a_request_to_zero_names_its_devices_and_who_asks() {
    let directory = directory();
    let host = Host::start(directory.path());
    for mask in [0, 0b101] {
        client::zero(&host.socket, "today", mask).unwrap();
        let ServerEvent::ZeroRequested { pid, devices, .. } = host.event() else { panic!("not heard") };
        assert_eq!((pid, devices), (own_pid(), mask));
    }
}

/// The motors are off where a frame of an emergency stop shows no force of any device.
#[test]
fn whoever_stops_the_motors_is_told_what_the_newest_frame_shows() {
    let directory = directory();
    let host = Host::start(directory.path());
    let told = || client::emergency_stop_over_connection(&host.socket, "today").unwrap().latest();
    assert_eq!(told(), None, "there is no frame");
    let (fault, stop) = (DriverState::Fault as u64, FaultReason::EmergencyStop as u64);
    let mut frame = Frame { device_count: 2, state: DriverState::Active as u64, ..Frame::zeroed() };
    frame.devices[1].force_on_user_n_applied = [0.0, 0.1, 0.0];
    let mut newest = |change: &dyn Fn(&mut Frame)| {
        change(&mut frame);
        frame.tick += 1;
        host.memory.write_frame(&frame);
        host.memory.ring(frame.tick, None);
        told()
    };
    assert_eq!(newest(&|frame| frame.fault = 0), Some((1, false)));
    assert_eq!(
        newest(&|frame| (frame.state, frame.fault) = (fault, stop)),
        Some((2, false)),
        "still a force"
    );
    assert_eq!(newest(&|frame| frame.devices[1] = Zeroable::zeroed()), Some((3, true)));
    assert_eq!(
        newest(&|frame| frame.fault = FaultReason::Overspeed as u64),
        Some((4, false)),
        "another fault"
    );
    assert_eq!(newest(&|frame| (frame.state, frame.fault) = (0, stop)), Some((5, false)), "left");
}
