//! Tests, sources and report lines that the documents name: each is there.

mod architecture;
mod equations;
mod named;
mod report;

use std::path::{Path, PathBuf};

/// The project's directory.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
