//! Places of drivers: the socket that somebody named, or the usual ones.

use super::listeners::{Listener, Listeners, There};
use super::{EXIT_FAULT, EXIT_USAGE};
use crate::say::say;
use clap::Args;
use shm_abi::client::AttachError;
use shm_abi::endpoint;
use shm_abi::users::UserWords;
use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The socket to ask at.
#[derive(Debug, Args)]
pub struct SocketArgs {
    /// The driver's socket
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
}

impl SocketArgs {
    /// The one driver to ask; says what was passed over.
    pub(super) fn path(&self) -> PathBuf {
        self.socket.clone().unwrap_or_else(|| usual_socket("io-driver"))
    }

    /// Every place where a driver may have to be stopped.
    pub(super) fn places(&self) -> Places {
        match self.socket.clone().or_else(endpoint::named) {
            Some(socket) => Places { sockets: vec![socket], is_named: true },
            None => Places { sockets: endpoint::candidates(), is_named: false },
        }
    }
}

/// The driver's place for `program` if nobody names a socket; says which sockets were passed over.
pub fn usual_socket(program: &str) -> PathBuf {
    let found = endpoint::find();
    if let Some(words) = found.words() {
        say(format_args!("{program}: {words}"));
    }
    found.socket
}

/// Places to ask at.
#[derive(Debug, Clone)]
pub(super) struct Places {
    pub(super) sockets: Vec<PathBuf>,
    /// Somebody named the one that is in question.
    pub(super) is_named: bool,
}

impl Places {
    /// The place of a driver, for a message: nothing to say if it is the only one.
    pub(super) fn told(&self, socket: &Path) -> String {
        if self.sockets.len() > 1 { format!(" ({})", socket.display()) } else { String::new() }
    }
}

/// A place where nobody could be asked, and why.
pub(super) type NotAsked = (PathBuf, AttachError);

/// Tells of the drivers that listen at places where they cannot be asked, a socket's file having been moved, deleted or
/// closed to us; whether there is one. They push on.
pub(super) fn tell_of_unheard(not_asked: &[NotAsked], listeners: &Listeners) -> bool {
    let mut is_one_there = false;
    for (socket, error) in not_asked {
        let Some(pid) = listeners.at(socket) else { continue };
        is_one_there = true;
        say(format_args!("io-driver: {error}"));
        let why = match error {
            AttachError::NoDriver { .. } | AttachError::DriverGone { .. } => {
                ", and its socket's file was moved or deleted, or is in a container"
            }
            _ => "",
        };
        let or = match error {
            AttachError::NoPermission { .. } | AttachError::NotAllowed { .. } => "ask one who may".to_owned(),
            _ => ending(pid),
        };
        say(format_args!(
            "io-driver: but process {pid} listens there{why}: the motors may still be on; cut their power, or {or}"
        ));
    }
    if listeners.is_cut_short() {
        say(format_args!(
            "io-driver: there was no time to look at all processes that are called like a driver: others may go on that \
             were not asked"
        ));
    }
    is_one_there
}

/// Nobody could be asked anywhere: says why, and which drivers live elsewhere.
pub(super) fn nobody_asked(places: &Places, not_asked: &[NotAsked]) -> ExitCode {
    let listeners = Listeners::find();
    if tell_of_unheard(not_asked, &listeners) {
        return ExitCode::from(EXIT_FAULT);
    }
    let is_telling = |(_, error): &&NotAsked| !matches!(error, AttachError::NoDriver { .. });
    let first = not_asked.iter().find(is_telling).or(not_asked.first());
    if let Some((_, error)) = first {
        say(format_args!("io-driver: {error}"));
    }
    let is_one_silent = not_asked.iter().any(|(_, error)| is_silent(error));
    let mut code = if is_one_silent || listeners.is_cut_short() { EXIT_FAULT } else { EXIT_USAGE };
    // Each once: the first of its sockets is the most certain one.
    let mut told = BTreeSet::new();
    let others: Vec<&Listener> = listeners.all.iter().filter(|other| told.insert(other.pid)).collect();
    for other in others.iter().copied().take(MOST_TOLD) {
        let is_told_once = listeners.all.iter().filter(|one| one.pid == other.pid).count() == 1;
        let who = OtherWords { other, is_told_once };
        // Whoever names a driver that is not there has at least heard of those that are.
        if places.is_named {
            say(format_args!("io-driver: {who}, and was not asked"));
            continue;
        }
        code = EXIT_FAULT;
        // Whatever a stranger's process says of itself is not to be asked instead.
        let socket = if other.is_ours() && other.there == There::Itself {
            format!("use --socket {}, ", other.socket.display())
        } else {
            String::new()
        };
        say(format_args!(
            "io-driver: {who}, and was not asked: the motors may still be on; {socket}cut their power, or {}",
            ending(other.pid)
        ));
    }
    let more = others.len().saturating_sub(MOST_TOLD);
    if more > 0 {
        say(format_args!("io-driver: and {more} more that are called like a driver"));
    }
    ExitCode::from(code)
}

/// A driver at another place: what is certain of it, and what is not.
struct OtherWords<'a> {
    other: &'a Listener,
    /// Only one socket is said to be its own: of several, somebody has made the others up.
    is_told_once: bool,
}

impl fmt::Display for OtherWords<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Listener { pid, owner, socket, there } = self.other;
        let (socket, user) = (socket.display(), UserWords(owner.user));
        match (self.other.is_ours(), there) {
            (true, There::Itself) => write!(f, "process {pid} is a driver at {socket}"),
            (true, There::Nobody) if self.is_told_once => {
                write!(f, "process {pid} is called like a driver, by its socket's name at {socket}")
            }
            (true, _) => write!(f, "process {pid} is called like a driver"),
            (false, _) => {
                write!(f, "process {pid} of {user} is called like a driver, and tells of a socket {socket}")
            }
        }
    }
}

/// Somebody listens and says nothing: nobody knows what became of the motors.
pub(super) fn is_silent(error: &AttachError) -> bool {
    !is_elsewhere(error) || matches!(error, AttachError::HungUp { .. })
}

/// There is no driver at this place for us to ask, or none for long.
pub(super) fn is_elsewhere(error: &AttachError) -> bool {
    matches!(
        error,
        AttachError::NoDriver { .. }
            | AttachError::DriverGone { .. }
            | AttachError::NoPermission { .. }
            | AttachError::NotADriver { .. }
            | AttachError::HungUp { .. }
    )
}

/// More words than these scroll away what matters.
const MOST_TOLD: usize = 8;

/// Command that ends a process which does not answer; a stopped one takes no signal but SIGKILL.
fn ending(pid: u32) -> String {
    let signal = if is_stopped(pid) { "KILL" } else { "TERM" };
    format!("end it with `kill -{signal} {pid}`")
}

/// State of a process: stopped, as by SIGSTOP, proc(5).
fn is_stopped(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The name before it may have any characters.
    stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with(['T', 't']))
}

#[cfg(test)]
mod tests {
    use patience::prelude::*;
    use rustix::process::{Pid, Signal, kill_process};

    use super::*;

    #[test]
    fn a_stopped_process_is_not_asked_to_end_by_a_signal_that_it_does_not_take() {
        let mut child = std::process::Command::new("sleep").arg("60").spawn().expect("a process");
        let pid = child.id();
        assert!(ending(pid).contains("kill -TERM"));
        let own = Pid::from_child(&child);
        kill_process(own, Signal::STOP).expect("it is sent");
        patience::until("a stopped process", || is_stopped(pid));
        assert!(ending(pid).contains("kill -KILL"));
        child.kill().expect("it is sent");
        child.bounded_wait();
    }
}
