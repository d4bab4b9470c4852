//! What moves the counters of an emulated card.

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
}

/// Raw counters and joint angles of a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Raw counters of the three joints.
    pub counters: [u32; 3],
    /// Joint angles (rad).
    pub joints: [f64; 3],
}

impl Motion {
    /// Goes on to `time_s` by `dt_s`, with these joint torques (N m), while a hand turns it by so many counts more.
    pub fn pass(
        &mut self,
        time_s: f64,
        dt_s: f64,
        torque: [f64; 3],
        hand: [i64; 3],
        encoders: &EncoderSpec,
    ) -> Pose {
        let map = JointMap::new(encoders);
        let counts = match self {
            Self::Rest => [0; 3],
            Self::Trace(replay) => replay.counts_at(time_s),
            Self::Yielding { viscosity_nm_s, joints } => {
                let homes = encoders.home_joint_angles_rad;
                for ((joint, torque), home) in joints.iter_mut().zip(torque).zip(homes) {
                    *joint = (*joint + dt_s * torque / *viscosity_nm_s).clamp(home - 1.0, home + 1.0);
                }
                map.angles_to_counts(*joints)
            }
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

    #[test]
    fn a_yielding_arm_turns_by_torque_over_viscosity() {
        let mut motion = Motion::Yielding { viscosity_nm_s: 2.0, joints: [0.0; 3] };
        let pose = motion.pass(0.1, 0.1, [0.2, 0.2, -0.4], [0; 3], &ENCODERS);
        let count = std::f64::consts::TAU / 40_960.0;
        for (found, wanted) in pose.joints.into_iter().zip([0.01, 0.01, -0.02]) {
            assert!((found - wanted).abs() <= 0.5 * count, "half a count");
        }
        // The second counter falls as its joint rises, and wraps below zero.
        assert!(pose.counters[1] > 65_000 && pose.counters[0] < 100);
    }

    #[test]
    fn an_arm_at_rest_stays() {
        let pose = Motion::Rest.pass(3.0, 1.0, [1.0; 3], [0; 3], &ENCODERS);
        assert_eq!(pose, Pose { counters: [0; 3], joints: [0.0; 3] });
        let turned = Motion::Rest.pass(3.0, 1.0, [0.0; 3], [0, 0, -1], &ENCODERS);
        assert_eq!(turned.counters, [0, 0, 65_535], "until a hand turns it");
        assert!(turned.joints[2] < 0.0);
    }
}
