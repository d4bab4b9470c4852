//! Lights (Melder 7.2.6, the Light Entity). The crate `view` draws by them.

use nalgebra::{Point3, Unit, Vector3};

use crate::colour::read_light_colour;
use crate::error::SceneError;
use crate::names::Names;
use crate::pose::read_direction;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// One `[[light]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLight {
    /// Unique among the lights; default l0, l1, ... by position in the list.
    pub name: String,
    /// From where it shines.
    pub kind: LightKind,
    /// Red, green and blue on surfaces that face it, 0 to 1; default white.
    pub diffuse: [f64; 3],
    /// In reflections; default as `diffuse`.
    pub specular: [f64; 3],
    /// Everywhere; default black, of an ambient light white.
    pub ambient: [f64; 3],
    /// Whether what it shines on casts a shadow; default yes, of an ambient light no.
    pub casts_shadow: bool,
}

/// From where a light shines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// From everywhere alike.
    Ambient,
    /// From very far away.
    Directional {
        /// The way that the light goes, in the world.
        direction: Unit<Vector3<f64>>,
    },
    /// From a place.
    Point {
        /// In the world (m).
        position_m: Point3<f64>,
        /// `1 / (a + b d + c d^2)` of it is left at the distance d: a, b (1/m), c (1/m^2); default 1, 0, 0.
        attenuation: [f64; 3],
    },
}

impl SceneLight {
    /// Reads the `[[light]]` at position `i` of the list.
    pub(crate) fn read<'d>(table: &Table<'d>, i: usize, names: &mut Names<'d>) -> Result<Self, SceneError> {
        let kind_value = table.require("kind", KINDS.list())?;
        let kind = kind_value.choose("light", &KINDS)?;
        table.check_keys(match kind {
            "point" => &POINT_KEYS,
            "directional" => &DIRECTIONAL_KEYS,
            _ => &AMBIENT_KEYS,
        })?;
        let colour = |key: &str, usual| match table.get(key) {
            Some(value) => read_light_colour(&value),
            None => Ok(usual),
        };
        let is_ambient = kind == "ambient";
        let diffuse = colour("diffuse", if is_ambient { BLACK } else { WHITE })?;
        Ok(Self {
            name: names.claim(table, format!("l{i}"))?,
            kind: read_kind(table, kind)?,
            diffuse,
            specular: colour("specular", diffuse)?,
            ambient: colour("ambient", if is_ambient { WHITE } else { BLACK })?,
            casts_shadow: table.get("casts_shadow").map_or(Ok(!is_ambient), |value| value.truth())?,
        })
    }
}

fn read_kind(table: &Table<'_>, kind: &str) -> Result<LightKind, SceneError> {
    Ok(match kind {
        "directional" => {
            let (direction, _) = read_direction(&table.require("direction", "an array of 3 numbers")?)?;
            LightKind::Directional { direction }
        }
        "point" => LightKind::Point {
            position_m: table.numbers_or("position_m", [0.0; 3])?.into(),
            attenuation: read_attenuation(table)?,
        },
        _ => LightKind::Ambient,
    })
}

/// Light is divided by it, at every distance.
fn read_attenuation(table: &Table<'_>) -> Result<[f64; 3], SceneError> {
    let Some(value) = table.get("attenuation") else { return Ok([1.0, 0.0, 0.0]) };
    let attenuation: [f64; 3] = value.numbers_in(Bound::NotNegative)?;
    if attenuation[0] > 0.0 {
        return Ok(attenuation);
    }
    Err(value.out_of_range("an array of 3 numbers, 0 or more, the first above 0"))
}

const WHITE: [f64; 3] = [1.0; 3];
const BLACK: [f64; 3] = [0.0; 3];
const KINDS: Vocabulary = Vocabulary { available: &["ambient", "directional", "point"], later: &[] };
const AMBIENT_KEYS: Vocabulary = Vocabulary { available: &["name", "kind", "ambient"], later: &[] };
const DIRECTIONAL_KEYS: Vocabulary = Vocabulary {
    available: &["name", "kind", "direction", "diffuse", "specular", "ambient", "casts_shadow"],
    later: &[],
};
const POINT_KEYS: Vocabulary = Vocabulary {
    available: &[
        "name",
        "kind",
        "position_m",
        "attenuation",
        "diffuse",
        "specular",
        "ambient",
        "casts_shadow",
    ],
    later: &[],
};
