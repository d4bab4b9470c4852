//! The kernel's books about a thread and a CPU, as /proc shows them.
//!
//! Problem: what a loop suffered must be read from outside: a loop that reads its own counters disturbs itself.
//! Model: text in, numbers out; parsers take text, so that recorded ones test them. What is missing or
//! different on another kernel is `None`.

use std::collections::BTreeMap;
use std::fs::read_to_string;

/// Counters of a thread since it began.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ThreadBooks {
    /// Page faults without I/O.
    pub minor_faults: u64,
    /// Page faults with I/O.
    pub major_faults: u64,
    /// How often it slept.
    pub voluntary_switches: u64,
    /// How often it was preempted.
    pub involuntary_switches: u64,
    /// CPU it ran on last.
    pub last_cpu: usize,
    /// How long it was ready without a CPU (ns), where the kernel tells.
    pub waited_ns: Option<u64>,
}

/// Times of a CPU, in the kernel's ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CpuTimes {
    /// Taken by the hypervisor.
    pub steal: u64,
    /// In interrupts and soft interrupts.
    pub interrupt: u64,
}

/// Reads a thread's books.
pub fn thread(pid: u32, tid: u32) -> Option<ThreadBooks> {
    let read = |name: &str| read_to_string(format!("/proc/{pid}/task/{tid}/{name}")).ok();
    let mut books = parse_thread(&read("stat")?, &read("status")?)?;
    books.waited_ns = read("schedstat").and_then(|text| text.split_whitespace().nth(1)?.parse().ok());
    Some(books)
}

/// The thread of this name in a process.
pub fn find_thread(pid: u32, name: &str) -> Option<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).ok()?;
    let named = |task: &std::fs::DirEntry| {
        read_to_string(task.path().join("comm")).is_ok_and(|found| found.trim_end() == name)
    };
    tasks.flatten().find(named)?.file_name().to_str()?.parse().ok()
}

/// Reads a CPU's times.
pub fn cpu_times(cpu: usize) -> Option<CpuTimes> {
    parse_cpu_times(&read_to_string("/proc/stat").ok()?, cpu)
}

/// Interrupts on a CPU so far, by number and name.
pub fn interrupts(cpu: usize) -> BTreeMap<String, u64> {
    read_to_string("/proc/interrupts").map(|text| parse_interrupts(&text, cpu)).unwrap_or_default()
}

/// Threads that are ready or running on the whole machine.
pub fn running() -> Option<u64> {
    let text = read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().nth(3)?.split('/').next()?.parse().ok()
}

/// Length of a tick in which the kernel counts times (ms); USER_HZ, which Linux fixes at 100 for programs.
pub fn tick_ms() -> f64 {
    1e3 / rustix::param::clock_ticks_per_second() as f64
}

fn parse_thread(stat: &str, status: &str) -> Option<ThreadBooks> {
    // Fields are counted behind the name, which may hold anything; proc(5) counts them from 1.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let field = |number: usize| fields.get(number - 3)?.parse::<u64>().ok();
    let line = |key: &str| {
        let value = status.lines().find_map(|line| line.strip_prefix(key))?;
        value.trim().parse::<u64>().ok()
    };
    Some(ThreadBooks {
        minor_faults: field(10)?,
        major_faults: field(12)?,
        voluntary_switches: line("voluntary_ctxt_switches:")?,
        involuntary_switches: line("nonvoluntary_ctxt_switches:")?,
        last_cpu: field(39)? as usize,
        waited_ns: None,
    })
}

fn parse_cpu_times(stat: &str, cpu: usize) -> Option<CpuTimes> {
    let name = format!("cpu{cpu}");
    let line = stat.lines().find(|line| line.split_whitespace().next() == Some(&name))?;
    let fields: Vec<u64> = line.split_whitespace().skip(1).map_while(|field| field.parse().ok()).collect();
    // user nice system idle iowait irq softirq steal
    Some(CpuTimes { steal: *fields.get(7)?, interrupt: fields[5] + fields[6] })
}

fn parse_interrupts(text: &str, cpu: usize) -> BTreeMap<String, u64> {
    let mut lines = text.lines();
    let heading = format!("CPU{cpu}");
    let headings = lines.next().unwrap_or("").split_whitespace().collect::<Vec<_>>();
    let Some(column) = headings.iter().position(|found| *found == heading) else { return BTreeMap::new() };
    lines.filter_map(|line| interrupt(line, column, headings.len())).collect()
}

/// `36:  0  38102  PCI-MSIX-0000:00:02.0  1-edge  virtio1-req.0` is "36 virtio1-req.0".
fn interrupt(line: &str, column: usize, cpus: usize) -> Option<(String, u64)> {
    let (number, rest) = line.split_once(':')?;
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let count = fields.get(column)?.parse().ok()?;
    let number = number.trim();
    let is_device = number.bytes().all(|byte| byte.is_ascii_digit());
    let name = if is_device { fields.last().copied() } else { None };
    let words = fields.get(cpus..).unwrap_or_default().join(" ");
    Some((format!("{number} {}", name.unwrap_or(&words)).trim_end().to_owned(), count))
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERRUPTS: &str = "           CPU0       CPU1       \n 36:          0      38102 PCI-MSIX-0000:00:02.0   1-edge      virtio1-req.0\nLOC:      57683      59222   Local timer interrupts\nERR:          0\n";

    #[test]
    fn interrupts_are_read_from_the_column_of_the_cpu() {
        let found = parse_interrupts(INTERRUPTS, 1);
        let expected =
            [("36 virtio1-req.0".to_owned(), 38102), ("LOC Local timer interrupts".to_owned(), 59222)];
        assert_eq!(found, BTreeMap::from(expected));
        assert_eq!(parse_interrupts(INTERRUPTS, 0)["36 virtio1-req.0"], 0);
        assert!(parse_interrupts(INTERRUPTS, 7).is_empty(), "no such CPU");
        assert!(parse_interrupts("garbage", 0).is_empty());
    }

    #[test]
    fn a_thread_is_read_whatever_its_name() {
        let mut fields: Vec<String> = (3..=52).map(|n| n.to_string()).collect();
        fields[0] = "S".into();
        let stat = format!("77 (a) name) R) {}", fields.join(" "));
        let status = "Name:\tx\nvoluntary_ctxt_switches:\t12\nnonvoluntary_ctxt_switches:\t3\n";
        let books = parse_thread(&stat, status).unwrap();
        assert_eq!((books.minor_faults, books.major_faults, books.last_cpu), (10, 12, 39));
        assert_eq!((books.voluntary_switches, books.involuntary_switches), (12, 3));
        assert_eq!(parse_thread("77 (x) R", status), None);
    }

    #[test]
    fn steal_and_interrupts_of_one_cpu() {
        let stat =
            "cpu  1 2 3 4 5 6 7 8 9 10\ncpu1 10 20 30 40 50 60 70 80 90 100\ncpu11 0 0 0 0 0 0 0 1 0 0\n";
        assert_eq!(parse_cpu_times(stat, 1), Some(CpuTimes { steal: 80, interrupt: 130 }));
        assert_eq!(parse_cpu_times(stat, 11), Some(CpuTimes { steal: 1, interrupt: 0 }));
        assert_eq!(parse_cpu_times(stat, 2), None);
    }

    #[test]
    fn the_kernel_here_is_read() {
        let pid = std::process::id();
        assert!(thread(pid, pid).is_some());
        assert!(cpu_times(rt_core::cpu::current_cpu()).is_some());
        assert!(thread(pid, 1).is_none(), "not our thread");
    }
}
