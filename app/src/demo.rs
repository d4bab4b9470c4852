//! What happens without arguments: the default scene, felt for ten seconds in real time.

use crate::not_zeroed;
use crate::outcome::RunFailure;
use crate::rig::{HandMode, Rig, RigError};
use crate::run::{Attach, RunPlan};
use crate::simulated::SimulatedDevices;
use io_driver::say::say;
use shm_abi::client::{self, AttachError};
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
/// to this directory.
pub fn plan(rig: &Rig, socket: PathBuf, directory: Option<&Path>) -> RunPlan {
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
    let record = vec![recording_place(directory)];
    RunPlan {
        clock: None,
        seconds: Some(SECONDS),
        record,
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

/// In the directory that is set, or here, if one may write there, else among the temporary files.
fn recording_place(directory: Option<&Path>) -> PathBuf {
    let here = directory.unwrap_or(Path::new("")).join(RECORDING);
    let writable = std::fs::File::options().append(true).create(true).open(&here).is_ok();
    let place = if writable { here } else { std::env::temp_dir().join(RECORDING) };
    std::path::absolute(&place).unwrap_or(place)
}
