//! Where the haptic devices stand in the world.
//!
//! Model: device k has a base frame D; its pose `X_WD` takes what the device measures into the
//! world, and forces computed in the world back to the device.
//!
//! ```toml
//! [[device]]                            # device 0
//! position_m = [-0.15, 0.0, 0.0]
//! orientation_wxyz = [1.0, 0.0, 0.0, 0.0]
//! ```
//! Both keys may be left out; a device beyond the list stands at the world's origin.

use std::path::Path;

use nalgebra::Isometry3;

use crate::MAX_DEVICES;
use crate::document::Document;
use crate::error::SceneError;
use crate::pose::read_pose;
use crate::reader::Table;
use crate::source::read_text;
use crate::vocabulary::Vocabulary;

/// The poses of the device bases. The default has every device at the world's origin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    poses: Vec<Isometry3<f64>>,
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
        let document = Document::new(text, file);
        let root = document.parse()?;
        let table = Table::root(document, &root);
        table.check_keys(&Vocabulary { available: &["device"], later: &[] })?;
        let devices = table.tables_up_to(MAX_DEVICES, "device")?;
        let poses = devices.iter().map(read_device).collect::<Result<_, _>>()?;
        Ok(Self { poses })
    }

    /// `X_WD` of the device with this index; identity beyond the list.
    pub fn pose(&self, device_index: usize) -> Isometry3<f64> {
        self.poses.get(device_index).copied().unwrap_or_else(Isometry3::identity)
    }
}

fn read_device(table: &Table<'_>) -> Result<Isometry3<f64>, SceneError> {
    table.check_keys(&Vocabulary { available: &["position_m", "orientation_wxyz"], later: &[] })?;
    read_pose(table)
}
