//! Recorded machines, and what the doctor says of them.

#![allow(dead_code, reason = "each test program uses its own part")]

use rt_core::doctor::machine::{LoopSpec, Machine};
use rt_core::doctor::recorded::RecordedMachine;
use rt_core::doctor::{self, Finding, Verdict};
use std::path::Path;

/// Every recorded machine with the CPU that its loop would run on.
pub(crate) const ALL: [(&str, usize); 8] = [
    ("lab-rt", 3),
    ("debian-laptop", 7),
    ("cloud-vm", 1),
    ("secure-boot", 3),
    ("rt-without-sysfs", 3),
    ("rt-cgroup-trap", 3),
    ("phantom-bound", 3),
    ("mesa-disabled", 3),
];

/// The text of a machine; one that says so lies on top of another's.
pub(crate) fn text_of(name: &str) -> String {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("rt-core/tests/machines");
    let text = std::fs::read_to_string(directory.join(format!("{name}.txt"))).unwrap();
    match text.strip_prefix("# on top of ").and_then(|rest| rest.split_once(".txt\n")) {
        Some((base, rest)) => text_of(base) + &without_comments(rest),
        None => text,
    }
}

fn without_comments(text: &str) -> String {
    text.split_at(text.find("=== ").unwrap()).1.to_owned()
}

pub(crate) fn load(name: &str) -> RecordedMachine {
    text_of(name).parse().unwrap()
}

/// A machine with changes in the same format.
pub(crate) fn load_with(name: &str, changes: &str) -> RecordedMachine {
    (text_of(name) + changes).parse().unwrap()
}

/// The loop of a default configuration.
pub(crate) fn spec(cpu: usize) -> LoopSpec {
    LoopSpec { cpu, priority: Some(80), period_ns: 1_000_000, phase_offset_ns: 370_000 }
}

pub(crate) fn examine(recorded: &RecordedMachine, spec: &LoopSpec) -> Vec<Finding> {
    doctor::examine(&Machine { tree: recorded, probes: recorded, spec })
}

/// Those that are not as they should be: id and verdict.
pub(crate) fn complaints(findings: &[Finding]) -> Vec<(&'static str, Verdict)> {
    let bad = findings.iter().filter(|finding| finding.verdict() != Verdict::Pass);
    bad.map(|finding| (finding.id, finding.verdict())).collect()
}

pub(crate) fn find<'a>(findings: &'a [Finding], id: &str) -> &'a Finding {
    findings.iter().find(|finding| finding.id == id).unwrap_or_else(|| panic!("no check {id}"))
}
