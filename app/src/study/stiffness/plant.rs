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
