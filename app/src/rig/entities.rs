//! From what a scene says of entities to what rendering takes.

use super::solids::Solids;
use super::{Rig, RigError, material};
use haptics::{Algorithm, Entity, ParameterError, Sphere};
use world::{AlgorithmSpec, Scene, SceneEntity, SceneFinger, ShapeSpec};

/// Radius of what stands in for a mesh that nobody feels (m).
const STAND_IN_M: f64 = 1e-3;

impl Rig {
    pub(super) fn entity(&self, spec: &SceneEntity, solids: &mut Solids) -> Result<Entity, RigError> {
        let what = || format!("entity {}", spec.name);
        let refused = |source| refused(spec, source);
        let unfit = |unfit| self.unfit((&spec.file, spec.line), what(), unfit);
        self.check_rendered(spec, what())?;
        let shape = material::shape(&spec.shape, &self.models, spec, solids).map_err(unfit)?;
        let friction = material::friction(&spec.friction).map_err(unfit)?;
        let algorithm = material::algorithm(spec.algorithm).map_err(unfit)?;
        let shading = material::shading(spec, &self.models).map_err(unfit)?;
        let height_map =
            spec.height_map.as_ref().map(|map| self.pictures.height_map(map, &shape)).transpose()?;
        let entity = Entity::new(shape, spec.pose, spec.stiffness_n_per_m)
            .and_then(|entity| entity.with_damping(spec.damping_n_s_per_m))
            .and_then(|entity| entity.with_friction(friction))
            .and_then(|entity| match spec.restitution {
                Some(restitution) => entity.with_restitution(restitution),
                None => Ok(entity),
            })
            .and_then(|entity| match spec.contact_stiffness_n_per_m {
                Some(stiffness_n_per_m) => entity.with_contact_stiffness(stiffness_n_per_m),
                None => Ok(entity),
            })
            .and_then(|entity| {
                entity.with_turning_friction(spec.torsional_friction_m, spec.rolling_friction_m)
            })
            .map(|entity| entity.with_algorithm(algorithm).with_shading(shading))
            .map(|entity| entity.with_said_stiffness(spec.is_stiffness_said))
            .map_err(refused)?;
        let entity = if spec.faces.is_empty() {
            entity
        } else {
            entity.with_face_materials(material::face_materials(spec).map_err(unfit)?)
        };
        let entity = match height_map {
            Some(height_map) => entity.with_height_map(height_map),
            None => entity,
        };
        let entity = if spec.is_collidable { entity } else { entity.without_collisions() };
        let entity = entity.within(self.space(spec.within.as_ref()));
        if spec.is_haptic { self.with_surface_effects(entity, spec) } else { Ok(entity.without_fingers()) }
    }

    /// An entity that is only seen: it has a place, a space, and a form as far as whoever draws it asks for one. It is among
    /// the others so that it is seen, chosen and moved by orders as they are.
    pub(super) fn only_seen(&self, spec: &SceneEntity, solids: &mut Solids) -> Result<Entity, RigError> {
        let unfit = |unfit| self.unfit((&spec.file, spec.line), format!("entity {}", spec.name), unfit);
        let shape = match &spec.shape {
            ShapeSpec::Mesh(_) => Sphere::new(STAND_IN_M).map_err(|source| refused(spec, source))?.into(),
            shape => material::shape(shape, &self.models, spec, solids).map_err(unfit)?,
        };
        let entity = Entity::new(shape, spec.pose, spec.stiffness_n_per_m);
        let entity = entity.map_err(|source| refused(spec, source))?;
        Ok(entity.without_fingers().without_collisions().within(self.space(spec.within.as_ref())))
    }

    /// The algorithms to compare with know surfaces, and trees have none of their own.
    fn check_rendered(&self, spec: &SceneEntity, what: String) -> Result<(), RigError> {
        let found = match spec.algorithm {
            AlgorithmSpec::VectorField => "vector-field",
            AlgorithmSpec::ClassicGodObject => "classic",
            _ => return Ok(()),
        };
        if !spec.shape.is_csg() {
            return Ok(());
        }
        Err(RigError::NotRendered { file: spec.file.to_path_buf(), line: spec.line, what, found })
    }

    /// What balls cannot feel by its equation they feel in triangles, made once for all forms that are alike.
    pub(super) fn prepared(&self, entities: Vec<Entity>) -> Vec<Entity> {
        let mut made: Vec<Entity> = Vec::new();
        let mut prepare = |entity: Entity, radius_m: f64| {
            if !entity.is_haptic || entity.is_felt_by(radius_m) {
                return entity;
            }
            if let Some(alike) = made.iter().find(|other| other.shape == entity.shape) {
                return Entity { for_balls: alike.for_balls.clone(), ..entity };
            }
            let entity = entity.prepared_for(radius_m);
            made.push(entity.clone());
            entity
        };
        let radii = || self.scene.fingers.iter().map(|finger| finger.radius_m);
        entities.into_iter().map(|entity| radii().fold(entity, &mut prepare)).collect()
    }

    /// A finger would pass through what it cannot feel, without a word.
    pub(super) fn check_felt(&self, entities: &[Entity], finger: &SceneFinger) -> Result<(), RigError> {
        let is_lost = |entity: &Entity| entity.is_haptic && !entity.is_felt_by(finger.radius_m);
        let not_felt = entities.iter().position(is_lost);
        let Some(index) = not_felt else { return Ok(()) };
        let spec = &self.scene.entities[index];
        let with_cone = entities[index].clone().with_algorithm(Algorithm::FrictionCone);
        // Somebody's own shape may be felt by small balls only.
        let by_smaller = entities[index].is_felt_by(1e-3 * finger.radius_m);
        Err(RigError::NotFelt {
            file: spec.file.to_path_buf(),
            line: spec.line,
            finger: finger.name.clone(),
            radius_m: finger.radius_m,
            entity: spec.name.clone(),
            kind: spec.shape.kind(),
            otherwise: match () {
                () if with_cone.is_felt_by(finger.radius_m) => ", algorithm = \"friction-cone\"",
                () if by_smaller => ", a smaller radius",
                () => "",
            },
        })
    }
}

/// Whether nobody meets an entity, nor does it move by itself or have a door: it is there to be looked at.
pub(super) fn is_only_seen(scene: &Scene, spec: &SceneEntity) -> bool {
    let has_door = || {
        let mut doors = scene.environments.iter().filter_map(|environment| environment.door.as_ref());
        doors.any(|door| door.of == spec.name)
    };
    !spec.is_met() && spec.motion.is_none() && !has_door()
}

/// Why an entity of the scene is refused.
pub(super) fn refused(spec: &SceneEntity, source: ParameterError) -> RigError {
    let (file, what) = (spec.file.to_path_buf(), format!("entity {}", spec.name));
    RigError::Refused { file, line: Some(spec.line), what, source }
}
