//! What the commander answered, as far as it is believed.
//!
//! Model: the bell on the commander's memory names the tick that was answered last. A command is read only when
//! the bell names another one, and becomes the newest only if it is whole, newer, and what it claims to be.
//! Cost: one command read and validated for each new number on the bell.

use crate::meter::bump;
use crate::safety::CommandAge;
use bytemuck::Zeroable;
use nalgebra::Vector3;
use shm_abi::{Command, CommanderView, DriverSegment};

/// The newest command of the lease that was believed.
#[derive(Debug)]
pub(crate) struct Reply {
    command: Command,
    /// Its tick; `None` before the first.
    pub(crate) tick: Option<u64>,
    /// How old it was when it was last used (ns); `None`: it has not been used yet.
    age_ns: Option<u64>,
    /// The last number on the commander's bell that was looked into, so that no lie is read twice.
    pub(crate) seen: Option<u64>,
    /// The driver's tick in which that was done.
    pub(crate) examined_in: u64,
    /// Where a command is read to before it is believed.
    candidate: Command,
    /// From the doorbell to the reply that answers this tick.
    pub(crate) round_trip_ns: u64,
}

impl Reply {
    pub(crate) fn none() -> Self {
        let command = Command::zeroed();
        Self {
            command,
            tick: None,
            age_ns: None,
            seen: None,
            examined_in: 0,
            candidate: command,
            round_trip_ns: 0,
        }
    }

    pub(crate) fn forget(&mut self) {
        *self = Self::none();
    }

    /// Believes the command that the bell announces, or counts why not.
    pub(crate) fn examine(
        &mut self,
        lease: &CommanderView,
        latest: Option<u64>,
        tick: u64,
        devices: u64,
        told: &DriverSegment,
    ) {
        let Some(answered) = latest else { return };
        // An answer to a tick that has not come, or one older than what we have, is no answer.
        if answered > tick || self.tick.is_some_and(|newest| answered <= newest) {
            return bump(&told.counters.commands_refused);
        }
        if lease.read_command(answered, &mut self.candidate).is_err() {
            return bump(&told.counters.commands_torn);
        }
        match self.candidate.validate(answered, lease.lease(), devices) {
            Ok(()) => {
                self.command = self.candidate;
                self.tick = Some(answered);
                self.age_ns = None;
            }
            Err(_) => bump(&told.counters.commands_refused),
        }
    }

    /// Ticks since the one that it answers.
    pub(crate) fn age_ticks(&self, tick: u64) -> Option<u64> {
        self.tick.map(|answered| tick.saturating_sub(answered))
    }

    /// How old it is when the motors are written, so long (ns) after they were written before. One that comes late was
    /// on its way for as many periods as it is ticks old.
    pub(crate) fn grow_older(&mut self, tick: u64, passed_ns: u64, period_ns: u64) -> Option<CommandAge> {
        let ticks = self.age_ticks(tick)?;
        let ns = match self.age_ns {
            Some(age_ns) => age_ns.saturating_add(passed_ns),
            None => ticks.saturating_mul(period_ns),
        };
        self.age_ns = Some(ns);
        Some(CommandAge { ticks, ns })
    }

    pub(crate) fn force(&self, device: usize) -> Vector3<f64> {
        Vector3::from(self.command.devices[device].force_on_user_n)
    }
}
