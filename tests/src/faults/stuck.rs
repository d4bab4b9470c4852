//! A driver's service thread that is stuck in a system call, or to which every call of a kind fails.
//!
//! strace attaches to that one thread, the process's first, and holds it before the call or makes the call fail; the
//! loop and the other threads are not traced.

use crate::driver::HANG;
use crate::faults::stand::Stand;
use patience::prelude::*;
use shm_abi::client;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What is done to a system call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Harm {
    /// It does not begin.
    Stall,
    /// It fails with this error.
    Failure(&'static str),
}

/// strace, attached to a driver's service thread until it is dropped.
#[derive(Debug)]
pub struct Tracer {
    strace: Child,
    output: PathBuf,
}

impl Tracer {
    /// Whether there is a strace that may attach to our own children.
    pub fn works() -> bool {
        let mut sleeper = Command::new("sleep").arg("1000").spawn().expect("sleep runs");
        let attached = attach(sleeper.id(), Path::new("/dev/null"), &[]);
        let works = attached.is_some();
        if let Some(mut strace) = attached {
            end(&mut strace);
        }
        end(&mut sleeper);
        works
    }

    /// Writes down the calls of the service thread.
    pub fn listening(stand: &Stand) -> Self {
        Self::start(stand, &[])
    }

    /// Does harm to each call of this name.
    pub fn harming(stand: &Stand, call: &str, harm: Harm) -> Self {
        let inject = match harm {
            // Longer than any test (us).
            Harm::Stall => format!("inject={call}:delay_enter=600000000"),
            Harm::Failure(error) => format!("inject={call}:error={error}"),
        };
        Self::start(stand, &["-e", &format!("trace={call}"), "-e", &inject])
    }

    fn start(stand: &Stand, arguments: &[&str]) -> Self {
        let output = stand.path("trace");
        let strace = attach(stand.driver.id(), &output, arguments).expect("strace attaches");
        Self { strace, output }
    }

    /// Names of the calls that were begun so far.
    pub fn calls(&self) -> BTreeSet<String> {
        let text = std::fs::read_to_string(&self.output).unwrap_or_default();
        let name = |line: &str| {
            let name = line.split_once('(')?.0;
            name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_').then(|| name.to_owned())
        };
        text.lines().filter_map(name).collect()
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        end(&mut self.strace);
    }
}

/// `None`: it may not.
fn attach(thread: u32, output: &Path, arguments: &[&str]) -> Option<Child> {
    let mut command = Command::new("strace");
    command.arg("-o").arg(output).args(["-p", &thread.to_string()]).args(arguments);
    let mut strace = command.stdin(Stdio::null()).stderr(Stdio::null()).spawn().ok()?;
    let begun = Instant::now();
    let is_attached = || {
        let status = std::fs::read_to_string(format!("/proc/{thread}/status")).unwrap_or_default();
        status.lines().any(|line| line.strip_prefix("TracerPid:").is_some_and(|pid| pid.trim() != "0"))
    };
    while !is_attached() {
        if strace.try_wait().expect("our own child").is_some() {
            return None;
        }
        assert!(begun.elapsed() < HANG, "strace neither attaches nor ends");
        std::thread::sleep(Duration::from_millis(1));
    }
    Some(strace)
}

fn end(child: &mut Child) {
    child.end();
}

/// Requests of clients to a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asking {
    /// Requests that leave whoever commands alone: to look, a lease that is another's, a fault to leave if there is none.
    Nothing,
    /// Leases, after the end of the one that there is: nobody commands while one is made.
    Leases,
    /// That the driver ends.
    TheEnd,
}

impl Asking {
    /// All that happens in a driver's life, in order.
    pub const LIFE: [Self; 3] = [Self::Nothing, Self::Leases, Self::TheEnd];
}

/// Clients that ask, in a thread of its own: any of them may wait for a service that is stuck.
pub fn ask(socket: &Path, what: Asking) -> JoinHandle<()> {
    let socket = socket.to_path_buf();
    std::thread::spawn(move || match what {
        Asking::Nothing => {
            let _ = client::observe(&socket, "life");
            let _ = client::command(&socket, "life");
            let _ = client::zero(&socket, "life", 0);
            let _ = client::clear_fault(&socket, "life");
        }
        Asking::Leases => {
            let _ = client::end_lease(&socket, "life");
            for _ in 0..3 {
                // It is in force once the service has seen that its memory is mapped.
                let lease = client::command(&socket, "life");
                std::thread::sleep(Duration::from_millis(60));
                drop(lease);
                std::thread::sleep(Duration::from_millis(30));
            }
        }
        Asking::TheEnd => {
            let _ = client::stop(&socket, "life");
        }
    })
}
