//! Coulomb friction of three joints that hold each other.
//!
//! Model: within a step of length `h` the friction gives each joint the impulse that stops it, or, if that is more
//! than `torque * h`, all it has against the motion. The joints are coupled by the mass matrix, so the impulses
//! are sought together, by projected Gauss-Seidel, beginning with the last step's.
//! Invariants: no joint gets more than its friction has; a joint whose needed impulse is within is stopped dead, so
//! that an arm which sticks does not creep; friction never speeds the arm up.
//! Cost: at most eight rounds of two joints, fewer where nothing changes any more. The coupling of the last two joints is at most a third of the mean
//! of their inertias, so each round leaves a ninth of the error: eight rounds leave 2e-8.
//! Reference: Moreau's impulses, as in Anitescu and Potra, Nonlinear Dynamics 14, 1997.

use nalgebra::{Matrix3, Vector3};

/// Rounds of Gauss-Seidel.
const ITERATIONS: u32 = 8;

/// The friction of an arm's joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFriction {
    torque_nm: [f64; 3],
    impulse: Vector3<f64>,
}

impl JointFriction {
    /// Joints with these friction torques (N m).
    pub fn new(torque_nm: [f64; 3]) -> Self {
        Self { torque_nm, impulse: Vector3::zeros() }
    }

    /// What the friction adds to the rates (rad/s) that a step of `dt_s` would end with without it.
    pub fn hold(&mut self, inertia: &Matrix3<f64>, rates: Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        // Mobility by blocks: the turret by itself, the other two joints together.
        let (m11, m22, m23, m33) = (inertia[(0, 0)], inertia[(1, 1)], inertia[(1, 2)], inertia[(2, 2)]);
        let by_determinant = 1.0 / (m22 * m33 - m23 * m23);
        let (w22, w23, w33) = (m33 * by_determinant, -m23 * by_determinant, m22 * by_determinant);
        let (by_w22, by_w33) = (1.0 / w22, 1.0 / w33);
        let most = self.torque_nm.map(|torque| torque * dt_s);
        let mut p = self.impulse;
        p.x = (-rates.x * m11).clamp(-most[0], most[0]);
        for _ in 0..ITERATIONS {
            let before = (p.y, p.z);
            p.y = (-(rates.y + w23 * p.z) * by_w22).clamp(-most[1], most[1]);
            p.z = (-(rates.z + w23 * p.y) * by_w33).clamp(-most[2], most[2]);
            if (p.y, p.z) == before {
                break;
            }
        }
        self.impulse = p;
        Vector3::new(p.x / m11, w22 * p.y + w23 * p.z, w23 * p.y + w33 * p.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const H: f64 = 62.5e-6;

    fn inertia(coupling: f64) -> Matrix3<f64> {
        Matrix3::new(3.7e-3, 0.0, 0.0, 0.0, 2.5e-3, coupling, 0.0, coupling, 1.1e-3)
    }

    #[test]
    fn a_slow_arm_is_stopped_dead_and_a_fast_one_loses_just_its_friction() {
        let mut friction = JointFriction::new([0.01; 3]);
        let slow = Vector3::new(1e-5, -5e-6, 2e-6);
        let after = slow + friction.hold(&inertia(3e-4), slow, H);
        // Eight rounds leave 2e-8 of the error.
        assert!(after.norm() < 1e-7 * slow.norm(), "{after}");
        let fast = Vector3::new(1.0, 2.0, 3.0);
        let change = inertia(3e-4) * friction.hold(&inertia(3e-4), fast, H);
        assert!((change + Vector3::repeat(0.01 * H)).norm() < 1e-20, "{change}");
    }

    proptest! {
        /// Oracle: the conditions themselves, for each joint.
        #[test]
        fn each_joint_rests_or_has_all_its_friction_against_it(
            rates in prop::array::uniform3(-1e-3..1e-3f64), coupling in -4e-4..4e-4f64,
            torque in prop::array::uniform3(0.0..0.05f64),
        ) {
            let (mass, rates) = (inertia(coupling), Vector3::from(rates));
            let mut friction = JointFriction::new(torque);
            let change = friction.hold(&mass, rates, H);
            let (after, impulse) = (rates + change, mass * change);
            for joint in 0..3 {
                let most = torque[joint] * H;
                prop_assert!(impulse[joint].abs() <= most * (1.0 + 1e-12) + 1e-22);
                let rests = after[joint].abs() < 1e-9;
                let opposes = (impulse[joint] + most * after[joint].signum()).abs() <= 1e-9 * most + 1e-22;
                prop_assert!(rests || opposes, "joint {}: {} {}", joint, after[joint], impulse[joint]);
            }
            let energy = |v: Vector3<f64>| 0.5 * v.dot(&(mass * v));
            prop_assert!(energy(after) <= energy(rates) * (1.0 + 1e-12));
        }
    }
}
