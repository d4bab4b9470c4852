//! `phantom3 study ...`: questions about the whole system that a table and a picture answer.
//!
//! Every study runs on the virtual clock or on none, so that its answers are the same on every machine.

pub mod integrators;
pub mod stiffness;

use crate::outcome::RunFailure;
use clap::Subcommand;
use rt_core::signals::StopSignals;

/// What can be studied.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// How stiff a virtual wall may be before it buzzes, by way of replying, rate, damping and hand
    Stiffness(stiffness::StiffnessArgs),
    /// How well moving objects are integrated: a spinning body for a minute, and how stiff a light one may be held
    Integrators(integrators::IntegratorsArgs),
}

/// Does the study.
///
/// # Errors
/// Bad arguments, results that cannot be written, and a signal.
pub fn execute(command: &StudyCommand, signals: &StopSignals) -> Result<crate::outcome::Stop, RunFailure> {
    match command {
        StudyCommand::Stiffness(args) => stiffness::execute(args, signals),
        StudyCommand::Integrators(args) => integrators::execute(args, signals),
    }
}
