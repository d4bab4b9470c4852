//! A running driver on a full screen: `io-driver status --watch` on a terminal.
//!
//! Problem: whoever stands before a device wants to see at a glance where it is, what it pushes, who commands it and
//! whether the loop keeps its time.
//! Model: one more observer. It reads the driver's memory, mapped read-only, a fifteenth of a second after it has drawn, and asks
//! the driver for nothing but that memory; a driver that ends is waited for.
//! Invariant: however it ends (key, signal, error, panic), the terminal is as it was before.

mod bar;
mod commander;
mod devices;
mod head;
mod keys;
mod latencies;
mod link;
mod look;
mod number;
mod screen;
mod state;
#[cfg(test)]
mod tests;
mod tick_rate;

use crate::monitor::keys::Key;
use crate::monitor::link::Link;
use crate::monitor::screen::{Heard, Screen};
use crate::monitor::state::Monitor;
use rt_core::signals::StopSignals;
use shm_abi::client::AttachError;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::{Duration, Instant};
use thiserror::Error;

/// Why nothing is shown any more.
#[derive(Debug, Error)]
pub enum MonitorError {
    /// There was no driver to begin with.
    #[error(transparent)]
    Attach(#[from] AttachError),
    /// Nobody would restore the terminal.
    #[error("cannot catch signals: {0}")]
    Signals(#[source] io::Error),
    /// The terminal is of no use.
    #[error("cannot use the terminal: {0}; `io-driver status --watch | cat` prints lines")]
    Terminal(#[source] io::Error),
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// By a key.
    Left,
    /// By this signal, or by the terminal's end, which is told as SIGHUP.
    Signal(i32),
}

/// Between two drawings; a key is answered at once.
const REFRESH: Duration = Duration::from_millis(66);

/// Whether there is somebody to look and to press keys.
pub fn has_terminal() -> bool {
    let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    io::stdin().is_terminal() && io::stdout().is_terminal() && !is_dumb
}

/// Shows the driver until a key or a signal ends it.
///
/// # Errors
/// If there is no driver, or the terminal refuses.
pub fn run(socket: &Path) -> Result<End, MonitorError> {
    let signals = StopSignals::install().map_err(MonitorError::Signals)?;
    let mut link = Link::attach(socket)?;
    let begun = Instant::now();
    let mut monitor = Monitor::default();
    let mut screen = Screen::open().map_err(MonitorError::Terminal)?;
    loop {
        link.observe(&mut monitor, begun.elapsed());
        let drawn = screen.draw(&monitor);
        // A terminal that goes away sends a signal and refuses what is written, in either order.
        if let Some(signal) = signals.requested() {
            return Ok(End::Signal(signal));
        }
        drawn.map_err(MonitorError::Terminal)?;
        match screen.listen(REFRESH).map_err(MonitorError::Terminal)? {
            Heard::Keys(keys) if keys.contains(&Key::Leave) => return Ok(End::Left),
            Heard::Keys(keys) => keys.into_iter().for_each(|key| monitor.press(key)),
            Heard::End => return Ok(End::Signal(libc::SIGHUP)),
        }
    }
}
