//! Every system call that the running driver may make, and what needs it.
//!
//! What is not here ends the process (SIGSYS, zero torque, last words) or is refused. In particular: no file
//! is opened, no program or thread started, no socket made, no device asked anything (`ioctl`), no memory made
//! executable, no signal sent to others, no right changed.
//!
//! The loop's own calls have no conditions, so that the kernel lets them through without running the filter;
//! therefore their order does not matter. `tests/tests/privilege/full_life.rs` lives through everything that
//! a driver can live through under this list, and shows which entries that takes.

use rt_core::sandbox::Only::{self, Any, OneOf, OwnProcess, Without};
use rt_core::sandbox::{AllowedCall, RefusedCall};

/// The list.
pub const ALLOWED_CALLS: &[AllowedCall] = &[
    // The loop.
    call("clock_nanosleep", libc::SYS_clock_nanosleep, Any, "the loop's timed wait; every pause elsewhere"),
    call(
        "futex",
        libc::SYS_futex,
        Any,
        "waking the commander, in lockstep sleeping for its reply; locks, joining the loop's thread",
    ),
    call("read", libc::SYS_read, OneOf(2, &[8]), "the loop has asked to wake the commander: eight bytes"),
    call(
        "clock_gettime",
        libc::SYS_clock_gettime,
        Any,
        "the clock where the vDSO cannot read it (clocksource not tsc)",
    ),
    call("sched_yield", libc::SYS_sched_yield, Any, "the standard library's channels and locks, contended"),
    call(
        "restart_syscall",
        libc::SYS_restart_syscall,
        Any,
        "the kernel's own: a wait goes on after stop and continue",
    ),
    // The socket.
    call("ppoll", libc::SYS_ppoll, Any, "the service's wait for clients"),
    call("accept4", libc::SYS_accept4, Any, "a client comes"),
    call("getsockopt", libc::SYS_getsockopt, Any, "who it is: process, user, groups"),
    call("pidfd_open", libc::SYS_pidfd_open, Any, "whether the commander's process lives, before Linux 6.5"),
    call("recvfrom", libc::SYS_recvfrom, Any, "its request"),
    call("recvmsg", libc::SYS_recvmsg, Any, "an emergency stop by datagram, and who sent it"),
    call("sendmsg", libc::SYS_sendmsg, Any, "the answer, with the segments' descriptors"),
    call("close", libc::SYS_close, Any, "it is gone; segments and device files at the end"),
    // A fresh segment for each lease.
    call("memfd_create", libc::SYS_memfd_create, Any, "the segment"),
    call("fallocate", libc::SYS_fallocate, Any, "its pages, before they are needed"),
    call("pipe2", libc::SYS_pipe2, Any, "a pipe, so that its page is not merged"),
    call("splice", libc::SYS_splice, Any, "the page into the pipe"),
    call("fcntl", libc::SYS_fcntl, OneOf(1, FCNTL), "sealing it; a second descriptor while it is mapped"),
    call("mmap", libc::SYS_mmap, Without(2, PROT_EXEC), "mapping it; large allocations"),
    call(
        "munmap",
        libc::SYS_munmap,
        Any,
        "unmapping it; large blocks freed; stack and signal stack of the loop's thread",
    ),
    // The heap.
    call("brk", libc::SYS_brk, Any, "the main thread's heap grows and shrinks"),
    call("mprotect", libc::SYS_mprotect, Without(2, PROT_EXEC), "the loop's thread's heap grows"),
    call("mremap", libc::SYS_mremap, Any, "a large allocation grows"),
    call("madvise", libc::SYS_madvise, Any, "heap given back; the stack of a thread that ends"),
    // Words.
    call("write", libc::SYS_write, Any, "the log, on standard error; the loop asks to wake the commander"),
    call("writev", libc::SYS_writev, Any, "the C library's own last message (heap corrupted, stack smashed)"),
    call(
        "pread64",
        libc::SYS_pread64,
        Any,
        "reads back whether this very filter is in force, from files opened before",
    ),
    // The end.
    call("statx", libc::SYS_statx, Any, "whether the socket's name is still ours before it is removed"),
    #[cfg(target_arch = "x86_64")]
    call("unlink", libc::SYS_unlink, Any, "removing the socket and its lock"),
    #[cfg(target_arch = "x86_64")]
    call("rmdir", libc::SYS_rmdir, Any, "removing the directory that a parent made for the socket"),
    #[cfg(not(target_arch = "x86_64"))]
    call("unlinkat", libc::SYS_unlinkat, Any, "both of these, where there are no calls for them alone"),
    call("exit", libc::SYS_exit, Any, "the loop's thread ends"),
    call("exit_group", libc::SYS_exit_group, Any, "the process ends"),
    // Signals and violent ends.
    call("rt_sigaction", libc::SYS_rt_sigaction, Any, "a fatal signal's handler steps aside; abort"),
    call(
        "rt_sigprocmask",
        libc::SYS_rt_sigprocmask,
        Any,
        "signals handed to the thread that stops; raise, abort, the end of a thread",
    ),
    call("rt_sigreturn", libc::SYS_rt_sigreturn, Any, "back from a handler"),
    call("sigaltstack", libc::SYS_sigaltstack, Any, "a thread that ends gives its signal stack back"),
    call("getpid", libc::SYS_getpid, Any, "our id in each answer to a client; raise, abort"),
    call("gettid", libc::SYS_gettid, Any, "raise, abort; the standard library's message of a stack overflow"),
    call("tgkill", libc::SYS_tgkill, OwnProcess(0), "raise, abort: only ever at itself"),
];

/// They start threads and processes. The C library makes them with all signals blocked, when SIGSYS would kill
/// without a last act; so they fail, and whoever wanted a thread ends in the ordinary way of an error or a panic.
pub const REFUSED_CALLS: &[RefusedCall] = &[
    RefusedCall { name: "clone", number: libc::SYS_clone },
    RefusedCall { name: "clone3", number: libc::SYS_clone3 },
    #[cfg(target_arch = "x86_64")]
    RefusedCall { name: "fork", number: libc::SYS_fork },
    #[cfg(target_arch = "x86_64")]
    RefusedCall { name: "vfork", number: libc::SYS_vfork },
];

const fn call(name: &'static str, number: libc::c_long, only: Only, reason: &'static str) -> AllowedCall {
    AllowedCall { name, number, only, reason }
}

const PROT_EXEC: u32 = libc::PROT_EXEC as u32;
/// The last one is the standard library's check of a descriptor before it is closed, in debug builds.
const FCNTL: &[u32] = &[libc::F_ADD_SEALS as u32, libc::F_DUPFD_CLOEXEC as u32, libc::F_GETFD as u32];
