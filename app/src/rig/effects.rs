//! From what a scene says of fields, guides, magnetism and vibration to what rendering takes, within the limits of the
//! rate that it will run at.

use super::material::Unfit;
use super::{Rig, RigError};
use haptics::{Entity, Field, Guide, Limits, Magnetism, ParameterError, Region, Track, Vibration};
use world::{FieldKindSpec, FieldSpec, GuideSpec, SceneEntity, TrackSpec};

impl Rig {
    /// The scene's fields and guides.
    pub(crate) fn effects(&self) -> Result<(Vec<Field>, Vec<Guide>), RigError> {
        let scene = &self.scene;
        let fields = scene.fields.iter().enumerate().map(|(index, spec)| {
            let what = format!("field[{index}]");
            field(spec, self.limits(spec.device_mass_kg))
                .map_err(|unfit| self.unfit((&self.scene_file, spec.line), what, unfit))
        });
        let guides = scene.guides.iter().enumerate().map(|(index, spec)| {
            let refused = |source| self.refused(Some(spec.line), format!("guide[{index}]"), source);
            self.limits(spec.device_mass_kg).and_then(|limits| guide(spec, &limits)).map_err(refused)
        });
        Ok((fields.collect::<Result<_, _>>()?, guides.collect::<Result<_, _>>()?))
    }

    /// What the entity's surface does beside being touched.
    pub(super) fn with_surface_effects(
        &self,
        mut entity: Entity,
        spec: &SceneEntity,
    ) -> Result<Entity, RigError> {
        let refused = |source| super::entities::refused(spec, source);
        let limits = self.limits(Limits::DEFAULT_DEVICE_MASS_KG).map_err(refused)?;
        if let Some(magnetism) = &spec.magnetism {
            if !Magnetism::suits(&entity.shape) {
                return Err(RigError::NoMagnet {
                    file: spec.file.to_path_buf(),
                    line: spec.line,
                    entity: spec.name.clone(),
                    kind: spec.shape.kind(),
                });
            }
            let made = Magnetism::new(magnetism.force_n, magnetism.distance_m, &limits);
            entity = entity.with_magnetism(made.map_err(refused)?);
        }
        if let Some(vibration) = &spec.vibration {
            let (frequency_hz, amplitude_n) = (vibration.frequency_hz, vibration.amplitude_n);
            let made = Vibration::new(frequency_hz, amplitude_n, vibration.full_load_n, &limits);
            entity = entity.with_vibration(made.map_err(refused)?);
        }
        Ok(entity)
    }

    /// Limits of effects on a device of this mass at its tip, at the rate.
    pub(crate) fn limits(&self, device_mass_kg: f64) -> Result<Limits, ParameterError> {
        Limits::at(self.period_ns as f64 / 1e9)?.with_device_mass(device_mass_kg)
    }
}

fn field(spec: &FieldSpec, limits: Result<Limits, ParameterError>) -> Result<Field, Unfit> {
    let limits = limits?;
    let region = match &spec.shape {
        Some(shape) => Region::within(shape.form()?, spec.pose, spec.rim_m)?,
        None => Region::everywhere_turned(spec.pose),
    };
    Ok(match spec.kind {
        FieldKindSpec::Viscous { damping_n_s_per_m } => Field::viscous(damping_n_s_per_m, region, &limits)?,
        FieldKindSpec::Inertial { mass_kg, cutoff_hz } => {
            Field::inertial(mass_kg, cutoff_hz, region, &limits)?
        }
        FieldKindSpec::Constant { force_n } => Field::constant(force_n, region)?,
    })
}

fn guide(spec: &GuideSpec, limits: &Limits) -> Result<Guide, ParameterError> {
    let track = match &spec.track {
        TrackSpec::Plane { point_m, normal } => Track::plane(*point_m, normal.into_inner())?,
        TrackSpec::Line { point_m, direction } => Track::line(*point_m, direction.into_inner())?,
        TrackSpec::Path(points_m) => Track::path(points_m)?,
    };
    let mut guide = Guide::new(track, spec.stiffness_n_per_m, spec.damping_n_s_per_m, limits)?
        .with_deadband(spec.deadband_m)?
        .with_force_limit(spec.force_limit_n)?;
    if let Some(capture_m) = spec.capture_m {
        guide = guide.with_capture(capture_m)?;
    }
    match spec.break_away_n {
        Some(break_away_n) => guide.with_break_away(break_away_n),
        None => Ok(guide),
    }
}
