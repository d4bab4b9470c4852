//! Which CPUs there are for this process.
//!
//! Problem: a container or a task set may offer fewer CPUs than the machine has, and a loop must
//! know whether it has one of its own before it spins.
//! Model: the affinity mask of the process's main thread, which the kernel keeps within the CPUs
//! that are online and allowed. Threads that were pinned afterwards do not count.
//! Cost: one system call and one allocation: for set-up. [`current_cpu`] is fit for the loop.

use nix::errno::Errno;
use nix::sched::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};
use nix::unistd::{Pid, getpid};

/// The CPUs this process may run on, ascending; never empty.
#[must_use]
pub fn online_cpus() -> Vec<usize> {
    match affinity(getpid()) {
        Ok(cpus) if !cpus.is_empty() => cpus,
        // A machine with more CPUs than the mask holds (1024): the one we are on is certain.
        _ => vec![current_cpu()],
    }
}

/// The CPUs that a loop may be given, the best last: those that this process may run on, then those that the
/// kernel keeps free of everybody who does not ask for them (isolcpus) and that it may move to. Never empty.
#[must_use]
pub fn loop_cpus() -> Vec<usize> {
    let online = online_cpus();
    let isolated = std::fs::read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
    let isolated = parse_cpu_list(&isolated).unwrap_or_default();
    let (mut ordinary, mut kept_free) = (online, Vec::new());
    for cpu in isolated {
        let is_open = ordinary.contains(&cpu);
        if is_open || may_move_to(cpu) {
            ordinary.retain(|other| *other != cpu);
            kept_free.push(cpu);
        }
    }
    ordinary.extend(kept_free);
    ordinary
}

/// Tried by a thread of its own: a container may forbid what the machine has.
fn may_move_to(cpu: usize) -> bool {
    let attempt = std::thread::spawn(move || {
        let mut mask = CpuSet::new();
        mask.set(cpu).and_then(|()| sched_setaffinity(Pid::from_raw(0), &mask)).is_ok()
            && affinity(Pid::from_raw(0)) == Ok(vec![cpu])
    });
    attempt.join().unwrap_or(false)
}

/// Has the calling thread run on any CPU that it may but this one. Where there is no other it stays.
pub fn leave(cpu: usize) {
    let calling_thread = Pid::from_raw(0);
    let Ok(mut mask) = sched_getaffinity(calling_thread) else { return };
    // A mask without any CPU is refused.
    let _ = mask.unset(cpu).and_then(|()| sched_setaffinity(calling_thread, &mask));
}

/// The CPU that the calling thread runs on now; it may be another one right after, unless pinned.
#[must_use]
pub fn current_cpu() -> usize {
    // Fails only on kernels before 2.6.19.
    sched_getcpu().unwrap_or(0)
}

/// The CPUs in a list of the kernel's format, such as `0-3,8`; None if it is not one.
#[must_use]
pub fn parse_cpu_list(list: &str) -> Option<Vec<usize>> {
    let mut cpus = Vec::new();
    for part in list.trim().split(',').filter(|part| !part.is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (usize, usize) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        if last < first || last >= MOST_CPUS {
            return None;
        }
        cpus.extend(first..=last);
    }
    Some(cpus)
}

/// Far above the largest machine Linux knows (8192): a wrong number must not fill the memory.
const MOST_CPUS: usize = 1 << 16;

/// The affinity mask of a thread; 0 is the calling one.
pub(crate) fn affinity(thread: Pid) -> Result<Vec<usize>, Errno> {
    let mask = sched_getaffinity(thread)?;
    Ok((0..CpuSet::count()).filter(|cpu| mask.is_set(*cpu) == Ok(true)).collect())
}

#[cfg(test)]
mod tests {
    use patience::prelude::*;

    use super::*;

    #[test]
    fn a_loop_may_be_given_every_cpu_of_ours_and_is_not_given_one_that_is_not_there() {
        let cpus = loop_cpus();
        for cpu in online_cpus() {
            assert!(cpus.contains(&cpu) && may_move_to(cpu));
        }
        assert!(!may_move_to(1023) || cpus.len() > 1000);
    }

    #[test]
    fn a_thread_that_leaves_a_cpu_keeps_the_others_and_stays_where_there_is_no_other() {
        let thread = std::thread::spawn(|| {
            let mine = Pid::from_raw(0);
            let mut left = affinity(mine).unwrap();
            while let [first, others @ ..] = &left[..] {
                leave(*first);
                let now = affinity(mine).unwrap();
                assert_eq!(now[..], if others.is_empty() { &left[..] } else { others }[..]);
                if others.is_empty() {
                    return;
                }
                left = now;
            }
        });
        thread.bounded_join().unwrap();
    }

    #[test]
    fn the_current_cpu_is_one_of_ours() {
        let cpus = online_cpus();
        assert!(cpus.is_sorted() && cpus.contains(&current_cpu()), "{cpus:?}");
    }

    #[test]
    fn as_many_cpus_are_listed_as_the_standard_library_counts() {
        // It looks at the same mask; a cgroup quota may make it count fewer.
        assert!(online_cpus().len() >= std::thread::available_parallelism().unwrap().get());
    }

    #[test]
    fn cpu_lists_are_read_as_the_kernel_writes_them() {
        assert_eq!(parse_cpu_list("\n"), Some(vec![]));
        assert_eq!(parse_cpu_list("3\n"), Some(vec![3]));
        assert_eq!(parse_cpu_list("0-2,5,7-8\n"), Some(vec![0, 1, 2, 5, 7, 8]));
    }

    #[test]
    fn what_is_no_cpu_list_is_refused() {
        for garbage in ["x", "1-", "-1", "3-1", "0-99999999999", "0-4000000"] {
            assert_eq!(parse_cpu_list(garbage), None, "{garbage}");
        }
    }
}
