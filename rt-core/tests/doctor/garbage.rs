//! Whatever lies in the machine's files: no panic, and no "pass" from a file that makes no sense.

use crate::machines::{load, spec};
use proptest::prelude::*;
use rt_core::doctor::machine::{FileStatus, Machine, Tree};
use rt_core::doctor::plan::{self, PlanNames};
use rt_core::doctor::recorded::{Entry, RecordedMachine};
use rt_core::doctor::table::Table;
use rt_core::doctor::{self, Check, GROUPS, Verdict};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io;

/// Notes which files a check read.
struct Watched<'a> {
    tree: &'a RecordedMachine,
    read: RefCell<BTreeSet<String>>,
}

impl Tree for Watched<'_> {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        self.read.borrow_mut().insert(path.to_owned());
        self.tree.read(path)
    }

    fn list(&self, path: &str) -> io::Result<Vec<String>> {
        self.tree.list(path)
    }

    fn status(&self, path: &str) -> io::Result<FileStatus> {
        self.tree.status(path)
    }

    fn link(&self, path: &str) -> io::Result<String> {
        self.tree.link(path)
    }
}

fn checks() -> impl Iterator<Item = &'static Check> {
    GROUPS.iter().flat_map(|group| group.checks)
}

/// The verdict of one check, and the files that it read.
fn ask(check: &Check, machine: &RecordedMachine, cpu: usize) -> (Verdict, BTreeSet<String>) {
    let watched = Watched { tree: machine, read: RefCell::default() };
    let spec = spec(cpu);
    let finding = check.examine("", &Machine { tree: &watched, probes: machine, spec: &spec });
    (finding.verdict(), watched.read.into_inner())
}

/// Any process may give itself any name.
fn is_a_process_name(path: &str) -> bool {
    path.ends_with("/comm")
}

/// Names and versions, in which any word may stand; whether they are text is checked.
fn is_free_text(path: &str) -> bool {
    let names = ["/proc/cmdline", "/proc/sys/kernel/version", "/proc/sys/kernel/osrelease"];
    is_a_process_name(path)
        || path.starts_with("/sys/class/dmi/")
        || names.contains(&path)
        || path.contains("/cpuidle/") && path.ends_with("/name")
}

/// What decides nothing: the distribution's name is for the remedy, these two say what is managed.
fn decides_nothing(path: &str) -> bool {
    path == "/etc/os-release"
        || path.starts_with("/sys/kernel/debug/irq/")
        || path.ends_with("available_clocksource")
}

fn garble_each_file(garbage: &[u8], skip: impl Fn(&str) -> bool) {
    for (name, cpu) in crate::machines::ALL {
        let machine = load(name);
        for check in checks() {
            let (_, files) = ask(check, &machine, cpu);
            for file in files.iter().filter(|file| !skip(file) && !decides_nothing(file)) {
                if !matches!(machine.files.get(file.as_str()), Some(Entry::File(..))) {
                    continue;
                }
                let mut garbled = machine.clone();
                garbled.set(file, garbage);
                let (verdict, _) = ask(check, &garbled, cpu);
                assert_ne!(verdict, Verdict::Pass, "{name}: {} with garbage in {file}", check.id);
            }
        }
    }
}

/// No file of the kernel holds these.
#[test]
fn a_check_whose_file_is_binary_garbage_never_passes() {
    for garbage in [&b"\0\0\0\0"[..], b"\xff\xfe1\n", b"1\x1b[2J\n", b"\x80 0-3"] {
        garble_each_file(garbage, is_a_process_name);
    }
}

/// A command line of one unknown word is a valid one, whose effects are elsewhere.
#[test]
fn a_check_whose_file_holds_a_wrong_word_never_passes() {
    for garbage in ["zebra\n", "-\n", "99999999999999999999999\n"] {
        garble_each_file(garbage.as_bytes(), is_free_text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Everything at once: several files with any bytes, on any machine; table and plan as well.
    #[test]
    fn any_bytes_in_any_files_never_panic(
        which in 0..crate::machines::ALL.len(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<Vec<u8>>()), 1..20),
    ) {
        let (name, cpu) = crate::machines::ALL[which];
        let mut machine = load(name);
        let files: Vec<String> = machine.files.keys().cloned().collect();
        for (index, content) in changes {
            machine.set(index.get(&files).as_str(), content);
        }
        render(&machine, cpu);
    }

    /// The same with words that nearly make sense.
    #[test]
    fn nearly_sensible_words_never_panic(
        which in 0..crate::machines::ALL.len(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), "[-0-9,x \\[\\]a-f\n:./'\"$`\\\\]{0,40}"), 1..20),
    ) {
        let (name, cpu) = crate::machines::ALL[which];
        let mut machine = load(name);
        let files: Vec<String> = machine.files.keys().cloned().collect();
        for (index, content) in changes {
            machine.set(index.get(&files).as_str(), content);
        }
        render(&machine, cpu);
    }

    #[test]
    fn any_text_in_place_of_a_recorded_machine_is_read_or_refused(text in "(?s).{0,200}") {
        let _ = text.parse::<RecordedMachine>();
    }
}

fn render(machine: &RecordedMachine, cpu: usize) {
    let spec = spec(cpu);
    let machine = Machine { tree: machine, probes: machine, spec: &spec };
    let findings = doctor::examine(&machine);
    let table = Table { findings: &findings, spec: &spec }.to_string();
    assert!(!table.chars().any(|c| c.is_control() && c != '\n'), "control characters reach the terminal");
    let names = PlanNames {
        prefix: "lab".into(),
        program: "/usr/bin/loop".into(),
        unit_prefixes: vec!["lab".into()],
    };
    let script = plan::script(&machine, &findings, &names);
    assert!(!script.chars().any(|c| c.is_control() && c != '\n'));
}
