//! Whether an entity's facets feel smooth.

use crate::error::SceneError;
use crate::reader::{Bound, Table, Value};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// A way to shade with its numbers, as the scene file gives it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum ShadingSpec {
    /// Facets feel as they are.
    #[default]
    None,
    /// Round all over. Of meshes only.
    Interpolated {
        /// Edges sharper than this stay sharp (degrees); 0 to 180.
        crease_angle_deg: f64,
        /// What becomes of the force.
        form: ShadingFormSpec,
    },
    /// Flat but towards edges. Of meshes and boxes.
    Regions {
        /// How far from an edge (m); above 0.
        length_m: f64,
        /// Edges sharper than this stay sharp (degrees); 0 to 180.
        crease_angle_deg: f64,
        /// What becomes of the force.
        form: ShadingFormSpec,
    },
}

/// How a force is turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum ShadingFormSpec {
    /// As far as the shaded normal.
    #[default]
    Rotate,
    /// Half way, as the thesis prints it; to compare with.
    Bisect,
}

impl ShadingSpec {
    /// Of interpolated normals, if none is given: between the edges of a tessellated curve and those of a box.
    pub const DEFAULT_CREASE_ANGLE_DEG: f64 = 40.0;
    /// Of regions, if none is given: none stays sharp.
    pub const NO_CREASE_ANGLE_DEG: f64 = 180.0;
    /// Of regions, if none is given: about what a fingertip tells apart.
    pub const DEFAULT_LENGTH_M: f64 = 0.002;

    /// Reads the `shading` of an entity of this shape; none if there is no such key.
    pub(crate) fn read(entity: &Table<'_>, shape: &ShapeSpec) -> Result<Self, SceneError> {
        let Some(value) = entity.get("shading") else { return Ok(Self::None) };
        let table = value.table(EXAMPLE)?;
        let kind_value = table.require("kind", KINDS.list())?;
        let kind = kind_value.choose("shading kind", &KINDS)?;
        table.check_keys(match kind {
            "interpolated" => &INTERPOLATED_KEYS,
            "regions" => &REGIONS_KEYS,
            _ => &NONE_KEYS,
        })?;
        check_shape(kind, &kind_value, shape)?;
        Ok(match kind {
            "interpolated" => Self::Interpolated {
                crease_angle_deg: read_crease(&table, Self::DEFAULT_CREASE_ANGLE_DEG)?,
                form: read_form(&table)?,
            },
            "regions" => Self::Regions {
                length_m: table.number_or("length_m", Bound::Positive, Self::DEFAULT_LENGTH_M)?,
                crease_angle_deg: read_crease(&table, Self::NO_CREASE_ANGLE_DEG)?,
                form: read_form(&table)?,
            },
            _ => Self::None,
        })
    }
}

/// What is round has no facets, and would silently feel as before.
fn check_shape(kind: &str, kind_value: &Value<'_>, shape: &ShapeSpec) -> Result<(), SceneError> {
    let is_fit =
        matches!((kind, shape), ("none", _) | (_, ShapeSpec::Mesh(_)) | ("regions", ShapeSpec::Box { .. }));
    if is_fit {
        return Ok(());
    }
    let scaled = if matches!(shape, ShapeSpec::Scaled { .. }) { "scaled " } else { "" };
    Err(kind_value.out_of_range(format!(
        "interpolated or regions on a mesh, regions on a box without scale; this is a {scaled}{}",
        shape.kind()
    )))
}

fn read_crease(table: &Table<'_>, default_deg: f64) -> Result<f64, SceneError> {
    let crease_angle_deg = table.number_or("crease_angle_deg", Bound::NotNegative, default_deg)?;
    if crease_angle_deg > 180.0 {
        return Err(table.require("crease_angle_deg", "")?.out_of_range("a number from 0 to 180"));
    }
    Ok(crease_angle_deg)
}

fn read_form(table: &Table<'_>) -> Result<ShadingFormSpec, SceneError> {
    let Some(value) = table.get("form") else { return Ok(ShadingFormSpec::default()) };
    Ok(match value.choose("shading form", &FORMS)? {
        "bisect" => ShadingFormSpec::Bisect,
        _ => ShadingFormSpec::Rotate,
    })
}

const fn words(available: &'static [&'static str]) -> Vocabulary {
    Vocabulary { available, later: &[] }
}

const KINDS: Vocabulary = words(&["none", "interpolated", "regions"]);
const FORMS: Vocabulary = words(&["rotate", "bisect"]);
const NONE_KEYS: Vocabulary = words(&["kind"]);
const INTERPOLATED_KEYS: Vocabulary = words(&["kind", "crease_angle_deg", "form"]);
const REGIONS_KEYS: Vocabulary = words(&["kind", "length_m", "crease_angle_deg", "form"]);
const EXAMPLE: &str = "a table such as { kind = \"interpolated\" }";
