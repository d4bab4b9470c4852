//! The driver's sandbox, call by call: what is not listed is fatal, what is listed is fatal with other arguments.
//!
//! Each call is made by a process of its own, in which nothing but the sandbox is in force.

use io_driver::config::ProcessConfig;
use io_driver::sandbox;
use io_driver::sandbox::allowed_calls::ALLOWED_CALLS;
use rt_core::sandbox::Only;
use system_tests::faults::process::{Running, myself, role};

const TEST: &str = "table::every_forbidden_call_is_fatal";

/// A call and its arguments. None of them would do harm if it were let through: the arguments are nonsense.
type Call = (&'static str, libc::c_long, [u64; 6]);

const BAD: u64 = u64::MAX;
const NO_ADDRESS: u64 = 0;

const fn call(name: &'static str, number: libc::c_long) -> Call {
    (name, number, [BAD; 6])
}

const FORBIDDEN: &[Call] = &[
    call("execve", libc::SYS_execve),
    call("execveat", libc::SYS_execveat),
    ("socket (AF_INET)", libc::SYS_socket, [libc::AF_INET as u64, libc::SOCK_DGRAM as u64, 0, 0, 0, 0]),
    ("socket (AF_UNIX)", libc::SYS_socket, [libc::AF_UNIX as u64, libc::SOCK_STREAM as u64, 0, 0, 0, 0]),
    ("socket (AF_NETLINK)", libc::SYS_socket, [libc::AF_NETLINK as u64, libc::SOCK_RAW as u64, 0, 0, 0, 0]),
    call("socketpair", libc::SYS_socketpair),
    call("connect", libc::SYS_connect),
    call("bind", libc::SYS_bind),
    call("openat", libc::SYS_openat),
    call("openat2", libc::SYS_openat2),
    call("open_by_handle_at", libc::SYS_open_by_handle_at),
    call("ptrace", libc::SYS_ptrace),
    call("process_vm_readv", libc::SYS_process_vm_readv),
    call("process_vm_writev", libc::SYS_process_vm_writev),
    call("pidfd_getfd", libc::SYS_pidfd_getfd),
    call("pidfd_send_signal", libc::SYS_pidfd_send_signal),
    call("mount", libc::SYS_mount),
    call("umount2", libc::SYS_umount2),
    call("chroot", libc::SYS_chroot),
    call("bpf", libc::SYS_bpf),
    call("kexec_load", libc::SYS_kexec_load),
    call("init_module", libc::SYS_init_module),
    call("finit_module", libc::SYS_finit_module),
    call("reboot", libc::SYS_reboot),
    call("setuid", libc::SYS_setuid),
    call("setresuid", libc::SYS_setresuid),
    call("setgroups", libc::SYS_setgroups),
    call("capset", libc::SYS_capset),
    call("prctl", libc::SYS_prctl),
    call("seccomp", libc::SYS_seccomp),
    call("unshare", libc::SYS_unshare),
    call("setns", libc::SYS_setns),
    call("ioctl", libc::SYS_ioctl),
    call("perf_event_open", libc::SYS_perf_event_open),
    call("userfaultfd", libc::SYS_userfaultfd),
    call("io_uring_setup", libc::SYS_io_uring_setup),
    call("keyctl", libc::SYS_keyctl),
    call("sched_setscheduler", libc::SYS_sched_setscheduler),
    call("sched_setaffinity", libc::SYS_sched_setaffinity),
    call("munlockall", libc::SYS_munlockall),
    call("prlimit64", libc::SYS_prlimit64),
    call("read", libc::SYS_read),
    call("ftruncate", libc::SYS_ftruncate),
    call("renameat2", libc::SYS_renameat2),
    call("linkat", libc::SYS_linkat),
    call("fchmod", libc::SYS_fchmod),
    call("kill", libc::SYS_kill),
    call("tkill", libc::SYS_tkill),
    call("pkey_mprotect", libc::SYS_pkey_mprotect),
    ("tgkill (another process)", libc::SYS_tgkill, [1, 1, 0, 0, 0, 0]),
    ("fcntl (F_SETFL)", libc::SYS_fcntl, [2, libc::F_SETFL as u64, 0, 0, 0, 0]),
    ("fcntl (F_SETOWN)", libc::SYS_fcntl, [2, libc::F_SETOWN as u64, 0, 0, 0, 0]),
    ("mmap (PROT_EXEC)", libc::SYS_mmap, mmap(libc::PROT_READ | libc::PROT_EXEC)),
    ("mmap (PROT_EXEC and PROT_WRITE)", libc::SYS_mmap, mmap(libc::PROT_WRITE | libc::PROT_EXEC)),
    ("mprotect (PROT_EXEC)", libc::SYS_mprotect, [NO_ADDRESS, 0, libc::PROT_EXEC as u64, 0, 0, 0]),
    // Beyond the numbers of today, and those of the x32 way.
    call("no call", 100_000),
    call("clock_nanosleep of x32", X32 | libc::SYS_clock_nanosleep),
    call("number -1", -1),
];

const X32: libc::c_long = 0x4000_0000;

const fn mmap(protection: libc::c_int) -> [u64; 6] {
    [0, 4096, protection as u64, (libc::MAP_PRIVATE | libc::MAP_ANONYMOUS) as u64, BAD, 0]
}

/// The control: allowed calls of which some are refused with other arguments above.
const ALLOWED: &[Call] = &[
    ("mmap", libc::SYS_mmap, mmap(libc::PROT_READ | libc::PROT_WRITE)),
    ("mprotect", libc::SYS_mprotect, [NO_ADDRESS, 0, libc::PROT_READ as u64, 0, 0, 0]),
    ("fcntl (F_ADD_SEALS)", libc::SYS_fcntl, [BAD, libc::F_ADD_SEALS as u64, 0, 0, 0, 0]),
    ("close", libc::SYS_close, [BAD; 6]),
    ("sched_yield", libc::SYS_sched_yield, [0; 6]),
];

/// They start processes, which would live on beside their maker.
const REFUSED: &[Call] = &[
    ("clone", libc::SYS_clone, [libc::SIGCHLD as u64, 0, 0, 0, 0, 0]),
    ("clone3", libc::SYS_clone3, [BAD; 6]),
    #[cfg(target_arch = "x86_64")]
    ("fork", libc::SYS_fork, [0; 6]),
    #[cfg(target_arch = "x86_64")]
    ("vfork", libc::SYS_vfork, [0; 6]),
];

const SURVIVED: i32 = 42;
const NO_SANDBOX: i32 = 43;

#[test]
fn every_forbidden_call_is_fatal() {
    if let Some(role) = role() {
        play(&role);
    }
    for (table, calls) in [("forbidden", FORBIDDEN), ("refused", REFUSED), ("allowed", ALLOWED)] {
        for (index, (name, ..)) in calls.iter().enumerate() {
            let end = Running::start(&mut myself(TEST, &format!("{table} {index}"))).end();
            assert_ne!(end.status, Some(NO_SANDBOX), "{end:?}");
            let expected = match table {
                "forbidden" => (None, Some(libc::SIGSYS)),
                _ => (Some(SURVIVED), None),
            };
            assert_eq!((end.status, end.signal), expected, "{name}");
        }
    }
    #[cfg(target_arch = "x86_64")]
    {
        let end = Running::start(&mut myself(TEST, "32 bit")).end();
        assert_eq!((end.status, end.signal), (None, Some(libc::SIGSYS)), "int 0x80");
    }
}

fn play(role: &str) -> ! {
    let no_core_file = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the limit is ours and only read.
    unsafe { libc::setrlimit(libc::RLIMIT_CORE, &raw const no_core_file) };
    let guarantee = sandbox::shut(&ProcessConfig::default());
    if !guarantee.obtained {
        eprintln!("{guarantee}");
        std::process::exit(NO_SANDBOX);
    }
    let (table, index) = role.split_once(' ').expect("a table and an index");
    match table {
        "forbidden" => drop(make(&FORBIDDEN[number(index)])),
        "allowed" => drop(make(&ALLOWED[number(index)])),
        "refused" => {
            let error = make(&REFUSED[number(index)]).expect_err("refused");
            assert_eq!(error.raw_os_error(), Some(libc::EPERM));
        }
        _ => make_in_32_bit_way(),
    }
    std::process::exit(SURVIVED)
}

fn number(text: &str) -> usize {
    text.parse().expect("a number")
}

fn make((_, number, [a, b, c, d, e, f]): &Call) -> std::io::Result<()> {
    // SAFETY: either it is not let through, or its arguments name nothing that this process uses.
    let result = unsafe { libc::syscall(*number, *a, *b, *c, *d, *e, *f) };
    if result == -1 { Err(std::io::Error::last_os_error()) } else { Ok(()) }
}

/// `getpid` by its 32-bit number, which means `writev` in the 64-bit way: allowed there, forbidden here.
fn make_in_32_bit_way() {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: the call takes no arguments; registers that the kernel changes are named.
    unsafe {
        std::arch::asm!("int 0x80", inout("rax") 20_u64 => _, out("r8") _, out("r9") _, out("r10") _, out("r11") _);
    }
}

#[test]
fn every_allowed_call_has_a_reason_and_stands_once() {
    let mut numbers: Vec<_> = ALLOWED_CALLS.iter().map(|call| call.number).collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), ALLOWED_CALLS.len());
    assert!(ALLOWED_CALLS.iter().all(|call| call.reason.len() > 10));
    for forbidden in FORBIDDEN {
        let listed = ALLOWED_CALLS.iter().find(|call| call.number == forbidden.1);
        assert!(listed.is_none_or(|call| call.only != Only::Any), "{}", forbidden.0);
    }
}

/// The kernel lets a call without conditions through by a table, and runs the filter for all others.
#[test]
fn the_calls_of_the_loop_have_no_conditions() {
    for name in ["clock_nanosleep", "futex"] {
        let call = ALLOWED_CALLS.iter().find(|call| call.name == name).expect("listed");
        assert_eq!(call.only, Only::Any);
    }
}
