//! What lets an ordinary user run the loop: a group, limits, udev rules, directories, cards set free.

use super::super::machine::Machine;
use super::super::step::{Action, Step};
use super::{PlanNames, Script, has_systemd, is_plain, quoted};
use crate::installed::{GROUP, UNITS};

pub(super) fn write(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let needs_group =
        |step: &Step| matches!(step.action, Action::Limits | Action::Udev { .. } | Action::Directory { .. });
    if steps.iter().any(needs_group) {
        group(script, machine);
    }
    if steps.iter().any(|step| step.action == Action::Limits) {
        limits(script, machine, names);
    }
    unbind(script, machine, steps, names);
    udev(script, machine, steps, names);
    directories(script, machine, steps, names);
}

/// Undone in full only where the plan makes it: a group that was there before is somebody else's.
fn group(script: &mut Script, machine: &Machine<'_>) {
    script.section("Group of those who may run the loop");
    if has_group(machine) {
        script.explain(
            "the group is there; makes whoever called sudo a member",
            &format!("gpasswd --delete NAME {GROUP}"),
        );
    } else {
        script.explain("makes the group, and whoever called sudo a member", &format!("groupdel {GROUP}"));
    }
    script.line(&format!("getent group {GROUP} >/dev/null || groupadd --system {GROUP}"));
    script.line(&format!("[ -z \"${{SUDO_USER:-}}\" ] || usermod -aG {GROUP} \"$SUDO_USER\""));
}

/// One that cannot be read may have it.
fn has_group(machine: &Machine<'_>) -> bool {
    let is_it = |line: &str| line.split(':').next() == Some(GROUP);
    match machine.text_if_any("/etc/group") {
        Ok(text) => text.is_some_and(|text| text.lines().any(is_it)),
        Err(_) => true,
    }
}

fn limits(script: &mut Script, machine: &Machine<'_>, names: &PlanNames) {
    let PlanNames { prefix, program, .. } = names;
    let path = format!("/etc/security/limits.d/90-{prefix}.conf");
    script.section("Rights: real-time priority and locked memory");
    let lines = [format!("@{GROUP} - rtprio 95"), format!("@{GROUP} - memlock unlimited")];
    script.lines_of_directory(machine, &path, &lines, "for members of the group, from their next login on");
    script.comment("Or, for the program whoever runs it, again after each build; undo: setcap -r PROGRAM:");
    script.comment(&format!("setcap cap_sys_nice,cap_ipc_lock=ep {}", quoted(program)));
    let units = machine.names(UNITS).unwrap_or_default();
    let is_ours = |unit: &&String| {
        unit.ends_with(".service")
            && names.unit_prefixes.iter().any(|prefix| unit.starts_with(prefix.as_str()))
    };
    let settings = ["LimitRTPRIO=95", "LimitMEMLOCK=infinity"];
    let has_rights = |unit: &str| {
        let text = machine.text(&format!("{UNITS}/{unit}")).unwrap_or_default();
        settings.iter().all(|setting| text.lines().any(|line| line.trim() == *setting))
    };
    for unit in units.iter().filter(is_ours).filter(|unit| is_plain(unit) && !has_rights(unit)) {
        let path = format!("{UNITS}/{unit}.d/{prefix}-rights.conf");
        script.explain(&format!("the same for {unit}"), &format!("rm {path}"));
        script.file(&path, &["[Service]", settings[0], settings[1]].map(str::to_owned));
        if has_systemd(machine) {
            script.line("systemctl daemon-reload");
        }
    }
}

fn unbind(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let bound: Vec<(&str, &str, &str)> = steps
        .iter()
        .filter_map(|step| match &step.action {
            Action::Unbind { address, driver } if is_plain(address) && is_plain(driver) => {
                Some((step.what.as_str(), address.as_str(), driver.as_str()))
            }
            _ => None,
        })
        .collect();
    let Some((_, _, first)) = bound.first() else { return };
    script.section("Cards that a kernel driver holds");
    for (what, address, driver) in &bound {
        script.explain(what, &format!("put {address} /sys/bus/pci/drivers/{driver}/bind"));
        script.line(&format!("put {address} /sys/bus/pci/drivers/{driver}/unbind"));
    }
    let mut drivers: Vec<&str> = bound.iter().map(|(_, _, driver)| *driver).collect();
    drivers.dedup();
    let path = format!("/etc/modprobe.d/{}.conf", names.prefix);
    script.comment(&format!("after undoing what follows: modprobe {first}"));
    let lines: Vec<String> = drivers.iter().map(|driver| format!("blacklist {driver}")).collect();
    script.lines_of_directory(machine, &path, &lines, "not loaded at the next boot");
}

fn udev(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let rules: Vec<(&str, &String)> = steps
        .iter()
        .filter_map(|step| match &step.action {
            Action::Udev { rule } => Some((step.what.as_str(), rule)),
            _ => None,
        })
        .collect();
    if rules.is_empty() {
        return;
    }
    let path = format!("/etc/udev/rules.d/70-{}.rules", names.prefix);
    script.section("Device files");
    rules.iter().for_each(|(what, _)| script.comment(what));
    let lines: Vec<String> = rules.iter().map(|(_, rule)| (*rule).clone()).collect();
    script.lines_of_directory(machine, &path, &lines, "rules for udev, read by udevadm control --reload");
    if !machine.exists("/run/udev") {
        script.comment("udev does not run here now; it will read the rules when it does.");
        return;
    }
    script.line("udevadm control --reload");
    // Of all devices only the kinds that the rules are about.
    let is_pci = |rule: &str| rule.contains("SUBSYSTEM==\"pci\"");
    if rules.iter().any(|(_, rule)| is_pci(rule)) {
        script.line("udevadm trigger --action=add --subsystem-match=pci");
    }
    if rules.iter().any(|(_, rule)| !is_pci(rule)) {
        script.line("udevadm trigger --action=add --subsystem-match=misc");
    }
}

fn directories(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let lines: Vec<String> = steps
        .iter()
        .filter_map(|step| match &step.action {
            Action::Directory { path, mode } if is_plain(path) => {
                Some(format!("d {path} {mode:04o} root {GROUP} -"))
            }
            _ => None,
        })
        .collect();
    if lines.is_empty() {
        return;
    }
    let path = format!("/etc/tmpfiles.d/{}.conf", names.prefix);
    script.section("Directories");
    if !has_systemd(machine) {
        script.comment("This machine does not run systemd: let whatever it runs at boot make, in the words of tmpfiles.d,");
        lines.iter().for_each(|line| script.comment(line));
        return;
    }
    script.explain("made at each boot", &format!("rm {path}"));
    script.file(&path, &lines);
    script.line(&format!("systemd-tmpfiles --create {}", quoted(&path)));
}
