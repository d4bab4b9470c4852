//! Settings of the running kernel, now and after each boot: sysctl, files of sysfs, services, swap.
//!
//! Where TuneD runs, it would take back what others set below `/sys`, so a profile of its own, on top of the one that is
//! active, carries these. What stands in sysctl.d it sets itself, after its own (`reapply_sysctl`, on by default).

use super::super::machine::Machine;
use super::super::step::{Action, Step};
use super::{PlanNames, Script, has_systemd, is_plain, quoted};

pub(super) fn write(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let has_tuned = has_tuned(machine);
    services(script, machine, steps);
    sysctl(script, machine, steps, names);
    puts(script, steps);
    if has_tuned {
        tuned(script, machine, steps, names);
    }
    lasting_puts(script, machine, steps, names);
    modules(script, steps);
}

fn services(script: &mut Script, machine: &Machine<'_>, steps: &[Step]) {
    for step in steps {
        match &step.action {
            Action::Stop { unit } if !has_systemd(machine) => {
                script.section(&format!("Service {unit}"));
                script.comment(&format!(
                    "This machine does not run systemd. {}: stop it your own way.",
                    step.what
                ));
            }
            Action::Stop { unit } => {
                script.section(&format!("Service {unit}"));
                script.explain(&step.what, &format!("systemctl enable --now {unit}"));
                script.line(&format!("systemctl disable --now {unit}"));
            }
            Action::SwapOff => {
                script.section("Swap");
                script.explain(&step.what, "swapon -a");
                script.comment("To keep it off, put a # before the swap lines of /etc/fstab.");
                script.line("swapoff -a");
            }
            _ => {}
        }
    }
}

fn sysctl(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let settings: Vec<_> = steps.iter().filter_map(sysctl_of).collect();
    if settings.is_empty() {
        return;
    }
    script.section("Kernel parameters");
    for (what, key, value, former) in &settings {
        script.explain(&format!("{key}: {what}"), &format!("sysctl -w {key}={former}"));
        script.line(&format!("sysctl -w {}", quoted(&format!("{key}={value}"))));
    }
    let path = format!("/etc/sysctl.d/90-{}.conf", names.prefix);
    let lines: Vec<String> = settings.iter().map(|(_, key, value, _)| format!("{key} = {value}")).collect();
    script.lines_of_directory(machine, &path, &lines, "the same after each boot");
}

fn sysctl_of(step: &Step) -> Option<(&str, &str, &str, &str)> {
    match &step.action {
        Action::Sysctl { key, value, former } => Some((&step.what, key, value, former)),
        _ => None,
    }
}

/// One value for one file.
struct Put<'a> {
    what: &'a str,
    path: &'a str,
    value: &'a str,
    former: &'a str,
    lasting: bool,
}

/// Only those whose path and value need no quoting anywhere.
fn puts_of(steps: &[Step]) -> impl Iterator<Item = Put<'_>> {
    steps.iter().filter_map(|step| match &step.action {
        Action::Put { path, value, former, lasting } if is_plain(path) && is_plain(value) => {
            Some(Put { what: &step.what, path, value, former, lasting: *lasting })
        }
        _ => None,
    })
}

fn puts(script: &mut Script, steps: &[Step]) {
    if puts_of(steps).next().is_none() {
        return;
    }
    script.section("Settings of the running kernel");
    for put in puts_of(steps) {
        script.explain(put.what, &format!("put {} {}", put.former, put.path));
        script.line(&format!("put {} {}", put.value, put.path));
    }
}

fn lasting_puts(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let taken = |put: &Put<'_>| has_tuned(machine) && put.path.starts_with("/sys/");
    let puts: Vec<Put<'_>> = puts_of(steps).filter(|put| put.lasting && !taken(put)).collect();
    if puts.is_empty() {
        return;
    }
    if !has_systemd(machine) {
        script
            .comment("This machine does not run systemd: let whatever it runs at boot do the same, that is");
        puts.iter().for_each(|put| script.comment(&format!("echo {} > {}", put.value, put.path)));
        return;
    }
    let unit = format!("{}-settings.service", names.prefix);
    let path = format!("/etc/systemd/system/{unit}");
    script.explain("the same after each boot", &format!("systemctl disable {unit} && rm {path}"));
    script.file(&path, &unit_lines(&puts));
    script.line("systemctl daemon-reload");
    script.line(&format!("systemctl enable {unit}"));
}

/// A unit that writes all values once; one that is refused does not keep it from the others. What a later plan adds
/// goes to the end, so that the section of the values is the last.
fn unit_lines(puts: &[Put<'_>]) -> Vec<String> {
    let head = ["[Unit]", "Description=Settings for a real-time loop", "After=sys-kernel-debug.mount"];
    let install = ["[Install]", "WantedBy=multi-user.target"];
    let service = ["[Service]", "Type=oneshot"];
    let write = |put: &Put<'_>| format!("ExecStart=-/bin/sh -c 'echo {} > {}'", put.value, put.path);
    let texts = |lines: &[&str]| -> Vec<String> { lines.iter().map(|line| (*line).to_owned()).collect() };
    [texts(&head), texts(&install), texts(&service), puts.iter().map(write).collect()].concat()
}

fn has_tuned(machine: &Machine<'_>) -> bool {
    ["/usr/sbin/tuned-adm", "/usr/bin/tuned-adm"].iter().any(|path| machine.exists(path))
}

fn tuned(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let settings: Vec<String> = puts_of(steps)
        .filter(|put| put.lasting && put.path.starts_with("/sys/"))
        .map(|put| format!("{}={}", put.path, put.value))
        .collect();
    if settings.is_empty() {
        return;
    }
    let path = format!("/etc/tuned/{}/tuned.conf", names.prefix);
    let active = machine.line("/etc/tuned/active_profile").ok().filter(|name| is_plain(name));
    let active = active.unwrap_or_else(|| "balanced".to_owned());
    let mut lines = Vec::new();
    if !machine.exists(&path) {
        lines.extend(["[main]", "summary=Settings for a real-time loop"].map(str::to_owned));
        lines.extend([format!("include={active}"), "[sysfs]".to_owned()]);
    }
    lines.extend(settings);
    script.section("TuneD, which would take these settings back, keeps them on top of what it has");
    script.explain("a profile of its own", &format!("tuned-adm profile {active}"));
    script.file(&path, &lines);
    script.line(&format!("tuned-adm profile {}", names.prefix));
}

fn modules(script: &mut Script, steps: &[Step]) {
    for step in steps {
        if let Action::Module { name } = &step.action {
            script.section(&format!("Kernel module {name}"));
            script.explain(&step.what, &format!("rmmod {name}"));
            script.line(&format!("modprobe {name} || echo 'no module {name}' >&2"));
        }
    }
}
