//! The calling thread's scheduling policy: set it, and read back what the kernel made of it.

use nix::Result;
use nix::errno::Errno;

/// A policy of sched(7) with its static priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Policy {
    /// `SCHED_OTHER`, `SCHED_FIFO`, ..., without the reset-on-fork flag.
    pub(crate) policy: i32,
    /// 0 for the policies without static priority.
    pub(crate) priority: i32,
}

/// Makes the calling thread `SCHED_FIFO`; threads and processes that it starts are not.
///
/// A thread that inherited the priority would preempt the very loop that started it, hence
/// `SCHED_RESET_ON_FORK`.
pub(crate) fn set_fifo(priority: u8) -> Result<()> {
    let param = libc::sched_param { sched_priority: i32::from(priority) };
    // SAFETY: `param` outlives the call, which only reads it; 0 names the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &param) };
    Errno::result(result).map(drop)
}

/// The policy that the kernel applies to the calling thread now.
pub(crate) fn current_policy() -> Result<Policy> {
    // SAFETY: takes no pointer; 0 names the calling thread.
    let policy = Errno::result(unsafe { libc::sched_getscheduler(0) })?;
    let mut param = libc::sched_param { sched_priority: 0 };
    // SAFETY: `param` is exclusively ours and large enough for the kernel's answer.
    Errno::result(unsafe { libc::sched_getparam(0, &mut param) })?;
    Ok(Policy { policy: policy & !libc::SCHED_RESET_ON_FORK, priority: param.sched_priority })
}
