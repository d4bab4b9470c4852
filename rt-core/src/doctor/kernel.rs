//! The kernel: is it real-time, does it keep off the loop's CPU, can its clock be read quickly?

use super::cpus::{list_of, without};
use super::machine::{LoopSpec, Machine, Obstacle, if_any, one_line};
use super::step::Step;
use super::{Check, Group, Judged, Judgement, Remedy};
use crate::setup::kernel::judge_kernel;
use crate::setup::placement::{ISOLATED_AT_BOOT, ISOLATED_AT_RUN_TIME};

/// These checks.
pub const GROUP: Group = Group {
    name: "kernel",
    checks: &[
        Check {
            id: "kernel.realtime",
            title: "real-time kernel",
            why: "An ordinary kernel finishes interrupts and locked sections before it lets a real-time thread \
                  run: usually microseconds, sometimes many milliseconds.",
            run: realtime,
        },
        Check {
            id: "kernel.isolcpus",
            title: "CPU isolated",
            why: "On a CPU that is not isolated the scheduler places other programs, which cost the loop its \
                  cache and make it wait for their system calls to end.",
            run: isolcpus,
        },
        Check {
            id: "kernel.nohz_full",
            title: "no tick on it",
            why: "The kernel's periodic tick interrupts the loop some hundred times a second.",
            run: nohz_full,
        },
        Check {
            id: "kernel.rcu_nocbs",
            title: "no RCU callbacks on it",
            why: "The kernel runs deferred clean-up (RCU callbacks) on every CPU unless told to offload it.",
            run: rcu_nocbs,
        },
        Check {
            id: "kernel.clocksource",
            title: "clock source",
            why: "The loop reads the clock while it spins; with tsc that takes some 25 ns, with hpet or acpi_pm a \
                  slow device access of a microsecond and more.",
            run: clocksource,
        },
        Check {
            id: "kernel.tick_phase",
            title: "phase off the tick",
            why: "A deadline that coincides with the kernel's tick waits for it: measured, the 90th percentile of \
                  lateness was 17 us on whole milliseconds and 0.04 us off them.",
            run: tick_phase,
        },
    ],
};

fn realtime(machine: &Machine<'_>) -> Judged {
    let sysfs = machine.text_if_any("/sys/kernel/realtime")?;
    if let Some(text) = sysfs.as_deref().filter(|text| !matches!(text.trim(), "0" | "1")) {
        return Err(Obstacle::garbled("/sys/kernel/realtime", text));
    }
    let version = machine.text("/proc/sys/kernel/version")?;
    let release = one_line(&machine.line("/proc/sys/kernel/osrelease")?, 80);
    let guarantee = judge_kernel(sysfs.as_deref(), &version, &release);
    if guarantee.obtained {
        return Ok(Judgement::pass(guarantee.found));
    }
    let text = format!("install and boot a PREEMPT_RT kernel: {}", kernel_package(machine));
    let step = Step::by_hand(text.clone());
    Ok(Judgement::fail(guarantee.found, Remedy::steps(text, [step])))
}

/// How this distribution's real-time kernel is installed.
fn kernel_package(machine: &Machine<'_>) -> &'static str {
    let release = machine.text("/etc/os-release").unwrap_or_default();
    let id = release.lines().find_map(|line| line.strip_prefix("ID=")).unwrap_or_default();
    match id.trim_matches('"') {
        "debian" => "apt-get install linux-image-rt-amd64 (arm64: linux-image-rt-arm64)",
        "ubuntu" => "pro enable realtime-kernel",
        "arch" => "pacman -S linux-rt",
        "fedora" => "Fedora has none of its own; build one with CONFIG_PREEMPT_RT=y (mainline from 6.12 on)",
        "rhel" | "centos" | "rocky" | "almalinux" => "dnf install kernel-rt (repository rt)",
        "opensuse-tumbleweed" | "opensuse-leap" | "sles" => "zypper install kernel-rt",
        _ => "from your distribution, or build one with CONFIG_PREEMPT_RT=y (mainline from 6.12 on)",
    }
}

fn isolcpus(machine: &Machine<'_>) -> Judged {
    let mut isolated = if_any(machine.cpu_list(ISOLATED_AT_BOOT))?.unwrap_or_default();
    isolated.extend(if_any(machine.cpu_list(ISOLATED_AT_RUN_TIME))?.unwrap_or_default());
    isolated.sort_unstable();
    isolated.dedup();
    covered(
        machine,
        &isolated,
        "isolated",
        "isolcpus",
        "managed_irq,domain,",
        "keep other programs off the CPU",
    )
}

/// The loop's CPU has no tick while a single thread runs there.
pub(super) fn has_no_tick(machine: &Machine<'_>) -> Result<bool, Obstacle> {
    let listed = if_any(machine.cpu_list("/sys/devices/system/cpu/nohz_full"))?;
    Ok(listed.unwrap_or_default().contains(&machine.spec.cpu))
}

/// Isolated at boot or at run time; what cannot be known counts as not.
pub(super) fn is_isolated(machine: &Machine<'_>) -> bool {
    let lists =
        [ISOLATED_AT_BOOT, ISOLATED_AT_RUN_TIME].map(|path| machine.cpu_list(path).unwrap_or_default());
    lists.iter().flatten().any(|cpu| *cpu == machine.spec.cpu)
}

fn nohz_full(machine: &Machine<'_>) -> Judged {
    let listed = if_any(machine.cpu_list("/sys/devices/system/cpu/nohz_full"))?.unwrap_or_default();
    covered(machine, &listed, "without tick", "nohz_full", "", "stop the tick while the loop alone runs")
}

fn rcu_nocbs(machine: &Machine<'_>) -> Judged {
    let listed = match machine.boot_parameter("rcu_nocbs")? {
        None => Vec::new(),
        // A bare word means all of them.
        Some(list) if list.is_empty() || list == "all" => machine.online_cpus()?,
        Some(list) => crate::cpu::parse_cpu_list(&list)
            .ok_or_else(|| Obstacle::garbled("/proc/cmdline", &format!("rcu_nocbs={list}")))?,
    };
    if !listed.contains(&machine.spec.cpu) && has_no_tick(machine)? {
        return Ok(Judgement::pass("offloaded, as nohz_full implies"));
    }
    covered(machine, &listed, "offloaded", "rcu_nocbs", "", "move deferred clean-up to other CPUs")
}

/// Judges whether a set of CPUs includes the loop's; else the remedy is to boot with it added.
fn covered(
    machine: &Machine<'_>,
    listed: &[usize],
    state: &str,
    key: &'static str,
    flags: &str,
    what: &str,
) -> Judged {
    let cpu = machine.spec.cpu;
    let found = if listed.is_empty() {
        format!("no CPU {state}")
    } else {
        format!("CPU {} {state}", list_of(listed))
    };
    if listed.contains(&cpu) {
        return Ok(Judgement::pass(found));
    }
    let mut wanted = without(listed, cpu);
    wanted.push(cpu);
    wanted.sort_unstable();
    let value = format!("{flags}{}", list_of(&wanted));
    let text = format!("{}boot with {key}={value}", instead(key, listed));
    let step = Step::boot(what, key, value, machine.boot_parameter(key)?);
    Ok(Judgement::warn(found, Remedy::steps(text, [step])))
}

/// Where another CPU is isolated already, the loop should rather move there.
fn instead(key: &str, listed: &[usize]) -> String {
    match listed.last() {
        Some(other) if key == "isolcpus" => {
            format!("set real_time.cpu = {other} in the driver's configuration; or ")
        }
        _ => String::new(),
    }
}

fn clocksource(machine: &Machine<'_>) -> Judged {
    const CURRENT: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    const AVAILABLE: &str = "/sys/devices/system/clocksource/clocksource0/available_clocksource";
    let current = one_line(&machine.line(CURRENT)?, 40);
    let switch = || -> Result<Remedy, Obstacle> {
        let offered = machine.text_if_any(AVAILABLE)?.unwrap_or_default();
        if offered.split_whitespace().any(|name| name == "tsc") {
            let step = Step::put("read time from the CPU itself", CURRENT, "tsc", &current);
            return Ok(Remedy::steps(format!("echo tsc > {CURRENT}"), [step]));
        }
        let text = "the kernel found tsc unstable: see `dmesg | grep -i tsc`; update the firmware, or boot with \
                    tsc=reliable if you know that it is";
        Ok(Remedy::steps(text, [Step::by_hand(text)]))
    };
    match current.as_str() {
        "tsc" | "arch_sys_counter" | "riscv_clocksource" => Ok(Judgement::pass(current)),
        "kvm-clock" | "hyperv_clocksource_tsc_page" | "xen" => {
            Ok(Judgement::warn(current.clone(), switch()?))
        }
        "hpet" | "acpi_pm" | "jiffies" | "refined-jiffies" | "hyperv_clocksource_msr" | "pit" => {
            Ok(Judgement::fail(current.clone(), switch()?))
        }
        _ => Err(Obstacle::garbled(CURRENT, &current)),
    }
}

/// Closer than this, a tick may still run when the deadline comes, or come while the loop works.
const TICK_DISTANCE_NS: u64 = 50_000;
/// What is assumed when the tick cannot be known: with the usual rates it is at whole milliseconds.
const USUAL_TICK_NS: u64 = 1_000_000;

fn tick_phase(machine: &Machine<'_>) -> Judged {
    let spec = machine.spec;
    if has_no_tick(machine)? {
        return Ok(Judgement::pass("the tick is off on this CPU"));
    }
    let (tick_ns, how) = match machine.probes.kernel_tick_ns() {
        // A coarse clock finer than 10 kHz would be no tick.
        Ok(ns) if (100_000..=100_000_000).contains(&ns) => (ns, format!("tick every {} us", ns / 1000)),
        _ => (USUAL_TICK_NS, "CONFIG_HZ unreadable, tick assumed at whole milliseconds".into()),
    };
    let distance_ns = distance_from_tick(spec, tick_ns);
    let found = format!("deadlines at least {} us away ({how})", distance_ns / 1000);
    if distance_ns >= TICK_DISTANCE_NS {
        return Ok(Judgement::pass(found));
    }
    let grid_ns = gcd(spec.period_ns, tick_ns);
    let text = if grid_ns >= 4 * TICK_DISTANCE_NS {
        format!(
            "set real_time.phase_offset_us = {} in the driver's configuration",
            grid_ns as f64 * 0.37 / 1e3
        )
    } else {
        "this rate wanders through the tick whatever its phase: boot with nohz_full for this CPU, or choose a rate \
         that divides 1 kHz or is a small multiple of it"
            .to_owned()
    };
    Ok(Judgement::warn(found, Remedy::steps(text.clone(), [Step::by_hand(text)])))
}

/// Least distance between any deadline and any tick (ns).
///
/// Differences of the two grids are the phase plus all multiples of the greatest common divisor.
fn distance_from_tick(spec: &LoopSpec, tick_ns: u64) -> u64 {
    let grid_ns = gcd(spec.period_ns, tick_ns).max(1);
    let rest = spec.phase_offset_ns % grid_ns;
    rest.min(grid_ns - rest)
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(period_ns: u64, phase_offset_ns: u64) -> LoopSpec {
        LoopSpec { cpu: 1, priority: Some(80), period_ns, phase_offset_ns }
    }

    #[test]
    fn the_distance_to_the_tick_is_that_of_the_slow_and_obvious_search() {
        for (period_us, phase_us, tick_us) in [
            (1000, 370, 4000),
            (1000, 0, 4000),
            (250, 100, 1000),
            (300, 50, 1000),
            (500, 990, 4000),
            (333, 7, 1000),
        ] {
            let deadlines = (0..20_000_u64).map(|n| n * period_us + phase_us);
            let slow = deadlines.map(|at| (at % tick_us).min(tick_us - at % tick_us)).min().unwrap();
            assert_eq!(
                distance_from_tick(&spec(period_us * 1000, phase_us * 1000), tick_us * 1000),
                slow * 1000
            );
        }
    }
}
