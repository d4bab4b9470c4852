//! An action of a signal that a flag decides.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whenever `signal` comes while `flag` is up, calls `act`, after what was registered before and before what is
/// registered later. `act` must be async-signal-safe.
pub(crate) fn on_signal_if(signal: libc::c_int, flag: Arc<AtomicBool>, act: fn()) -> io::Result<()> {
    let action = move || {
        if flag.load(Ordering::SeqCst) {
            act();
        }
    };
    // SAFETY: the action reads an atomic word, and calls what its owner says is fit for a handler; neither unwinds.
    unsafe { signal_hook::low_level::register(signal, action) }.map(drop)
}
