//! A driver's cycle without a clock, and a device that does what the test says.

#![allow(dead_code, unreachable_pub, reason = "each test uses some of it")]

use bytemuck::Zeroable;
use io_driver::cycle::{Cycle, Freshness, Protection};
use io_driver::device::{Device, Effort, Extras, Reading, TickTime, Written};
use io_driver::safety::Restrained;
use io_driver::safety::switches::Switches;
use io_driver::safety::{Ramps, Safety};
use io_driver::velocity::VelocityEstimator;
use io_driver::zeroing::ZeroState;
use nalgebra::Vector3;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DeviceInfo, DriverInfo};
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverView, FaultReason, Frame};
use std::os::fd::AsFd;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub const PERIOD_NS: u64 = 1_000_000;
/// Four ticks in, two ticks out; commands may be two ticks old.
pub const RAMPS: Ramps =
    Ramps { in_ns: 4 * PERIOD_NS, out_ns: 2 * PERIOD_NS, max_command_age_ns: 2 * PERIOD_NS };
pub const PEAK_N: f64 = 8.5;

/// What a device is made to do by the test, and what it was made to do by the driver.
#[derive(Default)]
pub struct Log {
    pub forces: Vec<Vector3<f64>>,
    pub next_reading: Option<Result<Reading, FaultReason>>,
    pub fail_write: bool,
    /// What it says that it had to cut itself.
    pub limits: u64,
    pub releases: u32,
    pub rearms: u32,
    /// Its counters.
    pub counts: [i64; 6],
    /// Whether it has to be zeroed; `None`: never.
    pub needs_zero: Option<bool>,
    pub extras: Extras,
    /// The time that reading it takes, and writing it.
    pub takes: Duration,
}

/// Its velocity is the plain difference of its positions.
pub struct TestDevice {
    pub velocity: VelocityEstimator,
    pub info: DeviceInfo,
    pub log: Arc<Mutex<Log>>,
}

impl TestDevice {
    fn take_time(&self) {
        let takes = self.log.lock().unwrap().takes;
        if !takes.is_zero() {
            std::thread::sleep(takes);
        }
    }
}

impl Device for TestDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        self.take_time();
        let planned = self.log.lock().unwrap().next_reading.take();
        let encoder_counts = self.log.lock().unwrap().counts;
        let usual = Reading { encoder_counts, ..Reading::at(Vector3::new(0.1, 0.2, 0.3)) };
        let reading = planned.unwrap_or(Ok(usual))?;
        let velocity_m_per_s = self.velocity.observe(time, reading.position_m.into()).into();
        Ok(Reading { velocity_m_per_s, ..reading })
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        Restrained::whole(effort.force_on_user_n)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        self.take_time();
        let force_on_user_n = effort.force_on_user_n;
        let mut log = self.log.lock().unwrap();
        log.forces.push(force_on_user_n);
        if log.fail_write {
            Err(FaultReason::DeviceWrite)
        } else {
            Ok(Written { force_on_user_n, limits: log.limits, ..Written::default() })
        }
    }

    fn release(&mut self) {
        self.log.lock().unwrap().releases += 1;
    }

    fn rearm(&mut self) {
        self.velocity.forget();
        self.log.lock().unwrap().rearms += 1;
    }

    fn extras(&self) -> Extras {
        self.log.lock().unwrap().extras
    }

    fn zero_state(&self) -> ZeroState {
        match self.log.lock().unwrap().needs_zero {
            None => ZeroState::Innate,
            Some(true) => ZeroState::Needed,
            Some(false) => ZeroState::Zeroed,
        }
    }

    fn zero(&mut self) {
        self.log.lock().unwrap().needs_zero = Some(false);
        // Its positions are places, not counts: they jump at a zero.
        self.velocity.forget();
    }

    fn lose_zero(&mut self) {
        let needs = &mut self.log.lock().unwrap().needs_zero;
        *needs = needs.map(|_| true);
    }
}

/// A driver's cycle and the test's ends of it.
pub struct Bench {
    pub cycle: Cycle,
    pub view: DriverView,
    pub log: Arc<Mutex<Log>>,
    /// Those of all devices; the one above is the first's.
    pub logs: Vec<Arc<Mutex<Log>>>,
    pub tick: u64,
}

/// A device without limits but its peak.
pub fn usual_device() -> DeviceInfo {
    DeviceInfo {
        name: "d".into(),
        kind: "test".into(),
        peak_force_n: PEAK_N,
        continuous_force_n: PEAK_N,
        workspace_min_m: [-1.0; 3],
        workspace_max_m: [1.0; 3],
        slew_n_per_s: f64::INFINITY,
        speed_limit_m_per_s: f64::INFINITY,
    }
}

impl Bench {
    pub fn new(freshness: u64) -> Self {
        Self::with(freshness, usual_device(), Switches::default())
    }

    /// One with a device and switches of the test's own.
    pub fn with(freshness: u64, info: DeviceInfo, switches: Switches) -> Self {
        Self::of(freshness, vec![info], switches)
    }

    /// One with several devices.
    pub fn of(freshness: u64, devices: Vec<DeviceInfo>, switches: Switches) -> Self {
        let memory = DriverMemory::create(&DriverInfo {
            period_ns: PERIOD_NS,
            reply_budget_ns: u64::MAX,
            max_command_age_ticks: RAMPS.max_command_age_ns / PERIOD_NS,
            ramp_in_ticks: RAMPS.in_ns / PERIOD_NS,
            ramp_out_ticks: RAMPS.out_ns / PERIOD_NS,
            clock_mode: ClockMode::Virtual,
            wait_mode: WaitMode::Spin,
            is_commissioning: false,
            cpu: None,
            devices: devices.clone(),
            setup_report: String::new(),
        })
        .unwrap();
        let view = DriverView::map(memory.fd()).unwrap();
        let logs: Vec<_> = devices.iter().map(|_| Arc::new(Mutex::new(Log::default()))).collect();
        let device = |(info, log): (DeviceInfo, &Arc<Mutex<Log>>)| -> Box<dyn Device> {
            let velocity = VelocityEstimator::of_exact_places();
            Box::new(TestDevice { velocity, info, log: Arc::clone(log) })
        };
        let devices = devices.into_iter().zip(&logs).map(device).collect();
        let protection = Protection { safety: Safety::new(RAMPS), switches, workspace_margin_m: 0.02 };
        let cycle = Cycle::new(Arc::new(memory), devices, protection, PERIOD_NS, Freshness(freshness));
        Self { cycle, view, log: Arc::clone(&logs[0]), logs, tick: 0 }
    }

    /// The same, whose deadlines are times of the monotonic clock.
    pub fn in_real_time(self) -> Self {
        Self { cycle: self.cycle.in_real_time(), ..self }
    }

    pub fn lease(&mut self, number: u64) -> CommanderMemory {
        let (view, fd) = CommanderView::create(number).unwrap();
        assert!(self.cycle.grant(view).is_none());
        CommanderMemory::map(fd.as_fd()).unwrap()
    }

    /// One tick; `answer` gets the frame and may publish. Returns the frame and the force written.
    pub fn tick(&mut self, answer: impl FnOnce(&Frame, &DriverView)) -> (Frame, Vector3<f64>) {
        self.tick_due_at((self.tick + 1) * PERIOD_NS, answer)
    }

    /// The same of the deadline `deadline_ns`.
    pub fn tick_due_at(
        &mut self,
        deadline_ns: u64,
        answer: impl FnOnce(&Frame, &DriverView),
    ) -> (Frame, Vector3<f64>) {
        self.tick += 1;
        self.cycle.change_lease();
        self.cycle.sense(self.tick, deadline_ns);
        let mut frame = Frame::zeroed();
        self.view.read_frame(self.tick, &mut frame).unwrap();
        answer(&frame, &self.view);
        self.cycle.take_reply();
        self.cycle.actuate();
        (frame, *self.log.lock().unwrap().forces.last().unwrap())
    }

    pub fn silent_tick(&mut self) -> (Frame, Vector3<f64>) {
        self.tick(|_, _| {})
    }

    /// Answers until the force is let through in full.
    pub fn ramp_in(&mut self, commander: &CommanderMemory, force: [f64; 3]) {
        let mut answered = || self.tick(|frame, view| publish(commander, view, frame.tick, force)).0;
        // Ramped out, answered for the first time, and ramped in.
        let most_ticks = 2 * (RAMPS.in_ns + RAMPS.out_ns + RAMPS.max_command_age_ns) / PERIOD_NS;
        let last = (0..most_ticks).map(|_| answered()).find(|frame| frame.authority >= 1.0);
        assert!(
            last.is_some(),
            "{most_ticks} answers do not let the force through in full: {:?}",
            answered()
        );
    }

    pub fn counter(&self, pick: impl Fn(&shm_abi::layout::Counters) -> &std::sync::atomic::AtomicU64) -> u64 {
        pick(&self.view.counters).load(Ordering::Relaxed)
    }
}

pub fn command(commander: &CommanderMemory, tick: u64, force: [f64; 3]) -> Command {
    let mut command = Command::zero(tick, commander.lease(), 1);
    command.devices[0].force_on_user_n = force;
    command
}

pub fn publish(commander: &CommanderMemory, view: &DriverView, tick: u64, force: [f64; 3]) {
    commander.publish(&command(commander, tick, force), view);
}
