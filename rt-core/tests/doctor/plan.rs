//! The fix plan: what it says for whole machines, that it is valid and harmless, and that it helps.

use crate::machines::{complaints, examine, load, load_with, spec};
use patience::prelude::*;
use rt_core::cpu::parse_cpu_list;
use rt_core::doctor::Verdict::Unreadable;
use rt_core::doctor::cpus::{list_of, mask_of};
use rt_core::doctor::machine::{Machine, Tree};
use rt_core::doctor::plan::{self, PlanNames};
use rt_core::doctor::recorded::RecordedMachine;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

fn plan_of(recorded: &RecordedMachine, cpu: usize) -> String {
    let spec = spec(cpu);
    let machine = Machine { tree: recorded, probes: recorded, spec: &spec };
    let names = PlanNames {
        prefix: "phantom3-plan".into(),
        program: "/usr/local/bin/io-driver".into(),
        unit_prefixes: vec!["io-driver".into()],
    };
    plan::script(&machine, &examine(recorded, &spec), &names)
}

/// With DOCTOR_BLESS set, writes the files anew: look at the difference then.
fn compare_with_golden(name: &str, cpu: usize) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/machines/{name}.plan.sh"));
    let script = plan_of(&load(name), cpu);
    if std::env::var_os("DOCTOR_BLESS").is_some() {
        std::fs::write(&path, &script).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    assert!(script == golden, "{name}: the plan is another than {}:\n{script}", path.display());
}

#[test]
fn the_laptops_plan_is_the_committed_one() {
    compare_with_golden("debian-laptop", 7);
}

#[test]
fn the_virtual_machines_plan_is_the_committed_one() {
    compare_with_golden("cloud-vm", 1);
}

#[test]
fn where_nothing_is_wrong_nothing_is_planned() {
    let script = plan_of(&load("lab-rt"), 3);
    assert!(script.ends_with("# Nothing to do.\n") && !script.contains("\nput"), "{script}");
}

#[test]
fn undoing_a_plan_leaves_no_group_that_it_made_and_takes_no_other() {
    let plan = |changes: &str| plan_of(&load_with("debian-laptop", changes), 7);
    let (whole, member) = ("; undo: groupdel phantom3\n", "; undo: gpasswd --delete NAME phantom3\n");
    for none in ["", "=== /etc/group\nroot:x:0:\nphantom3x:x:997:\n"] {
        let script = plan(none);
        assert!(script.contains(whole) && !script.contains(member), "{none:?}: {script}");
    }
    let script = plan("=== /etc/group\nroot:x:0:\nphantom3:x:997:tester\n");
    assert!(script.contains(member) && !script.contains(whole), "{script}");
}

/// What a plan may call; `put` and `add` are its own functions.
const HARMLESS: [&str; 28] = [
    "#",
    "mark='#",
    "add",
    "add()",
    "}",
    "for",
    "done",
    "set",
    "[",
    "put",
    "put()",
    "mkdir",
    "cat",
    "update-grub",
    "grubby",
    "printf",
    "kernel-install",
    "sysctl",
    "systemctl",
    "systemd-tmpfiles",
    "swapoff",
    "tuned-adm",
    "modprobe",
    "getent",
    "udevadm",
    "END",
    "exit",
    "#!/bin/sh",
];

/// Every line outside of files that the script writes.
fn commands(script: &str) -> Vec<&str> {
    let mut in_file = false;
    let mut lines = Vec::new();
    for line in script.lines() {
        if !in_file {
            lines.push(line);
        }
        in_file = (in_file || line.ends_with("<<'END'")) && line != "END";
    }
    lines
}

fn check_harmless(script: &str) {
    for line in commands(script) {
        let word = line.split(' ').next().unwrap();
        assert!(word.is_empty() || HARMLESS.contains(&word), "{line}");
        let code = if word == "#" || word == "#!/bin/sh" { "" } else { line };
        for danger in ["rm", "dd", "reboot", "mkfs", "curl", "wget", "eval", ">>", "chmod", "kill"] {
            assert!(!code.split_whitespace().any(|word| word == danger), "{line}");
        }
        // Files are only added to, and to none that is installed.
        assert!(!code.starts_with("cat >"), "{line}");
        if let Some(path) = code.strip_prefix("add ").and_then(|rest| rest.split(' ').next()) {
            assert!(path.contains("phantom3-plan"), "{line}");
        }
    }
}

fn check_syntax(script: &str) {
    let mut sh = Command::new("sh").arg("-n").stdin(Stdio::piped()).spawn().expect("every system has sh");
    sh.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    assert!(sh.bounded_wait().success(), "{script}");
}

/// Machines with each boot loader, with tuned, with a unit of the loop, and with hostile names.
fn variants() -> Vec<(RecordedMachine, usize)> {
    let changes = [
        "",
        "=== /usr/sbin/update-grub removed\n=== /usr/sbin/grubby\n",
        "=== /usr/sbin/update-grub removed\n",
        "=== /etc/default/grub removed\n=== /etc/kernel/cmdline\nroot=/dev/sda2 quiet\n",
        "=== /etc/default/grub removed\n=== /boot/firmware/cmdline.txt\nroot=/dev/mmcblk0p2\n",
        "=== /usr/sbin/tuned-adm\n",
        "=== /etc/systemd/system/io-driver.service\n[Service]\n",
        "=== /proc/irq/40/$(reboot)'/\n=== /proc/irq/40/smp_affinity_list\n0-7\n=== /proc/irq/40/effective_affinity_list\n7\n",
        "=== /proc/cmdline\nisolcpus=';reboot;'\"$(reboot)` irqaffinity=\\\n",
        "=== /sys/class/drm/card1/device/power/control\nauto\n",
    ];
    let laptops = changes.iter().map(|changes| (load_with("debian-laptop", changes), 7));
    laptops.chain(crate::machines::ALL.iter().map(|(name, cpu)| (load(name), *cpu))).collect()
}

#[test]
fn every_plan_is_a_valid_script_of_harmless_commands() {
    for (machine, cpu) in variants() {
        let script = plan_of(&machine, cpu);
        check_syntax(&script);
        check_harmless(&script);
    }
}

#[test]
fn every_command_that_changes_something_is_preceded_by_what_it_does_and_how_to_undo_it() {
    for (machine, cpu) in variants() {
        let script = plan_of(&machine, cpu);
        let lines = commands(&script);
        for (at, line) in lines.iter().enumerate().filter(|(_, line)| {
            [
                "put ",
                "sysctl ",
                "systemctl disable",
                "systemctl restart",
                "swapoff",
                "add ",
                "grubby",
                "modprobe",
            ]
            .iter()
            .any(|command| line.starts_with(command))
        }) {
            // A comment or the daemon's reload may stand between.
            let explained = lines[at.saturating_sub(3)..at]
                .iter()
                .any(|line| line.starts_with("# ") && line.contains("undo: "));
            assert!(explained, "{line}");
        }
    }
}

#[test]
fn each_boot_loader_gets_its_own_way() {
    let plan = |changes: &str| plan_of(&load_with("debian-laptop", changes), 7);
    let words =
        "isolcpus=managed_irq,domain,7 nohz_full=7 rcu_nocbs=7 irqaffinity=0-6 pcie_aspm.policy=performance";
    let grub = plan("");
    assert!(grub.contains("add /etc/default/grub.d/zz-phantom3-plan.cfg <<'END'\n"), "{grub}");
    for word in words.split(' ') {
        assert!(grub.contains(&format!("=\"$GRUB_CMDLINE_LINUX_DEFAULT {word}\" ;; esac\n")), "{word}");
    }
    let grubby = plan("=== /usr/sbin/update-grub removed\n=== /usr/sbin/grubby\n");
    assert!(grubby.contains(&format!("grubby --update-kernel=ALL --args='{words}'")));
    let systemd = plan("=== /etc/default/grub removed\n=== /etc/kernel/cmdline\nquiet\n");
    assert!(systemd.contains("[ -e /etc/kernel/cmdline.before-phantom3-plan ] || cp /etc/kernel/cmdline"));
    let raspberry = plan("=== /etc/default/grub removed\n=== /boot/firmware/cmdline.txt\nquiet\n");
    assert!(raspberry.contains(&format!("for word in {words}; do")));
    assert!(raspberry.contains("\"$line\" \"$word\" > /boot/firmware/cmdline.txt\n"), "{raspberry}");
    let none = plan("=== /etc/default/grub removed\n");
    assert!(none.contains("No boot loader was found") && none.contains(&format!("\n# {words}\n")));
}

/// Where TuneD runs it would undo what systemd set.
#[test]
fn tuned_gets_a_profile_on_top_of_the_active_one() {
    let active = "=== /usr/sbin/tuned-adm\n=== /etc/tuned/active_profile\nphantom3\n";
    let script = plan_of(&load_with("debian-laptop", active), 7);
    let profile = "add /etc/tuned/phantom3-plan/tuned.conf <<'END'\n[main]\nsummary=Settings for a real-time \
                   loop\ninclude=phantom3\n[sysfs]\n/sys/";
    assert!(script.contains(profile), "{script}");
    assert!(
        script.contains("tuned-adm profile phantom3-plan")
            && script.contains("undo: tuned-adm profile phantom3\n")
    );
    // A second plan adds to the last section of the first's.
    let again = format!("{active}=== /etc/tuned/phantom3-plan/tuned.conf\n# made by a plan\n[sysfs]\n");
    let script = plan_of(&load_with("debian-laptop", &again), 7);
    assert!(script.contains("add /etc/tuned/phantom3-plan/tuned.conf <<'END'\n/sys/"), "{script}");
}

/// Its script must not stop halfway at a command that is not there.
#[test]
fn without_systemd_and_udev_their_commands_are_not_called() {
    let script = plan_of(&load_with("debian-laptop", "=== /run/systemd removed\n=== /run/udev removed\n"), 7);
    let called = commands(&script);
    for command in ["systemctl", "systemd-tmpfiles", "udevadm"] {
        assert!(!called.iter().any(|line| line.starts_with(command)), "{script}");
    }
    assert!(script.contains("# echo performance > /sys/devices/system/cpu/cpu7/cpufreq/scaling_governor"));
}

#[test]
fn a_unit_of_the_loop_gets_a_drop_in() {
    let script =
        plan_of(&load_with("debian-laptop", "=== /etc/systemd/system/io-driver.service\n[Service]\n"), 7);
    assert!(script.contains("add /etc/systemd/system/io-driver.service.d/phantom3-plan-rights.conf"));
    assert!(script.contains("LimitRTPRIO=95\nLimitMEMLOCK=infinity\nEND"));
}

/// What the kernel makes of a written value.
fn accept(machine: &mut RecordedMachine, path: &str, value: &str) {
    let former = String::from_utf8(machine.read(path).unwrap_or_default()).unwrap();
    let content = match former.contains('[') {
        // `always [madvise] never`
        true => former.replace(['[', ']'], "").replace(value, &format!("[{value}]")),
        false => format!("{value}\n"),
    };
    assert!(machine.exists_as_file(path), "{path} is not there to be written");
    machine.set(path, content);
    if let Some(directory) = path.strip_suffix("/smp_affinity_list") {
        machine.set(&format!("{directory}/effective_affinity_list"), format!("{value}\n"));
    }
    if path == "/sys/devices/system/cpu/cpu3/online" {
        machine.set("/sys/devices/system/cpu/cpu7/topology/thread_siblings_list", "7\n");
    }
}

trait ExistsAsFile {
    fn exists_as_file(&self, path: &str) -> bool;
}

impl ExistsAsFile for RecordedMachine {
    fn exists_as_file(&self, path: &str) -> bool {
        // Switches of a CPU are not recorded, since no check reads them.
        self.read(path).is_ok() || path.ends_with("/online")
    }
}

/// Boots with these words.
fn boot(machine: &mut RecordedMachine, words: &str, cpus: usize) {
    let former = String::from_utf8(machine.read("/proc/cmdline").unwrap()).unwrap();
    machine.set("/proc/cmdline", format!("{} {words}\n", former.trim()));
    for word in words.split(' ') {
        let (key, value) = word.split_once('=').unwrap();
        match key {
            "isolcpus" => {
                let list = value.rsplit(',').next().unwrap();
                machine.set("/sys/devices/system/cpu/isolated", format!("{list}\n"));
            }
            "nohz_full" => machine.set("/sys/devices/system/cpu/nohz_full", format!("{value}\n")),
            "irqaffinity" => {
                let list = parse_cpu_list(value).unwrap();
                assert_eq!(list_of(&list), value);
                assert!(list.len() < cpus);
                machine.set("/proc/irq/default_smp_affinity", mask_of(&list));
            }
            _ => {}
        }
    }
}

/// Does to a recorded machine what a plan says, line by line of its text.
fn apply(machine: &mut RecordedMachine, script: &str, cpus: usize) {
    for line in script.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["put", value, path] => accept(machine, path, value),
            ["sysctl", "-w", setting] => {
                let (key, value) = setting.split_once('=').unwrap();
                accept(machine, &format!("/proc/sys/{}", key.replace('.', "/")), value);
            }
            ["systemctl", "disable", "--now", "irqbalance.service"] => machine.remove("/proc/612"),
            ["swapoff", "-a"] => machine.set("/proc/swaps", "Filename Type Size Used Priority\n"),
            ["@phantom3", "-", "rtprio", priority] => grant(machine, priority),
            _ if line.starts_with("case ") && line.contains("GRUB_CMDLINE_LINUX_DEFAULT=") => {
                let word = line.split_once("=\"$GRUB_CMDLINE_LINUX_DEFAULT ").unwrap().1;
                boot(machine, word.trim_end_matches("\" ;; esac"), cpus);
            }
            _ if line.contains("KERNEL==\"cpu_dma_latency\"") => {
                machine.probes.insert("dma_latency".into(), "us=0".into());
            }
            _ => {}
        }
    }
}

/// Rights take effect at the next login.
fn grant(machine: &mut RecordedMachine, priority: &str) {
    let limits =
        format!("Max locked memory unlimited unlimited bytes\nMax realtime priority {priority} {priority}\n");
    machine.set("/proc/self/limits", limits);
    machine
        .probes
        .insert("promotion".into(), format!("placed=ok asked=ok policy=1 priority=80 limit={priority}"));
    machine.probes.insert("memory_lock".into(), "asked=ok locked=9000 resident=8000".into());
}

#[test]
fn doing_what_the_laptops_plan_says_leaves_only_what_no_script_can_mend() {
    let mut machine = load("debian-laptop");
    let script = plan_of(&machine, 7);
    // The fair server's file cannot be read by this user, but root's script writes it.
    let writable = "put 0 /sys/kernel/debug/sched/fair_server/cpu7/runtime";
    assert!(script.contains(writable), "{script}");
    apply(&mut machine, &script.replace(writable, ""), 8);
    // By hand: the other kernel.
    machine.set("/proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian\n");
    let left = complaints(&examine(&machine, &spec(7)));
    let expected = [
        ("starvation.fair_server", Unreadable),
        ("firmware.smi", Unreadable),
        ("firmware.latency", Unreadable),
    ];
    assert_eq!(left, expected);
}

/// Two values for one key would replace one another; whoever wrote the first has to say which is meant.
#[test]
fn a_key_that_is_booted_with_another_value_is_left_to_people() {
    let other = "=== /proc/cmdline\nquiet isolcpus=managed_irq,domain,2\n";
    let script = plan_of(&load_with("debian-laptop", other), 7);
    let by_hand = "# by hand, isolcpus=managed_irq,domain,7: keep other programs off the CPU; it is booted with \
                   \"managed_irq,domain,2\" there now: change that where it stands\n";
    assert!(script.contains(by_hand), "{script}");
    assert!(!commands_and_files(&script).contains("isolcpus"), "{script}");
    assert!(commands_and_files(&script).contains("nohz_full=7"));
}

fn commands_and_files(script: &str) -> String {
    script.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect()
}

/// One remedy at a time: each mends its own finding.
#[test]
fn each_setting_mends_its_own_finding() {
    let cases = [
        ("interference.thp", "=== /sys/kernel/mm/transparent_hugepage/enabled\n[always] madvise never\n"),
        ("interference.ksm", "=== /sys/kernel/mm/ksm/run\n1\n"),
        ("interference.numa_balancing", "=== /proc/sys/kernel/numa_balancing\n1\n"),
        ("memory.compaction", "=== /proc/sys/vm/compact_unevictable_allowed\n1\n"),
        ("interference.workqueues", "=== /sys/devices/virtual/workqueue/cpumask\nf\n"),
        ("interference.default_smp_affinity", "=== /proc/irq/default_smp_affinity\nf\n"),
        (
            "interference.watchdogs",
            "=== /proc/sys/kernel/watchdog\n1\n=== /proc/sys/kernel/watchdog_cpumask\n0-3\n",
        ),
        (
            "interference.irq_affinity",
            "=== /proc/irq/9/smp_affinity_list\n0-3\n=== /proc/irq/9/effective_affinity_list\n3\n",
        ),
        ("starvation.rt_throttling", "=== /proc/sys/kernel/sched_rt_runtime_us\n950000\n"),
        ("starvation.fair_server", "=== /sys/kernel/debug/sched/fair_server/cpu3/runtime\n50000000\n"),
        ("power.governor", "=== /sys/devices/system/cpu/cpu3/cpufreq/scaling_governor\npowersave\n"),
        ("power.epp", "=== /sys/devices/system/cpu/cpu3/cpufreq/energy_performance_preference\npower\n"),
        ("power.pcie_aspm", "=== /sys/module/pcie_aspm/parameters/policy\n[default] performance powersave\n"),
        ("power.gpu", "=== /sys/class/drm/card0/device/power/control\nauto\n"),
        (
            "kernel.isolcpus",
            "=== /proc/cmdline\nnohz_full=3 rcu_nocbs=3 irqaffinity=0-2\n=== /sys/devices/system/cpu/isolated\n\n",
        ),
        (
            "kernel.nohz_full",
            "=== /proc/cmdline\nisolcpus=managed_irq,domain,3 rcu_nocbs=3 irqaffinity=0-2\n=== /sys/devices/system/cpu/nohz_full\n(null)\n",
        ),
        (
            "kernel.rcu_nocbs",
            "=== /proc/cmdline\nisolcpus=managed_irq,domain,3\n=== /sys/devices/system/cpu/nohz_full\n(null)\n",
        ),
        ("memory.swap", "=== /proc/swaps\nFilename Type\n/dev/sda3 partition\n"),
    ];
    for (id, changes) in cases {
        let mut machine = load_with("lab-rt", changes);
        let before = complaints(&examine(&machine, &spec(3)));
        assert!(before.iter().any(|(found, _)| *found == id), "{id}: {before:?}");
        let script = plan_of(&machine, 3);
        apply(&mut machine, &script, 4);
        assert_eq!(complaints(&examine(&machine, &spec(3))), [], "{id}");
    }
}
