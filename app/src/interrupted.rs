//! Signals that end a command which writes results.
//!
//! Model: a thread looks for them, since the one that works may wait for whoever reads a pipe. Results that are not whole
//! are taken back, which is told; the exit status is 128 and the signal's number.

use crate::cli::LAST_WORDS;
use crate::outcome::{RunFailure, Stop, no_thread};
use io_driver::say::{self, say};
use rt_core::replacement::{Abandoned, abandon_all};
use rt_core::signals::StopSignals;
use std::process::ExitCode;
use std::time::Duration;

/// Between two looks for a signal.
const TURN: Duration = Duration::from_millis(10);

/// Ends the process in order when a signal asks for it, from now on.
///
/// # Errors
/// If there can be no thread.
pub(crate) fn watch(signals: StopSignals) -> Result<(), RunFailure> {
    let watch = move || {
        loop {
            if let Some(signal) = signals.requested() {
                end(signal);
            }
            std::thread::sleep(TURN);
        }
    };
    let started = std::thread::Builder::new().name("signals".into()).spawn(watch);
    started.map(drop).map_err(|error| no_thread("to listen for signals", &error))
}

/// Ends the process as one that this signal ended.
pub(crate) fn end(signal: i32) -> ! {
    // Held to the end of the process: nothing takes its place any more.
    let (abandoned, _held) = abandon_all();
    for Abandoned { place, is_gone } in abandoned {
        let left = if is_gone { "is not written; what was there is as it was" } else { "is not complete" };
        say(format_args!("phantom3: {} {left}", place.display()));
    }
    let _: ExitCode = Stop::Signal(signal).conclude();
    say::flush(LAST_WORDS);
    std::process::exit(128 + signal)
}
