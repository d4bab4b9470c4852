//! What every arm with counters and motors has in common, whatever carries its registers.
//!
//! Model: raw counters, extended beyond their width, become joint angles and the tip, and their changes its velocity,
//! `J q'` with each joint's velocity estimated from its own counts; a force becomes codes.
//! Counters tell the pose only once the arm has been zeroed; until then its pose is that of the
//! description's home, or the last that was known, and is not valid.
//! An instrumented gimbal's counters are read, extended and zeroed together with the joints'.
//! Invariant: `read` comes before `render` in a tick; codes are for the pose that was read last.

use super::{Effort, Reading, TickTime, Written};
use crate::config::Zeroing;
use crate::device_file::ArmFile;
use crate::drive::Drive;
use crate::encoders::{EncoderExtender, JointMap};
use crate::kinematics::{Kinematics, Mechanism, gimbal};
use crate::safety::Restrained;
use crate::velocity::VelocityEstimator;
use crate::zeroing::ZeroState;
use nalgebra::Vector3;
use shm_abi::FaultReason;

/// An arm.
#[derive(Debug)]
pub struct Arm {
    /// Joints, then the gimbal; zeros where there is none.
    extender: EncoderExtender<6>,
    /// More counts between two readings tell nothing: the counter may have gone round either way.
    doubtful_step: u64,
    map: JointMap,
    gimbal: Option<JointMap>,
    zeroing: Zeroing,
    is_zeroed: bool,
    velocity: VelocityEstimator,
    kinematics: Kinematics,
    drive: Drive,
    joints: [f64; 3],
    last_ns: Option<u64>,
}

impl Arm {
    /// An arm of this description; `holds_its_weight`: gravity is compensated, if the bodies are described.
    pub fn new(file: &ArmFile, holds_its_weight: bool) -> Self {
        let kinematics = file.mechanism;
        let gravity = file.gravity.filter(|_| holds_its_weight);
        Self {
            extender: EncoderExtender::new(file.encoders.count_bits),
            doubtful_step: 1 << (file.encoders.count_bits - 2),
            map: JointMap::new(&file.encoders),
            gimbal: file.gimbal.as_ref().map(JointMap::new),
            zeroing: Zeroing::AtStart,
            is_zeroed: false,
            velocity: VelocityEstimator::of_counts(),
            kinematics,
            drive: Drive::new(kinematics, &file.motors, file.heat, gravity),
            joints: file.encoders.home_joint_angles_rad,
            last_ns: None,
        }
    }

    /// The same, zeroed in another way than at its start.
    pub fn with_zeroing(self, zeroing: Zeroing) -> Self {
        Self { zeroing, ..self }
    }

    /// Takes the raw counters of a tick.
    pub fn read(&mut self, raw: [i64; 3], time: TickTime) -> Reading {
        self.read_with_gimbal(raw, None, time)
    }

    /// The same with those of an instrumented gimbal, if they are there.
    pub fn read_with_gimbal(&mut self, raw: [i64; 3], gimbal: Option<[i64; 3]>, time: TickTime) -> Reading {
        let counts = self.extend(raw, gimbal);
        match self.last_ns.replace(time.time_ns) {
            None => match self.zeroing {
                Zeroing::AtStart => self.zero(),
                Zeroing::Known => self.is_zeroed = true,
                Zeroing::Ask => {}
            },
            Some(last_ns) => self.drive.pass(time.time_ns.saturating_sub(last_ns) as f64 / 1e9),
        }
        let (joint_counts, gimbal_counts) = halves(counts);
        if self.is_zeroed {
            self.joints = self.map.counts_to_angles(joint_counts);
        }
        let mut reading = Reading::at(self.kinematics.forward(self.joints));
        reading.is_valid = self.is_zeroed;
        let rates = self.joint_rates(joint_counts, time);
        reading.velocity_m_per_s = self.kinematics.jacobian(self.joints) * Vector3::from(rates);
        reading.joint_velocity_rad_per_s = rates;
        reading.encoder_counts = counts;
        reading.joint_angle_rad[..3].copy_from_slice(&self.joints);
        if let Some(map) = self.gimbal.filter(|_| gimbal.is_some()) {
            let angles =
                if self.is_zeroed { map.counts_to_angles(gimbal_counts) } else { map.home_angles_rad() };
            reading.joint_angle_rad[3..].copy_from_slice(&angles);
            let carrier = gimbal::carrier(&self.kinematics, self.joints);
            reading = reading.with_orientation(gimbal::orientation(carrier, angles));
        }
        reading
    }

    /// Whether it knows where it is.
    pub fn zero_state(&self) -> ZeroState {
        if self.is_zeroed { ZeroState::Zeroed } else { ZeroState::Needed }
    }

    /// The pose of the last counters is the zeroing pose.
    pub fn zero(&mut self) {
        let (joints, gimbal) = halves(self.extender.counts());
        self.map.zero_at(joints);
        if let Some(map) = &mut self.gimbal {
            map.zero_at(gimbal);
        }
        self.is_zeroed = true;
    }

    /// The counters may have lost their place.
    pub fn lose_zero(&mut self) {
        self.is_zeroed = false;
        self.forget_motion();
    }

    fn extend(&mut self, raw: [i64; 3], gimbal: Option<[i64; 3]>) -> [i64; 6] {
        let former = self.extender.counts();
        let [a, b, c] = raw;
        let [d, e, f] = gimbal.unwrap_or([0; 3]);
        let counts = self.extender.extend([a, b, c, d, e, f]);
        let is_doubtful = |(now, before): (&i64, &i64)| now.abs_diff(*before) > self.doubtful_step;
        if self.last_ns.is_some() && counts.iter().zip(&former).any(is_doubtful) {
            self.lose_zero();
        }
        counts
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

    /// The part of an effort that the motors can give in the pose that was read.
    pub fn attainable(&self, effort: Effort) -> Restrained {
        self.drive.attainable(self.joints, effort)
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

/// Joints and gimbal.
fn halves(counts: [i64; 6]) -> ([i64; 3], [i64; 3]) {
    let [a, b, c, d, e, f] = counts;
    ([a, b, c], [d, e, f])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_file::{DeviceFile, builtin};
    use std::path::Path;

    const GIMBAL: &str = "[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 2.0]\nsign = [1, -1, 1]\n\
                          channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.25, 0.0]\n";

    fn arm(zeroing: Zeroing) -> Arm {
        let text = format!("{}\n{GIMBAL}", builtin("premium-1.5").unwrap());
        let Ok(DeviceFile::Arm(file)) = DeviceFile::parse(&text, Path::new("arm.toml")) else { panic!() };
        Arm::new(&file, false).with_zeroing(zeroing)
    }

    fn time(tick: u64) -> TickTime {
        TickTime::counted(tick, 1_000_000, -1)
    }

    fn of(reading: &Reading) -> (bool, [i64; 6], [f64; 6]) {
        (reading.is_valid, reading.encoder_counts, reading.joint_angle_rad)
    }

    /// Three ticks in which 5 s went by, as after a stall that is made up for.
    #[test]
    fn motors_warm_by_the_time_that_passes_whatever_the_ticks() {
        let effort = Effort { force_on_user_n: Vector3::y() * 6.0, gravity_share: 1.0 };
        let heat_after = |times: &[TickTime]| {
            let mut arm = arm(Zeroing::AtStart);
            times.iter().fold(0.0, |_, time| {
                arm.read([0; 3], *time);
                arm.render(effort).unwrap().1.motor_heat
            })
        };
        let stalled = [0, 4_990_000_000, 5_000_000_000];
        let stalled = [0, 1, 2].map(|n| TickTime { time_ns: stalled[n], ..time(n as u64) });
        let steady = [0, 4990, 5000].map(time);
        assert_eq!(heat_after(&stalled), heat_after(&steady));
        assert!(heat_after(&stalled) > heat_after(&[0, 1, 2].map(time)) + 0.1);
    }

    #[test]
    fn an_arm_that_asks_shows_its_counts_and_no_pose_until_it_is_zeroed() {
        let mut arm = arm(Zeroing::Ask);
        for (tick, raw) in [(1, [500, 0, 0]), (2, [600, 10, 65_535])] {
            let reading = arm.read_with_gimbal(raw, Some([7, 8, 9]), time(tick));
            let (is_valid, counts, angles) = of(&reading);
            assert_eq!(
                (is_valid, angles),
                (false, [0.0, 0.0, 0.0, 0.0, 0.25, 0.0]),
                "home, for want of better"
            );
            assert_eq!(counts[0], raw[0], "the counts are told as they are");
            assert_eq!(arm.zero_state(), ZeroState::Needed);
        }
        arm.zero();
        let reading = arm.read_with_gimbal([600, 10, 65_535], Some([7, 8, 9]), time(3));
        assert_eq!(of(&reading), (true, [600, 10, -1, 7, 8, 9], [0.0, 0.0, 0.0, 0.0, 0.25, 0.0]));
        arm.lose_zero();
        let lost = arm.read_with_gimbal([700, 10, 65_535], Some([7, 8, 9]), time(4));
        assert!(!lost.is_valid && lost.encoder_counts[0] == 700);
    }

    #[test]
    fn an_arm_that_starts_at_home_is_zeroed_by_its_first_reading_and_never_by_itself_again() {
        let mut arm = arm(Zeroing::AtStart);
        assert!(arm.read([123, 456, 789], time(1)).is_valid);
        arm.lose_zero();
        assert!(!arm.read([123, 456, 789], time(2)).is_valid);
        arm.zero();
        assert!(arm.read([123, 456, 789], time(3)).is_valid);
    }

    #[test]
    fn a_counter_that_may_have_gone_round_either_way_costs_the_zero() {
        let mut arm = arm(Zeroing::AtStart);
        arm.read([0; 3], time(1));
        // A quarter of sixteen bits is still nearer than the way round.
        assert!(arm.read([16_384, 0, 0], time(2)).is_valid);
        assert!(!arm.read([16_384, 0, 16_385], time(3)).is_valid);
    }

    #[test]
    fn the_gimbal_is_measured_through_wraps_relative_to_its_zero_and_only_where_there_is_one() {
        let mut arm = arm(Zeroing::AtStart);
        let mut last = arm.read_with_gimbal([0; 3], Some([65_000, 0, 0]), time(1));
        for tick in 2..102 {
            let turned = 20 * (tick - 1);
            let raw = [(65_000 + turned) % 65_536, (65_536 - turned) % 65_536, turned].map(|c| c as i64);
            last = arm.read_with_gimbal([0; 3], Some(raw), time(tick));
        }
        // 2000 counts of 4000: half a turn of yaw and, through its sign, pitch; a quarter of roll.
        let expected = [std::f64::consts::PI, 0.25 + std::f64::consts::PI, std::f64::consts::FRAC_PI_2];
        for (found, wanted) in last.joint_angle_rad[3..].iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-12, "{last:?}");
        }
        let [w, x, y, z] = last.orientation_wxyz;
        let found = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        let about = |axis, angle| nalgebra::Rotation3::from_axis_angle(&axis, angle);
        use nalgebra::Vector3;
        let written_out = about(Vector3::y_axis(), expected[0])
            * about(Vector3::x_axis(), expected[1])
            * about(Vector3::z_axis(), expected[2]);
        assert!(found.angle_to(&written_out.into()) < 1e-7, "{found} (the angle of a rounding, as its root)");
        assert!(last.is_orientation_measured);
        let without = arm.read([0; 3], time(200));
        assert!(!without.is_orientation_measured);
        assert_eq!(without.orientation_wxyz, [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn the_gimbal_is_zeroed_together_with_the_joints() {
        let mut arm = arm(Zeroing::Ask);
        arm.read_with_gimbal([5, 6, 7], Some([100, 200, 300]), time(1));
        arm.zero();
        let home = arm.read_with_gimbal([5, 6, 7], Some([100, 200, 300]), time(2));
        assert_eq!(home.joint_angle_rad, [0.0, 0.0, 0.0, 0.0, 0.25, 0.0]);
        let turned = arm.read_with_gimbal([5, 6, 7], Some([101, 200, 300]), time(3));
        assert_eq!(turned.joint_angle_rad[3], std::f64::consts::TAU / 4000.0);
    }
}
