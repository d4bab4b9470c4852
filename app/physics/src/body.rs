//! A rigid body: where it is and how it moves.
//!
//! Model: what it carries from tick to tick is its momentum and its angular momentum, which nothing but forces and torques
//! change; how fast it turns follows from where its axes point (Melder eq. 5.8, where the gyroscopic term stands for that).
//! Frames: W, and B the entity's; the centre of mass is where B's frame puts it.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::mass::MassProperties;

/// A rigid body in motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// How its mass is spread.
    pub mass: MassProperties,
    /// Where its centre of mass is \[m\].
    pub centre_W: Vector3<f64>,
    /// `R_WB`.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of its centre of mass \[m/s\].
    pub velocity_W: Vector3<f64>,
    /// About its centre of mass \[N m s\].
    pub angular_momentum_W: Vector3<f64>,
    /// It never turns.
    pub rotation_locked: bool,
}

impl Body {
    /// At rest, its entity's frame at `X_WB`.
    pub fn at_rest(mass: MassProperties, X_WB: &Isometry3<f64>) -> Self {
        Self {
            mass,
            centre_W: (X_WB * nalgebra::Point3::from(mass.centre_B)).coords,
            orientation: X_WB.rotation,
            velocity_W: Vector3::zeros(),
            angular_momentum_W: Vector3::zeros(),
            rotation_locked: false,
        }
    }

    /// The same in motion: the velocity of its frame's origin (m/s), and how fast it turns (rad/s).
    #[must_use]
    pub fn moving(mut self, velocity_W: Vector3<f64>, angular_velocity_W: Vector3<f64>) -> Self {
        if !self.rotation_locked {
            self.angular_momentum_W = self.inertia_W() * angular_velocity_W;
        }
        self.velocity_W =
            velocity_W + self.angular_velocity_W().cross(&(self.orientation * self.mass.centre_B));
        self
    }

    /// The same, never turning.
    #[must_use]
    pub fn with_rotation_locked(self) -> Self {
        Self { rotation_locked: true, angular_momentum_W: Vector3::zeros(), ..self }
    }

    /// `X_WB`, the pose of its entity's frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let origin_W = self.centre_W - self.orientation * self.mass.centre_B;
        Isometry3::from_parts(Translation3::from(origin_W), self.orientation)
    }

    /// `R_WP`.
    pub fn axes(&self) -> UnitQuaternion<f64> {
        self.orientation * self.mass.axes_BP
    }

    /// `J` about the centre of mass \[kg m^2\], in W.
    pub fn inertia_W(&self) -> Matrix3<f64> {
        in_axes(&self.axes(), self.mass.principal_kg_m2)
    }

    /// Its inverse; zero where the body never turns.
    pub fn inverse_inertia_W(&self) -> Matrix3<f64> {
        if self.rotation_locked {
            return Matrix3::zeros();
        }
        in_axes(&self.axes(), self.mass.principal_kg_m2.map(f64::recip))
    }

    /// How fast it turns \[rad/s\], in W.
    pub fn angular_velocity_W(&self) -> Vector3<f64> {
        self.inverse_inertia_W() * self.angular_momentum_W
    }

    /// Kinetic energy \[J\].
    pub fn kinetic_energy_j(&self) -> f64 {
        0.5 * self.mass.mass_kg * self.velocity_W.norm_squared()
            + 0.5 * self.angular_momentum_W.dot(&self.angular_velocity_W())
    }

    /// Whether all that it is and does is a number.
    pub fn is_finite(&self) -> bool {
        let all = [self.centre_W, self.velocity_W, self.angular_momentum_W, self.orientation.imag()];
        all.iter().all(|v| v.iter().all(|x| x.is_finite())) && self.orientation.w.is_finite()
    }
}

/// `R diag(moments) R^T`.
fn in_axes(R_WP: &UnitQuaternion<f64>, moments: Vector3<f64>) -> Matrix3<f64> {
    let R = R_WP.to_rotation_matrix();
    //= melder#5.8
    R.matrix() * Matrix3::from_diagonal(&moments) * R.matrix().transpose()
}
