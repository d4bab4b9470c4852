//! The height map of an entity: a picture whose greys stand out of its surface.

use std::path::PathBuf;

use haptics::{Border, HeightForm, HeightMap, PictureScale};

use crate::error::{Location, SceneError};
use crate::reader::{Bound, Table};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// A picture of heights, and how it lies on the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMapSpec {
    /// PNG; made relative to where the scene file is. It is not opened by the reader of scenes.
    pub file: PathBuf,
    /// How far white stands above black (m); below it if negative.
    pub amplitude_m: f64,
    /// How large the picture is.
    pub scale: PictureScale,
    /// Default the raised surface.
    pub form: HeightForm,
    /// What lies beyond the picture's borders; default the picture again.
    pub border: Border,
    /// Whether black counts as white.
    pub invert: bool,
    /// The grey at the surface, from 0 (black, the default) to 1 (white).
    pub zero_level: f64,
    /// Where the scene says so, for messages.
    pub at: Location,
    /// Where it names the file.
    pub file_at: Location,
}

impl HeightMapSpec {
    /// Reads the `height_map` of an entity of this shape, if there is one.
    pub(crate) fn read(entity: &Table<'_>, shape: &ShapeSpec) -> Result<Option<Self>, SceneError> {
        let Some(value) = entity.get("height_map") else { return Ok(None) };
        let table = value.table(EXAMPLE)?;
        table.check_keys(&KEYS)?;
        let allowed = "the path of a PNG file, relative to this file";
        let file = table.require("file", allowed)?;
        let form = table.get("form").map(|form| form.choose("form of a height map", &FORMS)).transpose()?;
        let border = table.get("border").map(|border| border.choose("border", &BORDERS)).transpose()?;
        Ok(Some(Self {
            file: file.file(allowed)?,
            amplitude_m: read_amplitude(&table)?,
            scale: read_scale(&table, shape)?,
            form: if form == Some("along-force") { HeightForm::AlongForce } else { HeightForm::Gradient },
            border: if border == Some("clamp") { Border::Clamp } else { Border::Repeat },
            invert: table.get("invert").map_or(Ok(false), |invert| invert.truth())?,
            zero_level: read_zero_level(&table)?,
            at: *value.at(),
            file_at: *file.at(),
        }))
    }
}

/// One picture over all of the surface, unless something is said; a plane has no ends.
fn read_scale(table: &Table<'_>, shape: &ShapeSpec) -> Result<PictureScale, SceneError> {
    let is_endless = is_plane(shape);
    match (table.get("size_m"), table.get("repeat")) {
        (Some(_), Some(repeat)) => {
            Err(repeat.out_of_range("either size_m, the size of one picture, or repeat, how many there are"))
        }
        (Some(size), None) if matches!(shape, ShapeSpec::Mesh(_)) => Err(size.out_of_range(
            "repeat instead, since the texture coordinates of a mesh count pictures, not metres",
        )),
        (Some(size), None) => Ok(PictureScale::Size(size.numbers_in(Bound::Positive)?)),
        (None, Some(repeat)) if is_endless => Err(repeat.out_of_range(
            "size_m instead, the size of one picture, since a plane has no ends to repeat it between",
        )),
        (None, Some(repeat)) => Ok(PictureScale::Repeat(repeat.numbers_in(Bound::Positive)?)),
        (None, None) if is_endless => Err(table.missing("size_m", "an array of 2 numbers above 0")),
        (None, None) => Ok(PictureScale::Repeat([1.0; 2])),
    }
}

fn is_plane(shape: &ShapeSpec) -> bool {
    match shape {
        ShapeSpec::Plane { .. } => true,
        ShapeSpec::Scaled { shape, .. } => is_plane(shape),
        _ => false,
    }
}

fn read_amplitude(table: &Table<'_>) -> Result<f64, SceneError> {
    let most_m = HeightMap::LARGEST_AMPLITUDE_M;
    let allowed = format!("a number from -{most_m} to {most_m}, the height of white above black");
    let value = table.require("amplitude_m", &allowed)?;
    let amplitude_m = value.number(Bound::Any)?;
    if amplitude_m.abs() <= most_m { Ok(amplitude_m) } else { Err(value.out_of_range(allowed)) }
}

fn read_zero_level(table: &Table<'_>) -> Result<f64, SceneError> {
    let Some(value) = table.get("zero_level") else { return Ok(0.0) };
    let zero_level = value.number(Bound::Any)?;
    if (0.0..=1.0).contains(&zero_level) {
        Ok(zero_level)
    } else {
        Err(value.out_of_range("a number from 0 (black) to 1 (white)"))
    }
}

const FORMS: Vocabulary = Vocabulary { available: &["gradient", "along-force"], later: &[] };
const BORDERS: Vocabulary = Vocabulary { available: &["repeat", "clamp"], later: &[] };
const KEYS: Vocabulary = Vocabulary {
    available: &["file", "amplitude_m", "size_m", "repeat", "form", "invert", "zero_level", "border"],
    later: &[],
};
const EXAMPLE: &str = "a table such as { file = \"bumps.png\", amplitude_m = 0.0005, size_m = [0.05, 0.05] }";
