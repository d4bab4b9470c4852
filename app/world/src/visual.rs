//! What an entity looks like, which need not be what it feels like (Melder 7.1.1, 7.2.4).
//!
//! ```toml
//! visual = { shape = { kind = "mesh", file = "fine.obj" }, colour = [0.7, 0.0, 0.0] }
//! visual = { colour = [0.7, 0.0, 0.0, 0.25] }      # what is felt, in this colour, three quarters see-through
//! visual = [{ shape = ... }, { shape = ..., position_m = [0.0, 0.1, 0.0] }]
//! visual = false                                   # felt, and not seen
//! ```
//! The crate `view` draws it.

use nalgebra::Isometry3;

use crate::colour::read_colour;
use crate::error::SceneError;
use crate::pose::read_pose;
use crate::reader::{Table, Value};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// Something to be seen of an entity.
#[derive(Debug, Clone, PartialEq)]
pub struct VisualSpec {
    /// In its own frame; `None`: the shape that is felt.
    pub shape: Option<ShapeSpec>,
    /// Its frame in the entity's; default the same.
    pub pose: Isometry3<f64>,
    /// Red, green, blue and opacity, 0 to 1; `None`: nothing was said, and it is as [`VisualSpec::DEFAULT_COLOUR`] unless
    /// things are to be told apart.
    pub colour: Option<[f64; 4]>,
    /// Default yes.
    pub casts_shadow: bool,
}

impl Default for VisualSpec {
    fn default() -> Self {
        Self { shape: None, pose: Isometry3::identity(), colour: None, casts_shadow: true }
    }
}

impl VisualSpec {
    /// A light grey.
    pub const DEFAULT_COLOUR: [f64; 4] = [0.8, 0.8, 0.8, 1.0];

    /// Of an entity; without such a key what is felt is seen.
    pub(crate) fn read_all(entity: &Table<'_>) -> Result<Vec<Self>, SceneError> {
        let Some(value) = entity.get("visual") else { return Ok(vec![Self::default()]) };
        match value.truth_if_any() {
            Some(false) => Ok(Vec::new()),
            Some(true) => Ok(vec![Self::default()]),
            None if value.is_list() => value.items(ALLOWED)?.iter().map(Self::read).collect(),
            None => Ok(vec![Self::read(&value)?]),
        }
    }

    fn read(value: &Value<'_>) -> Result<Self, SceneError> {
        let table = value.table(ALLOWED)?;
        table.check_keys(&KEYS)?;
        let shape = table.get("shape").map(|_| ShapeSpec::read(&table)).transpose()?;
        Ok(Self {
            shape,
            pose: read_pose(&table)?,
            colour: table.get("colour").map(|value| read_colour(&value)).transpose()?,
            casts_shadow: table.get("casts_shadow").map_or(Ok(true), |value| value.truth())?,
        })
    }
}

const ALLOWED: &str = "false, a table such as { colour = [0.7, 0.0, 0.0] }, or an array of such tables";
const KEYS: Vocabulary = Vocabulary {
    available: &["shape", "position_m", "orientation_wxyz", "colour", "casts_shadow"],
    later: &[],
};
