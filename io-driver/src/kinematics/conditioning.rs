//! Measures how near a pose is to a singularity.
//!
//! Problem: near a singularity the device can neither move nor push in some direction, and
//! whoever divides by the Jacobian there gets nonsense; they need a number to ask first.
//! Model: joint velocities on the unit sphere become tip velocities on an ellipsoid, whose
//! longest and shortest half axes are the extreme singular values of the Jacobian.
//! Units: metres per radian (ideal device: one).
//! Invariant: `0 <= smallest <= largest` for finite joints.
//! Reference: Yoshikawa, Manipulability of robotic mechanisms, 1985.

/// Half axes of the manipulability ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditioning {
    /// Smallest singular value of the Jacobian; zero in a singularity.
    pub smallest: f64,
    /// Largest singular value of the Jacobian: no joint torque vector is longer than this times
    /// the force.
    pub largest: f64,
}

impl Conditioning {
    /// Between 0, singular, and 1, equally mobile in all directions.
    pub fn inverse_condition(self) -> f64 {
        if self.largest > 0.0 { self.smallest / self.largest } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_condition_number_of_a_point_is_zero() {
        assert_eq!(Conditioning { smallest: 0.0, largest: 0.0 }.inverse_condition(), 0.0);
        assert_eq!(Conditioning { smallest: 0.5, largest: 2.0 }.inverse_condition(), 0.25);
    }
}
