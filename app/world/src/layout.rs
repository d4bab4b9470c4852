//! Where the haptic devices stand in the world.
//!
//! Model: device k has a base frame D; its placement `X_WD` takes what the device measures into the
//! world, and forces computed in the world back to the device.
//!
//! ```toml
//! [[device]]                            # device 0
//! position_m = [-0.15, 0.0, 0.0]
//! orientation_wxyz = [1.0, 0.0, 0.0, 0.0]
//!
//! [[device]]                            # device 1, as an affine calibration found it
//! position_m = [0.15, 0.0, 0.0]
//! matrix = [[1.01, 0.0, 0.0], [0.0, 0.99, 0.0], [0.0, 0.002, 1.0]]   # rows; instead of orientation_wxyz
//! ```
//! All keys may be left out; a device beyond the list stands at the world's origin.
//!
//! Several devices may be placed as one (Melder 7.2.7.4): with `master = 0` the entries of all others are relative
//! to device 0's base M, and with `attached_to = "camera"` the master's own is relative to the camera C, whose pose
//! in the world is `[camera]` until [`Layout::with_camera`] says otherwise: `X_WD = X_WC X_CM X_MD`. A device beyond
//! the list then stands where the master does.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3};

use crate::MAX_DEVICES;
use crate::document::{Document, LineEnds};
use crate::error::SceneError;
use crate::placement::{LEAST_STRETCH, MOST_STRETCH, Placement, stretches};
use crate::pose::read_pose;
use crate::reader::{Table, Value};
use crate::source::read_text;
use crate::vocabulary::Vocabulary;

/// The placements of the device bases. The default has every device at the world's origin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// As written: relative to the master, if there is one.
    entries: Vec<Placement>,
    master: Option<usize>,
    /// X_WC, if the master is attached to the camera.
    camera: Option<Isometry3<f64>>,
}

impl Layout {
    /// Reads the layout file `path`.
    ///
    /// # Errors
    /// The file cannot be read, is too large or not UTF-8, or [`Layout::parse`] refuses its text.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Reads a layout from `text`; `file` is named in errors and not opened.
    ///
    /// # Errors
    /// The first thing found to be wrong, with its place and what is allowed there.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        let lines = LineEnds::of(text);
        let document = Document::new(text, &lines, file);
        let root = document.parse()?;
        let table = Table::root(document, &root);
        table.check_keys(&Vocabulary { available: &KEYS, later: &[] })?;
        let devices = table.tables_up_to(MAX_DEVICES, "device")?;
        let entries = devices.iter().map(read_device).collect::<Result<_, _>>()?;
        let master = table.get("master").map(|value| value.index(MAX_DEVICES)).transpose()?;
        Ok(Self { entries, master, camera: read_camera(&table, master)? })
    }

    /// `X_WD` of the device with this index.
    pub fn placement(&self, device_index: usize) -> Placement {
        let entry = self.entry(device_index);
        match self.master {
            None => entry,
            Some(master) if master == device_index => self.carried(entry),
            Some(master) => self.carried(self.entry(master)).then(&entry),
        }
    }

    /// Rotation and translation of `X_WD`; for an affine placement those nearest to it.
    pub fn pose(&self, device_index: usize) -> Isometry3<f64> {
        self.placement(device_index).nearest_pose()
    }

    /// What to write for a device in this layout, so that it stands there in the world: the inverse of
    /// [`Layout::placement`].
    pub fn entry_of(&self, device_index: usize, X_WD: &Placement) -> Placement {
        match self.master {
            None => *X_WD,
            Some(master) if master == device_index => match self.camera {
                Some(camera) => Placement::Rigid(camera.inverse()).then(X_WD),
                None => *X_WD,
            },
            Some(master) => self.placement(master).inverse().then(X_WD),
        }
    }

    /// The device that the others are placed relative to.
    pub fn master(&self) -> Option<usize> {
        self.master
    }

    /// The camera's pose `X_WC`, if the devices go where it goes.
    pub fn camera(&self) -> Option<Isometry3<f64>> {
        self.camera
    }

    /// The same with the camera elsewhere; unchanged if no device is attached to it. Allocates nothing.
    #[must_use]
    pub fn with_camera(self, X_WC: Isometry3<f64>) -> Self {
        Self { camera: self.camera.map(|_| X_WC), ..self }
    }

    fn entry(&self, device_index: usize) -> Placement {
        self.entries.get(device_index).copied().unwrap_or_else(Placement::identity)
    }

    /// Without a camera nothing is multiplied, and no bit changes.
    fn carried(&self, X_CM: Placement) -> Placement {
        self.camera.map_or(X_CM, |X_WC| Placement::Rigid(X_WC).then(&X_CM))
    }
}

fn read_device(table: &Table<'_>) -> Result<Placement, SceneError> {
    table.check_keys(&Vocabulary { available: &DEVICE_KEYS, later: &[] })?;
    let pose = read_pose(table)?;
    match table.get("matrix") {
        None => Ok(Placement::Rigid(pose)),
        Some(_) if table.get("orientation_wxyz").is_some() => {
            Err(SceneError::MatrixAndOrientation { at: table.at("matrix") })
        }
        Some(value) => {
            let matrix = read_matrix(&value)?;
            Placement::affine(matrix, pose.translation.vector).ok_or_else(|| not_a_placement(&value, &matrix))
        }
    }
}

fn read_matrix(value: &Value<'_>) -> Result<Matrix3<f64>, SceneError> {
    let rows: [[f64; 3]; 3] = value.rows()?;
    Ok(Matrix3::from_fn(|i, j| rows[i][j]))
}

fn not_a_placement(value: &Value<'_>, matrix: &Matrix3<f64>) -> SceneError {
    // Beyond some 1e100 the determinant overflows; the message stays finite where the numbers are.
    let (least, most, volume) = stretches(matrix);
    SceneError::NotAPlacement { at: value.at(), least, most, volume, allowed: [LEAST_STRETCH, MOST_STRETCH] }
}

/// The camera's pose, if the master is attached to it.
fn read_camera(table: &Table<'_>, master: Option<usize>) -> Result<Option<Isometry3<f64>>, SceneError> {
    let attached_to = table.get("attached_to").map(|value| value.choose("place", &PLACES)).transpose()?;
    if attached_to.is_some() && master.is_none() {
        return Err(table.missing("master", "the index of the device that is attached"));
    }
    let camera = table.get("camera").map(|value| value.table("a table, [camera]")).transpose()?;
    match (attached_to, camera) {
        (Some("camera"), None) => Ok(Some(Isometry3::identity())),
        (Some("camera"), Some(camera)) => {
            camera.check_keys(&Vocabulary { available: &["position_m", "orientation_wxyz"], later: &[] })?;
            read_pose(&camera).map(Some)
        }
        (_, Some(_)) => Err(table.missing("attached_to", "\"camera\", since there is a [camera]")),
        (_, None) => Ok(None),
    }
}

const KEYS: [&str; 4] = ["device", "master", "attached_to", "camera"];
const DEVICE_KEYS: [&str; 3] = ["position_m", "orientation_wxyz", "matrix"];
const PLACES: Vocabulary = Vocabulary { available: &["world", "camera"], later: &[] };
