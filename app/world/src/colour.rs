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

fn shares<const N: usize>(value: &Value<'_>) -> Result<[f64; N], SceneError> {
    let shares: [f64; N] = value.numbers_in(Bound::NotNegative)?;
    if shares.iter().all(|share| *share <= 1.0) {
        return Ok(shares);
    }
    Err(value.out_of_range(format!("an array of {N} numbers from 0 to 1")))
}
