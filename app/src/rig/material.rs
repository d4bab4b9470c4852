//! From what a scene says of an entity to what rendering takes: shape, friction, algorithm, shading.

use super::models::Models;
use super::solids::Solids;
use haptics::mesh::Mesh;
use haptics::passivity::{Passivity, PassivitySpec};
use haptics::{
    Algorithm, CsgError, Cuboid, FaceMaterial, FaceMaterials, Friction, ParameterError, Shading, ShadingForm,
    Shape,
};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use world::{AlgorithmSpec, FrictionSpec, NoSolid, SceneEntity, ShadingFormSpec, ShadingSpec, ShapeSpec};

/// Why something has no counterpart in rendering.
pub(super) enum Unfit {
    /// Its numbers are refused.
    Refused(ParameterError),
    /// Its parts make no solid.
    NoSolid(CsgError),
    /// This version has not got it.
    NotAvailable(String),
}

impl From<ParameterError> for Unfit {
    fn from(error: ParameterError) -> Self {
        Self::Refused(error)
    }
}

/// What keeps a finger passive at this length of a tick (s).
pub(super) fn passivity(spec: &world::PassivitySpec, period_s: f64) -> Result<Passivity, ParameterError> {
    let motion = PassivitySpec::usual(period_s);
    let usual = PassivitySpec::for_motion(
        period_s,
        spec.acceleration_m_per_s2.unwrap_or(motion.acceleration_m_per_s2),
        spec.resolution_m.unwrap_or(motion.resolution_m),
    );
    let wanted = usual.with_bound(spec.bound_j.unwrap_or(usual.bound_j));
    let passivity = PassivitySpec {
        recovery_w: spec.recovery_w.unwrap_or(wanted.recovery_w),
        device_friction_n: spec.device_friction_n.unwrap_or(wanted.device_friction_n),
        ..wanted
    };
    Passivity::new(passivity, period_s)
}

impl From<NoSolid> for Unfit {
    fn from(why: NoSolid) -> Self {
        match why {
            NoSolid::Refused(error) => Self::Refused(error),
            NoSolid::Unjoined(error) => Self::NoSolid(error),
            NoSolid::Modelled(what) => Self::NotAvailable(what),
        }
    }
}

/// A shape; meshes are those that were loaded.
pub(super) fn shape(
    spec: &ShapeSpec,
    models: &Models,
    entity: &SceneEntity,
    solids: &mut Solids,
) -> Result<Shape, Unfit> {
    match spec {
        ShapeSpec::Mesh(mesh) => match models.mesh(mesh, entity) {
            Some(mesh) => Ok(Arc::clone(mesh).into()),
            None => Err(Unfit::NotAvailable(format!("shape {spec:?}"))),
        },
        ShapeSpec::Nurbs(nurbs) => match models.nurbs(nurbs) {
            Some(nurbs) => Ok(Arc::clone(nurbs).into()),
            None => Err(Unfit::NotAvailable(format!("shape {spec:?}"))),
        },
        spec if spec.is_csg() => Ok(solids.solid(spec)?.into()),
        spec => Ok(Shape::Form(spec.form()?)),
    }
}

/// Materials of labelled faces of a mesh, in the order of their labels.
pub(super) fn face_materials(spec: &SceneEntity) -> Result<FaceMaterials, Unfit> {
    let made = spec.faces.iter().map(|faces| {
        let friction = friction(&faces.friction)?;
        Ok(FaceMaterial::new(friction, faces.stiffness_n_per_m, faces.damping_n_s_per_m)?)
    });
    made.collect::<Result<Vec<_>, Unfit>>().map(FaceMaterials::new)
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

/// How its facets feel; meshes are shaded when they are loaded.
pub(super) fn shading(entity: &SceneEntity, models: &Models) -> Result<Shading, Unfit> {
    let (spec, shape) = (entity.shading, &entity.shape);
    let not_available = || Unfit::NotAvailable(format!("shading {spec:?} of a {}", shape.kind()));
    match (spec, shape) {
        (ShadingSpec::None, _) => Ok(Shading::None),
        (_, ShapeSpec::Mesh(mesh)) => models.shading(mesh, entity).cloned().ok_or_else(not_available),
        (ShadingSpec::Regions { length_m, crease_angle_deg, form }, ShapeSpec::Box { size_m }) => {
            // All its edges are as sharp.
            if crease_angle_deg.to_radians() < FRAC_PI_2 {
                return Ok(Shading::None);
            }
            Ok(Shading::box_regions(&Cuboid::new(*size_m)?, length_m, shading_form(form))?)
        }
        _ => Err(not_available()),
    }
}

/// That of a mesh.
pub(super) fn mesh_shading(spec: ShadingSpec, mesh: &Mesh) -> Result<Shading, Unfit> {
    Ok(match spec {
        ShadingSpec::None => Shading::None,
        ShadingSpec::Interpolated { crease_angle_deg, form } => {
            Shading::interpolated(mesh, crease_angle_deg.to_radians(), shading_form(form))?
        }
        ShadingSpec::Regions { length_m, crease_angle_deg, form } => {
            Shading::regions(mesh, length_m, crease_angle_deg.to_radians(), shading_form(form))?
        }
        other => return Err(Unfit::NotAvailable(format!("shading {other:?}"))),
    })
}

fn shading_form(spec: ShadingFormSpec) -> ShadingForm {
    match spec {
        ShadingFormSpec::Bisect => ShadingForm::Bisect,
        _ => ShadingForm::Rotate,
    }
}
