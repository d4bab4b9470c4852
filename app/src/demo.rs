//! What happens without arguments: the default scene, felt for ten seconds in real time.

use crate::not_zeroed;
use crate::outcome::RunFailure;
use crate::record::Opened;
use crate::rig::{HandMode, Rig, RigError};
use crate::run::{Attach, RunPlan};
use crate::simulated::SimulatedDevices;
use io_driver::say::say;
use rt_core::output_file;
use shm_abi::client::{self, AttachError};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;
use world::{Scene, Settings};

const SCENE: &str = include_str!("../../config/scenes/default.toml");
const HAND: &str = include_str!("../../config/hands/default.csv");
const SCENE_NAME: &str = "config/scenes/default.toml (built in)";
/// How long it lasts, whatever the hand file says.
const SECONDS: f64 = 10.0;
const RECORDING: &str = "phantom3-demo.csv";

/// The default scene; its hand file lies in a directory of its own, for the driver to read.
pub struct Demo {
    /// The rig.
    pub rig: Rig,
    _directory: TempDir,
}

/// Unpacks the default scene.
///
/// # Errors
/// If there is no room for temporary files.
pub fn unpack(period_ns: u64) -> Result<Demo, RunFailure> {
    let no_room = |error: std::io::Error| {
        RunFailure::Start(format!(
            "cannot unpack the default scene: {error}; set TMPDIR to a directory that can be written"
        ))
    };
    let directory = tempfile::Builder::new().prefix("phantom3-demo-").tempdir().map_err(no_room)?;
    let hand = directory.path().join("default.csv");
    std::fs::write(&hand, HAND).map_err(no_room)?;
    let rig = default_rig(&hand, period_ns).map_err(|error| RunFailure::Start(error.to_string()))?;
    Ok(Demo { rig, _directory: directory })
}

fn default_rig(hand: &Path, period_ns: u64) -> Result<Rig, RigError> {
    let file = Path::new(SCENE_NAME);
    let scene = Scene::parse(SCENE, file)?;
    let hand_mode = HandMode::Impedance(SimulatedDevices::default());
    Rig::new(file, scene, None, Some(hand), hand_mode, period_ns)
}

/// Uses a driver that runs at this socket and is free; starts one of our own otherwise, and says why. The recording goes
/// into this file.
pub fn plan(rig: &Rig, socket: PathBuf, record: PathBuf) -> RunPlan {
    let attach = match client::observe(&socket, "phantom3 looks around") {
        Ok(seen) if seen.driver.read_latest().is_some_and(|frame| frame.lease != 0) => {
            say(format_args!(
                "phantom3: the driver at {} is commanded by somebody else; starting one of our own",
                socket.display()
            ));
            None
        }
        Ok(seen) if seen.driver.info().devices.len() < rig.device_count() => {
            say(format_args!(
                "phantom3: the driver at {} has too few devices for the default scene; starting one of our own",
                socket.display()
            ));
            None
        }
        Ok(seen) => match not_zeroed::words(&seen.driver, &socket) {
            Some(words) => {
                say(format_args!(
                    "phantom3: {words}; starting one of our own with simulated PHANToM Premiums"
                ));
                None
            }
            None => {
                say(format_args!(
                    "phantom3: using the driver at {}; its devices are the fingers",
                    socket.display()
                ));
                Some(Attach { socket, grace: Duration::from_secs(2) })
            }
        },
        Err(AttachError::NoDriver { .. } | AttachError::DriverGone { .. }) => {
            say(format_args!(
                "phantom3: no driver is running; starting one of our own with simulated PHANToM Premiums"
            ));
            None
        }
        Err(error) => {
            say(format_args!(
                "phantom3: {error}; starting a driver of our own with simulated PHANToM Premiums"
            ));
            None
        }
    };
    RunPlan {
        clock: None,
        seconds: Some(SECONDS),
        record: vec![record],
        events: Vec::new(),
        pictures: None,
        window: None,
        inputs: Vec::new(),
        seed: 0,
        orders: None,
        settings: Settings::default(),
        attach,
    }
}

/// Place of the recording: in the directory that is set; else here, or where one may not write here, in a directory of
/// its own among the temporary files, which nobody else can have prepared.
///
/// # Errors
/// A directory that is set and cannot be written, or no room for temporary files.
pub fn recording_place(directory: Option<&Path>) -> Result<PathBuf, RunFailure> {
    let here = directory.unwrap_or(Path::new("")).join(RECORDING);
    // It is opened by the run, which may find that somebody holds a lock on it.
    let refused = match Opened::open(&here) {
        Err(error) if !output_file::is_claimed(&error) => Some(error),
        _ => None,
    };
    let place = match (refused, directory) {
        (None, _) => here,
        (Some(error), Some(directory)) => {
            return Err(RunFailure::Start(format!(
                "the setting recording.directory is {}, and {} cannot be written: {error}; make that directory, or set another \
                 one",
                directory.display(),
                here.display()
            )));
        }
        (Some(error), None) => {
            let rights = Permissions::from_mode(0o700);
            let own = tempfile::Builder::new().prefix("phantom3-demo-").permissions(rights).tempdir();
            let own = own.map_err(|error| no_room(&error))?;
            let place = own.keep().join(RECORDING);
            say(format_args!(
                "phantom3: {RECORDING} cannot be written here: {error}; the recording goes to {}",
                place.display()
            ));
            place
        }
    };
    Ok(std::path::absolute(&place).unwrap_or(place))
}

fn no_room(error: &std::io::Error) -> RunFailure {
    RunFailure::Start(format!(
        "there is no place for temporary files: {error}; set TMPDIR to a directory that can be written"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_that_is_set_and_cannot_be_written_is_refused() {
        let place = tempfile::tempdir().expect("a directory");
        assert_eq!(recording_place(Some(place.path())).expect("room"), place.path().join(RECORDING));
        assert_eq!(
            place.path().read_dir().expect("a directory").count(),
            0,
            "nothing is made before the run"
        );
        let missing = place.path().join("missing");
        let refused = recording_place(Some(&missing)).expect_err("there is none");
        assert_eq!(refused.exit_status(), 2);
        let words = refused.to_string();
        assert!(words.contains("recording.directory") && words.contains("No such file"), "{words}");
    }
}
