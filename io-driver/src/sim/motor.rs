//! A motor and its amplifier: from a converter's code to the torque on a joint.
//!
//! Model: the amplifier regulates the current, as a first-order lag at its bandwidth, with whatever voltage that
//! takes, up to its supply:
//!
//! ```text
//! u = R i + K w + L di/dt,   |u| <= u_supply
//! ```
//!
//! `w` is the speed of the motor's shaft, `K` the torque constant, which is also that of the back-EMF; the
//! winding's resistance rises with its warmth ([`Heat`]). So a motor that turns fast, or is warm, gives less than
//! was asked for, and nobody tells the driver. An amplifier that gets no value for longer than its watchdog allows
//! switches itself off, and stays off until it is armed anew.
//! Signs: the motor's own sense of turning; [`crate::motors::MotorMap`] knows that of the joints.
//! Invariants: whatever the code, current and voltage stay within what the supply can do; stable for every step.
//! Cost: a handful of operations; one exponential when the step's length changes.

use super::spec::MotorPlantSpec;
use crate::heat::{Heat, HeatSpec};
use std::f64::consts::TAU;

/// A motor with its amplifier.
#[derive(Debug, Clone)]
pub struct MotorPlant {
    spec: MotorPlantSpec,
    torque_constant_nm_per_a: f64,
    heat: Heat,
    /// What the amplifier was told last (A).
    wanted_a: f64,
    /// What flows (A).
    current_a: f64,
    is_on: bool,
    /// Part of the current's error that is left after a step, and the step (s) that this is for.
    decay: (f64, f64),
}

impl MotorPlant {
    /// A cold motor, switched off.
    pub fn new(spec: MotorPlantSpec, torque_constant_nm_per_a: f64, heat: HeatSpec) -> Self {
        Self {
            spec,
            torque_constant_nm_per_a,
            heat: Heat::cold(heat),
            wanted_a: 0.0,
            current_a: 0.0,
            is_on: false,
            decay: (1.0, 0.0),
        }
    }

    /// The amplifier is on and regulates to this current (A).
    pub fn command(&mut self, current_a: f64) {
        self.wanted_a = current_a;
        self.is_on = true;
    }

    /// The amplifier is off: what still flows dies away through the winding.
    pub fn switch_off(&mut self) {
        self.wanted_a = 0.0;
        self.is_on = false;
    }

    /// The current (A).
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Torque at the shaft (N m).
    pub fn torque_nm(&self) -> f64 {
        self.torque_constant_nm_per_a * self.current_a
    }

    /// Warmth of the winding: 1 is the rated.
    pub fn rise(&self) -> f64 {
        self.heat.rise()
    }

    /// Goes on by `dt_s`, while the shaft turns at `speed_rad_per_s`.
    pub fn advance(&mut self, speed_rad_per_s: f64, dt_s: f64) {
        if dt_s != self.decay.1 {
            self.decay = ((-TAU * self.spec.amplifier_bandwidth_hz * dt_s).exp(), dt_s);
        }
        let regulated = self.wanted_a + (self.current_a - self.wanted_a) * self.decay.0;
        let back_emf_v = self.torque_constant_nm_per_a * speed_rad_per_s;
        self.current_a = self.within_supply(regulated, back_emf_v, dt_s);
    }

    /// The winding warms by what flowed for `dt_s`. Seconds matter, so once a tick is enough.
    pub fn warm(&mut self, dt_s: f64) {
        self.heat.flow(self.current_a, dt_s);
    }

    /// The current that the supply can reach on the way to the regulated one, by an implicit step.
    fn within_supply(&self, regulated_a: f64, back_emf_v: f64, dt_s: f64) -> f64 {
        let resistance_ohm = self.resistance_ohm();
        let per_step = self.spec.inductance_h / dt_s;
        let needed_v = resistance_ohm * regulated_a + back_emf_v + per_step * (regulated_a - self.current_a);
        // Off, the winding is short-circuited by the bridge's diodes only while current still flows; then it is open.
        let supply_v = if self.is_on { self.spec.supply_v } else { 0.0 };
        if needed_v.abs() <= supply_v {
            return regulated_a;
        }
        if !self.is_on {
            return self.current_a * per_step / (resistance_ohm + per_step);
        }
        let given_v = supply_v.copysign(needed_v);
        (given_v - back_emf_v + per_step * self.current_a) / (resistance_ohm + per_step)
    }

    /// Copper's resistance rises with its temperature.
    fn resistance_ohm(&self) -> f64 {
        self.spec.resistance_ohm * (1.0 + self.spec.resistance_per_k * self.spec.rated_rise_k * self.rise())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RE25: MotorPlantSpec = MotorPlantSpec {
        rotor_inertia_kg_m2: 10.3e-7,
        resistance_ohm: 2.18,
        inductance_h: 0.238e-3,
        supply_v: 24.0,
        amplifier_bandwidth_hz: 1000.0,
        resistance_per_k: 0.0039,
        rated_rise_k: 75.0,
        watchdog_s: 0.1,
    };
    const KT: f64 = 0.0234;

    fn motor(spec: MotorPlantSpec) -> MotorPlant {
        let heat = HeatSpec {
            continuous_current_a: 1.24,
            winding_time_constant_s: 12.0,
            housing_time_constant_s: 612.0,
            winding_share: 0.181,
        };
        MotorPlant::new(spec, KT, heat)
    }

    #[test]
    fn within_the_supply_the_current_follows_as_a_first_order_lag() {
        for dt_s in [10e-6, 31.25e-6, 50e-6] {
            let mut motor = motor(RE25);
            motor.command(1.0);
            for step in 1..=20 {
                motor.advance(0.0, dt_s);
                let closed = 1.0 - (-TAU * 1000.0 * dt_s * f64::from(step)).exp();
                // The lag is solved exactly; twenty products of an ulp or two.
                assert!((motor.current_a() - closed).abs() < 1e-14, "{dt_s} {step}");
            }
        }
    }

    #[test]
    fn a_motor_that_turns_gets_only_what_the_supply_has_left() {
        let mut motor = motor(RE25);
        motor.command(5.5);
        // 600 rad/s: 14 V of back-EMF leave 10 V for 2.18 ohm.
        for _ in 0..1000 {
            motor.advance(600.0, 31.25e-6);
        }
        let expected = (24.0 - KT * 600.0) / 2.18;
        assert!((motor.current_a() - expected).abs() < 1e-12, "{} {expected}", motor.current_a());
        // Turned the other way the supply is helped, and the wanted current is reached.
        for _ in 0..1000 {
            motor.advance(-600.0, 31.25e-6);
        }
        assert!((motor.current_a() - 5.5).abs() < 1e-12);
    }

    #[test]
    fn a_large_step_is_bounded_by_the_inductance() {
        let mut motor = motor(MotorPlantSpec { amplifier_bandwidth_hz: 1e5, ..RE25 });
        motor.command(5.5);
        let dt_s = 10e-6;
        motor.advance(0.0, dt_s);
        // The supply's voltage over the inductance, less what the resistance takes within the step.
        let expected = 24.0 / (RE25.inductance_h / dt_s + 2.18);
        assert!((motor.current_a() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_warm_winding_gives_less_at_the_same_voltage() {
        let spec = MotorPlantSpec { supply_v: 12.0, ..RE25 };
        let stall = |motor: &mut MotorPlant| {
            motor.command(100.0);
            (0..1000).for_each(|_| motor.advance(0.0, 31.25e-6));
            motor.current_a()
        };
        let mut motor = motor(spec);
        let cold = stall(&mut motor);
        assert!((cold - 12.0 / 2.18).abs() < 1e-9);
        motor.command(1.24);
        (0..1000).for_each(|_| motor.advance(0.0, 31.25e-6));
        (0..100_000).for_each(|_| motor.warm(1.0));
        let warm = stall(&mut motor);
        // At the rated rise of 75 K copper has 29 % more.
        assert!((warm - 12.0 / (2.18 * (1.0 + 0.0039 * 75.0))).abs() < 1e-9, "{warm}");
    }

    #[test]
    fn switched_off_the_current_dies_away_and_nothing_drives_it() {
        let mut motor = motor(RE25);
        motor.command(2.0);
        (0..100).for_each(|_| motor.advance(0.0, 31.25e-6));
        motor.switch_off();
        let before = motor.current_a();
        (0..32).for_each(|_| motor.advance(500.0, 31.25e-6));
        assert!(before > 1.9 && motor.current_a().abs() < 1e-3, "{before} {}", motor.current_a());
    }
}
