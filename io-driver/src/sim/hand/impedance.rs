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
    /// Of both springs beside each other (m/N): six quotients a step would cost as much as all the rest.
    compliance: Vector3<f64>,
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
        let stiffness = spec.grasp.stiffness_n_per_m + spec.arm.stiffness_n_per_m;
        Self {
            spec,
            compliance: stiffness.map(f64::recip),
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
            let drift = (k1 * tip.velocity[i] + k2 * intended.velocity[i]) * self.compliance[i];
            let lean = (k1 * (tip.at[i] - intended.at[i]) + pull - (b1 + b2) * drift) * self.compliance[i];
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;
    use proptest::prelude::*;

    /// Pen grip, Fu and Cavusoglu.
    const PEN: ImpedanceSpec = ImpedanceSpec {
        mass_kg: Vector3::new(0.218, 0.269, 0.204),
        grasp: SpringDamper {
            stiffness_n_per_m: Vector3::new(379.5, 552.4, 769.9),
            damping_n_s_per_m: Vector3::new(1.839, 3.609, 0.776),
        },
        arm: SpringDamper {
            stiffness_n_per_m: Vector3::new(78.75, 105.3, 271.7),
            damping_n_s_per_m: Vector3::new(4.645, 6.430, 18.06),
        },
    };
    const SUB_STEPS_S: [f64; 3] = [31.25e-6, 62.5e-6, 125e-6];

    #[test]
    fn a_hand_that_rests_where_the_tip_rests_feels_like_nothing_at_all() {
        let start = Vector3::new(0.1, -0.037, 0.0123);
        let mut hand = Impedance::new(PEN, start);
        for _ in 0..10_000 {
            let resting = Moving::resting(start);
            hand.advance(resting, resting, 62.5e-6);
            assert_eq!(hand.force_on_tip(resting), Vector3::zeros());
        }
    }

    #[test]
    fn pushed_and_waited_for_it_has_the_stiffness_of_both_springs_in_series() {
        let mut hand = Impedance::new(PEN, Vector3::zeros());
        let push = Vector3::new(0.004, -0.003, 0.002);
        for _ in 0..100_000 {
            hand.advance(Moving::resting(push), Moving::resting(Vector3::zeros()), 125e-6);
        }
        let force = hand.force_on_tip(Moving::resting(push));
        for i in 0..3 {
            let (k1, k2) = (PEN.grasp.stiffness_n_per_m[i], PEN.arm.stiffness_n_per_m[i]);
            let expected = -k1 * k2 / (k1 + k2) * push[i];
            // After 12 s all motion is gone (slowest decay 15 / s); forces of size one, some roundings.
            assert!((force[i] - expected).abs() < 1e-13, "{i}: {} {expected}", force[i]);
            assert!((PEN.static_stiffness()[i] * push[i] + expected).abs() < 1e-15);
        }
    }

    /// The tip shaken by the exact sinusoid, the force on it taken apart at that frequency.
    fn measured_stiffness(hertz: f64, dt_s: f64) -> [Complex<f64>; 3] {
        let (amplitude, w) = (1e-3, std::f64::consts::TAU * hertz);
        let tip = |t: f64| Moving {
            at: Vector3::repeat(amplitude * (w * t).cos()),
            velocity: Vector3::repeat(-amplitude * w * (w * t).sin()),
        };
        let mut hand = Impedance::new(PEN, Vector3::repeat(amplitude));
        let (settled, measured) = (1.5, (2.0 * hertz).ceil() / hertz);
        let steps = ((settled + measured) / dt_s).round() as usize;
        let from = steps - (measured / dt_s).round() as usize;
        let mut sums = [Complex::new(0.0, 0.0); 3];
        for step in 0..steps {
            let t = step as f64 * dt_s;
            if step >= from {
                let force = hand.force_on_tip(tip(t));
                let turned = Complex::from_polar(1.0, -w * t);
                (0..3).for_each(|i| sums[i] += turned * force[i]);
            }
            hand.advance(tip(t), Moving::resting(Vector3::zeros()), dt_s);
        }
        sums.map(|sum| -sum * (2.0 / ((steps - from) as f64 * amplitude)))
    }

    #[test]
    fn its_frequency_response_is_the_closed_form_below_20_hz() {
        for hertz in [0.5, 2.0, 5.0, 10.0, 18.0] {
            let measured = measured_stiffness(hertz, 62.5e-6);
            let s = Complex::new(0.0, std::f64::consts::TAU * hertz);
            for (i, measured) in measured.into_iter().enumerate() {
                let grasp = PEN.grasp.damping_n_s_per_m[i] * s + PEN.grasp.stiffness_n_per_m[i];
                let arm =
                    s * s * PEN.mass_kg[i] + s * PEN.arm.damping_n_s_per_m[i] + PEN.arm.stiffness_n_per_m[i];
                let closed = grasp * arm / (grasp + arm);
                // Left of the start after 1.5 s: e^-22. The tip's path is told as one straight line per step, off by
                // (w dt)^2 / 8 = 6e-6 of it; the rest is leakage of a window that is no whole number of steps.
                let error = (measured - closed).norm() / closed.norm();
                assert!(error < 1e-3, "{hertz} Hz, axis {i}: {measured} {closed} {error}");
            }
        }
    }

    impl Impedance {
        fn energy(&self, tip: Vector3<f64>, intended: Vector3<f64>) -> f64 {
            let of = |weights: Vector3<f64>, way: Vector3<f64>| 0.5 * weights.dot(&way.component_mul(&way));
            of(self.spec.mass_kg, self.mass.velocity)
                + of(self.spec.grasp.stiffness_n_per_m, self.mass.at - tip)
                + of(self.spec.arm.stiffness_n_per_m, self.mass.at - intended)
        }
    }

    fn any_spec() -> impl Strategy<Value = ImpedanceSpec> {
        // Everything that a model file may hold, its factors included; evenly over the orders of magnitude.
        let decades = |from: f64, to: f64| {
            prop::array::uniform3((from.ln()..to.ln()).prop_map(f64::exp)).prop_map(Vector3::from)
        };
        let pair = move || {
            (decades(0.05, 4e4), decades(1e-6, 400.0)).prop_map(|(stiffness_n_per_m, damping_n_s_per_m)| {
                SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
            })
        };
        (decades(1e-3, 10.0), pair(), pair()).prop_map(|(mass_kg, grasp, arm)| ImpedanceSpec {
            mass_kg,
            grasp,
            arm,
        })
    }

    fn any_vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-size..size).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn with_tip_and_intention_at_rest_its_energy_never_grows(
            spec in any_spec(), tip in any_vector(0.1), offset in any_vector(0.1), velocity in any_vector(1.0),
            dt_s in prop::sample::select(&SUB_STEPS_S[..]),
        ) {
            let mut hand = Impedance::new(spec, offset);
            hand.mass.velocity = velocity;
            let still = Moving::resting(Vector3::zeros());
            let mut before = hand.energy(tip, still.at);
            let first = before;
            for _ in 0..2000 {
                hand.advance(Moving::resting(tip), still, dt_s);
                let after = hand.energy(tip, still.at);
                // The motion is exact but for rounding: matrices squared up to ten times, 2^10 units in the last place.
                prop_assert!(after <= before + 1e-12 * first, "{before} {after}");
                before = after;
            }
        }

        /// A tip of an arm's mass that hangs on the hand and is integrated as a plant would, implicitly in the grasp.
        #[test]
        fn a_free_tip_on_any_hand_never_gains_energy_beyond_the_integrators_bound(
            spec in any_spec(), mass_kg in 0.03..0.2_f64, velocity in any_vector(1.0),
            dt_s in prop::sample::select(&SUB_STEPS_S[..]),
        ) {
            let mut hand = Impedance::new(spec, Vector3::zeros());
            let mut tip = Moving { at: Vector3::zeros(), velocity };
            let still = Moving::resting(Vector3::zeros());
            let kinetic = |tip: &Moving| 0.5 * mass_kg * tip.velocity.norm_squared();
            let first = kinetic(&tip);
            for _ in 0..4000 {
                let force = hand.force_on_tip(tip);
                let before = tip;
                for i in 0..3 {
                    let (k, b) = (spec.grasp.stiffness_n_per_m[i], spec.grasp.damping_n_s_per_m[i]);
                    let give = dt_s * (b + dt_s * k);
                    // (m + h b + h^2 k) v' = m v + h (F + b v), where F holds -b v already.
                    let momentum = mass_kg * before.velocity[i] + dt_s * (force[i] + b * before.velocity[i]);
                    tip.velocity[i] = momentum / (mass_kg + give);
                }
                hand.advance(Moving { at: before.at, velocity: tip.velocity }, still, dt_s);
                tip.at += tip.velocity * dt_s;
                let energy = kinetic(&tip) + hand.energy(tip.at, still.at);
                prop_assert!(energy <= first * 1.01, "{first} {energy}");
            }
        }
    }
}
