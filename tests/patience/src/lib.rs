//! Bounded waits for tests: conditions, threads, channels, sockets, child processes.
//!
//! Problem: the test harness has no time limit. A test that waits for what never comes stalls its program and everything
//! behind it, and says neither its name nor what was missing.
//!
//! Model: every wait ends after [`limit`] at the latest, with a panic in the thread of the test, which the harness reports
//! under the test's name. The message says what did not come and, of a child process, what it had said; the child is
//! killed. Waits that a panic cannot end (threads of a scope) are under a [watchdog](watched), which aborts the program
//! with the same words.
//!
//! Invariant: nothing here is a measurement. The limit is far above what the most loaded machine needs, and a test
//! that passes never waits for it.

#![forbid(unsafe_code)]

mod child;
mod condition;
mod socket;
mod thread;

pub use child::{BoundedChild, BoundedCommand};
pub use condition::{until, until_some, until_within};
pub use socket::{accepted, patient};
pub use thread::{BoundedReceiver, BoundedThread, Raised, watched};

/// The waits that read as methods of the standard library's types.
pub mod prelude {
    pub use crate::{BoundedChild, BoundedCommand, BoundedReceiver, BoundedThread};
}

use std::sync::OnceLock;
use std::time::Duration;

/// Long enough for the most loaded machine: only a hang takes longer.
pub const HANG: Duration = Duration::from_secs(60);

/// Environment variable with another limit, in seconds: a shorter one where hangs are expected, as in a mutation run.
pub const LIMIT_VARIABLE: &str = "PHANTOM3_TEST_PATIENCE_S";

/// How long a wait may take: [`HANG`], or what [`LIMIT_VARIABLE`] says.
pub fn limit() -> Duration {
    static LIMIT: OnceLock<Duration> = OnceLock::new();
    *LIMIT.get_or_init(|| {
        let Ok(text) = std::env::var(LIMIT_VARIABLE) else { return HANG };
        let seconds = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        seconds.unwrap_or_else(|| panic!("{LIMIT_VARIABLE} is {text:?}; it must be a number of seconds"))
    })
}
