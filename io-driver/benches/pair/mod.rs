//! A driver and its commander in one process, for the benches.

use io_driver::config::DriverConfig;
use io_driver::cycle::Cycle;
use io_driver::driver::{describe, make_cycle};
use io_driver::open::open_devices;
use shm_abi::doorbell::WaitMode;
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverView};
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::Arc;

const LEASE: u64 = 1;
/// A device without mechanics.
pub(crate) const IDEAL: &str = "[[device]]\nbackend = \"ideal\"\npeak_force_n = 8.5\n";
/// A device with the whole kinematics.
#[allow(dead_code, reason = "not every bench has one")]
pub(crate) const PREMIUM: &str =
    "[[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"traces/circle.csv\"\n";

/// An arm that this process simulates, in a pen grip that trembles.
#[allow(dead_code, reason = "not every bench has one")]
pub(crate) const SIMULATED: &str =
    "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\ngravity_compensation = true\n";

/// A driver and its commander, as under the virtual clock.
pub(crate) struct Pair {
    #[allow(dead_code, reason = "not every bench serves it")]
    pub(crate) memory: Arc<DriverMemory>,
    pub(crate) cycle: Cycle,
    pub(crate) driver: DriverView,
    pub(crate) commander: CommanderMemory,
    pub(crate) command: Command,
    pub(crate) tick: u64,
}

impl Pair {
    /// So many devices of one kind, under a lease with full authority.
    pub(crate) fn new(device: &str, count: usize) -> Self {
        Self::at_rate(1000, device, count)
    }

    /// The same at another rate (Hz).
    pub(crate) fn at_rate(rate_hz: u32, device: &str, count: usize) -> Self {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/driver/bench.toml"));
        let config = DriverConfig::parse(&format!("rate_hz = {rate_hz}\n{}", device.repeat(count)), file)
            .expect("a configuration");
        let devices = open_devices(&config).expect("devices");
        let info = describe(&config, &devices, WaitMode::Spin);
        let memory = Arc::new(DriverMemory::create(&info).expect("memory"));
        let driver = DriverView::map(memory.fd()).expect("a view");
        let (view, fd) = CommanderView::create(LEASE).expect("a lease");
        let commander = CommanderMemory::map(fd.as_fd()).expect("its memory");
        let mut cycle = make_cycle(&config, Arc::clone(&memory), devices);
        cycle.grant(view);
        cycle.change_lease();
        let mut command = Command::zero(0, LEASE, count as u64);
        // Above the peak for a Premium and an ideal device here: the limit is part of the work.
        command.devices[..count].iter_mut().for_each(|device| device.force_on_user_n = [6.0, -6.0, 3.0]);
        let mut pair = Self { memory, cycle, driver, commander, command, tick: 0 };
        // Past the ramp of 200 ticks, and round the ring of frames once, so that every page is warm.
        (0..5000).for_each(|_| pair.tick());
        assert_eq!(pair.cycle.safety().authority(), 1.0);
        pair
    }

    /// One whole tick under the lease.
    pub(crate) fn tick(&mut self) {
        self.tick += 1;
        self.cycle.sense(self.tick, 0);
        self.command.tick = self.tick;
        self.commander.publish(&self.command, &self.driver);
        assert!(self.cycle.take_reply());
        self.cycle.actuate();
    }
}
