//! Kinematics of the PHANToM Premium 1.5: a [`Parallelogram`] whose angles are all zero at home.
//!
//! Frames and signs: base frame D, x right, y up, z to the user, origin at the tip's home, where
//! all angles are zero: upper arm level, forearm hanging. So the shoulder lies at `(0, l2, -l1)`.
//! Joints: turret, upper arm above the horizontal, forearm forward of hanging.

use nalgebra::{Matrix3, Vector3};

use super::{Conditioning, JointConvention, JointLimits, Mechanism, Parallelogram, Unreachable};

/// A PHANToM Premium with three actuated joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Premium {
    linkage: Parallelogram,
    limits: JointLimits,
}

impl Premium {
    /// Its joints are the linkage's own angles.
    pub const CONVENTION: JointConvention = JointConvention::LINKAGE;

    /// Upper arm `l1` and forearm `l2`, both positive, and the stops of the joints.
    pub fn new(link_lengths_m: [f64; 2], limits: JointLimits) -> Self {
        let [l1, l2] = link_lengths_m;
        Self { linkage: Parallelogram::new(link_lengths_m, [l2, -l1]), limits }
    }

    /// Upper arm `l1` and forearm `l2`.
    pub fn link_lengths_m(&self) -> [f64; 2] {
        self.linkage.link_lengths_m()
    }

    /// Largest distance of the tip from the shoulder; no joint torque vector is longer than this times the
    /// force.
    pub fn reach_m(&self) -> f64 {
        self.linkage.reach_m()
    }
}

impl Mechanism for Premium {
    fn forward(&self, joints: [f64; 3]) -> Vector3<f64> {
        self.linkage.forward(joints)
    }

    fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable> {
        self.linkage.inverse(tip)
    }

    fn jacobian(&self, joints: [f64; 3]) -> Matrix3<f64> {
        self.linkage.jacobian(joints)
    }

    fn forward_and_jacobian(&self, joints: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        self.linkage.forward_and_jacobian(joints)
    }

    fn joint_limits(&self) -> JointLimits {
        self.limits
    }

    fn singularity(&self, joints: [f64; 3]) -> Conditioning {
        self.linkage.singularity(joints)
    }
}
