//! Prepares the calling thread and its process for a hard real-time loop, and says what it got.
//!
//! Problem: each of these requests may fail for lack of rights, and some "succeed" without effect: a
//! cgroup may forbid what the limit allows, a kernel may not be real-time at all. A loop that
//! believes it is real-time and is not, is worse than one that knows it is not.
//! Model: [`apply`] tries everything that was asked for and then reads back from the kernel what is
//! in force. Each item becomes a [`Guarantee`] with what was wanted, what was found and what to do.
//! Invariants: never fails and never panics: best effort, and the caller decides whether that is
//! enough. `found` never comes from a return code.
//! Cost: up to seconds, for locking and touching memory. Before the loop, on the loop's own thread.
//!
//! What counts for the calling thread: CPU, policy, timer slack, stack. For the whole process: locked
//! memory and heap. Threads started afterwards inherit the CPU (start them first, or place them) but
//! not the policy.

pub(crate) mod kernel;
pub(crate) mod latency;
mod limits;
pub(crate) mod memory;
pub(crate) mod placement;
mod report;
pub(crate) mod scheduling;

pub use report::{Guarantee, SetupReport};
pub use scheduling::promote_beside;

use std::fs::File;

/// What to ask for; nothing by default.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SetupRequest {
    /// Schedule the thread `SCHED_FIFO` with this priority, 1 to 99. Stay below 99, which kernel
    /// threads use, and on a real-time kernel choose deliberately above or below 50, its interrupts.
    pub fifo_priority: Option<u8>,
    /// Run on this CPU alone.
    pub cpu: Option<usize>,
    /// Keep all present and future pages of the process in memory.
    pub lock_memory: bool,
    /// Touch this much of the thread's stack, so that the loop's calls find it mapped.
    pub prefault_stack_bytes: usize,
    /// Touch this much heap and make the allocator keep it. On a thread other than the main one
    /// stay below 64 MiB, the size of such a thread's heap in glibc.
    pub prefault_heap_bytes: usize,
    /// How late the kernel may wake the thread to save power; without effect, and reported as 0, for
    /// a `SCHED_FIFO` thread. 1 is the least: 0 means the kernel's default.
    pub timer_slack_ns: Option<u64>,
    /// Longest wake-up time of a sleeping CPU; 0 keeps all CPUs out of deep sleep. In force as long
    /// as the guards live.
    pub dma_latency_us: Option<i32>,
}

/// What has to stay alive for the guarantees to hold; dropping it lets the CPUs sleep deeply again.
#[derive(Debug, Default)]
#[must_use = "dropping the guards gives up the guarantees"]
pub struct SetupGuards {
    dma_latency: Option<File>,
}

impl SetupGuards {
    /// Whether `/dev/cpu_dma_latency` is held open.
    #[must_use]
    pub fn holds_dma_latency(&self) -> bool {
        self.dma_latency.is_some()
    }
}

/// Does what `request` asks for to the calling thread and its process, and reports what is in force.
///
/// With a policy come the circumstances that decide its worth: kernel, throttling, fair server; with a
/// CPU, its isolation. The policy comes last: from then on the thread would keep others from their work while it
/// touches memory.
pub fn apply(request: &SetupRequest) -> (SetupReport, SetupGuards) {
    let mut report = SetupReport::default();
    let mut guards = SetupGuards::default();
    if let Some(cpu) = request.cpu {
        report.guarantees.push(placement::run_on(cpu));
        report.guarantees.push(placement::isolation(cpu));
    }
    report.guarantees.extend(memory::prepare(request));
    if let Some(ns) = request.timer_slack_ns {
        report.guarantees.push(latency::limit_timer_slack(ns));
    }
    if let Some(us) = request.dma_latency_us {
        let (guarantee, file) = latency::limit_dma_latency(us);
        report.guarantees.push(guarantee);
        guards.dma_latency = file;
    }
    if let Some(priority) = request.fifo_priority {
        report.guarantees.push(scheduling::make_fifo(priority));
        report.guarantees.extend(kernel::circumstances(request.cpu));
    }
    (report, guards)
}
