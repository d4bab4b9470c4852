//! Colours: red, green, blue and perhaps opacity, each from 0 to 1.

use crate::error::SceneError;
use crate::reader::{Bound, Value};

/// Three numbers, or four with the opacity last, which is 1 otherwise.
pub(crate) fn read_colour(value: &Value<'_>) -> Result<[f64; 4], SceneError> {
    match value.length() {
        4 => shares(value),
        3 => {
            let [red, green, blue] = shares(value)?;
            Ok([red, green, blue, 1.0])
        }
        _ => Err(value.out_of_range("an array of 3 or 4 numbers from 0 to 1: red, green, blue, opacity")),
    }
}

/// Three numbers: light has no opacity.
pub(crate) fn read_light_colour(value: &Value<'_>) -> Result<[f64; 3], SceneError> {
    shares(value)
}

/// White where colours are counted in bytes.
const BRIGHTEST_BYTE: f64 = 255.0;

fn shares<const N: usize>(value: &Value<'_>) -> Result<[f64; N], SceneError> {
    let shares: [f64; N] = value.numbers_in(Bound::NotNegative)?;
    let Some(first) = shares.iter().position(|share| *share > 1.0) else { return Ok(shares) };
    let allowed = format!("an array of {N} numbers from 0 to 1");
    if shares.iter().all(|share| *share <= BRIGHTEST_BYTE && share.fract() == 0.0) {
        // Rounded to what the eye can tell.
        let meant = shares.map(|share| (share / BRIGHTEST_BYTE * 1000.0).round() / 1000.0);
        return Err(SceneError::OutOfRange {
            at: value.at(),
            found: format!("{shares:?}, which looks like numbers from 0 to 255"),
            allowed: format!("{allowed}: write {meant:?}"),
        });
    }
    Err(value.nth(first).as_ref().unwrap_or(value).out_of_range("a number from 0 to 1"))
}
