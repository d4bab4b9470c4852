//! Turns joint torques into the codes of the motors' digital-to-analogue converters, and back.
//!
//! Problem: a converter has a coarse, finite range; what it cannot render has to be cut such that
//! the user still feels the right direction.
//! Model: motor torque `sign tau / reduction`; current by the torque constant; code in offset
//! binary, `2^(bits-1)` for zero and one step per `peak current / 2^(bits-1)`, so that 12 bits
//! have 2048 for zero. The most negative code is never used, to give both directions one range.
//! Saturation: if one motor is beyond its range, *all three* are scaled by the same factor. By
//! `tau = J^T F` that scales the force and keeps its direction; clipping each motor by itself
//! would turn the force, add a push along a wall to the one against it, and leave the friction
//! cone that was computed for it.
//! Signs: +1 where a positive current raises the joint angle.
//! Invariants: every code is a valid one. If any torque is not finite all three codes are zero
//! torque, the safe force, and the command says so.
//! Cost: a few operations per joint.

/// How a device drives its motors; what each number is for stands in its description file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSpec {
    /// Which of the device's converters belongs to each joint.
    pub channel: [u8; 3],
    /// +1 or -1: whether positive current raises or lowers the joint angle.
    pub sign: [i8; 3],
    /// Turns of the motor per turn of the joint.
    pub reduction: [f64; 3],
    /// Torque of the motor per current.
    pub torque_constant_nm_per_a: f64,
    /// Current at full scale of the converter.
    pub peak_current_a: f64,
    /// Width of the converter, 2 to 16.
    pub dac_bits: u32,
}

/// Map between joint torques and converter codes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorMap {
    sign: [i8; 3],
    reduction: [f64; 3],
    torque_constant_nm_per_a: f64,
    /// Current of one step of the converter.
    step_a: f64,
    /// Code of zero torque.
    zero: u16,
}

/// What to write to the converters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCommand {
    /// Code of each joint's converter.
    pub codes: [u16; 3],
    /// Part of the wanted torque that is rendered: 1, less when saturated, 0 if the torque was
    /// not finite.
    pub scale: f64,
}

impl MotorMap {
    /// The map of a device. A converter width outside 2 to 16 bits is taken as the nearest.
    pub fn new(spec: &MotorSpec) -> Self {
        let zero = 1u16 << (spec.dac_bits.clamp(2, 16) - 1);
        Self {
            sign: spec.sign,
            reduction: spec.reduction,
            torque_constant_nm_per_a: spec.torque_constant_nm_per_a,
            step_a: spec.peak_current_a / f64::from(zero),
            zero,
        }
    }

    /// Codes for joint torques in N m.
    pub fn command(&self, joint_torque: [f64; 3]) -> MotorCommand {
        self.command_within(joint_torque, [f64::INFINITY; 3])
    }

    /// Codes for joint torques in N m, of which none takes more than the allowed current (A), to half a step.
    pub fn command_within(&self, joint_torque: [f64; 3], allowed_a: [f64; 3]) -> MotorCommand {
        let steps = self.steps(joint_torque);
        // A sum is finite only if all are; overflow of huge ones ends in the same safe place.
        if !steps.iter().map(|s| s.abs()).sum::<f64>().is_finite() {
            return MotorCommand { codes: self.zero_codes(), scale: 0.0 };
        }
        let scale = steps.iter().zip(allowed_a).fold(1.0_f64, |scale, (steps, allowed_a)| {
            let range = self.range(allowed_a);
            if steps.abs() <= range { scale } else { scale.min(range / steps.abs()) }
        });
        MotorCommand { codes: steps.map(|s| self.code(scale * s)), scale }
    }

    /// The largest part, 0 to 1, of joint torques (N m) that can be had beside others, within the allowed currents (A)
    /// and the converters' range. One of what is not finite.
    pub fn share_within(&self, joint_torque: [f64; 3], beside: [f64; 3], allowed_a: [f64; 3]) -> f64 {
        let (steps, beside) = (self.steps(joint_torque), self.steps(beside));
        if !steps.iter().all(|s| s.is_finite()) {
            return 1.0;
        }
        (0..3).fold(1.0_f64, |share, j| {
            let range = self.range(allowed_a[j]);
            // Towards the end of the range that the torque points to.
            let room = range - beside[j] * steps[j].signum();
            if steps[j].abs() > room { share.min((room / steps[j].abs()).max(0.0)) } else { share }
        })
    }

    /// The codes of zero torque.
    pub fn zero_codes(&self) -> [u16; 3] {
        [self.zero; 3]
    }

    /// Joint torques, N m, which codes really make: rounding and saturation included.
    pub fn joint_torque(&self, codes: [u16; 3]) -> [f64; 3] {
        let motor_torque = self.motor_torque(codes);
        std::array::from_fn(|j| f64::from(self.sign[j]) * self.reduction[j] * motor_torque[j])
    }

    /// Torques at the motor shafts, N m, in the motors' own sense of turning.
    pub fn motor_torque(&self, codes: [u16; 3]) -> [f64; 3] {
        self.current_a(codes).map(|current| self.torque_constant_nm_per_a * current)
    }

    /// Motor currents.
    pub fn current_a(&self, codes: [u16; 3]) -> [f64; 3] {
        codes.map(|code| (f64::from(code) - f64::from(self.zero)) * self.step_a)
    }

    /// Joint torque of one step of each converter, N m: rounding loses at most half of it.
    pub fn torque_per_step(&self) -> [f64; 3] {
        self.reduction.map(|r| r * self.torque_constant_nm_per_a * self.step_a)
    }

    /// Largest joint torque of each motor alone, N m.
    pub fn peak_joint_torque(&self) -> [f64; 3] {
        self.torque_per_step().map(|t| t * f64::from(self.zero - 1))
    }

    /// Wanted steps of each converter from its zero, in any range.
    fn steps(&self, joint_torque: [f64; 3]) -> [f64; 3] {
        let torque_per_step = self.torque_per_step();
        std::array::from_fn(|j| f64::from(self.sign[j]) * joint_torque[j] / torque_per_step[j])
    }

    /// So many steps a current amounts to, as far as the converter has them.
    fn range(&self, allowed_a: f64) -> f64 {
        // `max` takes the number of the two: a range that is none allows nothing.
        f64::from(self.zero - 1).min((allowed_a / self.step_a).max(0.0))
    }

    /// Code of a number of steps within the range.
    fn code(&self, steps: f64) -> u16 {
        // Between 1 and 2 zero - 1, which fits: the caller has scaled.
        (f64::from(self.zero) + steps.round()) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{JointLimits, Mechanism, Premium};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    const PREMIUM: MotorSpec = MotorSpec {
        channel: [0, 1, 2],
        sign: [1, -1, 1],
        reduction: [175.0 / 13.0, 11.3, 11.3],
        torque_constant_nm_per_a: 0.0234,
        peak_current_a: 5.5,
        dac_bits: 12,
    };

    fn map() -> MotorMap {
        MotorMap::new(&PREMIUM)
    }

    #[test]
    fn no_torque_is_the_middle_code() {
        assert_eq!(map().command([0.0, -0.0, 0.0]), MotorCommand { codes: [2048; 3], scale: 1.0 });
        assert_eq!(map().joint_torque([2048; 3]), [0.0; 3]);
    }

    #[test]
    fn a_step_is_the_peak_current_over_two_thousand_and_forty_eight() {
        let step = map().torque_per_step();
        // 5.5 A / 2048 * 23.4 mN m/A * 11.3, to rounding.
        assert!((step[1] - 5.5 / 2048.0 * 0.0234 * 11.3).abs() < 1e-18);
        assert_eq!(map().command([step[0], step[1], -2.0 * step[2]]).codes, [2049, 2047, 2046]);
    }

    #[test]
    fn the_peak_force_of_the_data_sheet_is_within_range_at_home() {
        let premium = Premium::new([0.215, 0.170], JointLimits::UNBOUNDED);
        let torque = premium.joint_torque([0.0; 3], Vector3::new(0.0, 0.0, 8.5));
        assert_eq!(map().command(torque).scale, 1.0);
    }

    #[test]
    fn beyond_the_range_all_motors_are_scaled_alike() {
        let peak = map().peak_joint_torque();
        let command = map().command([2.0 * peak[0], peak[1], 0.0]);
        // Half of 2047 steps is between two codes.
        assert!(command.codes[0] == 4095 && (1024..=1025).contains(&command.codes[1]), "{command:?}");
        assert!((command.scale - 0.5).abs() < 1e-15 && command.codes[2] == 2048);
        assert_eq!(map().command([-9e9, 0.0, 0.0]).codes, [1, 2048, 2048]);
    }

    #[test]
    fn what_is_not_finite_becomes_no_torque_on_any_motor() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
            for joint in 0..3 {
                let mut torque = [0.1; 3];
                torque[joint] = bad;
                assert_eq!(map().command(torque), MotorCommand { codes: [2048; 3], scale: 0.0 });
            }
        }
    }

    #[test]
    fn no_motor_takes_more_than_it_is_allowed_and_all_are_scaled_alike() {
        let step = map().torque_per_step();
        let torque = [1000.0 * step[0], 500.0 * step[1], 0.0];
        let command = map().command_within(torque, [f64::INFINITY, 100.0 * 5.5 / 2048.0, 0.0]);
        // The second motor has a fifth of what it wants, so the first gets a fifth too; signs as in the file.
        assert_eq!(command.codes, [2248, 1948, 2048]);
        assert!((command.scale - 0.2).abs() < 1e-15);
        assert_eq!(map().command_within(torque, [f64::NAN; 3]).codes, [2048; 3]);
        assert_eq!(map().command_within(torque, [-1.0; 3]).codes, [2048; 3]);
    }

    #[test]
    fn sixteen_bits_fit() {
        let wide = MotorMap::new(&MotorSpec { dac_bits: 16, sign: [1; 3], ..PREMIUM });
        assert_eq!(wide.command([1e3, 0.0, 0.0]).codes, [65_535, 32_768, 32_768]);
        assert_eq!(wide.command([-1e3, 0.0, 0.0]).codes, [1, 32_768, 32_768]);
        assert_eq!(wide.zero_codes(), [32_768; 3]);
    }

    proptest! {
        #[test]
        fn the_written_torque_is_the_scaled_one_to_half_a_step(
            torque in prop::array::uniform3(-5.0..5.0_f64),
        ) {
            let command = map().command(torque);
            let (written, step) = (map().joint_torque(command.codes), map().torque_per_step());
            for j in 0..3 {
                // 1e-12 steps for rounding.
                prop_assert!((written[j] - command.scale * torque[j]).abs() <= (0.5 + 1e-12) * step[j]);
            }
        }

        /// Two codes are `0.5 sqrt 3` steps at most from the line, out of 2047 on it: the written
        /// motor vector leaves the wanted direction by less than a milliradian.
        #[test]
        fn saturation_keeps_the_direction(torque in prop::array::uniform3(-50.0..50.0_f64)) {
            let command = map().command(torque);
            prop_assume!(command.scale < 1.0);
            let in_steps = |t: [f64; 3]| {
                Vector3::from_fn(|j, _| t[j] / map().torque_per_step()[j])
            };
            let (wanted, written) = (in_steps(torque), in_steps(map().joint_torque(command.codes)));
            prop_assert!(wanted.angle(&written) < 1e-3, "{wanted} {written}");
            prop_assert!((written.amax() - 2047.0).abs() < 1e-9);
        }

        #[test]
        fn codes_survive_the_way_to_torques_and_back(codes in prop::array::uniform3(1u16..=4095)) {
            prop_assert_eq!(map().command(map().joint_torque(codes)).codes, codes);
        }

        #[test]
        fn every_torque_makes_valid_codes(torque: [f64; 3]) {
            let command = map().command(torque);
            prop_assert!(command.codes.iter().all(|c| (1..=4095).contains(c)));
            prop_assert!((0.0..=1.0).contains(&command.scale));
        }
    }
}
