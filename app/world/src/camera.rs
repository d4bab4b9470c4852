//! Cameras (Melder 7.2.6, the Camera Entity). The crate `view` draws by them. Devices that go where
//! the view goes are a matter of the layout, `attached_to = "camera"`.

#![allow(non_snake_case)] // Frames are capital letters: X_WC takes C to W.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::error::SceneError;
use crate::names::Names;
use crate::pose::{read_direction, read_pose};
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// One `[[camera]]`: it looks along -z of its frame C, y is up.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCamera {
    /// Unique among the cameras; default c0, c1, ... by position in the list.
    pub name: String,
    /// `X_WC`; default identity.
    pub pose: Isometry3<f64>,
    /// From the lower edge of the picture to the upper one (degrees); default [`SceneCamera::DEFAULT_FIELD_OF_VIEW_DEG`].
    pub field_of_view_deg: f64,
    /// What is nearer is not seen (m); above 0.
    pub near_m: f64,
    /// What is farther is not seen (m); above `near_m`.
    pub far_m: f64,
}

impl SceneCamera {
    /// That of a screen of 0.35 m at an arm's length.
    pub const DEFAULT_FIELD_OF_VIEW_DEG: f64 = 30.0;
    /// Nearer than a finger is seen sharply.
    pub const DEFAULT_NEAR_M: f64 = 0.01;
    /// Far beyond what any device reaches.
    pub const DEFAULT_FAR_M: f64 = 10.0;

    /// Reads the `[[camera]]` at position `i` of the list.
    pub(crate) fn read<'d>(table: &Table<'d>, i: usize, names: &mut Names<'d>) -> Result<Self, SceneError> {
        table.check_keys(&KEYS)?;
        let near_m = table.number_or("near_m", Bound::Positive, Self::DEFAULT_NEAR_M)?;
        let far_m = table.number_or("far_m", Bound::Positive, Self::DEFAULT_FAR_M.max(2.0 * near_m))?;
        if far_m <= near_m {
            return Err(table
                .require("far_m", "")?
                .out_of_range(format!("a number above near_m = {near_m}")));
        }
        Ok(Self {
            name: names.claim(table, format!("c{i}"))?,
            pose: read_camera_pose(table)?,
            field_of_view_deg: read_field_of_view(table)?,
            near_m,
            far_m,
        })
    }
}

/// As any pose, or from a place to look at.
fn read_camera_pose(table: &Table<'_>) -> Result<Isometry3<f64>, SceneError> {
    let up = match table.get("up") {
        Some(value) => read_direction(&value)?.0,
        None => Vector3::y_axis(),
    };
    let Some(target) = table.get("look_at_m") else {
        return match table.get("up") {
            Some(value) => Err(value.out_of_range("no `up` without `look_at_m`")),
            None => read_pose(table),
        };
    };
    if let Some(value) = table.get("orientation_wxyz") {
        return Err(value.out_of_range("either `orientation_wxyz` or `look_at_m`, not both"));
    }
    let eye: Point3<f64> = table.numbers_or("position_m", [0.0; 3])?.into();
    let ahead = Point3::from(target.numbers::<3>()?) - eye;
    let sideways = ahead.cross(&up).norm();
    if sideways > 1e-9 * ahead.norm() {
        // A frame that looks along z has x to the left; ours looks along -z.
        return Ok(Isometry3::face_towards(&eye, &(eye - ahead), &up));
    }
    Err(target.out_of_range(if ahead == Vector3::zeros() {
        "another place than the camera's own `position_m`"
    } else {
        "a place that is not straight along `up` from the camera, or another `up`"
    }))
}

fn read_field_of_view(table: &Table<'_>) -> Result<f64, SceneError> {
    let usual = SceneCamera::DEFAULT_FIELD_OF_VIEW_DEG;
    let angle_deg = table.number_or("field_of_view_deg", Bound::Positive, usual)?;
    if angle_deg < 180.0 {
        return Ok(angle_deg);
    }
    Err(table.require("field_of_view_deg", "")?.out_of_range("a number above 0 and below 180"))
}

const KEYS: Vocabulary = Vocabulary {
    available: &[
        "name",
        "position_m",
        "orientation_wxyz",
        "look_at_m",
        "up",
        "field_of_view_deg",
        "near_m",
        "far_m",
    ],
    later: &[],
};
