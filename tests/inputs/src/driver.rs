//! Files of the driver, its socket, and the replies that it is given.

use crate::check_message;
use bytemuck::Zeroable;
use io_driver::config::DriverConfig;
use io_driver::device_file::DeviceFile;
use io_driver::sim::script::HandScript;
use patience::BoundedThread;
use shm_abi::doorbell::WaitMode;
use shm_abi::handshake::{Request, RequestKind};
use shm_abi::segment::{ClockMode, CommanderMemory, CommanderView, DriverInfo, DriverMemory, DriverView};
use shm_abi::server::Server;
use shm_abi::{Command, client};
use std::cell::RefCell;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

/// A configuration of the driver, or the description of a device.
pub fn config(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let file = Path::new("/nowhere/at/all/driver.toml");
    if let Err(error) = DriverConfig::parse(text, file) {
        check_message(&error.to_string());
    }
    if let Err(error) = DeviceFile::parse(text, file) {
        check_message(&error.to_string());
    }
}

/// A hand's path.
pub fn hand_csv(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match HandScript::parse(text, Path::new("hand.csv"), &["f0", "f1"]) {
        Ok(script) => assert!(script.duration_s().is_finite(), "an endless script"),
        Err(error) => check_message(&error.to_string()),
    }
}

/// A segment that its commander spoils after a good reply: what is believed of it is finite and of the tick that was asked
/// for. The first two bytes say from where on the others are laid over it.
pub fn reply(bytes: &[u8]) {
    COMMANDER.with_borrow(|commander| commander.answer(bytes));
}

/// A client that says anything, in pieces; afterwards another one is still answered.
pub fn server(bytes: &[u8]) {
    HOST.with_borrow_mut(|host| host.suffer(bytes));
}

thread_local! {
    static COMMANDER: RefCell<Commander> = RefCell::new(Commander::new());
    static HOST: RefCell<Host> = RefCell::new(Host::new());
}

/// A commander's segment, and what the driver sees of it.
struct Commander {
    driver: DriverView,
    memory: CommanderMemory,
    view: CommanderView,
    segment: File,
}

impl Commander {
    const LEASE: u64 = 7;
    const TICK: u64 = 5;

    fn new() -> Self {
        let (view, fd) = CommanderView::create(Self::LEASE).expect("a segment");
        let driver = HOST.with_borrow(|host| DriverView::map(host.memory.fd())).expect("our own segment");
        let memory = CommanderMemory::map(fd.as_fd()).expect("a segment");
        Self { driver, memory, view, segment: File::from(fd) }
    }

    fn answer(&self, bytes: &[u8]) {
        self.memory.publish(&Command::zero(Self::TICK, Self::LEASE, 2), &self.driver);
        self.spoil(bytes);
        self.check();
        // Flipped again they are what they were.
        self.spoil(bytes);
    }

    fn check(&self) {
        let rung = self.view.latest_tick().unwrap_or_default();
        for tick in [rung, Self::TICK, 0, u64::MAX] {
            let mut command = Command::zeroed();
            let is_read = self.view.read_command(tick, &mut command).is_ok();
            if is_read && command.validate(tick, Self::LEASE, 2).is_ok() {
                let forces = command.devices[..2].iter().flat_map(|device| device.force_on_user_n);
                assert!(forces.into_iter().all(f64::is_finite), "a force that is none");
                assert_eq!((command.tick, command.lease), (tick, Self::LEASE));
            }
        }
    }

    /// Flips the bits that are set in `bytes`; what is beyond the segment's end is not there.
    fn spoil(&self, bytes: &[u8]) {
        let Some((at, flips)) = bytes.split_first_chunk() else { return };
        let at = 8 * u64::from(u16::from_le_bytes(*at));
        let mut there = vec![0; flips.len()];
        let read = self.segment.read_at(&mut there, at).unwrap_or_default();
        there.truncate(read);
        there.iter_mut().zip(flips).for_each(|(byte, flip)| *byte ^= flip);
        let _ = self.segment.write_all_at(&there, at);
    }
}

struct Host {
    server: Server,
    memory: DriverMemory,
    directory: TempDir,
}

impl Host {
    fn new() -> Self {
        let directory = TempDir::new().expect("a directory");
        let server = Server::bind(&directory.path().join("driver.sock")).expect("a socket");
        let info = DriverInfo {
            period_ns: 1_000_000,
            reply_budget_ns: 500_000,
            max_command_age_ticks: 3,
            ramp_in_ticks: 100,
            ramp_out_ticks: 10,
            is_commissioning: false,
            clock_mode: ClockMode::Virtual,
            wait_mode: WaitMode::Futex,
            cpu: None,
            devices: Vec::new(),
            setup_report: String::new(),
        };
        Self { server, memory: DriverMemory::create(&info).expect("a segment"), directory }
    }

    fn suffer(&mut self, bytes: &[u8]) {
        let socket = self.directory.path().join("driver.sock");
        let mut stream = UnixStream::connect(&socket).expect("it listens");
        stream.set_nonblocking(true).expect("a socket");
        self.poll();
        // The first byte says in how large pieces; the others are said as they are, or laid over a good request.
        let (first, said) = bytes.split_first().map_or((1, bytes), |(first, said)| (*first, said));
        let said = if first & 1 == 0 { said.to_vec() } else { spoilt_request(first, said) };
        for part in said.chunks(1 + usize::from(first / 2)) {
            let _ = stream.write(part);
            self.poll();
        }
        let _ = stream.read(&mut [0; 4096]);
        drop(stream);
        self.poll();
        self.poll();
        self.check_that_others_are_served(&socket);
    }

    fn check_that_others_are_served(&mut self, socket: &Path) {
        let socket = socket.to_path_buf();
        let asking = std::thread::spawn(move || client::observe(&socket, "somebody else").map(drop));
        for _ in 0..MOST_POLLS {
            self.poll_for(Duration::from_millis(1));
            if asking.is_finished() {
                break;
            }
        }
        asking.bounded_join().expect("no panic").expect("an observer is served, whoever came before");
        self.poll();
    }

    fn poll(&mut self) {
        self.poll_for(Duration::ZERO);
    }

    fn poll_for(&mut self, wait: Duration) {
        let mut events = Vec::new();
        self.server.poll(&self.memory, wait, &mut events).expect("it goes on");
    }
}

/// A request of this version, of a kind that a bit of `first` says, with the bits flipped that are set in `flips`.
fn spoilt_request(first: u8, flips: &[u8]) -> Vec<u8> {
    let kind = if first & 2 == 0 { RequestKind::Command } else { RequestKind::Observe };
    let mut request = bytemuck::bytes_of(&Request::new(kind, "fuzz")).to_vec();
    request.iter_mut().zip(flips).for_each(|(byte, flip)| *byte ^= flip);
    request.extend(flips.get(request.len()..).unwrap_or_default());
    request
}

/// Of a millisecond each: five seconds, in which anybody is served.
const MOST_POLLS: u32 = 5000;
