//! The device that has no mechanism: its joints are the coordinates of its tip.
//!
//! Problem: exact scripted runs need a device that adds nothing of its own.
//! Model: position and force go straight through.
//! Frames: base frame D; the "joints" are metres, the "torques" newtons.
//! Invariant: forward and inverse return the very bits they were given.

use nalgebra::{Matrix3, Vector3};

use super::{Conditioning, JointLimits, Mechanism, Unreachable};

/// Position goes straight through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ideal;

impl Mechanism for Ideal {
    fn forward(&self, joints: [f64; 3]) -> Vector3<f64> {
        joints.into()
    }

    fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable> {
        if tip.iter().all(|c| c.is_finite()) { Ok(tip.into()) } else { Err(Unreachable::NotFinite) }
    }

    fn jacobian(&self, _joints: [f64; 3]) -> Matrix3<f64> {
        Matrix3::identity()
    }

    // Written out: multiplying by the identity would turn a single NaN into three.
    fn joint_torque(&self, _joints: [f64; 3], force_on_user: Vector3<f64>) -> [f64; 3] {
        force_on_user.into()
    }

    fn joint_limits(&self) -> JointLimits {
        JointLimits::UNBOUNDED
    }

    fn singularity(&self, _joints: [f64; 3]) -> Conditioning {
        Conditioning { smallest: 1.0, largest: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn position_and_force_pass_bit_for_bit() {
        let joints = [0.1, -0.0, 1e-310];
        let tip = Ideal.forward(joints);
        assert_eq!(Ideal.inverse(tip).unwrap().map(f64::to_bits), joints.map(f64::to_bits));
        assert_eq!(Ideal.joint_torque(joints, tip).map(f64::to_bits), joints.map(f64::to_bits));
    }

    #[test]
    fn a_position_that_is_not_finite_is_refused() {
        assert_eq!(Ideal.inverse(Vector3::new(0.0, f64::NAN, 0.0)), Err(Unreachable::NotFinite));
    }
}
