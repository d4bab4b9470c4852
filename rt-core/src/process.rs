//! A child that must not outlive its parent.
//!
//! Problem: a driver started by an application that is killed would hold the device for ever.
//! Model: the kernel sends a signal of our choice when the parent ends (`PR_SET_PDEATHSIG`). A
//! parent that ended *before* the request leaves no signal, so the parent's id is checked after it.
//! Invariants: after `Ok` the signal comes whenever the parent ends; after `Err` nothing is changed.
//! Beware: to the kernel the parent is the *thread* that started the child; start it from one that
//! lives as long as the process. When that thread ends before the others, as it may under SIGKILL,
//! the child passes to one of them and the signal comes again at its end: choose a signal that may
//! come twice. Changing credentials, or executing a program with set-user-id bit or file
//! capabilities, clears the request: make it in the program itself, not between fork and exec.

use nix::errno::Errno;
use nix::sys::prctl::{get_pdeathsig, set_pdeathsig};
use nix::sys::signal::Signal;
use nix::unistd::getppid;
use std::io::Write;
use std::process::ExitCode;
use thiserror::Error;

/// Why the child is not tied to its parent.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum DieWithParentError {
    /// Not a signal.
    #[error("{signal} is not the number of a signal; use for instance SIGTERM, 15, or SIGKILL, 9")]
    NoSuchSignal {
        /// What was given.
        signal: i32,
    },
    /// The kernel refused.
    #[error("the kernel refused to send signal {signal} at the parent's end: {cause}")]
    Refused {
        /// The signal asked for.
        signal: i32,
        /// What the kernel said.
        cause: Errno,
    },
    /// The parent ended first; the child should end too.
    #[error("the parent (process {expected}) has ended already; this process now belongs to {found}")]
    ParentGone {
        /// The parent as the caller knew it.
        expected: u32,
        /// The parent now.
        found: u32,
    },
}

/// Makes the kernel send `signal` to this process when its parent ends.
///
/// `expected_parent_pid` is the parent's own id, handed to the child by argument or environment:
/// [`std::os::unix::process::parent_id`] asked in the child may already name the adopting process.
///
/// # Errors
/// If the parent has ended already, the number is no signal, or the kernel refuses.
pub fn die_with_parent(expected_parent_pid: u32, signal: i32) -> Result<(), DieWithParentError> {
    let wanted = Signal::try_from(signal).map_err(|_| DieWithParentError::NoSuchSignal { signal })?;
    let refused = |cause| DieWithParentError::Refused { signal, cause };
    let former = get_pdeathsig().map_err(refused)?;
    set_pdeathsig(wanted).map_err(refused)?;
    let found = getppid().as_raw().unsigned_abs();
    if found == expected_parent_pid {
        return Ok(());
    }
    set_pdeathsig(former).map_err(refused)?;
    Err(DieWithParentError::ParentGone { expected: expected_parent_pid, found })
}

/// Ends the process at once, without the handlers that libraries have left for its end: one of them may wait for what
/// never comes.
pub fn exit_without_handlers(code: ExitCode) -> ! {
    let _ = std::io::stdout().flush();
    let number = (0..=u8::MAX).find(|number| ExitCode::from(*number) == code);
    signal_hook::low_level::exit(number.unwrap_or(u8::MAX).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_child;
    use patience::prelude::*;
    use std::io::Read;
    use std::process::Stdio;
    use std::time::Duration;

    const TEST: &str = "process::tests::a_child_dies_when_its_parent_does";
    const PARENT: &str = "RT_CORE_TEST_PARENT";
    /// Well above what a busy machine needs to deliver a signal; a child that lives on says so.
    const LIFE: Duration = Duration::from_secs(30);

    /// This process starts a parent, the parent starts a child and ends. The child holds the pipe
    /// that this process reads: the pipe ends when the child does.
    #[test]
    fn a_child_dies_when_its_parent_does() {
        match test_child::role(TEST).as_deref() {
            Some("parent") => play_parent(),
            Some(_) => play_child(),
            None => {}
        }
        let mut parent = test_child::command(TEST, "parent").stdout(Stdio::piped()).spawn().unwrap();
        let mut said = String::new();
        parent.stdout.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(parent.bounded_wait().success());
        assert!(said.contains("tied"), "{said}");
        assert!(!said.contains("outlived"), "{said}");
    }

    /// Ends once the child is tied to it, without waiting for the child's end.
    fn play_parent() -> ! {
        let (mut tied, tell) = std::io::pipe().unwrap();
        let id = std::process::id().to_string();
        let mut child = test_child::command(TEST, "child");
        child.env(PARENT, id).stdout(Stdio::inherit()).stderr(Stdio::from(tell)).spawn().unwrap();
        let mut byte = [0];
        tied.read_exact(&mut byte).unwrap();
        std::process::exit(0)
    }

    fn play_child() -> ! {
        let parent = std::env::var(PARENT).unwrap().parse().unwrap();
        println!("{}", if die_with_parent(parent, libc::SIGKILL).is_ok() { "tied" } else { "refused" });
        eprintln!("tied");
        std::thread::sleep(LIFE);
        println!("outlived its parent");
        std::process::exit(1)
    }

    #[test]
    fn a_parent_that_is_gone_is_an_error_and_changes_nothing() {
        let before = get_pdeathsig().unwrap();
        let found = std::os::unix::process::parent_id();
        let expected = std::process::id();
        let result = die_with_parent(expected, libc::SIGKILL);
        assert_eq!(result, Err(DieWithParentError::ParentGone { expected, found }));
        assert_eq!(get_pdeathsig().unwrap(), before);
    }

    #[test]
    fn a_number_that_is_no_signal_is_refused() {
        let result = die_with_parent(std::os::unix::process::parent_id(), 4711);
        assert_eq!(result, Err(DieWithParentError::NoSuchSignal { signal: 4711 }));
    }
}
