//! Tells people something on standard error, and does not mind when nobody can hear it.
//!
//! What is told is made plain first ([`Plain`]): names come from files, and must not act on a terminal.
//!
//! `eprintln!` panics when the write fails: whoever kills the `tee` behind `io-driver run 2>&1 | tee log`, or
//! fills the disk under a log, would take the driver with it, motors on.

use rt_core::plain_text::Plain;
use std::fmt;
use std::io::Write;

/// Writes a line in one piece.
pub fn say(line: fmt::Arguments<'_>) {
    // Nobody to tell is no reason to stop.
    let _ = std::io::stderr().write_all(format!("{}\n", Plain(line)).as_bytes());
}

/// Writes a line of results on standard output.
pub fn tell(line: fmt::Arguments<'_>) {
    // A closed pipe is no reason to fail.
    let _ = std::io::stdout().write_all(format!("{}\n", Plain(line)).as_bytes());
}
