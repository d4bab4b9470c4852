//! Which tick's command drives the motors, on the virtual clock.

use bytemuck::Zeroable;
use io_driver::config::ReplyMode;
use patience::prelude::*;
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::fast_thread::{self, FastEnd, FastRemains, FastShared};
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue;
use phantom3::simulated::SimulatedDevices;
use phantom3::virtual_clock::VirtualDriver;
use rt_core::signals::StopSignals;
use shm_abi::doorbell::WaitMode;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::segment::ClockMode;
use shm_abi::segment::DriverInfo;
use shm_abi::{CommanderMemory, CommanderView, DriverMemory, DriverState, DriverView, Frame, ReplyKind};
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use world::Scene;

const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"wall\"\nstiffness_n_per_m = 500.0\n\
                     shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.002 }\n";

const LEASE: u64 = 7;

fn rig() -> Rig {
    let file = Path::new("scene.toml");
    let hand_mode = HandMode::Impedance(SimulatedDevices::default());
    let scene = Scene::parse(SCENE, file).expect("a scene");
    Rig::new(file, scene, None, None, hand_mode, 1_000_000).expect("a rig")
}

/// A driver in real time that this test plays: no tick is later than the test, however busy the machine.
fn driver_info() -> DriverInfo {
    DriverInfo {
        period_ns: 1_000_000,
        reply_budget_ns: 500_000,
        max_command_age_ticks: 5,
        ramp_in_ticks: 1,
        ramp_out_ticks: 1,
        is_commissioning: false,
        clock_mode: ClockMode::Real,
        wait_mode: WaitMode::Futex,
        cpu: None,
        devices: Vec::new(),
        setup_report: String::new(),
    }
}

fn frame(tick: u64, lease: u64) -> Frame {
    let mut frame =
        Frame { tick, lease, device_count: 1, state: DriverState::Active as u64, ..Frame::zeroed() };
    frame.run_tick = tick as i64 - 1;
    frame.deadline_ns = tick * 1_000_000;
    frame.devices[0].flags = DEVICE_POSITION_VALID;
    frame
}

/// Whether it comes to be so within as long as the busiest machine takes.
fn comes_true(mut is_so: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while !is_so() {
        if begun.elapsed() > Duration::from_secs(20) {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}

/// A run of a few rows against frames that the test tells.
struct Told {
    memory: DriverMemory,
    replies: CommanderView,
    shared: FastShared,
    thread: JoinHandle<FastRemains>,
}

const ROWS: u64 = 3;

impl Told {
    fn start(shared: FastShared) -> Self {
        let memory = DriverMemory::create(&driver_info()).expect("memory");
        let view = DriverView::map(memory.fd()).expect("memory");
        let (replies, fd) = CommanderView::create(LEASE).expect("memory");
        let commander = CommanderMemory::map(fd.as_fd()).expect("memory");
        let (rows, _queue) = row_queue(0);
        let step = rig().fast_step().expect("a step");
        let fast = FastLoop::new(step, rows, WhenFull::Drop, ROWS, 1_000_000);
        let (_, thread) = fast_thread::start(fast, view, commander, shared.clone()).expect("a thread");
        Self { memory, replies, shared, thread }
    }

    fn tell(&self, tick: u64, lease: u64) {
        self.memory.write_frame(&frame(tick, lease));
        self.memory.ring(tick, Some(&self.replies));
    }

    /// Tells a tick of the lease; whether it is answered.
    fn is_answered(&self, tick: u64) -> bool {
        self.tell(tick, LEASE);
        comes_true(|| self.replies.latest_tick() == Some(tick) || self.thread.is_finished())
            && self.replies.latest_tick() == Some(tick)
    }

    fn end(self) -> FastRemains {
        assert!(comes_true(|| self.thread.is_finished()), "it goes on");
        self.thread.bounded_join().expect("no panic")
    }
}

/// Whoever gives the lease back needs ticks to do so, and each of them would count as a missed reply.
#[test]
fn replies_go_on_after_the_last_row_until_the_lease_is_over() {
    let told = Told::start(FastShared { outlasts: Duration::from_secs(1000), ..FastShared::default() });
    for tick in 1..=40 {
        assert!(told.is_answered(tick), "no reply for tick {tick} of {ROWS} rows");
    }
    assert!(told.shared.is_over.load(Ordering::Acquire), "whoever watches has been told meanwhile");
    told.tell(41, LEASE + 1);
    let remains = told.end();
    assert_eq!((remains.end, remains.fast.tally.rows <= ROWS), (FastEnd::Finished, true));
    assert_eq!(remains.fast.tally.answered, 40, "as the driver counts them");
}

/// The one who would give it back may wait for a terminal, for a disk, for a picture.
#[test]
fn replies_end_soon_after_the_last_row_though_nobody_gives_the_lease_back() {
    let told = Told::start(FastShared { outlasts: Duration::from_millis(50), ..FastShared::default() });
    let last = (1..100_000).find(|tick| !told.is_answered(*tick)).expect("an end");
    assert!(last > ROWS, "{last}");
    assert_eq!(told.end().end, FastEnd::Finished);
}

const SIGNALLED: &str = "reply_modes::a_signal_ends_the_replies_though_nobody_else_looks_at_it";

/// In a process of its own: the handlers are the process's.
#[test]
fn a_signal_ends_the_replies_though_nobody_else_looks_at_it() {
    const ROLE: &str = "REPLY_MODES_TEST_SIGNALLED";
    if std::env::var_os(ROLE).is_none() {
        let mut again = std::process::Command::new(std::env::current_exe().expect("this test"));
        again.args(["--exact", SIGNALLED]).env(ROLE, "");
        assert!(again.bounded_status().expect("it runs").success());
        return;
    }
    let signals = StopSignals::install().expect("handlers");
    let told = Told::start(FastShared { signals, ..FastShared::default() });
    assert!(told.is_answered(1) && told.is_answered(2));
    rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::HUP).expect("itself");
    assert_eq!(told.end().end, FastEnd::Signal(1));
}

/// How many ticks old the command is that drives the motors, once somebody commands.
fn ages(mode: ReplyMode) -> Vec<u64> {
    let rig = rig();
    let mut config = rig.driver_config(ClockMode::Virtual);
    config.reply.mode = mode;
    let mut driver = VirtualDriver::open(&config).expect("devices");
    let (rows, _queue) = row_queue(0);
    let step = rig.fast_step().expect("a step");
    let mut fast = FastLoop::new(step, rows, WhenFull::Drop, u64::MAX, config.period_ns);
    let mut frame = Frame::zeroed();
    let mut ages = Vec::new();
    for tick in 1..400 {
        assert!(!matches!(driver.tick(tick, &mut fast), Turn::Fault(_)));
        driver.view().read_frame(tick, &mut frame).expect("just written");
        if frame.previous.reply == ReplyKind::Fresh as u64 {
            ages.push(tick - 1 - frame.previous.command_tick);
        }
    }
    ages
}

#[test]
fn a_reply_for_the_same_tick_drives_it_and_one_for_the_next_tick_is_always_one_tick_old() {
    for (mode, age) in [(ReplyMode::OnArrival, 0), (ReplyMode::FixedPhase, 0), (ReplyMode::NextTick, 1)] {
        let ages = ages(mode);
        assert!(ages.len() > 390 && ages.iter().all(|found| *found == age), "{mode:?}: {ages:?}");
    }
}
