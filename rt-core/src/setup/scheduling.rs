//! Makes the loop's thread `SCHED_FIFO` and reads back whether it is.

use super::limits::raise_soft_limit;
use super::report::Guarantee;
use crate::sys::sched::{Policy, current_policy, set_fifo};
use nix::Result;
use nix::errno::Errno;
use nix::sys::resource::Resource;
use std::fmt;

/// Promotes the calling thread.
pub(super) fn make_fifo(priority: u8) -> Guarantee {
    let Promotion { asked, found, rtprio_limit } = promote(priority);
    judge_fifo(priority, asked, found, rtprio_limit)
}

/// What came of asking for `SCHED_FIFO`.
pub(crate) struct Promotion {
    /// What the kernel answered.
    pub(crate) asked: Result<()>,
    /// The policy in force afterwards.
    pub(crate) found: Result<Policy>,
    /// The limit in force.
    pub(crate) rtprio_limit: u64,
}

/// Asks, and reads back.
pub(crate) fn promote(priority: u8) -> Promotion {
    let rtprio_limit = raise_soft_limit(Resource::RLIMIT_RTPRIO);
    let asked = set_fifo(priority);
    Promotion { asked, found: current_policy(), rtprio_limit }
}

/// Promotes a thread beside a loop that sleeps nearly always, and must not be starved by others when it is needed.
pub fn promote_beside(name: &'static str, priority: u8) -> Guarantee {
    Guarantee { name, ..make_fifo(priority) }
}

pub(crate) fn judge_fifo(
    priority: u8,
    asked: Result<()>,
    found: Result<Policy>,
    rtprio_limit: u64,
) -> Guarantee {
    let wanted = Policy { policy: libc::SCHED_FIFO, priority: i32::from(priority) };
    let remedy = (found != Ok(wanted)).then(|| remedy(priority, asked, rtprio_limit));
    let found = found.map_or_else(|error| format!("unreadable ({error})"), |policy| policy.to_string());
    Guarantee::asked("scheduling", wanted.to_string(), found, remedy)
}

fn remedy(priority: u8, asked: Result<()>, rtprio_limit: u64) -> String {
    match asked {
        Err(Errno::EINVAL) => "choose a priority from 1 to 99".to_owned(),
        Err(Errno::EPERM) if rtprio_limit < u64::from(priority) => format!(
            "raise RLIMIT_RTPRIO from {rtprio_limit} to {priority} or more (rtprio in \
             /etc/security/limits.d, LimitRTPRIO= in a systemd unit), or give the program the capability: \
             setcap cap_sys_nice=ep"
        ),
        Err(Errno::EPERM) => "the process's cgroup grants no real-time time: raise its cpu.rt_runtime_us, \
             or leave that cgroup"
            .to_owned(),
        Err(error) => format!("the kernel refused: {error}"),
        Ok(()) => "the kernel accepted but did not apply it: look for a sandbox or a daemon that \
             changes policies"
            .to_owned(),
    }
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.policy {
            libc::SCHED_OTHER => "SCHED_OTHER",
            libc::SCHED_FIFO => "SCHED_FIFO",
            libc::SCHED_RR => "SCHED_RR",
            libc::SCHED_BATCH => "SCHED_BATCH",
            libc::SCHED_IDLE => "SCHED_IDLE",
            libc::SCHED_DEADLINE => "SCHED_DEADLINE",
            other => return write!(f, "policy {other} with priority {}", self.priority),
        };
        f.write_str(name)?;
        if self.priority > 0 { write!(f, " {}", self.priority) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OTHER: Policy = Policy { policy: libc::SCHED_OTHER, priority: 0 };
    const FIFO_80: Policy = Policy { policy: libc::SCHED_FIFO, priority: 80 };

    #[test]
    fn a_promotion_counts_when_the_kernel_confirms_it() {
        let promoted = judge_fifo(80, Ok(()), Ok(FIFO_80), 99);
        assert_eq!(promoted.to_string(), "  obtained  scheduling: SCHED_FIFO 80");
    }

    #[test]
    fn a_promotion_that_silently_did_nothing_is_missing() {
        let silent = judge_fifo(80, Ok(()), Ok(OTHER), 99);
        assert_eq!((silent.obtained, silent.found.as_str()), (false, "SCHED_OTHER"));
        assert!(silent.remedy.unwrap().contains("did not apply"));
        assert!(!judge_fifo(70, Ok(()), Ok(FIFO_80), 99).obtained, "another priority is not the one wanted");
    }

    /// A thread that was promoted from outside has what it wants, though it may not ask for it.
    #[test]
    fn what_is_in_force_counts_more_than_the_refusal() {
        assert!(judge_fifo(80, Err(Errno::EPERM), Ok(FIFO_80), 0).obtained);
    }

    #[test]
    fn a_refusal_names_the_limit_that_caused_it() {
        let remedy_of = |error, limit| judge_fifo(80, Err(error), Ok(OTHER), limit).remedy.unwrap();
        assert!(remedy_of(Errno::EPERM, 20).contains("RLIMIT_RTPRIO from 20 to 80"));
        assert!(remedy_of(Errno::EPERM, 99).contains("cgroup"), "the limit would allow it");
        assert!(remedy_of(Errno::EINVAL, 99).contains("1 to 99"));
    }

    #[test]
    fn policies_read_as_in_the_manual() {
        assert_eq!(OTHER.to_string(), "SCHED_OTHER");
        assert_eq!(Policy { policy: 42, priority: 1 }.to_string(), "policy 42 with priority 1");
    }
}
