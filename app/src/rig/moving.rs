//! From what a scene says of entities that move to bodies.

use haptics::Entity;
use physics::collide::can_move;
use physics::{Body, BodyError, Integrator, MassProperties, Response, Settings};
use world::{IntegratorSpec, MassSpec, MotionSpec, ResponseSpec, SceneEntity};

use super::{Rig, RigError};
use crate::fast_step::FastStep;

impl Rig {
    /// The entities that move: their numbers, and what the scene says of them.
    pub(super) fn moving(&self) -> impl Iterator<Item = (usize, &SceneEntity, &MotionSpec)> {
        let entities = self.scene.entities.iter().enumerate();
        entities.filter_map(|(index, entity)| Some((index, entity, entity.motion.as_ref()?)))
    }

    /// The bodies of these entities, with their numbers.
    pub(super) fn bodies(&self, entities: &[Entity]) -> Result<Vec<(usize, Body)>, RigError> {
        let body = |(index, spec, motion): (usize, &SceneEntity, &MotionSpec)| {
            let body = if can_move(&entities[index].shape) {
                body(&entities[index], motion)
            } else {
                Err(BodyError::NoContactPoints { shape: spec.shape.kind() })
            };
            Ok((index, body.map_err(|source| self.no_body(spec, source))?))
        };
        self.moving().map(body).collect()
    }

    pub(super) fn with_objects(
        &self,
        step: FastStep,
        bodies: &[(usize, Body)],
    ) -> Result<FastStep, RigError> {
        let dynamics = self.scene.dynamics;
        let settings = Settings {
            gravity_W: self.scene.gravity_m_s2,
            integrator: match dynamics.integrator {
                IntegratorSpec::Implicit => Integrator::Implicit,
                IntegratorSpec::Rk4 => Integrator::Rk4,
                IntegratorSpec::ThesisEuler => Integrator::ThesisEuler,
                IntegratorSpec::ThesisEulerGyroscopic => Integrator::ThesisEulerGyroscopic,
            },
            response: match dynamics.response {
                ResponseSpec::Force => Response::Force,
                ResponseSpec::Impulse { restitution } => Response::Impulse { restitution },
            },
            ..Settings::default()
        };
        // Which entity it is, is not told; the first that moves is named.
        let first = |source| self.no_body(&self.scene.entities[bodies[0].0], source);
        step.with_objects(bodies, settings).map_err(first)
    }

    fn no_body(&self, spec: &SceneEntity, source: BodyError) -> RigError {
        let what = format!("entity {}", spec.name);
        RigError::NoBody { file: self.scene_file.clone(), line: spec.line, what, source }
    }
}

fn body(entity: &Entity, motion: &MotionSpec) -> Result<Body, BodyError> {
    let mass = match motion.mass {
        MassSpec::Mass(mass_kg) => MassProperties::of_shape(&entity.shape, mass_kg),
        MassSpec::Density(_) => MassProperties::of_shape(&entity.shape, 1.0),
    }?;
    let mass = match motion.inertia_kg_m2 {
        Some(moments) => mass.with_inertia(moments)?,
        None => mass,
    };
    let mass = match motion.centre_of_mass_m {
        Some(centre_m) => mass.with_centre(centre_m.into()),
        None => mass,
    };
    let body = Body::at_rest(mass, &entity.X_WB);
    let body = if motion.rotation_locked { body.with_rotation_locked() } else { body };
    Ok(body.moving(motion.velocity_m_s, motion.angular_velocity_rad_s))
}
