//! `[process]`: what the process may do once it is set up.

use crate::toml_report::{Allowed, TomlReport, TomlText};
use serde::Deserialize;
use toml::Spanned;

/// What the process may do once it is set up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessConfig {
    /// Shut out all system calls that are not needed.
    pub sandbox: bool,
    /// Whom a driver that root started becomes: `NAME` or `UID`, with `:GROUP` if it is not the user's own.
    pub user: Option<String>,
    /// For how long the thread that serves the socket may stand still while a force might be let through (ns).
    pub service_silence_ns: u64,
}

impl Default for ProcessConfig {
    fn default() -> Self {
        Self { sandbox: true, user: None, service_silence_ns: USUAL_SILENCE_NS }
    }
}

/// Fifty of its turns: a thread without real-time rights on a loaded machine may wait for some of them.
const USUAL_SILENCE_NS: u64 = 1_000_000_000;
/// Five turns; as long as a person takes to notice that a stop is not heard.
const SILENCE: Allowed = Allowed { min: 100.0, max: 5000.0, unit: "ms" };

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawProcess {
    sandbox: Option<bool>,
    user: Option<String>,
    service_silence_ms: Option<Spanned<f64>>,
}

impl RawProcess {
    /// Whether there is such a user is found out at the start, on the machine that it starts on.
    pub(super) fn validate(self, toml: &TomlText<'_>) -> Result<ProcessConfig, TomlReport> {
        let usual = ProcessConfig::default();
        let silence_ms = self.service_silence_ms.map(|ms| toml.number(&ms, SILENCE)).transpose()?;
        Ok(ProcessConfig {
            sandbox: self.sandbox.unwrap_or(usual.sandbox),
            user: self.user,
            service_silence_ns: silence_ms.map_or(usual.service_silence_ns, |ms| (ms * 1e6).round() as u64),
        })
    }
}
