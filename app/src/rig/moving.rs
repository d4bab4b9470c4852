//! From what a scene says of entities that move to bodies.

use haptics::{Entity, ParameterError, Shape};
use io_driver::say::say;
use physics::collide::{self, can_move, is_collidable};
use physics::{
    Attachment, Body, BodyError, ContactStiffness, Contacts, FingerSettings, HeldOrientation, Integrator,
    LimitSurface, MassProperties, Response, Settings, Sleep, SoftFinger, TorsionModel,
};
use world::{
    AttachSpec, AttachedOrientation, ContactStiffnessSpec, IntegratorSpec, MassSpec, MotionSpec,
    ResponseSpec, SceneEntity, SceneFinger, SoftModelSpec, SoftSpec,
};

use super::{Rig, RigError};
use crate::fast_step::{FastStep, HandFinger};

impl Rig {
    /// The entities that move: their numbers, and what the scene says of them.
    pub(crate) fn moving(&self) -> impl Iterator<Item = (usize, &SceneEntity, &MotionSpec)> {
        let entities = self.scene.entities.iter().enumerate();
        entities.filter_map(|(index, entity)| Some((index, entity, entity.motion.as_ref()?)))
    }

    /// The bodies of these entities, with their numbers.
    pub(crate) fn bodies(
        &self,
        entities: &[Entity],
    ) -> impl Iterator<Item = Result<(usize, Body), RigError>> {
        let body = |(index, spec, motion): (usize, &SceneEntity, &MotionSpec)| {
            let body = if can_move(&entities[index].shape) {
                body(&entities[index], motion)
            } else {
                Err(BodyError::NoContactPoints { shape: spec.shape.kind() })
            };
            Ok((index, body.map_err(|source| no_body(spec, source))?))
        };
        self.moving().map(body)
    }

    /// The masses of the entities that move, with their numbers (kg).
    pub(crate) fn masses(&self, entities: &[Entity]) -> impl Iterator<Item = (usize, f64)> {
        self.bodies(entities).filter_map(|body| body.ok().map(|(index, body)| (index, body.mass.mass_kg)))
    }

    /// Settings of all bodies.
    fn dynamics(&self) -> Settings {
        let dynamics = self.scene.dynamics;
        Settings {
            gravity_W: self.scene.gravity_m_s2,
            integrator: match dynamics.integrator {
                IntegratorSpec::Implicit => Integrator::Implicit,
                IntegratorSpec::Rk4 => Integrator::Rk4,
                IntegratorSpec::ThesisEuler => Integrator::ThesisEuler,
                IntegratorSpec::ThesisEulerGyroscopic => Integrator::ThesisEulerGyroscopic,
                IntegratorSpec::ThesisEulerPrinted => Integrator::ThesisEulerPrinted,
            },
            response: match dynamics.response {
                ResponseSpec::Force { restitution: None } => Response::Force,
                ResponseSpec::Force { restitution: Some(restitution) } => Response::Bounce { restitution },
                ResponseSpec::Impulse { restitution } => Response::Impulse { restitution },
            },
            contact_stiffness: match dynamics.stiffness {
                ContactStiffnessSpec::AsFelt => ContactStiffness::AsFelt,
                ContactStiffnessSpec::ByMass { damping_ratio } => ContactStiffness::ByMass { damping_ratio },
                ContactStiffnessSpec::AsSaid { damping_ratio } => ContactStiffness::AsSaid { damping_ratio },
                ContactStiffnessSpec::Given { stiffness_n_per_m, damping_ratio } => {
                    ContactStiffness::Given { stiffness_n_per_m, damping_ratio }
                }
            },
            sleep: dynamics.sleep.then(Sleep::default),
            ..Settings::default()
        }
    }

    pub(crate) fn integrator(&self) -> Integrator {
        self.dynamics().integrator
    }

    /// Contacts between entities, as a run has them.
    pub(crate) fn contacts(&self, entities: &[Entity]) -> Contacts {
        let heaviest_kg = self.masses(entities).map(|(_, mass_kg)| mass_kg).fold(0.0, f64::max);
        self.dynamics().contacts(heaviest_kg)
    }

    pub(super) fn with_objects(
        &self,
        step: FastStep,
        bodies: &[(usize, Body)],
    ) -> Result<FastStep, RigError> {
        let (dynamics, settings) = (self.scene.dynamics, self.dynamics());
        // Which entity it is, is not told; the first that moves is named.
        let first = |source| no_body(&self.scene.entities[bodies[0].0], source);
        let hand: Vec<HandFinger> =
            self.scene.fingers.iter().map(|f| self.hand_finger(f)).collect::<Result<_, _>>()?;
        step.with_objects(bodies, settings, dynamics.lists, &hand, dynamics.grasp_quality).map_err(first)
    }

    fn hand_finger(&self, spec: &SceneFinger) -> Result<HandFinger, RigError> {
        let refused = |source| self.refused(None, format!("finger {}", spec.name), source);
        let soft = spec.soft.as_ref().map_or(Ok(SoftFinger::POINT), soft_finger).map_err(refused)?;
        let attachment = spec.attach.as_ref().map(attachment).transpose().map_err(refused)?;
        let settings = FingerSettings { soft, attachment };
        Ok(HandFinger { settings, button: spec.attach.map(|attach| attach.button) })
    }

    /// Says which entities pass through each other, because nobody finds where they touch.
    pub(super) fn tell_what_passes(&self, entities: &[Entity]) {
        for Passing { kind, names, through } in self.what_passes(entities) {
            say(format_args!(
                "phantom3: {names} ({kind}) passes through {}: contact points between such shapes are not found",
                through.join(", ")
            ));
        }
    }

    /// The same as data. Whether two can meet is a matter of their kinds (and of a mesh whether it is closed), so that
    /// ten thousand entities are some dozen questions.
    pub(crate) fn what_passes(&self, entities: &[Entity]) -> Vec<Passing> {
        let mut kinds: Vec<Kind<'_>> = Vec::new();
        for (index, (entity, spec)) in entities.iter().zip(&self.scene.entities).enumerate() {
            if entity.is_collidable {
                let is_body = spec.motion.is_some();
                let key = (collide::name(&entity.shape), can_move(&entity.shape), is_body, entity.space);
                match kinds.iter_mut().find(|kind| kind.key == key) {
                    Some(kind) => kind.members.push(index),
                    None => kinds.push(Kind { key, shape: &entity.shape, members: vec![index] }),
                }
            }
        }
        let passes = |a: &Kind<'_>, b: &Kind<'_>| {
            let alone = std::ptr::eq(a, b) && a.members.len() == 1;
            let is_elsewhere = a.key.3 != b.key.3;
            !(alone
                || is_elsewhere
                || is_collidable(a.shape, b.shape)
                || b.key.2 && is_collidable(b.shape, a.shape))
        };
        let passing = kinds.iter().filter(|a| a.key.2).filter_map(|a| {
            let through: Vec<String> =
                kinds.iter().filter(|b| passes(a, b)).map(|b| self.listed(&b.members)).collect();
            let kind = self.scene.entities[a.members[0]].shape.kind();
            let names = in_words(&self.names_of(&a.members).collect::<Vec<_>>());
            (!through.is_empty()).then_some(Passing { kind, names, through })
        });
        passing.collect()
    }

    /// Names and kinds of a few, and how many more there are.
    fn listed(&self, members: &[usize]) -> String {
        let kind = self.scene.entities[members[0]].shape.kind();
        let names = self.names_of(members).map(|name| format!("{name} ({kind})"));
        in_words(&names.collect::<Vec<_>>())
    }

    fn names_of(&self, members: &[usize]) -> impl Iterator<Item = &str> {
        members.iter().map(|&index| self.scene.entities[index].name.as_str())
    }
}

/// A few names, and how many more there are.
pub(crate) fn in_words<S: AsRef<str>>(names: &[S]) -> String {
    let few: Vec<&str> = names.iter().take(MOST_NAMED).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(MOST_NAMED) {
        0 => few.join(", "),
        more => format!("{} and {more} more", few.join(", ")),
    }
}

/// Entities that other ones let through.
#[derive(Debug, Clone, PartialEq)]
pub struct Passing {
    /// Of which shape they are.
    pub kind: &'static str,
    /// Who they are.
    pub names: String,
    /// Through whom they pass, with their kinds.
    pub through: Vec<String>,
}

/// Entities that are all alike for the question whether two can meet.
struct Kind<'e> {
    /// The shape's name, whether it could move, whether it does, and in which space.
    key: (&'static str, bool, bool, u32),
    shape: &'e Shape,
    members: Vec<usize>,
}

/// More names are no help.
const MOST_NAMED: usize = 8;

fn no_body(spec: &SceneEntity, source: BodyError) -> RigError {
    let what = format!("entity {}", spec.name);
    RigError::NoBody { file: spec.file.to_path_buf(), line: spec.line, what, source }
}

fn soft_finger(spec: &SoftSpec) -> Result<SoftFinger, ParameterError> {
    let usual = SoftFinger::default();
    let of = |name| TorsionModel::of_name(name).unwrap_or(TorsionModel::None);
    let mut model = match spec.model {
        SoftModelSpec::None => TorsionModel::None,
        SoftModelSpec::Coulomb { .. } => of("coulomb"),
        SoftModelSpec::Viscous { .. } => of("viscous"),
        SoftModelSpec::StickSlip { .. } => of("stick-slip"),
    };
    let set = |place: &mut f64, value: Option<f64>| *place = value.unwrap_or(*place);
    match (&mut model, spec.model) {
        (
            TorsionModel::Coulomb { pad_radius_m, limit_surface },
            SoftModelSpec::Coulomb { pad_radius_m: given, is_uncoupled },
        ) => {
            set(pad_radius_m, given);
            if is_uncoupled {
                *limit_surface = LimitSurface::Uncoupled;
            }
        }
        (
            TorsionModel::Viscous { critical_area_m2, damping_nm_s_per_rad },
            SoftModelSpec::Viscous { critical_area_m2: area, viscous_damping_n_m_s_per_rad: damping },
        ) => {
            set(critical_area_m2, area);
            set(damping_nm_s_per_rad, damping);
        }
        (
            TorsionModel::StickSlip {
                critical_area_at_rest_m2,
                critical_area_turning_m2,
                damping_nm_s_per_rad,
            },
            SoftModelSpec::StickSlip {
                critical_area_at_rest_m2: at_rest,
                critical_area_turning_m2: turning,
                viscous_damping_n_m_s_per_rad: damping,
            },
        ) => {
            set(critical_area_at_rest_m2, at_rest);
            // The usual share of the other, where only that is given.
            let share = *critical_area_turning_m2 / *critical_area_at_rest_m2;
            set(critical_area_turning_m2, turning.or(at_rest.map(|area| area * share)));
            set(damping_nm_s_per_rad, damping);
        }
        _ => {}
    }
    SoftFinger {
        model,
        stiffness_nm_per_rad: spec.stiffness_n_m_per_rad.unwrap_or(usual.stiffness_nm_per_rad),
        damping_nm_s_per_rad: spec.damping_n_m_s_per_rad.unwrap_or(usual.damping_nm_s_per_rad),
        normal_share: spec.normal_share.unwrap_or(usual.normal_share),
        gimbal_area_m2: spec.gimbal_area_m2.unwrap_or(usual.gimbal_area_m2),
    }
    .validated()
}

fn attachment(spec: &AttachSpec) -> Result<Attachment, ParameterError> {
    let usual = Attachment::default();
    Attachment {
        stiffness_n_per_m: spec.stiffness_n_per_m.unwrap_or(usual.stiffness_n_per_m),
        damping_n_s_per_m: spec.damping_n_s_per_m.unwrap_or(usual.damping_n_s_per_m),
        most_force_n: spec.most_force_n.unwrap_or(usual.most_force_n),
        orientation: match spec.orientation {
            AttachedOrientation::Free => HeldOrientation::Free,
            AttachedOrientation::Locked => HeldOrientation::Locked,
            AttachedOrientation::Gimbal => HeldOrientation::Gimbal,
        },
        stiffness_nm_per_rad: spec.stiffness_n_m_per_rad.unwrap_or(usual.stiffness_nm_per_rad),
        damping_nm_s_per_rad: spec.damping_n_m_s_per_rad.unwrap_or(usual.damping_nm_s_per_rad),
        most_torque_nm: spec.most_torque_n_m.unwrap_or(usual.most_torque_nm),
        fade_s: spec.fade_s.unwrap_or(usual.fade_s),
    }
    .validated()
}

fn body(entity: &Entity, motion: &MotionSpec) -> Result<Body, BodyError> {
    let mass = match (motion.mass, motion.inertia_kg_m2, motion.centre_of_mass_m) {
        // What is measured needs no volume.
        (MassSpec::Mass(mass_kg), Some(moments), Some(centre_m)) => {
            MassProperties::given(mass_kg, centre_m.into(), moments)?
        }
        (mass, moments, centre_m) => {
            let of_shape = match mass {
                MassSpec::Mass(mass_kg) => MassProperties::of_shape(&entity.shape, mass_kg),
                MassSpec::Density(density) => MassProperties::of_density(&entity.shape, density),
            }?;
            let turned = moments.map_or(Ok(of_shape), |moments| of_shape.with_inertia(moments))?;
            centre_m.map_or(turned, |centre_m| turned.with_centre(centre_m.into()))
        }
    };
    let body = Body::at_rest(mass.fitting(&entity.shape)?, &entity.X_WB);
    let body = if motion.rotation_locked { body.with_rotation_locked() } else { body };
    Ok(body.moving(motion.velocity_m_s, motion.angular_velocity_rad_s))
}
