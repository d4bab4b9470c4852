//! Memory that is there before the loop needs it: locked, stack and heap touched.
//!
//! Model: a page that is touched and locked never faults again. Locking covers all mappings, present
//! and future; the allocator is told to keep what it has; then stack and heap are touched once to
//! map them and once more to count the faults, which is the evidence.

use super::SetupRequest;
use super::limits::raise_soft_limit;
use super::report::Guarantee;
use crate::sys::malloc::{NotTuned, keep_freed_pages};
use crate::sys::stack::lowest_address;
use crate::usage::ResourceUsage;
use nix::errno::Errno;
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{RLIM_INFINITY, Resource};
use std::fs::read_to_string;
use std::hint::black_box;

/// Smallest page of the machines Linux runs on: a step that misses none.
const PAGE: usize = 4096;

pub(super) fn prepare(request: &SetupRequest) -> Vec<Guarantee> {
    let mut guarantees = Vec::new();
    if request.lock_memory {
        guarantees.push(lock());
    }
    if request.prefault_heap_bytes > 0 {
        guarantees.push(prefault_heap(request.prefault_heap_bytes));
    }
    if request.prefault_stack_bytes > 0 {
        guarantees.push(prefault_stack(request.prefault_stack_bytes));
    }
    guarantees
}

/// Locks all memory, as far as the limits allow.
fn lock() -> Guarantee {
    let Locking { asked, status, limit } = lock_all();
    judge_lock(asked, &status, limit)
}

/// What came of asking for locked memory.
pub(crate) struct Locking {
    /// What the kernel answered.
    pub(crate) asked: nix::Result<()>,
    /// `/proc/self/status` afterwards.
    pub(crate) status: String,
    /// The limit in force (bytes); none if nothing limits this process.
    pub(crate) limit: Option<u64>,
}

/// Asks, and reads back.
pub(crate) fn lock_all() -> Locking {
    let limit = raise_soft_limit(Resource::RLIMIT_MEMLOCK);
    let status = read_to_string("/proc/self/status").unwrap_or_default();
    let unlimited = limit == RLIM_INFINITY || may_lock_without_limit(&status);
    let asked = if unlimited {
        mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE)
    } else {
        // Under a limit, locking the future would let a later allocation fail, and so abort.
        mlockall(MlockAllFlags::MCL_CURRENT)
    };
    let status = read_to_string("/proc/self/status").unwrap_or_default();
    Locking { asked, status, limit: if unlimited { None } else { Some(limit) } }
}

/// `limit` in bytes, or none if nothing limits this process.
pub(crate) fn judge_lock(asked: nix::Result<()>, status: &str, limit: Option<u64>) -> Guarantee {
    let (locked, resident) = (kib(status, "VmLck:"), kib(status, "VmRSS:"));
    let covered =
        matches!((locked, resident), (Some(locked), Some(resident)) if locked > 0 && locked >= resident);
    let found = match (locked, resident) {
        (Some(locked), Some(resident)) => format!("{locked} KiB locked, {resident} KiB resident"),
        _ => "unreadable".to_owned(),
    };
    let remedy = match (asked, limit) {
        (Ok(()), None) if covered => None,
        (_, Some(limit)) => Some(format!(
            "raise RLIMIT_MEMLOCK from {} KiB to unlimited (memlock in /etc/security/limits.d, \
             LimitMEMLOCK=infinity in a systemd unit), or give the program the capability: setcap \
             cap_ipc_lock,cap_sys_resource=ep",
            limit / 1024
        )),
        (Err(Errno::ENOMEM), None) => Some("free memory: not everything fits".to_owned()),
        (Err(error), None) => Some(format!("the kernel refused: {error}")),
        (Ok(()), None) => Some("the kernel accepted but did not lock everything".to_owned()),
    };
    Guarantee::asked("memory locked", "all present and future pages".to_owned(), found, remedy)
}

/// Whether the effective capabilities in a `/proc/self/status` include CAP_IPC_LOCK.
pub(crate) fn may_lock_without_limit(status: &str) -> bool {
    const CAP_IPC_LOCK: u32 = 14;
    let capabilities = field(status, "CapEff:").and_then(|text| u64::from_str_radix(text, 16).ok());
    capabilities.is_some_and(|bits| bits >> CAP_IPC_LOCK & 1 == 1)
}

fn kib(status: &str, key: &str) -> Option<u64> {
    field(status, key)?.parse().ok()
}

/// The first word behind `key` in a `/proc/self/status`.
pub(crate) fn field<'a>(status: &'a str, key: &str) -> Option<&'a str> {
    status.lines().find_map(|line| line.strip_prefix(key))?.split_whitespace().next()
}

fn prefault_heap(bytes: usize) -> Guarantee {
    let tuned = keep_freed_pages();
    let mapped = touch_heap(bytes);
    let faults = faults_of(|| black_box(touch_heap(bytes)));
    judge_heap(bytes, tuned, mapped, faults)
}

/// Whether there was that much; a failed allocation must not end the process.
fn touch_heap(bytes: usize) -> bool {
    let mut block: Vec<u8> = Vec::new();
    if block.try_reserve_exact(bytes).is_err() {
        return false;
    }
    block.resize(bytes, 1);
    black_box(&mut block);
    true
}

fn judge_heap(bytes: usize, tuned: Result<(), NotTuned>, mapped: bool, faults: u64) -> Guarantee {
    let remedy = match (mapped, tuned) {
        (false, _) => Some("free memory, or ask for less".to_owned()),
        (true, Err(NotTuned)) if faults > 0 => {
            Some("this C library gives freed pages back: use glibc".to_owned())
        }
        _ if faults > 0 => {
            Some("ask for less than 64 MiB on this thread, or set up on the main one".to_owned())
        }
        _ => None,
    };
    let found = if mapped { format!("{faults} page faults when used again") } else { "no memory".to_owned() };
    let wanted = format!("{} KiB without page fault", bytes / 1024);
    Guarantee::asked("heap prefaulted", wanted, found, remedy)
}

/// Left below the touched part for what the touching itself calls, and for signal handlers.
const STACK_RESERVE: usize = 64 * 1024;

fn prefault_stack(bytes: usize) -> Guarantee {
    let here = address_of_a_local();
    let room = lowest_address().map_or(0, |lowest| here.saturating_sub(lowest + STACK_RESERVE));
    let touched = bytes.min(room);
    touch_stack_down_to(here - touched);
    let faults = faults_of(|| touch_stack_down_to(here - touched));
    judge_stack(bytes, touched, faults)
}

fn judge_stack(wanted: usize, touched: usize, faults: u64) -> Guarantee {
    let remedy = if touched < wanted {
        Some("give the thread a larger stack (thread::Builder::stack_size, ulimit -s)".to_owned())
    } else {
        (faults > 0).then(|| "lock the memory: the stack's pages are taken away again".to_owned())
    };
    let found = format!("{} KiB, {faults} page faults when used again", touched / 1024);
    Guarantee::asked("stack prefaulted", format!("{} KiB without page fault", wanted / 1024), found, remedy)
}

/// Descends in frames of about a page, by address: frames are larger without optimisation.
#[inline(never)]
fn touch_stack_down_to(lowest: usize) {
    let mut page = [0_u8; PAGE];
    black_box(&mut page);
    if page.as_ptr().addr() > lowest {
        touch_stack_down_to(lowest);
    }
    // Used again, so that the call above is no tail call that reuses this frame.
    black_box(&mut page);
}

#[inline(never)]
fn address_of_a_local() -> usize {
    let local = black_box(0_u8);
    (&raw const local).addr()
}

/// Page faults of this thread while `f` runs.
fn faults_of<R>(f: impl FnOnce() -> R) -> u64 {
    let before = ResourceUsage::of_thread();
    black_box(f());
    let faults = ResourceUsage::of_thread().delta(&before);
    faults.minor_faults + faults.major_faults
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;

    /// Lines of `/proc/self/status` as recorded, of a root process before and after locking.
    const UNLOCKED: &str =
        "Name:\tcat\nVmLck:\t       0 kB\nVmRSS:\t    1784 kB\nCapEff:\t000001ffffffffff\n";
    const LOCKED: &str = "Name:\tcat\nVmLck:\t    5616 kB\nVmRSS:\t    5404 kB\nCapEff:\t0000000000000000\n";

    #[test]
    fn a_lock_counts_when_it_covers_what_is_resident() {
        let locked = judge_lock(Ok(()), LOCKED, None);
        assert!(locked.obtained);
        assert_eq!(locked.found, "5616 KiB locked, 5404 KiB resident");
        assert!(!judge_lock(Ok(()), UNLOCKED, None).obtained, "accepted, not applied");
        assert!(!judge_lock(Ok(()), "", None).obtained, "nothing to read");
        let partly = "VmLck:\t     100 kB\nVmRSS:\t    5404 kB\n";
        assert!(!judge_lock(Ok(()), partly, None).obtained, "some of it only");
    }

    #[test]
    fn a_lock_under_a_limit_names_the_limit() {
        for asked in [Ok(()), Err(Errno::ENOMEM), Err(Errno::EPERM)] {
            let limited = judge_lock(asked, LOCKED, Some(8192 * 1024));
            assert!(!limited.obtained, "future pages are not locked");
            assert!(limited.remedy.unwrap().contains("RLIMIT_MEMLOCK from 8192 KiB"));
        }
    }

    #[test]
    fn the_capability_to_lock_is_read_from_the_effective_set() {
        assert!(may_lock_without_limit(UNLOCKED));
        assert!(!may_lock_without_limit(LOCKED));
        assert!(may_lock_without_limit("CapEff:\t0000000000004000\n"), "bit 14 alone");
        assert!(!may_lock_without_limit("CapEff:\tnonsense\n"));
    }

    #[test]
    fn heap_and_stack_count_when_using_them_again_faults_no_page() {
        assert!(judge_heap(1 << 20, Ok(()), true, 0).obtained);
        assert!(judge_heap(1 << 20, Ok(()), true, 256).remedy.unwrap().contains("64 MiB"));
        assert!(judge_heap(1 << 20, Err(NotTuned), true, 256).remedy.unwrap().contains("glibc"));
        assert_eq!(judge_heap(1 << 20, Ok(()), false, 0).found, "no memory");
        assert!(judge_stack(65_536, 65_536, 0).obtained);
        assert!(!judge_stack(65_536, 65_536, 3).obtained);
        assert!(judge_stack(65_536, 4_096, 0).remedy.unwrap().contains("larger stack"));
    }

    #[test]
    fn more_stack_than_there_is_does_not_overflow_it() {
        let small = std::thread::Builder::new().stack_size(256 * 1024);
        let guarantee = small.spawn(|| prefault_stack(1 << 30)).unwrap().bounded_join().unwrap();
        assert!(!guarantee.obtained);
    }

    /// An oracle for "touched": a fresh thread's stack faults the first time and not the second.
    #[test]
    fn touching_the_stack_maps_as_many_pages_as_asked() {
        const BYTES: usize = 1 << 20;
        let touch = || {
            let lowest = address_of_a_local() - BYTES;
            (faults_of(|| touch_stack_down_to(lowest)), faults_of(|| touch_stack_down_to(lowest)))
        };
        let (first, second) = std::thread::spawn(touch).bounded_join().unwrap();
        // A thread's stack may be left over from an earlier thread of this program, already mapped,
        // or come as a huge page, so the first count has no lower bound worth asserting.
        assert!(second <= first, "{second} faults after {first}");
        // A page more or less where the descent ends.
        assert!(second <= 1, "{second}");
    }

    #[test]
    fn memory_that_does_not_exist_is_reported_not_fatal() {
        assert!(!touch_heap(usize::MAX / 2));
    }
}
