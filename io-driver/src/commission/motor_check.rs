//! Does each motor turn its own joint, and the right way?
//!
//! Model: one joint after another. Nothing for a while, until it rests; then a torque that grows slowly from
//! zero, in the positive sense, until some joint has turned by a few counts or the torque is all there may be.
//! A joint that turned the other way has a motor with the wrong sign (the counters were checked before); if
//! another joint turned more, channels are mixed up. Then nothing again.
//! Invariants: at most one torque is not zero; it never exceeds the limit; nothing depends on where the joint
//! goes but when to stop, so a wrong sign is no feedback.
//! Cost: constant.

/// What the check asks of the motors, and how far a joint has to turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCheckSpec {
    /// Largest torque of each joint (N m).
    pub torque_nm: [f64; 3],
    /// So far a joint has to turn (rad).
    pub turned_rad: [f64; 3],
    /// Ticks from no torque to all of it.
    pub ramp_ticks: u64,
    /// Ticks of rest before each joint.
    pub rest_ticks: u64,
}

/// What became of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorVerdict {
    /// Its joint turned as it should.
    Right,
    /// Its joint turned the other way.
    Reversed,
    /// Another joint turned instead.
    Crossed {
        /// Which.
        joint: usize,
    },
    /// Nothing turned.
    Stuck,
}

/// The check, from tick to tick.
#[derive(Debug, Clone, Copy)]
pub struct MotorCheck {
    spec: MotorCheckSpec,
    joint: usize,
    ticks: u64,
    start: [f64; 3],
    verdicts: [Option<MotorVerdict>; 3],
}

impl MotorCheck {
    /// A check that begins with the first joint at rest.
    pub fn new(spec: MotorCheckSpec) -> Self {
        Self { spec, joint: 0, ticks: 0, start: [0.0; 3], verdicts: [None; 3] }
    }

    /// The joint that is being tried, and its share of the torque; none while it rests or all are done.
    pub fn trying(&self) -> Option<(usize, f64)> {
        let ticks = self.ticks.checked_sub(self.spec.rest_ticks)?;
        (self.joint < 3).then(|| (self.joint, ticks as f64 / self.spec.ramp_ticks.max(1) as f64))
    }

    /// What has been found, once all joints have been tried.
    pub fn verdicts(&self) -> Option<[MotorVerdict; 3]> {
        let [a, b, c] = self.verdicts;
        Some([a?, b?, c?])
    }

    /// Takes the joint angles of a tick (rad), returns the joint torques for it (N m).
    pub fn step(&mut self, joints: [f64; 3]) -> [f64; 3] {
        if self.joint >= 3 {
            return [0.0; 3];
        }
        self.ticks += 1;
        let Some((joint, share)) = self.trying() else {
            self.start = joints;
            return [0.0; 3];
        };
        if let Some(verdict) = self.look(joints, share) {
            self.verdicts[joint] = Some(verdict);
            self.joint += 1;
            self.ticks = 0;
            return [0.0; 3];
        }
        let mut torque = [0.0; 3];
        torque[joint] = self.spec.torque_nm[joint] * share.min(1.0);
        torque
    }

    fn look(&self, joints: [f64; 3], share: f64) -> Option<MotorVerdict> {
        // In units of what counts as having turned.
        let turned: [f64; 3] = std::array::from_fn(|j| (joints[j] - self.start[j]) / self.spec.turned_rad[j]);
        let farthest = (0..3).fold(0, |far, j| if turned[j].abs() > turned[far].abs() { j } else { far });
        if turned[farthest].abs() >= 1.0 {
            return Some(match (farthest == self.joint, turned[farthest] > 0.0) {
                (true, true) => MotorVerdict::Right,
                (true, false) => MotorVerdict::Reversed,
                (false, _) => MotorVerdict::Crossed { joint: farthest },
            });
        }
        // A second time the ramp at full torque, for a joint that sticks.
        (share >= 2.0).then_some(MotorVerdict::Stuck)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEC: MotorCheckSpec = MotorCheckSpec {
        torque_nm: [0.05, 0.06, 0.07],
        turned_rad: [0.003; 3],
        ramp_ticks: 1000,
        rest_ticks: 100,
    };

    /// Masses with dry friction, driven through motors that are wired as the matrix says.
    struct Arm {
        wiring: [[f64; 3]; 3],
        friction_nm: [f64; 3],
        joints: [f64; 3],
        speeds: [f64; 3],
    }

    impl Arm {
        fn wired(wiring: [[f64; 3]; 3]) -> Self {
            Self { wiring, friction_nm: [0.006; 3], joints: [0.1, 0.2, 0.3], speeds: [0.0; 3] }
        }

        fn step(&mut self, torque: [f64; 3]) {
            for j in 0..3 {
                let drive: f64 = (0..3).map(|k| self.wiring[j][k] * torque[k]).sum();
                let friction = self.friction_nm[j];
                let slowed = (drive.abs() - friction).max(0.0) * drive.signum() - 0.2 * self.speeds[j];
                self.speeds[j] += 1e-3 / 2.5e-3 * slowed;
                self.joints[j] += 1e-3 * self.speeds[j];
            }
        }
    }

    fn check(mut arm: Arm) -> [MotorVerdict; 3] {
        let mut check = MotorCheck::new(SPEC);
        let home = arm.joints;
        for _ in 0..20_000 {
            let torque = check.step(arm.joints);
            assert!(torque.iter().filter(|t| **t != 0.0).count() <= 1);
            assert!((0..3).all(|j| (0.0..=SPEC.torque_nm[j]).contains(&torque[j])));
            arm.step(torque);
            for (now, home) in arm.joints.iter().zip(home) {
                // Few threshold widths: it coasts while the damping stops it.
                assert!((now - home).abs() < 0.03, "a joint ran away");
            }
            if let Some(verdicts) = check.verdicts() {
                return verdicts;
            }
        }
        panic!("it does not end");
    }

    const RIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn an_arm_that_is_wired_right_passes() {
        assert_eq!(check(Arm::wired(RIGHT)), [MotorVerdict::Right; 3]);
    }

    #[test]
    fn each_reversed_motor_is_found_and_the_others_are_not_blamed() {
        for reversed in 0..3 {
            let mut wiring = RIGHT;
            wiring[reversed][reversed] = -1.0;
            let mut expected = [MotorVerdict::Right; 3];
            expected[reversed] = MotorVerdict::Reversed;
            assert_eq!(check(Arm::wired(wiring)), expected);
        }
    }

    #[test]
    fn channels_that_are_mixed_up_are_told_by_name() {
        let swapped = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let crossed = |joint| MotorVerdict::Crossed { joint };
        assert_eq!(check(Arm::wired(swapped)), [crossed(1), crossed(0), MotorVerdict::Right]);
    }

    #[test]
    fn a_motor_that_is_not_connected_is_stuck() {
        let mut wiring = RIGHT;
        wiring[2][2] = 0.0;
        assert_eq!(
            check(Arm::wired(wiring)),
            [MotorVerdict::Right, MotorVerdict::Right, MotorVerdict::Stuck]
        );
    }
}
