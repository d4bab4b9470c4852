//! Putting a system call filter into force.

use nix::Result;
use nix::errno::Errno;
use seccompiler::sock_filter;

/// Why the kernel did not take a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NotInstalled {
    /// It said so.
    Refused(Errno),
    /// This thread has a filter of its own that the others lack.
    Thread(i64),
}

/// Puts `program` into force for every thread of the process, for good. The kernel demands that the calling
/// thread can gain no new privileges.
///
/// `SPEC_ALLOW`: kernels before 5.16 would else switch off speculation past stores for the whole loop, which
/// costs per cent; the driver runs no foreign code that could exploit it.
pub(crate) fn install(program: &[sock_filter]) -> std::result::Result<(), NotInstalled> {
    let flags = libc::SECCOMP_FILTER_FLAG_TSYNC | libc::SECCOMP_FILTER_FLAG_SPEC_ALLOW;
    let len = u16::try_from(program.len()).map_err(|_| NotInstalled::Refused(Errno::EINVAL))?;
    let program = Program { len, filter: program.as_ptr() };
    let result = seccomp(libc::SECCOMP_SET_MODE_FILTER, flags, &program).map_err(NotInstalled::Refused)?;
    if result == 0 { Ok(()) } else { Err(NotInstalled::Thread(result)) }
}

/// `struct sock_fprog` of linux/filter.h.
#[repr(C)]
struct Program {
    len: u16,
    filter: *const sock_filter,
}

fn seccomp(operation: libc::c_uint, flags: libc::c_ulong, program: &Program) -> Result<i64> {
    // SAFETY: the kernel copies the program, which outlives the call and is as long as it says.
    Errno::result(unsafe { libc::syscall(libc::SYS_seccomp, operation, flags, &raw const *program) })
}
