//! Names of system calls, for the last words of a process that made a forbidden one.
//!
//! Not all of the kernel's hundreds: those that an intruder or a mistake is likely to try. The others keep
//! their number, which `ausyscall` or a kernel header turns into a name.

use std::fmt;

/// A call that the filter did not let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ForbiddenCall {
    /// Its number.
    pub(crate) number: i32,
    /// `AUDIT_ARCH_*` of the way in which it was made.
    pub(crate) architecture: u32,
}

impl fmt::Display for ForbiddenCall {
    /// Async-signal-safe: only copies text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.number)?;
        if self.architecture != NATIVE {
            return f.write_str(" of another architecture");
        }
        name_of(self.number).map_or(Ok(()), |name| write!(f, " ({name})"))
    }
}

/// linux/audit.h: ELF machine, 64 bits, little end first.
#[cfg(target_arch = "x86_64")]
const NATIVE: u32 = 0xc000_003e;
#[cfg(target_arch = "aarch64")]
const NATIVE: u32 = 0xc000_00b7;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const NATIVE: u32 = 0;

fn name_of(number: i32) -> Option<&'static str> {
    let number = libc::c_long::from(number);
    NAMES.iter().chain(OLD_NAMES).find(|(known, _)| *known == number).map(|(_, name)| *name)
}

type Name = (libc::c_long, &'static str);

const NAMES: &[Name] = &[
    (libc::SYS_accept, "accept"),
    (libc::SYS_bind, "bind"),
    (libc::SYS_bpf, "bpf"),
    (libc::SYS_capset, "capset"),
    (libc::SYS_chdir, "chdir"),
    (libc::SYS_chroot, "chroot"),
    (libc::SYS_clone, "clone"),
    (libc::SYS_clone3, "clone3"),
    (libc::SYS_connect, "connect"),
    (libc::SYS_dup, "dup"),
    (libc::SYS_dup3, "dup3"),
    (libc::SYS_epoll_create1, "epoll_create1"),
    (libc::SYS_execve, "execve"),
    (libc::SYS_execveat, "execveat"),
    (libc::SYS_fchmod, "fchmod"),
    (libc::SYS_fchmodat, "fchmodat"),
    (libc::SYS_fchown, "fchown"),
    (libc::SYS_fcntl, "fcntl"),
    (libc::SYS_finit_module, "finit_module"),
    (libc::SYS_fstat, "fstat"),
    (libc::SYS_ftruncate, "ftruncate"),
    (libc::SYS_getcwd, "getcwd"),
    (libc::SYS_getdents64, "getdents64"),
    (libc::SYS_getrandom, "getrandom"),
    (libc::SYS_init_module, "init_module"),
    (libc::SYS_io_uring_setup, "io_uring_setup"),
    (libc::SYS_ioctl, "ioctl"),
    (libc::SYS_kexec_load, "kexec_load"),
    (libc::SYS_kill, "kill"),
    (libc::SYS_lseek, "lseek"),
    (libc::SYS_madvise, "madvise"),
    (libc::SYS_mkdirat, "mkdirat"),
    (libc::SYS_mlockall, "mlockall"),
    (libc::SYS_mmap, "mmap"),
    (libc::SYS_mount, "mount"),
    (libc::SYS_mprotect, "mprotect"),
    (libc::SYS_nanosleep, "nanosleep"),
    (libc::SYS_newfstatat, "newfstatat"),
    (libc::SYS_openat, "openat"),
    (libc::SYS_openat2, "openat2"),
    (libc::SYS_perf_event_open, "perf_event_open"),
    (libc::SYS_personality, "personality"),
    (libc::SYS_pipe2, "pipe2"),
    (libc::SYS_pkey_mprotect, "pkey_mprotect"),
    (libc::SYS_prctl, "prctl"),
    (libc::SYS_prlimit64, "prlimit64"),
    (libc::SYS_process_vm_readv, "process_vm_readv"),
    (libc::SYS_process_vm_writev, "process_vm_writev"),
    (libc::SYS_ptrace, "ptrace"),
    (libc::SYS_read, "read"),
    (libc::SYS_readlinkat, "readlinkat"),
    (libc::SYS_reboot, "reboot"),
    (libc::SYS_recvmsg, "recvmsg"),
    (libc::SYS_renameat2, "renameat2"),
    (libc::SYS_sched_getaffinity, "sched_getaffinity"),
    (libc::SYS_sched_setscheduler, "sched_setscheduler"),
    (libc::SYS_seccomp, "seccomp"),
    (libc::SYS_sendto, "sendto"),
    (libc::SYS_setgid, "setgid"),
    (libc::SYS_setgroups, "setgroups"),
    (libc::SYS_setns, "setns"),
    (libc::SYS_setresgid, "setresgid"),
    (libc::SYS_setresuid, "setresuid"),
    (libc::SYS_setsockopt, "setsockopt"),
    (libc::SYS_setuid, "setuid"),
    (libc::SYS_socket, "socket"),
    (libc::SYS_socketpair, "socketpair"),
    (libc::SYS_tgkill, "tgkill"),
    (libc::SYS_tkill, "tkill"),
    (libc::SYS_umount2, "umount2"),
    (libc::SYS_unshare, "unshare"),
    (libc::SYS_userfaultfd, "userfaultfd"),
];

/// Calls that newer architectures do without.
#[cfg(target_arch = "x86_64")]
const OLD_NAMES: &[Name] = &[
    (libc::SYS_arch_prctl, "arch_prctl"),
    (libc::SYS_chmod, "chmod"),
    (libc::SYS_fork, "fork"),
    (libc::SYS_ioperm, "ioperm"),
    (libc::SYS_iopl, "iopl"),
    (libc::SYS_lstat, "lstat"),
    (libc::SYS_open, "open"),
    (libc::SYS_poll, "poll"),
    (libc::SYS_readlink, "readlink"),
    (libc::SYS_rename, "rename"),
    (libc::SYS_stat, "stat"),
    (libc::SYS_vfork, "vfork"),
];
#[cfg(not(target_arch = "x86_64"))]
const OLD_NAMES: &[Name] = &[];

#[cfg(test)]
mod tests {
    use super::*;

    fn text(number: libc::c_long, architecture: u32) -> String {
        ForbiddenCall { number: number as i32, architecture }.to_string()
    }

    #[test]
    fn a_call_is_named_where_the_name_is_known() {
        assert_eq!(text(libc::SYS_socket, NATIVE), format!("{} (socket)", libc::SYS_socket));
        assert_eq!(text(9999, NATIVE), "9999");
        assert_eq!(
            text(libc::SYS_socket, NATIVE ^ 1),
            format!("{} of another architecture", libc::SYS_socket)
        );
    }
}
