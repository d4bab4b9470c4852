//! A force field of a scene: what it does, and where.

use nalgebra::{Isometry3, Vector3};

use crate::error::SceneError;
use crate::pose::read_pose;
use crate::reader::{Bound, Table};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// The most fields of a scene.
pub const MAX_FIELDS: usize = 64;

/// One `[[field]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldSpec {
    /// Where its `[[field]]` stands in the file, for messages; counted from 1.
    pub line: usize,
    /// What it does.
    pub kind: FieldKindSpec,
    /// Within which shape, in the field's frame B; `None`: everywhere.
    pub shape: Option<ShapeSpec>,
    /// `X_WB`; default identity.
    pub pose: Isometry3<f64>,
    /// Width of the rim over which it fades (m); above 0.
    pub rim_m: f64,
    /// Mass of the device at its tip (kg), for the limits; above 0.
    pub device_mass_kg: f64,
}

/// What a field does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FieldKindSpec {
    /// A force against the velocity.
    Viscous {
        /// Along each axis of B; 0 or more.
        damping_n_s_per_m: [f64; 3],
    },
    /// A force against the acceleration.
    Inertial {
        /// 0 or more.
        mass_kg: f64,
        /// Corner of the filter of the acceleration; above 0.
        cutoff_hz: f64,
    },
    /// Always the same force.
    Constant {
        /// On the user, world frame.
        force_n: Vector3<f64>,
    },
}

impl FieldSpec {
    /// Reads all `[[field]]`s of a scene.
    pub(crate) fn read_all(scene: &Table<'_>) -> Result<Vec<Self>, SceneError> {
        scene.tables_up_to(MAX_FIELDS, "field")?.iter().map(Self::read).collect()
    }

    fn read(table: &Table<'_>) -> Result<Self, SceneError> {
        let kind = table.require("kind", KINDS.list())?.choose("field kind", &KINDS)?;
        let (keys, read): (_, Read) = match kind {
            "viscous" => (VISCOUS_KEYS, read_viscous),
            "inertial" => (INERTIAL_KEYS, read_inertial),
            _ => (CONSTANT_KEYS, read_constant),
        };
        table.check_keys(&keys)?;
        let mass = haptics::Limits::DEFAULT_DEVICE_MASS_KG;
        Ok(Self {
            line: table.document().line(table.offset()),
            kind: read(table)?,
            shape: read_shape(table)?,
            pose: read_pose(table)?,
            rim_m: table.number_or("rim_m", Bound::Positive, haptics::Region::DEFAULT_RIM_M)?,
            device_mass_kg: table.number_or("device_mass_kg", Bound::Positive, mass)?,
        })
    }
}

type Read = fn(&Table<'_>) -> Result<FieldKindSpec, SceneError>;

fn read_viscous(table: &Table<'_>) -> Result<FieldKindSpec, SceneError> {
    let value = table.require("damping_n_s_per_m", DAMPING)?;
    Ok(FieldKindSpec::Viscous { damping_n_s_per_m: value.along_axes(Bound::NotNegative)? })
}

fn read_inertial(table: &Table<'_>) -> Result<FieldKindSpec, SceneError> {
    let mass_kg = table.number("mass_kg", Bound::NotNegative)?;
    let cutoff_hz = table.number_or("cutoff_hz", Bound::Positive, haptics::Field::DEFAULT_CUTOFF_HZ)?;
    Ok(FieldKindSpec::Inertial { mass_kg, cutoff_hz })
}

fn read_constant(table: &Table<'_>) -> Result<FieldKindSpec, SceneError> {
    let force: [f64; 3] = table.require("force_n", "an array of 3 numbers")?.numbers()?;
    Ok(FieldKindSpec::Constant { force_n: force.into() })
}

/// How deep a point is in it must be known without a search.
fn read_shape(table: &Table<'_>) -> Result<Option<ShapeSpec>, SceneError> {
    if table.get("shape").is_none() {
        return Ok(None);
    }
    let shape = ShapeSpec::read(table)?;
    if shape.is_closed_form() {
        return Ok(Some(shape));
    }
    let kind = table.require("shape", "")?;
    Err(kind.out_of_range("a shape with a closed form, such as { kind = \"box\", size_m = [0.1, 0.1, 0.1] }"))
}

const DAMPING: &str = "a number, 0 or more, or an array of 3 numbers, 0 or more";
const KINDS: Vocabulary = Vocabulary { available: &["viscous", "inertial", "constant"], later: &[] };
const VISCOUS_KEYS: Vocabulary = Vocabulary {
    available: &[
        "kind",
        "damping_n_s_per_m",
        "shape",
        "position_m",
        "orientation_wxyz",
        "rim_m",
        "device_mass_kg",
    ],
    later: &[],
};
const INERTIAL_KEYS: Vocabulary = Vocabulary {
    available: &[
        "kind",
        "mass_kg",
        "cutoff_hz",
        "shape",
        "position_m",
        "orientation_wxyz",
        "rim_m",
        "device_mass_kg",
    ],
    later: &[],
};
const CONSTANT_KEYS: Vocabulary = Vocabulary {
    available: &["kind", "force_n", "shape", "position_m", "orientation_wxyz", "rim_m"],
    later: &[],
};
