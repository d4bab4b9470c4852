//! Rational patches in TOML: degrees, knots, weighted points.
//!
//! ```toml
//! [[patch]]
//! degree = [2, 1]                                # along u and v, 1 to 7
//! knots_u = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]      # as many as points along u, plus degree, plus one
//! knots_v = [0.0, 0.0, 1.0, 1.0]
//! points = [                                     # x, y, z and perhaps a weight (1); u runs first
//!     [1.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.7071], [0.0, 0.0, 1.0],
//!     [1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.7071], [0.0, 1.0, 1.0],
//! ]
//! ```
//! Weights stand beside the coordinates and are not multiplied into them. Patches whose edges agree are joined; in what
//! order they come and which way round they are does not matter.

use super::ModelError;
use crate::document::{Document, LineEnds};
use crate::error::SceneError;
use crate::reader::{Bound, Table, Value};
use crate::source::MAX_FILE_BYTES;
use crate::vocabulary::Vocabulary;
use haptics::{NurbsError, NurbsPatch};
use std::fmt::Write;
use std::path::Path;

/// Reads a TOML file of patches; `file` is named in errors and not opened.
///
/// # Errors
/// The first thing found to be wrong, with file, line and key.
pub fn read_patches(file: &Path, bytes: &[u8]) -> Result<Vec<NurbsPatch>, ModelError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let error = SceneError::TooLarge { file: file.into(), limit_bytes: MAX_FILE_BYTES };
        return Err(ModelError::Toml(Box::new(error)));
    }
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let offset_bytes = error.valid_up_to();
        let line = 1 + bytes[..offset_bytes].iter().filter(|&&byte| byte == b'\n').count();
        Box::new(SceneError::NotUtf8 { file: file.into(), line, offset_bytes })
    })?;
    read(file, text).map_err(|error| ModelError::Toml(Box::new(error)))
}

fn read(file: &Path, text: &str) -> Result<Vec<NurbsPatch>, SceneError> {
    let lines = LineEnds::of(text);
    let document = Document::new(text, &lines, file);
    let root = document.parse()?;
    let table = Table::root(document, &root);
    table.check_keys(&FILE_KEYS)?;
    let patches = table.tables("patch")?;
    if patches.is_empty() {
        return Err(table.missing("patch", "one table or more, each under its own [[patch]]"));
    }
    patches.iter().enumerate().map(|(index, table)| patch(index, table)).collect()
}

fn patch(index: usize, table: &Table<'_>) -> Result<NurbsPatch, SceneError> {
    table.check_keys(&PATCH_KEYS)?;
    let degree: Value<'_> = table.require("degree", DEGREE)?;
    let degree =
        degree.numbers::<2>()?.map(|number| if number.fract() == 0.0 { number } else { 0.0 } as usize);
    let knots_u = table.require("knots_u", KNOTS)?.list(Bound::Any)?;
    let knots_v = table.require("knots_v", KNOTS)?.list(Bound::Any)?;
    let points: Vec<[f64; 4]> =
        table.require("points", POINTS)?.items(POINTS)?.iter().map(point).collect::<Result<_, _>>()?;
    let patch = NurbsPatch { degree, knots: [knots_u, knots_v], points };
    patch.check(index).map_err(|error| refused(table, error))?;
    Ok(patch)
}

fn point(value: &Value<'_>) -> Result<[f64; 4], SceneError> {
    if value.length() == 4 {
        return value.numbers();
    }
    let [x, y, z] = value.numbers()?;
    Ok([x, y, z, 1.0])
}

/// The place of what makes numbers no patch.
fn refused(table: &Table<'_>, error: NurbsError) -> SceneError {
    let NurbsError::Patch { part, found, allowed, .. } = error else {
        let found = error.to_string();
        return SceneError::OutOfRange { at: table.at("points"), found, allowed: POINTS.into() };
    };
    let key = match part.split_once(' ') {
        Some(("degree", _)) => "degree",
        Some(("knots", "u")) => "knots_u",
        Some(("knots", _)) => "knots_v",
        _ => "points",
    };
    // Which of the two degrees, and which of many points, the key does not tell.
    let found = if key == "degree" || part.contains('[') { format!("{part}: {found}") } else { found };
    SceneError::OutOfRange { at: table.at(key), found, allowed }
}

/// The text of a file that [`read_patches`] reads as these patches, to the last bit.
pub fn write_patches(patches: &[NurbsPatch]) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
    let mut text = String::new();
    for patch in patches {
        let [u, v] = &patch.knots;
        let _ = writeln!(text, "[[patch]]\ndegree = {:?}", patch.degree);
        let _ = writeln!(text, "knots_u = [{}]\nknots_v = [{}]\npoints = [", list(u), list(v));
        for point in &patch.points {
            let _ = writeln!(text, "    [{}],", list(point));
        }
        text.push_str("]\n\n");
    }
    text
}

const FILE_KEYS: Vocabulary = Vocabulary { available: &["patch"], later: &[] };
const PATCH_KEYS: Vocabulary =
    Vocabulary { available: &["degree", "knots_u", "knots_v", "points"], later: &[] };
const DEGREE: &str = "an array of 2 whole numbers from 1 to 7";
const KNOTS: &str = "an array of numbers none of which is below the one before";
const POINTS: &str = "an array of points, each 3 coordinates and perhaps a weight above 0";
