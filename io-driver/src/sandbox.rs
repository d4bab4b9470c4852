//! Takes from the running driver every right that it does not need.
//!
//! Problem: the driver starts with real-time rights, perhaps as root, and then talks to strangers for hours.
//! Model, in this order, each read back from the kernel: locked memory is made independent of the capability;
//! all threads, those of service, loop and stops, give up their capabilities and the possibility of new ones; a driver started by root becomes
//! the configured user; once it listens, all system calls but those of [`allowed_calls`] are shut out, for
//! all threads at once, those that stop and log among them. What was opened, mapped, locked and promoted before stays.
//! Invariant: nothing here is needed to run; what is missing is told, and refused by `--strict`.

pub mod allowed_calls;

use crate::config::ProcessConfig;
use crate::say;
use allowed_calls::{ALLOWED_CALLS, REFUSED_CALLS};
use rt_core::privileges::{self, Keep, User, UserError};
use rt_core::setup::{Guarantee, SetupReport};
use std::path::Path;

/// The user to become; `None`: it stays who it is.
///
/// # Errors
/// If the configuration names nobody that this machine knows.
pub fn user_to_become(config: &ProcessConfig) -> Result<Option<User>, UserError> {
    let user = config.user.as_deref().map(User::look_up).transpose()?;
    Ok(user.filter(|user| !user.is_own()))
}

/// Makes the directory that the socket will lie in, and gives it to the user. One that is there already is
/// left as it is; whatever fails, fails again with a better report when the driver wants to listen.
pub fn make_directory_for(user: &User, socket: &Path) {
    use std::os::unix::fs::DirBuilderExt;
    let Some(directory) = socket.parent().filter(|directory| !directory.as_os_str().is_empty()) else {
        return;
    };
    if std::fs::DirBuilder::new().mode(0o750).create(directory).is_ok() {
        let _ = std::os::unix::fs::chown(directory, Some(user.uid), Some(user.gid));
    }
}

/// Gives up all rights of the process. `others` makes every other thread call
/// [`reduce_thread`](privileges::reduce_thread) and waits until it has.
///
/// # Errors
/// If it cannot become `user`.
pub fn give_up_rights(
    user: Option<&User>,
    report: &mut SetupReport,
    others: impl Fn(Keep),
) -> Result<(), UserError> {
    report.guarantees.extend(privileges::keep_memory_locked());
    let everywhere = |keep| {
        others(keep);
        privileges::reduce_thread(keep);
    };
    if let Some(user) = user {
        // The C library changes the user of every thread, so each must keep the right to it until then.
        everywhere(Keep::ChangeOfUser);
        user.become_for_good()?;
    }
    everywhere(Keep::Nothing);
    report.guarantees.push(privileges::judge(user));
    Ok(())
}

/// Shuts out all system calls that are not allowed, from now on and in every thread; or says that they are not.
pub fn shut(config: &ProcessConfig) -> Guarantee {
    if config.sandbox {
        return rt_core::sandbox::shut(ALLOWED_CALLS, REFUSED_CALLS);
    }
    Guarantee {
        name: "system calls",
        wanted: "all".into(),
        found: "all (`sandbox = false` in the configuration)".into(),
        obtained: true,
        remedy: None,
        circumstance: false,
    }
}

/// The standard library's hook reads files for a backtrace if the environment asks for one. In the sandbox
/// that would be fatal, in the very moment in which the panic is about to be caught and the motors zeroed. Call
/// it before other hooks are put in front.
pub fn say_panics_plainly() {
    std::panic::set_hook(Box::new(|info| {
        let thread = std::thread::current();
        say::say(format_args!("thread '{}' {info}", thread.name().unwrap_or("without name")));
    }));
}
