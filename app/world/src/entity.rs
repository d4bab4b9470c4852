//! An entity of a scene: a shape somewhere in the world, and how it feels.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, Vector3};

use crate::dynamics;
use crate::effects::{MagnetismSpec, VibrationSpec};
use crate::error::SceneError;
use crate::faces::{FacesSpec, Usual};
use crate::friction::FrictionSpec;
use crate::grid::Grid;
use crate::height_map::HeightMapSpec;
use crate::material::read_material;
use crate::motion::{MassSpec, MotionSpec};
use crate::names::{Names, name_of};
use crate::pose::read_pose;
use crate::problems::Problems;
use crate::reader::{Bound, Table};
use crate::shading::ShadingSpec;
use crate::shape::ShapeSpec;
use crate::visual::VisualSpec;
use crate::vocabulary::Vocabulary;

/// One `[[entity]]`, or one of its grid: fixed in the world, or with a mass.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneEntity {
    /// Unique among the entities; default e0, e1, ... by position in the list.
    pub name: String,
    /// The file that its `[[entity]]` stands in, for messages.
    pub file: Arc<Path>,
    /// Where in that file; counted from 1.
    pub line: usize,
    /// What it is in the scene.
    pub kind: EntityKind,
    /// In the entity's frame B.
    pub shape: ShapeSpec,
    /// `X_WB`, the pose of the entity's frame in the world; default identity.
    pub pose: Isometry3<f64>,
    /// Normal force per depth; above 0, default [`SceneEntity::DEFAULT_STIFFNESS_N_PER_M`].
    pub stiffness_n_per_m: f64,
    /// It says that itself: it is neither the default nor a material's.
    pub is_stiffness_said: bool,
    /// Normal force per speed of approach; 0 or more, default 0, or [`MotionSpec::DEFAULT_DAMPING_N_S_PER_M`] if it moves.
    pub damping_n_s_per_m: f64,
    /// Default none.
    pub friction: FrictionSpec,
    /// Faces that are made of something else; of meshes alone.
    pub faces: Arc<[FacesSpec]>,
    /// Share of an approaching velocity that comes back, 0 to 1; default what the other entity, or the scene, says.
    pub restitution: Option<f64>,
    /// Of each point where another entity touches it \[N/m\], if it says.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Torque about the normal that its contacts resist, per normal force \[m\]; default
    /// [`SceneEntity::DEFAULT_TURNING_FRICTION_M`].
    pub torsional_friction_m: f64,
    /// The like across the normal.
    pub rolling_friction_m: f64,
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
    /// Whether fingers feel it; default yes.
    pub is_haptic: bool,
    /// Whether other entities collide with it; default yes.
    pub is_collidable: bool,
    /// What is seen of it; default what is felt.
    pub visuals: Arc<[VisualSpec]>,
    /// The environment behind whose door it is; default in the world outside.
    pub within: Option<String>,
}

/// What an entity is in the scene (Melder 7.2.6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EntityKind {
    /// A game object: one `[[entity]]`.
    Object,
    /// A part of an `[[environment]]`, which never moves.
    Environment,
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
    /// Torsional and rolling friction of what does not say it (m).
    pub const DEFAULT_TURNING_FRICTION_M: f64 = 2e-4;

    /// Reads the `[[entity]]` at position `i` of the list, laid over its template; a grid makes many of it.
    pub(crate) fn read_all<'d>(
        table: &Table<'d>,
        i: usize,
        names: &mut Names<'d>,
        problems: &mut Problems,
    ) -> Vec<Self> {
        problems.keys(table, &KEYS);
        let Some(grid) = problems.keep(Grid::read(table)) else { return Vec::new() };
        let Some(grid) = grid else {
            let name = problems.keep(names.claim(table, format!("e{i}")));
            return Self::read(table, name.unwrap_or_default(), None, problems).into_iter().collect();
        };
        let base = problems.keep(name_of(table)).flatten().unwrap_or_else(|| format!("e{i}"));
        let Some(first) = Self::read(table, base, None, problems) else { return Vec::new() };
        let mut item = |(place, offset_m): (String, Vector3<f64>)| {
            let name = format!("{}{place}", first.name);
            let name = problems.keep(names.claim_made(table, name, " (of the grid)"))?;
            let pose = Translation3::from(offset_m) * first.pose;
            Some(Self { name, pose, ..first.clone() })
        };
        // One refusal says it all.
        grid.places().map_while(&mut item).collect()
    }

    /// Reads what a table says of an entity: all of it, or all but the shape and where that is.
    pub(crate) fn read(
        table: &Table<'_>,
        name: String,
        given: Option<(ShapeSpec, Isometry3<f64>)>,
        problems: &mut Problems,
    ) -> Option<Self> {
        let made_of = problems.keep(read_material(table)).flatten();
        let motion = problems.keep(MotionSpec::read(table, made_of));
        let usual_damping = match motion {
            Some(Some(_)) => MotionSpec::DEFAULT_DAMPING_N_S_PER_M,
            _ => 0.0,
        };
        let damping = made_of.map_or(usual_damping, |made_of| made_of.damping_n_s_per_m);
        let stiffness = made_of.map_or(Self::DEFAULT_STIFFNESS_N_PER_M, |made_of| made_of.stiffness_n_per_m);
        let kind = if given.is_some() { EntityKind::Environment } else { EntityKind::Object };
        let (shape, pose) = match given {
            Some((shape, pose)) => (Some(shape), Some(pose)),
            None => (problems.keep(ShapeSpec::read(table)), problems.keep(read_pose(table))),
        };
        let stiffness = table.number_or("stiffness_n_per_m", Bound::Positive, stiffness);
        let truth = |key: &str| table.get(key).map_or(Ok(true), |value| value.truth());
        let stiffness_n_per_m = problems.keep(stiffness);
        let damping_n_s_per_m = match (&motion, stiffness_n_per_m) {
            (Some(motion), Some(stiffness)) => {
                problems.keep(read_damping(table, motion.as_ref(), stiffness, damping))
            }
            _ => None,
        };
        let friction = problems.keep(FrictionSpec::read(table, made_of));
        let restitution = problems.keep(dynamics::read_restitution(table));
        let contact_stiffness =
            table.get("contact_stiffness_n_per_m").map(|value| value.number(Bound::Positive)).transpose();
        let contact_stiffness_n_per_m = problems.keep(contact_stiffness);
        let turning = made_of.map_or(Self::DEFAULT_TURNING_FRICTION_M, |made_of| made_of.turning_friction_m);
        let length = |key: &str| table.number_or(key, Bound::NotNegative, turning);
        let [torsional_friction_m, rolling_friction_m] =
            ["torsional_friction_m", "rolling_friction_m"].map(|key| problems.keep(length(key)));
        let algorithm = problems.keep(AlgorithmSpec::read(table));
        let magnetism = problems.keep(MagnetismSpec::read(table));
        let vibration = problems.keep(VibrationSpec::read(table));
        let of_shape = shape.as_ref().map(|shape| {
            let shading = problems.keep(ShadingSpec::read(table, shape));
            let height_map = problems.keep(HeightMapSpec::read(table, shape));
            let faces = match (&friction, stiffness_n_per_m, damping_n_s_per_m) {
                (Some(friction), Some(stiffness_n_per_m), Some(damping_n_s_per_m)) => {
                    let usual = Usual { friction, stiffness_n_per_m, damping_n_s_per_m };
                    problems.keep(FacesSpec::read_all(table, shape, &usual))
                }
                _ => None,
            };
            (shading, height_map, faces)
        });
        let (is_haptic, is_collidable) = (problems.keep(truth("haptic")), problems.keep(truth("collidable")));
        let visuals = problems.keep(VisualSpec::read_all(table));
        let within = problems.keep(read_within(table));
        let (shading, height_map, faces) = of_shape?;
        Some(Self {
            name,
            file: table.document().file().into(),
            line: table.document().line(table.offset()),
            kind,
            shape: shape?,
            pose: pose?,
            stiffness_n_per_m: stiffness_n_per_m?,
            damping_n_s_per_m: damping_n_s_per_m?,
            friction: friction?,
            faces: faces?.into(),
            restitution: restitution?,
            is_stiffness_said: table.get("stiffness_n_per_m").is_some(),
            contact_stiffness_n_per_m: contact_stiffness_n_per_m?,
            torsional_friction_m: torsional_friction_m?,
            rolling_friction_m: rolling_friction_m?,
            algorithm: algorithm?,
            material: made_of.map(|made_of| made_of.name),
            magnetism: magnetism?,
            vibration: vibration?,
            shading: shading?,
            height_map: height_map?,
            motion: motion?,
            is_haptic: is_haptic?,
            is_collidable: is_collidable?,
            visuals: visuals?.into(),
            within: within?,
        })
    }

    /// Whether fingers or other entities meet it; if neither do, it is only seen.
    pub fn is_met(&self) -> bool {
        self.is_haptic || self.is_collidable
    }

    /// Checks a template, which may leave out the shape.
    pub(crate) fn check_template(table: &Table<'_>, problems: &mut Problems) {
        problems.keys(table, &KEYS);
        problems.keep(Grid::read(table));
        if table.get("shape").is_some() {
            Self::read(table, String::new(), None, problems);
        }
    }
}

/// Damping (N s/m): as it is said, or a ratio to the critical one `2 sqrt(k m)` of its stiffness and mass, or the usual one.
fn read_damping(
    table: &Table<'_>,
    motion: Option<&MotionSpec>,
    stiffness_n_per_m: f64,
    usual_n_s_per_m: f64,
) -> Result<f64, SceneError> {
    let Some(value) = table.get("damping_ratio") else {
        return table.number_or("damping_n_s_per_m", Bound::NotNegative, usual_n_s_per_m);
    };
    if table.get("damping_n_s_per_m").is_some() {
        return Err(value.out_of_range("either `damping_ratio` or `damping_n_s_per_m`, not both"));
    }
    let ratio = value.number(Bound::NotNegative)?;
    if ratio > 1.0 {
        return Err(value.out_of_range("a number from 0 to 1"));
    }
    match motion.map(|motion| motion.mass) {
        Some(MassSpec::Mass(mass_kg)) => Ok(2.0 * ratio * (stiffness_n_per_m * mass_kg).sqrt()),
        _ => {
            Err(table.missing("mass_kg", "a number above 0: a `damping_ratio` is one of stiffness and mass"))
        }
    }
}

pub(crate) fn read_within(table: &Table<'_>) -> Result<Option<String>, SceneError> {
    let Some(value) = table.get("within") else { return Ok(None) };
    value.text("the name of an [[environment]] with a door").map(|name| Some(name.to_owned()))
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
        "damping_ratio",
        "friction",
        "faces",
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
        "contact_stiffness_n_per_m",
        "torsional_friction_m",
        "rolling_friction_m",
        "haptic",
        "collidable",
        "visual",
        "template",
        "grid",
        "within",
    ],
    later: &[],
};
