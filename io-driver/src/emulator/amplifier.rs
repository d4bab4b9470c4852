//! What a good amplifier does: it checks what it gets, minds its watchdog, and switches itself off.
//!
//! Model: three channels with converters of some bits. Each value is checked against limits that the driver
//! knows nothing of: the codes' range, the force at the tip that the torques amount to in the pose of the moment (where
//! the pose can tell, which it cannot near a singular one), and how far that force is from the one before, unless it
//! only became shorter. How warm the motors are is not checked. A value that fails trips the amplifiers, and so does
//! silence for longer than the watchdog waits while they are on. Tripped they give no current until they are armed anew.
//! Frames and signs: forces on the user in the device's base frame D.
//! Invariants: no current flows while off or tripped; every value is counted once, as good or under what was
//! wrong with it.

use crate::kinematics::{Kinematics, Mechanism};
use crate::motors::MotorSpec;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What an amplifier lets pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplifierSpec {
    /// Converters and motors.
    pub motors: MotorSpec,
    /// The arm that they move.
    pub kinematics: Kinematics,
    /// Longest force at the tip (N); infinite: not checked.
    pub peak_n: f64,
    /// How far a force may be from the one before, unless that only became shorter (N); infinite: not checked.
    pub step_n: f64,
    /// Silence that trips it (ns).
    pub watchdog_ns: u64,
}

/// One value as it comes from the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Value {
    /// When it was written (ns).
    pub time_ns: u64,
    /// Codes of the three joints' converters.
    pub codes: [u16; 3],
    /// Whether the amplifiers are to be on.
    pub enable: bool,
}

/// Names each count once: the fields of [`Tally`], in the order of the words in the card.
macro_rules! tally {
    ($($(#[$doc:meta])* $name:ident,)+) => {
        /// What was seen so far.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
        pub struct Tally {
            $($(#[$doc])* pub $name: u64,)+
        }

        impl Tally {
            /// How many counts there are.
            pub const WORDS: usize = [$(stringify!($name)),+].len();

            /// The counts in the order of the fields, as they lie in the card.
            pub fn to_words(&self) -> [u64; Self::WORDS] {
                [$(self.$name),+]
            }

            /// Back from the card.
            pub fn from_words(words: [u64; Self::WORDS]) -> Self {
                let [$($name),+] = words;
                Self { $($name),+ }
            }
        }
    };
}

tally! {
    /// Values that were checked.
    checked,
    /// Values that were overwritten before they could be.
    lost,
    /// Values with the amplifiers on and any torque.
    energised,
    /// Codes that no converter has.
    bad_codes,
    /// Torque asked for with the amplifiers off.
    torque_while_off,
    /// Forces beyond the peak.
    beyond_peak,
    /// Forces that grew, turned or reversed too fast.
    beyond_step,
    /// Times the watchdog was not served.
    watchdog_trips,
    /// Times it was switched off by a register alone, as a dying driver does.
    switched_off,
    /// The longest force at the tip (uN).
    largest_force_un,
    /// Number of the first value that was wrong; 0: none.
    first_wrong,
}

/// The amplifiers of one arm.
#[derive(Debug)]
pub struct Amplifier {
    spec: AmplifierSpec,
    value: Value,
    is_tripped: bool,
    /// The force before this one.
    last_force: Vector3<f64>,
    tally: Tally,
}

impl Tally {
    /// Values that were wrong.
    pub fn wrong(&self) -> u64 {
        self.bad_codes + self.torque_while_off + self.beyond_peak + self.beyond_step
    }
}

impl Amplifier {
    /// Off, without a value.
    pub fn new(spec: AmplifierSpec) -> Self {
        let value = Value { time_ns: 0, codes: [zero_code(&spec.motors); 3], enable: false };
        Self { spec, value, is_tripped: false, last_force: Vector3::zeros(), tally: Tally::default() }
    }

    /// What was seen so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Whether it has switched itself off.
    pub fn is_tripped(&self) -> bool {
        self.is_tripped
    }

    /// So many values could not be checked.
    pub fn lose(&mut self, values: u64) {
        self.tally.lost += values;
    }

    /// Takes a value, for an arm in that pose.
    pub fn take(&mut self, value: Value, joints: [f64; 3]) {
        self.tally.checked += 1;
        let wrong = self.tally.wrong();
        self.check(value, joints);
        if self.tally.wrong() > wrong {
            self.is_tripped = true;
            if self.tally.first_wrong == 0 {
                self.tally.first_wrong = self.tally.checked;
            }
        }
        self.value = value;
    }

    /// Time has come to `now_ns`, and the enable register reads `is_enabled`.
    pub fn pass(&mut self, now_ns: u64, is_enabled: bool) {
        if self.value.enable && !is_enabled {
            self.tally.switched_off += 1;
            self.value.enable = false;
        }
        let silence_ns = now_ns.saturating_sub(self.value.time_ns);
        if self.value.enable && !self.is_tripped && silence_ns > self.spec.watchdog_ns {
            self.tally.watchdog_trips += 1;
            self.is_tripped = true;
        }
    }

    /// Somebody armed it anew: it may be switched on again, beginning without force.
    pub fn arm(&mut self) {
        self.is_tripped = false;
        self.value.enable = false;
        self.last_force = Vector3::zeros();
    }

    /// Joint torques that the motors make now (N m).
    pub fn joint_torque(&self) -> [f64; 3] {
        self.codes().map_or([0.0; 3], |codes| self.torque_of(codes))
    }

    /// The codes that it regulates to; `None` while it is off or has tripped.
    pub fn codes(&self) -> Option<[u16; 3]> {
        (!self.is_tripped && self.value.enable).then_some(self.value.codes)
    }

    fn check(&mut self, value: Value, joints: [f64; 3]) {
        let zero = zero_code(&self.spec.motors);
        let tally = &mut self.tally;
        let is_code = |code: &u16| (1..2 * u32::from(zero)).contains(&u32::from(*code));
        if !value.codes.iter().all(is_code) {
            tally.bad_codes += 1;
            return;
        }
        let has_torque = value.codes.iter().any(|code| *code != zero);
        if !value.enable {
            tally.torque_while_off += u64::from(has_torque);
            self.last_force = Vector3::zeros();
            return;
        }
        tally.energised += u64::from(has_torque);
        if let Some(force) = self.force_of(value.codes, joints) {
            self.check_force(force);
        }
    }

    fn check_force(&mut self, force: Vector3<f64>) {
        let tally = &mut self.tally;
        tally.largest_force_un = tally.largest_force_un.max((force.norm() * 1e6) as u64);
        tally.beyond_peak += u64::from(force.norm() > self.spec.peak_n + RESOLUTION_N);
        let is_step = (force - self.last_force).norm() <= self.spec.step_n + RESOLUTION_N;
        let is_shortened = distance_to_shorter_ones(self.last_force, force) <= RESOLUTION_N;
        tally.beyond_step += u64::from(!is_step && !is_shortened);
        self.last_force = force;
    }

    /// The force at the tip; none where the pose cannot tell.
    fn force_of(&self, codes: [u16; 3], joints: [f64; 3]) -> Option<Vector3<f64>> {
        if self.spec.kinematics.singularity(joints).inverse_condition() < 0.05 {
            return None;
        }
        let inverse = self.spec.kinematics.jacobian(joints).transpose().try_inverse()?;
        Some(inverse * Vector3::from(self.torque_of(codes)))
    }

    /// Reckoned from the description anew, not by the driver's own map.
    fn torque_of(&self, codes: [u16; 3]) -> [f64; 3] {
        let MotorSpec { sign, reduction, torque_constant_nm_per_a, peak_current_a, .. } = self.spec.motors;
        let zero = f64::from(zero_code(&self.spec.motors));
        std::array::from_fn(|j| {
            let current_a = (f64::from(codes[j]) - zero) / zero * peak_current_a;
            f64::from(sign[j]) * reduction[j] * torque_constant_nm_per_a * current_a
        })
    }
}

/// How far a force is from the nearest one that only shortens the last: by the three cases of a point beside a
/// segment, and not by the driver's own limiter.
fn distance_to_shorter_ones(last: Vector3<f64>, force: Vector3<f64>) -> f64 {
    let along = force.dot(&last);
    if along <= 0.0 {
        force.norm()
    } else if along >= last.norm_squared() {
        (force - last).norm()
    } else {
        force.cross(&last).norm() / last.norm()
    }
}

fn zero_code(motors: &MotorSpec) -> u16 {
    1 << (motors.dac_bits.clamp(2, 16) - 1)
}

/// The converters' steps over the levers of an arm, both values of a step rounded, and an arm that moved a
/// little between being read and being written: N.
const RESOLUTION_N: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Effort;
    use crate::device_file::{ArmFile, DeviceFile, builtin};
    use crate::drive::Drive;
    use std::path::Path;

    const MS: u64 = 1_000_000;

    fn premium() -> ArmFile {
        match DeviceFile::parse(builtin("premium-1.5").unwrap(), Path::new("premium-1.5")) {
            Ok(DeviceFile::Arm(arm_file)) => *arm_file,
            other => panic!("{other:?}"),
        }
    }

    fn amplifier() -> Amplifier {
        let arm_file = premium();
        let kinematics = arm_file.mechanism;
        Amplifier::new(AmplifierSpec {
            motors: arm_file.motors,
            kinematics,
            peak_n: 8.5,
            step_n: 5.0,
            watchdog_ns: 10 * MS,
        })
    }

    fn codes(force: Vector3<f64>) -> [u16; 3] {
        let arm_file = premium();
        let kinematics = arm_file.mechanism;
        let mut drive = Drive::new(kinematics, &arm_file.motors, arm_file.heat, None);
        drive.render([0.0; 3], Effort { force_on_user_n: force, gravity_share: 0.0 }).unwrap().0
    }

    fn value(time_ns: u64, force: Vector3<f64>) -> Value {
        Value { time_ns, codes: codes(force), enable: true }
    }

    #[test]
    fn a_force_within_all_limits_is_made() {
        let mut amplifier = amplifier();
        let force = Vector3::new(1.0, -2.0, 0.5);
        amplifier.take(value(MS, force), [0.0; 3]);
        let torque = amplifier.joint_torque();
        let expected = premium().mechanism.joint_torque([0.0; 3], force);
        for j in 0..3 {
            // Half a converter step: 5.5 A / 2048 * 23.4 mN m/A * 13.5 / 2.
            assert!((torque[j] - expected[j]).abs() < 4.3e-4, "joint {j}");
        }
        assert_eq!((amplifier.tally().wrong(), amplifier.tally().checked), (0, 1));
    }

    #[test]
    fn silence_trips_it_and_arming_lets_it_begin_again() {
        let mut amplifier = amplifier();
        amplifier.take(value(MS, Vector3::x()), [0.0; 3]);
        amplifier.pass(11 * MS, true);
        assert!(!amplifier.is_tripped(), "10 ms are allowed");
        amplifier.pass(11 * MS + 1, true);
        assert!(amplifier.is_tripped());
        amplifier.take(value(12 * MS, Vector3::x()), [0.0; 3]);
        assert_eq!(amplifier.joint_torque(), [0.0; 3], "a late value does not help");
        amplifier.arm();
        amplifier.take(value(13 * MS, Vector3::x()), [0.0; 3]);
        assert_ne!(amplifier.joint_torque(), [0.0; 3]);
        assert_eq!(amplifier.tally().watchdog_trips, 1);
    }

    #[test]
    fn a_cleared_enable_register_is_zero_torque_at_once() {
        let mut amplifier = amplifier();
        amplifier.take(value(MS, Vector3::x()), [0.0; 3]);
        amplifier.pass(MS + 1, false);
        assert_eq!((amplifier.joint_torque(), amplifier.tally().switched_off), ([0.0; 3], 1));
        amplifier.pass(100 * MS, false);
        assert!(!amplifier.is_tripped(), "off needs no watchdog");
    }

    #[test]
    fn each_limit_trips_it_and_is_counted_apart() {
        let zero = Value { time_ns: MS, codes: [2048; 3], enable: true };
        type Count = fn(&Tally) -> u64;
        let wrongs: [(Value, Count); 5] = [
            (Value { codes: [0, 2048, 2048], ..zero }, |tally| tally.bad_codes),
            (Value { codes: [2048, 4096, 2048], ..zero }, |tally| tally.bad_codes),
            (Value { codes: [2048, 2100, 2048], enable: false, ..zero }, |tally| tally.torque_while_off),
            (value(MS, Vector3::z() * 5.2), |tally| tally.beyond_step),
            (Value { codes: [4095, 4095, 4095], ..zero }, |tally| tally.beyond_peak),
        ];
        for (value, count) in wrongs {
            let mut amplifier = amplifier();
            amplifier.take(zero, [0.0; 3]);
            amplifier.take(value, [0.0; 3]);
            assert!(amplifier.is_tripped(), "{value:?}");
            let tally = amplifier.tally();
            assert_eq!((count(&tally), tally.first_wrong, tally.checked), (1, 2, 2), "{value:?}");
        }
    }

    #[test]
    fn a_force_may_vanish_or_shorten_at_once_but_neither_reverse_nor_turn() {
        let (mut amplifier, mut time_ns) = (amplifier(), 0);
        let mut is_wrong = |force: Vector3<f64>| {
            let before = amplifier.tally().beyond_step;
            time_ns += MS;
            amplifier.take(value(time_ns, force), [0.0; 3]);
            amplifier.tally().beyond_step > before
        };
        for z in [4.0, 8.0, 1.0, 5.0, 0.0, 4.9, 0.0, -4.9, 0.0, 2.4, -2.4] {
            assert!(!is_wrong(Vector3::z() * z), "{z}");
        }
        assert!(is_wrong(Vector3::z() * 2.8), "5.2 N from one side to the other");
        assert!(!is_wrong(Vector3::zeros()));
        assert!(!is_wrong(Vector3::y() * 4.0));
        assert!(is_wrong(Vector3::z() * 4.0), "as long as before, and 5.7 N away");
    }

    #[test]
    fn the_tally_survives_the_way_through_the_card() {
        let words: [u64; Tally::WORDS] = std::array::from_fn(|i| i as u64 + 1);
        assert_eq!(Tally::from_words(words).to_words(), words);
    }
}
