//! Prints what the doctor sees of this machine, in the format of the recorded machines in
//! `rt-core/tests/machines`: for a bug report, or for a test of a kind of machine that is not there yet.
//!
//! `cargo run -p io-driver --example record_machine > machine.txt`; look through it before you give it away:
//! it holds the kernel's command line, names of devices and of the machine's model.

#![forbid(unsafe_code)]

use io_driver::doctor::device;
use rt_core::doctor::live::{LiveProbes, LiveTree};
use rt_core::doctor::machine::{FileStatus, LoopSpec, Machine, Tree};
use rt_core::doctor::probe::{GapProbe, LockProbe, Probes, PromotionProbe};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// Passes everything through and notes it.
#[derive(Default)]
struct Recorder {
    tree: LiveTree,
    notes: RefCell<BTreeMap<String, String>>,
}

impl Recorder {
    fn note<T>(&self, path: &str, result: &io::Result<T>, text: impl FnOnce(&T) -> String) {
        let entry = match result {
            Ok(value) => text(value),
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => format!("=== {path} denied\n"),
            Err(_) => return,
        };
        self.notes.borrow_mut().entry(path.to_owned()).or_insert(entry);
    }

    fn mode_of(&self, path: &str) -> String {
        match self.tree.status(path) {
            Ok(status)
                if matches!(status.mode, 0o644 | 0o444 | 0o777 | 0o755 | 0o555)
                    && status.uid + status.gid == 0 =>
            {
                let read_only = status.mode & 0o200 == 0 && path.ends_with("smp_affinity_list");
                if read_only { " mode 0444".into() } else { String::new() }
            }
            Ok(FileStatus { mode, uid, gid, .. }) => format!(" mode {mode:04o} uid {uid} gid {gid}"),
            Err(_) => String::new(),
        }
    }
}

impl Tree for Recorder {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let result = self.tree.read(path);
        self.note(path, &result, |content| {
            let text = String::from_utf8_lossy(content);
            let end = if text.ends_with('\n') || text.is_empty() { "" } else { "\n" };
            format!("=== {path}{}\n{text}{end}", self.mode_of(path))
        });
        result
    }

    fn list(&self, path: &str) -> io::Result<Vec<String>> {
        let result = self.tree.list(path);
        if !matches!(path, "/proc" | "/proc/irq") {
            self.note(path, &result, |_| format!("=== {path}/\n"));
        }
        result
    }

    fn status(&self, path: &str) -> io::Result<FileStatus> {
        let result = self.tree.status(path);
        let is_directory = result.as_ref().is_ok_and(|status| status.is_directory);
        // Looked at on the way to an interrupt's handler, which is a directory.
        if is_directory || !path.starts_with("/proc/irq/") {
            let slash = if is_directory { "/" } else { "" };
            self.note(path, &result, |_| format!("=== {path}{slash}{}\n", self.mode_of(path)));
        }
        result
    }

    fn link(&self, path: &str) -> io::Result<String> {
        let result = self.tree.link(path);
        self.note(path, &result, |target| format!("=== {path} -> {target}\n"));
        result
    }
}

fn answer(result: Result<(), i32>) -> String {
    result.map_or_else(|errno| errno.to_string(), |()| "ok".to_owned())
}

fn promotion_text(probe: &PromotionProbe) -> String {
    let found = probe
        .found
        .map_or_else(|_| String::new(), |(policy, priority)| format!(" policy={policy} priority={priority}"));
    format!(
        "placed={} asked={}{found} limit={}",
        answer(probe.placed),
        answer(probe.asked),
        probe.rtprio_limit
    )
}

fn lock_text(probe: &LockProbe) -> String {
    let kib = |key: &str| {
        let line = probe.status.lines().find_map(|line| line.strip_prefix(key));
        line.and_then(|line| line.split_whitespace().next()).unwrap_or("?").to_owned()
    };
    let limit = probe.limit.map_or_else(String::new, |limit| format!(" limit={limit}"));
    format!("asked={} locked={} resident={}{limit}", answer(probe.asked), kib("VmLck:"), kib("VmRSS:"))
}

fn gap_text(probe: &GapProbe) -> String {
    let smi = probe.smi.map_or_else(String::new, |smi| format!(" smi={smi}"));
    format!(
        "largest_ns={} long_gaps={} fifo={} preemptions={}{smi}",
        probe.largest_ns,
        probe.long_gaps,
        u8::from(probe.was_fifo),
        probe.preemptions
    )
}

fn or_error<T>(result: Result<T, String>, text: impl FnOnce(T) -> String) -> String {
    result.map_or_else(|error| format!("error {error}"), text)
}

/// Of the processes only interrupt threads and irqbalance, of the interrupts only what was read.
fn matters(path: &str, recorded: &BTreeMap<String, String>) -> bool {
    let of_process = path.strip_prefix("/proc/").and_then(|rest| rest.split_once('/'));
    match of_process.filter(|(pid, _)| pid.bytes().all(|byte| byte.is_ascii_digit())) {
        Some((pid, _)) => {
            let name = recorded.get(&format!("/proc/{pid}/comm")).and_then(|entry| entry.lines().nth(1));
            name.is_some_and(|name| name.starts_with("irq/") || name == "irqbalance")
        }
        None => true,
    }
}

fn main() {
    let cpu = *rt_core::cpu::online_cpus().last().expect("a CPU");
    let spec = LoopSpec { cpu, priority: Some(80), period_ns: 1_000_000, phase_offset_ns: 370_000 };
    let (recorder, probes) = (Recorder::default(), LiveProbes);
    let machine = Machine { tree: &recorder, probes: &probes, spec: &spec };
    let _ = (rt_core::doctor::examine(&machine), device::examine(&machine));
    println!("# Recorded for a loop on CPU {cpu}.");
    let recorded = recorder.notes.borrow();
    for (path, entry) in recorded.iter().filter(|(path, _)| matters(path, &recorded)) {
        debug_assert!(entry.starts_with(&format!("=== {path}")));
        print!("{entry}");
    }
    println!("=== probe promotion\n{}", promotion_text(&probes.promotion(cpu, 80)));
    println!("=== probe memory_lock\n{}", lock_text(&probes.memory_lock()));
    println!(
        "=== probe gaps\n{}",
        or_error(probes.gaps(cpu, Duration::from_millis(200)), |gaps| gap_text(&gaps))
    );
    println!("=== probe loop_faults\n{}", or_error(probes.loop_faults(cpu), |n| format!("faults={n}")));
    println!("=== probe dma_latency\n{}", or_error(probes.held_dma_latency_us(), |us| format!("us={us}")));
    println!("=== probe kernel_tick\n{}", or_error(probes.kernel_tick_ns(), |ns| format!("ns={ns}")));
    println!("=== probe smi_count\n{}", or_error(probes.smi_count(cpu), |n| format!("count={n}")));
}
