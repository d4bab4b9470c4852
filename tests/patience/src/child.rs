//! Waits for child processes: one that does not end is killed, and what it had said is in the message.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::condition::is_met;
use crate::limit;

/// Runs a command to its end, as [`Command::output`] does: standard output and error are collected.
#[track_caller]
pub fn output(command: &mut Command) -> io::Result<Output> {
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    Ok(output_of(child))
}

/// Runs a command to its end, as [`Command::status`] does.
#[track_caller]
pub fn status(command: &mut Command) -> io::Result<ExitStatus> {
    Ok(ended(&mut command.spawn()?))
}

/// Waits for a child's end and collects what it says into its pipes, as [`Child::wait_with_output`] does.
#[track_caller]
pub fn output_of(mut child: Child) -> Output {
    drop(child.stdin.take());
    let words = [Words::of(child.stdout.take()), Words::of(child.stderr.take())];
    let status = end_of(&mut child, limit(), || {
        let said: Vec<String> = words.iter().map(Words::until_now).collect();
        format!("; it has said {:?} and on standard error {:?}", said[0], said[1])
    });
    let [stdout, stderr] = words.map(Words::all);
    Output { status, stdout, stderr }
}

/// Waits for a child's end. One that takes longer than [`limit`] is killed, and fails the test.
#[track_caller]
pub fn ended(child: &mut Child) -> ExitStatus {
    ended_within(limit(), child)
}

/// As [`ended`], with a limit of its own.
#[track_caller]
pub fn ended_within(limit: Duration, child: &mut Child) -> ExitStatus {
    end_of(child, limit, String::new)
}

/// Kills a child and waits until it is gone; also fine for one that has ended.
pub fn end(child: &mut Child) {
    let _ = child.kill();
    // Whoever is killed goes, unless the kernel itself waits for something.
    let _ = is_met(limit(), || child.try_wait().map_or(Some(()), |status| status.map(drop)));
}

#[track_caller]
fn end_of(child: &mut Child, limit: Duration, said: impl FnOnce() -> String) -> ExitStatus {
    let status = is_met(limit, || child.try_wait().expect("our child"));
    status.unwrap_or_else(|| {
        let said = said();
        end(child);
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
            crate::joined("the pipe of a child that has ended is closed", thread);
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
        let output = output(&mut shell("head -c 200000 /dev/zero; echo to the side >&2; exit 3")).unwrap();
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
