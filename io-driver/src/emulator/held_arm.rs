//! A simulated arm behind an emulated card, and the hand that holds it.
//!
//! Problem: a developer without hardware should meet the whole chain, with a driver in one process and everything that
//! it drives in another: registers, an amplifier that judges, an arm with mass, weight and friction, a hand.
//! Model: [`SimulatedArm`] and [`ImpedanceHand`], as in a simulated device. They go on in steps of [`STEP_S`], so that
//! nothing has to be worked out anew for each of the emulator's rounds; what is left of a round is made up in the next.
//! The amplifier's watchdog is that of the emulator: the description's own would be a second one behind it.
//! Frames: the world is the device's base frame D.
//! Cost: some 6 us for each millisecond that passes; no allocation.

use super::motion::{Handle, Pose};
use crate::device::simulated::Wish;
use crate::device_file::ArmFile;
use crate::encoders::{JointMap, wrapped};
use crate::kinematics::{Kinematics, Mechanism};
use crate::sim::arm::{NobodyHolds, STEP_S, SimulatedArm};
use crate::sim::hand::{Felt, HandModel, ImpedanceHand};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

/// Steps after which a hand thinks again: a millisecond.
const STEPS_PER_THOUGHT: u32 = 16;

/// Arm and hand.
#[derive(Debug)]
pub struct HeldArm {
    plant: SimulatedArm,
    kinematics: Kinematics,
    map: JointMap,
    count_bits: u32,
    wish: Wish,
    hand: Option<ImpedanceHand>,
    orientation: UnitQuaternion<f64>,
    buttons: Option<u32>,
    /// What has passed (s), and what of it the plant has still to make up (s).
    time_s: f64,
    owed_s: f64,
    steps: u32,
}

/// Why an arm cannot be simulated, or held there.
#[derive(Debug, Error)]
pub enum HeldArmError {
    /// The description is for real devices only.
    #[error(
        "the description says nothing of how the arm moves; it needs the table [simulation], as premium-1.5 has it"
    )]
    NoSimulation,
    /// It does not reach there.
    #[error(
        "the hand begins at {at_m:?} m, which the arm does not reach: {why}; choose a place in its workspace"
    )]
    OutOfReach {
        /// Where.
        at_m: [f64; 3],
        /// Why not.
        why: String,
    },
}

impl HeldArm {
    /// An arm at rest where the hand begins; without a `model` nobody holds it.
    ///
    /// # Errors
    /// If the description has no simulation, or the arm does not reach there.
    pub fn new(
        file: &ArmFile,
        wish: Wish,
        model: Option<&HandModel>,
        seed: u64,
    ) -> Result<Self, HeldArmError> {
        let mut wish = wish;
        let mut file = file.clone();
        let simulation = file.simulation.as_mut().ok_or(HeldArmError::NoSimulation)?;
        simulation.motor.watchdog_s = f64::INFINITY;
        let (start, _) = wish.at(0.0);
        let joints = pose(&file.mechanism, start)?;
        Ok(Self {
            plant: SimulatedArm::new(&file, joints, seed).ok_or(HeldArmError::NoSimulation)?,
            kinematics: file.mechanism,
            map: file.joint_map(),
            count_bits: file.encoders.count_bits,
            hand: model.map(|model| ImpedanceHand::new(model, start, seed)),
            wish,
            orientation: UnitQuaternion::identity(),
            buttons: None,
            time_s: 0.0,
            owed_s: 0.0,
            steps: 0,
        })
    }

    /// Goes on by `dt_s` with these codes, or with the amplifiers off, while the hand wants the arm to be turned by so
    /// many counts more than its script has it.
    pub(super) fn pass(&mut self, dt_s: f64, codes: Option<[u16; 3]>, hand: [i64; 3]) -> Pose {
        match codes {
            Some(codes) => self.plant.command(codes),
            None => self.plant.switch_off(),
        }
        self.owed_s += dt_s;
        while self.owed_s >= STEP_S {
            self.owed_s -= STEP_S;
            self.step(hand);
        }
        let raw = self.plant.counters();
        Pose {
            counters: raw.map(|count| wrapped(count, self.count_bits) as u32),
            joints: self.plant.truth().joints,
        }
    }

    fn step(&mut self, turned: [i64; 3]) {
        if self.steps.is_multiple_of(STEPS_PER_THOUGHT) {
            self.think(turned);
        }
        self.steps = self.steps.wrapping_add(1);
        self.time_s += STEP_S;
        match &mut self.hand {
            Some(hand) => self.plant.advance(STEP_S, hand),
            None => self.plant.advance(STEP_S, &mut NobodyHolds),
        }
    }

    fn think(&mut self, turned: [i64; 3]) {
        let (wanted, handle) = self.wish.at(self.time_s);
        self.orientation = handle.orientation_W;
        self.buttons = self.wish.has_buttons().then_some(handle.buttons as u32);
        let wanted = self.beyond(wanted, turned);
        let Some(hand) = &mut self.hand else { return };
        let truth = self.plant.truth();
        let felt = Felt {
            force_on_user_D: -hand.force_on_tip(truth.tip, truth.tip_velocity),
            partners_centroid_D: None,
        };
        hand.intend(wanted, felt, STEP_S * f64::from(STEPS_PER_THOUGHT));
    }

    /// Where the tip is when the joints have been turned by so many counts from where it is here.
    fn beyond(&self, tip: Vector3<f64>, turned: [i64; 3]) -> Vector3<f64> {
        if turned == [0; 3] {
            return tip;
        }
        let Ok(joints) = self.kinematics.inverse(tip) else { return tip };
        let rad_per_count = self.map.rad_per_count();
        self.kinematics.forward(std::array::from_fn(|j| joints[j] + rad_per_count[j] * turned[j] as f64))
    }

    /// What the handle's own counters and buttons show.
    pub(super) fn handle(&mut self) -> Handle {
        Handle { gimbal_counters: self.plant.gimbal_counters(self.orientation), buttons: self.buttons }
    }
}

fn pose(kinematics: &Kinematics, tip: Vector3<f64>) -> Result<[f64; 3], HeldArmError> {
    let out_of_reach = |why: String| HeldArmError::OutOfReach { at_m: tip.into(), why };
    let joints = kinematics.inverse(tip).map_err(|error| out_of_reach(error.to_string()))?;
    let excess = kinematics.joint_limits().excess(joints);
    if excess > 0.0 {
        return Err(out_of_reach(format!("a joint would be {excess:.3} rad beyond its stop")));
    }
    Ok(joints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_file::{DeviceFile, builtin};
    use crate::sim::hand::model_file::{self, Firmness};
    use std::path::Path;

    fn arm(name: &str) -> ArmFile {
        match DeviceFile::parse(builtin(name).unwrap(), Path::new(name)) {
            Ok(DeviceFile::Arm(arm)) => *arm,
            other => panic!("{other:?}"),
        }
    }

    fn pen() -> HandModel {
        let mut model = model_file::parse(
            model_file::builtin("pen-grip").unwrap(),
            Path::new("pen-grip"),
            Firmness::Usual,
        )
        .unwrap();
        model.tremor.rms_m = Vector3::zeros();
        model
    }

    fn held(place: Vector3<f64>, model: Option<&HandModel>) -> HeldArm {
        HeldArm::new(&arm("premium-1.5"), Wish::Resting(place), model, 1).unwrap()
    }

    fn live(arm: &mut HeldArm, milliseconds: usize, codes: Option<[u16; 3]>) {
        for _ in 0..milliseconds {
            arm.pass(1e-3, codes, [0; 3]);
        }
    }

    fn tip(arm: &HeldArm) -> Vector3<f64> {
        arm.plant.truth().tip
    }

    #[test]
    fn however_its_time_is_divided_it_moves_the_same() {
        let place = Vector3::new(0.0, 0.08, 0.0);
        let [mut whole, mut parts] = [(); 2].map(|()| held(place, Some(&pen())));
        let codes = Some([2100, 2300, 1900]);
        for _ in 0..100 {
            whole.pass(1e-3, codes, [0; 3]);
            for _ in 0..7 {
                parts.pass(1e-3 / 7.0, codes, [0; 3]);
            }
        }
        // At most a step is still owed; the tip is no faster than 1 m/s.
        assert!((tip(&whole) - tip(&parts)).norm() < STEP_S, "{} {}", tip(&whole), tip(&parts));
        assert!((tip(&whole) - place).norm() > 2e-3, "it was pushed");
    }

    #[test]
    fn what_its_amplifiers_no_longer_give_lets_it_fall_back_into_the_hand() {
        let place = Vector3::new(0.0, 0.05, 0.0);
        let mut arm = held(place, Some(&pen()));
        live(&mut arm, 1000, Some([2048, 2400, 2048]));
        let pushed = (tip(&arm) - place).norm();
        live(&mut arm, 2000, None);
        let left = (tip(&arm) - place).norm();
        // Weight and friction of up to some 0.1 N each over 60 N/m and more.
        assert!(pushed > 8e-3 && left < 4e-3, "{pushed} {left}");
    }

    #[test]
    fn a_hand_takes_it_where_its_joints_are_so_many_counts_further() {
        let home = Vector3::zeros();
        let mut arm = held(home, Some(&pen()));
        let turned = [300, -200, 100];
        for _ in 0..3000 {
            arm.pass(1e-3, None, turned);
        }
        let wanted = arm.beyond(home, turned);
        let off = (tip(&arm) - wanted).norm();
        assert!(wanted.norm() > 8e-3 && off < 3e-3, "{wanted}, off by {off}");
    }

    #[test]
    fn without_a_hand_its_weight_moves_it() {
        // Where the forearm's motor, which balances it, has most of its lever.
        let place = arm("premium-1.5").mechanism.forward([0.0, 0.8, 1.2]);
        let mut fallen = held(place, None);
        live(&mut fallen, 300, None);
        assert!((tip(&fallen) - place).norm() > 0.01);
    }

    #[test]
    fn a_place_out_of_reach_is_refused() {
        let far = HeldArm::new(&arm("premium-1.5"), Wish::Resting(Vector3::x()), None, 1).unwrap_err();
        assert!(far.to_string().starts_with("the hand begins at [1.0, 0.0, 0.0] m, which"), "{far}");
        let unmoved = ArmFile { simulation: None, ..arm("premium-1.5") };
        let error = HeldArm::new(&unmoved, Wish::Resting(Vector3::zeros()), None, 1).unwrap_err();
        assert!(error.to_string().contains("[simulation]"), "{error}");
    }
}
