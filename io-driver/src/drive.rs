//! From a force on the user to converter codes, within what motors and amplifiers stand.
//!
//! Model: joint torque `tau = J^T F + share * tau_gravity`; codes by [`MotorMap`]. If the weight alone would need more of
//! a motor than its amplifier gives or than its warmth allows, the weight's share is cut first, of all three alike; what
//! the motors have beyond that is the force's. A force that would need more is cut ([`Drive::attainable`]) before its
//! growth is bounded, so that it keeps its direction. The currents then warm the motors ([`Heat`]) until the next codes.
//! Frames and signs: forces on the user in D.
//! Invariants: codes are always valid ones. No force is always attainable: the torques that are left for it are a box
//! that has zero in it. The rendered force that is told is what the codes amount to, less the part of the arm's own
//! weight that they hold; what they do not hold is weight, as in an arm without compensation. Where the Jacobian is too
//! near a singularity to tell the force apart from the codes, the force before rounding is told.
//! Cost: one Jacobian and its inverse; no allocation.

use crate::device::{Effort, Written};
use crate::heat::{Heat, HeatSpec};
use crate::kinematics::gravity::Gravity;
use crate::kinematics::{Kinematics, Mechanism};
use crate::motors::{MotorMap, MotorSpec};
use crate::safety::Restrained;
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::frame::{LIMIT_HEAT, LIMIT_SATURATION};

/// Below this ratio of singular values a rounding error of a code would be blown up beyond meaning.
const TELLABLE: f64 = 1e-3;

/// The motors of an arm and how warm they are.
#[derive(Debug, Clone)]
pub struct Drive {
    kinematics: Kinematics,
    motors: MotorMap,
    peak_current_a: f64,
    heat: [Heat; 3],
    /// What holds the arm's own weight, if that is wanted.
    gravity: Option<Gravity>,
    current_a: [f64; 3],
    /// The motors were switched off since the time that was last accounted for.
    is_released: bool,
}

/// The part of the arm's weight that the motors hold.
#[derive(Debug, Clone, Copy)]
struct HeldWeight {
    /// Of each joint (N m).
    torque: Vector3<f64>,
    /// Of the whole, 0 to 1.
    share: f64,
}

impl Drive {
    /// Motors of which nobody knows how warm they are.
    pub fn new(kinematics: Kinematics, motors: &MotorSpec, heat: HeatSpec, gravity: Option<Gravity>) -> Self {
        Self {
            kinematics,
            motors: MotorMap::new(motors),
            peak_current_a: motors.peak_current_a,
            heat: [Heat::unknown(heat); 3],
            gravity,
            current_a: [0.0; 3],
            is_released: false,
        }
    }

    /// The codes of zero torque.
    pub fn zero_codes(&self) -> [u16; 3] {
        self.motors.zero_codes()
    }

    /// Time went by (s) with the currents of the last codes. If the motors were released meanwhile nobody knows
    /// when, and all of it counts as with currents: a fault that follows a stall comes at its end.
    pub fn pass(&mut self, elapsed_s: f64) {
        for (heat, current_a) in self.heat.iter_mut().zip(self.current_a) {
            heat.flow(current_a, elapsed_s);
        }
        if std::mem::take(&mut self.is_released) {
            self.current_a = [0.0; 3];
        }
    }

    /// The motors are off from now on.
    pub fn release(&mut self) {
        self.is_released = true;
    }

    /// The largest part of an effort's force that the motors can give in a pose, beside what holds the arm's weight.
    /// A torque that is not a number is left to [`render`](Self::render).
    pub fn attainable(&self, joints: [f64; 3], effort: Effort) -> Restrained {
        let allowed = self.allowed_current_a();
        let weight = self.held_weight(self.holding_torque(joints, effort.gravity_share), allowed).torque;
        let wanted = self.kinematics.joint_torque(joints, effort.force_on_user_n);
        let share = self.motors.share_within(wanted, weight.into(), allowed);
        if share >= 1.0 {
            return Restrained::whole(effort.force_on_user_n);
        }
        Restrained { force_on_user_n: effort.force_on_user_n * share, limits: self.limits(share, allowed) }
    }

    /// Codes for an effort in a pose, and what they amount to.
    ///
    /// # Errors
    /// [`FaultReason::MotorNotFinite`] if a torque is not a number.
    pub fn render(&mut self, joints: [f64; 3], effort: Effort) -> Result<([u16; 3], Written), FaultReason> {
        let whole_weight = self.holding_torque(joints, effort.gravity_share);
        let wanted = Vector3::from(self.kinematics.joint_torque(joints, effort.force_on_user_n));
        if !wanted.iter().chain(&whole_weight).all(|t| t.is_finite()) {
            return Err(FaultReason::MotorNotFinite);
        }
        let allowed = self.allowed_current_a();
        let held = self.held_weight(whole_weight, allowed);
        let share = self.motors.share_within(wanted.into(), held.torque.into(), allowed);
        let torque = wanted * share + held.torque;
        let command = self.motors.command_within(torque.into(), allowed);
        // None of a torque for which there is no number of steps.
        let share = share * command.scale;
        self.current_a = self.motors.current_a(command.codes);
        self.is_released = false;
        let residual = Vector3::from(self.motors.joint_torque(command.codes)) - held.torque - wanted * share;
        let written = Written {
            force_on_user_n: self.rendered(joints, effort.force_on_user_n * share, residual),
            motor_codes: command.codes.map(i64::from),
            limits: self.limits(share.min(held.share), allowed),
            motor_heat: self.heat.iter().map(Heat::rise).fold(0.0, f64::max),
        };
        Ok((command.codes, written))
    }

    fn allowed_current_a(&self) -> [f64; 3] {
        self.heat.map(|heat| heat.allowed_current_a(self.peak_current_a))
    }

    fn holding_torque(&self, joints: [f64; 3], share: f64) -> Vector3<f64> {
        let whole = self.gravity.as_ref().map(|gravity| Vector3::from(gravity.holding_torque(joints)));
        whole.map_or_else(Vector3::zeros, |whole| whole * share)
    }

    /// As much of the weight as the motors can hold.
    fn held_weight(&self, whole: Vector3<f64>, allowed_a: [f64; 3]) -> HeldWeight {
        let share = self.motors.share_within(whole.into(), [0.0; 3], allowed_a);
        HeldWeight { torque: whole * share, share }
    }

    /// The force that was scaled, and what the torques that are left over add to it.
    fn rendered(&self, joints: [f64; 3], scaled: Vector3<f64>, residual: Vector3<f64>) -> Vector3<f64> {
        if self.kinematics.singularity(joints).inverse_condition() < TELLABLE {
            return scaled;
        }
        let transposed = self.kinematics.jacobian(joints).transpose();
        transposed.try_inverse().map_or(scaled, |inverse| scaled + inverse * residual)
    }

    fn limits(&self, scale: f64, allowed_a: [f64; 3]) -> u64 {
        let is_warm = allowed_a.iter().any(|allowed| *allowed < self.peak_current_a);
        match (scale < 1.0, is_warm) {
            (false, _) => 0,
            (true, true) => LIMIT_HEAT,
            (true, false) => LIMIT_SATURATION,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_file::{DeviceFile, builtin};
    use proptest::prelude::*;
    use std::path::Path;

    fn drive(with_gravity: bool) -> Drive {
        let text = builtin("premium-1.5").unwrap();
        let DeviceFile::Arm(arm_file) = DeviceFile::parse(text, Path::new("premium-1.5")).unwrap() else {
            panic!("a premium")
        };
        let gravity = arm_file.gravity.filter(|_| with_gravity);
        Drive::new(arm_file.mechanism, &arm_file.motors, arm_file.heat, gravity)
    }

    fn push(force: Vector3<f64>) -> Effort {
        Effort { force_on_user_n: force, gravity_share: 1.0 }
    }

    const JOINTS: [f64; 3] = [0.1, 0.2, 0.3];

    #[test]
    fn what_is_told_is_what_the_codes_amount_to_with_and_without_weight() {
        for with_gravity in [false, true] {
            let mut drive = drive(with_gravity);
            let force = Vector3::new(0.7, -0.3, 1.1);
            let (codes, written) = drive.render(JOINTS, push(force)).unwrap();
            let torque = Vector3::from(drive.motors.joint_torque(codes)) - drive.holding_torque(JOINTS, 1.0);
            let told = Vector3::from(drive.kinematics.joint_torque(JOINTS, written.force_on_user_n));
            // Roundings of products near 0.1 N m.
            assert!((told - torque).norm() < 1e-15, "{told} {torque}");
            // Half a step of each converter: 0.035 mN m over levers of 0.05 to 0.3 m, some 5 mN.
            assert!((written.force_on_user_n - force).norm() < 5e-3, "{with_gravity} {written:?}");
            assert_eq!(written.limits, 0);
        }
    }

    /// There the codes do not tell it: a rounding would look like newtons.
    #[test]
    fn near_a_singular_pose_the_force_before_rounding_is_told() {
        let mut drive = drive(false);
        for (from_singular, is_told) in [(0.0, false), (1e-4, false), (0.1, true)] {
            let joints = [0.4, std::f64::consts::FRAC_PI_2 - from_singular, 0.0];
            let condition = drive.kinematics.singularity(joints).inverse_condition();
            assert_eq!(condition >= TELLABLE, is_told, "{condition}");
            let force = Vector3::new(0.7, -0.3, 1.1);
            let written = drive.render(joints, push(force)).unwrap().1;
            assert_eq!(written.force_on_user_n != force, is_told, "{written:?}");
        }
    }

    #[test]
    fn the_weight_is_held_on_top_of_the_force_and_only_by_its_share() {
        let mut with = drive(true);
        let mut without = drive(false);
        let torque = |codes| Vector3::from(drive(false).motors.joint_torque(codes));
        let (codes_with, _) = with.render(JOINTS, push(Vector3::zeros())).unwrap();
        let (codes_without, _) = without.render(JOINTS, push(Vector3::zeros())).unwrap();
        let expected = Vector3::from(with.gravity.unwrap().holding_torque(JOINTS));
        let step = with.motors.torque_per_step()[0];
        assert!((torque(codes_with) - torque(codes_without) - expected).amax() <= step, "to a step");
        let half = Effort { force_on_user_n: Vector3::zeros(), gravity_share: 0.5 };
        let codes_with_half = with.render(JOINTS, half).unwrap().0;
        assert!((torque(codes_with_half) - 0.5 * expected).amax() <= step, "to a step");
        let none = Effort { force_on_user_n: Vector3::zeros(), gravity_share: 0.0 };
        assert_eq!(with.render(JOINTS, none).unwrap().0, with.zero_codes());
    }

    #[test]
    fn a_long_strong_push_warms_the_motors_and_is_cut_back_in_its_own_direction() {
        let mut drive = drive(false);
        let force = Vector3::new(0.0, -6.0, 3.0);
        let mut last = None;
        for _ in 0..60_000 {
            drive.pass(1e-3);
            let (_, written) = drive.render(JOINTS, push(force)).unwrap();
            // Half a converter step, 1.3 mA, on 1.24 A.
            assert!(written.motor_heat < 1.0022, "{}", written.motor_heat);
            last = Some(written);
        }
        let written = last.unwrap();
        assert_eq!(written.limits, LIMIT_HEAT);
        assert!(written.force_on_user_n.norm() < 0.5 * force.norm(), "{written:?}");
        let turned = written.force_on_user_n.normalize().cross(&force.normalize()).norm();
        // Half a converter step of 5 mN on some 2 N.
        assert!(turned < 5e-3, "{turned}");
    }

    /// A loop that stalled held its last codes all the while, whatever it does first when it wakes.
    #[test]
    fn a_release_does_not_undo_the_warmth_of_the_time_before_it() {
        let motor_heat = |is_released: bool| {
            let mut drive = drive(false);
            drive.render(JOINTS, push(Vector3::y() * 6.0)).unwrap();
            if is_released {
                drive.release();
            }
            drive.pass(5.0);
            drive.render(JOINTS, Effort::default()).unwrap().1.motor_heat
        };
        assert_eq!(motor_heat(true), motor_heat(false));
        let mut drive = drive(false);
        drive.render(JOINTS, push(Vector3::y() * 6.0)).unwrap();
        drive.release();
        drive.pass(1e-3);
        let before = drive.heat[1].rise();
        drive.pass(1.0);
        assert!(drive.heat[1].rise() < before, "off, it cools");
    }

    proptest! {
        /// Beside the weight, and whatever each motor had before: then codes cut nothing more, to rounding.
        #[test]
        fn what_is_attainable_keeps_its_direction_and_is_rendered_as_it_is(
            force in prop::array::uniform3(-12.0..12.0f64),
            before in prop::array::uniform3(0.0..4.0f64),
            joints in prop::array::uniform3(-0.3..0.3f64),
        ) {
            let mut drive = drive(true);
            for (heat, current_a) in drive.heat.iter_mut().zip(before) {
                heat.flow(current_a, 30.0);
            }
            let force = Vector3::from(force);
            let attainable = drive.attainable(joints, push(force)).force_on_user_n;
            prop_assert!(force.cross(&attainable).norm() <= 1e-12 * force.norm_squared());
            prop_assert!(attainable.dot(&force) >= 0.0 && attainable.norm() <= force.norm());
            let allowed = drive.allowed_current_a();
            // Of the weight, what motors hold that are as warm as these.
            let weight = drive.held_weight(drive.holding_torque(joints, 1.0), allowed).torque;
            let wanted = Vector3::from(drive.kinematics.joint_torque(joints, attainable)) + weight;
            let scale = drive.motors.command_within(wanted.into(), allowed).scale;
            prop_assert!(scale > 1.0 - 1e-12, "{} {}", scale, attainable);
            // The longest of its direction: a little more is too much.
            let more = Vector3::from(drive.kinematics.joint_torque(joints, attainable * 1.001)) + weight;
            let is_cut = attainable.norm() < force.norm() * (1.0 - 1e-9);
            prop_assert!(!is_cut || attainable.norm() < 1e-3
                || drive.motors.command_within(more.into(), allowed).scale < 1.0);
        }
    }

    #[test]
    fn beyond_the_amplifiers_range_it_says_so() {
        let (_, written) = drive(false).render([0.0; 3], push(Vector3::y() * 50.0)).unwrap();
        assert_eq!(written.limits, LIMIT_SATURATION);
    }

    #[test]
    fn a_force_far_beyond_the_motors_takes_nothing_of_what_holds_the_weight() {
        let mut drive = drive(true);
        let force = Vector3::new(30.0, 100.0, -70.0);
        let (codes, _) = drive.render(JOINTS, push(force)).unwrap();
        let left = Vector3::from(drive.motors.joint_torque(codes)) - drive.holding_torque(JOINTS, 1.0);
        let direction = Vector3::from(drive.kinematics.joint_torque(JOINTS, force)).normalize();
        let across = left - direction * left.dot(&direction);
        assert!(left.dot(&direction) > 0.1 && across.amax() <= drive.motors.torque_per_step()[0], "{left}");
    }

    #[test]
    fn a_torque_that_is_not_a_number_is_a_fault() {
        let result = drive(false).render([f64::NAN, 0.0, 0.0], push(Vector3::x()));
        assert_eq!(result.unwrap_err(), FaultReason::MotorNotFinite);
    }
}
