//! Load that disturbs a real-time loop the way an ordinary machine does.
//!
//! Model: each worker is a process of its own, niced, that dies with this one, whatever kills it. All are bounded:
//! memory to 64 MiB, disk to one nameless file of 64 MiB that vanishes with its process, forks and
//! packets to a rate, packets to 127.0.0.1.
//! Invariant: when a [`Load`] is dropped, its processes are gone.

mod disk;
mod fork;
mod loopback;
mod memory;

use crate::jitter::child::OwnChild;
use crate::jitter::error::JitterError;
use crate::jitter::roles::{Role, command_on};
use std::fmt;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// How much it gives way to ordinary work.
const NICE: i32 = 10;

/// What a worker does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Copies through more memory than any cache holds.
    Memory,
    /// Rewrites a file and has it brought to disk.
    Disk,
    /// Starts processes that end at once.
    Fork,
    /// Sends itself packets.
    Loopback,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Memory, Self::Disk, Self::Fork, Self::Loopback];

    /// Its name in options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Memory => "memory",
            Self::Disk => "disk",
            Self::Fork => "fork",
            Self::Loopback => "loopback",
        }
    }

    /// The one with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// All names.
    pub fn names() -> Vec<&'static str> {
        Self::ALL.map(Self::name).to_vec()
    }
}

/// Which load.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadPlan {
    /// Kinds.
    pub kinds: Vec<Kind>,
    /// Processes of each kind.
    pub workers: usize,
}

impl fmt::Display for LoadPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.kinds.iter().map(|kind| kind.name()).collect();
        write!(f, "{} x {}", self.workers, names.join(","))
    }
}

/// Running workers; they end when it is dropped.
#[derive(Debug)]
pub struct Load {
    workers: Vec<(Kind, OwnChild)>,
}

impl Load {
    /// Starts all workers; those that need a disk take the file system of `directory`.
    ///
    /// # Errors
    /// If one does not start.
    pub fn start(plan: &LoadPlan, directory: &Path, cpus: &[usize]) -> Result<Self, JitterError> {
        let mut load = Self { workers: Vec::new() };
        for kind in plan.kinds.iter().flat_map(|kind| std::iter::repeat_n(*kind, plan.workers)) {
            let failed =
                |error: std::io::Error| JitterError::fault(&format!("start the load {}", kind.name()), error);
            let mut command = command_on(Role::Load, cpus).map_err(failed)?;
            let child = OwnChild::start(command.arg(kind.name()).arg(directory)).map_err(failed)?;
            load.workers.push((kind, child));
        }
        Ok(load)
    }

    /// Process ids.
    pub fn ids(&self) -> Vec<u32> {
        self.workers.iter().map(|(_, child)| child.id()).collect()
    }

    /// Workers that have ended by themselves, which none should; each is told once.
    pub fn casualties(&mut self) -> Vec<String> {
        let mut told = Vec::new();
        self.workers.retain_mut(|(kind, child)| match child.ended() {
            Some(status) => {
                told.push(format!("the load {} ended by itself ({status})", kind.name()));
                false
            }
            None => true,
        });
        told
    }
}

/// The role's program: `load KIND DIRECTORY`, until somebody ends it.
pub fn main() -> ExitCode {
    let mut words = std::env::args_os().skip(1);
    let kind = words.next().and_then(|name| Kind::from_name(name.to_str()?));
    let (Some(kind), Some(directory)) = (kind, words.next()) else {
        eprintln!("jitter: the load needs a kind and a directory");
        return ExitCode::from(2);
    };
    // Whatever the result: giving way is polite, not necessary.
    let _ = rustix::process::nice(NICE);
    let failed = match kind {
        Kind::Memory => memory::work(),
        Kind::Disk => disk::work(Path::new(&directory)),
        Kind::Fork => fork::work(),
        Kind::Loopback => loopback::work(),
    };
    eprintln!("jitter: the load {} cannot go on: {failed}", kind.name());
    ExitCode::from(3)
}

/// Sleeps the rest of a period.
struct Pace {
    period: Duration,
    next: std::time::Instant,
}

impl Pace {
    fn per_second(rate: u32) -> Self {
        Self { period: Duration::from_secs(1) / rate, next: std::time::Instant::now() }
    }

    fn wait(&mut self) {
        let now = std::time::Instant::now();
        // Not catching up: a bounded rate stays bounded after a stall too.
        self.next = (self.next + self.period).max(now);
        std::thread::sleep(self.next - now);
    }
}
