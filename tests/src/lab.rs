//! A laboratory's workstation made of directories: the installation of `config/system` under a root of its own.

use crate::programs;
use patience::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Where programs go unless told otherwise.
pub const PREFIX: &str = "/usr/local";

/// The root directory of a machine that does not exist.
#[derive(Debug)]
pub struct Lab {
    root: TempDir,
    programs: TempDir,
}

impl Lab {
    /// With nothing in it yet; the programs to be installed are stand-ins that do nothing.
    pub fn bare() -> Self {
        let lab = Self::without_programs();
        for name in ["io-driver", "phantom3"] {
            let path = lab.programs.path().join(name);
            fs::write(&path, "#!/bin/sh\n").expect("a file");
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("our own file");
        }
        lab
    }

    /// With the programs under test to be installed.
    pub fn with_programs_under_test() -> Self {
        let lab = Self::without_programs();
        for (name, program) in [("io-driver", programs::io_driver()), ("phantom3", programs::phantom3())] {
            std::os::unix::fs::symlink(program.get_program(), lab.programs.path().join(name))
                .expect("a link");
        }
        lab
    }

    fn without_programs() -> Self {
        let [root, programs] = [(); 2].map(|()| tempfile::tempdir().expect("a directory"));
        Self { root, programs }
    }

    /// Where a file of the installed machine really lies.
    pub fn path(&self, installed: impl AsRef<Path>) -> PathBuf {
        let installed = installed.as_ref();
        self.root.path().join(installed.strip_prefix("/").unwrap_or(installed))
    }

    /// The text of an installed file.
    pub fn read(&self, installed: &str) -> String {
        let path = self.path(installed);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// Writes a file of the installed machine.
    pub fn write(&self, installed: &str, text: &str) {
        let path = self.path(installed);
        fs::create_dir_all(path.parent().expect("not the root")).expect("a directory");
        fs::write(path, text).expect("a file");
    }

    /// The text of an installed file, with the programs and configuration where they really lie.
    pub fn with_real_paths(&self, installed: &str) -> String {
        let root = self.root.path().display().to_string();
        self.read(installed)
            .replace(PREFIX, &format!("{root}{PREFIX}"))
            .replace("/etc/phantom3", &format!("{root}/etc/phantom3"))
    }

    /// The installer, ready for more arguments.
    pub fn installer(&self) -> Command {
        self.installer_of(&sources())
    }

    /// The installer of another copy of `config/system`.
    pub fn installer_of(&self, sources: &Path) -> Command {
        let mut command = self.installer_for_this_machine(sources);
        // Whatever the machine that tests has.
        command.args(["--cpus", "8"]);
        command
    }

    /// The same with the CPUs that the machine that tests has.
    pub fn installer_for_this_machine(&self, sources: &Path) -> Command {
        let mut command = Command::new("sh");
        command.arg(sources.join("install.sh"));
        command.arg("--destdir").arg(self.root.path()).arg("--binaries").arg(self.programs.path());
        command
    }

    /// Installs; returns what was said.
    pub fn install(&self, arguments: &[&str]) -> String {
        succeed(self.installer().args(arguments))
    }

    /// Every file and directory below a directory of the machine, by the path it would be installed at.
    pub fn files(&self, below: &str) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        walk(&self.path(below), &mut |path| {
            let installed = Path::new("/").join(path.strip_prefix(self.root.path()).expect("below the root"));
            files.insert(installed.display().to_string(), fs::read(path).unwrap_or_default());
        });
        files
    }
}

/// `config/system` of the project.
pub fn sources() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().expect("the project").join("config/system")
}

/// Calls `see` for everything below a directory.
pub fn walk(directory: &Path, see: &mut impl FnMut(&Path)) {
    for entry in fs::read_dir(directory).expect("a directory").flatten() {
        let path = entry.path();
        see(&path);
        if path.is_dir() && !path.is_symlink() {
            walk(&path, see);
        }
    }
}

/// Runs a program that has to succeed without a complaint; returns what it said.
pub fn succeed(command: &mut Command) -> String {
    let (status, out, err) = programs::said(&command.bounded_output().expect("it runs"));
    assert_eq!((status, err.as_str()), (Some(0), ""), "{command:?}\n{out}");
    out
}

/// A tool of the system, if it is installed; else says that a check is skipped and how the same is tested.
pub fn tool(name: &str, instead: &str) -> Option<Command> {
    let works =
        Command::new(name).arg("--version").bounded_output().is_ok_and(|output| output.status.success());
    if !works {
        println!("skipped: {name} is not installed; {instead}");
    }
    works.then(|| Command::new(name))
}
