//! Time within which a driver shows what it was asked for, and the words when it does not.
//!
//! Model: whoever asked is told after [`PROMPT`] that nothing is certain, and it is looked on after that.

use crate::say::say;
use std::fmt;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Time limit of an answer, after which we say that nothing is certain.
pub(super) const PROMPT: Duration = Duration::from_millis(100);

/// [`PROMPT`] in words.
#[derive(Debug, Clone, Copy)]
pub(super) struct PromptWords;

impl fmt::Display for PromptWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms", PROMPT.as_millis())
    }
}

/// Does something that may wait, and says these words if it takes longer than [`PROMPT`]. They have a thread of their
/// own, so that neither a request without an answer delays them nor a standard error that nobody reads the request;
/// where the system gives no thread they come after it.
pub(super) fn say_if_late<T>(words: &str, body: impl FnOnce() -> T) -> T {
    say_line_if_late(format!("io-driver: {words}"), body)
}

/// The same with a line that names another program.
pub fn say_line_if_late<T>(line: String, body: impl FnOnce() -> T) -> T {
    run_with_watch(body, move || say(format_args!("{line}")))
}

fn run_with_watch<T>(body: impl FnOnce() -> T, tell: impl Fn() + Clone + Send + 'static) -> T {
    let begun = Instant::now();
    let (done, is_done) = channel::<()>();
    let teller = tell.clone();
    // It ends with the process, whoever reads the words.
    let watch = move || {
        if is_done.recv_timeout(PROMPT) == Err(RecvTimeoutError::Timeout) {
            teller();
        }
    };
    let watcher = std::thread::Builder::new().spawn(watch);
    let value = body();
    drop(done);
    if watcher.is_err() && begun.elapsed() > PROMPT {
        tell();
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;

    #[test]
    fn the_words_come_while_it_is_still_waited_for_and_not_at_all_where_it_is_prompt() {
        let (send, told) = channel();
        let send_it = move || send.send(Instant::now()).unwrap();
        let begun = Instant::now();
        let at = run_with_watch(|| told.bounded_recv(), send_it).expect("words, before the body ends");
        assert!(at.duration_since(begun) >= PROMPT, "{:?}", at.duration_since(begun));
        let (send, told) = channel::<()>();
        run_with_watch(|| (), move || send.send(()).unwrap());
        // The thread is gone, and with it who could send.
        assert!(told.bounded_recv().is_err());
    }
}
