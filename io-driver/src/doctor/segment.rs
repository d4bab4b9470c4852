//! The driver's socket: is there a place for it, does anybody listen, does it speak our version, who may come?

use super::user::User;
use crate::status;
use rt_core::doctor::machine::{FileStatus, Machine, Obstacle};
use rt_core::doctor::step::{Action, Step};
use rt_core::doctor::{Finding, Judged, Judgement, Remedy};
use rt_core::installed::{DRIVER_UNIT, GROUP as REAL_TIME_GROUP, RUNTIME_DIRECTORY, UNITS};
use shm_abi::client::{self, AttachError};
use shm_abi::handshake::own_version_text;
use std::path::Path;

/// What a driver answered, or why there is no answer.
pub type Answer = Result<Seen, AttachError>;

/// A driver that answered.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Seen {
    /// Its process id.
    pub pid: u64,
    /// Its devices that do not know where they are.
    pub not_zeroed: Vec<String>,
}

/// Asks the driver at a socket who it is, as an observer: no lease, and gone again at once.
pub fn ask(socket: &Path) -> Answer {
    client::observe(socket, "io-driver doctor").map(|attachment| Seen {
        pid: attachment.driver_pid,
        not_zeroed: status::not_zeroed(&attachment.driver),
    })
}

const GROUP: &str = "segment";

struct SegmentCheck {
    id: &'static str,
    title: &'static str,
    why: &'static str,
    run: fn(&Machine<'_>, &str, &Answer) -> Judged,
}

const CHECKS: [SegmentCheck; 5] = [
    SegmentCheck {
        id: "segment.directory",
        title: "runtime directory",
        why: "The driver makes its socket there, and applications look for it there.",
        run: directory,
    },
    SegmentCheck {
        id: "segment.socket",
        title: "socket",
        why: "A socket without a listener is left over from a driver that died; one that does not answer is stopped.",
        run: socket,
    },
    SegmentCheck {
        id: "segment.abi",
        title: "contract version",
        why: "A driver of another version would be refused by every application, or misread.",
        run: version,
    },
    SegmentCheck {
        id: "segment.reach",
        title: "who can reach it",
        why: "Whoever can open the socket can command the motors and stop the driver.",
        run: reach,
    },
    SegmentCheck {
        id: "segment.zeroed",
        title: "zeroed devices",
        why: "As long as one device does not know where it is, none gets force.",
        run: zeroed,
    },
];

/// The questions about a socket and who listens there.
pub fn examine(machine: &Machine<'_>, socket: &str, answer: &Answer) -> Vec<Finding> {
    let ask = |check: &SegmentCheck| {
        let judgement = (check.run)(machine, socket, answer).unwrap_or_else(Judgement::from);
        let SegmentCheck { id, title, why, .. } = *check;
        Finding { group: GROUP, id, title, why, judgement }
    };
    CHECKS.iter().map(ask).collect()
}

fn parent_of(socket: &str) -> &str {
    match socket.rsplit_once('/') {
        Some(("", _)) | None => "/",
        Some((directory, _)) => directory,
    }
}

fn directory(machine: &Machine<'_>, socket: &str, _: &Answer) -> Judged {
    let path = parent_of(socket);
    match machine.status(path) {
        Ok(status) if !status.is_directory => {
            let text = format!("move {path} out of the way, or name another socket with PHANTOM3_SOCKET");
            Ok(Judgement::fail(format!("{path} is no directory"), Remedy::words(text)))
        }
        Ok(status) => Ok(judge_directory(path, &status)),
        Err(Obstacle::Absent(_)) => absent_directory(machine, path),
        Err(obstacle) => Err(obstacle),
    }
}

fn judge_directory(path: &str, status: &FileStatus) -> Judgement {
    let found = format!("{path}, mode {:04o}, owner {}, group {}", status.mode, status.uid, status.gid);
    // A sticky directory keeps strangers from replacing the socket.
    if status.mode & 0o002 != 0 && status.mode & 0o1000 == 0 {
        let text = format!("chmod o-w {path}");
        return Judgement::fail(
            format!("{found}: anybody can put a socket of their own there"),
            Remedy::words(text),
        );
    }
    Judgement::pass(found)
}

/// The driver makes the last part of the path itself, with mode 0750, if it may.
fn absent_directory(machine: &Machine<'_>, path: &str) -> Judged {
    let user = User::of(machine)?;
    if machine.status(parent_of(path)).is_ok_and(|above| user.may_write(&above)) {
        return Ok(Judgement::pass(format!("{path} does not exist yet; the driver makes it")));
    }
    if path == RUNTIME_DIRECTORY && machine.exists(&format!("{UNITS}/{DRIVER_UNIT}")) {
        return Ok(Judgement::pass(format!(
            "{path} does not exist yet; {DRIVER_UNIT} makes it when it starts"
        )));
    }
    let step = Step {
        what: "a place for the driver's socket".into(),
        action: Action::Directory { path: path.to_owned(), mode: 0o770 },
    };
    let text = format!(
        "RuntimeDirectory=phantom3 in the driver's systemd unit, or \"d {path} 0770 root {REAL_TIME_GROUP} -\" in \
         /etc/tmpfiles.d; an ordinary login has $XDG_RUNTIME_DIR instead"
    );
    Ok(Judgement::warn(format!("{path} does not exist"), Remedy::steps(text, [step])))
}

fn socket(_: &Machine<'_>, _: &str, answer: &Answer) -> Judged {
    Ok(match answer {
        Ok(seen) => Judgement::pass(format!("driver, process {}, answers", seen.pid)),
        Err(AttachError::NoDriver { .. }) => Judgement::pass("no driver is running"),
        Err(
            AttachError::WrongVersion { .. }
            | AttachError::WrongLayout { .. }
            | AttachError::UnknownRequest { .. },
        ) => Judgement::pass("a driver answers"),
        Err(AttachError::DriverGone { socket }) => {
            let text = "start the driver again: it replaces the socket";
            let step =
                Step::by_hand(format!("{} is left over from a driver that died: {text}", socket.display()));
            Judgement::warn(format!("{} has no listener", socket.display()), Remedy::steps(text, [step]))
        }
        Err(
            AttachError::NoPermission { .. }
            | AttachError::NotAllowed { .. }
            | AttachError::NothingToAttach { .. }
            | AttachError::Refused(_)
            | AttachError::LeaseHeld { .. }
            | AttachError::System { .. }
            | AttachError::Unread { .. },
        ) => {
            let text = "ask as a user who may use the socket";
            Judgement::unreadable(told(answer), Remedy::words(text))
        }
        Err(AttachError::NoAnswer { seconds, .. }) => {
            let text = "see `ps`: continue the driver (kill -CONT PID) or kill it";
            Judgement::fail(
                format!("somebody listens and does not answer within {seconds} s"),
                Remedy::words(text),
            )
        }
        Err(AttachError::NotADriver { .. } | AttachError::HungUp { .. } | AttachError::Segment(_)) => {
            Judgement::fail(
                told(answer),
                Remedy::words("name another socket with PHANTOM3_SOCKET, or end that program"),
            )
        }
    })
}

/// What stood in the way, without the advice that its message ends with.
fn told(answer: &Answer) -> String {
    let text = answer.as_ref().err().map_or_else(String::new, AttachError::to_string);
    text.split("; ").next().unwrap_or_default().to_owned()
}

fn version(_: &Machine<'_>, _: &str, answer: &Answer) -> Judged {
    let ours = own_version_text();
    Ok(match answer {
        Ok(_) => Judgement::pass(format!("{ours}, the driver's too")),
        Err(AttachError::NoDriver { .. } | AttachError::DriverGone { .. }) => {
            Judgement::pass(format!("{ours}; no driver to compare with"))
        }
        Err(AttachError::WrongVersion { found, expected }) => Judgement::fail(
            format!("the driver's is {found}, ours {expected}"),
            Remedy::words("install driver and application from the same release, and start the driver again"),
        ),
        Err(AttachError::WrongLayout { found, expected, .. }) => Judgement::fail(
            format!("both {ours}, but the driver's layout is {found:#018x}, ours {expected:#018x}"),
            Remedy::words("one of the two is a modified build: build both from the same source"),
        ),
        Err(_) => Judgement::unreadable(
            "the driver did not say",
            Remedy::words("see the line before: who listens there, and may you ask?"),
        ),
    })
}

fn zeroed(_: &Machine<'_>, _: &str, answer: &Answer) -> Judged {
    Ok(match answer {
        Ok(seen) if seen.not_zeroed.is_empty() => Judgement::pass("every device knows where it is"),
        Ok(seen) => {
            let names = seen.not_zeroed.join(", ");
            let text = "bring each into its zeroing pose, then `io-driver zero`";
            let step = Step::by_hand(format!("not zeroed: {names}: {text}"));
            Judgement::warn(format!("not zeroed: {names}"), Remedy::steps(text, [step]))
        }
        Err(_) => Judgement::pass("no driver was asked"),
    })
}

fn reach(machine: &Machine<'_>, socket: &str, _: &Answer) -> Judged {
    let status = match machine.status(socket) {
        Ok(status) => status,
        Err(Obstacle::Absent(_)) => return Ok(Judgement::pass("nobody: there is no socket")),
        Err(obstacle) => return Err(obstacle),
    };
    let found = format!("mode {:04o}, owner {}, group {}", status.mode & 0o777, status.uid, status.gid);
    // To connect one needs to write to the socket and to pass every directory above.
    let is_passable =
        |directory: &str| machine.status(directory).is_ok_and(|status| status.mode & 0o001 != 0);
    let directories =
        socket.char_indices().filter(|(at, c)| *c == '/' && *at > 0).map(|(at, _)| &socket[..at]);
    let is_open = status.mode & 0o002 != 0 && directories.into_iter().all(is_passable);
    if is_open {
        let text = format!("chmod o-rwx {socket}; the driver makes it with mode 0660");
        return Ok(Judgement::warn(format!("{found}: every user of this machine"), Remedy::words(text)));
    }
    let who = if status.mode & 0o020 != 0 { "the owner, the group and root" } else { "the owner and root" };
    Ok(Judgement::pass(format!("{found}: {who}")))
}
