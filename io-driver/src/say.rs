//! Tells people something on standard error, and does not mind when nobody can hear it.
//!
//! What is told is made plain first ([`PlainLines`]): names come from files, and must not act on a terminal. Lines after
//! the first are indented, so that no name with a line break in it forges a line of ours.
//!
//! `eprintln!` panics when the write fails: whoever kills the `tee` behind `io-driver run 2>&1 | tee log`, or
//! fills the disk under a log, would take the driver with it, motors on. And a write waits for as long as the other
//! end likes: a terminal held by Ctrl-S, a pipe that nobody drains. So a driver only queues its lines, from where it catches
//! signals on (`hold`), and `log_thread` writes them once it is there.
//! Invariant: once lines are queued, [`say`] never waits; a line that finds the queue full is counted.

use crate::arguments;
use rt_core::plain_text::PlainLines;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::fmt;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Lines that may wait for standard error.
const CAPACITY: usize = 1024;
/// Of a pipe that takes anything, without waiting (bytes): `PIPE_BUF`.
const TAKEN_AT_ONCE: usize = 4096;
/// For standard error to take something.
const PATIENCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 500_000_000 };
/// Between two looks whether the queue has room.
const LOOK: Duration = Duration::from_millis(1);

static QUEUE: OnceLock<Queue> = OnceLock::new();
/// Somebody has waited for standard error in vain.
static IN_VAIN: AtomicBool = AtomicBool::new(false);
/// The other end of the queue, until the log's thread has it.
static HELD: Mutex<Option<Receiver<Entry>>> = Mutex::new(None);

#[derive(Debug)]
struct Queue {
    entries: SyncSender<Entry>,
    dropped: AtomicU64,
}

/// What travels to the log's thread.
#[derive(Debug)]
pub(crate) enum Entry {
    /// A line, with its end.
    Line(String),
    /// A line that is told anew again and again.
    Status(String),
    /// Dropped when everything before it has been written.
    Flush(SyncSender<()>),
}

/// Says a line: writes it in one piece, or leaves that to the log's thread where there is one.
pub fn say(line: fmt::Arguments<'_>) {
    let line = indented(line);
    match QUEUE.get() {
        None => write(&line),
        Some(queue) => match queue.entries.try_send(Entry::Line(line)) {
            Ok(()) => {}
            // The log's thread could not be started: why is what is to be told.
            Err(TrySendError::Disconnected(Entry::Line(line))) => write_if_taken(&line),
            Err(_) => {
                queue.dropped.fetch_add(1, Ordering::Relaxed);
            }
        },
    }
}

/// Shows a text as it is, such as a line that is told anew again and again: one that finds no room is left out.
pub fn show(text: String) {
    match QUEUE.get() {
        None => write(&text),
        Some(queue) => drop(queue.entries.try_send(Entry::Status(text))),
    }
}

/// Writes a line of results on standard output.
pub fn tell(line: fmt::Arguments<'_>) {
    // A closed pipe is no reason to fail.
    let _ = std::io::stdout().write_all(indented(line).as_bytes());
}

/// In one piece, with its end.
fn indented(text: fmt::Arguments<'_>) -> String {
    let text = arguments::shortened(PlainLines(text).to_string());
    let mut lines = text.lines();
    let mut out = lines.next().unwrap_or_default().to_owned();
    for line in lines {
        let indent = if line.starts_with("  ") { "\n" } else { "\n  " };
        out.extend([indent, line]);
    }
    out + "\n"
}

/// Waits until everything that was said is written, but no longer than `patience`, and not again once that was in vain; returns
/// whether it is.
pub fn flush(patience: Duration) -> bool {
    if IN_VAIN.load(Ordering::Relaxed) {
        return false;
    }
    let is_written = flushed(patience);
    IN_VAIN.fetch_or(!is_written, Ordering::Relaxed);
    is_written
}

fn flushed(patience: Duration) -> bool {
    let Some(queue) = QUEUE.get() else { return true };
    let until = Instant::now() + patience;
    let (send_done, done) = sync_channel(0);
    let mut entry = Entry::Flush(send_done);
    while let Err(refused) = queue.entries.try_send(entry) {
        // Without the log's thread everything is written when it is said.
        let TrySendError::Full(back) = refused else { return true };
        if Instant::now() >= until {
            return false;
        }
        entry = back;
        std::thread::sleep(LOOK);
    }
    let rest = until.saturating_duration_since(Instant::now());
    // Nothing is ever sent; the other end is dropped.
    done.recv_timeout(rest) == Err(std::sync::mpsc::RecvTimeoutError::Disconnected)
}

/// Lines that found no room so far.
pub fn dropped() -> u64 {
    QUEUE.get().map_or(0, |queue| queue.dropped.load(Ordering::Relaxed))
}

/// From now on lines are queued, until somebody asks for them.
pub(crate) fn hold() {
    if let Some(entries) = begin_queue() {
        *HELD.lock().unwrap_or_else(PoisonError::into_inner) = Some(entries);
    }
}

/// The queued lines, for whoever writes them; from now on lines are queued. `None` if somebody has them already.
pub(crate) fn queue() -> Option<Receiver<Entry>> {
    let held = HELD.lock().unwrap_or_else(PoisonError::into_inner).take();
    held.or_else(begin_queue)
}

fn begin_queue() -> Option<Receiver<Entry>> {
    let (entries, received) = sync_channel(CAPACITY);
    let queue = Queue { entries, dropped: AtomicU64::new(0) };
    QUEUE.set(queue).is_ok().then_some(received)
}

/// Writes as much as the other end of standard error takes within half a second: signals are caught already.
pub(crate) fn write_if_taken(line: &str) {
    let err = std::io::stderr();
    for piece in line.as_bytes().chunks(TAKEN_AT_ONCE) {
        match poll(&mut [PollFd::new(&err, PollFlags::OUT)], Some(&PATIENCE)) {
            Ok(0) | Err(_) => return,
            Ok(_) => drop((&err).write_all(piece)),
        }
    }
}

/// May wait for as long as the other end of standard error likes.
pub(crate) fn write(line: &str) {
    // Nobody to tell is no reason to stop.
    let _ = std::io::stderr().write_all(line.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_keeps_its_lines_and_a_name_with_a_line_break_forges_none() {
        let block = "guarantees:\n  obtained: memory\n  missing: priority";
        assert_eq!(indented(format_args!("{block}")), format!("{block}\n"));
        let name = "x\nio-driver: motors were written zero\u{1b}[2J";
        let said = indented(format_args!("io-driver: lease 1 to process 7 ({name})"));
        let expected =
            "io-driver: lease 1 to process 7 (x\n  io-driver: motors were written zero\\u{1b}[2J)\n";
        assert_eq!(said, expected);
    }
}
