//! Results on the standard output.
//!
//! Model: a closed pipe is how `| head` says that it has seen enough, and no reason to fail. A full disk is one: the
//! result is lost, which is told once on standard error and ends a command that only tells something with status 3.
//! A stop counts for more than the telling of it: it says its words on standard error then, and its
//! status stays what it is.

use crate::say::say;
use rt_core::plain_text::PlainLines;
use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Something that was to be printed is lost, a stop's words left out.
static IS_LOST: AtomicBool = AtomicBool::new(false);

/// Prints a line or several; whether somebody reads on.
pub(crate) fn print_line(text: &str) -> bool {
    print(&format!("{}\n", PlainLines(text)))
}

/// Prints what is plain already; whether somebody reads on.
pub(crate) fn print(text: &str) -> bool {
    print_for("io-driver", text)
}

/// The same for a program of this name.
pub fn print_for(program: &str, text: &str) -> bool {
    let Err(error) = write(text) else { return true };
    if is_loss(&error) {
        IS_LOST.store(true, Ordering::Relaxed);
        say_lost(program, &error);
    }
    false
}

/// Prints what a stop did, on standard error if the standard output takes it not. Its status stays what it is.
pub(crate) fn print_outcome(text: &str) {
    match write(&format!("{}\n", PlainLines(text))) {
        Err(error) if is_loss(&error) => {
            say_lost("io-driver", &error);
            say(format_args!("io-driver: {text}"));
        }
        Ok(()) | Err(_) => {}
    }
}

/// Something that was to be printed is lost.
pub fn is_lost() -> bool {
    IS_LOST.load(Ordering::Relaxed)
}

fn write(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush())
}

fn is_loss(error: &io::Error) -> bool {
    error.kind() != ErrorKind::BrokenPipe
}

/// Once.
fn say_lost(program: &str, error: &io::Error) {
    static IS_SAID: AtomicBool = AtomicBool::new(false);
    if IS_SAID.swap(true, Ordering::Relaxed) {
        return;
    }
    say(format_args!("{program}: cannot write the standard output: {error}; what was to be told is lost"));
}
