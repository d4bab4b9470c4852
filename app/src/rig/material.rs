//! From what a scene says of an entity to what rendering takes: shape, friction, algorithm.

use super::models::Models;
use haptics::{
    Algorithm, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Friction, ParameterError, Plane, Scaled,
    Shape, Sphere, Torus,
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
        ShapeSpec::Nurbs(nurbs) => match models.nurbs(nurbs) {
            Some(nurbs) => Ok(Arc::clone(nurbs).into()),
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
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } => Torus::new(ring_radius_m, tube_radius_m)?.into(),
        ShapeSpec::Ellipsoid { radii_m } => Ellipsoid::new(radii_m)?.into(),
        ShapeSpec::Scaled { ref shape, scale } => Scaled::new(form(shape)?, scale)?,
        ref other => return Err(Unfit::NotAvailable(format!("shape {other:?}"))),
    })
}

/// A friction model.
pub(super) fn friction(spec: &FrictionSpec) -> Result<Friction, Unfit> {
    Ok(match *spec {
        FrictionSpec::None => Friction::None,
        FrictionSpec::Coulomb { mu } => Friction::coulomb(mu)?,
        FrictionSpec::Stiction { mu_s, mu_d } => Friction::stiction(mu_s, mu_d)?,
        FrictionSpec::Viscous { mu_v_s_per_m } => Friction::viscous(mu_v_s_per_m)?,
        FrictionSpec::CoulombViscous { mu, mu_v_s_per_m } => Friction::coulomb_viscous(mu, mu_v_s_per_m)?,
        FrictionSpec::Stribeck { mu_s, mu_d, v_s_m_s, mu_v_s_per_m } => {
            Friction::stribeck(mu_s, mu_d, v_s_m_s, mu_v_s_per_m)?
        }
        FrictionSpec::Karnopp { mu_s, mu_d, v_min_m_s, mu_v_s_per_m } => {
            Friction::karnopp(mu_s, mu_d, v_min_m_s, mu_v_s_per_m)?
        }
        FrictionSpec::Dahl { mu } => Friction::dahl(mu)?,
        FrictionSpec::LuGre { mu_s, mu_d, v_s_m_s, mu_v_s_per_m, damping_n_s_per_m } => {
            Friction::lugre(mu_s, mu_d, v_s_m_s, mu_v_s_per_m, damping_n_s_per_m)?
        }
        FrictionSpec::Curve { ref speed_m_s, ref mu, mu_s } => curve(speed_m_s, mu, mu_s)?,
        FrictionSpec::Bristle { mu, bonds, seed } => Friction::bristle(mu, bonds, seed)?,
        FrictionSpec::ResetIntegrator { mu_s, mu_d, damping_n_s_per_m } => {
            Friction::reset_integrator(mu_s, mu_d, damping_n_s_per_m)?
        }
        FrictionSpec::Hayward { mu, stick_fraction } => Friction::hayward_armstrong(mu, stick_fraction)?,
        FrictionSpec::FixedCone { friction_n, static_n } => Friction::fixed_cone(friction_n, Some(static_n))?,
        ref other => return Err(Unfit::NotAvailable(format!("friction {other:?}"))),
    })
}

/// A curve begins at rest: below its first point it is as high as there.
fn curve(speed_m_s: &[f64], mu: &[f64], mu_s: f64) -> Result<Friction, ParameterError> {
    let at_rest = mu.first().filter(|_| speed_m_s.first() != Some(&0.0)).map(|&mu| (0.0, mu));
    let drawn = speed_m_s.iter().copied().zip(mu.iter().copied());
    let points: Vec<(f64, f64)> = at_rest.into_iter().chain(drawn).collect();
    Friction::curve(mu_s, &points)
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
