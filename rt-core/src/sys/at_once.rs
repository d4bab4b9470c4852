//! The end of a process that is told to end, and some time later again.

use crate::clock::monotonic_ns;
use crate::last_act;
use signal_hook::low_level;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// From `same_request` after its first coming on, `signal` performs the last act and then ends the process by its
/// default action.
pub(crate) fn end_when_repeated(signal: i32, same_request: Duration) -> io::Result<()> {
    let first_ns = AtomicU64::new(NEVER);
    let same_request_ns = same_request.as_nanos() as u64;
    let act = move || {
        let now_ns = monotonic_ns();
        match first_ns.compare_exchange(NEVER, now_ns, Ordering::SeqCst, Ordering::SeqCst) {
            Err(first_ns) if now_ns.saturating_sub(first_ns) >= same_request_ns => {
                last_act::perform();
                // It only fails for signals that cannot be caught either.
                let _ = low_level::emulate_default_handler(signal);
            }
            _ => {}
        }
    };
    // SAFETY: the action reads a clock, exchanges a word, stores to registers and may end the process: all of it is
    // async-signal-safe, and nothing can panic.
    unsafe { low_level::register(signal, act) }.map(|_| ())
}

/// No time that the clock shows.
const NEVER: u64 = u64::MAX;
