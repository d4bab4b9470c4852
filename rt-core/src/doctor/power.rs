//! What saves power and costs time: frequencies, sleep states, sleeping links.

use super::machine::{Machine, Obstacle, if_any, one_line};
use super::step::Step;
use super::{Check, Group, Judged, Judgement, Remedy};
use crate::installed::LATENCY_RULE;

/// These checks.
pub const GROUP: Group = Group {
    name: "power",
    checks: &[
        Check {
            id: "power.governor",
            title: "frequency governor",
            why: "A loop that works a tenth of the time looks idle to a governor, which slows the CPU down; changing \
                  back stops it for tens of microseconds.",
            run: governor,
        },
        Check {
            id: "power.epp",
            title: "energy preference",
            why: "The processor itself chooses lower frequencies when told to prefer energy to performance.",
            run: energy_preference,
        },
        Check {
            id: "power.c_states",
            title: "sleep states",
            why: "Waking from a deep sleep state takes up to a millisecond. The driver holds /dev/cpu_dma_latency at 0 \
                  against it, if it may.",
            run: sleep_states,
        },
        Check {
            id: "power.turbo",
            title: "turbo",
            why: "With turbo the frequency depends on what the other cores do: faster on average, less even. Worth \
                  knowing when two measurements differ.",
            run: turbo,
        },
        Check {
            id: "power.pcie_aspm",
            title: "sleeping PCIe links",
            why: "A link that sleeps between two ticks takes up to some 60 us to wake at each access to a card.",
            run: link_power,
        },
        Check {
            id: "power.gpu",
            title: "GPU power management",
            why: "A graphics card that is switched off and on again blocks the bus and the firmware for milliseconds.",
            run: gpu,
        },
    ],
};

fn governor(machine: &Machine<'_>) -> Judged {
    let path = format!("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", machine.spec.cpu);
    let Some(governor) = if_any(machine.line(&path))? else {
        return Ok(Judgement::pass("none: firmware or hypervisor decides"));
    };
    match governor.as_str() {
        "performance" => Ok(Judgement::pass(governor)),
        "powersave" | "schedutil" | "ondemand" | "conservative" | "userspace" => {
            let step = Step::put("full frequency for the loop's CPU", &path, "performance", &governor);
            Ok(Judgement::warn(governor, Remedy::steps(format!("echo performance > {path}"), [step])))
        }
        _ => Err(Obstacle::garbled(path, &governor)),
    }
}

fn energy_preference(machine: &Machine<'_>) -> Judged {
    let path =
        format!("/sys/devices/system/cpu/cpu{}/cpufreq/energy_performance_preference", machine.spec.cpu);
    let Some(preference) = if_any(machine.line(&path))? else {
        return Ok(Judgement::pass("this CPU has none"));
    };
    // A number between 0 (performance) and 255 was written by hand.
    let number = preference.parse::<u8>().ok();
    match (preference.as_str(), number) {
        ("performance", _) | (_, Some(0)) => Ok(Judgement::pass(preference)),
        ("default" | "balance_performance" | "balance_power" | "power", _) | (_, Some(_)) => {
            let step =
                Step::put("performance before energy on the loop's CPU", &path, "performance", &preference);
            Ok(Judgement::warn(preference, Remedy::steps(format!("echo performance > {path}"), [step])))
        }
        _ => Err(Obstacle::garbled(path, &preference)),
    }
}

/// States that take longer to leave than this disturb a loop at 1 kHz.
const HARMLESS_US: u64 = 10;

fn sleep_states(machine: &Machine<'_>) -> Judged {
    let deepest = deepest_state(machine)?;
    let Some((name, latency_us)) = deepest else { return Ok(Judgement::pass("none in use")) };
    let state = format!("deepest in use: {name}, {latency_us} us to leave");
    match machine.probes.held_dma_latency_us() {
        // Another program may ask for less, which suits us too.
        Ok(us) if us <= 0 => {
            Ok(Judgement::pass(format!("{state}; none while the driver holds /dev/cpu_dma_latency")))
        }
        _ if latency_us <= HARMLESS_US => Ok(Judgement::pass(state)),
        Ok(us) => {
            let found =
                format!("{state}; /dev/cpu_dma_latency was held at 0 and the limit in force is {us} us");
            Ok(Judgement::fail(found, hold_latency()))
        }
        Err(error) => {
            let found = format!("{state}; /dev/cpu_dma_latency cannot be held ({})", one_line(&error, 60));
            Ok(Judgement::warn(found, hold_latency()))
        }
    }
}

fn hold_latency() -> Remedy {
    let text = format!("a udev rule: {LATENCY_RULE}");
    Remedy::steps(text, [Step::udev("let the group keep the CPUs awake", LATENCY_RULE)])
}

/// Name and exit latency (us) of the deepest state that the kernel may choose; none without any.
fn deepest_state(machine: &Machine<'_>) -> Result<Option<(String, u64)>, Obstacle> {
    let directory = format!("/sys/devices/system/cpu/cpu{}/cpuidle", machine.spec.cpu);
    let mut deepest: Option<(String, u64)> = None;
    for state in machine.names(&directory)?.iter().filter(|name| name.starts_with("state")) {
        let file = |name: &str| format!("{directory}/{state}/{name}");
        let is_disabled = machine.number::<u64>(&file("disable"))? != 0;
        let latency_us: u64 = machine.number(&file("latency"))?;
        let name = one_line(&machine.line(&file("name"))?, 30);
        if !is_disabled && deepest.as_ref().is_none_or(|(_, most)| latency_us > *most) {
            deepest = Some((name, latency_us));
        }
    }
    Ok(deepest)
}

fn turbo(machine: &Machine<'_>) -> Judged {
    const INTEL: &str = "/sys/devices/system/cpu/intel_pstate/no_turbo";
    const OTHERS: &str = "/sys/devices/system/cpu/cpufreq/boost";
    let on = match if_any(machine.switch(INTEL))? {
        Some(off) => Some((!off, format!("echo 1 > {INTEL}"))),
        None => if_any(machine.switch(OTHERS))?.map(|on| (on, format!("echo 0 > {OTHERS}"))),
    };
    Ok(Judgement::pass(match on {
        None => "no switch for it".to_owned(),
        Some((false, _)) => "off".to_owned(),
        Some((true, command)) => format!("on; for the most even times: {command}"),
    }))
}

fn link_power(machine: &Machine<'_>) -> Judged {
    const POLICY: &str = "/sys/module/pcie_aspm/parameters/policy";
    let Some(policy) = if_any(machine.chosen(POLICY))? else {
        return Ok(Judgement::pass("this kernel puts no links to sleep"));
    };
    let off = |value: Option<String>| value.as_deref() == Some("off");
    match policy.as_str() {
        "performance" => Ok(Judgement::pass(policy)),
        "default" | "powersave" | "powersupersave" if off(machine.boot_parameter("pcie_aspm")?) => {
            Ok(Judgement::pass("off at boot"))
        }
        "default" | "powersave" | "powersupersave" => {
            let boot = machine.boot_parameter("pcie_aspm.policy")?;
            let steps = [
                Step::put("keep PCIe links awake", POLICY, "performance", &policy),
                Step::boot("keep PCIe links awake from the start", "pcie_aspm.policy", "performance", boot),
            ];
            let text = format!("echo performance > {POLICY}; at boot: pcie_aspm.policy=performance");
            let found =
                if policy == "default" { "default: as the firmware left it".to_owned() } else { policy };
            Ok(Judgement::warn(found, Remedy::steps(text, steps)))
        }
        _ => Err(Obstacle::garbled(POLICY, &policy)),
    }
}

fn gpu(machine: &Machine<'_>) -> Judged {
    let cards = machine.names("/sys/class/drm")?;
    // `card0` is a device, `card0-HDMI-A-1` a connector.
    let is_card = |name: &&String| {
        name.strip_prefix("card")
            .is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit()))
    };
    let (mut found, mut steps) = (Vec::new(), Vec::new());
    for card in cards.iter().filter(is_card) {
        let path = format!("/sys/class/drm/{card}/device/power/control");
        // A virtual display has no device behind it.
        let Some(control) = if_any(machine.line(&path))? else { continue };
        match control.as_str() {
            "on" => {}
            "auto" => steps.push(Step::put("do not switch this graphics card off", &path, "on", "auto")),
            _ => return Err(Obstacle::garbled(path, &control)),
        }
        found.push(format!("{card} {control}"));
    }
    match (found.is_empty(), steps.is_empty()) {
        (true, _) => Ok(Judgement::pass("no GPU")),
        (false, true) => Ok(Judgement::pass(format!("{}: never switched off", found.join(", ")))),
        (false, false) => {
            let text = "echo on > /sys/class/drm/CARD/device/power/control for each";
            Ok(Judgement::warn(
                format!("{}: switched off when idle", found.join(", ")),
                Remedy::steps(text, steps),
            ))
        }
    }
}
