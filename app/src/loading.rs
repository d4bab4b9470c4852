//! A line for whoever waits while models and textures are read.

use crate::progress::StatusLine;
use rt_core::plain_text::Plain;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

/// Less is no waiting.
const SOON: Duration = Duration::from_secs(1);
const TURN: Duration = Duration::from_millis(200);

/// Does this work, which reads a file and what it names; if that takes longer, a line says so.
pub(crate) fn while_reading<T>(file: &Path, work: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let (done, is_done) = sync_channel::<()>(0);
    std::thread::scope(|scope| {
        let tell = move || {
            let mut pause = SOON;
            let mut line = StatusLine::default();
            while is_done.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                let seconds = begun.elapsed().as_secs();
                line.show(|| format!("phantom3: reading {} ({seconds} s)", Plain(file.display())));
                pause = TURN;
            }
        };
        // Without a thread there is no line.
        let teller = std::thread::Builder::new().name("reading".into()).spawn_scoped(scope, tell);
        let result = work();
        drop(done);
        // The line ends before anybody else speaks.
        let _ = teller.map(ScopedJoinHandle::join);
        result
    })
}
