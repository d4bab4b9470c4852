//! Programs for which something is scarce: a small disk in place of a directory, short files, few descriptors.

use patience::prelude::*;
use std::path::Path;
use std::process::{Command, Stdio};

/// `command` with these limits of the shell, such as `-n 8`: at most eight descriptors; `-f 100`: files of at most
/// 100 blocks of 512 bytes. The process is the program itself: the shell makes room for it.
pub fn limited(command: &Command, limits: &str) -> Command {
    wrapped("sh", &["-c", &format!("ulimit {limits} && exec \"$0\" \"$@\"")], command)
}

/// `command` where a disk of its own lies over `directory`, made with these options of tmpfs, such as
/// `size=100k`, which nobody else sees; `None` if no disk can be mounted here, not even in a namespace.
pub fn on_small_disk(command: &Command, directory: &Path, options: &str) -> Option<Command> {
    let mount = format!("mount -t tmpfs -o {options} tmpfs '{}'", directory.display());
    let mounted = mounted(command, &mount);
    if mounted.is_none() {
        eprintln!("skipped: no small disk can be mounted here; limited files cover the same path");
    }
    mounted
}

/// `command` where `directory` has a second name, which nobody else sees; `None` if nothing can be mounted here, not even
/// in a namespace.
pub fn mounted_twice(command: &Command, directory: &Path, name: &Path) -> Option<Command> {
    let mounted = mounted(command, &format!("mount --bind '{}' '{}'", directory.display(), name.display()));
    if mounted.is_none() {
        eprintln!("skipped: nothing can be mounted here; links give files two names elsewhere");
    }
    mounted
}

/// `command` after this command line, whose mounts nobody else sees.
fn mounted(command: &Command, mount: &str) -> Option<Command> {
    let rights = [&["--mount"][..], &["--user", "--map-root-user", "--mount"]];
    let is_possible = |rights: &&&[&str]| {
        let mut unshare = Command::new("unshare");
        unshare.args(**rights).args(["sh", "-c", mount]);
        unshare.stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success())
    };
    let rights = rights.iter().find(is_possible)?;
    eprintln!("mounted by unshare {}", rights.join(" "));
    let script = format!("{mount} && exec \"$0\" \"$@\"");
    Some(wrapped("unshare", &[rights, &["sh", "-c", &script][..]].concat(), command))
}

/// `outer` with these arguments and then the program and its own; surroundings as they were.
fn wrapped(outer: &str, arguments: &[&str], command: &Command) -> Command {
    let mut wrapped = Command::new(outer);
    wrapped.args(arguments).arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => wrapped.env(name, value),
            None => wrapped.env_remove(name),
        };
    }
    if let Some(directory) = command.get_current_dir() {
        wrapped.current_dir(directory);
    }
    wrapped
}
