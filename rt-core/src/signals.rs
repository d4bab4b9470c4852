//! Requests to stop, as a flag that a loop looks at.
//!
//! Problem: a signal's default action ends the process in the middle of a tick, motors on.
//! Model: SIGTERM, SIGINT and SIGHUP set one word; the loop reads it each tick and ends in order.
//! If ending hangs, the *same* SIGTERM or SIGINT once more, [`SAME_REQUEST`] or more after the first, performs the last
//! act ([`crate::last_act`]) and ends the process at once, by the default action and with its exit status. Others do
//! not mean "now": timeout(1) sends its signal to its child and right after that to the child's group, a terminal sends
//! SIGINT to parent and child alike, a parent then sends its child SIGTERM, and systemd may send SIGHUP right after
//! SIGTERM.
//! A SIGHUP that was ignored when the program began stays so: nohup(1) and shells that are left ask for that, of
//! applications and drivers alike, so that they outlive the terminal. Whoever is told of its parent's end by SIGHUP takes it
//! all the same ([`StopSignals::install_with_hangup`]).
//! The kernel hands a signal to any thread that does not block it, by preference to the first one, and that thread may be
//! stuck in a system call. A process that must hear them at once blocks them everywhere ([`block_in_this_thread`]) but in
//! one thread that is never stuck ([`receive_in_this_thread`]).
//! Invariants: installed for the rest of the process. A signal ends the sleep of the thread that
//! happens to receive it, not of all: a loop that sleeps long has to wake by itself. SIGPIPE stays
//! ignored, as Rust's start-up code leaves it: a write to a closed socket is an error, not a death.
//! Cost: one relaxed load a tick.

use crate::sys::at_once::end_when_repeated;
use crate::sys::inherited::is_ignored;
use nix::sys::signal::{SigSet, Signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Signals closer together than this are one request: longer than one sender takes to send it twice, shorter than
/// anybody's patience.
pub const SAME_REQUEST: Duration = Duration::from_millis(200);

/// Leaves SIGTERM, SIGINT and SIGHUP to the other threads; threads that are started from this one do the same.
///
/// # Errors
/// What pthread_sigmask(3) reports.
pub fn block_in_this_thread() -> io::Result<()> {
    Ok(stop_signals().thread_block()?)
}

/// Undoes [`block_in_this_thread`] for this thread; what came meanwhile is handled now.
///
/// # Errors
/// What pthread_sigmask(3) reports.
pub fn receive_in_this_thread() -> io::Result<()> {
    Ok(stop_signals().thread_unblock()?)
}

fn stop_signals() -> SigSet {
    [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP].into_iter().collect()
}

/// Catches SIGXFSZ, so that a file which may not grow any more is a failed write, as a full disk is. For the beginning of a
/// program: whatever it does may write.
///
/// # Errors
/// Errors of sigaction(2).
pub fn outlive_full_files() -> io::Result<()> {
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
}

/// Whether this process was asked to stop; by default nothing asks.
#[derive(Clone, Debug, Default)]
pub struct StopSignals {
    /// Number of the latest signal, 0 before the first.
    signal: Arc<AtomicUsize>,
}

impl StopSignals {
    /// Installs the handlers, that of SIGHUP only if it is not ignored. Clone the result for other threads; a second
    /// installation works too.
    ///
    /// # Errors
    /// What sigaction(2) reports.
    pub fn install() -> io::Result<Self> {
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        Self::install_for([SIGTERM, SIGINT].into_iter().chain(hangup))
    }

    /// The same, and that of SIGHUP in any case.
    ///
    /// # Errors
    /// Errors of sigaction(2).
    pub fn install_with_hangup() -> io::Result<Self> {
        Self::install_for([SIGTERM, SIGINT, SIGHUP])
    }

    fn install_for(numbers: impl IntoIterator<Item = i32>) -> io::Result<Self> {
        let signal = Arc::new(AtomicUsize::new(0));
        for number in [SIGTERM, SIGINT] {
            end_when_repeated(number, SAME_REQUEST)?;
        }
        for number in numbers {
            flag::register_usize(number, Arc::clone(&signal), number as usize)?;
        }
        outlive_full_files()?;
        Ok(Self { signal })
    }

    /// The signal that asked this process to stop, the latest if there were several. Fit for the
    /// loop.
    #[must_use]
    pub fn requested(&self) -> Option<i32> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            number => Some(number as i32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_child;
    use nix::sys::signal::raise;
    use patience::prelude::*;
    use std::os::unix::process::ExitStatusExt;
    use std::process::ExitStatus;

    #[test]
    fn a_signal_to_the_process_is_handled_by_the_thread_that_receives_it_while_all_others_block_it() {
        const OWN: &str = "signals::tests::a_signal_to_the_process_is_handled_by_the_thread_that_receives_it_while_all_others_block_it";
        if test_child::role(OWN).is_some() {
            let stop = StopSignals::install().unwrap();
            // The test runner's own main thread would take it; it is handed to this one by name instead.
            block_in_this_thread().unwrap();
            raise(Signal::SIGTERM).unwrap();
            assert_eq!(stop.requested(), None, "it waits");
            receive_in_this_thread().unwrap();
            std::process::exit(stop.requested().unwrap_or(0));
        }
        assert_eq!(test_child::command(OWN, "play").bounded_status().unwrap().code(), Some(SIGTERM));
    }

    const TEST: &str = "signals::tests::stop_signals_set_the_flag_and_repeated_ones_kill";

    /// In child processes: the handlers are for good, and the runner's own Ctrl-C must keep working.
    #[test]
    fn stop_signals_set_the_flag_and_repeated_ones_kill() {
        if let Some(role) = test_child::role(TEST) {
            play(&role);
        }
        for once in ["SIGTERM", "SIGINT", "SIGHUP"] {
            let number = once.parse::<Signal>().unwrap() as i32;
            assert_eq!(outcome(once).code(), Some(number), "{once} is a request");
        }
        assert_eq!(outcome("").code(), Some(0), "no signal, no request");
        assert_eq!(outcome("SIGTERM later SIGTERM").signal(), Some(SIGTERM));
        assert_eq!(outcome("SIGINT later SIGINT").signal(), Some(SIGINT));
        assert_eq!(outcome("SIGTERM SIGTERM").code(), Some(SIGTERM), "one request, delivered twice");
        assert_eq!(outcome("SIGTERM SIGTERM later SIGTERM").signal(), Some(SIGTERM));
        assert_eq!(outcome("SIGINT SIGTERM").code(), Some(SIGTERM), "still a request");
        assert_eq!(outcome("SIGTERM SIGHUP SIGHUP").code(), Some(SIGHUP), "still a request");
    }

    const NOHUP: &str =
        "signals::tests::a_hangup_that_was_ignored_at_the_beginning_stays_so_unless_it_is_asked_for";

    #[test]
    fn a_hangup_that_was_ignored_at_the_beginning_stays_so_unless_it_is_asked_for() {
        if let Some(role) = test_child::role(NOHUP) {
            play(&role);
        }
        let outcome = |role: &str| {
            let child = test_child::command(NOHUP, role);
            let mut shell = std::process::Command::new("sh");
            shell
                .args(["-c", "trap '' HUP; exec \"$0\" \"$@\""])
                .arg(child.get_program())
                .args(child.get_args());
            shell.envs(child.get_envs().filter_map(|(name, value)| Some((name, value?))));
            shell.bounded_status().unwrap().code()
        };
        assert_eq!(outcome("SIGHUP"), Some(0), "as nohup(1) asks for");
        assert_eq!(outcome("SIGHUP SIGTERM SIGHUP"), Some(SIGTERM), "the others are heard");
        assert_eq!(outcome("hangup SIGHUP"), Some(SIGHUP), "a parent's end is");
    }

    /// Receives the signals and exits with the number of the one requested.
    fn play(signals: &str) -> ! {
        let (stop, signals) = match signals.strip_prefix("hangup ") {
            Some(signals) => (StopSignals::install_with_hangup().unwrap(), signals),
            None => (StopSignals::install().unwrap(), signals),
        };
        assert_eq!(stop.requested(), None);
        for name in signals.split_whitespace() {
            match name {
                "later" => std::thread::sleep(SAME_REQUEST),
                name => raise(name.parse().unwrap()).unwrap(),
            }
        }
        std::process::exit(stop.requested().unwrap_or(0))
    }

    fn outcome(signals: &str) -> ExitStatus {
        test_child::command(TEST, signals).bounded_status().unwrap()
    }
}
