//! `io-driver end-lease`.
//!
//! Model: whose lease it was is what the frame before the request tells; with none there is nothing to end, which is
//! said, since whoever asks wants somebody's force away. Asked, then believed only when a new frame is of another lease or of
//! none.
//! Invariant: no exit status of 0 without such a frame.

use super::clearing::{LOOK, PROMPT};
use super::{EXIT_FAULT, fail_to_ask};
use crate::print::print_line;
use crate::say::say;
use shm_abi::{DriverView, client};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

const NAME: &str = "io-driver";

/// Asks, and says what was ended.
pub(super) fn end_lease(socket: &Path) -> ExitCode {
    let observer = client::observe(socket, NAME);
    let before = observer.as_ref().map(|observer| observer.driver.read_latest());
    if let Err(error) = client::end_lease(socket, NAME) {
        return fail_to_ask(&error);
    }
    let said = match (&observer, before) {
        (_, Ok(Some(frame))) if frame.lease == 0 => "nobody commanded the devices".into(),
        (Ok(observer), Ok(Some(frame))) if has_ended(&observer.driver, frame.lease) => {
            format!("lease {} is ended; its force ramps out", frame.lease)
        }
        (Ok(_), Ok(Some(frame))) => {
            let lease = frame.lease;
            return unseen(format_args!(
                "lease {lease} was asked to end, and no new frame shows that it did"
            ));
        }
        (Err(error), _) | (_, Err(error)) => {
            return unseen(format_args!(
                "the lease was asked to end, and what became of it cannot be seen: {error}"
            ));
        }
        _ => return unseen(format_args!("the lease was asked to end, and the driver has told no frame")),
    };
    print_line(&said);
    ExitCode::SUCCESS
}

fn unseen(what: std::fmt::Arguments<'_>) -> ExitCode {
    say(format_args!("io-driver: {what}: its force may still be on; next: io-driver emergency-stop"));
    ExitCode::from(EXIT_FAULT)
}

/// True once a frame is of another lease, or of none, if one comes in time: the loop takes note with its next tick.
fn has_ended(driver: &DriverView, lease: u64) -> bool {
    let until = Instant::now() + PROMPT + Duration::from_nanos(driver.info().period_ns) * 5;
    while driver.read_latest().is_none_or(|frame| frame.lease == lease) {
        if Instant::now() >= until {
            return false;
        }
        std::thread::sleep(LOOK);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::told::memory;
    use super::*;
    use bytemuck::Zeroable;
    use shm_abi::Frame;

    /// The loop hangs, or the machine keeps it from running: what stands there is from before.
    #[test]
    fn a_lease_has_ended_once_a_frame_is_of_another_one() {
        let memory = memory();
        let driver = DriverView::map(memory.fd()).expect("our own");
        for (tick, lease, ended) in [(7, 3, false), (8, 3, false), (9, 0, true), (10, 4, true)] {
            memory.write_frame(&Frame { tick, lease, ..Frame::zeroed() });
            memory.ring(tick, None);
            assert_eq!(has_ended(&driver, 3), ended, "{lease}");
        }
    }
}
