//! The arguments of `play`, and what they make.

use super::DEFAULT_RATE_HZ;
use super::numbers::parse_seconds;
use crate::outcome::RunFailure;
use crate::play;
use crate::rig::Rig;
use crate::run::RunPlan;
use clap::Args;
use io_driver::config::period_of;
use rt_core::signals::StopSignals;
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
    pub(super) fn rig(&self, settings: &Settings, signals: &StopSignals) -> Result<Rig, RunFailure> {
        play::rig(self.scene.as_deref(), settings, period_of(DEFAULT_RATE_HZ), signals)
    }

    /// # Errors
    /// An output that would take the place of an input, or whose name says no format.
    pub(super) fn plan(&self, rig: &Rig, settings: &Settings) -> Result<RunPlan, RunFailure> {
        let plan = RunPlan {
            clock: Some(ClockMode::Real),
            seconds: self.seconds,
            record: self.record.clone(),
            events: self.events.clone(),
            pictures: None,
            window: None,
            inputs: rig.input_files().into_iter().chain(settings.input_files()).collect(),
            seed: 0,
            orders: None,
            settings: settings.clone(),
            attach: None,
        };
        plan.check_outputs(&plan.inputs)?;
        Ok(plan)
    }
}
