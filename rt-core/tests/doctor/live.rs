//! The real file system and the real probes.

use crate::machines::{load, spec};
use rt_core::doctor::live::{LiveProbes, LiveTree};
use rt_core::doctor::machine::{Machine, Tree};
use rt_core::doctor::probe::Probes;
use rt_core::doctor::recorded::{Entry, RecordedMachine};
use rt_core::doctor::{self, Verdict};
use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

/// Locked memory is the whole process's: only one test at a time probes.
static PROBING: Mutex<()> = Mutex::new(());

/// A directory that goes with the test.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("rt-core-doctor-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Writes a recorded machine's files below a directory.
fn unpack(machine: &RecordedMachine, root: &Path) {
    for (path, entry) in &machine.files {
        let place = root.join(path.trim_start_matches('/'));
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        match entry {
            Entry::File(content, status) => {
                fs::write(&place, content).unwrap();
                fs::set_permissions(&place, Permissions::from_mode(status.mode)).unwrap();
            }
            Entry::Directory(_) => fs::create_dir_all(&place).unwrap(),
            Entry::Link(target) => symlink(target, &place).unwrap(),
            Entry::Denied => panic!("{path}: needs another user"),
        }
    }
}

/// The two trees are each other's oracle.
#[test]
fn a_machine_on_disk_is_judged_as_the_recorded_one() {
    for name in ["lab-rt", "cloud-vm", "phantom-bound", "mesa-disabled"] {
        let (recorded, scratch) = (load(name), Scratch::new(name));
        unpack(&recorded, &scratch.0);
        let (tree, spec) = (LiveTree::below(&scratch.0), spec(1));
        let of = |tree: &dyn Tree| doctor::examine(&Machine { tree, probes: &recorded, spec: &spec });
        assert_eq!(of(&tree), of(&recorded), "{name}");
    }
}

#[test]
fn links_modes_and_directories_are_told_apart() {
    let scratch = Scratch::new("kinds");
    unpack(&load("phantom-bound"), &scratch.0);
    let tree = LiveTree::below(&scratch.0);
    let card = "/sys/bus/pci/devices/0000:05:02.0";
    assert_eq!(tree.link(&format!("{card}/driver")).unwrap(), "../../../../bus/pci/drivers/phantom");
    assert_eq!(tree.status(&format!("{card}/resource2")).unwrap().mode, 0o600);
    assert!(
        tree.status(card).unwrap().is_directory
            && !tree.status(&format!("{card}/enable")).unwrap().is_directory
    );
    assert!(tree.read(card).is_err() && tree.list("/nowhere").is_err());
}

/// Whatever this machine grants, each probe comes to an end and leaves this thread as it was.
#[test]
fn the_probes_come_back_and_leave_nothing_behind() {
    let _alone = PROBING.lock().unwrap();
    let of_thread = || {
        let status = fs::read_to_string("/proc/thread-self/status").unwrap();
        let stat = fs::read_to_string("/proc/thread-self/stat").unwrap();
        let policy: Vec<String> =
            stat.rsplit_once(')').unwrap().1.split_whitespace().skip(37).take(2).map(str::to_owned).collect();
        let line = |key| status.lines().find(|line| line.starts_with(key)).map(str::to_owned);
        (line("Cpus_allowed_list:"), policy)
    };
    let (before, cpu) = (of_thread(), *rt_core::cpu::online_cpus().last().unwrap());
    let probes = LiveProbes;
    let promotion = probes.promotion(cpu, 1);
    assert!(promotion.found.is_ok() && promotion.placed.is_ok(), "{promotion:?}");
    let gaps = probes.gaps(cpu, Duration::from_millis(20)).unwrap();
    assert!(gaps.largest_ns > 0, "{gaps:?}");
    assert!(probes.memory_lock().status.contains("VmLck:"));
    assert!(probes.loop_faults(cpu).is_ok());
    // Any kernel ticks between 100 and 1000 times a second.
    assert!((1_000_000..=10_000_000).contains(&probes.kernel_tick_ns().unwrap()));
    let _ = (probes.held_dma_latency_us(), probes.smi_count(cpu));
    assert!(probes.gaps(4095, Duration::from_millis(1)).is_err(), "no machine has that many");
    assert_eq!(of_thread(), before);
    let locked = fs::read_to_string("/proc/self/status").unwrap();
    assert!(locked.lines().any(|line| line.starts_with("VmLck:") && line.ends_with(" 0 kB")), "{locked}");
}

#[test]
fn this_machine_gets_a_verdict_for_every_check() {
    let _alone = PROBING.lock().unwrap();
    let cpu = *rt_core::cpu::online_cpus().last().unwrap();
    let (tree, probes, spec) = (LiveTree::default(), LiveProbes, spec(cpu));
    let findings = doctor::examine(&Machine { tree: &tree, probes: &probes, spec: &spec });
    assert_eq!(findings.len(), doctor::GROUPS.iter().map(|group| group.checks.len()).sum::<usize>());
    for finding in findings.iter().filter(|finding| finding.verdict() == Verdict::Unreadable) {
        println!("unreadable here: {}: {}", finding.id, finding.judgement.found);
    }
}
