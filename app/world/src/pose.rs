//! Reads a pose: `position_m` and `orientation_wxyz` of a table, and unit vectors.

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use crate::error::SceneError;
use crate::reader::{Table, Value};

/// The pose written in `table`; position and orientation default to those of the parent frame.
pub(crate) fn read_pose(table: &Table<'_>) -> Result<Isometry3<f64>, SceneError> {
    let [x, y, z] = table.numbers_or("position_m", [0.0; 3])?;
    let orientation = match table.get("orientation_wxyz") {
        Some(value) => read_orientation(&value)?,
        None => UnitQuaternion::identity(),
    };
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), orientation))
}

/// A quaternion typed with a few digits is normalised; one further from length 1 is more likely
/// another order of components or Euler angles than rounding, and is refused.
fn read_orientation(value: &Value<'_>) -> Result<UnitQuaternion<f64>, SceneError> {
    let wxyz: [f64; 4] = value.numbers()?;
    let length = wxyz.into_iter().fold(0.0, f64::hypot);
    if (length - 1.0).abs() > LENGTH_TOLERANCE {
        return Err(SceneError::NotARotation { at: value.at(), wxyz, length, tolerance: LENGTH_TOLERANCE });
    }
    let [w, x, y, z] = wxyz;
    Ok(UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
}

/// The direction of a vector of any length but zero, and that length as two factors whose
/// product may lie beyond what an `f64` holds.
pub(crate) fn read_direction(value: &Value<'_>) -> Result<(Unit<Vector3<f64>>, [f64; 2]), SceneError> {
    let vector = Vector3::from(value.numbers::<3>()?);
    let scale = vector.amax();
    if scale == 0.0 {
        return Err(SceneError::NoDirection { at: value.at() });
    }
    let (direction, length) = Unit::new_and_get(vector / scale);
    Ok((direction, [scale, length]))
}

/// Four digits after the point, as papers print quaternions, leave an error of at most 2e-4.
const LENGTH_TOLERANCE: f64 = 1e-3;
