//! What the doctor says of whole recorded machines.

use crate::machines::{complaints, examine, find, load, spec};
use rt_core::doctor::Verdict::{self, Fail, Unreadable, Warn};

fn complaints_of(name: &str, cpu: usize) -> Vec<(&'static str, Verdict)> {
    complaints(&examine(&load(name), &spec(cpu)))
}

#[test]
fn a_well_set_up_workstation_passes_everything() {
    assert_eq!(complaints_of("lab-rt", 3), []);
}

#[test]
fn a_real_time_kernel_without_the_sysfs_file_passes_everything_too() {
    assert_eq!(complaints_of("rt-without-sysfs", 3), []);
}

#[test]
fn a_laptop_as_it_comes_is_told_everything_that_is_in_the_way() {
    let expected = [
        ("kernel.realtime", Fail),
        ("kernel.isolcpus", Warn),
        ("kernel.nohz_full", Warn),
        ("kernel.rcu_nocbs", Warn),
        ("starvation.rt_throttling", Warn),
        ("starvation.fair_server", Unreadable),
        ("privilege.rtprio", Fail),
        ("privilege.memlock", Fail),
        ("privilege.promotion", Fail),
        ("interference.irq_affinity", Warn),
        ("interference.default_smp_affinity", Warn),
        ("interference.workqueues", Warn),
        ("interference.irqbalance", Warn),
        ("interference.thp", Warn),
        ("interference.smt_sibling", Warn),
        ("interference.watchdogs", Warn),
        ("interference.timer_migration", Warn),
        ("power.governor", Warn),
        ("power.epp", Warn),
        ("power.c_states", Warn),
        ("power.pcie_aspm", Warn),
        ("power.gpu", Warn),
        ("firmware.smi", Unreadable),
        ("firmware.latency", Unreadable),
        ("memory.lock", Fail),
        ("memory.swap", Warn),
        ("memory.compaction", Warn),
    ];
    assert_eq!(complaints_of("debian-laptop", 7), expected);
}

#[test]
fn a_virtual_machine_is_not_blamed_for_what_only_hardware_has() {
    let expected = [
        ("kernel.realtime", Fail),
        ("kernel.isolcpus", Warn),
        ("kernel.nohz_full", Warn),
        ("kernel.rcu_nocbs", Warn),
        ("starvation.rt_throttling", Warn),
        ("starvation.fair_server", Unreadable),
        ("interference.irq_affinity", Warn),
        ("interference.default_smp_affinity", Warn),
        ("interference.workqueues", Warn),
        ("interference.watchdogs", Warn),
        ("interference.timer_migration", Warn),
        ("power.pcie_aspm", Warn),
        ("firmware.virtualisation", Warn),
        ("firmware.steal", Warn),
        ("firmware.smi", Unreadable),
        ("firmware.latency", Warn),
    ];
    assert_eq!(complaints_of("cloud-vm", 1), expected);
}

#[test]
fn secure_boot_hides_the_fair_server_and_the_smi_count() {
    let expected = [("starvation.fair_server", Unreadable), ("firmware.smi", Unreadable)];
    assert_eq!(complaints_of("secure-boot", 3), expected);
    let findings = examine(&load("secure-boot"), &spec(3));
    let server = &find(&findings, "starvation.fair_server").judgement;
    assert_eq!(server.found, "closed by kernel lockdown");
}

#[test]
fn a_cgroup_without_a_share_is_found_and_blamed_for_the_refused_promotion() {
    let expected = [("starvation.rt_group", Fail), ("privilege.promotion", Fail)];
    assert_eq!(complaints_of("rt-cgroup-trap", 3), expected);
    let findings = examine(&load("rt-cgroup-trap"), &spec(3));
    let remedy = |id| &find(&findings, id).judgement.remedy.as_ref().unwrap().text;
    assert!(
        remedy("starvation.rt_group")
            .starts_with("echo 100000 > /sys/fs/cgroup/cpu,cpuacct/lab/cpu.rt_runtime_us")
    );
    assert!(remedy("privilege.promotion").contains("cgroup grants no real-time time"));
}

#[test]
fn cards_are_no_business_of_these_checks() {
    for name in ["phantom-bound", "mesa-disabled"] {
        assert_eq!(complaints_of(name, 3), []);
    }
}

#[test]
fn every_complaint_has_a_reason_and_a_remedy_and_every_pass_has_neither_need() {
    for (name, cpu) in crate::machines::ALL {
        for finding in examine(&load(name), &spec(cpu)) {
            let remedy = finding.judgement.remedy.as_ref();
            assert_eq!(remedy.is_none(), finding.verdict() == Verdict::Pass, "{name}: {}", finding.id);
            assert!(remedy.is_none_or(|remedy| !remedy.text.is_empty()), "{name}: {}", finding.id);
            assert!(!finding.judgement.found.is_empty() && !finding.why.is_empty());
            assert!(finding.id.starts_with(finding.group), "{}", finding.id);
        }
    }
}

#[test]
fn no_two_checks_share_an_id() {
    let findings = examine(&load("lab-rt"), &spec(3));
    let ids: std::collections::BTreeSet<_> = findings.iter().map(|finding| finding.id).collect();
    assert_eq!(ids.len(), findings.len());
}
