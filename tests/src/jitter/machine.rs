//! The machine's circumstances that explain a latency, as far as it tells.
//!
//! The machine's name and addresses are left out: results are passed around.

use std::collections::BTreeMap;
use std::fs::read_to_string;

/// What can be read of the machine now; what it does not tell is left out.
pub fn describe(cpu: Option<usize>) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut put = |key: &str, value: Option<String>| {
        if let Some(value) = value.map(|value| value.trim().to_owned()).filter(|value| !value.is_empty()) {
            found.insert(key.to_owned(), value);
        }
    };
    for (key, path) in FILES {
        put(key, read_to_string(path).ok());
    }
    let cpu_info = read_to_string("/proc/cpuinfo").unwrap_or_default();
    put("cpu model", field(&cpu_info, "model name"));
    put("microcode", field(&cpu_info, "microcode"));
    put("hypervisor", Some(if has_flag(&cpu_info, "hypervisor") { "yes" } else { "no" }.into()));
    put("memory", field(&read_to_string("/proc/meminfo").unwrap_or_default(), "MemTotal"));
    let cpus: Vec<_> = rt_core::cpu::online_cpus().iter().map(ToString::to_string).collect();
    put("cpus open to us", Some(cpus.join(",")));
    let Some(cpu) = cpu else { return found };
    put("measured cpu", Some(cpu.to_string()));
    for (key, path) in OF_CPU {
        put(key, read_to_string(format!("/sys/devices/system/cpu/cpu{cpu}/{path}")).ok());
    }
    let server = format!("/sys/kernel/debug/sched/fair_server/cpu{cpu}/runtime");
    put("fair server", read_to_string(server).ok().map(|ns| format!("{} ns of each second", ns.trim())));
    put("cpu idle states", idle_states(cpu));
    found
}

const FILES: [(&str, &str); 17] = [
    ("kernel", "/proc/sys/kernel/osrelease"),
    ("kernel build", "/proc/sys/kernel/version"),
    ("kernel real-time", "/sys/kernel/realtime"),
    ("kernel command line", "/proc/cmdline"),
    ("clocksource", "/sys/devices/system/clocksource/clocksource0/current_clocksource"),
    ("cpus online", "/sys/devices/system/cpu/online"),
    ("cpus isolated", "/sys/devices/system/cpu/isolated"),
    ("cpus nohz_full", "/sys/devices/system/cpu/nohz_full"),
    ("smt", "/sys/devices/system/cpu/smt/control"),
    ("rt runtime (us)", "/proc/sys/kernel/sched_rt_runtime_us"),
    ("rt period (us)", "/proc/sys/kernel/sched_rt_period_us"),
    ("timer migration", "/proc/sys/kernel/timer_migration"),
    ("numa balancing", "/proc/sys/kernel/numa_balancing"),
    ("transparent huge pages", "/sys/kernel/mm/transparent_hugepage/enabled"),
    ("ksm", "/sys/kernel/mm/ksm/run"),
    ("swappiness", "/proc/sys/vm/swappiness"),
    ("load average at start", "/proc/loadavg"),
];

const OF_CPU: [(&str, &str); 6] = [
    ("governor", "cpufreq/scaling_governor"),
    ("frequency driver", "cpufreq/scaling_driver"),
    ("energy preference", "cpufreq/energy_performance_preference"),
    ("frequency range from (kHz)", "cpufreq/scaling_min_freq"),
    ("frequency range to (kHz)", "cpufreq/scaling_max_freq"),
    ("smt siblings", "topology/thread_siblings_list"),
];

fn idle_states(cpu: usize) -> Option<String> {
    let name = |state: usize| {
        let path = format!("/sys/devices/system/cpu/cpu{cpu}/cpuidle/state{state}/name");
        read_to_string(path).ok().map(|name| name.trim().to_owned())
    };
    Some((0..16).map_while(name).collect::<Vec<_>>().join(" "))
}

fn field(text: &str, key: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with(key))?;
    line.split_once(':').map(|(_, value)| value.trim().to_owned())
}

fn has_flag(cpu_info: &str, flag: &str) -> bool {
    field(cpu_info, "flags").is_some_and(|flags| flags.split_whitespace().any(|found| found == flag))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_here_tells_at_least_kernel_cpus_and_command_line() {
        let found = describe(Some(rt_core::cpu::current_cpu()));
        for key in ["kernel", "kernel command line", "cpus online", "measured cpu", "memory"] {
            assert!(found.contains_key(key), "{key}: {found:?}");
        }
    }

    #[test]
    fn flags_are_whole_words() {
        let info = "model name\t: A CPU @ 2 GHz\nflags\t\t: fpu vme hypervisors\n";
        assert_eq!(field(info, "model name").unwrap(), "A CPU @ 2 GHz");
        assert!(!has_flag(info, "hypervisor") && has_flag(info, "vme"));
    }
}
