//! Maps joints to the tip and forces at the tip to joint torques, for each mechanism.
//!
//! Problem: encoders count joints and motors turn joints, but everybody else thinks in the
//! position of the tip and the force on the user.
//! Model: rigid links without clearance; the base stands still.
//! Frames and signs: everything in the device's base frame D, x to the right, y up, z to the
//! user, origin where the mechanism says. A positive torque turns its joint towards a
//! larger angle. SI, radians; the joints of [`Ideal`] are metres.
//! Invariants: no function panics, whatever it is given. [`Mechanism::joint_torque`] only ever
//! multiplies by the transposed Jacobian, so it stays bounded in every singularity; nothing here
//! inverts a Jacobian.
//! Cost: a dozen trigonometric functions at most; no loop, no allocation.

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub mod conditioning;
pub mod gimbal;
pub mod gravity;
pub mod ideal;
pub mod joint_convention;
pub mod joint_limits;
pub mod parallelogram;
pub mod premium;
pub mod wooden_haptics;

pub use conditioning::Conditioning;
pub use ideal::Ideal;
pub use joint_convention::{JointConvention, LinkagePose};
pub use joint_limits::{Interval, JointLimits};
pub use parallelogram::Parallelogram;
pub use premium::Premium;
pub use wooden_haptics::WoodenHaptics;

/// The geometry of a device with three actuated joints and a free gimbal at its tip.
pub trait Mechanism: Send {
    /// Position `p_D` of the tip in the base frame, in metres.
    fn forward(&self, joints: [f64; 3]) -> Vector3<f64>;

    /// Joints that bring the tip to `p_D`.
    ///
    /// Limits of the joints are not looked at: ask [`JointLimits::contains`].
    ///
    /// # Errors
    /// [`Unreachable`] says by how much the position is out of reach.
    fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable>;

    /// Velocity of the tip per velocity of each joint: column `j` belongs to joint `j`, metres
    /// per radian.
    fn jacobian(&self, joints: [f64; 3]) -> Matrix3<f64>;

    /// Both, for whoever needs both at the same joints.
    fn forward_and_jacobian(&self, joints: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        (self.forward(joints), self.jacobian(joints))
    }

    /// Joint torques, N m, that make the tip push the user with `force_on_user`, N, while
    /// nothing accelerates.
    ///
    /// By virtual work `tau . dq = F . dx`, hence `tau = J^T F`. Along a direction in which a
    /// singular mechanism cannot move the torque vanishes instead of growing: the user feels
    /// less than was asked for, never more.
    fn joint_torque(&self, joints: [f64; 3], force_on_user: Vector3<f64>) -> [f64; 3] {
        self.jacobian(joints).tr_mul(&force_on_user).into()
    }

    /// How far the joints can turn.
    fn joint_limits(&self) -> JointLimits;

    /// How near the pose is to a singularity.
    fn singularity(&self, joints: [f64; 3]) -> Conditioning;
}

/// Why no joints exist for a position of the tip.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Unreachable {
    /// Further from the shoulder than the stretched arm.
    #[error("the tip would lie {beyond_m} m beyond the reach of the stretched arm, {reach_m} m")]
    TooFar {
        /// Distance missing to the position.
        beyond_m: f64,
        /// Reach of the arm from its shoulder.
        reach_m: f64,
    },
    /// Nearer to the shoulder than the folded arm.
    #[error("the tip would lie {short_m} m inside the hole around the shoulder of radius {hole_m} m")]
    TooNear {
        /// Distance to the nearest position in reach.
        short_m: f64,
        /// Radius of the sphere around the shoulder which the folded arm cannot enter.
        hole_m: f64,
    },
    /// A coordinate is infinite or not a number.
    #[error("the position of the tip is not finite")]
    NotFinite,
}

/// The mechanisms this driver knows, dispatched without a pointer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kinematics {
    /// PHANToM Premium with three actuated joints.
    Premium(Premium),
    /// An arm of the WoodenHaptics family.
    WoodenHaptics(WoodenHaptics),
    /// Position goes straight through.
    Ideal(Ideal),
}

impl Mechanism for Kinematics {
    fn forward(&self, joints: [f64; 3]) -> Vector3<f64> {
        match self {
            Self::Premium(premium) => premium.forward(joints),
            Self::WoodenHaptics(arm) => arm.forward(joints),
            Self::Ideal(ideal) => ideal.forward(joints),
        }
    }

    fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable> {
        match self {
            Self::Premium(premium) => premium.inverse(tip),
            Self::WoodenHaptics(arm) => arm.inverse(tip),
            Self::Ideal(ideal) => ideal.inverse(tip),
        }
    }

    fn jacobian(&self, joints: [f64; 3]) -> Matrix3<f64> {
        match self {
            Self::Premium(premium) => premium.jacobian(joints),
            Self::WoodenHaptics(arm) => arm.jacobian(joints),
            Self::Ideal(ideal) => ideal.jacobian(joints),
        }
    }

    fn forward_and_jacobian(&self, joints: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        match self {
            Self::Premium(premium) => premium.forward_and_jacobian(joints),
            Self::WoodenHaptics(wooden) => wooden.forward_and_jacobian(joints),
            Self::Ideal(ideal) => ideal.forward_and_jacobian(joints),
        }
    }

    fn joint_limits(&self) -> JointLimits {
        match self {
            Self::Premium(premium) => premium.joint_limits(),
            Self::WoodenHaptics(arm) => arm.joint_limits(),
            Self::Ideal(ideal) => ideal.joint_limits(),
        }
    }

    fn singularity(&self, joints: [f64; 3]) -> Conditioning {
        match self {
            Self::Premium(premium) => premium.singularity(joints),
            Self::WoodenHaptics(arm) => arm.singularity(joints),
            Self::Ideal(ideal) => ideal.singularity(joints),
        }
    }
}
