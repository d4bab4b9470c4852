//! A simulated hand on a device's tip.
//!
//! Problem: what a device and an algorithm do depends on who holds it. A hand that is nothing but a position hides
//! every instability and every effort.
//! Model: a script says where the finger wants to be. A person gets there with limited bandwidth (`intention`) and
//! an arm and a grasp that give way (`impedance`); the fingertip trembles (`tremor`); whoever minds presses harder
//! when what is held slips (`grip`). The numbers are files ([`model_file`]).
//! Frames: everything in the device's base frame D; how a turned base enters is told at [`HandModel::in_base`].
//! Forces are on the device's tip.
//! Invariants: starts at rest without force if the tip starts where the hand does; the same seed and the same
//! questions give the same bytes on every platform.
//! Cost: below 0.2 us a sub-step (`cargo bench -p io-driver --bench hand`); no allocation.
#![allow(non_snake_case)] // a frame's letter ends the name of a quantity in it

mod grip;
mod impedance;
mod intention;
mod model;
pub mod model_file;
mod transition;
mod tremor;

use nalgebra::Vector3;

use super::arm::TipLoad;
use grip::Grip;
pub use grip::{Felt, GripSpec};
use impedance::{Impedance, Moving};
pub use impedance::{ImpedanceSpec, SpringDamper};
use intention::Intention;
pub use intention::IntentionSpec;
pub use model::HandModel;
use tremor::Tremor;
pub use tremor::TremorSpec;

/// One finger's hand, stepped with the device's plant.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpedanceHand {
    impedance: Impedance,
    intention: Intention,
    tremor: Option<Tremor>,
    grip: Option<Grip>,
    tip_D: Vector3<f64>,
    /// The intended point, on its even way through the tick.
    intended: Moving,
    /// The fingertip against the hand's mass, likewise, and where that is at the tick's end.
    trembling: Moving,
    trembled: Vector3<f64>,
}

impl ImpedanceHand {
    /// At rest at `start_D` (m). Fingers of one hand get different seeds.
    pub fn new(model: &HandModel, start_D: Vector3<f64>, seed: u64) -> Self {
        let stiffness = model.impedance.static_stiffness();
        let trembles = model.tremor.rms_m != Vector3::zeros();
        Self {
            impedance: Impedance::new(model.impedance, start_D),
            intention: Intention::new(model.intention, start_D),
            tremor: trembles.then(|| Tremor::new(&model.tremor, seed)),
            grip: model.minds_slip.then(|| Grip::new(model.grip, stiffness, model.intention)),
            tip_D: start_D,
            intended: Moving::resting(start_D),
            trembling: Moving::resting(Vector3::zeros()),
            trembled: Vector3::zeros(),
        }
    }

    /// A tick of `dt_s` > 0 begins: where the finger wants to be (m), and what it felt in the tick before.
    pub fn intend(&mut self, wanted_D: Vector3<f64>, felt: Felt, dt_s: f64) {
        let shift_D = self.grip.as_mut().map(|grip| grip.step(self.tip_D, felt, dt_s));
        self.intended = self.intention.step(wanted_D + shift_D.unwrap_or_default(), dt_s);
        if let Some(tremor) = &mut self.tremor {
            let before = std::mem::replace(&mut self.trembled, tremor.step(dt_s));
            self.trembling = Moving { at: before, velocity: (self.trembled - before) / dt_s };
        }
    }

    /// Force of the hand on the tip (N), which is at `tip_D` (m) and moves with `tip_velocity_D` (m/s).
    pub fn force_on_tip(&self, tip_D: Vector3<f64>, tip_velocity_D: Vector3<f64>) -> Vector3<f64> {
        self.impedance.force_on_tip(self.against_fingertip(tip_D, tip_velocity_D))
    }

    /// The hand's mass moves on by a sub-step of `dt_s` > 0, in which the tip moves evenly from `tip_D` (m) with
    /// `tip_velocity_D` (m/s).
    pub fn advance(&mut self, tip_D: Vector3<f64>, tip_velocity_D: Vector3<f64>, dt_s: f64) {
        self.impedance.advance(self.against_fingertip(tip_D, tip_velocity_D), self.intended, dt_s);
        self.intended = self.intended.after(dt_s);
        self.trembling = self.trembling.after(dt_s);
        self.tip_D = tip_D;
    }

    /// Stiffness (N/m) and damping (N s/m) of the grasp at the tip, per axis: what an implicit integrator asks for.
    pub fn grasp(&self) -> (Vector3<f64>, Vector3<f64>) {
        let grasp = &self.impedance.spec().grasp;
        (grasp.stiffness_n_per_m, grasp.damping_n_s_per_m)
    }

    /// The tip as the grasp sees it: the fingertip's own trembling taken away.
    fn against_fingertip(&self, tip_D: Vector3<f64>, tip_velocity_D: Vector3<f64>) -> Moving {
        Moving { at: tip_D - self.trembling.at, velocity: tip_velocity_D - self.trembling.velocity }
    }
}

impl TipLoad for ImpedanceHand {
    fn force_on_tip(&self, tip_D: Vector3<f64>, velocity_D: Vector3<f64>) -> Vector3<f64> {
        self.force_on_tip(tip_D, velocity_D)
    }

    fn advance(&mut self, tip_D: Vector3<f64>, velocity_D: Vector3<f64>, dt_s: f64) {
        self.advance(tip_D, velocity_D, dt_s);
    }
}

#[cfg(test)]
mod tests {
    use super::model_file::{Firmness, builtin, parse};
    use super::*;
    use std::path::Path;

    const TICK_S: f64 = 1e-3;
    const SUB_STEP_S: f64 = TICK_S / 16.0;

    fn pen() -> HandModel {
        parse(builtin("pen-grip").unwrap(), Path::new("pen-grip"), Firmness::Usual).unwrap()
    }

    /// A tip of 20 g that nothing holds but the hand, semi-implicitly; where it is after each tick.
    fn free_tip(model: &HandModel, seed: u64, ticks: usize) -> Vec<Vector3<f64>> {
        let mut hand = ImpedanceHand::new(model, Vector3::zeros(), seed);
        let (mut at, mut velocity) = (Vector3::zeros(), Vector3::zeros());
        let tick = |_| {
            hand.intend(Vector3::zeros(), Felt::default(), TICK_S);
            for _ in 0..16 {
                velocity += hand.force_on_tip(at, velocity) * (SUB_STEP_S / 0.02);
                hand.advance(at, velocity, SUB_STEP_S);
                at += velocity * SUB_STEP_S;
            }
            at
        };
        (0..ticks).map(tick).collect()
    }

    #[test]
    fn a_calm_hand_that_has_what_it_wants_does_exactly_nothing() {
        let mut calm = pen();
        calm.tremor.rms_m = Vector3::zeros();
        assert!(free_tip(&calm, 1, 2000).iter().all(|at| *at == Vector3::zeros()));
    }

    #[test]
    fn a_free_fingertip_trembles_as_the_model_says() {
        let samples = free_tip(&pen(), 1, 20_000);
        let last = &samples[2000..];
        for axis in 0..3 {
            let square = last.iter().map(|at| at[axis] * at[axis]).sum::<f64>() / last.len() as f64;
            // 20 g on the grasp's spring swing at 22 to 31 Hz, which lifts 12 Hz by up to 1 / (1 - (12/22)^2) = 1.4 and
            // 8 Hz by 1.15; the hand's own mass takes a tenth; beats of 18 s some percent.
            let gain = square.sqrt() / pen().tremor.rms_m[axis];
            assert!((0.95..1.45).contains(&gain), "axis {axis}: {gain}");
        }
        // It begins at rest: within the first tick nothing of size.
        assert!(samples[0].norm() < 1e-7);
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_another_tremor() {
        let bits = |seed| -> Vec<u64> {
            free_tip(&pen(), seed, 500).iter().flatten().map(|number| number.to_bits()).collect()
        };
        assert!(bits(7) == bits(7));
        assert!(bits(7) != bits(8));
    }

    #[test]
    fn however_a_tick_is_divided_the_hand_arrives_at_the_same_place() {
        let after = |sub_steps: u32| {
            let mut hand = ImpedanceHand::new(&pen(), Vector3::zeros(), 3);
            let tip = Vector3::new(1e-3, 0.0, -2e-3);
            for _ in 0..500 {
                hand.intend(Vector3::new(0.01, 0.02, 0.0), Felt::default(), TICK_S);
                let dt_s = TICK_S / f64::from(sub_steps);
                (0..sub_steps).for_each(|_| hand.advance(tip, Vector3::zeros(), dt_s));
            }
            hand.force_on_tip(tip, Vector3::zeros())
        };
        // The motion is exact for points that move evenly, so only rounding is left: 16,000 steps, forces of size one.
        assert!((after(8) - after(32)).norm() < 1e-11, "{}", (after(8) - after(32)).norm());
    }
}
