//! `zeroing`: how a device learns where it is.

use serde::Deserialize;

/// When an arm's pose is taken for its zeroing pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Zeroing {
    /// When it is read first: somebody sees to it that it is in that pose whenever a driver starts.
    #[default]
    AtStart,
    /// When a person says so (`io-driver zero`). Until then it knows only how far it moved, and gets no force.
    Ask,
}
