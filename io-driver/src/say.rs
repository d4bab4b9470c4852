//! Tells people something on standard error, and does not mind when nobody can hear it.
//!
//! `eprintln!` panics when the write fails: whoever kills the `tee` behind `io-driver run 2>&1 | tee log`, or
//! fills the disk under a log, would take the driver with it, motors on.

use std::fmt;
use std::io::Write;

/// Writes a line in one piece.
pub fn say(line: fmt::Arguments<'_>) {
    // Nobody to tell is no reason to stop.
    let _ = std::io::stderr().write_all(format!("{line}\n").as_bytes());
}
