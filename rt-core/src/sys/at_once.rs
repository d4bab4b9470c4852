//! The last act of a process that is told the same signal twice.

use crate::last_act;
use signal_hook::low_level;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// When `signal` comes and `again` is up, the last act is performed. To be registered before the action that ends
/// the process.
pub(crate) fn perform_last_act_if(signal: i32, again: Arc<AtomicBool>) -> io::Result<()> {
    let act = move || {
        if again.load(Ordering::SeqCst) {
            last_act::perform();
        }
    };
    // SAFETY: the action loads a flag and stores to registers, both async-signal-safe, and cannot panic.
    unsafe { low_level::register(signal, act) }.map(|_| ())
}
