//! `[reply]`: when the motors are written.

use super::ns_of_us;
use crate::toml_report::{Allowed, TomlReport, TomlText};
use serde::Deserialize;
use toml::Spanned;

/// When the motors are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyMode {
    /// As soon as the reply to this tick is there.
    OnArrival,
    /// At a fixed time after the tick began, so that the application's jitter stays out of the loop delay.
    FixedPhase,
    /// At once, with the reply to the tick before, as the thesis does.
    NextTick,
}

/// How to wait for replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReplyConfig {
    /// When the motors are written.
    pub mode: ReplyMode,
    /// How long after the tick's deadline a reply is still in time (ns).
    pub budget_ns: u64,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawReply {
    mode: Option<RawReplyMode>,
    budget_us: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RawReplyMode {
    SameTick,
    FixedPhase,
    NextTick,
}

impl RawReply {
    pub(super) fn validate(self, toml: &TomlText<'_>, period_ns: u64) -> Result<ReplyConfig, TomlReport> {
        let within_period = Allowed { min: 1.0, max: 0.9 * period_ns as f64 / 1e3, unit: "us" };
        let budget_ns = match self.budget_us {
            Some(number) => ns_of_us(toml.number(&number, within_period)?),
            None => period_ns / 2,
        };
        let mode = match self.mode.unwrap_or(RawReplyMode::SameTick) {
            RawReplyMode::SameTick => ReplyMode::OnArrival,
            RawReplyMode::FixedPhase => ReplyMode::FixedPhase,
            RawReplyMode::NextTick => ReplyMode::NextTick,
        };
        Ok(ReplyConfig { mode, budget_ns })
    }
}
