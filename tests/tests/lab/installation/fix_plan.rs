//! The doctor's fix plan on a machine that `install.sh` has set up: it adds, and takes nothing away.

use io_driver::doctor::plan_names;
use patience::prelude::*;
use rt_core::doctor::machine::{LoopSpec, Machine};
use rt_core::doctor::recorded::RecordedMachine;
use rt_core::doctor::{self, plan};
use rt_core::installed;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use system_tests::lab::{Lab, PREFIX, sources, succeed};

/// What a plan calls besides the shell's own tools; here they do nothing.
const STAND_INS: [&str; 11] = [
    "update-grub",
    "sysctl",
    "systemctl",
    "systemd-tmpfiles",
    "swapoff",
    "udevadm",
    "getent",
    "groupadd",
    "usermod",
    "modprobe",
    "tuned-adm",
];

const CPU: usize = 7;

/// A laptop of eight CPUs on which the installer has put everything, and nothing is in force yet.
fn installed_laptop() -> Lab {
    let lab = Lab::bare();
    lab.install(&["--cpu", "7"]);
    for cpu in 0..8 {
        fs::create_dir_all(lab.path(format!("/sys/devices/system/cpu/cpu{cpu}"))).expect("a directory");
    }
    lab
}

/// The plan of the recorded laptop with what lies below the lab's `/etc`, and with changes.
fn plan_on(lab: &Lab, changes: &str) -> String {
    let project = sources().join("../..");
    let recorded = project.join("rt-core/tests/machines/debian-laptop.txt");
    let mut text = fs::read_to_string(recorded).expect("there");
    for (path, content) in lab.files("/") {
        if path.starts_with("/etc/") && lab.path(&path).is_file() {
            text += &format!("=== {path}\n{}", String::from_utf8(content).expect("text"));
        }
    }
    let machine: RecordedMachine = (text + changes).parse().expect("a good record");
    let spec = LoopSpec { cpu: CPU, priority: Some(80), period_ns: 1_000_000, phase_offset_ns: 370_000 };
    let machine = Machine { tree: &machine, probes: &machine, spec: &spec };
    plan::script(&machine, &doctor::examine(&machine), &plan_names())
}

/// Runs a plan on the lab's files.
fn run(lab: &Lab, script: &str) -> String {
    let stand_ins = tempfile::tempdir().expect("a directory");
    for name in STAND_INS.iter().copied().chain(["id"]) {
        let path = stand_ins.path().join(name);
        let says = if name == "id" { "echo 0" } else { "" };
        fs::write(&path, format!("#!/bin/sh\n{says}\n")).expect("a file");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("ours");
    }
    let root = lab.path("/").display().to_string();
    let root = root.trim_end_matches('/');
    // Commands and redirections; what lies inside of files stays as it is.
    let script = script.replace(" /etc/", &format!(" {root}/etc/"));
    let script: String =
        script.lines().filter(|line| !line.starts_with("put ")).map(|line| format!("{line}\n")).collect();
    let path = format!("{}:/usr/bin:/bin", stand_ins.path().display());
    succeed(Command::new("sh").args(["-c", &script]).env("PATH", path))
}

/// The boot line as grub-mkconfig makes it: each file of defaults sourced in the order of the names.
fn boot_line(lab: &Lab) -> String {
    let program = format!(
        "sh {} --root {} --conf {}",
        lab.path(format!("{PREFIX}/libexec/phantom3/phantom3-machine")).display(),
        lab.path("/").display(),
        lab.path(installed::MACHINE_CONF).display()
    );
    let mut text = "set -e\nGRUB_CMDLINE_LINUX_DEFAULT=quiet\nGRUB_CMDLINE_LINUX=\n".to_owned();
    for (path, content) in lab.files("/etc/default/grub.d") {
        assert!(path.ends_with(".cfg"), "{path}");
        text += &String::from_utf8(content).expect("text");
    }
    let text = text.replace(&format!("{PREFIX}/libexec/phantom3/phantom3-machine"), &program);
    let text = text + "echo \"$GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT\"\n";
    succeed(Command::new("sh").args(["-c", &text])).trim().to_owned()
}

fn count(line: &str, key: &str) -> usize {
    line.split(' ').filter(|word| word.split('=').next() == Some(key)).count()
}

fn unchanged(lab: &Lab, before: &BTreeMap<String, Vec<u8>>) {
    let after = lab.files("/");
    for (path, content) in before {
        assert_eq!(after.get(path), Some(content), "{path} is another");
    }
}

#[test]
fn a_plan_after_the_installation_changes_none_of_its_files_and_keeps_the_isolation() {
    let lab = installed_laptop();
    let isolated = "isolcpus=managed_irq,domain,7 nohz_full=7 rcu_nocbs=7 irqaffinity=0,1,2,3,4,5,6";
    assert_eq!(boot_line(&lab), format!("{isolated} quiet"));
    let before = lab.files("/");
    run(&lab, &plan_on(&lab, ""));
    unchanged(&lab, &before);
    let line = boot_line(&lab);
    assert!(line.starts_with(isolated), "{line}");
    for key in ["isolcpus", "nohz_full", "rcu_nocbs", "irqaffinity", "pcie_aspm.policy"] {
        assert_eq!(count(&line, key), 1, "{key} in {line}");
    }
    // Both take themselves away and nothing else.
    assert!(lab.install(&[]).contains("everything is in its place already"));
    lab.install(&["--uninstall"]);
    let left: Vec<String> = lab.files("/etc").into_keys().filter(|path| lab.path(path).is_file()).collect();
    assert!(!left.is_empty() && left.iter().all(|path| path.contains("phantom3-plan")), "{left:?}");
}

#[test]
fn what_the_installation_says_already_is_not_said_twice() {
    let lab = installed_laptop();
    let script = plan_on(&lab, "");
    for said in [
        "/etc/sysctl.d/70-phantom3.conf says so already: kernel.sched_rt_runtime_us = -1",
        "/etc/security/limits.d/phantom3.conf says so already: @phantom3 - rtprio 95",
        "/etc/security/limits.d/phantom3.conf says so already: @phantom3 - memlock unlimited",
        "/etc/udev/rules.d/70-phantom3.rules says so already: SUBSYSTEM==\"misc\", KERNEL==\"cpu_dma_latency\"",
    ] {
        assert!(script.contains(said), "{said}: {script}");
    }
    assert!(!script.contains("phantom3-driver.service.d"), "its unit has these rights: {script}");
    assert!(script.contains("\nsystemctl restart phantom3-machine.service\n"), "{script}");
    for path in ["scaling_governor", "fair_server", "smp_affinity", "transparent_hugepage"] {
        assert!(
            !script.lines().any(|line| line.starts_with("put ") && line.contains(path)),
            "{path}: {script}"
        );
    }
}

/// What the first plan added must not be lost with the second, which finds less to do.
#[test]
fn a_second_plan_adds_to_the_first() {
    let lab = Lab::bare();
    let swap_off = "=== /proc/swaps\nFilename Type Size Used Priority\n";
    run(&lab, &plan_on(&lab, swap_off));
    let first = lab.files("/etc");
    assert!(count(&boot_line(&lab), "isolcpus") == 1, "{first:?}");
    let later = "=== /sys/devices/system/cpu/isolated\n7\n=== /proc/sys/kernel/sched_rt_runtime_us\n-1\n\
                 === /proc/sys/kernel/numa_balancing\n1\n";
    run(&lab, &plan_on(&lab, &format!("{swap_off}{later}")));
    assert_eq!(count(&boot_line(&lab), "isolcpus"), 1);
    let sysctl = lab.read("/etc/sysctl.d/90-phantom3-plan.conf");
    for line in ["kernel.sched_rt_runtime_us = -1\n", "kernel.numa_balancing = 0\n"] {
        assert_eq!(sysctl.matches(line).count(), 1, "{sysctl}");
    }
    // The same once more changes nothing.
    let before = lab.files("/");
    run(&lab, &plan_on(&lab, &format!("{swap_off}{later}")));
    assert_eq!(before, lab.files("/"));
}

#[test]
fn a_file_of_the_plans_name_that_somebody_else_made_is_left_alone() {
    let lab = Lab::bare();
    let path = "/etc/sysctl.d/90-phantom3-plan.conf";
    lab.write(path, "# mine\nkernel.panic = 10\n");
    let script = plan_on(&lab, "");
    let output = {
        let script = script.replace(" /etc/", &format!(" {}/etc/", lab.path("/").display()));
        let functions = script.split("\n# == ").next().expect("a beginning").replace("set -eu", "set -u");
        let functions: String = functions
            .lines()
            .filter(|line| !line.contains("id -u"))
            .map(|line| format!("{line}\n"))
            .collect();
        let call = format!("add {} <<'END'\nkernel.watchdog = 0\nEND\n", lab.path(path).display());
        Command::new("sh").args(["-c", &(functions + &call)]).bounded_output().expect("it runs")
    };
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && err.contains("left alone, no fix plan made it"), "{err}");
    assert_eq!(lab.read(path), "# mine\nkernel.panic = 10\n");
}

/// One name for each thing, wherever it is told.
#[test]
fn programs_and_installed_files_agree_on_their_names() {
    let lab = Lab::bare();
    lab.install(&["--cpu", "7"]);
    for path in [
        format!("{}/{}", installed::UNITS, installed::MACHINE_UNIT),
        format!("{}/{}", installed::UNITS, installed::DRIVER_UNIT),
        installed::MACHINE_CONF.to_owned(),
    ] {
        assert!(lab.path(&path).is_file(), "{path} is not installed");
    }
    let has_line = |path: &str, line: &str| lab.read(path).lines().any(|found| found == line);
    let unit = |name: &str| format!("{}/{name}", installed::UNITS);
    assert!(has_line(&unit(installed::DRIVER_UNIT), &format!("Group={}", installed::GROUP)));
    assert!(has_line("/etc/udev/rules.d/70-phantom3.rules", installed::LATENCY_RULE));
    // systemd makes these below /run.
    let runtime =
        |path: &'static str| Path::new(path).strip_prefix("/run").expect("below /run").display().to_string();
    let directory = format!("RuntimeDirectory={}", runtime(installed::RUNTIME_DIRECTORY));
    assert!(has_line(&unit(installed::DRIVER_UNIT), &directory));
    let state = Path::new(installed::READ_BACK).parent().expect("a directory").display().to_string();
    let name = state.strip_prefix("/run/").expect("below /run").to_owned();
    assert!(has_line(&unit(installed::MACHINE_UNIT), &format!("RuntimeDirectory={name}")));
    let script = lab.read(&format!("{PREFIX}/libexec/phantom3/phantom3-machine"));
    assert!(script.contains(&format!("\nstate={state}\n")) && script.contains("\"$state/read-back\""));
}
