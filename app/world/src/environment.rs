//! Environments: what a scene takes place in, always fixed (Melder 7.2.6).
//!
//! ```toml
//! [[environment]]
//! name = "room"
//! kind = "room"                          # six walls that face inwards; or plane, mesh, mixed
//! size_m = [0.6, 0.4, 0.6]
//! material = "wood"                      # of all its parts
//! floor = { material = "rubber" }        # what differs
//! ceiling = false                        # left out
//! ```
//! An environment is short for fixed entities, which are called by its name and theirs: `room_floor`.
//!
//! One with a `door` is behind it: only who went in through the door feels it and what is `within` it, and nothing else.
//! So it may be larger than the hull that has the door: the thesis' TARDIS (Melder ch. 7).

use nalgebra::{Isometry3, Unit, Vector3};

use crate::entity::SceneEntity;
use crate::error::SceneError;
use crate::names::Names;
use crate::pose::{read_direction, read_pose};
use crate::problems::Problems;
use crate::reader::{Bound, Table, Value};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// One `[[environment]]`. Its parts are entities of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneEnvironment {
    /// Unique among the environments; default environment0, environment1, ... by position in the list.
    pub name: String,
    /// How it is made.
    pub kind: EnvironmentKind,
    /// The names of its entities.
    pub parts: Vec<String>,
    /// Through which it is entered; `None`: it is the world's.
    pub door: Option<DoorSpec>,
}

/// How an environment is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EnvironmentKind {
    /// A ground.
    Plane,
    /// Up to six walls that face inwards.
    Room,
    /// A mesh, felt from both sides.
    Mesh,
    /// Parts of any shape.
    Mixed,
}

/// An opening in an entity.
#[derive(Debug, Clone, PartialEq)]
pub struct DoorSpec {
    /// The entity that has it.
    pub of: String,
    /// The opening's frame in the entity's: it lies around the origin across z, which leads out.
    pub pose: Isometry3<f64>,
    /// Its width along x and height along y (m).
    pub size_m: [f64; 2],
}

impl EnvironmentKind {
    /// Its name in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Room => "room",
            Self::Mesh => "mesh",
            Self::Mixed => "mixed",
        }
    }
}

impl SceneEnvironment {
    /// Reads the `[[environment]]` at position `i` of the list; its entities go to `entities`.
    pub(crate) fn read<'d>(
        table: &Table<'d>,
        i: usize,
        names: (&mut Names<'d>, &mut Names<'d>),
        entities: &mut Vec<SceneEntity>,
        problems: &mut Problems,
    ) -> Option<Self> {
        let (own_names, entity_names) = names;
        let (kind, keys) = problems.keep(read_kind(table))?;
        problems.keys(table, keys);
        let name = problems.keep(own_names.claim(table, format!("environment{i}")))?;
        let pose = problems.keep(read_pose(table))?;
        let parts = problems.keep(parts_of(table, kind, &pose))?;
        let door = problems.keep(DoorSpec::read(table))?;
        let mut environment = Self { name, kind, parts: Vec::new(), door };
        for part in parts {
            let called = part
                .suffix
                .map_or(environment.name.clone(), |suffix| format!("{}_{suffix}", environment.name));
            let claimed = entity_names.claim_made(&part.table, called, " (of an environment)");
            let Some(called) = problems.keep(claimed) else { continue };
            let given = Some((part.shape, part.pose));
            let Some(mut entity) = SceneEntity::read(&part.table, called.clone(), given, problems) else {
                continue;
            };
            entity.within = environment.door.as_ref().map(|_| environment.name.clone());
            environment.parts.push(called);
            entities.push(entity);
        }
        Some(environment)
    }
}

fn read_kind(table: &Table<'_>) -> Result<(EnvironmentKind, &'static Vocabulary), SceneError> {
    Ok(match table.require("kind", KINDS.list())?.choose("environment", &KINDS)? {
        "plane" => (EnvironmentKind::Plane, &PLANE_KEYS),
        "room" => (EnvironmentKind::Room, &ROOM_KEYS),
        "mesh" => (EnvironmentKind::Mesh, &MESH_KEYS),
        _ => (EnvironmentKind::Mixed, &MIXED_KEYS),
    })
}

/// A part that becomes an entity: what its table says over what the environment's says.
struct Part<'d> {
    table: Table<'d>,
    /// Behind the environment's name; `None`: it is called the same.
    suffix: Option<String>,
    shape: ShapeSpec,
    /// In the world.
    pose: Isometry3<f64>,
}

fn parts_of<'d>(
    table: &Table<'d>,
    kind: EnvironmentKind,
    pose: &Isometry3<f64>,
) -> Result<Vec<Part<'d>>, SceneError> {
    let whole = |shape| vec![Part { table: table.clone(), suffix: None, shape, pose: *pose }];
    match kind {
        EnvironmentKind::Plane => Ok(whole(ShapeSpec::read_ground(table)?)),
        EnvironmentKind::Mesh => Ok(whole(ShapeSpec::read_hollow_mesh(table)?)),
        EnvironmentKind::Room => walls(table, pose),
        EnvironmentKind::Mixed => mixed(table, pose),
    }
}

/// Half-spaces: nobody falls through one, however fast.
fn walls<'d>(table: &Table<'d>, pose: &Isometry3<f64>) -> Result<Vec<Part<'d>>, SceneError> {
    let size: [f64; 3] = table.require("size_m", SIZE)?.numbers_in(Bound::Positive)?;
    let mut parts = Vec::new();
    for (wall, axis, sign) in WALLS {
        let own = match table.get(wall) {
            Some(value) if value.truth_if_any() == Some(false) => continue,
            Some(value) if value.truth_if_any() == Some(true) => table.clone(),
            Some(value) => surface_of(&value, table)?,
            None => table.clone(),
        };
        let mut normal = Vector3::zeros();
        normal[axis] = sign;
        let shape = ShapeSpec::Plane { normal: Unit::new_unchecked(normal), offset_m: -0.5 * size[axis] };
        parts.push(Part { table: own, suffix: Some(wall.into()), shape, pose: *pose });
    }
    Ok(parts)
}

fn surface_of<'d>(value: &Value<'d>, environment: &Table<'d>) -> Result<Table<'d>, SceneError> {
    let own = value.table("false, or a table of what differs, such as { material = \"rubber\" }")?;
    own.check_keys(&WALL_KEYS)?;
    Ok(own.over(environment.clone()))
}

fn mixed<'d>(table: &Table<'d>, pose: &Isometry3<f64>) -> Result<Vec<Part<'d>>, SceneError> {
    let parts = table.require("part", PARTS)?.tables("environment.part")?;
    let part = |(i, own): (usize, &Table<'d>)| {
        own.check_keys(&PART_KEYS)?;
        let (shape, own_pose) = (ShapeSpec::read(own)?, read_pose(own)?);
        let suffix = crate::names::name_of(own)?.unwrap_or_else(|| i.to_string());
        let table = own.clone().over(table.clone());
        Ok(Part { table, suffix: Some(suffix), shape, pose: pose * own_pose })
    };
    parts.iter().enumerate().map(part).collect()
}

impl DoorSpec {
    fn read(environment: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = environment.get("door") else { return Ok(None) };
        let table = value.table(DOOR)?;
        table.check_keys(&DOOR_KEYS)?;
        let of = table.require("of", "the name of the entity that has the door")?;
        let size = table.require("size_m", "an array of 2 numbers above 0, width and height")?;
        Ok(Some(Self {
            of: of.text("the name of the entity that has the door")?.to_owned(),
            pose: read_pose(&table)?,
            size_m: size.numbers_in(Bound::Positive)?,
        }))
    }
}

impl ShapeSpec {
    /// That of an environment which is a plane: level at the height 0 unless it says otherwise.
    fn read_ground(table: &Table<'_>) -> Result<Self, SceneError> {
        let normal = match table.get("normal") {
            Some(value) => read_direction(&value)?.0,
            None => Vector3::y_axis(),
        };
        Ok(Self::Plane { normal, offset_m: table.number_or("offset_m", Bound::Any, 0.0)? })
    }
}

/// Wall, axis of its normal and where that points: inwards.
const WALLS: [(&str, usize, f64); 6] = [
    ("floor", 1, 1.0),
    ("ceiling", 1, -1.0),
    ("left", 0, 1.0),
    ("right", 0, -1.0),
    ("back", 2, 1.0),
    ("front", 2, -1.0),
];
const SIZE: &str = "an array of 3 numbers above 0, the inner size of the room";
const PARTS: &str = "tables with a `shape` each, under [[environment.part]]";
const DOOR: &str = "a table such as { of = \"hull\", position_m = [0.0, 0.0, 0.05], size_m = [0.04, 0.06] }";
const DOOR_KEYS: Vocabulary =
    Vocabulary { available: &["of", "position_m", "orientation_wxyz", "size_m"], later: &[] };
const KINDS: Vocabulary = Vocabulary { available: &["plane", "room", "mesh", "mixed"], later: &[] };

/// Lists of keys with those of every surface.
macro_rules! with_surface {
    ($($key:literal),* $(,)?) => {
        Vocabulary {
            available: &[
                $($key,)*
                "stiffness_n_per_m",
                "damping_n_s_per_m",
                "friction",
                "restitution",
                "contact_stiffness_n_per_m",
                "torsional_friction_m",
                "rolling_friction_m",
                "algorithm",
                "material",
                "shading",
                "height_map",
                "magnetism",
                "vibration",
                "haptic",
                "collidable",
                "visual",
            ],
            later: &[],
        }
    };
}

const WALL_KEYS: Vocabulary = with_surface!();
const PART_KEYS: Vocabulary = with_surface!("name", "shape", "position_m", "orientation_wxyz");
const PLANE_KEYS: Vocabulary =
    with_surface!("name", "kind", "normal", "offset_m", "position_m", "orientation_wxyz", "door");
const MESH_KEYS: Vocabulary =
    with_surface!("name", "kind", "file", "scale", "position_m", "orientation_wxyz", "door");
const MIXED_KEYS: Vocabulary =
    with_surface!("name", "kind", "part", "position_m", "orientation_wxyz", "door");
const ROOM_KEYS: Vocabulary = with_surface!(
    "name",
    "kind",
    "size_m",
    "floor",
    "ceiling",
    "left",
    "right",
    "back",
    "front",
    "position_m",
    "orientation_wxyz",
    "door",
);
