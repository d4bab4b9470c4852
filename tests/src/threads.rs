//! What the kernel says about a thread of a child process, and on which CPUs children run.
//!
//! Problem: "the loop sleeps once a tick and faults no page" is a claim of the program about itself; the
//! kernel's books about that thread are evidence. None of these needs rights for a child of one's own.

use patience::prelude::*;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

/// A thread of another process.
#[derive(Debug, Clone)]
pub struct ThreadOf {
    /// Its id.
    pub tid: u32,
    directory: PathBuf,
}

/// Page faults of a thread since it began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageFaults {
    /// Without I/O.
    pub minor: u64,
    /// With I/O.
    pub major: u64,
}

impl ThreadOf {
    /// Finds the thread of this name, waiting for it to appear.
    pub fn find(pid: u32, name: &str) -> Self {
        let begun = Instant::now();
        loop {
            if let Some(found) = Self::look_for(pid, name) {
                return found;
            }
            assert!(begun.elapsed() < crate::driver::HANG, "process {pid} has no thread {name}");
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    fn look_for(pid: u32, name: &str) -> Option<Self> {
        let tasks = fs::read_dir(format!("/proc/{pid}/task")).ok()?;
        let named =
            |directory: &PathBuf| fs::read_to_string(directory.join("comm")).is_ok_and(|n| n.trim() == name);
        let directory = tasks.flatten().map(|task| task.path()).find(named)?;
        let tid = directory.file_name()?.to_str()?.parse().ok()?;
        Some(Self { tid, directory })
    }

    /// Its page faults (proc(5), fields 10 and 12 of `stat`).
    pub fn page_faults(&self) -> PageFaults {
        let stat = self.read("stat");
        // Fields are counted behind the name, which may hold anything.
        let behind = stat.rsplit_once(')').expect("a name in parentheses").1;
        let field =
            |number: usize| behind.split_whitespace().nth(number - 3).and_then(|text| text.parse().ok());
        PageFaults { minor: field(10).expect("minflt"), major: field(12).expect("majflt") }
    }

    /// How often it went to sleep of its own will: in a system call that blocks.
    pub fn sleeps(&self) -> u64 {
        self.status("voluntary_ctxt_switches:")
    }

    /// How often it has called read- or write-like system calls; `None`: the kernel does not tell.
    pub fn reads_and_writes(&self) -> Option<u64> {
        let io = fs::read_to_string(self.directory.join("io")).ok()?;
        let count = |key| line_value(&io, key)?.parse::<u64>().ok();
        Some(count("syscr:")? + count("syscw:")?)
    }

    /// Number of the system call that it is blocked in at this moment; `None`: it runs, or the kernel does
    /// not tell.
    pub fn blocked_in(&self) -> Option<u64> {
        fs::read_to_string(self.directory.join("syscall")).ok()?.split_whitespace().next()?.parse().ok()
    }

    /// How long it has been on a CPU (ns); `None`: the kernel does not tell.
    pub fn cpu_ns(&self) -> Option<u64> {
        fs::read_to_string(self.directory.join("schedstat")).ok()?.split_whitespace().next()?.parse().ok()
    }

    /// Memory of its process that is locked (KiB).
    pub fn locked_kib(&self) -> u64 {
        self.status("VmLck:")
    }

    fn status(&self, key: &str) -> u64 {
        line_value(&self.read("status"), key)
            .and_then(|text| text.parse().ok())
            .expect("a number in its status")
    }

    fn read(&self, file: &str) -> String {
        fs::read_to_string(self.directory.join(file)).expect("the thread lives")
    }
}

/// The first word behind `key`.
fn line_value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.lines().find_map(|line| line.strip_prefix(key))?.split_whitespace().next()
}

/// Runs `f` on this CPU alone; so do the processes that it starts.
pub fn pinned_to<R: Send>(cpu: usize, f: impl FnOnce() -> R + Send) -> R {
    std::thread::scope(|scope| {
        let body = || {
            let mut only = CpuSet::new();
            only.set(cpu);
            sched_setaffinity(None, &only).expect("a CPU that is ours");
            f()
        };
        scope.spawn(body).bounded_join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The last CPU that this thread may use: the driver's choice.
pub fn last_cpu() -> usize {
    let mine = sched_getaffinity(None).expect("our own mask");
    (0..CpuSet::MAX_CPU).rev().find(|cpu| mine.is_set(*cpu)).expect("at least one CPU")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_sleeps_is_seen_to_sleep_and_one_that_touches_memory_to_fault() {
        let (stop, stopped) = std::sync::mpsc::channel::<()>();
        let body = move || {
            while stopped
                .recv_timeout(std::time::Duration::from_millis(1))
                .is_err_and(|e| e == std::sync::mpsc::RecvTimeoutError::Timeout)
            {
                // A page of its own: an allocator would hand out again what was touched before.
                memmap2::MmapMut::map_anon(1).unwrap()[0] = 1;
            }
        };
        let thread = std::thread::Builder::new().name("sleepy".into()).spawn(body).unwrap();
        let seen = ThreadOf::find(std::process::id(), "sleepy");
        let (sleeps, faults) = (seen.sleeps(), seen.page_faults());
        let begun = Instant::now();
        while seen.sleeps() < sleeps + 10 || seen.page_faults().minor < faults.minor + 10 {
            assert!(
                begun.elapsed() < crate::driver::HANG,
                "{} sleeps, {:?}",
                seen.sleeps(),
                seen.page_faults()
            );
            std::thread::yield_now();
        }
        drop(stop);
        thread.bounded_join().unwrap();
    }

    #[test]
    fn pinning_reaches_no_further_than_the_closure() {
        let cpu = last_cpu();
        let before = sched_getaffinity(None).unwrap();
        assert_eq!(pinned_to(cpu, || sched_getaffinity(None).unwrap().count()), 1);
        assert_eq!(sched_getaffinity(None).unwrap(), before);
    }
}
