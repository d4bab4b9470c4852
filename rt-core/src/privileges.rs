//! Gives up, once the loop is set up, every right that it does not need any more.
//!
//! Problem: real-time rights come from root or from capabilities, and whoever finds a hole in the process
//! would have them too, for as long as it runs.
//! Model: capabilities belong to threads, so every thread gives up its own by [`reduce_thread`]: effective,
//! permitted, inheritable and ambient set, the bounding set as far as that is allowed, and the possibility of
//! new ones (`no_new_privs`). A process that root started becomes an ordinary [`User`] in between. What was
//! obtained with them stays: policy, locked pages, open files. [`judge`] then reads every thread's rights from
//! the kernel.
//!
//! Locked memory needs care: with `MCL_FUTURE` every later mapping counts against `RLIMIT_MEMLOCK` once
//! CAP_IPC_LOCK is gone, and an allocation beyond it fails, which aborts. [`keep_memory_locked`] comes first.
//! Invariants: never fails and never panics but for the user, which is asked for by name and therefore must
//! work. `found` comes from `/proc`, never from a return code.

mod thread_status;
mod user;

pub(crate) use thread_status::{ThreadFiles, ThreadStatus};
pub use user::{User, UserError, group_id};

use crate::setup::Guarantee;
use crate::sys::capability::{self, CAP_SETGID, CAP_SETUID};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::prctl::set_no_new_privs;
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit, setrlimit};
use std::io;

/// What a thread keeps for the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Nothing.
    Nothing,
    /// What it takes to become another user, who then has to give up this as well.
    ChangeOfUser,
}

/// Gives up the calling thread's capabilities and the possibility of new ones.
pub fn reduce_thread(keep: Keep) {
    // Whatever is refused here is found by `judge`. Without CAP_SETPCAP the bounding set stays; nothing can
    // be gained from it, since no program that this process starts gets new rights.
    let _ = (0..MAX_CAPABILITIES).try_for_each(capability::drop_from_bounding_set);
    let _ = capability::clear_ambient_set();
    let kept = match keep {
        Keep::Nothing => 0,
        Keep::ChangeOfUser => capability::permitted().unwrap_or(0) & (1 << CAP_SETUID | 1 << CAP_SETGID),
    };
    let _ = capability::keep_only(kept);
    let _ = set_no_new_privs();
}

/// As many as fit into the kernel's sets; it says where they end.
const MAX_CAPABILITIES: u32 = 64;

/// Sees to it that locked memory does not depend on a capability. Call it with all rights, when everything
/// that the loop touches is there; `None`: all is well.
///
/// Without a limit, later mappings are locked too. Under one that cannot be lifted, what is there stays locked
/// and what comes later is not: better than an allocation that fails.
#[must_use]
pub fn keep_memory_locked() -> Option<Guarantee> {
    let limit = || getrlimit(Resource::RLIMIT_MEMLOCK).map_or(0, |(soft, _)| soft);
    if locked_kib() == 0 || limit() == RLIM_INFINITY {
        return None;
    }
    // CAP_SYS_RESOURCE, which root has, allows this.
    let _ = setrlimit(Resource::RLIMIT_MEMLOCK, RLIM_INFINITY, RLIM_INFINITY);
    if limit() == RLIM_INFINITY {
        return None;
    }
    let asked = mlockall(MlockAllFlags::MCL_CURRENT);
    Some(judge_later_memory(limit(), asked))
}

fn judge_later_memory(limit: u64, asked: nix::Result<()>) -> Guarantee {
    let found = match asked {
        Ok(()) => "what is there now stays locked, what comes later is not".to_owned(),
        Err(error) => format!("the kernel refused to lock what is there now: {error}"),
    };
    let remedy = format!(
        "raise RLIMIT_MEMLOCK from {} KiB to unlimited (memlock in /etc/security/limits.d, \
         LimitMEMLOCK=infinity in a systemd unit), or add cap_sys_resource to the program's capabilities, \
         with which it raises the limit itself",
        limit / 1024
    );
    let wanted = "later mappings locked without a capability".to_owned();
    Guarantee::asked("later memory locked", wanted, found, Some(remedy))
}

fn locked_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
    line.and_then(|text| text.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Whether every thread of the process has given up its rights; `user` is whom it was to become.
#[must_use]
pub fn judge(user: Option<&User>) -> Guarantee {
    judge_threads(ThreadFiles::open().and_then(|files| files.read()), user)
}

fn judge_threads(threads: io::Result<Vec<ThreadStatus>>, user: Option<&User>) -> Guarantee {
    let wanted = match user {
        Some(user) => format!("no capability, no new ones, user {} with group {} alone", user.uid, user.gid),
        None => "no capability, no new ones".to_owned(),
    };
    let threads = match threads {
        Ok(threads) => threads,
        Err(error) => {
            let remedy = Some("mount /proc, where the kernel tells".to_owned());
            return Guarantee::asked("privileges", wanted, format!("unreadable ({error})"), remedy);
        }
    };
    match threads.iter().find_map(|thread| complaint(thread, user)) {
        Some(found) => {
            let remedy = "start it as an ordinary user with RLIMIT_RTPRIO and RLIMIT_MEMLOCK".to_owned();
            Guarantee::asked("privileges", wanted, found, Some(remedy))
        }
        None => Guarantee::asked("privileges", wanted, what_is_left(&threads), None),
    }
}

fn complaint(thread: &ThreadStatus, user: Option<&User>) -> Option<String> {
    let name = &thread.name;
    if thread.capabilities != 0 {
        return Some(format!("capabilities {:#x} in thread {name}", thread.capabilities));
    }
    if !thread.no_new_privileges {
        return Some(format!("thread {name} may get new ones"));
    }
    let user = user?;
    let is_user = thread.uids == [user.uid; 4] && thread.gids == [user.gid; 4];
    let is_alone = thread.groups.iter().all(|group| *group == user.gid);
    (!is_user || !is_alone).then(|| {
        format!("users {:?}, groups {:?} {:?} in thread {name}", thread.uids, thread.gids, thread.groups)
    })
}

/// Said without a complaint: a bounding set is worth nothing to a process that cannot gain by executing.
fn what_is_left(threads: &[ThreadStatus]) -> String {
    let uid = threads.first().and_then(|thread| thread.uids.get(1)).copied().unwrap_or(0);
    let bounding = threads.iter().fold(0, |all, thread| all | thread.bounding);
    let root = if uid == 0 { " (root, who still owns root's files)" } else { "" };
    let kept = if bounding == 0 { "" } else { ", bounding set kept for lack of CAP_SETPCAP" };
    format!("no capability, no new ones, user {uid}{root}{kept}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_child;
    use patience::prelude::*;

    fn thread(name: &str) -> ThreadStatus {
        ThreadStatus {
            name: name.into(),
            uids: vec![1000; 4],
            gids: vec![100; 4],
            no_new_privileges: true,
            ..ThreadStatus::default()
        }
    }

    fn found(threads: Vec<ThreadStatus>, user: Option<&User>) -> (bool, String) {
        let guarantee = judge_threads(Ok(threads), user);
        (guarantee.obtained, guarantee.found)
    }

    #[test]
    fn one_thread_that_keeps_something_spoils_the_whole() {
        assert_eq!(
            found(vec![thread("a"), thread("b")], None),
            (true, "no capability, no new ones, user 1000".into())
        );
        let able = ThreadStatus { capabilities: 1 << 14, ..thread("b") };
        assert_eq!(found(vec![thread("a"), able], None), (false, "capabilities 0x4000 in thread b".into()));
        let open = ThreadStatus { no_new_privileges: false, ..thread("b") };
        assert_eq!(found(vec![thread("a"), open], None), (false, "thread b may get new ones".into()));
        let root = ThreadStatus { uids: vec![0; 4], bounding: 1, ..thread("a") };
        let (obtained, text) = found(vec![root], None);
        assert!(obtained && text.contains("user 0 (root") && text.contains("bounding set kept"), "{text}");
    }

    #[test]
    fn a_user_that_was_asked_for_is_the_only_one() {
        let user = User { name: "lab".into(), uid: 1000, gid: 100 };
        assert!(found(vec![thread("a")], Some(&user)).0);
        let saved_root = ThreadStatus { uids: vec![1000, 1000, 0, 1000], ..thread("a") };
        assert!(!found(vec![saved_root], Some(&user)).0, "it could become root again");
        let in_disk_group = ThreadStatus { groups: vec![100, 6], ..thread("a") };
        assert!(!found(vec![in_disk_group], Some(&user)).0);
        let unreadable = judge_threads(Err(io::ErrorKind::NotFound.into()), None);
        assert!(!unreadable.obtained && unreadable.found.starts_with("unreadable"));
    }

    const TEST: &str = "privileges::tests::what_was_given_up_is_gone_for_the_kernel_too";

    /// In a child: rights do not come back.
    #[test]
    fn what_was_given_up_is_gone_for_the_kernel_too() {
        if test_child::role(TEST).is_some() {
            give_up_and_look();
        }
        let status = test_child::command(TEST, "child").bounded_status().unwrap();
        assert_eq!(status.code(), Some(0));
    }

    /// The test runner's main thread has given up nothing: it is what `judge` has to complain about.
    fn give_up_and_look() -> ! {
        assert!(!judge(None).obtained);
        reduce_thread(Keep::Nothing);
        let own = std::fs::read_to_string("/proc/thread-self/status").unwrap();
        for key in ["CapInh", "CapPrm", "CapEff", "CapAmb"] {
            assert!(own.contains(&format!("{key}:\t0000000000000000\n")), "{own}");
        }
        assert!(own.contains("NoNewPrivs:\t1\n"), "{own}");
        assert_eq!(capability::permitted(), Ok(0));
        assert!(capability::keep_only(1 << CAP_SETUID).is_err(), "nothing comes back");
        std::process::exit(0)
    }
}
