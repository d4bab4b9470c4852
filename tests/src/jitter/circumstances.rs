//! What the kernel counted around a moment: the differences of two looks at its books.
//!
//! Problem: a number alone explains nothing. A page fault, a preemption, an interrupt storm, or time that the
//! hypervisor took: each leaves a trace in a counter, if one looks before and after.
//! Model: [`Books`] is one look at the loop's thread and its CPU. The last few looks are kept; an event
//! is explained by the differences between the last look before it began and the first after it ended.
//! Limits, told with every event: the counters of *all* that happened in that interval, some tens of
//! milliseconds, not of the event alone; steal time comes in ticks of the kernel (10 ms as a rule).

use crate::jitter::proc_books::{self, CpuTimes, ThreadBooks};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};

/// Differences over an interval. Of what the kernel does not tell there is `None`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circumstances {
    /// Length of the interval that the differences cover (ms): they cannot be told finer.
    pub interval_ms: f64,
    /// CPU of the loop at the interval's end.
    pub cpu: Option<usize>,
    /// It was another one at the beginning.
    pub migrated: bool,
    /// Page faults of the loop's thread, without I/O.
    pub minor_faults: Option<u64>,
    /// Page faults of the loop's thread, with I/O.
    pub major_faults: Option<u64>,
    /// How often the loop's thread slept: about once a tick.
    pub voluntary_switches: Option<u64>,
    /// How often the loop's thread was preempted.
    pub involuntary_switches: Option<u64>,
    /// How long the loop's thread was ready and had no CPU (us).
    pub waited_for_cpu_us: Option<f64>,
    /// Ticks of that CPU that the hypervisor took.
    pub steal_ticks: Option<u64>,
    /// Ticks of that CPU spent in interrupts and soft interrupts.
    pub interrupt_ticks: Option<u64>,
    /// Length of such a tick (ms).
    pub tick_ms: f64,
    /// Interrupts on that CPU by name; those that did not come are left out.
    pub interrupts: BTreeMap<String, u64>,
    /// How many processes were ready or running on the whole machine at the interval's end.
    pub running: Option<u64>,
    /// What else is known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

/// One look.
#[derive(Debug, Clone)]
pub struct Books {
    /// When, on the monotonic clock.
    pub at_ns: u64,
    thread: Option<ThreadBooks>,
    cpu: Option<usize>,
    cpu_times: Option<CpuTimes>,
    interrupts: BTreeMap<String, u64>,
    running: Option<u64>,
}

/// Whom to look at.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    /// Process id.
    pub pid: u32,
    /// Thread id of the loop.
    pub tid: u32,
    /// CPU of the loop, where it is pinned.
    pub cpu: Option<usize>,
}

/// The last looks at a subject.
#[derive(Debug)]
pub struct Watch {
    subject: Subject,
    looks: VecDeque<Books>,
}

/// Enough for an event that lasted several polls.
const KEPT: usize = 32;

impl Books {
    /// Looks now. What cannot be read is left out.
    pub fn look(subject: Subject) -> Self {
        let at_ns = rt_core::clock::monotonic_ns();
        let thread = proc_books::thread(subject.pid, subject.tid);
        let cpu = subject.cpu.or_else(|| thread.as_ref().map(|books| books.last_cpu));
        Self {
            at_ns,
            thread,
            cpu,
            cpu_times: cpu.and_then(proc_books::cpu_times),
            interrupts: cpu.map(proc_books::interrupts).unwrap_or_default(),
            running: proc_books::running(),
        }
    }
}

impl Watch {
    /// Looks for the first time.
    pub fn new(subject: Subject) -> Self {
        Self { subject, looks: VecDeque::from([Books::look(subject)]) }
    }

    /// Looks again.
    pub fn look(&mut self) {
        self.looks.push_back(Books::look(self.subject));
        if self.looks.len() > KEPT {
            self.looks.pop_front();
        }
    }

    /// What happened around an event that began and ended at these times.
    pub fn around(&self, from_ns: u64, to_ns: u64) -> Circumstances {
        let Some(newest) = self.looks.back() else { return Circumstances::default() };
        let before = self.looks.iter().rev().find(|look| look.at_ns <= from_ns).or(self.looks.front());
        let after = self.looks.iter().find(|look| look.at_ns >= to_ns).unwrap_or(newest);
        difference(before.unwrap_or(newest), after)
    }
}

fn difference(before: &Books, after: &Books) -> Circumstances {
    let thread = before.thread.as_ref().zip(after.thread.as_ref());
    let thread = |of: fn(&ThreadBooks) -> u64| thread.map(|(a, b)| of(b).saturating_sub(of(a)));
    let times = before.cpu_times.as_ref().zip(after.cpu_times.as_ref());
    let waited = |books: &ThreadBooks| books.waited_ns;
    let waited_ns = before.thread.as_ref().and_then(waited).zip(after.thread.as_ref().and_then(waited));
    let last_cpu = |books: &Books| books.thread.as_ref().map(|thread| thread.last_cpu);
    Circumstances {
        interval_ms: after.at_ns.saturating_sub(before.at_ns) as f64 / 1e6,
        cpu: last_cpu(after).or(after.cpu),
        migrated: last_cpu(before) != last_cpu(after),
        minor_faults: thread(|books| books.minor_faults),
        major_faults: thread(|books| books.major_faults),
        voluntary_switches: thread(|books| books.voluntary_switches),
        involuntary_switches: thread(|books| books.involuntary_switches),
        waited_for_cpu_us: waited_ns.map(|(a, b)| b.saturating_sub(a) as f64 / 1e3),
        steal_ticks: times.map(|(a, b)| b.steal.saturating_sub(a.steal)),
        interrupt_ticks: times.map(|(a, b)| b.interrupt.saturating_sub(a.interrupt)),
        tick_ms: proc_books::tick_ms(),
        interrupts: came(&before.interrupts, &after.interrupts),
        running: after.running,
        remarks: Vec::new(),
    }
}

fn came(before: &BTreeMap<String, u64>, after: &BTreeMap<String, u64>) -> BTreeMap<String, u64> {
    let since = |(name, count): (&String, &u64)| {
        let more = count.saturating_sub(before.get(name).copied().unwrap_or(0));
        (more > 0).then(|| (name.clone(), more))
    };
    after.iter().filter_map(since).collect()
}

impl Circumstances {
    /// What stands out, in a few words, and how fine that is.
    pub fn in_short(&self) -> String {
        format!("{} (within {:.0} ms)", self.what_stands_out(), self.interval_ms)
    }

    /// What stands out, in a few words.
    pub fn what_stands_out(&self) -> String {
        let mut words = Vec::new();
        let mut say = |count: Option<u64>, what: &str| {
            if let Some(count) = count.filter(|count| *count > 0) {
                words.push(format!("{count} {what}"));
            }
        };
        say(self.steal_ticks, "steal ticks");
        say(self.major_faults, "major faults");
        say(self.minor_faults, "minor faults");
        say(self.involuntary_switches, "preemptions");
        say(self.interrupt_ticks, "interrupt ticks");
        if let Some(us) = self.waited_for_cpu_us.filter(|us| *us >= 1.0) {
            words.push(format!("{us:.0} us without a CPU"));
        }
        if self.migrated {
            words.push("moved to another CPU".into());
        }
        // The timer's own are expected, about one a tick.
        let mut devices: Vec<_> =
            self.interrupts.iter().filter(|(name, _)| !name.starts_with("LOC")).collect();
        devices.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        words.extend(devices.iter().take(3).map(|(name, count)| format!("{count} x {name}")));
        words.extend(self.remarks.iter().cloned());
        if words.is_empty() { "nothing else counted".into() } else { words.join(", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn books(at_ns: u64, faults: u64) -> Books {
        let thread = ThreadBooks { minor_faults: faults, last_cpu: 1, ..ThreadBooks::default() };
        let interrupts = BTreeMap::from([("36 virtio1-req.0".to_owned(), 10 * at_ns), ("RES".to_owned(), 7)]);
        Books { at_ns, thread: Some(thread), cpu: Some(1), cpu_times: None, interrupts, running: Some(2) }
    }

    fn watch(looks: &[(u64, u64)]) -> Watch {
        let subject = Subject { pid: 0, tid: 0, cpu: Some(1) };
        Watch { subject, looks: looks.iter().map(|(at, faults)| books(*at, *faults)).collect() }
    }

    #[test]
    fn an_event_is_explained_by_the_nearest_looks_around_it() {
        let watch = watch(&[(100, 0), (200, 5), (300, 6), (400, 60)]);
        let around = watch.around(210, 290);
        assert_eq!(around.minor_faults, Some(1));
        assert_eq!(around.interrupts, BTreeMap::from([("36 virtio1-req.0".to_owned(), 1000)]));
        assert_eq!(watch.around(150, 310).minor_faults, Some(60), "it spans three intervals");
        assert_eq!(watch.around(50, 150).minor_faults, Some(5), "it began before the first look");
    }

    #[test]
    fn what_stands_out_is_said_and_how_fine_it_is() {
        let calm = Circumstances { interval_ms: 50.2, ..Circumstances::default() };
        assert_eq!(calm.in_short(), "nothing else counted (within 50 ms)");
        let stolen = Circumstances { steal_ticks: Some(2), major_faults: Some(1), ..calm };
        assert_eq!(stolen.in_short(), "2 steal ticks, 1 major faults (within 50 ms)");
    }

    #[test]
    fn a_look_at_this_very_thread_finds_the_fault_that_it_makes() {
        let tid = rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs();
        let subject = Subject { pid: std::process::id(), tid, cpu: None };
        let mut watch = Watch::new(subject);
        let from_ns = rt_core::clock::monotonic_ns();
        // Fresh pages of 4 KiB: at least some of them fault, even with huge pages.
        let page = std::hint::black_box(vec![1_u8; 8 << 20]);
        let to_ns = rt_core::clock::monotonic_ns();
        watch.look();
        let around = watch.around(from_ns, to_ns);
        assert!(around.minor_faults.unwrap() > 0, "{around:?} {}", page.len());
        assert!(around.interval_ms > 0.0 && around.cpu.is_some());
    }
}
