//! Free play: a scene, a window, and a hand that a mouse moves.

mod free_place;
mod starts;

use crate::loading::while_reading;
use crate::outcome::RunFailure;
use crate::rig::{HandMode, Rig};
use crate::settings;
use crate::simulated::SimulatedDevices;
use io_driver::say::say;
use io_driver::sim::hand::model_file::Firmness;
use rt_core::signals::StopSignals;
use std::path::Path;
use world::{Scene, Settings};

const SCENE: &str = include_str!("../../config/scenes/play.toml");
const SCENE_NAME: &str = "config/scenes/play.toml (built in)";

/// A scene, or the small table that is built in, for a hand that people move. Its fingers begin outside of everything.
///
/// # Errors
/// What is wrong with it.
pub fn rig(
    scene: Option<&Path>,
    settings: &Settings,
    period_ns: u64,
    signals: &StopSignals,
) -> Result<Rig, RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let (file, mut scene) = match scene {
        Some(named) => {
            let file = settings::find(named, &settings.scenes.value);
            let scene = Scene::load(&file).map_err(|error| wrong(&error))?;
            (file, scene)
        }
        None => {
            (SCENE_NAME.into(), Scene::parse(SCENE, Path::new(SCENE_NAME)).map_err(|error| wrong(&error))?)
        }
    };
    // Nothing follows a script.
    scene.hand = None;
    settings::find_data(&mut scene, &file, settings);
    let hand_mode = HandMode::Impedance(devices());
    let rig = while_reading(&file, signals, || Rig::new(&file, scene, None, None, hand_mode, period_ns))
        .map_err(|error| wrong(&error))?;
    let (starts, told) = starts::starts(&rig).map_err(|error| wrong(&error))?;
    if !told.is_empty() {
        say(format_args!("phantom3: fingers begin elsewhere than the scene says: {}", told.join("; ")));
    }
    rig.starting_at(&starts).map_err(|error| wrong(&error))
}

/// Arms that a light finger pulls: its springs are alike along all axes, 200 N/m, so that a grip is as hard however it is
/// turned. A mouse does not tremble.
pub fn devices() -> SimulatedDevices {
    SimulatedDevices {
        hand_model: "fingertip".into(),
        firmness: Firmness::Light,
        trembles: false,
        is_live: true,
        ..SimulatedDevices::default()
    }
}
