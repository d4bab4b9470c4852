//! Other programs' real-time threads on the measured CPU.
//!
//! Problem: a second driver with the same priority on the same CPU, forgotten in another window, makes every figure
//! three orders of magnitude worse and leaves no trace in any counter but "waited for the CPU".
//! Model: at the beginning of each slice all threads of the machine are looked at; those that are real-time, not the
//! kernel's, allowed on the CPU and not below our priority are told by name, each name once.
//! Cost: a millisecond or two for a few hundred threads, between slices.

use std::collections::BTreeSet;
use std::fs::{read_dir, read_to_string};

/// From sched.h.
const FIFO: u64 = 1;
const RR: u64 = 2;
const DEADLINE: u64 = 6;
/// From the kernel's own include/linux/sched.h; shown in /proc/PID/stat.
const KERNEL_THREAD: u64 = 0x0020_0000;

/// Programs with such threads that were told already.
#[derive(Debug, Default)]
pub struct Neighbours {
    told: BTreeSet<String>,
}

impl Neighbours {
    /// Those that are new, each with a sentence.
    pub fn newcomers(&mut self, cpu: Option<usize>, priority: Option<u8>) -> Vec<String> {
        let Some(cpu) = cpu else { return Vec::new() };
        let found: BTreeSet<String> = all_threads(cpu, priority.unwrap_or(0)).collect();
        let fresh: Vec<String> = found.difference(&self.told).cloned().collect();
        self.told.extend(found);
        let tell = |who: String| {
            format!(
                "{who} runs on CPU {cpu} as well, and not below the measured loop: the figures are not the machine's alone"
            )
        };
        fresh.into_iter().map(tell).collect()
    }
}

fn all_threads(cpu: usize, priority: u8) -> impl Iterator<Item = String> {
    let own = std::process::id();
    let is_number = |name: &str| name.bytes().all(|byte| byte.is_ascii_digit());
    let processes = read_dir("/proc").into_iter().flatten().flatten();
    let processes = processes.filter_map(move |entry| {
        let name = entry.file_name().into_string().ok().filter(|name| is_number(name))?;
        (name.parse() != Ok(own)).then_some(name)
    });
    processes.flat_map(move |pid| {
        let threads = read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
        threads.filter_map(move |thread| {
            let stat = read_to_string(thread.path().join("stat")).ok()?;
            let who = real_time_thread(&stat, priority)?;
            let status = read_to_string(thread.path().join("status")).ok()?;
            allowed_on(&status, cpu).then_some(who)
        })
    })
}

/// Who it is, if it is a real-time thread of a program and not below `priority`. It need not be on the CPU now.
fn real_time_thread(stat: &str, priority: u8) -> Option<String> {
    let (head, rest) = stat.rsplit_once(')')?;
    let name = head.split_once('(')?.1;
    let fields: Vec<&str> = rest.split_whitespace().collect();
    // proc(5) counts fields from 1; behind the name comes the third.
    let field = |number: usize| fields.get(number - 3)?.parse::<u64>().ok();
    let (flags, level, policy) = (field(9)?, field(40)?, field(41)?);
    let is_above = policy == DEADLINE || (matches!(policy, FIFO | RR) && level >= u64::from(priority));
    let policy = match policy {
        FIFO => "FIFO",
        RR => "RR",
        _ => "DEADLINE",
    };
    (is_above && flags & KERNEL_THREAD == 0)
        .then(|| format!("the real-time thread {name} ({policy} {level})"))
}

fn allowed_on(status: &str, cpu: usize) -> bool {
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    list.and_then(rt_core::cpu::parse_cpu_list).is_some_and(|cpus| cpus.contains(&cpu))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stat(flags: u64, level: u64, policy: u64) -> String {
        let mut fields = vec!["0".to_owned(); 50];
        fields[0] = "S".into();
        fields[9 - 3] = flags.to_string();
        fields[40 - 3] = level.to_string();
        fields[41 - 3] = policy.to_string();
        format!("99 (driver-loop) {}", fields.join(" "))
    }

    #[test]
    fn only_programs_threads_that_can_delay_ours_count() {
        let who = |flags, level, policy| real_time_thread(&stat(flags, level, policy), 80);
        assert_eq!(who(0, 80, FIFO).unwrap(), "the real-time thread driver-loop (FIFO 80)");
        assert!(who(0, 99, RR).is_some() && who(0, 0, DEADLINE).is_some());
        assert!(who(0, 79, FIFO).is_none(), "below ours");
        assert!(who(0, 0, 0).is_none(), "an ordinary thread");
        assert!(who(KERNEL_THREAD, 99, FIFO).is_none(), "the kernel's own");
        assert!(real_time_thread("garbage", 80).is_none());
    }

    #[test]
    fn a_thread_counts_where_it_may_run() {
        assert!(allowed_on("Name:\tx\nCpus_allowed_list:\t0-1,4\n", 4));
        assert!(!allowed_on("Cpus_allowed_list:\t0-1\n", 2));
        assert!(!allowed_on("", 0));
    }

    #[test]
    fn a_neighbour_is_told_once() {
        let mut neighbours = Neighbours::default();
        let cpu = Some(rt_core::cpu::current_cpu());
        // Whatever runs here was told the first time; a test of another program may begin in between.
        let first = neighbours.newcomers(cpu, None);
        let again = neighbours.newcomers(cpu, None);
        assert!(again.iter().all(|who| !first.contains(who)), "{again:?}");
        assert!(neighbours.newcomers(None, None).is_empty());
    }
}
