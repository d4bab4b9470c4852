//! A force and the torque of it about a point.

use nalgebra::Vector3;

/// What acts on a body: a force, and a torque about its centre of mass; in W.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// \[N\]
    pub force_W: Vector3<f64>,
    /// About the centre of mass \[N m\].
    pub torque_W: Vector3<f64>,
}

impl Wrench {
    /// Adds a force that acts at `arm_W` from the centre of mass: the Residual Force and Torque Algorithms, a summand at a
    /// time.
    #[inline]
    pub fn add(&mut self, force_W: &Vector3<f64>, arm_W: &Vector3<f64>) {
        //= melder#5.5
        self.force_W += force_W;
        //= melder#5.6
        self.torque_W += arm_W.cross(force_W);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_and_their_torques_about_the_centre_of_mass_add_up() {
        //= melder#5.5 type=test
        //= melder#5.6 type=test
        let mut wrench = Wrench::default();
        wrench.add(&Vector3::new(0.0, 2.0, 0.0), &Vector3::new(0.5, 0.0, 0.0));
        wrench.add(&Vector3::new(0.0, -2.0, 0.0), &Vector3::new(-0.5, 0.0, 0.0));
        wrench.add(&Vector3::new(1.0, 0.0, 0.0), &Vector3::zeros());
        assert_eq!(wrench.force_W, Vector3::new(1.0, 0.0, 0.0));
        assert_eq!(wrench.torque_W, Vector3::new(0.0, 0.0, 2.0));
    }
}
