//! `[process]`: what the process may do once it is set up.

use serde::Deserialize;

/// What the process may do once it is set up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessConfig {
    /// Shut out all system calls that are not needed.
    pub sandbox: bool,
    /// Whom a driver that root started becomes: `NAME` or `UID`, with `:GROUP` if it is not the user's own.
    pub user: Option<String>,
}

impl Default for ProcessConfig {
    fn default() -> Self {
        Self { sandbox: true, user: None }
    }
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawProcess {
    sandbox: Option<bool>,
    user: Option<String>,
}

impl RawProcess {
    /// Whether there is such a user is found out at the start, on the machine that it starts on.
    pub(super) fn validate(self) -> ProcessConfig {
        let usual = ProcessConfig::default();
        ProcessConfig { sandbox: self.sandbox.unwrap_or(usual.sandbox), user: self.user }
    }
}
