//! Programs run as another user, with the rights that a test gives them.
//!
//! Only root can do that; a test that cannot says so, and looks at what it can see as itself.

use patience::prelude::*;
use std::ffi::OsStr;
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// The user whom every Linux machine has for this, and its number as group.
pub const NOBODY: u32 = 65534;

/// Whether this process may become another user, and has the tool to do it (`setpriv` of util-linux); if not,
/// says why a test is skipped.
pub fn can_be_others() -> bool {
    if !rustix::process::geteuid().is_root() {
        println!("skipped: only root can start a program as another user");
        return false;
    }
    let tried =
        Command::new("setpriv").args(["--reuid=65534", "true"]).stderr(Stdio::null()).bounded_status();
    let can = tried.is_ok_and(|status| status.success());
    if !can {
        println!("skipped: there is no `setpriv` that can start a program as another user");
    }
    can
}

/// A program, copied to where everybody may execute it, to be run as [`NOBODY`].
#[derive(Debug)]
pub struct Stranger {
    program: PathBuf,
    _directory: TempDir,
}

impl Stranger {
    /// Copies it.
    pub fn of(program: &Path) -> Self {
        let directory = open_directory();
        let copy = directory.path().join("program");
        // Not by this process: while another thread starts a child, that child would hold the copy open for
        // writing, and nobody may execute what is being written.
        let copied = Command::new("cp").arg(program).arg(&copy).bounded_status().expect("there is `cp`");
        assert!(copied.success(), "a copy of {}", program.display());
        Self { program: copy, _directory: directory }
    }

    /// It, with these capabilities and no others (`sys_nice`, ...), or none.
    pub fn command(&self, capabilities: &[&str]) -> Command {
        let sets = capabilities.iter().fold("-all".to_owned(), |sets, name| format!("{sets},+{name}"));
        let mut command = Command::new("setpriv");
        command.args(["--reuid=65534", "--regid=65534", "--clear-groups"]);
        command.arg(format!("--inh-caps={sets}")).arg(format!("--ambient-caps={sets}"));
        command.arg("--").arg(&self.program).current_dir("/");
        command
    }

    /// It, as some other user with these groups besides its own.
    pub fn as_user(&self, uid: u32, groups: &[u32]) -> Command {
        let groups: Vec<String> = groups.iter().chain([&uid]).map(u32::to_string).collect();
        let mut command = Command::new("setpriv");
        command.arg(format!("--reuid={uid}")).arg(format!("--regid={uid}"));
        command.arg(format!("--groups={}", groups.join(","))).arg("--").arg(&self.program).current_dir("/");
        command
    }

    /// The same with arguments.
    pub fn with<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = self.command(&[]);
        command.args(arguments);
        command
    }
}

/// A directory that everybody may enter.
pub fn open_directory() -> TempDir {
    tempfile::Builder::new()
        .permissions(std::fs::Permissions::from_mode(0o755))
        .tempdir()
        .expect("a directory")
}

/// A directory that belongs to [`NOBODY`].
pub fn directory_of_nobody() -> TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    chown(directory.path(), Some(NOBODY), Some(NOBODY)).expect("root may give it away");
    directory
}
