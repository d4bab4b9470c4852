//! Waits for threads and channels, and what ends them when a test fails.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvError, RecvTimeoutError, channel};
use std::thread::{JoinHandle, ScopedJoinHandle};
use std::time::Duration;

use crate::condition::is_met;
use crate::limit;

/// Waits for threads.
pub trait BoundedThread {
    /// What the thread returns.
    type Value;

    /// As [`JoinHandle::join`], within [`limit`]; panics if it takes longer.
    fn bounded_join(self) -> std::thread::Result<Self::Value>;
}

impl<T> BoundedThread for JoinHandle<T> {
    type Value = T;

    #[track_caller]
    fn bounded_join(self) -> std::thread::Result<T> {
        let limit = limit();
        let is_finished = is_met(limit, || self.is_finished().then_some(())).is_some();
        assert!(is_finished, "waited {limit:?} in vain for the end of a thread");
        self.join()
    }
}

/// Of a scope, which a panic would not end: the program is aborted as by [`watched`].
impl<T> BoundedThread for ScopedJoinHandle<'_, T> {
    type Value = T;

    fn bounded_join(self) -> std::thread::Result<T> {
        watched(limit(), "the end of a thread of a scope", || self.join())
    }
}

/// Waits for messages.
pub trait BoundedReceiver {
    /// What comes.
    type Message;

    /// As [`Receiver::recv`], within [`limit`]; panics if it takes longer.
    fn bounded_recv(&self) -> Result<Self::Message, RecvError>;
}

impl<T> BoundedReceiver for Receiver<T> {
    type Message = T;

    #[track_caller]
    fn bounded_recv(&self) -> Result<T, RecvError> {
        let limit = limit();
        match self.recv_timeout(limit) {
            Ok(value) => Ok(value),
            Err(RecvTimeoutError::Disconnected) => Err(RecvError),
            Err(RecvTimeoutError::Timeout) => panic!("waited {limit:?} in vain for a message"),
        }
    }
}

/// Sets a flag when dropped, also by a panic: the threads of a scope that look at it end, and with them the scope.
#[derive(Debug)]
pub struct Raised<'flag>(pub &'flag AtomicBool);

impl Drop for Raised<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// Does something that no panic of this thread could end, such as a scope that joins its threads.
///
/// Takes it longer than the limit, the program is aborted, after the name of the test and `what` were printed.
pub fn watched<T>(limit: Duration, what: &str, body: impl FnOnce() -> T) -> T {
    let (done, is_done) = channel::<()>();
    let test = std::thread::current().name().unwrap_or("a thread without a name").to_owned();
    let what = what.to_owned();
    let watch = move || {
        if is_done.recv_timeout(limit) == Err(RecvTimeoutError::Timeout) {
            // Not by `eprintln!`: the harness keeps what a test prints for its end, which this one has none of.
            let words = format!("{test}: waited {limit:?} in vain: {what}; the test program is aborted\n");
            let _ = std::io::stderr().write_all(words.as_bytes());
            std::process::abort();
        }
    };
    std::thread::Builder::new().name("watchdog".into()).spawn(watch).expect("a thread");
    // Dropped at the end, also by a panic.
    let _done = done;
    body()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::BoundedCommand;

    /// What a body panics with.
    pub(crate) fn message_of<T>(body: impl FnOnce() -> T) -> String {
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(body)).err().expect("a panic");
        match panic.downcast::<String>() {
            Ok(text) => *text,
            Err(panic) => panic.downcast_ref::<&str>().expect("a text").to_string(),
        }
    }

    #[test]
    fn a_threads_value_and_a_channels_messages_arrive() {
        assert_eq!(std::thread::spawn(|| 7).bounded_join().unwrap(), 7);
        let (send, receive) = channel();
        send.send(1).unwrap();
        drop(send);
        assert_eq!((receive.bounded_recv(), receive.bounded_recv()), (Ok(1), Err(RecvError)));
    }

    #[test]
    fn a_scope_whose_body_panics_ends_when_its_threads_look_at_a_raised_flag() {
        let stop = AtomicBool::new(false);
        let body = || {
            std::thread::scope(|scope| {
                let _stops = Raised(&stop);
                scope.spawn(|| crate::until("the flag", || stop.load(Ordering::SeqCst)));
                panic!("in the body");
            });
        };
        let message = watched(crate::HANG, "the scope", || message_of::<()>(body));
        assert_eq!(message, "in the body");
    }

    /// Present: this process is the one that hangs.
    const HANGS: &str = "PATIENCE_TEST_HANGS";

    #[test]
    fn a_scope_that_hangs_aborts_the_program_with_the_tests_name_and_words() {
        if std::env::var_os(HANGS).is_some() {
            watched(limit(), "a thread that nobody stops", || {
                std::thread::scope(|scope| scope.spawn(std::thread::park).join())
            })
            .expect("it never comes here");
        }
        let name = "thread::tests::a_scope_that_hangs_aborts_the_program_with_the_tests_name_and_words";
        let mut again = std::process::Command::new(std::env::current_exe().unwrap());
        // Two, since a lone thread of tests bears no name of a test.
        again.args(["--exact", name, "--test-threads", "2"]);
        let output = again.env(HANGS, "").env(crate::LIMIT_VARIABLE, "0.2").bounded_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let words =
            format!("{name}: waited 200ms in vain: a thread that nobody stops; the test program is aborted");
        assert!(!output.status.success() && said.contains(&words), "{said}");
    }
}
