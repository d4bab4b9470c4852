//! Waits for child processes: one that does not end is killed, and what it had said is in the message.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::condition::is_met;
use crate::limit;

/// Waits for commands.
pub trait BoundedCommand {
    /// As [`Command::output`], within [`limit`]: standard output and error are collected, standard input is empty.
    fn bounded_output(&mut self) -> io::Result<Output>;

    /// As [`Command::status`], within [`limit`].
    fn bounded_status(&mut self) -> io::Result<ExitStatus>;
}

impl BoundedCommand for Command {
    #[track_caller]
    fn bounded_output(&mut self) -> io::Result<Output> {
        let child = self.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        // Not by `map`: the place that is told is the caller's.
        match child {
            Ok(child) => Ok(child.bounded_output()),
            Err(error) => Err(error),
        }
    }

    #[track_caller]
    fn bounded_status(&mut self) -> io::Result<ExitStatus> {
        Ok(self.spawn()?.bounded_wait())
    }
}

/// Waits for children. One that does not end in time is killed, and fails the test.
pub trait BoundedChild {
    /// As [`Child::wait`], within [`limit`].
    fn bounded_wait(&mut self) -> ExitStatus;

    /// As [`Child::wait`], within a limit of its own.
    fn wait_within(&mut self, limit: Duration) -> ExitStatus;

    /// As [`Child::wait_with_output`], within [`limit`].
    fn bounded_output(self) -> Output;

    /// As [`Child::wait_with_output`], within a limit of its own.
    fn output_within(self, limit: Duration) -> Output;

    /// Kills it and waits until it is gone; also fine for one that has ended.
    fn end(&mut self);
}

impl BoundedChild for Child {
    #[track_caller]
    fn bounded_wait(&mut self) -> ExitStatus {
        self.wait_within(limit())
    }

    #[track_caller]
    fn wait_within(&mut self, limit: Duration) -> ExitStatus {
        end_of(self, limit, String::new)
    }

    #[track_caller]
    fn bounded_output(self) -> Output {
        self.output_within(limit())
    }

    #[track_caller]
    fn output_within(mut self, limit: Duration) -> Output {
        drop(self.stdin.take());
        let words = [Words::of(self.stdout.take()), Words::of(self.stderr.take())];
        let status = end_of(&mut self, limit, || {
            let said = words.each_ref().map(Words::until_now);
            format!("; it has said {:?} and on standard error {:?}", said[0], said[1])
        });
        let [stdout, stderr] = words.map(Words::all);
        Output { status, stdout, stderr }
    }

    fn end(&mut self) {
        let _ = self.kill();
        // Whoever is killed goes, unless the kernel itself waits for something.
        let _ = is_met(limit(), || self.try_wait().map_or(Some(()), |status| status.map(drop)));
    }
}

#[track_caller]
fn end_of(child: &mut Child, limit: Duration, said: impl FnOnce() -> String) -> ExitStatus {
    let status = is_met(limit, || child.try_wait().expect("our child"));
    status.unwrap_or_else(|| {
        let said = said();
        child.end();
        panic!("process {} did not end within {limit:?} and was killed{said}", child.id())
    })
}

/// What comes through a pipe, read by a thread of its own.
struct Words {
    bytes: Arc<Mutex<Vec<u8>>>,
    thread: Option<JoinHandle<()>>,
}

impl Words {
    fn of(pipe: Option<impl Read + Send + 'static>) -> Self {
        let bytes = Arc::new(Mutex::new(Vec::new()));
        let into = Arc::clone(&bytes);
        let read = move |mut pipe: Box<dyn Read + Send>| {
            let mut chunk = [0; 4096];
            while let Ok(read @ 1..) = pipe.read(&mut chunk) {
                into.lock().expect("nobody panics here").extend_from_slice(&chunk[..read]);
            }
        };
        let thread = pipe.map(|pipe| std::thread::spawn(move || read(Box::new(pipe))));
        Self { bytes, thread }
    }

    fn until_now(&self) -> String {
        String::from_utf8_lossy(&self.bytes.lock().expect("nobody panics here")).into_owned()
    }

    /// To the end of the pipe, which whoever the child left behind may hold open.
    #[track_caller]
    fn all(self) -> Vec<u8> {
        if let Some(thread) = self.thread {
            let is_closed = is_met(limit(), || thread.is_finished().then_some(())).is_some();
            assert!(is_closed, "the child has ended, but somebody it left behind holds its pipe open");
        }
        std::mem::take(&mut self.bytes.lock().expect("nobody panics here"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thread::tests::message_of;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn a_childs_words_and_its_status_are_collected() {
        // More than a pipe holds.
        let mut command = shell("head -c 200000 /dev/zero; echo to the side >&2; exit 3");
        let output = command.bounded_output().unwrap();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(3), 200_000));
        assert_eq!(output.stderr, b"to the side\n");
    }

    #[test]
    fn a_child_that_hangs_is_killed_and_its_words_are_told() {
        let mut child = shell("echo loading; exec sleep 1000").stdout(Stdio::piped()).spawn().unwrap();
        let words = Words::of(child.stdout.take());
        crate::until("it speaks", || words.until_now() == "loading\n");
        let wait = || end_of(&mut child, Duration::from_millis(50), || format!("; {:?}", words.until_now()));
        let message = message_of(wait);
        assert!(message.contains("did not end within 50ms and was killed; \"loading\\n\""), "{message}");
        assert!(child.try_wait().unwrap().is_some(), "it is gone");
    }
}
