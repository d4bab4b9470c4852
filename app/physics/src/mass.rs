//! How a body's mass is spread: mass, centre of mass and inertia.
//!
//! Model: closed forms are solid and of one density. Inertia is kept as principal moments about the centre of mass and the
//! axes that they belong to.
//! Frames: B the entity's frame, P the principal axes.

use haptics::{ParameterError, Shape};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::broad_phase::Aabb;
use crate::collide;
use crate::error::BodyError;

mod forms;
mod polyhedron;

use forms::Spread;

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
    /// A mass below 1e-15 or above 1e15 kg; a shape without inertia (a plane, an own surface); a mesh that is not closed or
    /// encloses nothing.
    pub fn of_shape(shape: &Shape, mass_kg: f64) -> Result<Self, BodyError> {
        let mass_kg = mass(mass_kg)?;
        if let Shape::Mesh(mesh) = shape {
            return Ok(polyhedron::volume(mesh)?.with_mass(mass_kg));
        }
        Ok(Self::of_spread(&spread(shape)?, mass_kg))
    }

    /// Of a solid of this shape and density \[kg/m^3\].
    ///
    /// # Errors
    /// A density that is not finite or not positive, or makes no such mass; a shape without inertia.
    pub fn of_density(shape: &Shape, density_kg_m3: f64) -> Result<Self, BodyError> {
        let density_kg_m3 = positive("density_kg_m3", density_kg_m3)?;
        if let Shape::Mesh(mesh) = shape {
            let volume = polyhedron::volume(mesh)?;
            return Ok(volume.with_mass(mass(density_kg_m3 * volume.volume_m3)?));
        }
        let spread = spread(shape)?;
        let mass_kg = mass(density_kg_m3 * spread.volume_m3)?;
        Ok(Self::of_spread(&spread, mass_kg))
    }

    fn of_spread(spread: &Spread, mass_kg: f64) -> Self {
        Self {
            mass_kg,
            centre_B: spread.centre_B,
            principal_kg_m2: spread.moments_per_mass() * mass_kg,
            axes_BP: UnitQuaternion::identity(),
        }
    }

    /// As it was measured: for shapes that have no volume or whose volume nobody works out. Moments \[kg m^2\] are those
    /// about the centre of mass \[m, in B\], about the entity's own axes.
    ///
    /// # Errors
    /// A mass below 1e-15 or above 1e15 kg, a centre that is not finite, impossible moments.
    pub fn given(mass_kg: f64, centre_B: Vector3<f64>, moments: [f64; 3]) -> Result<Self, BodyError> {
        let mass_kg = mass(mass_kg)?;
        if let Some(&value) = centre_B.iter().find(|value| !value.is_finite()) {
            let (parameter, allowed) = ("centre_of_mass_m", "finite numbers");
            return Err(ParameterError::OutOfRange { parameter, value, allowed }.into());
        }
        let (principal_kg_m2, axes_BP) = (moments.into(), UnitQuaternion::identity());
        Self { mass_kg, centre_B, principal_kg_m2, axes_BP }.with_inertia(moments)
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

    /// The same if it can be that of this shape: contacts at a shape's ends cannot be solved for a mass that is all in its
    /// middle.
    ///
    /// # Errors
    /// A moment below a thousandth of what the box around the shape would have, if it were full of the mass.
    pub fn fitting(self, shape: &Shape) -> Result<Self, BodyError> {
        let Some(around) = Aabb::of_shape(shape, &Isometry3::identity()) else { return Ok(self) };
        let half_m = (around.high_W - around.low_W) * 0.5;
        let full = Vector3::from_fn(|i, _| {
            let across_m2 = half_m.norm_squared() - half_m[i] * half_m[i];
            self.mass_kg / 3.0 * across_m2
        });
        let inertia_B = self.inertia_B().diagonal();
        match (0..3).find(|&i| inertia_B[i] < LEAST_SPREAD * full[i]) {
            Some(axis) => Err(BodyError::Concentrated {
                axis: ["x", "y", "z"][axis],
                moment_kg_m2: inertia_B[axis],
                least_kg_m2: LEAST_SPREAD * full[axis],
            }),
            None => Ok(self),
        }
    }

    /// The same mass with its centre elsewhere (m, in B).
    ///
    /// The moments stay as they are and are those about the new centre: a body that is not of one density. What is known
    /// about another point than the centre of mass, at a distance d from it, is larger by `m d^2` across d (parallel axes).
    pub fn with_centre(self, centre_B: Vector3<f64>) -> Self {
        Self { centre_B, ..self }
    }

    /// Inertia about the centre of mass in the entity's frame \[kg m^2\].
    pub fn inertia_B(&self) -> Matrix3<f64> {
        let R_BP = self.axes_BP.to_rotation_matrix();
        R_BP * Matrix3::from_diagonal(&self.principal_kg_m2) * R_BP.transpose()
    }
}

/// Of a body \[kg\]: beyond, forces of fingers are no numbers any more.
const MASSES_KG: [f64; 2] = [1e-15, 1e15];
/// Of the moments of a full box around a shape: the least that a body of this shape may have.
const LEAST_SPREAD: f64 = 1e-3;

fn mass(value: f64) -> Result<f64, ParameterError> {
    let [least, most] = MASSES_KG;
    let (parameter, allowed) = ("mass_kg", "a number from 1e-15 to 1e15");
    let is_one = (least..=most).contains(&value);
    if is_one { Ok(value) } else { Err(ParameterError::OutOfRange { parameter, value, allowed }) }
}

pub(crate) fn positive(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    let allowed = "a finite number > 0";
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(ParameterError::OutOfRange { parameter, value, allowed })
    }
}

/// Of a solid that is full.
fn spread(shape: &Shape) -> Result<Spread, BodyError> {
    match shape {
        Shape::Form(form) => Spread::of(form),
        _ => None,
    }
    .ok_or_else(|| BodyError::NoInertia { shape: collide::name(shape) })
}
