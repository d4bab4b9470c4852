//! Settings that the installed unit makes at each boot: the plan restarts it instead of doing the same beside it.

use super::super::machine::{Machine, one_line};
use super::super::step::{Action, Step};
use super::{Script, has_systemd};
use crate::installed::{MACHINE_CONF, MACHINE_UNIT, UNITS};

/// Parts the steps into those that the installed unit does and the others.
pub(super) fn part(machine: &Machine<'_>, steps: Vec<Step>) -> (Vec<Step>, Vec<Step>) {
    let is_installed = has_systemd(machine) && machine.exists(&format!("{UNITS}/{MACHINE_UNIT}"));
    let serves = is_installed && keeps_free(machine, machine.spec.cpu);
    steps.into_iter().partition(|step| serves && is_set_by_unit(&step.action))
}

/// Whether `machine.conf` names this CPU.
fn keeps_free(machine: &Machine<'_>, cpu: usize) -> bool {
    let text = machine.text(MACHINE_CONF).unwrap_or_default();
    let number = |line: &str| -> Option<usize> {
        let value = line.strip_prefix("LOOP_CPU=").or_else(|| line.strip_prefix("FAST_CPU="))?;
        value.trim().parse().ok()
    };
    text.lines().filter_map(number).any(|found| found == cpu)
}

/// The same list as in `phantom3-machine`; a test compares the two.
fn is_set_by_unit(action: &Action) -> bool {
    match action {
        Action::Put { path, .. } => SET_BY_UNIT.iter().any(|part| path.contains(part)),
        Action::Sysctl { key, .. } => SYSCTL_OF_UNIT.contains(key),
        _ => false,
    }
}

const SYSCTL_OF_UNIT: [&str; 3] =
    ["kernel.numa_balancing", "kernel.nmi_watchdog", "vm.compact_unevictable_allowed"];

const SET_BY_UNIT: [&str; 7] = [
    "/sched/fair_server/",
    "/cpufreq/scaling_governor",
    "/cpufreq/energy_performance_preference",
    "/transparent_hugepage/enabled",
    "/virtual/workqueue/",
    "/proc/irq/default_smp_affinity",
    "/smp_affinity_list",
];

pub(super) fn write(script: &mut Script, steps: &[Step]) {
    if steps.is_empty() {
        return;
    }
    script.section(&format!(
        "{MACHINE_UNIT}, which is installed, sets these; its journal says what it could not"
    ));
    steps.iter().for_each(|step| script.comment(&format!("- {}", one_line(&step.what, 200))));
    script.explain(
        "sets them anew; the driver's service starts it at each boot",
        &format!("systemctl stop {MACHINE_UNIT}"),
    );
    script.line(&format!("systemctl restart {MACHINE_UNIT}"));
}
