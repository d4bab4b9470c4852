//! Which tick's command drives the motors, on the virtual clock.

use bytemuck::Zeroable;
use io_driver::config::ReplyMode;
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue;
use phantom3::simulated::SimulatedDevices;
use phantom3::virtual_clock::VirtualDriver;
use shm_abi::segment::ClockMode;
use shm_abi::{Frame, ReplyKind};
use std::path::Path;
use world::Scene;

const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"wall\"\nstiffness_n_per_m = 500.0\n\
                     shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.002 }\n";

/// How many ticks old the command is that drives the motors, once somebody commands.
fn ages(mode: ReplyMode) -> Vec<u64> {
    let file = Path::new("scene.toml");
    let hand_mode = HandMode::Impedance(SimulatedDevices::default());
    let scene = Scene::parse(SCENE, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, hand_mode, 1_000_000).expect("a rig");
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
