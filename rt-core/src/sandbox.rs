//! Shuts out all system calls but those that the owner lists.
//!
//! Problem: whoever takes over a process that talks to strangers can do with it all that the kernel lets it do.
//! A loop that is set up needs a few dozen calls out of several hundred.
//! Model: a list of [`AllowedCall`]s, each with its reason, becomes a seccomp filter for all threads. Every
//! other call raises SIGSYS before the kernel looks at it, so that the fatal handlers of
//! [`epitaph`](crate::epitaph) run: last act, last words with the call's name, death. Whether the filter is in
//! force is read back from the kernel for every thread.
//!
//!
//! SIGSYS cannot be caught while it is blocked: the kernel then kills at once, without last act. The C library
//! blocks all signals while it starts a thread or a process. The calls that do that are therefore *refused*, by an
//! error, instead of being fatal.
//!
//! Invariants: for good. A call made in another architecture's way (`int 0x80`, x32) is as forbidden as one
//! that is not listed. Nothing is installed if the list cannot be compiled.
//! Cost: a call without conditions is let through by a table in the kernel (5.11 or newer), one with conditions
//! by the filter; both are measured in `tests/sandbox_cost.rs`. Speculation is left as it is.

use crate::privileges::{ThreadFiles, ThreadStatus};
use crate::setup::Guarantee;
use crate::sys::seccomp::{NotInstalled, install};
use nix::errno::Errno;
use nix::sys::prctl::set_no_new_privs;
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    TargetArch, sock_filter,
};
use std::collections::BTreeMap;
use std::io;

/// A system call that is let through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllowedCall {
    /// Its name.
    pub name: &'static str,
    /// `libc::SYS_...`.
    pub number: libc::c_long,
    /// With which arguments.
    pub only: Only,
    /// What needs it.
    pub reason: &'static str,
}

/// A system call that fails with EPERM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefusedCall {
    /// Its name.
    pub name: &'static str,
    /// `libc::SYS_...`.
    pub number: libc::c_long,
}

/// Which arguments of a call are let through. Arguments count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// All.
    Any,
    /// Those in which this argument, 32 bits wide, is one of these.
    OneOf(u8, &'static [u32]),
    /// Those in which none of these bits is set in this argument.
    Without(u8, u32),
    /// Those in which this argument is the id of the calling process.
    OwnProcess(u8),
}

/// Lets nothing but `calls` through from now on, in every thread; all others are fatal, or `refused`.
pub fn shut(calls: &[AllowedCall], refused: &[RefusedCall]) -> Guarantee {
    let installed = compile(calls, refused).and_then(|program| {
        // Opened first: reading is allowed then, opening probably not.
        let files = ThreadFiles::open().map_err(|error| Failure::Unreadable(error.to_string()))?;
        // The kernel demands it of whoever has no rights; if it fails, so does what follows.
        let _ = set_no_new_privs();
        install(&program).map_err(Failure::NotInstalled)?;
        Ok(files)
    });
    match installed {
        Ok(files) => judge(calls.len(), files.read()),
        Err(failure) => missing(calls.len(), &failure),
    }
}

/// Why there is no filter.
enum Failure {
    /// No such filter can be made, here.
    Uncompilable(String),
    NotInstalled(NotInstalled),
    /// Nobody would know.
    Unreadable(String),
}

fn wanted(count: usize) -> String {
    format!("{count} and no others, in every thread")
}

fn judge(count: usize, threads: io::Result<Vec<ThreadStatus>>) -> Guarantee {
    const MODE_FILTER: u64 = 2;
    let (found, remedy) = match threads {
        Err(error) => (format!("unreadable ({error})"), Some("mount /proc, where the kernel tells")),
        Ok(threads) => match threads.iter().find(|thread| thread.seccomp != MODE_FILTER) {
            Some(thread) => (
                format!("no filter in thread {}", thread.name),
                Some("the kernel accepted but did not apply it"),
            ),
            None => (format!("{count} allowed, all others are fatal or refused"), None),
        },
    };
    Guarantee::asked("system calls", wanted(count), found, remedy.map(str::to_owned))
}

fn missing(count: usize, failure: &Failure) -> Guarantee {
    let (found, remedy) = match failure {
        Failure::Uncompilable(why) => (format!("no filter ({why})"), "use x86_64 or aarch64".to_owned()),
        Failure::Unreadable(why) => {
            (format!("no filter (/proc is unreadable: {why})"), "mount /proc".to_owned())
        }
        Failure::NotInstalled(NotInstalled::Refused(Errno::EINVAL | Errno::ENOSYS)) => (
            "no filter (this kernel has none)".to_owned(),
            "use a kernel with CONFIG_SECCOMP_FILTER, 4.17 or newer".to_owned(),
        ),
        Failure::NotInstalled(NotInstalled::Refused(errno)) => (
            format!("no filter ({errno})"),
            "look for a sandbox round this process that forbids its own".to_owned(),
        ),
        Failure::NotInstalled(NotInstalled::Thread(tid)) => (
            "no filter".to_owned(),
            format!("thread {tid} was started with a filter of its own; start it without"),
        ),
    };
    Guarantee::asked("system calls", wanted(count), found, Some(remedy))
}

fn compile(calls: &[AllowedCall], refused: &[RefusedCall]) -> Result<BpfProgram, Failure> {
    let impossible = |error: seccompiler::BackendError| Failure::Uncompilable(error.to_string());
    let architecture = TargetArch::try_from(std::env::consts::ARCH).map_err(impossible)?;
    let mut rules = BTreeMap::new();
    for call in calls {
        if rules.insert(i64_of(call.number), rules_of(call.only).map_err(impossible)?).is_some() {
            return Err(Failure::Uncompilable(format!("{} is listed twice", call.name)));
        }
    }
    let filter = SeccompFilter::new(rules, SeccompAction::Trap, SeccompAction::Allow, architecture);
    let mut program: BpfProgram = filter.and_then(TryInto::try_into).map_err(impossible)?;
    // The library kills outright for another architecture, which leaves no time for a last act.
    for instruction in &mut program {
        if instruction.k == libc::SECCOMP_RET_KILL_PROCESS {
            instruction.k = libc::SECCOMP_RET_TRAP;
        }
    }
    program.splice(ARCHITECTURE_CHECK..ARCHITECTURE_CHECK, refusals(refused));
    Ok(program)
}

/// Instructions at the beginning that look at the architecture and have returned if it is another one.
const ARCHITECTURE_CHECK: usize = 3;

/// What the library cannot express: a second verdict, by two instructions for each call. All jumps of the
/// program are relative, so that it may stand before the rest.
fn refusals(refused: &[RefusedCall]) -> Vec<sock_filter> {
    const LOAD_WORD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const IF_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    /// Where `struct seccomp_data` has the number of the call.
    const NUMBER: u32 = 0;
    let instruction = |code, if_not: u8, k| sock_filter { code, jt: 0, jf: if_not, k };
    let mut program = vec![instruction(LOAD_WORD, 0, NUMBER)];
    for call in refused {
        program.push(instruction(IF_EQUAL, 1, call.number as u32));
        program.push(instruction(RETURN, 0, libc::SECCOMP_RET_ERRNO | libc::EPERM as u32));
    }
    program
}

#[allow(clippy::useless_conversion, clippy::allow_attributes, reason = "narrower on 32-bit machines")]
fn i64_of(number: libc::c_long) -> i64 {
    number.into()
}

/// One of these must hold; none: every argument will do.
fn rules_of(only: Only) -> Result<Vec<SeccompRule>, seccompiler::BackendError> {
    let rule = |argument: u8, operator: SeccompCmpOp, value: u32| {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, operator, value.into())?;
        SeccompRule::new(vec![condition])
    };
    match only {
        Only::Any => Ok(Vec::new()),
        Only::OneOf(argument, values) => {
            values.iter().map(|value| rule(argument, SeccompCmpOp::Eq, *value)).collect()
        }
        Only::Without(argument, bits) => Ok(vec![rule(argument, SeccompCmpOp::MaskedEq(bits.into()), 0)?]),
        Only::OwnProcess(argument) => Ok(vec![rule(argument, SeccompCmpOp::Eq, std::process::id())?]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thread(seccomp: u64) -> ThreadStatus {
        ThreadStatus { name: "loop".into(), seccomp, ..ThreadStatus::default() }
    }

    #[test]
    fn a_filter_counts_when_every_thread_has_it() {
        assert!(judge(3, Ok(vec![thread(2), thread(2)])).obtained);
        let one_without = judge(3, Ok(vec![thread(2), thread(0)]));
        assert_eq!((one_without.obtained, one_without.found.as_str()), (false, "no filter in thread loop"));
        assert!(!judge(3, Err(io::ErrorKind::NotFound.into())).obtained);
    }

    #[test]
    fn a_kernel_without_filters_is_told() {
        let old = missing(3, &Failure::NotInstalled(NotInstalled::Refused(Errno::EINVAL)));
        assert!(!old.obtained && old.remedy.unwrap().contains("CONFIG_SECCOMP_FILTER"));
        let thread = missing(3, &Failure::NotInstalled(NotInstalled::Thread(7)));
        assert!(thread.remedy.unwrap().starts_with("thread 7 "));
    }

    #[test]
    fn a_call_that_is_listed_twice_is_no_filter() {
        let call = AllowedCall { name: "close", number: libc::SYS_close, only: Only::Any, reason: "" };
        assert!(
            matches!(compile(&[call, call], &[]), Err(Failure::Uncompilable(why)) if why == "close is listed twice")
        );
    }

    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    #[test]
    fn nothing_is_killed_without_its_last_act() {
        let call = AllowedCall { name: "close", number: libc::SYS_close, only: Only::Any, reason: "" };
        let program = compile(&[call], &[]).unwrap_or_default();
        assert!(!program.is_empty());
        assert!(program.iter().all(|instruction| instruction.k != libc::SECCOMP_RET_KILL_PROCESS));
    }
}
