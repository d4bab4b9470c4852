//! What files cannot tell: things that have to be tried.
//!
//! Invariant: a probe leaves nothing behind and starves nobody: the one that spins does so at the
//! lowest real-time priority, so that a driver that runs on the same CPU takes it away.

use std::time::Duration;

/// What can be tried on a machine. Errors are raw `errno`s where the kernel refused something that is
/// judged, and sentences where nothing but reporting is left.
pub trait Probes {
    /// Promotes a thread on `cpu` to `SCHED_FIFO` and reads back.
    fn promotion(&self, cpu: usize, priority: u8) -> PromotionProbe;
    /// Locks all memory of the process, reads back, unlocks.
    fn memory_lock(&self) -> LockProbe;
    /// Spins on `cpu` reading the clock.
    ///
    /// # Errors
    /// Why it could not.
    fn gaps(&self, cpu: usize, length: Duration) -> Result<GapProbe, String>;
    /// Page faults of a loop on `cpu` that uses memory which was touched before.
    ///
    /// # Errors
    /// Why it could not be tried.
    fn loop_faults(&self, cpu: usize) -> Result<u64, String>;
    /// The wake-up limit in force (us) while `/dev/cpu_dma_latency` is held at 0.
    ///
    /// # Errors
    /// Why it cannot be held.
    fn held_dma_latency_us(&self) -> Result<i32, String>;
    /// Time between two ticks of the kernel (ns).
    ///
    /// # Errors
    /// Why it cannot be known.
    fn kernel_tick_ns(&self) -> Result<u64, String>;
    /// System management interrupts of a CPU since it was started.
    ///
    /// # Errors
    /// Why they are not counted, or not for us.
    fn smi_count(&self, cpu: usize) -> Result<u32, String>;
    /// A 32-bit word of a file that can only be mapped, as a PCI card's memory.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn mapped_word(&self, path: &str, offset: usize) -> Result<u32, String>;
}

/// What came of a promotion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PromotionProbe {
    /// Whether the thread got onto the CPU first; else why not (errno).
    pub placed: Result<(), i32>,
    /// What the kernel answered (errno).
    pub asked: Result<(), i32>,
    /// Policy and priority in force afterwards (errno).
    pub found: Result<(i32, i32), i32>,
    /// The RTPRIO limit.
    pub rtprio_limit: u64,
}

/// What came of locking memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LockProbe {
    /// What the kernel answered (errno).
    pub asked: Result<(), i32>,
    /// `/proc/self/status` while it was locked.
    pub status: String,
    /// The limit (bytes); none if nothing limits this process.
    pub limit: Option<u64>,
}

/// What a spinning loop saw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GapProbe {
    /// Longest time between two readings of the clock (ns).
    pub largest_ns: u64,
    /// Gaps longer than 20 us.
    pub long_gaps: u64,
    /// Whether it ran with real-time priority.
    pub was_fifo: bool,
    /// How often another thread took the CPU away.
    pub preemptions: u64,
    /// How many system management interrupts came meanwhile, if they are counted.
    pub smi: Option<u32>,
}
