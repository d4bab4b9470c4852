//! An entity of a scene: a shape somewhere in the world, and how it feels.

use nalgebra::Isometry3;

use crate::dynamics::ResponseSpec;
use crate::effects::{MagnetismSpec, VibrationSpec};
use crate::error::SceneError;
use crate::friction::FrictionSpec;
use crate::height_map::HeightMapSpec;
use crate::material::read_material;
use crate::motion::MotionSpec;
use crate::names::Names;
use crate::pose::read_pose;
use crate::reader::{Bound, Table};
use crate::shading::ShadingSpec;
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// One `[[entity]]`: fixed in the world, or with a mass.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneEntity {
    /// Unique among the entities; default e0, e1, ... by position in the list.
    pub name: String,
    /// Where its `[[entity]]` stands in the file, for messages; counted from 1.
    pub line: usize,
    /// In the entity's frame B.
    pub shape: ShapeSpec,
    /// `X_WB`, the pose of the entity's frame in the world; default identity.
    pub pose: Isometry3<f64>,
    /// Normal force per depth; above 0, default [`SceneEntity::DEFAULT_STIFFNESS_N_PER_M`].
    pub stiffness_n_per_m: f64,
    /// Normal force per speed of approach; 0 or more, default 0, or [`MotionSpec::DEFAULT_DAMPING_N_S_PER_M`] if it moves.
    pub damping_n_s_per_m: f64,
    /// Default none.
    pub friction: FrictionSpec,
    /// Share of an approaching velocity that comes back, 0 to 1; default what the other entity, or the scene, says.
    pub restitution: Option<f64>,
    /// Default the Friction Cone Algorithm.
    pub algorithm: AlgorithmSpec,
    /// What it is made of, if the scene says; it gave the values that the scene did not.
    pub material: Option<&'static str>,
    /// How it attracts fingers that are near.
    pub magnetism: Option<MagnetismSpec>,
    /// How it hums while it is touched.
    pub vibration: Option<VibrationSpec>,
    /// Default none.
    pub shading: ShadingSpec,
    /// Default none.
    pub height_map: Option<HeightMapSpec>,
    /// How it moves; default it is fixed.
    pub motion: Option<MotionSpec>,
}

/// What works out the force of contacts with an entity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum AlgorithmSpec {
    /// The Friction Cone Algorithm.
    #[default]
    FrictionCone,
    /// A force along the way to the nearest point of the surface, as haptics began; to compare with.
    VectorField,
    /// The god-object without friction; to compare with.
    ClassicGodObject,
}

impl SceneEntity {
    /// Stiffness of an entity that gives none: firm to the touch, and well inside what a desktop
    /// device renders stably at 1 kHz with a tick of delay.
    pub const DEFAULT_STIFFNESS_N_PER_M: f64 = 1000.0;

    /// Reads the `[[entity]]` at position `i` of the list.
    pub(crate) fn read(
        table: &Table<'_>,
        i: usize,
        names: &mut Names,
        response: ResponseSpec,
    ) -> Result<Self, SceneError> {
        table.check_keys(&KEYS)?;
        let material = read_material(table)?;
        let stiffness_default =
            material.map_or(Self::DEFAULT_STIFFNESS_N_PER_M, |made_of| made_of.stiffness_n_per_m);
        let motion = MotionSpec::read(table, material)?;
        let usual_damping = if motion.is_some() { MotionSpec::DEFAULT_DAMPING_N_S_PER_M } else { 0.0 };
        let damping_default = material.map_or(usual_damping, |made_of| made_of.damping_n_s_per_m);
        let name = names.claim(table, format!("e{i}"))?;
        let shape = ShapeSpec::read(table)?;
        Ok(Self {
            name,
            line: table.document().line(table.offset()),
            pose: read_pose(table)?,
            stiffness_n_per_m: table.number_or("stiffness_n_per_m", Bound::Positive, stiffness_default)?,
            damping_n_s_per_m: table.number_or("damping_n_s_per_m", Bound::NotNegative, damping_default)?,
            friction: FrictionSpec::read(table, material)?,
            restitution: response.read_restitution(table)?,
            algorithm: AlgorithmSpec::read(table)?,
            material: material.map(|made_of| made_of.name),
            magnetism: MagnetismSpec::read(table)?,
            vibration: VibrationSpec::read(table)?,
            shading: ShadingSpec::read(table, &shape)?,
            height_map: HeightMapSpec::read(table, &shape)?,
            motion,
            shape,
        })
    }
}

impl AlgorithmSpec {
    fn read(entity: &Table<'_>) -> Result<Self, SceneError> {
        let Some(value) = entity.get("algorithm") else { return Ok(Self::default()) };
        Ok(match value.choose("algorithm", &ALGORITHMS)? {
            "vector-field" => Self::VectorField,
            "classic" => Self::ClassicGodObject,
            _ => Self::FrictionCone,
        })
    }
}

const ALGORITHMS: Vocabulary =
    Vocabulary { available: &["friction-cone", "vector-field", "classic"], later: &[] };

const KEYS: Vocabulary = Vocabulary {
    available: &[
        "name",
        "shape",
        "position_m",
        "orientation_wxyz",
        "stiffness_n_per_m",
        "damping_n_s_per_m",
        "friction",
        "algorithm",
        "material",
        "shading",
        "height_map",
        "magnetism",
        "vibration",
        "movable",
        "mass_kg",
        "density_kg_m3",
        "inertia_kg_m2",
        "centre_of_mass_m",
        "velocity_m_s",
        "angular_velocity_rad_s",
        "rotation_locked",
        "restitution",
    ],
    later: &[],
};
