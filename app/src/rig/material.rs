//! From what a scene says of an entity to what rendering takes: shape, friction, algorithm.

use super::models::Models;
use haptics::{
    Algorithm, Capsule, Cone, Cuboid, Cylinder, Form, Friction, ParameterError, Plane, Shape, Sphere,
};
use std::sync::Arc;
use world::{AlgorithmSpec, FrictionSpec, ShapeSpec};

/// Why something has no counterpart in rendering.
pub(super) enum Unfit {
    /// Its numbers are refused.
    Refused(ParameterError),
    /// This version has not got it.
    NotAvailable(String),
}

impl From<ParameterError> for Unfit {
    fn from(error: ParameterError) -> Self {
        Self::Refused(error)
    }
}

/// A shape; meshes are those that were loaded.
pub(super) fn shape(spec: &ShapeSpec, models: &Models) -> Result<Shape, Unfit> {
    match spec {
        ShapeSpec::Mesh(mesh) => match models.mesh(mesh) {
            Some(mesh) => Ok(Arc::clone(mesh).into()),
            None => Err(Unfit::NotAvailable(format!("shape {spec:?}"))),
        },
        spec => Ok(Shape::Form(form(spec)?)),
    }
}

fn form(spec: &ShapeSpec) -> Result<Form, Unfit> {
    Ok(match *spec {
        ShapeSpec::Plane { normal, offset_m } => Plane::new(normal.into_inner(), offset_m)?.into(),
        ShapeSpec::Sphere { radius_m } => Sphere::new(radius_m)?.into(),
        ShapeSpec::Box { size_m } => Cuboid::new(size_m)?.into(),
        ShapeSpec::Cylinder { radius_m, length_m } => Cylinder::new(radius_m, length_m)?.into(),
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => {
            Cone::new(radius_bottom_m, radius_top_m, length_m)?.into()
        }
        ShapeSpec::Capsule { radius_m, length_m } => Capsule::new(radius_m, length_m)?.into(),
        ref other => return Err(Unfit::NotAvailable(format!("shape {other:?}"))),
    })
}

/// A friction model.
pub(super) fn friction(spec: &FrictionSpec) -> Result<Friction, Unfit> {
    Ok(match *spec {
        FrictionSpec::None => Friction::None,
        FrictionSpec::Coulomb { mu } => Friction::Coulomb { mu },
        FrictionSpec::Stiction { mu_s, mu_d } => Friction::Stiction { mu_s, mu_d },
        FrictionSpec::Viscous { mu_v_s_per_m } => Friction::Viscous { mu_v_s_per_m },
        FrictionSpec::CoulombViscous { mu, mu_v_s_per_m } => Friction::CoulombViscous { mu, mu_v_s_per_m },
        ref other => return Err(Unfit::NotAvailable(format!("friction {other:?}"))),
    })
}

/// What works out the force.
pub(super) fn algorithm(spec: AlgorithmSpec) -> Result<Algorithm, Unfit> {
    match spec {
        AlgorithmSpec::FrictionCone => Ok(Algorithm::FrictionCone),
        AlgorithmSpec::VectorField => Ok(Algorithm::VectorField),
        AlgorithmSpec::ClassicGodObject => Ok(Algorithm::ClassicGodObject),
        other => Err(Unfit::NotAvailable(format!("algorithm {other:?}"))),
    }
}
