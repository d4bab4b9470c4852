//! What theory needs to know of an arm: its numbers along one axis, in its home pose.
//!
//! Model: a force along the axis, everything else free, moves the tip as a mass `1 / (e J M^-1 J^T e)` would; rotors
//! included. Friction and damping are those of joints that have to turn for the tip to move along the axis.

use super::case::Axis;
use io_driver::device_file::ArmFile;
use io_driver::kinematics::Mechanism;
use nalgebra::{Matrix3, Vector3};

/// An arm along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plant {
    /// The tip in the home pose, in D (m).
    pub tip_m: Vector3<f64>,
    /// Apparent mass (kg).
    pub mass_kg: f64,
    /// Viscous friction (N s/m).
    pub viscous_n_s_per_m: f64,
    /// Coulomb friction (N).
    pub coulomb_n: f64,
    /// Displacement of the tip by a count (m).
    pub count_m: f64,
    /// Bandwidth of the amplifiers (Hz).
    pub amplifier_hz: f64,
}

impl Plant {
    /// Of an arm that says how it moves.
    pub fn of(arm: &ArmFile, axis: Axis) -> Option<Self> {
        let spec = arm.simulation?;
        let home = arm.encoders.home_joint_angles_rad;
        let (e, jacobian) = (axis.normal().into_inner(), arm.mechanism.jacobian(home));
        let reduction = Vector3::from(arm.motors.reduction);
        let rotors = reduction.component_mul(&reduction) * spec.motor.rotor_inertia_kg_m2;
        let inertia = spec.dynamics.mass_matrix(home) + Matrix3::from_diagonal(&rotors);
        let mobility = jacobian * inertia.try_inverse()? * jacobian.transpose();
        // Rates of the joints for a velocity of 1 m/s along the axis and none across it.
        let rates = jacobian.try_inverse()? * e;
        let torque = jacobian.tr_mul(&e);
        let per_count = std::f64::consts::TAU / f64::from(arm.encoders.counts_per_rev);
        let counts = reduction.map(|n| per_count / n);
        let sum = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
        Some(Self {
            tip_m: arm.mechanism.forward(home),
            mass_kg: 1.0 / (e.dot(&(mobility * e))),
            viscous_n_s_per_m: sum(&|j| spec.viscous_nm_s[j] * rates[j] * rates[j]),
            coulomb_n: sum(&|j| spec.coulomb_nm[j] * rates[j].abs()),
            count_m: sum(&|j| counts[j] * torque[j].abs()),
            amplifier_hz: spec.motor.amplifier_bandwidth_hz,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::SimulatedDevices;

    #[test]
    fn a_premium_at_home_has_the_numbers_of_its_description_times_the_levers() {
        let arm = SimulatedDevices::default().arm().unwrap();
        // Apparent masses with rotors, in grams, and levers, as published; friction is the data sheet's everywhere.
        for (axis, grams, lever_m, reduction) in
            [(Axis::X, 81.0, 0.215, 175.0 / 13.0), (Axis::Y, 55.0, 0.215, 11.3), (Axis::Z, 37.0, 0.170, 11.3)]
        {
            let plant = Plant::of(&arm, axis).unwrap();
            assert!((plant.mass_kg * 1e3 - grams).abs() < 0.6, "{axis:?}: {} kg", plant.mass_kg);
            assert!((plant.coulomb_n - 0.04).abs() < 1e-4, "{axis:?}: {} N", plant.coulomb_n);
            // 2.3e-4 and 1.4e-4 are rounded to two digits.
            assert!((plant.viscous_n_s_per_m - 0.005).abs() < 2e-4, "{axis:?}: {}", plant.viscous_n_s_per_m);
            let count_m = std::f64::consts::TAU / 4096.0 / reduction * lever_m;
            assert!((plant.count_m / count_m - 1.0).abs() < 1e-12, "{axis:?}: {} m", plant.count_m);
            assert_eq!((plant.tip_m, plant.amplifier_hz), (Vector3::zeros(), 1000.0));
        }
    }
}
