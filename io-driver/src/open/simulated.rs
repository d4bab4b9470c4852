//! Opening a simulated arm: its pose where the hand begins, its hand, and when its motors take effect.

#![allow(non_snake_case)] // Frames are capital letters: a point p_W is in the world.

use super::{
    HandFiles, OpenError, arm_info, commissioned, has_switch, holds_its_weight, live_finger, mechanism, read,
    script,
};
use crate::config::{Backend, DeviceConfig, DriverConfig, HandChoice, ReplyMode, Wish, Zeroing};
use crate::device::Device;
use crate::device::arm::Arm;
use crate::device::simulated::{HeldBy, Holder, Latency, SimulatedDevice, Wish as HandWish};
use crate::device_file::ArmFile;
use crate::kinematics::Mechanism;
use crate::sim::arm::SimulatedArm;
use crate::sim::hand::{HandModel, ImpedanceHand, model_file};
use crate::sim::split_mix::SplitMix64;
use crate::sim::tip_board::TipBoard;
use crate::toml_report::MAX_TOML_BYTES;
use nalgebra::{Point3, Vector3};
use shm_abi::segment::{ClockMode, DeviceInfo};
use std::sync::Arc;

/// From reading to writing where time is only counted: a round trip and the work of a tick, as measured on an idle
/// machine with the fast thread on a CPU of its own.
pub const ROUND_TRIP_NS: u64 = 5_000;

pub(super) fn open(
    device: &DeviceConfig,
    config: &DriverConfig,
    board: &Arc<TipBoard>,
    hands: &mut HandFiles,
) -> Result<Box<dyn Device>, OpenError> {
    let Backend::Simulated { description, wish, holder, seed } = &device.backend else {
        unreachable!("the caller has looked");
    };
    let file = mechanism(device, description)?;
    let place = config.devices.iter().position(|other| other.name == device.name).unwrap_or(0);
    let [of_plant, of_hand] = seeds(*seed, place);
    let wanted = match (live_finger(device, wish)?, script(device, wish, config, hands)?) {
        (Some(live), _) => HandWish::Live(live),
        (None, Some((player, finger))) => HandWish::Scripted(player, finger),
        (None, None) => HandWish::Resting(wish.start_m),
    };
    let (wanted, start_W) = beginning(wanted, wish);
    let start_D = wish.base_in_world.inverse_transform_point(&Point3::from(start_W)).coords;
    let joints = pose(device, &file, start_W, start_D)?;
    let no_simulation = || OpenError::NoSimulation { device: device.name.clone(), file: description.clone() };
    let plant = SimulatedArm::new(&file, joints, of_plant).ok_or_else(no_simulation)?;
    let holder = match holder {
        None => Holder::Nobody,
        Some(choice) => Holder::Hand(Box::new(HeldBy {
            hand: ImpedanceHand::new(
                &hand(device, choice)?.in_base(&wish.base_in_world.rotation),
                start_D,
                of_hand,
            ),
            wish: wanted,
            board: Arc::clone(board),
            place,
        })),
    };
    // Nobody shall take it for a real one.
    let info = DeviceInfo { kind: "simulated".into(), ..commissioned(arm_info(device, &file), config) };
    let arm = Arm::new(&file, holds_its_weight(device, config)).with_zeroing(device.zeroing);
    let opened = SimulatedDevice::new(info, arm, plant, holder, wish.base_in_world, latency(config));
    if has_switch(device, config) && !opened.extras().buttons {
        return Err(OpenError::NobodyPresses { device: device.name.clone() });
    }
    // In lockstep the driver's idle ticks go by a clock that nobody can repeat. On a virtual clock there is none, and the first
    // tick, in which nothing is written yet, shall be the same.
    let opened = match config.clock {
        ClockMode::Lockstep | ClockMode::Virtual => opened.waiting_for_a_commander(),
        ClockMode::Real => opened,
    };
    Ok(Box::new(opened))
}

/// Where the hand is at first, in W.
fn beginning(mut wanted: HandWish, wish: &Wish) -> (HandWish, Vector3<f64>) {
    let start = match &mut wanted {
        HandWish::Scripted(player, finger) => player.position(*finger, 0.0),
        HandWish::Resting(at) => Some(*at),
        // It goes from there to wherever it is wanted by then.
        HandWish::Live(_) => None,
    };
    (wanted, start.unwrap_or(wish.start_m))
}

/// Of arm and hand: no two devices of a driver, and no two seeds, share a stream.
fn seeds(seed: u64, place: usize) -> [u64; 2] {
    let mut of_driver = SplitMix64::new(seed);
    let of_place = of_driver.next_u64() ^ SplitMix64::new(!(place as u64)).next_u64();
    let mut of_device = SplitMix64::new(of_place);
    [of_device.next_u64(), of_device.next_u64()]
}

fn pose(
    device: &DeviceConfig,
    file: &ArmFile,
    start_W: Vector3<f64>,
    start_D: Vector3<f64>,
) -> Result<[f64; 3], OpenError> {
    let out_of_reach =
        |why: String| OpenError::OutOfReach { device: device.name.clone(), start_m: start_W.into(), why };
    let joints = file.mechanism.inverse(start_D).map_err(|error| out_of_reach(error.to_string()))?;
    let excess = file.mechanism.joint_limits().excess(joints);
    if excess > 0.0 {
        return Err(out_of_reach(format!("a joint would be {excess:.3} rad beyond its stop")));
    }
    // Counters that say where they are have to say it within one turn of theirs.
    let counts = file.joint_map().angles_to_counts(joints);
    let half = 1i64 << (file.encoders.count_bits - 1);
    if device.zeroing == Zeroing::Known && counts.iter().any(|count| !(-half..half).contains(count)) {
        let bits = file.encoders.count_bits;
        return Err(out_of_reach(format!(
            "its counters of {bits} bits have wrapped there; zero it with `zeroing = \"ask\"`"
        )));
    }
    Ok(joints)
}

fn hand(device: &DeviceConfig, choice: &HandChoice) -> Result<HandModel, OpenError> {
    let HandChoice { model, firmness, trembles } = choice;
    let text = match model_file::builtin(&model.to_string_lossy()) {
        Some(text) => text.to_owned(),
        None => read(device, model, MAX_TOML_BYTES)?,
    };
    let mut hand = model_file::parse(&text, model, *firmness)?;
    if !trembles {
        hand.tremor.rms_m = Vector3::zeros();
    }
    Ok(hand)
}

/// In real time what is measured; else what the way of replying says. With replies in the next tick the motors are
/// written at its beginning, a round trip after its reading.
fn latency(config: &DriverConfig) -> Latency {
    match (config.clock, config.reply.mode) {
        (ClockMode::Real, _) => Latency::Measured,
        (_, ReplyMode::FixedPhase) => Latency::Nominal(config.reply.budget_ns),
        (_, ReplyMode::OnArrival | ReplyMode::NextTick) => Latency::Nominal(ROUND_TRIP_NS),
    }
}
