//! How a body moves within a tick, and what moves it.

use nalgebra::{Matrix3, Vector3};

/// How a body moves and what moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Of its centre of mass \[m/s\].
    pub velocity_W: Vector3<f64>,
    /// \[rad/s\]
    pub angular_velocity_W: Vector3<f64>,
    /// \[1/kg\]; zero where nothing moves it.
    pub inverse_mass: f64,
    /// \[1/(kg m^2)\]; zero where it never turns.
    pub inverse_inertia_W: Matrix3<f64>,
}

impl Motion {
    /// Of what stands still, whatever presses it.
    pub(crate) const NONE: Self = Self {
        velocity_W: Vector3::new(0.0, 0.0, 0.0),
        angular_velocity_W: Vector3::new(0.0, 0.0, 0.0),
        inverse_mass: 0.0,
        inverse_inertia_W: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Velocity of its point at this arm \[m/s\].
    #[inline]
    pub fn at(&self, arm_W: &Vector3<f64>) -> Vector3<f64> {
        self.velocity_W + self.angular_velocity_W.cross(arm_W)
    }

    #[inline]
    pub(super) fn push(&mut self, impulse_W: &Vector3<f64>, arm_W: &Vector3<f64>) {
        self.velocity_W += impulse_W * self.inverse_mass;
        self.angular_velocity_W += self.inverse_inertia_W * arm_W.cross(impulse_W);
    }

    #[inline]
    pub(super) fn turn(&mut self, angular_impulse_W: &Vector3<f64>) {
        self.angular_velocity_W += self.inverse_inertia_W * angular_impulse_W;
    }

    /// What velocity an impulse at this arm gives to the point there \[1/kg\].
    #[inline]
    pub(super) fn mobility_W(&self, arm_W: &Vector3<f64>) -> Matrix3<f64> {
        let r = arm_W.cross_matrix();
        Matrix3::from_diagonal_element(self.inverse_mass) - r * self.inverse_inertia_W * r
    }

    /// Whether it does not move, whatever could move it.
    #[inline]
    pub(crate) fn is_still(&self) -> bool {
        [self.velocity_W, self.angular_velocity_W] == [Vector3::zeros(); 2]
    }

    /// Whether anything that presses it moves it.
    #[inline]
    pub(crate) fn is_movable(&self) -> bool {
        self.inverse_mass != 0.0 || self.inverse_inertia_W != Matrix3::zeros()
    }

    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        let Self { velocity_W, angular_velocity_W, inverse_mass, inverse_inertia_W } = self;
        // Zero times what is no number, or infinite, is no number.
        let zero = (velocity_W * 0.0 + angular_velocity_W * 0.0).sum() + (inverse_inertia_W * 0.0).sum();
        zero + inverse_mass * 0.0 == 0.0
    }
}
