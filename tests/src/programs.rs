//! The programs under test, built beside the test that starts them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Names the process of the test that started a program.
const TEST_VARIABLE: &str = "PHANTOM3_TEST_PROCESS";

/// `phantom3`, ready for arguments.
pub fn phantom3() -> Command {
    tied(Command::new(program("phantom3-under-test")))
}

/// `io-driver`, ready for arguments.
pub fn io_driver() -> Command {
    tied(Command::new(program("io-driver-under-test")))
}

/// Another copy of one of them, ready for arguments.
pub fn copied(path: &Path) -> Command {
    tied(Command::new(path))
}

/// Where `phantom3` lies.
pub fn phantom3_file() -> PathBuf {
    program("phantom3-under-test")
}

/// In a program under test: the kernel kills it when the test's thread that started it ends, however it ends. A
/// program that another program started is tied to that one as it is in use.
pub fn end_with_the_test() {
    let test = std::env::var(TEST_VARIABLE).ok().and_then(|text| text.parse().ok());
    if let Some(test) = test {
        // Refused if the parent is another one.
        let _ = rt_core::process::die_with_parent(test, rustix::process::Signal::KILL.as_raw());
    }
}

fn tied(mut command: Command) -> Command {
    command.env(TEST_VARIABLE, std::process::id().to_string());
    // Nobody's own layout may move the devices of a test.
    command.env("XDG_CONFIG_HOME", "/dev/null");
    // Nor may windows open on it.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
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
    let directory = test.parent().and_then(Path::parent).expect("target directory");
    let path = directory.join(name);
    assert!(path.exists(), "{} is not built; run the tests with cargo", path.display());
    path
}
