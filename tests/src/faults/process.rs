//! Processes to be stopped, killed and asked after.

use crate::driver::{HANG, wait_or_kill_after};
use crate::programs;
use crate::workplace::spawn;
use patience::prelude::*;
use patience::{limit, watched};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A program's end and everything it said.
#[derive(Debug)]
pub struct End {
    /// Exit status; `None` if a signal killed it.
    pub status: Option<i32>,
    /// The signal that killed it.
    pub signal: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// A running program; killed when dropped.
#[derive(Debug)]
pub struct Running {
    child: Child,
    /// What it has said on standard error, as far as that was listened to.
    heard: String,
}

impl Running {
    /// Starts it. It must not say more than a pipe holds, 64 KiB, before it ends.
    pub fn start(command: &mut Command) -> Self {
        let child = spawn(command.stdout(Stdio::piped()).stderr(Stdio::piped()).stdin(Stdio::null()));
        Self { child, heard: String::new() }
    }

    /// Starts it with a standard error of one's own, which is not listened to.
    pub fn start_saying_to(command: &mut Command, err: impl Into<Stdio>) -> Self {
        let child = spawn(command.stdout(Stdio::null()).stderr(err).stdin(Stdio::null()));
        Self { child, heard: String::new() }
    }

    /// Starts it with a standard input of one's own, which goes on until what is behind it ends.
    pub fn start_reading(command: &mut Command, input: impl Into<Stdio>) -> Self {
        let child = spawn(command.stdout(Stdio::piped()).stderr(Stdio::piped()).stdin(input));
        Self { child, heard: String::new() }
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) {
        send(self.id(), signal);
    }

    /// Kills it, and returns when it is dead.
    pub fn kill(mut self) {
        self.child.end();
    }

    /// Lets it go on if it was stopped.
    pub fn go_on(&mut self) {
        if !self.has_ended() {
            self.signal(Signal::CONT);
        }
    }

    /// Whether it has ended.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("our own child").is_some()
    }

    /// Fails the test with the program's words if it has ended.
    pub fn must_run(&mut self) {
        if self.child.try_wait().expect("our own child").is_some() {
            panic!("it ended by itself: {:?}", self.end());
        }
    }

    /// Waits until it has said this on standard error.
    pub fn hear(&mut self, words: &str) {
        let pipe = self.child.stderr.as_mut().expect("piped");
        let begun = Instant::now();
        while !self.heard.contains(words) {
            assert!(begun.elapsed() < HANG, "it has only said {:?}", self.heard);
            let mut ready = [PollFd::new(pipe, PollFlags::IN)];
            let pause = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
            if poll(&mut ready, Some(&pause)).is_ok_and(|ready| ready > 0) {
                let mut bytes = [0; 4096];
                let read = pipe.read(&mut bytes).expect("readable");
                assert!(read > 0, "it ended and has only said {:?}", self.heard);
                self.heard += &String::from_utf8_lossy(&bytes[..read]);
            }
        }
    }

    /// The lines of its standard output, as they come; the channel ends with them. Its [`end`](Self::end) then
    /// knows of none.
    pub fn take_lines(&mut self) -> Receiver<String> {
        let pipe = self.child.stdout.take().expect("taken once");
        let (send, receive) = channel();
        // It ends with the pipe, and the pipe with the program.
        std::thread::spawn(move || {
            BufReader::new(pipe).lines().map_while(Result::ok).try_for_each(|line| send.send(line))
        });
        receive
    }

    /// Waits for its end.
    pub fn end(&mut self) -> End {
        self.end_within(HANG)
    }

    /// Waits for the end of one that may take longer.
    pub fn end_within(&mut self, patience: Duration) -> End {
        use std::os::unix::process::ExitStatusExt;
        let status = wait_or_kill_after(&mut self.child, patience);
        let text = |pipe: Option<&mut dyn Read>| {
            let mut bytes = Vec::new();
            if let Some(pipe) = pipe {
                pipe.read_to_end(&mut bytes).expect("readable");
            }
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let Self { child, heard } = self;
        // Whoever it left behind may hold its pipes open.
        let (out, rest) = watched(limit(), "the pipes of a program that has ended are closed", || {
            let out = text(child.stdout.as_mut().map(|pipe| pipe as _));
            (out, text(child.stderr.as_mut().map(|pipe| pipe as _)))
        });
        let err = std::mem::take(heard) + &rest;
        End { status: status.code(), signal: status.signal(), out, err }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.child.end();
    }
}

/// Sends a signal to a process that lives.
pub fn send(process: u32, signal: Signal) {
    let pid = Pid::from_raw(process.cast_signed()).expect("a process id");
    kill_process(pid, signal).expect("it lives");
}

/// Whether a process lives; one that has died and that nobody has asked after does not.
pub fn is_alive(process: u32) -> bool {
    state_and_parent(process).is_some_and(|(state, _)| !matches!(state, 'Z' | 'X'))
}

/// The living children of a process.
pub fn children_of(process: u32) -> Vec<u32> {
    processes()
        .filter(|id| is_alive(*id) && state_and_parent(*id).is_some_and(|(_, parent)| parent == process))
        .collect()
}

/// A process that has this text in its environment; one that has ended has none.
pub fn with_environment(text: &str) -> Option<u32> {
    let has = |id: &u32| {
        let environment = std::fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
        environment.windows(text.len()).any(|window| window == text.as_bytes())
    };
    processes().find(has)
}

fn processes() -> impl Iterator<Item = u32> {
    let all = std::fs::read_dir("/proc").expect("/proc").flatten();
    all.filter_map(|entry| entry.file_name().to_str()?.parse().ok())
}

/// The name in the middle may hold anything, even parentheses: what follows it is counted from its end.
fn state_and_parent(process: u32) -> Option<(char, u32)> {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let mut fields = text.get(text.rfind(')')? + 1..)?.split_whitespace();
    Some((fields.next()?.chars().next()?, fields.next()?.parse().ok()?))
}

/// Names the role of a test program that another one started.
const ROLE_VARIABLE: &str = "PHANTOM3_TEST_ROLE";

/// This very test program again, running only the test `name`, which finds its [`role`] there.
pub fn myself(name: &str, role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("the test knows its own file"));
    command.args(["--exact", name, "--nocapture", "--test-threads", "1"]).env(ROLE_VARIABLE, role);
    command
}

/// What another test program started this one for; `None`: nobody did.
pub fn role() -> Option<String> {
    std::env::var(ROLE_VARIABLE).ok()
}

/// `io-driver` with these arguments, at this socket, to its end.
pub fn io_driver(arguments: &[&str], socket: &std::path::Path) -> End {
    Running::start(programs::io_driver().args(arguments).arg("--socket").arg(socket)).end()
}
