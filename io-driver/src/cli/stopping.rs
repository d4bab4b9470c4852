//! `io-driver emergency-stop` and `io-driver stop`.
//!
//! Model: asked in every way there is, then believed only when seen. An emergency stop goes by datagram and over a
//! connection; it is done when a new frame shows the fault and no force in any device. A stop is done when the driver has
//! ended and its last words say that the motors were written zero.
//! Invariant: no exit status of 0 without that sight. Asking and looking have threads of their own: neither a driver
//! that does not answer nor one without a free place delays the words that motors may still be on.

use super::{EXIT_FAULT, EXIT_USAGE, fail, print_line};
use crate::say::say;
use rt_core::epitaph::{self, EpitaphKind};
use shm_abi::client::{self, AttachError, Attachment};
use shm_abi::{DriverState, DriverView, FaultReason, Frame, stop_socket};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// How long a stop may take before we say that nothing is certain.
const PROMPT: Duration = Duration::from_millis(100);
/// How long we look on after that.
const PATIENCE: Duration = Duration::from_secs(5);
/// Between two looks at the frames.
const LOOK: Duration = Duration::from_micros(500);
/// Between two tries to find a place among those who look on.
const RETRY: Duration = Duration::from_millis(10);
const NAME: &str = "io-driver";

/// What the threads of an emergency stop tell.
enum News {
    /// A frame of this tick shows it.
    Shown(u64),
    /// Nobody could be asked, in either way.
    NotAsked(AttachError),
}

/// Stops the motors, and says whether that was seen.
pub(super) fn emergency_stop(socket: &Path) -> ExitCode {
    let begun = Instant::now();
    let (tell, news) = channel();
    let asks = in_background(socket, &tell, |socket, tell| {
        if let Err(error) = ask(&socket) {
            let _ = tell.send(News::NotAsked(error));
        }
    });
    let looks = in_background(socket, &tell, move |socket, tell| {
        if let Some(tick) = wait_for_zero(&socket, begun + PATIENCE) {
            let _ = tell.send(News::Shown(tick));
        }
    });
    match (asks, looks) {
        (Ok(()), Ok(())) => {
            drop(tell);
            judge(&news, socket, begun)
        }
        _ => ask_and_look(socket, begun),
    }
}

/// In both ways; an error if nobody can have heard it.
fn ask(socket: &Path) -> Result<(), AttachError> {
    let sent = stop_socket::send(socket);
    client::emergency_stop_over_connection(socket, NAME).or_else(|error| sent.map_err(|_| error))
}

/// One after the other, where the system gives no threads.
fn ask_and_look(socket: &Path, begun: Instant) -> ExitCode {
    say(format_args!("io-driver: {UNCERTAIN}"));
    if let Err(error) = ask(socket) {
        return unreachable_driver(socket, &error);
    }
    match wait_for_zero(socket, begun + PATIENCE) {
        Some(tick) => shown(tick),
        None => not_shown(),
    }
}

fn in_background<News: Send + 'static>(
    socket: &Path,
    tell: &Sender<News>,
    body: impl FnOnce(PathBuf, Sender<News>) + Send + 'static,
) -> std::io::Result<()> {
    let (socket, tell) = (socket.to_path_buf(), tell.clone());
    // They end with the process, whatever they wait for.
    std::thread::Builder::new().spawn(move || body(socket, tell)).map(drop)
}

fn judge(news: &Receiver<News>, socket: &Path, begun: Instant) -> ExitCode {
    let mut is_warned = false;
    loop {
        let patience = if is_warned { PATIENCE } else { PROMPT };
        match news.recv_timeout(patience.saturating_sub(begun.elapsed())) {
            Ok(News::Shown(tick)) => return shown(tick),
            Ok(News::NotAsked(error)) => return unreachable_driver(socket, &error),
            Err(_) if !is_warned => {
                is_warned = true;
                say(format_args!("io-driver: {UNCERTAIN}"));
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return not_shown(),
        }
    }
}

fn shown(tick: u64) -> ExitCode {
    let _ = print_line(&format!("emergency stop: tick {tick} shows the fault and no force"));
    ExitCode::SUCCESS
}

fn not_shown() -> ExitCode {
    say(format_args!("io-driver: the stop was asked for, and no frame has shown it"));
    ExitCode::from(EXIT_FAULT)
}

/// Nobody can be asked there. A driver whose socket's file was moved or deleted pushes on.
fn unreachable_driver(socket: &Path, error: &AttachError) -> ExitCode {
    let Some(pid) = listener(socket) else { return fail(error, EXIT_USAGE) };
    say(format_args!("io-driver: {error}"));
    say(format_args!(
        "io-driver: but process {pid} listens there, and its socket's file was moved or deleted: the motors may still be \
         on; cut their power, or end it with `kill -TERM {pid}`"
    ));
    ExitCode::from(EXIT_FAULT)
}

/// The process of a driver that listens at this path, whatever became of the file: the kernel keeps the name under which
/// the socket was made, which ends with the process's number. A driver with a network of its own, as a service has, is
/// in that network's table alone.
fn listener(socket: &Path) -> Option<u32> {
    let made = format!(" {}.", socket.display());
    drivers().find(|pid| {
        let table = std::fs::read_to_string(format!("/proc/{pid}/net/unix")).unwrap_or_default();
        let end = pid.to_string();
        table.lines().any(|line| line.rsplit_once(made.as_str()).is_some_and(|(_, number)| number == end))
    })
}

/// All processes that have the driver's name.
fn drivers() -> impl Iterator<Item = u32> {
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|pid: &u32| {
        let name = std::fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
        PROGRAMS.iter().any(|program| name.starts_with(program))
    })
}

/// What a driver's program is called: by itself, or within the application.
const PROGRAMS: [&str; 2] = ["io-driver", "phantom3"];

const UNCERTAIN: &str =
    "the emergency stop is not confirmed within 100 ms: the motors may still be on; cut their power";

/// The tick whose frame shows that the motors are off; `None`: the driver is gone, or no frame shows that in time.
fn wait_for_zero(socket: &Path, until: Instant) -> Option<u64> {
    let attachment = loop {
        match client::observe(socket, NAME) {
            Ok(attachment) => break attachment,
            Err(AttachError::NoDriver { .. } | AttachError::DriverGone { .. }) => return None,
            Err(_) if Instant::now() > until => return None,
            Err(_) => std::thread::sleep(RETRY),
        }
    };
    let driver = &attachment.driver;
    // What stands there already may be old, and the loop dead.
    let stale = driver.latest_tick();
    loop {
        match driver.read_latest() {
            Some(frame) if Some(frame.tick) > stale && is_stopped(&frame) => return Some(frame.tick),
            _ if !attachment.connection.is_open() || Instant::now() > until => return None,
            _ => std::thread::sleep(LOOK),
        }
    }
}

fn is_stopped(frame: &Frame) -> bool {
    frame.state == DriverState::Fault as u64
        && frame.fault == FaultReason::EmergencyStop as u64
        && frame.present_devices().iter().all(|device| device.force_on_user_n_applied == [0.0; 3])
}

/// Ends the driver, and says whether that was seen.
pub(super) fn stop(socket: &Path) -> ExitCode {
    let (observer, asked) = match ask_to_end(socket) {
        Ok(answer) => answer,
        Err(error) => return fail(&error, EXIT_FAULT),
    };
    let pid = match asked {
        Ok(pid) => pid,
        Err(error @ (AttachError::NoDriver { .. } | AttachError::DriverGone { .. })) => {
            return unreachable_driver(socket, &error);
        }
        Err(
            error @ (AttachError::NotAllowed { .. }
            | AttachError::NoPermission { .. }
            | AttachError::NotADriver { .. }),
        ) => return fail(&error, EXIT_USAGE),
        Err(error) => {
            say(format_args!("io-driver: {error}"));
            say(format_args!("io-driver: the motors may still be on; next: io-driver emergency-stop"));
            return ExitCode::from(EXIT_FAULT);
        }
    };
    // It stops, whether or not somebody reads that.
    let _ = print_line(&format!("driver (process {pid}) stops"));
    let Some(observer) = observer.filter(|observer| observer.driver_pid == pid) else {
        say(format_args!(
            "io-driver: it cannot be watched ending; the motors may still be on: look yourself"
        ));
        return ExitCode::from(EXIT_FAULT);
    };
    wait_for_end(&observer, pid)
}

type Ending = (Option<Attachment>, Result<u64, AttachError>);

/// Asks in a thread of its own, so that a driver that does not answer does not delay the words either.
fn ask_to_end(socket: &Path) -> std::io::Result<Ending> {
    let (tell, answers) = channel();
    in_background(socket, &tell, |socket, tell| {
        // Before, so that its last words can be read; without a place to look on the driver ends all the same.
        let observer = client::observe(&socket, NAME).ok();
        let _ = tell.send((observer, client::stop(&socket, NAME)));
    })?;
    answers.recv_timeout(PROMPT).or_else(|_| {
        say(format_args!("io-driver: {NOT_STOPPED}"));
        answers.recv().map_err(std::io::Error::other)
    })
}

const NOT_STOPPED: &str = "it has not stopped within 100 ms: the motors may still be on";

fn wait_for_end(observer: &Attachment, pid: u64) -> ExitCode {
    let begun = Instant::now();
    let mut is_warned = false;
    while observer.connection.is_open() && epitaph::read(&observer.driver.epitaph).is_none() {
        if !is_warned && begun.elapsed() > PROMPT {
            is_warned = true;
            say(format_args!("io-driver: {NOT_STOPPED}"));
        }
        if begun.elapsed() > PATIENCE {
            say(format_args!("io-driver: process {pid} lives on; cut the motors' power, then kill it"));
            return ExitCode::from(EXIT_FAULT);
        }
        std::thread::sleep(LOOK);
    }
    judge_end(&observer.driver)
}

fn judge_end(driver: &DriverView) -> ExitCode {
    let Some(words) = epitaph::read(&driver.epitaph) else {
        say(format_args!("io-driver: it ended without last words: the motors may still be on"));
        return ExitCode::from(EXIT_FAULT);
    };
    if words.kind != EpitaphKind::Stopped {
        say(format_args!("io-driver: it ended otherwise: {words}"));
        return ExitCode::from(EXIT_FAULT);
    }
    let _ = print_line(&format!("{words}; the motors were written zero"));
    ExitCode::SUCCESS
}
