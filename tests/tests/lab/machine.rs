//! What is set on the machine at boot: the root scripts on a made-up /sys and /proc, and the udev rules.

use patience::prelude::*;
use rt_core::read_back::{ReadBack, Writers};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::process::Command;
use system_tests::lab::{Lab, sources, succeed, tool};
use system_tests::programs::said;

const IRQ: &str = "/proc/irq/24/smp_affinity";
const DEFAULT_IRQ: &str = "/proc/irq/default_smp_affinity";
const WORKQUEUE: &str = "/sys/devices/virtual/workqueue/cpumask";
const THP: &str = "/sys/kernel/mm/transparent_hugepage/enabled";

/// A machine of four CPUs whose last is the loop's.
fn machine() -> Lab {
    let lab = Lab::bare();
    for cpu in 0..4 {
        lab.write(&fair_server(cpu), "50000000\n");
        lab.write(&governor(cpu), "powersave\n");
        lab.write(
            &format!("/sys/devices/system/cpu/cpu{cpu}/cpufreq/energy_performance_preference"),
            "power\n",
        );
    }
    lab.write(IRQ, "f\n");
    lab.write("/proc/irq/25/smp_affinity", "3\n");
    lab.write("/proc/irq/26/smp_affinity", "8\n");
    lab.write(DEFAULT_IRQ, "f\n");
    lab.write(WORKQUEUE, "0000000f\n");
    lab.write("/sys/devices/virtual/workqueue/writeback/cpumask", "0000000f\n");
    lab.write("/sys/devices/virtual/workqueue/last/cpumask", "00000008\n");
    lab.write(THP, "always [madvise] never\n");
    lab.write("/etc/phantom3/machine.conf", "# the last one\nLOOP_CPU=3\nFAST_CPU=\n");
    lab
}

fn fair_server(cpu: usize) -> String {
    format!("/sys/kernel/debug/sched/fair_server/cpu{cpu}/runtime")
}

fn governor(cpu: usize) -> String {
    format!("/sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor")
}

fn script(lab: &Lab, arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command.arg(sources().join("libexec/phantom3-machine")).arg("--root").arg(lab.path("/"));
    command.arg("--conf").arg(lab.path("/etc/phantom3/machine.conf"));
    command.arg("--state").arg(lab.path("/run/phantom3-machine")).args(arguments);
    command
}

fn run(lab: &Lab, arguments: &[&str]) -> String {
    succeed(&mut script(lab, arguments))
}

/// The kernel's files; those of the script itself lie elsewhere.
fn kernel_files(lab: &Lab) -> BTreeMap<String, Vec<u8>> {
    lab.files("/sys").into_iter().chain(lab.files("/proc")).collect()
}

/// The paths in the lines of that word.
fn paths_told(said: &str, word: &str) -> BTreeSet<String> {
    let lines = said.lines().filter_map(|line| line.strip_prefix(word));
    lines.map(|rest| rest.trim().split(':').next().expect("a path").to_owned()).collect()
}

#[test]
fn exactly_what_it_says_is_changed_and_undone() {
    let lab = machine();
    let before = kernel_files(&lab);
    let said = run(&lab, &["apply"]);
    let after = kernel_files(&lab);
    let changed: BTreeSet<String> =
        before.keys().filter(|path| before[*path] != after[*path]).cloned().collect();
    assert_eq!(before.len(), after.len());
    assert_eq!(paths_told(&said, "set "), changed, "{said}");
    assert!(said.contains("9 set, 0 could not be set"), "{said}");

    let expected = [
        (fair_server(3), "0\n"),
        (governor(3), "performance\n"),
        (governor(2), "powersave\n"),
        (IRQ.into(), "7\n"),
        // Away from the loop's CPU already.
        ("/proc/irq/25/smp_affinity".into(), "3\n"),
        // Of the loop's CPU alone: to those that interrupts go to by default.
        ("/proc/irq/26/smp_affinity".into(), "7\n"),
        // Not for interrupts alone; nobody else could serve it.
        ("/sys/devices/virtual/workqueue/last/cpumask".into(), "00000008\n"),
        (DEFAULT_IRQ.into(), "7\n"),
        (WORKQUEUE.into(), "00000007\n"),
        (THP.into(), "never\n"),
    ];
    for (path, text) in expected {
        assert_eq!(lab.read(&path), text, "{path}");
    }

    let undone = run(&lab, &["undo"]);
    assert_eq!(paths_told(&undone, "set "), changed, "{undone}");
    assert_eq!(lab.read(THP), "madvise\n", "the kernel would show it among the others again");
    lab.write(THP, "always [madvise] never\n");
    assert_eq!(kernel_files(&lab), before);
    assert_eq!(run(&lab, &["undo"]).lines().next(), Some("nothing to undo"));
}

#[test]
fn what_was_set_is_read_back_and_published_for_everybody() {
    const PUBLISHED: &str = "/run/phantom3-machine/read-back";
    let lab = machine();
    let refusing = lab.path(governor(3));
    fs::remove_file(&refusing).expect("ours");
    symlink("/proc/version", &refusing).expect("a link");
    run(&lab, &["apply"]);
    // As the driver and the doctor read it, on a machine where root wrote it.
    let root = Writers { uid: 0, mode: 0o755 };
    let told = ReadBack::believed(root, root, lab.read(PUBLISHED)).expect("root's");
    assert_eq!(told.value(&fair_server(3)), Some("0"));
    assert_eq!(told.value(IRQ), Some("7"));
    assert!(told.was_refused(&governor(3)) && !told.was_refused(IRQ));
    assert_eq!(told.value(&fair_server(2)), None, "another CPU's is not set");
    for (path, mode) in [(PUBLISHED, 0o644), ("/run/phantom3-machine", 0o755)] {
        let found = fs::metadata(lab.path(path)).expect("there").permissions().mode() & 0o777;
        assert_eq!(found, mode, "{path}");
    }
    // Once more: what is as it should be is told as well, and nothing twice.
    let before = lab.read(PUBLISHED);
    run(&lab, &["apply"]);
    let sorted = |text: &str| text.lines().map(str::to_owned).collect::<BTreeSet<_>>();
    assert!(sorted(&before).is_superset(&sorted(&lab.read(PUBLISHED))));
    assert!(lab.read(PUBLISHED).contains(&format!("set {} 0\n", fair_server(3))));
    run(&lab, &["undo"]);
    assert!(!lab.path(PUBLISHED).exists(), "what is undone is told no longer");
}

#[test]
fn a_dry_run_says_the_same_and_changes_nothing() {
    let lab = machine();
    let before = lab.files("/");
    let would = run(&lab, &["--dry-run", "apply"]);
    assert_eq!(lab.files("/"), before, "not even a directory for former values");
    let said = run(&lab, &["apply"]);
    assert_eq!(paths_told(&would, "would set "), paths_told(&said, "set "));
    let applied = lab.files("/");
    let would_undo = run(&lab, &["--dry-run", "undo"]);
    assert_eq!(lab.files("/"), applied);
    assert_eq!(paths_told(&would_undo, "would set "), paths_told(&said, "set "));
}

#[test]
fn applying_twice_still_brings_back_the_first_values() {
    let lab = machine();
    run(&lab, &["apply"]);
    // Somebody moves an interrupt back in between.
    lab.write(IRQ, "8\n");
    lab.write(DEFAULT_IRQ, "e\n");
    run(&lab, &["apply"]);
    assert_eq!(lab.read(DEFAULT_IRQ), "6\n");
    run(&lab, &["undo"]);
    assert_eq!((lab.read(IRQ), lab.read(DEFAULT_IRQ)), ("f\n".into(), "f\n".into()));
}

#[test]
fn what_the_kernel_refuses_or_does_not_have_is_told_and_no_failure() {
    let lab = machine();
    let refusing = lab.path(governor(3));
    fs::remove_file(&refusing).expect("ours");
    // A file of the real kernel that nobody can write, root included.
    symlink("/proc/version", &refusing).expect("a link");
    fs::remove_file(lab.path(fair_server(3))).expect("ours");
    let said = run(&lab, &["apply"]);
    // What it says to whoever writes to it, in the words of the system.
    let line = format!("COULD NOT set {} to performance: Input/output error\n", governor(3));
    assert!(said.contains(&line), "{said}");
    assert!(said.contains(&format!("absent   {}", fair_server(3))), "{said}");
    assert!(said.contains("7 set, 1 could not be set"), "{said}");
    assert_eq!(lab.read(IRQ), "7\n", "the rest is done all the same");
}

#[test]
fn masks_of_large_machines_keep_their_commas() {
    let cases = [
        ("ffffffff,ffffffff", 33, "fffffffd,ffffffff"),
        ("ffffffff,ffffffff", 31, "ffffffff,7fffffff"),
        ("00000001,00000002", 32, "00000000,00000002"),
        ("ff", 7, "7f"),
        ("ff", 9, "ff"),
    ];
    for (mask, cpu, expected) in cases {
        let lab = machine();
        fs::create_dir_all(lab.path(format!("/sys/devices/system/cpu/cpu{cpu}"))).expect("a directory");
        lab.write("/etc/phantom3/machine.conf", &format!("LOOP_CPU={cpu}\n"));
        lab.write(IRQ, &format!("{mask}\n"));
        run(&lab, &["apply"]);
        assert_eq!(lab.read(IRQ), format!("{expected}\n"), "{mask} without CPU {cpu}");
    }
}

#[test]
fn both_loops_cpus_are_kept_free_at_boot_and_at_run_time() {
    let lab = machine();
    assert_eq!(
        run(&lab, &["kernel-arguments"]),
        "isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0,1,2\n"
    );
    lab.write("/etc/phantom3/machine.conf", "LOOP_CPU=3\nFAST_CPU=2\n");
    assert_eq!(
        run(&lab, &["kernel-arguments"]),
        "isolcpus=managed_irq,domain,2,3 nohz_full=2,3 rcu_nocbs=2,3 irqaffinity=0,1\n"
    );
    run(&lab, &["apply"]);
    assert_eq!((lab.read(IRQ).as_str(), lab.read(&fair_server(2)).as_str()), ("3\n", "0\n"));
}

#[test]
fn a_configuration_that_does_not_fit_the_machine_changes_nothing() {
    let lab = machine();
    let witness = lab.path("/witness");
    let inject = format!("LOOP_CPU=$(touch {})\n", witness.display());
    for text in
        ["LOOP_CPU=0\n", "LOOP_CPU=4\n", "LOOP_CPU=\n", "", "LOOP_CPU=3\nFAST_CPU=x\n", inject.as_str()]
    {
        lab.write("/etc/phantom3/machine.conf", text);
        let before = lab.files("/");
        let (status, out, err) = said(&script(&lab, &["apply"]).bounded_output().expect("it runs"));
        assert_eq!((status, out.as_str()), (Some(2), ""), "{text}");
        assert!(err.contains("machine.conf: ") && err.contains("allowed: the number of a CPU"), "{err}");
        assert!(err.contains("(0,1,2,3)"), "{err}");
        assert_eq!(lab.files("/"), before);
    }
    assert!(!witness.exists(), "it is read, not executed");
}

#[test]
fn the_boot_line_gets_the_arguments_or_stays_as_it_is() {
    let lab = machine();
    let program = sources().join("libexec/phantom3-machine").display().to_string();
    let options = format!(
        "sh {program} --root {} --conf {}",
        lab.path("/").display(),
        lab.path("/etc/phantom3/machine.conf").display()
    );
    let dropin = fs::read_to_string(sources().join("grub.d/phantom3.cfg")).expect("there");
    let dropin = dropin.replace("/usr/local/libexec/phantom3/phantom3-machine", &options);
    // As grub-mkconfig does it: sourced by a shell that ends on any failure.
    let boot_line = || {
        let text = format!("set -e\nGRUB_CMDLINE_LINUX=\"quiet\"\n{dropin}\necho \"$GRUB_CMDLINE_LINUX\"\n");
        let output = Command::new("sh").args(["-c", &text]).bounded_output().expect("it runs");
        let (status, out, _) = said(&output);
        assert_eq!(status, Some(0));
        out
    };
    assert_eq!(
        boot_line(),
        "quiet isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0,1,2\n"
    );
    lab.write("/etc/phantom3/machine.conf", "LOOP_CPU=9\n");
    assert_eq!(boot_line(), "quiet\n");
}

/// A card at its bus address, with the kernel driver that holds it.
fn card(lab: &Lab, driver: &str) -> (String, Command) {
    let directory = "/sys/bus/pci/devices/0000:03:00.0".to_owned();
    lab.write(&format!("{directory}/enable"), "0\n");
    for file in ["config", "resource0", "resource2", "resource3"] {
        lab.write(&format!("{directory}/{file}"), "");
        fs::set_permissions(lab.path(format!("{directory}/{file}")), fs::Permissions::from_mode(0o600))
            .expect("ours");
    }
    lab.write(&format!("/sys/bus/pci/drivers/{driver}/unbind"), "");
    symlink(format!("../../drivers/{driver}"), lab.path(format!("{directory}/driver"))).expect("a link");
    let group = fs::metadata(lab.path("/")).expect("ours").gid().to_string();
    let mut command = Command::new("sh");
    command.arg(sources().join("libexec/phantom3-card")).args(["--group", &group]).arg("--root");
    command.arg(lab.path("/"));
    (directory, command)
}

#[test]
fn a_card_is_taken_from_the_kernels_driver_enabled_and_given_to_the_group() {
    let lab = Lab::bare();
    let (directory, mut command) = card(&lab, "phantom");
    succeed(command.arg("0000:03:00.0"));
    assert_eq!(lab.read("/sys/bus/pci/drivers/phantom/unbind"), "0000:03:00.0\n");
    assert_eq!(lab.read(&format!("{directory}/enable")), "1\n");
    let mode = |file: &str| {
        fs::metadata(lab.path(format!("{directory}/{file}"))).expect("ours").permissions().mode() & 0o777
    };
    assert_eq!(["resource0", "resource2", "resource3"].map(mode), [0o660; 3]);
    assert_eq!(mode("config"), 0o600, "only the registers are handed over");
}

#[test]
fn a_card_of_another_driver_stays_its_own_and_a_dry_run_changes_nothing() {
    let lab = Lab::bare();
    let (_, mut command) = card(&lab, "vfio-pci");
    let before = lab.files("/");
    let said = succeed(command.args(["--dry-run", "0000:03:00.0"]));
    assert!(said.contains("would enable 0000:03:00.0") && !said.contains("take"), "{said}");
    assert_eq!(lab.files("/"), before);
    let (_, mut command) = card(&Lab::bare(), "phantom");
    assert_eq!(said_status(command.arg("../../../etc")), Some(2));
    let (_, mut command) = card(&Lab::bare(), "phantom");
    assert_eq!(said_status(command.arg("0000:09:00.0")), Some(2), "no such card");
}

fn said_status(command: &mut Command) -> Option<i32> {
    said(&command.bounded_output().expect("it runs")).0
}

// --- udev -------------------------------------------------------------------------------------------------

/// A rule: what has to be so, and what is done then.
#[derive(Debug, Default)]
struct Rule {
    matches: Vec<(String, bool, String)>,
    assignments: Vec<(String, String)>,
}

/// Reads rules by udev's grammar, as far as ours use it: KEY OPERATOR "VALUE", comma, ...
fn rules() -> Vec<Rule> {
    let text = fs::read_to_string(sources().join("udev/70-phantom3.rules")).expect("there");
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.map(rule).collect()
}

fn rule(line: &str) -> Rule {
    let mut rule = Rule::default();
    let mut rest = line;
    while !rest.is_empty() {
        let operator_at = rest.find(['=', '!', '+', ':']).unwrap_or_else(|| panic!("no operator: {rest}"));
        let (key, tail) = rest.split_at(operator_at);
        let (operator, tail) = tail.split_at(tail.find('"').expect("a value in quotes"));
        let (value, tail) = tail[1..].split_once('"').expect("the quotes end");
        let known = ["ACTION", "SUBSYSTEM", "KERNEL", "GOTO", "LABEL", "RUN", "GROUP", "MODE"];
        assert!(known.contains(&key) || key.starts_with("ATTR{") && key.ends_with('}'), "{key}");
        match operator {
            "==" | "!=" => rule.matches.push((key.into(), operator == "==", value.into())),
            "=" | "+=" => rule.assignments.push((key.into(), value.into())),
            other => panic!("{other} in {line}"),
        }
        rest = tail.strip_prefix(", ").unwrap_or(tail);
        assert!(
            tail.is_empty() || tail.starts_with(", "),
            "between two parts of a rule stands a comma: {line}"
        );
    }
    rule
}

/// What is done for a device; alternatives are separated by `|`.
fn done_for(device: &[(&str, &str)]) -> Vec<(String, String)> {
    let mut done = Vec::new();
    let rules = rules();
    let mut at = 0;
    while at < rules.len() {
        let rule = &rules[at];
        at += 1;
        let holds = |(key, wanted, value): &(String, bool, String)| {
            let found = device.iter().find(|(name, _)| name == key).map_or("", |(_, value)| value);
            value.split('|').any(|alternative| alternative == found) == *wanted
        };
        if !rule.matches.iter().all(holds) {
            continue;
        }
        for (key, value) in &rule.assignments {
            if key == "GOTO" {
                let label = |rule: &Rule| rule.assignments.contains(&("LABEL".into(), value.clone()));
                at = rules.iter().position(label).expect("the label is there");
            } else if key != "LABEL" {
                done.push((key.clone(), value.clone()));
            }
        }
    }
    done
}

#[test]
fn the_cards_are_known_by_their_numbers_and_no_others() {
    let card = |action: &'static str, ids: [&'static str; 4]| {
        let [vendor, device, subsystem_vendor, subsystem_device] = ids;
        done_for(&[
            ("ACTION", action),
            ("SUBSYSTEM", "pci"),
            ("ATTR{vendor}", vendor),
            ("ATTR{device}", device),
            ("ATTR{subsystem_vendor}", subsystem_vendor),
            ("ATTR{subsystem_device}", subsystem_device),
        ])
    };
    let hand_over = [("RUN".to_owned(), "/usr/local/libexec/phantom3/phantom3-card $kernel".to_owned())];
    let phantom = ["0x10b5", "0x9050", "0x10b5", "0x9050"];
    assert_eq!(card("add", phantom), hand_over);
    // The kernel's driver may come later than the card.
    assert_eq!(card("bind", phantom), hand_over);
    for mesa in ["0x5124", "0x5125", "0x5925", "0x6125", "0x6925"] {
        assert_eq!(card("add", ["0x2718", mesa, "0x2718", mesa]), hand_over, "{mesa}");
    }
    assert!(card("remove", phantom).is_empty());
    assert!(card("unbind", phantom).is_empty());
    // A PLX 9050 on somebody else's board, another chip of the vendor, another Mesa card.
    for other in [
        ["0x10b5", "0x9050", "0x1234", "0x0001"],
        ["0x10b5", "0x9050", "0x1234", "0x9050"],
        ["0x10b5", "0x9050", "0x10b5", "0x1067"],
        ["0x10b5", "0x9054", "0x10b5", "0x9050"],
        ["0x2718", "0x9050", "0x10b5", "0x9050"],
        ["0x2718", "0x5126", "0x2718", "0x5126"],
    ] {
        assert!(card("add", other).is_empty(), "{other:?}");
    }
}

#[test]
fn the_group_may_keep_the_cpus_awake() {
    let done = done_for(&[("ACTION", "add"), ("SUBSYSTEM", "misc"), ("KERNEL", "cpu_dma_latency")]);
    let expected = [("GROUP", "phantom3"), ("MODE", "0660")];
    assert_eq!(done, expected.map(|(key, value)| (key.to_owned(), value.to_owned())));
    assert!(done_for(&[("ACTION", "add"), ("SUBSYSTEM", "misc"), ("KERNEL", "vga_arbiter")]).is_empty());
}

#[test]
fn udev_itself_finds_the_rules_well_formed() {
    let Some(mut udevadm) = tool("udevadm", "the rules are read by a grammar of our own here") else {
        return;
    };
    // Known since version 254.
    let knows =
        Command::new("udevadm").args(["verify", "--help"]).bounded_output().is_ok_and(|o| o.status.success());
    if !knows {
        println!("skipped: this udevadm cannot verify; the rules are read by a grammar of our own here");
        return;
    }
    // The group's name is resolved only where the user was made.
    let arguments = ["verify", "--resolve-names=never"];
    let output = udevadm
        .args(arguments)
        .arg(sources().join("udev/70-phantom3.rules"))
        .bounded_output()
        .expect("it runs");
    assert!(output.status.success(), "{output:?}");
}
