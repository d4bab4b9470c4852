//! `io-driver stop`.
//!
//! Model: asked, then believed only when seen. A stop is done when the driver has ended and its last words say that the
//! motors were written zero. Without a named socket the first place is taken at which a driver can be asked.
//! Invariant: no exit status of 0 without that sight. Asking has a thread of its own, where the system gives one:
//! a driver that does not answer does not delay the words that motors may still be on. Without a thread it is asked
//! before anything is said.

use super::listeners::Listeners;
use super::places::{NotAsked, Places, is_elsewhere, nobody_asked, tell_of_unheard};
use super::prompt::{PROMPT, PromptWords};
use super::{EXIT_FAULT, EXIT_USAGE, fail};
use crate::print::print_outcome;
use crate::say::say;
use rt_core::epitaph::{self, EpitaphKind};
use shm_abi::DriverView;
use shm_abi::client::{self, AttachError, Attachment};
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// How long we look on after the words that nothing is certain.
const PATIENCE: Duration = Duration::from_secs(5);
/// Between two looks whether it has ended.
const LOOK: Duration = Duration::from_micros(500);
const NAME: &str = "io-driver";

/// Ends the driver, and says whether that was seen.
pub(super) fn stop(places: &Places) -> ExitCode {
    let mut not_asked: Vec<NotAsked> = Vec::new();
    for socket in &places.sockets {
        let Asked { ending, is_late } = ask_to_end(socket);
        match ending {
            // It was there, and ended while it was asked.
            (Some(observer), Err(error)) if is_elsewhere(&error) => {
                return wait_for_end(&observer, observer.driver_pid);
            }
            (None, Err(error)) if is_elsewhere(&error) && is_late => return say_without_last_words(),
            (_, Err(error)) if is_elsewhere(&error) => not_asked.push((socket.clone(), error)),
            (observer, answer) => {
                let code = judge_answer(observer, answer, &places.told(socket));
                let others = places.sockets.len() > 1;
                let listeners = if others { Listeners::find() } else { Listeners::default() };
                let is_one_unheard = tell_of_unheard(&not_asked, &listeners);
                tell_of_others(places, socket, &not_asked, &listeners);
                let may_go_on = is_one_unheard || listeners.is_cut_short();
                return if may_go_on { ExitCode::from(EXIT_FAULT) } else { code };
            }
        }
    }
    nobody_asked(places, &not_asked)
}

/// One driver was asked to end; another one goes on.
fn tell_of_others(places: &Places, asked: &Path, not_asked: &[NotAsked], listeners: &Listeners) {
    let was_tried = |socket: &Path| socket == asked || not_asked.iter().any(|(other, _)| other == socket);
    for socket in places.sockets.iter().filter(|socket| !was_tried(socket)) {
        if let Some(pid) = listeners.at(socket) {
            let socket = socket.display();
            say(format_args!(
                "io-driver: another driver, process {pid}, goes on; next: io-driver stop --socket {socket}"
            ));
        }
    }
}

fn judge_answer(observer: Option<Attachment>, answer: Result<u64, AttachError>, place: &str) -> ExitCode {
    let pid = match answer {
        Ok(pid) => pid,
        Err(error @ AttachError::NotAllowed { .. }) => return fail(&error, EXIT_USAGE),
        Err(error) => {
            say(format_args!("io-driver: {error}"));
            say(format_args!("io-driver: the motors may still be on; next: io-driver emergency-stop"));
            return ExitCode::from(EXIT_FAULT);
        }
    };
    // It stops, whether or not somebody reads that.
    print_outcome(&format!("driver (process {pid}) stops{place}"));
    let Some(observer) = observer.filter(|observer| observer.driver_pid == pid) else {
        say(format_args!(
            "io-driver: it cannot be watched ending; the motors may still be on: look yourself"
        ));
        return ExitCode::from(EXIT_FAULT);
    };
    wait_for_end(&observer, pid)
}

/// An observer's place, if there was one, and the driver's answer.
type Ending = (Option<Attachment>, Result<u64, AttachError>);

struct Asked {
    ending: Ending,
    /// Somebody held the socket and did not answer in time: the words that motors may still be on are said.
    is_late: bool,
}

/// Asks in a thread of its own, so that a driver that does not answer does not delay the words either; where there is
/// none, here.
fn ask_to_end(socket: &Path) -> Asked {
    let (tell, answers) = channel();
    let place = socket.to_path_buf();
    // It ends with the process, whatever it waits for.
    let asks = move || {
        let _ = tell.send(observe_and_stop(&place));
    };
    if std::thread::Builder::new().spawn(asks).is_err() {
        return Asked { ending: observe_and_stop(socket), is_late: false };
    }
    let in_time = answers.recv_timeout(PROMPT);
    let is_late = in_time.is_err();
    let answer = in_time.or_else(|_| {
        say_not_stopped();
        answers.recv()
    });
    // That thread cannot end without an answer but by a panic.
    Asked { ending: answer.unwrap_or_else(|_| observe_and_stop(socket)), is_late }
}

/// Looks on first, so that its last words can be read; without a place to look on the driver ends all the same.
fn observe_and_stop(socket: &Path) -> Ending {
    let observer = client::observe(socket, NAME).ok();
    (observer, client::stop(socket, NAME))
}

fn wait_for_end(observer: &Attachment, pid: u64) -> ExitCode {
    let begun = Instant::now();
    let mut is_warned = false;
    while observer.connection.is_open() && epitaph::read(&observer.driver.epitaph).is_none() {
        if !is_warned && begun.elapsed() > PROMPT {
            is_warned = true;
            say_not_stopped();
        }
        if begun.elapsed() > PATIENCE {
            say(format_args!("io-driver: process {pid} lives on; cut the motors' power, then kill it"));
            return ExitCode::from(EXIT_FAULT);
        }
        std::thread::sleep(LOOK);
    }
    judge_end(&observer.driver)
}

fn say_not_stopped() {
    say(format_args!("io-driver: it has not stopped within {PromptWords}: the motors may still be on"));
}

fn say_without_last_words() -> ExitCode {
    say(format_args!("io-driver: it ended without last words: the motors may still be on"));
    ExitCode::from(EXIT_FAULT)
}

fn judge_end(driver: &DriverView) -> ExitCode {
    let Some(words) = epitaph::read(&driver.epitaph) else { return say_without_last_words() };
    if words.kind != EpitaphKind::Stopped {
        say(format_args!("io-driver: it ended otherwise: {words}"));
        return ExitCode::from(EXIT_FAULT);
    }
    print_outcome(&format!("{words}; the motors were written zero"));
    ExitCode::SUCCESS
}
