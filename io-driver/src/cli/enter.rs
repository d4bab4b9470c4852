//! Waiting for a person who presses Enter, which Ctrl-C ends.

use rt_core::signals::StopSignals;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, ErrorKind};
use std::os::fd::AsFd;

/// Time until a signal that another thread received is seen.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

/// End of the wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entered {
    /// A line, of which nothing is told.
    Line,
    /// The input has ended.
    NoInput,
    /// The process was asked to stop.
    Stopped,
}

/// Waits for the end of a line of the standard input; what follows stays there.
///
/// # Errors
/// Errors of the standard input.
pub(super) fn wait_for_enter(signals: &StopSignals) -> io::Result<Entered> {
    let input = io::stdin();
    loop {
        if signals.requested().is_some() {
            return Ok(Entered::Stopped);
        }
        let mut byte = [0];
        match poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&LOOK)).map_err(io::Error::from) {
            Ok(0) => continue,
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        }
        match rustix::io::read(input.as_fd(), &mut byte).map_err(io::Error::from) {
            Ok(0) => return Ok(Entered::NoInput),
            Ok(_) if byte == *b"\n" => return Ok(Entered::Line),
            Ok(_) => {}
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            Err(error) => return Err(error),
        }
    }
}
