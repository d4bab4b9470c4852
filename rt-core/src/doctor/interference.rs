//! What else the machine does on the loop's CPU: interrupts, kernel work, memory management, a twin.

mod interrupts;

use super::cpus::{list_of, mask_of, parse_mask, without};
use super::kernel::{has_no_tick, is_isolated};
use super::machine::{Machine, Obstacle, if_any};
use super::privilege::processes;
use super::step::{Action, Step};
use super::{Check, Group, Judged, Judgement, Remedy};

/// These checks.
pub const GROUP: Group = Group {
    name: "interference",
    checks: &[
        Check {
            id: "interference.irq_affinity",
            title: "interrupts on the CPU",
            why: "Each device interrupt on the loop's CPU takes some microseconds from it, in bursts much more.",
            run: interrupts::affinity,
        },
        Check {
            id: "interference.default_smp_affinity",
            title: "CPUs of new interrupts",
            why: "A device that appears later gets its interrupts by this mask.",
            run: interrupts::default_affinity,
        },
        Check {
            id: "interference.workqueues",
            title: "CPUs of kernel work",
            why: "Unbound work of the kernel (write-back, crypto, drivers) runs on the CPUs of this mask.",
            run: workqueues,
        },
        Check {
            id: "interference.irqbalance",
            title: "irqbalance",
            why: "irqbalance moves interrupts back to the loop's CPU, whatever was set by hand.",
            run: irqbalance,
        },
        Check {
            id: "interference.thp",
            title: "transparent huge pages",
            why: "With `always`, the kernel compacts memory to make huge pages and stops whoever touches it meanwhile.",
            run: huge_pages,
        },
        Check {
            id: "interference.ksm",
            title: "same-page merging",
            why: "KSM makes equal pages read-only to share them; writing to one is a page fault, locked or not.",
            run: same_page_merging,
        },
        Check {
            id: "interference.numa_balancing",
            title: "NUMA balancing",
            why: "It unmaps pages now and then to see who uses them: page faults in the loop.",
            run: numa_balancing,
        },
        Check {
            id: "interference.smt_sibling",
            title: "hyper-threading sibling",
            why: "Two hardware threads share one core: whatever runs on the sibling slows the loop by up to a half.",
            run: smt_sibling,
        },
        Check {
            id: "interference.watchdogs",
            title: "lock-up watchdogs",
            why: "The kernel's watchdogs wake a thread of the highest priority on each CPU and use its counters.",
            run: watchdogs,
        },
        Check {
            id: "interference.timer_migration",
            title: "timer migration",
            why: "Timers of idle CPUs are handed to busy ones, and a spinning loop makes its CPU the busiest.",
            run: timer_migration,
        },
    ],
};

fn workqueues(machine: &Machine<'_>) -> Judged {
    const MASK: &str = "/sys/devices/virtual/workqueue/cpumask";
    let Some(mask) = if_any(machine.line(MASK))? else {
        return Ok(Judgement::pass("this kernel has no such mask"));
    };
    let cpus = parse_mask(&mask).filter(|cpus| !cpus.is_empty());
    let cpus = cpus.ok_or_else(|| Obstacle::garbled(MASK, &mask))?;
    mask_without_the_cpu(machine, MASK, &cpus, &mask, "keep unbound kernel work off the CPU")
}

/// Passes if the mask leaves the loop's CPU out; else the remedy is to take it out.
fn mask_without_the_cpu(
    machine: &Machine<'_>,
    path: &str,
    cpus: &[usize],
    former: &str,
    what: &str,
) -> Judged {
    let found = format!("CPU {}", list_of(cpus));
    if !cpus.contains(&machine.spec.cpu) {
        return Ok(Judgement::pass(found));
    }
    let online = machine.online_cpus()?;
    let others = without(&online, machine.spec.cpu);
    if others.is_empty() {
        return Ok(Judgement::warn(
            format!("{found}, and there is no other"),
            Remedy::words("use a machine with two CPUs"),
        ));
    }
    let mask = mask_of(&others);
    let step = Step::put(what, path, &mask, former);
    Ok(Judgement::warn(found, Remedy::steps(format!("echo {mask} > {path}"), [step])))
}

fn irqbalance(machine: &Machine<'_>) -> Judged {
    if !processes(machine)?.iter().any(|(_, name)| name == "irqbalance") {
        return Ok(Judgement::pass("not running"));
    }
    // It leaves CPUs alone that are isolated or without tick, since version 1.0.8.
    if is_isolated(machine) || has_no_tick(machine)? {
        return Ok(Judgement::pass("running; it leaves isolated CPUs alone"));
    }
    let step = Step {
        what: "stop moving interrupts about".into(),
        action: Action::Stop { unit: "irqbalance.service" },
    };
    let text = format!(
        "systemctl disable --now irqbalance, or IRQBALANCE_BANNED_CPULIST={} in /etc/default/irqbalance",
        machine.spec.cpu
    );
    Ok(Judgement::warn("running", Remedy::steps(text, [step])))
}

fn huge_pages(machine: &Machine<'_>) -> Judged {
    const ENABLED: &str = "/sys/kernel/mm/transparent_hugepage/enabled";
    let Some(chosen) = if_any(machine.chosen(ENABLED))? else {
        return Ok(Judgement::pass("this kernel has none"));
    };
    match chosen.as_str() {
        "never" | "madvise" => Ok(Judgement::pass(chosen)),
        "always" => {
            let step = Step::put("make huge pages only for programs that ask", ENABLED, "madvise", "always");
            Ok(Judgement::warn(chosen, Remedy::steps(format!("echo madvise > {ENABLED}"), [step])))
        }
        _ => Err(Obstacle::garbled(ENABLED, &chosen)),
    }
}

fn same_page_merging(machine: &Machine<'_>) -> Judged {
    const RUN: &str = "/sys/kernel/mm/ksm/run";
    match if_any(machine.number::<u8>(RUN))? {
        None => Ok(Judgement::pass("this kernel has none")),
        Some(0) => Ok(Judgement::pass("off")),
        Some(2) => Ok(Judgement::pass("off, all pages separated")),
        Some(1) => {
            // 2 also takes apart what is merged already.
            let step = Step::put("stop merging pages, and separate those that are merged", RUN, "2", "1");
            Ok(Judgement::warn("on", Remedy::steps(format!("echo 2 > {RUN}"), [step])))
        }
        Some(other) => Err(Obstacle::garbled(RUN, &other.to_string())),
    }
}

fn numa_balancing(machine: &Machine<'_>) -> Judged {
    const SWITCH: &str = "/proc/sys/kernel/numa_balancing";
    match if_any(machine.number::<u8>(SWITCH))? {
        None => Ok(Judgement::pass("this kernel has none")),
        Some(0) => Ok(Judgement::pass("off")),
        // 2 moves pages between kinds of memory.
        Some(mode @ 1..=3) => {
            let step = Step::sysctl(
                "do not unmap pages to watch their use",
                "kernel.numa_balancing",
                0,
                mode.into(),
            );
            Ok(Judgement::warn(
                format!("on ({mode})"),
                Remedy::steps("sysctl kernel.numa_balancing=0", [step]),
            ))
        }
        Some(other) => Err(Obstacle::garbled(SWITCH, &other.to_string())),
    }
}

fn smt_sibling(machine: &Machine<'_>) -> Judged {
    let cpu = machine.spec.cpu;
    let path = format!("/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list");
    let core = machine.cpu_list(&path)?;
    if !core.contains(&cpu) {
        return Err(Obstacle::garbled(path, &list_of(&core)));
    }
    let siblings = without(&core, cpu);
    let Some(sibling) = siblings.first() else { return Ok(Judgement::pass("none")) };
    let found = format!("CPU {} shares the core", list_of(&siblings));
    let online = format!("/sys/devices/system/cpu/cpu{sibling}/online");
    let step = Step::put("switch the sibling off", &online, "0", "1");
    let text =
        format!("echo 0 > {online}, or boot with nosmt, or switch hyper-threading off in the firmware");
    Ok(Judgement::warn(found, Remedy::steps(text, [step])))
}

fn watchdogs(machine: &Machine<'_>) -> Judged {
    const SWITCH: &str = "/proc/sys/kernel/watchdog";
    const CPUS: &str = "/proc/sys/kernel/watchdog_cpumask";
    if if_any(machine.switch(SWITCH))? != Some(true) {
        return Ok(Judgement::pass("off"));
    }
    let watched = if_any(machine.cpu_list(CPUS))?;
    if watched.is_some_and(|cpus| !cpus.contains(&machine.spec.cpu)) {
        return Ok(Judgement::pass("on, but not on this CPU"));
    }
    let hard = if_any(machine.switch("/proc/sys/kernel/nmi_watchdog"))? == Some(true);
    let found = if hard { "soft lock-up and NMI watchdog on" } else { "soft lock-up watchdog on" };
    let step = Step::sysctl("no lock-up watchdogs", "kernel.watchdog", 0, 1);
    let text = "sysctl kernel.watchdog=0, or keep them off this CPU with kernel.watchdog_cpumask";
    Ok(Judgement::warn(found, Remedy::steps(text, [step])))
}

fn timer_migration(machine: &Machine<'_>) -> Judged {
    match if_any(machine.switch("/proc/sys/kernel/timer_migration"))? {
        None => Ok(Judgement::pass("this kernel has none")),
        Some(false) => Ok(Judgement::pass("off")),
        Some(true) if is_isolated(machine) || has_no_tick(machine)? => {
            Ok(Judgement::pass("on, but not to isolated CPUs"))
        }
        Some(true) => {
            let step = Step::sysctl("leave timers where they are", "kernel.timer_migration", 0, 1);
            Ok(Judgement::warn("on", Remedy::steps("sysctl kernel.timer_migration=0", [step])))
        }
    }
}
