//! A recorded encoder trace through a described mechanism.
//!
//! Model: the raw counters of the trace, by ticks since the driver's start, are extended beyond their width,
//! turned into joint angles and into the tip, as a real device's would be; the force goes through J^T and
//! the converters' codes, which nobody listens to. The trace's first row is the home pose.
//!
//! Invariant: what it says was rendered is what the codes amount to. Where the Jacobian is too near a
//! singularity to tell the force apart from the codes, the force before rounding is reported.

use super::encoder_trace::EncoderReplay;
use super::{Device, Reading, TickTime, Written};
use crate::encoders::{EncoderExtender, EncoderSpec, JointMap};
use crate::kinematics::{Kinematics, Mechanism};
use crate::motors::{MotorMap, MotorSpec};
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;

/// Below this ratio of singular values a rounding error of a code would be blown up beyond meaning.
const TELLABLE: f64 = 1e-3;

/// The device.
#[derive(Debug)]
pub struct ReplayDevice {
    info: DeviceInfo,
    replay: EncoderReplay,
    extender: EncoderExtender,
    map: JointMap,
    kinematics: Kinematics,
    motors: MotorMap,
    joints: [f64; 3],
    first_tick: Option<u64>,
}

impl ReplayDevice {
    /// A device of this description that moves as the trace does.
    pub fn new(
        info: DeviceInfo,
        replay: EncoderReplay,
        kinematics: Kinematics,
        encoders: &EncoderSpec,
        motors: &MotorSpec,
    ) -> Self {
        Self {
            info,
            replay,
            extender: EncoderExtender::new(encoders.count_bits),
            map: JointMap::new(encoders),
            kinematics,
            motors: MotorMap::new(motors),
            joints: encoders.home_joint_angles_rad,
            first_tick: None,
        }
    }

    /// What codes amount to, given that `scale` of `wanted` was asked of them.
    fn rendered(&self, wanted: Vector3<f64>, torque: [f64; 3], scale: f64, codes: [u16; 3]) -> Vector3<f64> {
        let scaled = wanted * scale;
        if self.kinematics.singularity(self.joints).inverse_condition() < TELLABLE {
            return scaled;
        }
        let rounding = Vector3::from(self.motors.joint_torque(codes)) - Vector3::from(torque) * scale;
        let transposed = self.kinematics.jacobian(self.joints).transpose();
        transposed.try_inverse().map_or(scaled, |inverse| scaled + inverse * rounding)
    }
}

impl Device for ReplayDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let first = *self.first_tick.get_or_insert(time.tick);
        let elapsed = i64::try_from(time.tick.saturating_sub(first)).unwrap_or(i64::MAX);
        let raw = self.replay.counts_at(super::run_time_s(elapsed, time.period_ns));
        let counts = self.extender.extend(raw);
        if time.tick == first {
            self.map.zero_at(counts);
        }
        self.joints = self.map.counts_to_angles(counts);
        let mut reading = Reading::at(self.kinematics.forward(self.joints));
        reading.encoder_counts[..3].copy_from_slice(&counts);
        reading.joint_angle_rad[..3].copy_from_slice(&self.joints);
        Ok(reading)
    }

    fn write(&mut self, force_on_user_n: Vector3<f64>) -> Result<Written, FaultReason> {
        let torque = self.kinematics.joint_torque(self.joints, force_on_user_n);
        if !torque.iter().all(|t| t.is_finite()) {
            return Err(FaultReason::MotorNotFinite);
        }
        let command = self.motors.command(torque);
        Ok(Written {
            force_on_user_n: self.rendered(force_on_user_n, torque, command.scale, command.codes),
            motor_codes: command.codes.map(i64::from),
        })
    }

    fn release(&mut self) {}
}
