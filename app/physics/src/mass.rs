//! How a body's mass is spread: mass, centre of mass and inertia.
//!
//! Model: closed forms are solid and of one density. Inertia is kept as principal moments about the centre of mass and the
//! axes that they belong to.
//! Frames: B the entity's frame, P the principal axes.

mod polyhedron;

use haptics::{Form, ParameterError, Shape};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::error::BodyError;

/// Mass, centre of mass and inertia of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// m \[kg\], > 0.
    pub mass_kg: f64,
    /// Centre of mass in the entity's frame \[m\].
    pub centre_B: Vector3<f64>,
    /// Principal moments about the centre of mass \[kg m^2\], all > 0.
    pub principal_kg_m2: Vector3<f64>,
    /// `R_BP`: the principal axes in the entity's frame.
    pub axes_BP: UnitQuaternion<f64>,
}

impl MassProperties {
    /// Of a solid of this shape and mass, of one density.
    ///
    /// # Errors
    /// A mass that is not finite or not positive; a shape without inertia (a plane, an own surface); a mesh that is not
    /// closed or encloses nothing.
    pub fn of_shape(shape: &Shape, mass_kg: f64) -> Result<Self, BodyError> {
        let mass_kg = positive("mass_kg", mass_kg)?;
        if let Shape::Mesh(mesh) = shape {
            return Ok(polyhedron::volume(mesh)?.with_mass(mass_kg));
        }
        let Shape::Form(form) = shape else {
            return Err(BodyError::NoInertia { shape: "shape of this kind" });
        };
        let per_mass = moments_per_mass(form).ok_or(BodyError::NoInertia { shape: "plane" })?;
        Ok(Self {
            mass_kg,
            centre_B: Vector3::zeros(),
            principal_kg_m2: per_mass * mass_kg,
            axes_BP: UnitQuaternion::identity(),
        })
    }

    /// The same with these principal moments \[kg m^2\], about the entity's own axes.
    ///
    /// # Errors
    /// Moments that no mass distribution has: not finite, not positive, or one larger than the other two together.
    pub fn with_inertia(self, moments: [f64; 3]) -> Result<Self, BodyError> {
        let [x, y, z] = moments;
        let sum = x + y + z;
        // Rounding of decimals: a thin rod's moments are written as equal.
        let is_possible = |one: f64| one.is_finite() && one > 0.0 && 2.0 * one <= sum * (1.0 + 1e-9);
        if !moments.iter().all(|&one| is_possible(one)) {
            return Err(BodyError::Inertia { moments });
        }
        Ok(Self { principal_kg_m2: moments.into(), axes_BP: UnitQuaternion::identity(), ..self })
    }

    /// The same mass with its centre elsewhere (m, in B); the moments are those about the new centre.
    pub fn with_centre(self, centre_B: Vector3<f64>) -> Self {
        Self { centre_B, ..self }
    }

    /// Inertia about the centre of mass in the entity's frame \[kg m^2\].
    pub fn inertia_B(&self) -> Matrix3<f64> {
        let R_BP = self.axes_BP.to_rotation_matrix();
        R_BP * Matrix3::from_diagonal(&self.principal_kg_m2) * R_BP.transpose()
    }
}

pub(crate) fn positive(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    let allowed = "a finite number > 0";
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(ParameterError::OutOfRange { parameter, value, allowed })
    }
}

/// Principal moments of a solid of 1 kg about its centre \[m^2\].
fn moments_per_mass(form: &Form) -> Option<Vector3<f64>> {
    Some(match form {
        Form::Sphere(sphere) => Vector3::repeat(0.4 * sphere.radius_m().powi(2)),
        Form::Cuboid(cuboid) => {
            let [x, y, z] = cuboid.size_m().map(|edge| edge * edge / 12.0);
            Vector3::new(y + z, x + z, x + y)
        }
        _ => return None,
    })
}
