//! What moves the counters of an emulated card.

use super::held_arm::HeldArm;
use crate::device::encoder_trace::EncoderReplay;
use crate::encoders::{EncoderSpec, JointMap, wrapped};

/// Where the arm is.
#[derive(Debug)]
pub enum Motion {
    /// At home.
    Rest,
    /// Where a trace says.
    Trace(EncoderReplay),
    /// Wherever its motors push it, in treacle: each joint turns at torque / viscosity, up to a radian from home. No
    /// mass, no weight: the simplest arm that shows a sign that is wrong.
    Yielding {
        /// How much it resists (N m s/rad).
        viscosity_nm_s: f64,
        /// Where it is now (rad).
        joints: [f64; 3],
    },
    /// As its mass, its weight, its friction, its motors and whoever holds it have it.
    Simulated(Box<HeldArm>),
}

/// What amplifiers give an arm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Given {
    /// Joint torques (N m), as the description has them.
    pub torque_nm: [f64; 3],
    /// What they regulate to; `None`: they are off.
    pub codes: Option<[u16; 3]>,
}

/// Raw counters and joint angles of a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Raw counters of the three joints.
    pub counters: [u32; 3],
    /// Joint angles (rad).
    pub joints: [f64; 3],
}

/// What a simulated hand does to the handle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Handle {
    /// Raw counters of an instrumented gimbal, if there is one.
    pub gimbal_counters: Option<[i64; 3]>,
    /// Which buttons it presses; `None`: it leaves them to others.
    pub buttons: Option<u32>,
}

impl Motion {
    /// What the handle shows.
    pub fn handle(&mut self) -> Handle {
        match self {
            Self::Simulated(arm) => arm.handle(),
            Self::Rest | Self::Trace(_) | Self::Yielding { .. } => Handle::default(),
        }
    }

    /// Goes on to `time_s` by `dt_s`, with what its amplifiers give it, while a hand turns it by so many counts more,
    /// or a hand that holds a simulated arm wants to.
    pub fn pass(
        &mut self,
        time_s: f64,
        dt_s: f64,
        given: Given,
        hand: [i64; 3],
        encoders: &EncoderSpec,
    ) -> Pose {
        let map = JointMap::new(encoders);
        let counts = match self {
            Self::Rest => [0; 3],
            Self::Trace(replay) => replay.counts_at(time_s),
            Self::Yielding { viscosity_nm_s, joints } => {
                let homes = encoders.home_joint_angles_rad;
                for ((joint, torque), home) in joints.iter_mut().zip(given.torque_nm).zip(homes) {
                    *joint = (*joint + dt_s * torque / *viscosity_nm_s).clamp(home - 1.0, home + 1.0);
                }
                map.angles_to_counts(*joints)
            }
            Self::Simulated(arm) => return arm.pass(dt_s, given.codes, hand),
        };
        let counts: [i64; 3] = std::array::from_fn(|joint| counts[joint] + hand[joint]);
        Pose {
            counters: counts.map(|count| wrapped(count, encoders.count_bits) as u32),
            joints: map.counts_to_angles(counts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENCODERS: EncoderSpec = EncoderSpec {
        channel: [0, 1, 2],
        counts_per_rev: 4096,
        count_bits: 16,
        sign: [1, -1, 1],
        reduction: [10.0; 3],
        home_joint_angles_rad: [0.0; 3],
    };

    fn given(torque_nm: [f64; 3]) -> Given {
        Given { torque_nm, codes: None }
    }

    #[test]
    fn a_yielding_arm_turns_by_torque_over_viscosity() {
        let mut motion = Motion::Yielding { viscosity_nm_s: 2.0, joints: [0.0; 3] };
        let pose = motion.pass(0.1, 0.1, given([0.2, 0.2, -0.4]), [0; 3], &ENCODERS);
        let count = std::f64::consts::TAU / 40_960.0;
        for (found, wanted) in pose.joints.into_iter().zip([0.01, 0.01, -0.02]) {
            assert!((found - wanted).abs() <= 0.5 * count, "half a count");
        }
        // The second counter falls as its joint rises, and wraps below zero.
        assert!(pose.counters[1] > 65_000 && pose.counters[0] < 100);
    }

    #[test]
    fn an_arm_at_rest_stays() {
        let pose = Motion::Rest.pass(3.0, 1.0, given([1.0; 3]), [0; 3], &ENCODERS);
        assert_eq!(pose, Pose { counters: [0; 3], joints: [0.0; 3] });
        let turned = Motion::Rest.pass(3.0, 1.0, given([0.0; 3]), [0, 0, -1], &ENCODERS);
        assert_eq!(turned.counters, [0, 0, 65_535], "until a hand turns it");
        assert!(turned.joints[2] < 0.0);
    }
}
