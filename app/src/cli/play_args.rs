//! The arguments of `play`, and what they make.

use super::DEFAULT_RATE_HZ;
use super::numbers::parse_seconds;
use crate::outcome::RunFailure;
use crate::outputs::{self, Output};
use crate::play;
use crate::rig::Rig;
use crate::run::RunPlan;
use clap::Args;
use io_driver::config::period_of;
use shm_abi::segment::ClockMode;
use std::path::PathBuf;
use world::Settings;

#[derive(Debug, Clone, Default, Args)]
pub(super) struct PlayArgs {
    /// The scene (TOML) [default: a small table with things on it]
    scene: Option<PathBuf>,
    /// Write every tick here, as `run` does; may be given several times
    #[arg(long, value_name = "FILE")]
    record: Vec<PathBuf>,
    /// Write what happens here, as `run` does; may be given several times
    #[arg(long, value_name = "FILE")]
    events: Vec<PathBuf>,
    /// How long; default: until the window is closed
    #[arg(long, alias = "duration", value_name = "S", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
}

impl PlayArgs {
    pub(super) fn rig(&self, settings: &Settings) -> Result<Rig, RunFailure> {
        play::rig(self.scene.as_deref(), settings, period_of(DEFAULT_RATE_HZ))
    }

    /// What is written must not take the place of what is read, and names its format.
    pub(super) fn check_outputs(&self, rig: &Rig) -> Result<(), RunFailure> {
        let inputs = inputs(rig);
        let (record, events) = (
            self.record.iter().map(|file| Output::ticks(file)),
            self.events.iter().map(|file| Output::events(file)),
        );
        outputs::check(&record.chain(events).collect::<Vec<_>>(), &inputs.iter().collect::<Vec<_>>())
    }

    pub(super) fn plan(&self, rig: &Rig, settings: &Settings) -> RunPlan {
        RunPlan {
            clock: Some(ClockMode::Real),
            seconds: self.seconds,
            record: self.record.clone(),
            events: self.events.clone(),
            pictures: None,
            window: None,
            inputs: inputs(rig),
            seed: 0,
            orders: None,
            settings: settings.clone(),
            attach: None,
        }
    }
}

fn inputs(rig: &Rig) -> Vec<PathBuf> {
    std::iter::once(&rig.scene_file).chain(rig.model_files()).cloned().collect()
}
