//! Simulated devices for the fingers of a scene: which arm, whose hand, and where the arms stand.
//!
//! Model: where no layout says where the devices stand, each stands at the world's origin if its finger's whole path
//! lies within its workspace there; else its base is moved, without turning it, by the smallest distance that
//! brings the path into the workspace, or the middle of the path to the middle of the workspace along an axis on
//! which it is too long.
//! Frames: bases in W.

use io_driver::config::{Backend, HandChoice, Wish};
use io_driver::device_file::{self, ArmFile, DeviceFile, DeviceFileError, Workspace};
use io_driver::sim::hand::HandModel;
use io_driver::sim::hand::model_file::{self, Firmness};
use io_driver::toml_report::{MAX_TOML_BYTES, TomlReport};
use nalgebra::{Isometry3, Vector3};
use rt_core::input_file;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A hand that is held back by a surface, or follows late, leaves its path by some millimetres (m).
const SLACK_M: f64 = 0.01;

/// What is simulated where no driver runs.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedDevices {
    /// The arm's description: a built-in's name or a file.
    pub description: PathBuf,
    /// How the hand pulls: a built-in's name or a file, or `nobody`.
    pub hand_model: PathBuf,
    /// How tightly it holds.
    pub firmness: Firmness,
    /// Whether it trembles.
    pub trembles: bool,
    /// Whether somebody at a window, and no file, says where the fingers shall be.
    pub is_live: bool,
    /// Of tremor and noise.
    pub seed: u64,
}

impl Default for SimulatedDevices {
    fn default() -> Self {
        Self {
            description: "premium-1.5".into(),
            hand_model: "pen-grip".into(),
            firmness: Firmness::Usual,
            trembles: true,
            is_live: false,
            seed: 0,
        }
    }
}

/// Why nothing can be simulated.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// A file cannot be read.
    #[error("cannot read the {what} {file}: {source}; name a file, or one of {builtins}")]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// What it is.
        what: &'static str,
        /// What there is besides files.
        builtins: String,
        /// What the system said.
        source: io::Error,
    },
    /// The description is wrong.
    #[error(transparent)]
    Description(#[from] DeviceFileError),
    /// The hand's model is wrong.
    #[error(transparent)]
    Hand(#[from] TomlReport),
    /// An ideal device is not simulated.
    #[error(
        "{file} describes an ideal device, which has nothing to simulate; use --hand-mode kinematic, or an arm such as premium-1.5"
    )]
    Ideal {
        /// Which.
        file: PathBuf,
    },
}

impl SimulatedDevices {
    /// What is usual for a scene with so many fingers.
    ///
    /// One finger is a stylus in a pen grip. Several are fingertips in thimbles, with which things are taken: at a hand
    /// script's 4 mm below the surface of 500 N/m two pen grips, of 65 N/m along the grip, press with 0.23 N, and drop
    /// whatever is heavier than 33 g at a friction of 0.7; fingertips, of 550 N/m, press with 1 N.
    pub fn for_fingers(count: usize) -> Self {
        let usual = Self::default();
        if count > 1 { Self { hand_model: "fingertip".into(), ..usual } } else { usual }
    }

    /// The description.
    ///
    /// # Errors
    /// If it cannot be read, is wrong or describes no arm.
    pub fn arm(&self) -> Result<ArmFile, SimulationError> {
        let file = &self.description;
        let text = match device_file::builtin(&file.to_string_lossy()) {
            Some(text) => text.to_owned(),
            None => read(file, "device's description", &device_file::BUILTIN_NAMES)?,
        };
        match DeviceFile::parse(&text, file)? {
            DeviceFile::Arm(arm) => Ok(*arm),
            DeviceFile::Ideal(_) => Err(SimulationError::Ideal { file: file.clone() }),
        }
    }

    /// The hand; `None`: nobody.
    ///
    /// # Errors
    /// If its model cannot be read or is wrong.
    pub fn hand(&self) -> Result<Option<HandModel>, SimulationError> {
        let file = &self.hand_model;
        let name = file.to_string_lossy();
        let text = match model_file::builtin(&name) {
            _ if name == "nobody" => return Ok(None),
            Some(text) => text.to_owned(),
            None => read(file, "hand's model", &[&model_file::BUILTIN_NAMES[..], &["nobody"]].concat())?,
        };
        Ok(Some(model_file::parse(&text, file, self.firmness)?))
    }

    /// Such a device in a driver's configuration.
    pub fn backend(&self, wish: Wish) -> Backend {
        let name = self.hand_model.to_string_lossy();
        let is_builtin = model_file::builtin(&name).is_some();
        let holder = (name != "nobody").then(|| HandChoice {
            model: absolute(&self.hand_model, is_builtin),
            firmness: self.firmness,
            trembles: self.trembles,
        });
        let is_builtin = device_file::builtin(&self.description.to_string_lossy()).is_some();
        Backend::Simulated {
            description: absolute(&self.description, is_builtin),
            wish,
            holder,
            seed: self.seed,
        }
    }
}

fn read(file: &Path, what: &'static str, builtins: &[&str]) -> Result<String, SimulationError> {
    input_file::read_text(file, MAX_TOML_BYTES).map_err(|source| SimulationError::Unreadable {
        file: file.into(),
        what,
        builtins: builtins.join(", "),
        source,
    })
}

/// So that the driver finds it from wherever it runs.
fn absolute(file: &Path, is_builtin: bool) -> PathBuf {
    if is_builtin { file.into() } else { std::path::absolute(file).unwrap_or_else(|_| file.into()) }
}

/// X_WD of a device whose finger's path has these corners in W (m).
pub fn base_for_path(lowest: Vector3<f64>, highest: Vector3<f64>, workspace: &Workspace) -> Isometry3<f64> {
    let shift = |axis: usize| {
        let half = 0.5 * workspace.size_m[axis] - SLACK_M;
        let (min, max) = (workspace.centre_m[axis] - half, workspace.centre_m[axis] + half);
        // From the base that has the path's end at the workspace's end, to the one that has its beginning there.
        let (least, most) = (highest[axis] - max, lowest[axis] - min);
        if least <= most { 0.0f64.clamp(least, most) } else { 0.5 * (least + most) }
    };
    Isometry3::translation(shift(0), shift(1), shift(2))
}

/// X_WD of a device whose finger goes wherever people take it, over a table on which things between these corners of W (m)
/// stand: the middle of the workspace is over theirs, and its lower end where a finger that presses the table is.
pub fn base_over_table(lowest: Vector3<f64>, highest: Vector3<f64>, workspace: &Workspace) -> Isometry3<f64> {
    let middle = 0.5 * (lowest + highest) - Vector3::from(workspace.centre_m);
    let floor_m = workspace.centre_m[1] - 0.5 * workspace.size_m[1];
    Isometry3::translation(middle.x, lowest.y - PRESSED_M - floor_m, middle.z)
}

/// From the middle of what stands on a table to a finger that presses beside it, and some more (m).
const PRESSED_M: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    const WORKSPACE: Workspace = Workspace { size_m: [0.4, 0.2, 0.2], centre_m: [0.0, 0.1, 0.0] };

    fn base(lowest: [f64; 3], highest: [f64; 3]) -> Vector3<f64> {
        base_for_path(lowest.into(), highest.into(), &WORKSPACE).translation.vector
    }

    #[test]
    fn what_never_ends_is_no_description() {
        let endless = SimulatedDevices { description: "/dev/zero".into(), ..SimulatedDevices::default() };
        let said = endless.arm().expect_err("no file").to_string();
        assert!(
            said.contains("/dev/zero: it is a device, no regular file; name a file, or one of premium-1.5"),
            "{said}"
        );
    }

    #[test]
    fn a_path_within_the_workspace_leaves_the_base_at_the_origin() {
        assert_eq!(base([-0.1, 0.02, -0.05], [0.1, 0.15, 0.05]), Vector3::zeros());
    }

    #[test]
    fn a_path_that_leaves_it_moves_the_base_no_farther_than_needed() {
        // 5 cm too far to the right and 3 cm too deep, with a centimetre of slack: the workspace's ends are at 0.19
        // and 0.01.
        let moved = base([0.0, -0.02, 0.0], [0.24, 0.1, 0.0]);
        assert!((moved - Vector3::new(0.05, -0.03, 0.0)).norm() < 1e-15, "{moved}");
    }

    #[test]
    fn a_workspace_for_people_is_over_the_middle_of_the_table_and_begins_below_it() {
        let lowest = Vector3::new(-0.1, 0.02, -0.25);
        let base = base_over_table(lowest, Vector3::new(0.3, 0.05, 0.05), &WORKSPACE).translation.vector;
        // The workspace's own middle is 0.1 m above the base, its lower end on the base's level.
        assert!((base - Vector3::new(0.1, -0.03, -0.1)).norm() < 1e-15, "{base}");
    }

    #[test]
    fn a_path_that_is_too_long_is_put_in_the_middle() {
        let moved = base([-0.1, 0.1, -0.2], [0.1, 0.1, 0.4]);
        assert!((moved - Vector3::new(0.0, 0.0, 0.1)).norm() < 1e-15, "{moved}");
    }
}
