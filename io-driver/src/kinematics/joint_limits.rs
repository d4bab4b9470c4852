//! Says which joint angles a mechanism can take.
//!
//! Model: each joint has a stop at either end, and so has the angle between the last two links,
//! because a parallelogram linkage carries both on the base: its third angle is absolute, and the
//! links collide by the *difference* of two joints; or by their sum, where the mechanism counts the
//! upper arm the other way round.
//! Frames and signs: joint angles of the mechanism, radians (metres for the ideal device).
//! Invariant: what is not a number is never inside.
//! Cost: eight comparisons.

/// A closed interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end, belonging to it.
    pub min: f64,
    /// Upper end, belonging to it.
    pub max: f64,
}

/// The stops of a mechanism with three joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Of each joint.
    pub joints: [Interval; 3],
    /// Of the bend of the elbow, see [`JointLimits::elbow_angle`].
    pub elbow: Interval,
    /// How the upper arm counts in it: -1 or +1.
    pub elbow_sign: f64,
}

impl Interval {
    /// Everything but "not a number".
    pub const UNBOUNDED: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };

    /// Whether `value` lies in it.
    pub fn contains(self, value: f64) -> bool {
        self.min <= value && value <= self.max
    }

    /// How far `value` lies outside; zero inside, infinite for what is not a number.
    pub fn excess(self, value: f64) -> f64 {
        if self.contains(value) {
            0.0
        } else if value.is_nan() {
            f64::INFINITY
        } else {
            (self.min - value).max(value - self.max)
        }
    }
}

impl JointLimits {
    /// No stops at all.
    pub const UNBOUNDED: Self =
        Self { joints: [Interval::UNBOUNDED; 3], elbow: Interval::UNBOUNDED, elbow_sign: -1.0 };

    /// Bend of the elbow: `joints[2] - joints[1]`, or their sum if the upper arm counts the other way round. A torque
    /// `t` of the elbow's stop acts as `t` on joint 2 and as `elbow_sign * t` on joint 1.
    pub fn elbow_angle(&self, joints: [f64; 3]) -> f64 {
        joints[2] + self.elbow_sign * joints[1]
    }

    /// Whether the mechanism can take these angles.
    pub fn contains(&self, joints: [f64; 3]) -> bool {
        self.excess(joints) == 0.0
    }

    /// How far the worst joint (or the elbow) is beyond its stop; zero within all.
    pub fn excess(&self, joints: [f64; 3]) -> f64 {
        let bend = self.elbow.excess(self.elbow_angle(joints));
        (0..3).map(|j| self.joints[j].excess(joints[j])).fold(bend, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: JointLimits = JointLimits {
        joints: [
            Interval { min: -1.0, max: 1.0 },
            Interval { min: -1.0, max: 2.0 },
            Interval { min: 0.0, max: 3.0 },
        ],
        elbow: Interval { min: -0.5, max: 0.75 },
        elbow_sign: -1.0,
    };

    #[test]
    fn the_ends_belong_to_the_limits() {
        assert!(LIMITS.contains([1.0, 2.0, 2.75]));
        assert!(LIMITS.contains([-1.0, 0.5, 0.0]));
    }

    #[test]
    fn the_elbow_limits_two_joints_that_are_each_within_their_own() {
        // 2.0 - 0.0 is 1.25 more than the elbow bends; all numbers are exact in binary.
        assert_eq!(LIMITS.excess([0.0, 0.0, 2.0]), 1.25);
        assert!(!LIMITS.contains([0.0, 0.0, 2.0]));
    }

    #[test]
    fn an_upper_arm_that_counts_the_other_way_round_bends_the_elbow_by_the_sum() {
        let limits = JointLimits { elbow_sign: 1.0, ..LIMITS };
        assert_eq!(limits.elbow_angle([9.0, 0.5, 0.25]), 0.75);
        assert!(limits.contains([0.0, 0.5, 0.25]));
        assert_eq!(limits.excess([0.0, 2.0, 0.25]), 1.5);
    }

    #[test]
    fn the_excess_is_that_of_the_worst_joint() {
        assert_eq!(LIMITS.excess([-1.5, 2.25, 2.5]), 0.5);
    }

    #[test]
    fn nan_is_outside_and_everything_else_inside_the_unbounded() {
        assert!(!LIMITS.contains([f64::NAN, 0.0, 0.0]));
        assert!(!JointLimits::UNBOUNDED.contains([0.0, f64::NAN, 0.0]));
        assert!(JointLimits::UNBOUNDED.contains([1e300, -1e300, 1e300]));
    }
}
