//! Runs one test of this test program again as a child process, for what only a dying process shows.

use std::process::{Command, Stdio};

const ROLE: &str = "RT_CORE_TEST_CHILD";

/// The child's role, if this process was started by [`command`] for `test`.
///
/// A test that finds a role plays it and does not return; else it is the parent.
pub(crate) fn role(test: &str) -> Option<String> {
    let role = std::env::var(ROLE).ok()?;
    role.strip_prefix(test)?.strip_prefix('=').map(str::to_owned)
}

/// This program, running nothing but `test`, in `role`. Its chatter is dropped, standard output and
/// error can be redirected.
pub(crate) fn command(test: &str, role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("own path"));
    command.args(["--exact", test, "--nocapture", "--test-threads=1"]);
    command.env(ROLE, format!("{test}={role}"));
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}
