//! Kinematics of WoodenHaptics, an open-hardware arm of plywood: a [`Parallelogram`] with angles and an
//! origin of its own.
//!
//! Problem: its makers write, with z up, x to the user and y to the right,
//!
//! ```text
//! x = cos A (Lb sin B + Lc sin C) - xo
//! y = sin A (Lb sin B + Lc sin C)
//! z = Ln + Lb cos B - Lc cos C - zo
//! ```
//!
//! Model: the upper arm's angle `B` counts forward of upright, so the linkage's is `theta2 = pi/2 - B`;
//! turret `A` and forearm `C` count as the linkage does. Their x, y, z are our z, x, y. The linkage's elbow
//! `theta3 - theta2` is `B + C - pi/2`: stops of the elbow limit the sum `B + C`, which lies between 0,
//! folded, and pi, stretched.
//! Frames and signs: base frame D, x right, y up, z to the user; the origin is `xo` in front of the turret's
//! axis and `zo` above its foot, amid the workspace, and no pose of zeroing. All angles are zero where the
//! upper arm is upright and the forearm hangs along it, which no arm can take.
//! Reference: Forsslund, Yip, Sallnas, WoodenHaptics: a starting kit for crafting force-reflecting spatial
//! haptic devices, TEI 2015; its driver.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};

use super::{Conditioning, JointConvention, JointLimits, Mechanism, Parallelogram, Unreachable};

/// An arm of the WoodenHaptics family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WoodenHaptics {
    linkage: Parallelogram,
    limits: JointLimits,
}

impl WoodenHaptics {
    /// The upper arm counts forward of upright.
    pub const CONVENTION: JointConvention =
        JointConvention { sign: [1.0, -1.0, 1.0], offset_rad: [0.0, FRAC_PI_2, 0.0] };

    /// Bodies `Ln` (turret, up to the shoulder), `Lb` (upper arm), `Lc` (forearm), the origin `[xo, zo]`, and
    /// the stops of the joints.
    pub fn new(body_lengths_m: [f64; 3], origin_m: [f64; 2], limits: JointLimits) -> Self {
        let [turret_m, upper_arm_m, forearm_m] = body_lengths_m;
        let [forward_m, up_m] = origin_m;
        let linkage = Parallelogram::new([upper_arm_m, forearm_m], [turret_m - up_m, -forward_m]);
        Self { linkage, limits }
    }

    /// Upper arm `Lb` and forearm `Lc`.
    pub fn link_lengths_m(&self) -> [f64; 2] {
        self.linkage.link_lengths_m()
    }

    /// Largest distance of the tip from the shoulder; no joint torque vector is longer than this times the
    /// force.
    pub fn reach_m(&self) -> f64 {
        self.linkage.reach_m()
    }
}

impl Mechanism for WoodenHaptics {
    fn forward(&self, joints: [f64; 3]) -> Vector3<f64> {
        self.linkage.forward(Self::CONVENTION.linkage_angles(joints))
    }

    fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable> {
        self.linkage.inverse(tip).map(|angles| Self::CONVENTION.joints(angles))
    }

    fn jacobian(&self, joints: [f64; 3]) -> Matrix3<f64> {
        self.forward_and_jacobian(joints).1
    }

    fn forward_and_jacobian(&self, joints: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        let (tip, mut jacobian) = self.linkage.forward_and_jacobian(Self::CONVENTION.linkage_angles(joints));
        for (mut column, sign) in jacobian.column_iter_mut().zip(Self::CONVENTION.sign) {
            column *= sign;
        }
        (tip, jacobian)
    }

    fn joint_limits(&self) -> JointLimits {
        self.limits
    }

    fn singularity(&self, joints: [f64; 3]) -> Conditioning {
        self.linkage.singularity(Self::CONVENTION.linkage_angles(joints))
    }
}
