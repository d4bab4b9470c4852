//! The programs under test, built beside the test that starts them.

use std::path::PathBuf;
use std::process::{Command, Output};

/// `phantom3`, ready for arguments.
pub fn phantom3() -> Command {
    Command::new(program("phantom3-under-test"))
}

/// `io-driver`, ready for arguments.
pub fn io_driver() -> Command {
    Command::new(program("io-driver-under-test"))
}

/// The bare reference loop, ready for arguments.
pub fn bare_loop() -> Command {
    Command::new(program("bare-loop"))
}

/// The latency harness, ready for arguments.
pub fn jitter() -> Command {
    Command::new(program("jitter"))
}

/// What a finished program said, for asserting on.
pub fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Cargo puts tests into `deps` below the directory of the programs.
fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("the test knows its own file");
    let directory = test.parent().and_then(std::path::Path::parent).expect("target directory");
    let path = directory.join(name);
    assert!(path.exists(), "{} is not built; run the tests with cargo", path.display());
    path
}
