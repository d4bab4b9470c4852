//! What can go wrong, and with which exit status it ends.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use thiserror::Error;

/// The gate was not passed.
pub const EXIT_GATE: u8 = 1;
/// Bad usage or bad input; nothing was measured.
pub const EXIT_USAGE: u8 = 2;
/// A fault during the measurement.
pub const EXIT_FAULT: u8 = 3;

/// Why `jitter` did not do what it was asked to.
#[derive(Debug, Error)]
pub enum JitterError {
    /// Options that make no sense.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read.
    #[error("cannot read {file}: {source}")]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file that is not what it should be.
    #[error("{file} is not a usable {what}: {detail}")]
    BadFile {
        /// Which.
        file: PathBuf,
        /// What it should be.
        what: &'static str,
        /// What was found, and what is expected.
        detail: String,
    },
    /// A child could not be started or did not do its work.
    #[error("{0}")]
    Fault(String),
    /// The file with everything could not be written.
    #[error("cannot write {file}: {detail}; the results so far are lost unless an earlier file is there")]
    Lost {
        /// The file.
        file: PathBuf,
        /// The system's error.
        detail: String,
    },
    /// A table or a picture of results could not be written.
    #[error("cannot write {file}: {detail}")]
    Write {
        /// Which.
        file: PathBuf,
        /// What the system said.
        detail: String,
    },
    /// The same, where everything is in another file.
    #[error("{failure}; {} is there with all results: `jitter report {} --out DIR` makes the rest of it", result.display(), result.display())]
    Rest {
        /// The file that could not be written.
        failure: Box<JitterError>,
        /// The file that was.
        result: PathBuf,
    },
}

impl JitterError {
    /// The exit status that tells it.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Usage(_) | Self::Unreadable { .. } | Self::BadFile { .. } => EXIT_USAGE,
            Self::Fault(_) | Self::Lost { .. } | Self::Write { .. } | Self::Rest { .. } => EXIT_FAULT,
        })
    }

    /// The same, with the file that everything is in.
    pub fn beside(self, result: &Path) -> Self {
        Self::Rest { failure: Box::new(self), result: result.into() }
    }

    /// A fault with what was tried and what came of it.
    pub fn fault(what: &str, error: impl std::fmt::Display) -> Self {
        Self::Fault(format!("cannot {what}: {error}"))
    }
}
