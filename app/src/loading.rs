//! Reading of scenes, models and textures, which may take long: a line for whoever waits, and an ear for signals.

use crate::interrupted;
use crate::progress::{SOON, StatusLine};
use rt_core::plain_text::Plain;
use rt_core::signals::StopSignals;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

/// Between two looks for a signal.
const TURN: Duration = Duration::from_millis(20);

/// Does this work, which reads a file and what it names, and makes nothing. If that takes longer a line says so; a signal
/// ends the program meanwhile.
pub(crate) fn while_reading<T>(file: &Path, signals: &StopSignals, work: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let (done, is_done) = sync_channel::<()>(0);
    std::thread::scope(|scope| {
        let tell = move || {
            let mut line = StatusLine::told_just_now();
            while is_done.recv_timeout(TURN) == Err(RecvTimeoutError::Timeout) {
                if let Some(signal) = signals.requested() {
                    line.end();
                    interrupted::end(signal);
                }
                let elapsed = begun.elapsed();
                if elapsed > SOON {
                    line.show(|| {
                        format!("phantom3: reading {} ({} s)", Plain(file.display()), elapsed.as_secs())
                    });
                }
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
