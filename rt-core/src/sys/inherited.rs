//! Inherited descriptors and signal actions, which the runtime or the program changes soon.

use std::sync::atomic::{AtomicBool, Ordering};

static OUTPUT_WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Runs before `main`: Rust's start-up code opens /dev/null for a standard output that is closed, and from then on the
/// two cannot be told apart.
#[used]
#[unsafe(link_section = ".init_array")]
static LOOK: extern "C" fn() = look;

extern "C" fn look() {
    // SAFETY: takes no pointer, and changes nothing.
    let flags = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) };
    OUTPUT_WAS_CLOSED.store(flags == -1, Ordering::Relaxed);
}

/// There was no standard output when this process began.
pub(crate) fn output_was_closed() -> bool {
    OUTPUT_WAS_CLOSED.load(Ordering::Relaxed)
}

/// The signal is ignored now, as nohup(1) arranges it for SIGHUP.
pub(crate) fn is_ignored(signal: i32) -> bool {
    // SAFETY: all of its fields may be zero.
    let mut now: libc::sigaction = unsafe { std::mem::zeroed() };
    // SAFETY: without a new action nothing is changed; `now` is ours, and large enough for the answer.
    let result = unsafe { libc::sigaction(signal, std::ptr::null(), &mut now) };
    result == 0 && now.sa_sigaction == libc::SIG_IGN
}
