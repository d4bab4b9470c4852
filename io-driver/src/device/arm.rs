//! What every arm with counters and motors has in common, whatever carries its registers.
//!
//! Model: raw counters, extended beyond their width, become joint angles and the tip, and their changes its velocity,
//! `J q'` with each joint's velocity estimated from its own counts; a force becomes codes.
//! Invariant: `read` comes before `render` in a tick; codes are for the pose that was read last.

use super::{Effort, Reading, TickTime, Written};
use crate::device_file::ArmFile;
use crate::drive::Drive;
use crate::encoders::{EncoderExtender, JointMap};
use crate::kinematics::{Kinematics, Mechanism};
use crate::velocity::VelocityEstimator;
use nalgebra::Vector3;
use shm_abi::FaultReason;

/// An arm.
#[derive(Debug)]
pub struct Arm {
    extender: EncoderExtender,
    map: JointMap,
    velocity: VelocityEstimator,
    kinematics: Kinematics,
    drive: Drive,
    joints: [f64; 3],
    last_tick: Option<u64>,
    /// The counters read zero in the home pose, whatever the pose of the first reading.
    is_zeroed: bool,
}

impl Arm {
    /// An arm of this description; `holds_its_weight`: gravity is compensated, if the bodies are described.
    pub fn new(premium: &ArmFile, holds_its_weight: bool) -> Self {
        let kinematics = premium.mechanism;
        let gravity = premium.gravity.filter(|_| holds_its_weight);
        Self {
            extender: EncoderExtender::new(premium.encoders.count_bits),
            map: JointMap::new(&premium.encoders),
            velocity: VelocityEstimator::of_counts(),
            kinematics,
            drive: Drive::new(kinematics, &premium.motors, premium.heat, gravity),
            joints: premium.encoders.home_joint_angles_rad,
            last_tick: None,
            is_zeroed: false,
        }
    }

    /// An arm whose counters read zero in the home pose.
    pub fn already_zeroed(self) -> Self {
        Self { is_zeroed: true, ..self }
    }

    /// Takes the raw counters of a tick. The pose of the first is the home pose.
    pub fn read(&mut self, raw: [i64; 3], time: TickTime) -> Reading {
        let counts = self.extender.extend(raw);
        match self.last_tick.replace(time.tick) {
            None if self.is_zeroed => {}
            None => self.map.zero_at(counts),
            Some(last) => {
                let elapsed = i64::try_from(time.tick.saturating_sub(last)).unwrap_or(i64::MAX);
                self.drive.pass(super::run_time_s(elapsed, time.period_ns));
            }
        }
        self.joints = self.map.counts_to_angles(counts);
        let rates = self.joint_rates(counts, time);
        let mut reading = Reading::at(self.kinematics.forward(self.joints));
        reading.velocity_m_per_s = self.kinematics.jacobian(self.joints) * Vector3::from(rates);
        reading.joint_velocity_rad_per_s = rates;
        reading.encoder_counts[..3].copy_from_slice(&counts);
        reading.joint_angle_rad[..3].copy_from_slice(&self.joints);
        reading
    }

    /// Of the counts, so that zeroing moves nothing.
    fn joint_rates(&mut self, counts: [i64; 3], time: TickTime) -> [f64; 3] {
        let counts_per_s = self.velocity.observe(time, counts.map(|count| count as f64));
        let rad_per_count = self.map.rad_per_count();
        std::array::from_fn(|j| rad_per_count[j] * counts_per_s[j])
    }

    /// What was read so far says nothing about how fast it moves.
    pub fn forget_motion(&mut self) {
        self.velocity.forget();
    }

    /// Codes for an effort in the pose that was read.
    ///
    /// # Errors
    /// A torque that is not a number.
    pub fn render(&mut self, effort: Effort) -> Result<([u16; 3], Written), FaultReason> {
        self.drive.render(self.joints, effort)
    }

    /// The codes of zero torque; the motors get them now.
    pub fn release(&mut self) -> [u16; 3] {
        self.drive.release();
        self.drive.zero_codes()
    }
}
