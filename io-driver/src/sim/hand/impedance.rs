//! What the device's tip feels of a hand: the two-spring-damper model of Fu and Cavusoglu.
//!
//! Problem: a hand is no source of position. It gives way, and its mass swings.
//! Model: along each axis, from the tip to where the user wants to be,
//!
//! ```text
//! tip --(k1, b1: grasp)-- mass M --(k2, b2: arm)-- intended point
//! M x'' = k1 (x_tip - x) + b1 (x_tip' - x') + k2 (x_int - x) + b2 (x_int' - x')
//! ```
//!
//! All springs are relaxed when the three are at one point. Over a step, tip and intended point move evenly; for
//! that the motion of the mass is exact, so no step is too long for it and none makes its energy grow.
//! Frames: everything in one frame whose axes are those of the parameters; forces are on the tip.
//! Invariant: at rest at one point, force and motion are exactly zero.
//! Cost: some 20 ns a step, and three matrix exponentials when the step's length changes; no allocation.
//! Reference: Fu, Cavusoglu, "Human-arm-and-hand-dynamic model with variability analyses for a stylus-based haptic
//! interface", IEEE Trans. SMC B 42(6), 2012; valid below 20 Hz.

use nalgebra::Vector3;

use super::transition::Transition;

/// A spring with a damper beside it, per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringDamper {
    /// Stiffness (N/m).
    pub stiffness_n_per_m: Vector3<f64>,
    /// Damping (N s/m).
    pub damping_n_s_per_m: Vector3<f64>,
}

/// The numbers of a hand, per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpedanceSpec {
    /// What swings (kg).
    pub mass_kg: Vector3<f64>,
    /// Between tip and mass.
    pub grasp: SpringDamper,
    /// Between mass and intended point.
    pub arm: SpringDamper,
}

/// A point and how it moves (m, m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moving {
    pub(super) at: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
}

/// The hand's mass on its two springs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Impedance {
    spec: ImpedanceSpec,
    mass: Moving,
    transitions: [Transition; 3],
    /// What the transitions are for (s).
    step_s: f64,
}

impl ImpedanceSpec {
    /// Stiffness at the tip when everything rests (N/m): both springs in series.
    pub fn static_stiffness(&self) -> Vector3<f64> {
        let (grasp, arm) = (self.grasp.stiffness_n_per_m, self.arm.stiffness_n_per_m);
        grasp.component_mul(&arm).component_div(&(grasp + arm))
    }

    fn transitions(&self, dt_s: f64) -> [Transition; 3] {
        let stiffness = self.grasp.stiffness_n_per_m + self.arm.stiffness_n_per_m;
        let damping = self.grasp.damping_n_s_per_m + self.arm.damping_n_s_per_m;
        std::array::from_fn(|i| {
            Transition::new(stiffness[i] / self.mass_kg[i], damping[i] / self.mass_kg[i], dt_s)
        })
    }
}

impl Moving {
    pub(super) fn resting(at: Vector3<f64>) -> Self {
        Self { at, velocity: Vector3::zeros() }
    }

    pub(super) fn after(&self, dt_s: f64) -> Self {
        Self { at: self.at + self.velocity * dt_s, velocity: self.velocity }
    }
}

impl Impedance {
    /// At rest at `start`.
    pub(super) fn new(spec: ImpedanceSpec, start: Vector3<f64>) -> Self {
        Self {
            spec,
            mass: Moving::resting(start),
            transitions: spec.transitions(USUAL_STEP_S),
            step_s: USUAL_STEP_S,
        }
    }

    pub(super) fn spec(&self) -> &ImpedanceSpec {
        &self.spec
    }

    /// Force of the grasp on the tip (N).
    pub(super) fn force_on_tip(&self, tip: Moving) -> Vector3<f64> {
        let grasp = &self.spec.grasp;
        grasp.stiffness_n_per_m.component_mul(&(self.mass.at - tip.at))
            + grasp.damping_n_s_per_m.component_mul(&(self.mass.velocity - tip.velocity))
    }

    /// The mass moves on by `dt_s` > 0, in which tip and intended point move evenly from where they are.
    pub(super) fn advance(&mut self, tip: Moving, intended: Moving, dt_s: f64) {
        if dt_s != self.step_s {
            (self.transitions, self.step_s) = (self.spec.transitions(dt_s), dt_s);
        }
        let (grasp, arm) = (&self.spec.grasp, &self.spec.arm);
        for i in 0..3 {
            let (k1, k2) = (grasp.stiffness_n_per_m[i], arm.stiffness_n_per_m[i]);
            let (b1, b2) = (grasp.damping_n_s_per_m[i], arm.damping_n_s_per_m[i]);
            let pull = b1 * tip.velocity[i] + b2 * intended.velocity[i];
            // The even motion that the mass would settle into; measured from the intended point, so that rest is exact.
            let drift = (k1 * tip.velocity[i] + k2 * intended.velocity[i]) / (k1 + k2);
            let lean = (k1 * (tip.at[i] - intended.at[i]) + pull - (b1 + b2) * drift) / (k1 + k2);
            let settled = intended.at[i] + lean;
            let (offset, speed) =
                self.transitions[i].apply(self.mass.at[i] - settled, self.mass.velocity[i] - drift);
            self.mass.at[i] = settled + drift * dt_s + offset;
            self.mass.velocity[i] = drift + without_dregs(speed);
        }
    }
}

/// A decaying number never reaches zero; below the smallest normal ones every product would cost a hundred times more.
pub(super) fn without_dregs(number: f64) -> f64 {
    if number.abs() < 1e-100 { 0.0 } else { number }
}

/// A guess that saves the first step's exponentials.
const USUAL_STEP_S: f64 = 62.5e-6;
