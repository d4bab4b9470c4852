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
