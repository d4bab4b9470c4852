//! The end of the X server while the window is open: a session that ends, a forwarded connection that breaks.
//!
//! Problem: Xlib ends the whole process then, by `exit(1)`: a run without its report, a recording without its end.
//! Model: a handler of that error that does not return, as Xlib asks of it. It keeps the thread that noticed for good, which
//! is the window's, and raises a flag.

use std::ffi::c_int;
use std::sync::atomic::{AtomicBool, Ordering};
use x11_dl::xlib::{Display, Xlib};

static IS_LOST: AtomicBool = AtomicBool::new(false);

/// The server is gone.
pub(super) fn is_lost() -> bool {
    IS_LOST.load(Ordering::Acquire)
}

/// From now on the process outlives the server. Where there is no Xlib, nobody connects by it.
pub(super) fn outlive_the_server() {
    let Ok(xlib) = Xlib::open() else { return };
    // SAFETY: the handler is a function of the program; a library that was opened so is never closed.
    unsafe { (xlib.XSetIOErrorHandler)(Some(keep_this_thread)) };
}

unsafe extern "C" fn keep_this_thread(_: *mut Display) -> c_int {
    IS_LOST.store(true, Ordering::Release);
    loop {
        std::thread::park();
    }
}
