//! Does each motor turn its own joint, and the right way?
//!
//! Model: one joint after another. Nothing until all have stood still for a while: an arm that falls by its weight
//! would turn whatever a motor does. Then a torque that grows slowly from zero, in the positive sense, until some
//! joint has turned by a few counts or the torque is all there may be; if nothing turned, the same in the negative
//! sense, for a joint that lies against a stop.
//! A joint that turned the other way has a motor with the wrong sign (the counters were checked before); if
//! another joint turned more, channels are mixed up. Then nothing again.
//! What is tried are the signs, not the strength: friction, weight and a hand that steadies the arm may take most of
//! the torque, as long as what is left turns the joint farther than a hand trembles.
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
    /// Ticks for which all joints have to rest before each is tried.
    pub rest_ticks: u64,
    /// Share of what counts as having turned within which a joint rests.
    pub rest_share: f64,
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
    /// The sense in which it is tried: 1 or -1.
    sense: f64,
    ticks: u64,
    restless_ticks: u64,
    start: [f64; 3],
    verdicts: [Option<MotorVerdict>; 3],
}

impl MotorCheck {
    /// A check that begins with the first joint at rest.
    pub fn new(spec: MotorCheckSpec) -> Self {
        let start = [f64::NAN; 3];
        Self { spec, joint: 0, sense: 1.0, ticks: 0, restless_ticks: 0, start, verdicts: [None; 3] }
    }

    /// For how many ticks the arm has been waited for to rest.
    pub fn restless_ticks(&self) -> u64 {
        self.restless_ticks
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
        let Some((joint, share)) = self.trying() else {
            self.rest(joints);
            return [0.0; 3];
        };
        self.ticks += 1;
        match self.look(joints, share) {
            None => {
                let mut torque = [0.0; 3];
                torque[joint] = self.sense * self.spec.torque_nm[joint] * share.min(1.0);
                torque
            }
            Some(MotorVerdict::Stuck) if self.sense > 0.0 => self.go_on(joint, -1.0),
            Some(verdict) => {
                self.verdicts[joint] = Some(verdict);
                self.go_on(joint + 1, 1.0)
            }
        }
    }

    /// With this joint in this sense; first a rest.
    fn go_on(&mut self, joint: usize, sense: f64) -> [f64; 3] {
        (self.joint, self.sense, self.ticks, self.restless_ticks) = (joint, sense, 0, 0);
        [0.0; 3]
    }

    /// A rest begins anew whenever a joint has left where it began.
    fn rest(&mut self, joints: [f64; 3]) {
        self.restless_ticks += 1;
        let rests = self.turned(joints).into_iter().all(|turned| turned.abs() <= self.spec.rest_share);
        if self.ticks > 0 && rests {
            self.ticks += 1;
        } else {
            self.ticks = 1;
            self.start = joints;
        }
        if self.ticks >= self.spec.rest_ticks {
            self.start = joints;
        }
    }

    /// Since the rest began, in units of what counts as having turned.
    fn turned(&self, joints: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| (joints[j] - self.start[j]) / self.spec.turned_rad[j])
    }

    fn look(&self, joints: [f64; 3], share: f64) -> Option<MotorVerdict> {
        let turned = self.turned(joints);
        let farthest = (0..3).fold(0, |far, j| if turned[j].abs() > turned[far].abs() { j } else { far });
        if turned[farthest].abs() >= 1.0 {
            return Some(match (farthest == self.joint, turned[farthest] * self.sense > 0.0) {
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
        rest_share: 0.3,
    };

    /// Masses with dry friction, driven through motors that are wired as the matrix says.
    struct Arm {
        wiring: [[f64; 3]; 3],
        friction_nm: [f64; 3],
        weight_nm: [f64; 3],
        stops: [f64; 3],
        joints: [f64; 3],
        speeds: [f64; 3],
    }

    impl Arm {
        fn wired(wiring: [[f64; 3]; 3]) -> Self {
            Self {
                wiring,
                friction_nm: [0.006; 3],
                weight_nm: [0.0; 3],
                stops: [f64::INFINITY; 3],
                joints: [0.1, 0.2, 0.3],
                speeds: [0.0; 3],
            }
        }

        fn step(&mut self, torque: [f64; 3]) {
            for j in 0..3 {
                let drive = self.weight_nm[j] + (0..3).map(|k| self.wiring[j][k] * torque[k]).sum::<f64>();
                let friction = self.friction_nm[j];
                let slowed = (drive.abs() - friction).max(0.0) * drive.signum() - 0.2 * self.speeds[j];
                self.speeds[j] += 1e-3 / 2.5e-3 * slowed;
                self.joints[j] += 1e-3 * self.speeds[j];
                if self.joints[j] > self.stops[j] {
                    (self.joints[j], self.speeds[j]) = (self.stops[j], 0.0);
                }
            }
        }
    }

    fn check(mut arm: Arm) -> [MotorVerdict; 3] {
        let mut check = MotorCheck::new(SPEC);
        let home = arm.joints;
        for _ in 0..20_000 {
            let torque = check.step(arm.joints);
            assert!(torque.iter().filter(|t| **t != 0.0).count() <= 1);
            assert!((0..3).all(|j| torque[j].abs() <= SPEC.torque_nm[j]));
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

    #[test]
    fn a_joint_at_its_stop_is_tried_away_from_it() {
        for sign in [1.0, -1.0] {
            let mut wiring = RIGHT;
            wiring[1][1] = sign;
            // Its weight presses it on.
            let arm = Arm { stops: [1.0, 0.2, 1.0], weight_nm: [0.0, 0.02, 0.0], ..Arm::wired(wiring) };
            let expected = if sign > 0.0 { MotorVerdict::Right } else { MotorVerdict::Reversed };
            assert_eq!(check(arm), [MotorVerdict::Right, expected, MotorVerdict::Right]);
        }
    }

    #[test]
    fn an_arm_that_falls_is_waited_for_and_not_judged() {
        let mut arm = Arm { weight_nm: [0.0, -0.02, 0.0], ..Arm::wired(RIGHT) };
        let mut check = MotorCheck::new(SPEC);
        for _ in 0..5000 {
            assert_eq!(check.step(arm.joints), [0.0; 3]);
            arm.step([0.0; 3]);
        }
        assert_eq!((check.trying(), check.verdicts(), check.restless_ticks()), (None, None, 5000));
    }
}
