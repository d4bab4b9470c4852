//! On which CPU the loop runs, and whether the kernel keeps others away from it.

use super::report::Guarantee;
use crate::cpu::{affinity, parse_cpu_list};
use nix::errno::Errno;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use std::fs::read_to_string;

const CALLING_THREAD: Pid = Pid::from_raw(0);

/// CPUs that the boot loader's `isolcpus=` took out of load balancing.
pub(crate) const ISOLATED_AT_BOOT: &str = "/sys/devices/system/cpu/isolated";
/// CPUs in isolated partitions of cgroup v2, made at run time; kernel 6.8 or newer.
pub(crate) const ISOLATED_AT_RUN_TIME: &str = "/sys/fs/cgroup/cpuset.cpus.isolated";

/// Pins the calling thread.
pub(super) fn run_on(cpu: usize) -> Guarantee {
    let former = affinity(CALLING_THREAD).unwrap_or_default();
    let asked = pin(cpu);
    judge_placement(cpu, asked, affinity(CALLING_THREAD), &former)
}

pub(crate) fn pin(cpu: usize) -> Result<(), Errno> {
    let mut mask = CpuSet::new();
    mask.set(cpu)?;
    sched_setaffinity(CALLING_THREAD, &mask)
}

fn judge_placement(
    wanted: usize,
    asked: Result<(), Errno>,
    found: Result<Vec<usize>, Errno>,
    former: &[usize],
) -> Guarantee {
    let obtained = found.as_ref().is_ok_and(|cpus| cpus == &[wanted]);
    let remedy = (!obtained).then(|| match asked {
        Err(Errno::EINVAL) => {
            let usable = cpu_list(former);
            format!("choose one of the CPUs open to this process ({usable}), or widen its cpuset")
        }
        Err(error) => format!("the kernel refused: {error}"),
        Ok(()) => "something else sets this thread's affinity (taskset, cset, a cpuset): stop it".to_owned(),
    });
    let found = found.map_or_else(|error| format!("unreadable ({error})"), |cpus| cpu_list(&cpus));
    Guarantee::asked("cpu", wanted.to_string(), found, remedy)
}

/// Whether the kernel leaves this CPU to those who ask for it.
pub(super) fn isolation(cpu: usize) -> Guarantee {
    let lists = [ISOLATED_AT_BOOT, ISOLATED_AT_RUN_TIME].map(|path| read_to_string(path).ok());
    judge_isolation(cpu, lists.iter().map(Option::as_deref))
}

fn judge_isolation<'a>(wanted: usize, lists: impl Iterator<Item = Option<&'a str>>) -> Guarantee {
    let mut isolated: Vec<usize> = lists.flatten().filter_map(parse_cpu_list).flatten().collect();
    isolated.sort_unstable();
    isolated.dedup();
    let remedy = (!isolated.contains(&wanted)).then(|| match wanted {
        0 => "choose another CPU: CPU 0 is left to everything else".to_owned(),
        // Those that are isolated already stay so.
        _ => {
            let mut all = isolated.clone();
            all.push(wanted);
            all.sort_unstable();
            let list: Vec<String> = all.iter().map(usize::to_string).collect();
            let list = list.join(",");
            format!("boot with isolcpus=managed_irq,domain,{list} nohz_full={list} rcu_nocbs={list}")
        }
    });
    let found = if isolated.is_empty() { "none isolated".to_owned() } else { cpu_list(&isolated) };
    Guarantee::circumstance("cpu isolation", &format!("CPU {wanted} isolated"), found, remedy)
}

fn cpu_list(cpus: &[usize]) -> String {
    let numbers: Vec<String> = cpus.iter().map(usize::to_string).collect();
    format!("CPU {}", numbers.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_wanted_cpu_alone_counts_as_placed() {
        let placed = judge_placement(1, Ok(()), Ok(vec![1]), &[0, 1]);
        assert!(placed.obtained && placed.remedy.is_none());
        assert_eq!(placed.found, "CPU 1");
        assert!(!judge_placement(1, Ok(()), Ok(vec![0, 1]), &[0, 1]).obtained, "accepted, not applied");
    }

    #[test]
    fn a_cpu_out_of_reach_names_those_within() {
        let refused = judge_placement(7, Err(Errno::EINVAL), Ok(vec![0, 1]), &[0, 1]);
        assert!(!refused.obtained);
        assert!(refused.remedy.unwrap().contains("(CPU 0,1)"));
    }

    #[test]
    fn isolation_counts_whether_made_at_boot_or_at_run_time() {
        let judge = |boot, run_time| judge_isolation(3, [boot, run_time].into_iter());
        assert!(judge(Some("2-3\n"), None).obtained);
        assert!(judge(Some("\n"), Some("3\n")).obtained);
        let missing = judge(Some("\n"), None);
        assert!(!missing.obtained && missing.circumstance);
        assert_eq!(missing.found, "none isolated");
        let another = judge(Some("1"), Some("garbage"));
        assert_eq!((another.obtained, another.found.as_str()), (false, "CPU 1"));
        let all = "boot with isolcpus=managed_irq,domain,1,3 nohz_full=1,3 rcu_nocbs=1,3";
        assert_eq!(another.remedy.as_deref(), Some(all), "another's isolation is kept");
        let first = judge_isolation(0, [Some("1")].into_iter()).remedy.expect("it is not isolated");
        assert!(first.contains("choose another CPU") && !first.contains("isolcpus"), "{first}");
    }
}
