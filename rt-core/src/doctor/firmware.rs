//! What runs below the kernel: system management interrupts, and a hypervisor.

use super::machine::{Machine, Obstacle, one_line};
use super::step::{Action, Step};
use super::{Check, Group, Judged, Judgement, Remedy};
use std::time::Duration;

/// These checks.
pub const GROUP: Group = Group {
    name: "firmware",
    checks: &[
        Check {
            id: "firmware.virtualisation",
            title: "virtual machine",
            why: "On a virtual machine the hypervisor takes the CPU away unseen; its milliseconds cannot be configured \
                  away inside.",
            run: virtualisation,
        },
        Check {
            id: "firmware.steal",
            title: "stolen time",
            why: "Time that the hypervisor gave to others while this CPU had work to do.",
            run: steal,
        },
        Check {
            id: "firmware.smi",
            title: "SMI count",
            why: "A system management interrupt stops all CPUs for the firmware's own purposes, tens of microseconds to \
                  milliseconds, unseen by the kernel.",
            run: smi,
        },
        Check {
            id: "firmware.latency",
            title: "gaps in a spinning loop",
            why: "A loop that does nothing but read the clock sees every moment in which somebody else had the CPU.",
            run: latency,
        },
    ],
};

fn virtualisation(machine: &Machine<'_>) -> Judged {
    if !machine.is_virtual()? {
        return Ok(Judgement::pass("none seen"));
    }
    let name = ["/sys/hypervisor/type", "/sys/class/dmi/id/product_name", "/sys/class/dmi/id/sys_vendor"];
    let name = name.iter().find_map(|path| machine.line(path).ok()).map(|name| one_line(&name, 40));
    let found = name.map_or_else(|| "yes".to_owned(), |name| format!("yes ({name})"));
    let text = "use a machine of its own for devices; here for development, expect milliseconds now and then";
    Ok(Judgement::warn(found, Remedy::words(text)))
}

fn steal(machine: &Machine<'_>) -> Judged {
    const STAT: &str = "/proc/stat";
    let text = machine.text(STAT)?;
    let name = format!("cpu{}", machine.spec.cpu);
    let line = text.lines().find(|line| line.split_whitespace().next() == Some(&name));
    let numbers: Option<Vec<u64>> =
        line.and_then(|line| line.split_whitespace().skip(1).map(|number| number.parse().ok()).collect());
    // user nice system idle iowait irq softirq steal guest guest_nice; guests are in user already.
    let numbers =
        numbers.filter(|numbers| numbers.len() >= 8).ok_or_else(|| Obstacle::garbled(STAT, &text))?;
    let (stolen, total) = (numbers[7], numbers[..8].iter().fold(0_u64, |sum, n| sum.saturating_add(*n)));
    if stolen == 0 {
        return Ok(Judgement::pass("none since boot"));
    }
    let percent = stolen as f64 / total as f64 * 100.0;
    let text = "ask the host's owner for a CPU of its own (pinned, not overcommitted), or use a real machine";
    Ok(Judgement::warn(format!("{percent:.2} % of this CPU's time since boot"), Remedy::words(text)))
}

fn smi(machine: &Machine<'_>) -> Judged {
    if machine.is_virtual()? {
        let text = "count them on the host";
        return Ok(Judgement::unreadable("hidden by the hypervisor", Remedy::words(text)));
    }
    match machine.probes.smi_count(machine.spec.cpu) {
        Ok(0) => Ok(Judgement::pass("none since boot")),
        Ok(count) => judge_smi_rate(machine, count),
        Err(error) => {
            let text = "modprobe msr, then run the doctor as root; only Intel's processors count them, and lockdown \
                        hides the count";
            let step =
                Step { what: "let root read the SMI count".into(), action: Action::Module { name: "msr" } };
            Ok(Judgement::unreadable(one_line(&error, 60), Remedy::steps(text, [step])))
        }
    }
}

/// No machine runs longer (s).
const CENTURY_S: f64 = 3.2e9;

/// Some come while the machine starts; what counts is how often they come later.
fn judge_smi_rate(machine: &Machine<'_>, count: u32) -> Judged {
    const UPTIME: &str = "/proc/uptime";
    let text = machine.line(UPTIME)?;
    let seconds = text.split(' ').next().and_then(|word| word.parse::<f64>().ok());
    let seconds =
        seconds.filter(|s| *s > 0.0 && *s < CENTURY_S).ok_or_else(|| Obstacle::garbled(UPTIME, &text))?;
    let per_hour = f64::from(count) / (seconds / 3600.0).max(1.0);
    let found = format!("{count} since boot, {per_hour:.0} an hour");
    // A few hundred come at boot, so a young machine is not blamed for them.
    if per_hour <= 60.0 || (seconds < 3600.0 && count < 1000) {
        return Ok(Judgement::pass(found));
    }
    let text = "in the firmware's setup, switch off legacy USB support, power capping and ECC/thermal polling; update \
                the firmware; if the rate stays, choose another main board";
    Ok(Judgement::warn(found, Remedy::words(text)))
}

/// How long the loop spins.
const SPIN: Duration = Duration::from_millis(200);
/// Wide thresholds: a tick of the kernel takes some microseconds, with page-table isolation ten.
const WARN_NS: u64 = 100_000;
/// Half of a tick at 1 kHz, which is the usual reply budget.
const FAIL_NS: u64 = 500_000;

fn latency(machine: &Machine<'_>) -> Judged {
    let gaps = match machine.probes.gaps(machine.spec.cpu, SPIN) {
        Ok(gaps) => gaps,
        Err(error) => {
            let text = "choose a CPU that is open to this process";
            return Ok(Judgement::unreadable(one_line(&error, 60), Remedy::words(text)));
        }
    };
    let mut found = format!("longest {} us in {} ms", gaps.largest_ns / 1000, SPIN.as_millis());
    if gaps.long_gaps > 0 {
        found += &format!(", {} longer than 20 us", gaps.long_gaps);
    }
    if gaps.preemptions > 0 {
        found += &format!("; other threads ran {} times", gaps.preemptions);
    } else if !gaps.was_fifo {
        found += "; tried without real-time priority";
    }
    found += &match gaps.smi {
        Some(count) if count > 0 => format!("; {count} SMIs meanwhile"),
        _ => String::new(),
    };
    // Only the firmware is left to blame when nothing else could have run.
    let nobody_else = gaps.was_fifo && !machine.is_virtual()?;
    let remedy = Remedy::words(
        "mend the other findings first; then run `hwlatdetect --duration=60` (Debian: rt-tests) and look into the \
         firmware's setup for power management and legacy USB",
    );
    Ok(match gaps.largest_ns {
        ns if ns < WARN_NS => Judgement::pass(found),
        // Their turns hide the firmware's.
        _ if gaps.preemptions > 0 => Judgement::unreadable(found, on_a_free_cpu(gaps.was_fifo)),
        ns if ns >= FAIL_NS && nobody_else => Judgement::fail(found, remedy),
        _ => Judgement::warn(found, remedy),
    })
}

fn on_a_free_cpu(was_fifo: bool) -> Remedy {
    Remedy::words(match was_fifo {
        true => "ask again when no driver runs on this CPU",
        false => "ask again with the right to real-time priority, or as root",
    })
}
