//! How a mechanism names its joint angles, against those of the linkage that its equations are written for.
//!
//! Problem: arms of the same build count their angles from different poses and the other way round; their
//! equations shall exist once.
//! Model: `theta = sign q + offset` for each joint, with `q` the mechanism's own angle and `theta` the
//! linkage's: turret from pointing at the user, upper arm above the horizontal, forearm forward of hanging.
//! Invariant: signs are +1 or -1, so power stays the same: a torque, a rate or a row of a Jacobian changes
//! sides by its sign alone.

/// Sign and offset of each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointConvention {
    /// +1 or -1: whether the linkage's angle grows with the mechanism's.
    pub sign: [f64; 3],
    /// The linkage's angle where the mechanism's is zero (rad).
    pub offset_rad: [f64; 3],
}

impl JointConvention {
    /// A mechanism that counts as the linkage does.
    pub const LINKAGE: Self = Self { sign: [1.0; 3], offset_rad: [0.0; 3] };

    /// The linkage's angles (rad) at these joints of the mechanism.
    pub fn linkage_angles(&self, joints: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| self.sign[j] * joints[j] + self.offset_rad[j])
    }

    /// The mechanism's joints (rad) at these angles of the linkage.
    pub fn joints(&self, linkage_angles: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| self.sign[j] * (linkage_angles[j] - self.offset_rad[j]))
    }

    /// Torques, or rates, from one side to the other; both ways are the same.
    pub fn turned(&self, per_joint: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| self.sign[j] * per_joint[j])
    }
}

/// Sines and cosines of a linkage's angles, for whoever needs them more than once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkagePose {
    /// Of turret, upper arm and forearm.
    pub sin: [f64; 3],
    /// Of the same.
    pub cos: [f64; 3],
}

impl LinkagePose {
    /// At these angles (rad).
    pub fn at(angles: [f64; 3]) -> Self {
        let pairs = angles.map(f64::sin_cos);
        Self { sin: pairs.map(|(sin, _)| sin), cos: pairs.map(|(_, cos)| cos) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_come_back_and_power_is_kept() {
        let convention = JointConvention { sign: [1.0, -1.0, 1.0], offset_rad: [0.0, 1.5, -0.25] };
        // All numbers are exact in binary.
        let joints = [0.5, 0.75, -1.0];
        assert_eq!(convention.linkage_angles(joints), [0.5, 0.75, -1.25]);
        assert_eq!(convention.joints(convention.linkage_angles(joints)), joints);
        let (torque, rate) = (convention.turned([1.0, 2.0, 3.0]), convention.turned([0.5, 0.25, 2.0]));
        assert_eq!((0..3).map(|j| torque[j] * rate[j]).sum::<f64>(), 7.0);
    }
}
