//! Check that motors hold an arm's own weight for ever.
//!
//! Problem: motors that cannot hold the weight grow warm without any force, let the arm sag, and leave nothing for the
//! force.
//! Model: in every pose that the joints can take, what the continuous current makes on each joint is compared with what
//! holds the arm there ([`Gravity`]). It has to be [`MARGIN`] times as much, so that something is left for the force. The
//! poses are a grid of [`POSES`] a joint: the torques are sines of the joints, and over half a turn a grid of 24 steps
//! misses a quarter of a percent of a sine's peak, a small part of the margin.
//! Cost: some 15,000 poses, once.

use crate::device_file::ArmFile;
use crate::kinematics::gravity::Gravity;
use crate::kinematics::{Interval, JointLimits, Mechanism};
use crate::motors::MotorSpec;
use std::f64::consts::PI;

/// Torque that continuous currents have to make, in terms of the weight's.
pub(super) const MARGIN: f64 = 1.25;

/// On each joint, between its stops.
const POSES: u32 = 25;

/// A joint whose motor does not hold the weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TooHeavy {
    /// Its number, from 0.
    pub(super) joint: usize,
    /// Torque that holds the arm in the worst pose (N m).
    pub(super) weight_nm: f64,
    /// Torque of the continuous current (N m).
    pub(super) continuous_nm: f64,
}

/// The joint that has the least for its weight, if that is too little. An arm without bodies has no weight.
pub(super) fn too_heavy(arm: &ArmFile) -> Option<TooHeavy> {
    let weight_nm = largest_torque(arm.gravity.as_ref()?, &arm.mechanism.joint_limits());
    let continuous_nm = continuous_torque(&arm.motors, arm.heat.continuous_current_a);
    let joints = (0..3).map(|joint| TooHeavy {
        joint,
        weight_nm: weight_nm[joint],
        continuous_nm: continuous_nm[joint],
    });
    let missing = |found: &TooHeavy| MARGIN * found.weight_nm - found.continuous_nm;
    joints.filter(|found| missing(found) > 0.0).max_by(|a, b| missing(a).total_cmp(&missing(b)))
}

fn continuous_torque(motors: &MotorSpec, continuous_a: f64) -> [f64; 3] {
    let current_a = continuous_a.min(motors.peak_current_a);
    motors.reduction.map(|reduction| reduction * motors.torque_constant_nm_per_a * current_a)
}

/// Of each joint, over all poses (N m).
fn largest_torque(gravity: &Gravity, limits: &JointLimits) -> [f64; 3] {
    let mut largest = [0.0_f64; 3];
    for turret in angles(limits.joints[0]) {
        for upper_arm in angles(limits.joints[1]) {
            for forearm in angles(limits.joints[2]) {
                let joints = [turret, upper_arm, forearm];
                if limits.contains(joints) {
                    let torque = gravity.holding_torque(joints);
                    largest = std::array::from_fn(|joint| largest[joint].max(torque[joint].abs()));
                }
            }
        }
    }
    largest
}

/// From stop to stop; a joint without stops turns once round.
fn angles(joint: Interval) -> impl Iterator<Item = f64> {
    let (min, max) = (joint.min.max(-PI), joint.max.min(PI));
    (0..POSES).map(move |step| min + (max - min) * f64::from(step) / f64::from(POSES - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_file::{BUILTIN_NAMES, DeviceFile, builtin};
    use nalgebra::{UnitQuaternion, Vector3};
    use std::path::Path;

    fn arm(name: &str, changes: &[(&str, &str)]) -> Option<ArmFile> {
        let mut text = builtin(name).unwrap().to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        match DeviceFile::parse(&text, Path::new(name)).unwrap() {
            DeviceFile::Arm(arm) => Some(*arm),
            DeviceFile::Ideal(_) => None,
        }
    }

    /// However its base lies.
    #[test]
    fn every_built_in_arm_is_held_by_its_motors() {
        let lying = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI / 2.0);
        for name in BUILTIN_NAMES {
            let Some(arm) = arm(name, &[]) else { continue };
            assert_eq!(too_heavy(&arm), None, "{name}");
            assert_eq!(too_heavy(&arm.in_base(&lying)), None, "{name}, lying");
        }
    }

    /// By hand: the forearm of a Premium is horizontal at worst, and that pose lies within its stops.
    #[test]
    fn the_largest_torque_is_the_moment_at_the_worst_angle() {
        let arm = arm("premium-1.5", &[]).unwrap();
        let gravity = arm.gravity.unwrap();
        let limits = JointLimits::UNBOUNDED;
        let largest = largest_torque(&gravity, &limits);
        let level = gravity.holding_torque([0.0, 0.0, PI / 2.0]);
        // The grid has both poses.
        assert_eq!(largest[0], 0.0);
        assert!((largest[1] - level[1].abs()).abs() < 1e-15 && (largest[2] - level[2].abs()).abs() < 1e-15);
    }

    #[test]
    fn the_margin_is_what_is_asked_for() {
        let premium = arm("premium-1.5", &[]).unwrap();
        let weight_nm = largest_torque(&premium.gravity.unwrap(), &premium.mechanism.joint_limits());
        let least_a = |arm: &ArmFile| {
            let per_ampere = continuous_torque(&arm.motors, 1.0);
            (0..3).map(|joint| MARGIN * weight_nm[joint] / per_ampere[joint]).fold(0.0, f64::max)
        };
        for (share, is_enough) in [(1.001, true), (0.999, false)] {
            let mut arm = premium.clone();
            arm.heat.continuous_current_a = share * least_a(&premium);
            assert_eq!(too_heavy(&arm).is_none(), is_enough, "{share}");
        }
    }
}
