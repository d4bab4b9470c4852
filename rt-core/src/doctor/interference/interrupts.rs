//! Device interrupts: where they go now, and where those of new devices will go.
//!
//! A *managed* interrupt belongs to a queue of a device that has one for each CPU (NVMe, network
//! cards); nobody may move it. Kernels from 6.11 on show that by a read-only affinity file. On older ones only the
//! attempt tells, which the doctor does not make: the file's mode says nothing there, and what is known is what root
//! sees in debugfs, or what [`read_back`](crate::read_back) says of root's own attempt at boot.

use super::super::cpus::{list_of, parse_mask, without};
use super::super::machine::{Machine, Obstacle, if_any, one_line};
use super::super::step::{Action, Step};
use super::super::{Judged, Judgement, Remedy};
use super::mask_without_the_cpu;
use crate::read_back::ReadBack;
use crate::setup::kernel::version_of;

/// A device interrupt that goes to the loop's CPU.
struct Interrupt {
    number: String,
    name: String,
    movable: Movable,
    /// The CPUs that it may go to.
    allowed: String,
}

/// Whether root may send an interrupt elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Movable {
    Yes,
    /// It is managed.
    No,
    /// This kernel tells only who tries.
    Unknown,
}

pub(super) fn affinity(machine: &Machine<'_>) -> Judged {
    let interrupts = interrupts_on(machine)?;
    if interrupts.is_empty() {
        return Ok(Judgement::pass("none"));
    }
    let (managed, movable): (Vec<_>, Vec<_>) =
        interrupts.into_iter().partition(|interrupt| interrupt.movable == Movable::No);
    let others = list_of(&without(&machine.online_cpus()?, machine.spec.cpu));
    if others.is_empty() {
        let found = format!("{} interrupts, and there is no other CPU", movable.len() + managed.len());
        return Ok(Judgement::warn(found, Remedy::words("use a machine with two CPUs")));
    }
    if movable.is_empty() {
        return judge_managed(machine, &managed);
    }
    let mut found = format!("{} ({})", movable.len(), names(&movable));
    let unknown = movable.iter().filter(|interrupt| interrupt.movable == Movable::Unknown).count();
    if unknown > 0 {
        found += &format!(
            "; whether {unknown} of them are managed, and cannot be moved, this kernel tells only who tries"
        );
    }
    if !managed.is_empty() {
        found += &format!("; managed, which cannot be moved: {} ({})", managed.len(), names(&managed));
    }
    let puts = movable.iter().map(|interrupt| put(interrupt, &others));
    let boot = machine.boot_parameter("irqaffinity")?;
    // What stands there already need not be asked for.
    let boot = (boot.as_deref() != Some(others.as_str())).then(|| {
        Step::boot("send interrupts to the other CPUs from the start", "irqaffinity", &others, boot)
    });
    let text =
        format!("echo {others} > /proc/irq/N/smp_affinity_list for each; at boot: irqaffinity={others}");
    Ok(Judgement::warn(found, Remedy::steps(text, boot.into_iter().chain(puts))))
}

fn put(interrupt: &Interrupt, others: &str) -> Step {
    Step {
        what: format!("send interrupt {} ({}) elsewhere", interrupt.number, interrupt.name),
        action: Action::Put {
            path: format!("/proc/irq/{}/smp_affinity_list", interrupt.number),
            value: others.to_owned(),
            former: interrupt.allowed.clone(),
            lasting: false,
        },
    }
}

/// With `isolcpus=managed_irq` the kernel keeps them away as long as a housekeeping CPU can serve.
fn judge_managed(machine: &Machine<'_>, managed: &[Interrupt]) -> Judged {
    let isolation = machine.boot_parameter("isolcpus")?;
    let found = format!("managed, which cannot be moved: {} ({})", managed.len(), names(managed));
    if isolation.as_deref().is_some_and(|value| value.split(',').any(|word| word == "managed_irq")) {
        return Ok(Judgement::pass(format!("{found}; isolcpus=managed_irq keeps them quiet")));
    }
    let cpu = machine.spec.cpu;
    let value = format!("managed_irq,domain,{cpu}");
    let text =
        format!("boot with isolcpus={value}; they fire only for what this CPU itself asks of the device");
    let step = Step::boot("keep managed interrupts off the CPU where possible", "isolcpus", value, isolation);
    Ok(Judgement::warn(found, Remedy::steps(text, [step])))
}

fn names(interrupts: &[Interrupt]) -> String {
    const SHOWN: usize = 6;
    let shown = interrupts.iter().take(SHOWN);
    let mut names: Vec<String> = shown.map(|i| format!("{} {}", i.number, i.name)).collect();
    if interrupts.len() > SHOWN {
        names.push(format!("{} more", interrupts.len() - SHOWN));
    }
    names.join(", ")
}

fn interrupts_on(machine: &Machine<'_>) -> Result<Vec<Interrupt>, Obstacle> {
    let names = machine.tree.list("/proc/irq").map_err(|_| Obstacle::Absent("/proc/irq".into()))?;
    let mut numbers: Vec<u32> = names.iter().filter_map(|name| name.parse().ok()).collect();
    numbers.sort_unstable();
    let mut found = Vec::new();
    let told = machine.read_back().unwrap_or_default();
    for number in numbers {
        found.extend(interrupt_on(machine, number, &told)?);
    }
    Ok(found)
}

/// None if nobody handles it, or if it does not go to the loop's CPU.
fn interrupt_on(machine: &Machine<'_>, number: u32, told: &ReadBack) -> Result<Option<Interrupt>, Obstacle> {
    let directory = format!("/proc/irq/{number}");
    let (allowed_file, effective_file) =
        (format!("{directory}/smp_affinity_list"), format!("{directory}/effective_affinity_list"));
    let Some(name) = handler(machine, &directory)? else { return Ok(None) };
    // Freed while we looked.
    let Some(allowed) = if_any(machine.cpu_list(&allowed_file))? else { return Ok(None) };
    // Empty before the interrupt is started.
    let effective = if_any(machine.cpu_list(&effective_file))?.filter(|cpus| !cpus.is_empty());
    // One that was sent elsewhere goes there when it next occurs; where it still would go says nothing until then.
    let reaches = |cpus: &Vec<usize>| cpus.contains(&machine.spec.cpu);
    if !reaches(&allowed) || !effective.as_ref().is_none_or(reaches) {
        return Ok(None);
    }
    let movable = movable(machine, number, told)?;
    let allowed = list_of(&allowed);
    Ok(Some(Interrupt { number: number.to_string(), name, movable, allowed }))
}

/// The name of the first handler, which is a directory among the files.
fn handler(machine: &Machine<'_>, directory: &str) -> Result<Option<String>, Obstacle> {
    let is_handler = |name: &String| {
        machine.status(&format!("{directory}/{name}")).is_ok_and(|status| status.is_directory)
    };
    Ok(machine.names(directory)?.into_iter().find(is_handler).map(|name| one_line(&name, 30)))
}

fn movable(machine: &Machine<'_>, number: u32, told: &ReadBack) -> Result<Movable, Obstacle> {
    let directory = format!("/proc/irq/{number}");
    let is_read_only = machine.status(&format!("{directory}/smp_affinity_list"))?.mode & 0o200 == 0;
    let mask = format!("{directory}/smp_affinity");
    if is_read_only || told.was_refused(&mask) {
        return Ok(Movable::No);
    }
    Ok(match is_marked_managed(machine, number) {
        Some(true) => Movable::No,
        // Root has moved it.
        _ if told.value(&mask).is_some() => Movable::Yes,
        None if !shows_managed_by_mode(machine)? => Movable::Unknown,
        _ => Movable::Yes,
    })
}

/// Only root can see that, and not under lockdown.
fn is_marked_managed(machine: &Machine<'_>, number: u32) -> Option<bool> {
    let state = machine.text(&format!("/sys/kernel/debug/irq/irqs/{number}")).ok()?;
    Some(state.contains("IRQD_AFFINITY_MANAGED"))
}

fn shows_managed_by_mode(machine: &Machine<'_>) -> Result<bool, Obstacle> {
    const RELEASE: &str = "/proc/sys/kernel/osrelease";
    let release = machine.line(RELEASE)?;
    let version = version_of(&release).ok_or_else(|| Obstacle::garbled(RELEASE, &release))?;
    Ok(version >= FIRST_WITH_READ_ONLY_AFFINITY)
}

const FIRST_WITH_READ_ONLY_AFFINITY: (u32, u32) = (6, 11);

pub(super) fn default_affinity(machine: &Machine<'_>) -> Judged {
    const MASK: &str = "/proc/irq/default_smp_affinity";
    let mask = machine.line(MASK)?;
    let cpus = parse_mask(&mask).filter(|cpus| !cpus.is_empty());
    let cpus = cpus.ok_or_else(|| Obstacle::garbled(MASK, &mask))?;
    mask_without_the_cpu(machine, MASK, &cpus, &mask, "send new devices' interrupts elsewhere")
}
