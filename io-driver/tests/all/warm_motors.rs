//! Motors that are warm give less, and not the same in all directions: what is cut for that makes no blow.

use io_driver::device::Effort;
use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::drive::Drive;
use io_driver::emulator::amplifier::{Amplifier, AmplifierSpec, Tally, Value};
use io_driver::safety::workspace::Edge;
use io_driver::safety::{Elapsed, Guard, Limits, Restrained};
use nalgebra::Vector3;
use shm_abi::frame::LIMIT_HEAT;
use std::path::Path;

const PERIOD_NS: u64 = 1_000_000;
const SLEW_N_PER_S: f64 = 1000.0;
const STEP_N: f64 = SLEW_N_PER_S * PERIOD_NS as f64 / 1e9;

fn premium() -> ArmFile {
    match DeviceFile::parse(builtin("premium-1.5").unwrap(), Path::new("premium-1.5")) {
        Ok(DeviceFile::Arm(arm_file)) => *arm_file,
        other => panic!("{other:?}"),
    }
}

/// A minute of forces of the peak, each in some other direction than the one before, at the zeroing pose: what amplifiers
/// saw that check the growth of each force, and in how many ticks warmth cut one. `knows`: whether the guard knows what the
/// motors can give.
fn a_minute_of_peak_forces(mut next: impl FnMut() -> Vector3<f64>, knows: bool) -> (Tally, u32) {
    let file = premium();
    let (kinematics, joints) = (file.mechanism, file.encoders.home_joint_angles_rad);
    let (peak_n, everywhere) = (file.peak_force_n, Vector3::repeat(1.0));
    let edge = Edge { min_m: -everywhere, max_m: everywhere, margin_m: 0.02 };
    let limits = Limits { peak_n, slew_n_per_s: SLEW_N_PER_S, speed_m_per_s: f64::INFINITY, edge };
    let mut guard = Guard::new(limits);
    let mut drive = Drive::new(kinematics, &file.motors, file.heat, None);
    let watchdog_ns = u64::MAX;
    let spec = AmplifierSpec { motors: file.motors, kinematics, peak_n, step_n: STEP_N, watchdog_ns };
    let mut amplifier = Amplifier::new(spec);
    let mut derated = 0;
    for tick in 1..=60_000 {
        drive.pass(PERIOD_NS as f64 / 1e9);
        let effort = |force_on_user_n| Effort { force_on_user_n, gravity_share: 0.0 };
        let attainable =
            |force| if knows { drive.attainable(joints, effort(force)) } else { Restrained::whole(force) };
        let elapsed = Elapsed::new(PERIOD_NS, PERIOD_NS);
        let restrained = guard.restrain(next() * peak_n, 1.0, elapsed, attainable);
        let (codes, written) = drive.render(joints, effort(restrained.force_on_user_n)).expect("finite");
        derated += u32::from((restrained.limits | written.limits) & LIMIT_HEAT != 0);
        amplifier.take(Value { time_ns: tick * PERIOD_NS, codes, enable: true }, joints);
    }
    //
    (amplifier.tally(), derated)
}

/// Directions that stay for ten seconds, in which some motors become warm and others do not, and then turn as fast as the
/// slew rate lets the peak force turn, around each axis.
fn stay_and_turn() -> impl FnMut() -> Vector3<f64> {
    let mut tick = 0_u32;
    move || {
        tick += 1;
        let (along, turn) = ((tick / 10_000) as usize % 3, tick % 10_000);
        let angle = 0.1 * f64::from(turn.saturating_sub(9_800));
        let [mut from, mut to] = [Vector3::zeros(); 2];
        (from[along], to[(along + 1 + tick as usize / 30_000) % 3]) = (angle.cos(), angle.sin());
        from + to
    }
}

/// Directions of no order, each for a twentieth of a second.
fn random() -> impl FnMut() -> Vector3<f64> {
    let (mut seed, mut tick, mut direction) = (7_u64, 0, Vector3::zeros());
    move || {
        let mut number = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        if tick % 50 == 0 {
            direction = Vector3::from_fn(|_, _| number()).normalize();
        }
        tick += 1;
        direction
    }
}

#[test]
fn no_force_of_warm_motors_grows_turns_or_reverses_faster_than_the_slew_rate() {
    let seen = [a_minute_of_peak_forces(stay_and_turn(), true), a_minute_of_peak_forces(random(), true)];
    for (tally, derated) in seen {
        assert_eq!((tally.checked, tally.wrong()), (60_000, 0), "{tally:?}");
        assert!(derated > 10_000, "{derated} ticks were cut");
        assert!(tally.energised > 50_000, "{tally:?}");
    }
}

/// Else the test above would show nothing.
#[test]
fn where_the_growth_was_bounded_before_the_warmth_they_did() {
    let (tally, _) = a_minute_of_peak_forces(stay_and_turn(), false);
    assert!(tally.beyond_step > 100, "{tally:?}");
}
