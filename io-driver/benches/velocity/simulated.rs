//! Movements of a simulated arm in a simulated hand, whose truth no closed form tells: weight, friction, tremor, and
//! a wall that pushes back.

use crate::motion::Sample;
use io_driver::device_file::ArmFile;
use io_driver::encoders::{EncoderExtender, JointMap};
use io_driver::kinematics::Mechanism;
use io_driver::sim::arm::SimulatedArm;
use io_driver::sim::hand::model_file::{Firmness, builtin, parse};
use io_driver::sim::hand::{Felt, ImpedanceHand};
use nalgebra::Vector3;
use std::path::Path;

/// What the hand wants, and what it meets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Task {
    /// For people.
    pub(crate) name: &'static str,
    /// Where it wants to be (m), by time (s), from the home position.
    wish: fn(f64) -> Vector3<f64>,
    /// Stiffness of the wall below the home position (N/m).
    wall_n_per_m: f64,
}

/// Those of the table.
pub(crate) const TASKS: [Task; 2] = [
    Task { name: "simulated: strokes", wish: |t| strokes(t, Vector3::new(0.6, 0.8, 0.0)), wall_n_per_m: 0.0 },
    Task { name: "simulated: taps, 2 kN/m", wish: |t| taps(t), wall_n_per_m: 2000.0 },
];

/// Twice a second there and back, 6 cm.
fn strokes(t: f64, direction: Vector3<f64>) -> Vector3<f64> {
    direction * (0.03 * (1.0 - (std::f64::consts::TAU * 2.0 * t).cos()))
}

/// Four times a second from 5 mm above the wall to 10 mm behind it.
fn taps(t: f64) -> Vector3<f64> {
    Vector3::y() * (0.0075 * (std::f64::consts::TAU * 4.0 * t).cos() - 0.0025)
}

/// What counters said and what was true, tick by tick.
#[derive(Debug)]
pub(crate) struct Ride {
    pub(crate) samples: Vec<Sample>,
    /// Velocities of the joints (rad/s) and of the tip (m/s).
    truth: Vec<(Vector3<f64>, Vector3<f64>)>,
    rate_hz: f64,
}

impl Ride {
    /// Of an arm that begins at home.
    pub(crate) fn new(file: &ArmFile, task: &Task, rate_hz: f64, seconds: f64) -> Self {
        let model = parse(builtin("pen-grip").expect("built in"), Path::new("pen-grip"), Firmness::Usual);
        let home = file.mechanism.forward([0.0; 3]);
        let mut hand = ImpedanceHand::new(&model.expect("it is valid"), home, 7);
        let mut arm = SimulatedArm::new(file, [0.0; 3], 7).expect("it says how it moves");
        let (map, motors) = (JointMap::new(&file.encoders), file.motor_map());
        let mut extender = EncoderExtender::<3>::new(file.encoders.count_bits);
        let (mut samples, mut truths) = (Vec::new(), Vec::new());
        for tick in 0..(seconds * rate_hz) as u64 {
            let time_s = tick as f64 / rate_hz;
            let counts = extender.extend(arm.counters());
            let joints_rad = map.counts_to_angles(counts);
            samples.push(Sample { tick, time_s, counts, joints_rad });
            let truth = arm.truth();
            truths.push((truth.rates.into(), truth.tip_velocity));
            let depth = (home - file.mechanism.forward(joints_rad)).y.max(0.0);
            let force = Vector3::y() * (task.wall_n_per_m * depth);
            arm.command(motors.command(file.mechanism.joint_torque(joints_rad, force)).codes);
            hand.intend(home + (task.wish)(time_s) - (task.wish)(0.0), Felt::default(), 1.0 / rate_hz);
            arm.advance(1.0 / rate_hz, &mut hand);
        }
        Self { samples, truth: truths, rate_hz }
    }

    /// Linear between two ticks.
    pub(crate) fn truth(&self, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let at = (time_s * self.rate_hz).clamp(0.0, (self.truth.len() - 1) as f64);
        let (tick, part) = (at.floor() as usize, at.fract());
        let (joints, tip) = self.truth[tick];
        let (later_joints, later_tip) = self.truth[(tick + 1).min(self.truth.len() - 1)];
        (joints.lerp(&later_joints, part), tip.lerp(&later_tip, part))
    }
}
