//! The driver's tick and the application's turn leave the heap alone, whatever the other side does.
//!
//! Each is played over a hundred thousand ticks through everything that may happen in one, under an
//! allocator that counts the calls of this thread. What belongs to other threads (granting leases, throwing
//! mappings away, recording) is done here between the counted parts.

use bytemuck::Zeroable;
use haptics::ContactState;
use io_driver::config::{DriverConfig, period_of};
use io_driver::cycle::Cycle;
use io_driver::device::{Device, Effort, Reading, TickTime, Written};
use io_driver::driver::{describe, make_cycle};
use io_driver::live_hand::{LiveHand, LiveWish};
use io_driver::mail::{Inbox, Letter, Sender, mail};
use io_driver::open::open_devices;
use io_driver::safety::Restrained;
use io_driver::sim::hand::model_file;
use io_driver::status::CounterStatus;
use io_driver::zeroing::{DeviceSet, ZeroState};
use nalgebra::Vector3;
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue_of;
use rt_core::alloc_guard::{self, CountingAllocator};
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DeviceInfo};
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverState, DriverView, FaultReason};
use std::fmt::Write as _;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use system_tests::everything;
use world::Scene;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const TICKS: u64 = 100_000;
/// A lease's life; a prime, so that the events below meet it in ever new phases.
const LEASE_TICKS: u64 = 997;

/// Tests that make mappings take turns, since one of them counts the mappings of the process.
static MAPPINGS: Mutex<()> = Mutex::new(());

fn in_turn() -> MutexGuard<'static, ()> {
    MAPPINGS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn config_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(name)
}

#[test]
fn the_drivers_tick_never_calls_the_heap_whatever_the_commander_does() {
    let _turn = in_turn();
    alloc_guard::assert_installed();
    let mut play = Play::new();
    for tick in 1..=TICKS {
        play.prepare(tick);
        let ((), heap_calls) = alloc_guard::count(|| play.tick(tick));
        assert_eq!(heap_calls, 0, "in tick {tick}");
    }
    // All of it happened, or nothing has been shown.
    let seen = CounterStatus::of(&play.driver);
    assert_eq!(seen.ticks, TICKS);
    for (name, count) in [
        ("fresh", seen.replies_fresh),
        ("missed", seen.replies_missed),
        ("torn", seen.commands_torn),
        ("refused", seen.commands_refused),
        ("limited", seen.forces_limited),
        ("faults", seen.faults),
    ] {
        assert!(count > TICKS / LEASE_TICKS / 2, "{name}: {seen:?}");
    }
    assert!(play.zeros.into_iter().all(|count| count > 10), "{:?}", play.zeros);
    assert!(play.full_authority, "no lease came to full authority");
}

#[test]
fn a_lease_that_ended_is_unmapped_by_the_socket_thread_and_not_by_the_loop() {
    let _turn = in_turn();
    let mut play = Play::new();
    for lease in 1..100 {
        let (view, _fd) = CommanderView::create(lease).unwrap();
        play.sender.post(Letter::Grant(view)).unwrap();
        if lease > 1 {
            play.sender.urgent.end_lease(lease - 1);
        }
        let before = mapped_commanders();
        for tick in 0..3 {
            play.tick(3 * lease + tick);
        }
        assert_eq!(mapped_commanders(), before, "the loop mapped or unmapped something at lease {lease}");
        play.sender.clear_waste();
        assert_eq!(mapped_commanders(), 1, "only the lease in force stays");
    }
}

/// Lines of this process's map that show a commander's segment.
fn mapped_commanders() -> usize {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    maps.lines().filter(|line| line.contains("phantom3-commander")).count()
}

/// A hand that minds slip, another hand that somebody moves live, and nobody.
fn simulated(directory: &Path) -> String {
    let model = model_file::builtin("pen-grip").unwrap().replace("minds_slip = false", "minds_slip = true");
    let file = directory.join("slip.toml");
    std::fs::write(&file, model).unwrap();
    let live = directory.join("live");
    LiveHand::create(&live).unwrap().want(3, &LiveWish::at(Vector3::new(0.01, 0.02, 0.0)));
    let live = format!("live_hand = {:?}\nlive_finger = 3\n", live.to_str().unwrap());
    let device = |arm: &str, hand: &str, more: &str| {
        format!(
            "[[device]]\nbackend = \"simulated\"\ndescription = \"{arm}\"\nhand_model = {hand:?}\ngravity_compensation = true\n{more}"
        )
    };
    let hands = [
        ("premium-1.5", file.to_str().unwrap(), ""),
        ("wooden-haptics", "fingertip", live.as_str()),
        ("premium-1.5", "nobody", ""),
    ];
    hands.map(|(arm, hand, more)| device(arm, hand, more)).concat()
}

/// A driver's tick, and what surrounds it.
struct Play {
    cycle: Cycle,
    inbox: Inbox,
    sender: Sender,
    driver: DriverView,
    commander: Option<CommanderMemory>,
    lease: u64,
    devices: u64,
    full_authority: bool,
    /// Zeros that were granted and refused.
    zeros: [u64; 2],
}

impl Play {
    /// Two ideal devices that follow a hand, two Premiums that replay a trace, one that breaks, and three that are
    /// simulated: held by a trembling hand that minds slip, by another kind of hand, and by nobody.
    fn new() -> Self {
        let hand = "[[device]]\nbackend = \"ideal\"\nhand = \"../hands/default.csv\"\npeak_force_n = 8.5\n";
        let premium = "[[device]]\nbackend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"traces/circle.csv\"\n";
        let directory = tempfile::tempdir().unwrap();
        let simulated = simulated(directory.path());
        let text = format!("[safety]\nramp_in_ms = 50\n{}{}{simulated}", hand.repeat(2), premium.repeat(2));
        let config = DriverConfig::parse(&text, &config_file("driver/test.toml")).unwrap();
        let mut devices = open_devices(&config).unwrap();
        devices.push(Box::new(Breaking::new(devices[0].info().clone())));
        let info = describe(&config, &devices, WaitMode::Spin);
        let memory = Arc::new(DriverMemory::create(&info).unwrap());
        let driver = DriverView::map(memory.fd()).unwrap();
        let count = devices.len() as u64;
        let cycle = make_cycle(&config, memory, devices);
        let (sender, inbox) = mail();
        Self {
            cycle,
            inbox,
            sender,
            driver,
            commander: None,
            lease: 0,
            devices: count,
            full_authority: false,
            zeros: [0; 2],
        }
    }

    /// What the socket's thread and the commander do before the tick.
    fn prepare(&mut self, tick: u64) {
        if self.cycle.safety().state() == DriverState::Fault && tick.is_multiple_of(10) {
            let asked_ns = rt_core::clock::monotonic_ns() + 1;
            assert_eq!(self.sender.urgent.clear_fault(asked_ns, |_| true), Ok(()));
        }
        if tick.is_multiple_of(37) {
            // The one that breaks; sometimes all, of which two move.
            let asked = if tick.is_multiple_of(2) { 1 << 7 } else { 0 };
            self.sender.post(Letter::Zero(DeviceSet(asked))).unwrap();
        }
        if tick % LEASE_TICKS == 1 {
            if self.lease > 0 {
                self.sender.urgent.end_lease(self.lease);
            }
            self.grant();
            if self.lease.is_multiple_of(5) {
                // The next one comes while the former still ramps out, and is replaced by another at once.
                self.grant();
            }
        }
        self.sender.clear_waste();
    }

    fn grant(&mut self) {
        self.lease += 1;
        let (view, fd) = CommanderView::create(self.lease).unwrap();
        self.commander = Some(CommanderMemory::map(fd.as_fd()).unwrap());
        self.sender.post(Letter::Grant(view)).unwrap();
    }

    /// The loop's own part, with the commander's answer in the middle of it.
    fn tick(&mut self, tick: u64) {
        self.inbox.deliver(&mut self.cycle);
        if let Some(verdict) = self.cycle.zero_verdict() {
            self.zeros[usize::from(verdict.is_err())] += 1;
        }
        self.cycle.sense(tick, tick * 1_000_000);
        self.cycle.take_reply();
        self.answer(tick);
        self.cycle.take_reply();
        self.cycle.actuate();
        self.full_authority |= self.cycle.safety().authority() == 1.0;
    }

    /// Right mostly; else late, silent or garbage of every kind.
    fn answer(&self, tick: u64) {
        let Some(commander) = &self.commander else { return };
        let mut command = Command::zero(tick, commander.lease(), self.devices);
        for device in &mut command.devices[..self.devices as usize] {
            device.force_on_user_n = [9.0, -1.0, 0.5 * (tick as f64 / 40.0).sin()];
        }
        match tick % 1009 {
            // Silence, short enough to be held and long enough to expire.
            100..103 | 200..220 => return,
            300 => command.devices[3].force_on_user_n[1] = f64::NAN,
            301 => command.lease += 1,
            302 => command.device_count = u64::MAX,
            303 => command.tick = tick + 7,
            304 => command.tick = u64::MAX,
            305 => command.tick = tick.saturating_sub(2),
            306 => command.devices[0].force_on_user_n = [f64::MAX; 3],
            _ => {}
        }
        commander.publish(&command, &self.driver);
        if tick % 1009 == 307 {
            // It dies in the middle of the next write, which it has announced already.
            let slot = &commander.commands[tick as usize % commander.commands.len()];
            slot.sequence.store(2 * tick + 1, Ordering::Relaxed);
        }
    }
}

/// A device that breaks now and then, in each way that a device may.
struct Breaking {
    info: DeviceInfo,
    tick: u64,
    needs_zero: bool,
}

impl Breaking {
    fn new(info: DeviceInfo) -> Self {
        Self { info, tick: 0, needs_zero: false }
    }
}

impl Device for Breaking {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        self.tick = time.tick;
        match time.tick % 1511 {
            500 => Err(FaultReason::DeviceRead),
            // It loses its place.
            700 => {
                self.needs_zero = true;
                Ok(Reading::at(Vector3::zeros()))
            }
            501 => Ok(Reading { is_valid: false, ..Reading::at(Vector3::zeros()) }),
            1000 => Ok(Reading::at(Vector3::repeat(f64::NAN))),
            _ => Ok(Reading::at(Vector3::zeros())),
        }
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        Restrained::whole(effort.force_on_user_n)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        match self.tick % 1511 {
            1400 => Err(FaultReason::DeviceWrite),
            _ => Ok(Written { force_on_user_n: effort.force_on_user_n, ..Written::default() }),
        }
    }

    fn release(&mut self) {}

    fn zero_state(&self) -> ZeroState {
        if self.needs_zero { ZeroState::Needed } else { ZeroState::Zeroed }
    }

    fn zero(&mut self) {
        self.needs_zero = false;
    }
}

/// The default scene's hand touches, holds and slides for ten seconds: at 10 kHz a hundred thousand ticks.
#[test]
fn the_applications_turn_never_calls_the_heap_while_fingers_touch_hold_and_slide() {
    play_scene(&config_file("scenes/default.toml"), 2, TICKS / 100);
}

/// Two fingers squeeze a cube on the floor, drag it, pull off it sideways, and let go; a ball bounces and leaves the world.
#[test]
fn the_applications_turn_never_calls_the_heap_while_objects_move() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("scene.toml"), OBJECTS).unwrap();
    let mut hand = String::from("t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n");
    for step in 0..=100 {
        let phase = f64::from(step % 20) / 20.0;
        let closed = if phase < 0.8 { 0.021 } else { 0.04 };
        // Up slowly, then off over the cube's sides, faster than it can follow.
        let y = 0.025 + 0.05 * phase * phase;
        let _ = writeln!(
            hand,
            "{:?},{closed},{y:?},0,-{closed},{:?},{:?}",
            f64::from(step) * 0.1,
            y,
            0.02 * phase
        );
    }
    std::fs::write(directory.path().join("hand.csv"), hand).unwrap();
    play_scene(&directory.path().join("scene.toml"), 2, TICKS / 400);
}

const OBJECTS: &str = r#"
hand = "hand.csv"
[[finger]]
[[finger]]
[[entity]]
name = "floor"
shape = { kind = "plane", normal = [0, 1, 0], offset_m = 0 }
friction = { model = "coulomb", mu = 0.5 }
[[entity]]
name = "cube"
shape = { kind = "box", size_m = [0.05, 0.05, 0.05] }
position_m = [0, 0.025, 0]
mass_kg = 0.1
stiffness_n_per_m = 500
friction = { model = "stiction", mu_s = 0.4, mu_d = 0.2 }
[[entity]]
name = "ball"
shape = { kind = "sphere", radius_m = 0.02 }
position_m = [0.3, 0.3, 0]
velocity_m_s = [0, 0, 20]
mass_kg = 0.1
"#;

/// A finger goes to and fro over stacks of two, all of which are in the slow list but those that it is near.
#[test]
fn the_applications_turn_never_calls_the_heap_while_things_change_lists() {
    let directory = tempfile::tempdir().unwrap();
    let mut hand = String::from("t,f0_x,f0_y,f0_z\n");
    for step in 0..=100 {
        // Into the tops now and then, 5 mm deep.
        let y = if step % 4 == 2 { 0.075 } else { 0.1 };
        let _ = writeln!(hand, "{:?},{:?},{y:?},0", f64::from(step) * 0.1, 0.45 * f64::from(step % 2));
    }
    std::fs::write(directory.path().join("hand.csv"), hand).unwrap();
    // By mass, what meets is stopped by impulses.
    for kind in ["as-felt", "by-mass"] {
        let scene = format!("contact_stiffness = {{ kind = \"{kind}\" }}\n{STACKS}");
        std::fs::write(directory.path().join("scene.toml"), scene).unwrap();
        let mut fast = play_scene(&directory.path().join("scene.toml"), 1, 0);
        let end = fast.step_mut().end_lists(None).unwrap();
        assert_eq!(end.fast + end.slow.unwrap(), 20, "{kind}: {end}");
        // A hundred ways along ten stacks of two. What is ahead or near of the finger when it turns stays: 976 come, about
        // half.
        assert!(end.handed.came > 500 && end.handed.went > 500, "{kind}: {end}");
    }
}

const STACKS: &str = r#"
hand = "hand.csv"
lists = { fast_bodies = 0 }
[[finger]]
[[entity]]
name = "floor"
shape = { kind = "plane", normal = [0, 1, 0], offset_m = 0 }
friction = { model = "coulomb", mu = 0.5 }
[[entity]]
name = "cube"
shape = { kind = "box", size_m = [0.04, 0.04, 0.04] }
position_m = [0, 0.02, 0]
mass_kg = 0.1
stiffness_n_per_m = 500
damping_n_s_per_m = 2
friction = { model = "coulomb", mu = 0.5 }
grid = { count = [10, 2, 1], spacing_m = [0.05, 0.04, 1] }
"#;

/// Three fingers over meshes, patches, solids and raised boxes, with fields, guides, magnets, vibration and passivity.
#[test]
fn the_applications_turn_never_calls_the_heap_with_everything_that_a_scene_may_have() {
    for is_round in [false, true] {
        let directory = tempfile::tempdir().unwrap();
        everything::write(directory.path(), is_round);
        // The hand is done after half of the ticks, and most of the time the fingers are in the air.
        play_scene(&directory.path().join("scene.toml"), 3, TICKS / 400);
    }
}

/// A hundred thousand turns at 10 kHz; every state of friction is seen more often than that.
fn play_scene(file: &Path, fingers: usize, least: u64) -> FastLoop {
    let _turn = in_turn();
    alloc_guard::assert_installed();
    let period_ns = period_of(10_000.0);
    let rig = Rig::new(file, Scene::load(file).unwrap(), None, None, HandMode::Kinematic, period_ns).unwrap();
    let config = rig.driver_config(ClockMode::Virtual);
    let devices = open_devices(&config).unwrap();
    let memory = Arc::new(DriverMemory::create(&describe(&config, &devices, WaitMode::Spin)).unwrap());
    let driver = DriverView::map(memory.fd()).unwrap();
    let mut cycle = make_cycle(&config, memory, devices);
    let (view, fd) = CommanderView::create(1).unwrap();
    let commander = CommanderMemory::map(fd.as_fd()).unwrap();
    cycle.grant(view);
    cycle.change_lease();
    let step = rig.fast_step().unwrap();
    let (rows, mut taken) = row_queue_of(1024, usize::MAX, step.bodies().len());
    let (events, mut event_ends) = world::events::event_queue(256);
    let mut fast = FastLoop::new(step, rows, WhenFull::Drop, TICKS, period_ns).with_events(events);
    let mut told = 0;
    let (mut seen, mut answered) = ([0_u64; 3], 0);
    for tick in 1..=TICKS {
        cycle.sense(tick, tick * period_ns);
        // Some frames are never looked at, so that the next turn searches the ring for what came of them.
        if tick % 1013 > 3 {
            let (turn, heap_calls) = alloc_guard::count(|| fast.turn(tick, &driver, &commander));
            assert_eq!((turn, heap_calls), (Turn::Answered, 0), "in tick {tick}");
            answered += 1;
        }
        cycle.take_reply();
        cycle.actuate();
        if tick == TICKS / 2 {
            // As after the loss of the driver.
            assert_eq!(alloc_guard::count(|| fast.reset()).1, 0);
        }
        // For a while nobody takes the rows, so that the queue runs full.
        while tick % 10_000 < 5_000
            && let Some((row, _)) = taken.receive()
        {
            for finger in &row.fingers[..fingers] {
                seen[finger.friction as usize] += 1;
            }
            while event_ends.receive(u64::MAX).is_some() {
                told += 1;
            }
        }
    }
    assert!(told > 0, "nothing was told");
    assert_eq!(fast.tally.answered, answered);
    assert!(fast.tally.rows_lost > 0 && fast.tally.frames_missed > 0, "{:?}", fast.tally);
    for state in [ContactState::Free, ContactState::Stick, ContactState::Slip] {
        assert!(seen[state as usize] > least, "hardly ever {state:?}: {seen:?}");
    }
    fast
}

#[test]
fn a_tick_that_allocates_would_be_noticed() {
    let (_, heap_calls) = alloc_guard::count(|| drop(std::hint::black_box(vec![Command::zeroed()])));
    assert_eq!(heap_calls, 2, "one allocation, one release");
}
