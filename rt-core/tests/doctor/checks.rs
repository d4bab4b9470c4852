//! Each check with each verdict that it can give: the well set-up workstation with one thing changed.

use crate::machines::{complaints, examine, find, load_with, spec};
use rt_core::doctor::Verdict::{self, Fail, Pass, Unreadable, Warn};
use rt_core::doctor::machine::LoopSpec;

/// Id, verdict, words of what was found, changes to the machine.
type Case<'a> = (&'a str, Verdict, &'a str, &'a str);

#[track_caller]
fn check(cases: &[Case<'_>]) {
    for (id, verdict, found, changes) in cases {
        check_for(&spec(3), (id, *verdict, found, changes));
    }
}

#[track_caller]
fn check_for(spec: &LoopSpec, (id, verdict, found, changes): Case<'_>) {
    let findings = examine(&load_with("lab-rt", changes), spec);
    let judgement = &find(&findings, id).judgement;
    assert_eq!(judgement.verdict, verdict, "{id}, {changes}: {judgement:?}");
    assert!(judgement.found.contains(found), "{id}, {changes}: {:?} lacks {found:?}", judgement.found);
}

const READ_BACK: &str = "=== /run/phantom3-machine/ mode 0755\n=== /run/phantom3-machine/read-back mode 0644";
const OLD_KERNEL: &str =
    "=== /proc/sys/kernel/osrelease\n6.1.0-49-rt-amd64\n=== /proc/irq/31/smp_affinity_list mode 0644\n3\n";

/// What root has published, with the owner and mode of directory and file, where debugfs is closed to this user.
fn published(directory: &str, file: &str, word: &str, value: &str) -> String {
    format!(
        "=== /sys/kernel/debug denied\n=== /run/phantom3-machine/{directory}\n=== /run/phantom3-machine/read-back{file}\n\
         {word} /sys/kernel/debug/sched/fair_server/cpu3/runtime {value}\n"
    )
}

fn open_published() -> String {
    published("", "", "set", "0").replace("=== /sys/kernel/debug denied\n", "")
}

#[test]
fn kernel() {
    const CLOCK: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    check(&[
        ("kernel.realtime", Pass, "6.12.117+deb12-rt-amd64 PREEMPT_RT", ""),
        (
            "kernel.realtime",
            Fail,
            "not PREEMPT_RT",
            "=== /sys/kernel/realtime\n0\n=== /proc/sys/kernel/version\n#1 SMP PREEMPT_DYNAMIC\n",
        ),
        ("kernel.realtime", Unreadable, "makes no sense", "=== /sys/kernel/realtime\nyes\n"),
        ("kernel.realtime", Unreadable, "permission denied", "=== /proc/sys/kernel/version denied\n"),
        ("kernel.isolcpus", Pass, "CPU 3 isolated", ""),
        (
            "kernel.isolcpus",
            Pass,
            "CPU 3 isolated",
            "=== /sys/devices/system/cpu/isolated\n\n=== /sys/fs/cgroup/cpuset.cpus.isolated\n3\n",
        ),
        ("kernel.isolcpus", Warn, "no CPU isolated", "=== /sys/devices/system/cpu/isolated\n\n"),
        ("kernel.isolcpus", Warn, "CPU 0-1 isolated", "=== /sys/devices/system/cpu/isolated\n0-1\n"),
        ("kernel.isolcpus", Unreadable, "makes no sense", "=== /sys/devices/system/cpu/isolated\nthree\n"),
        ("kernel.nohz_full", Pass, "CPU 3 without tick", ""),
        ("kernel.nohz_full", Warn, "no CPU without tick", "=== /sys/devices/system/cpu/nohz_full\n(null)\n"),
        ("kernel.nohz_full", Warn, "no CPU without tick", "=== /sys/devices/system/cpu/nohz_full removed\n"),
        ("kernel.nohz_full", Unreadable, "makes no sense", "=== /sys/devices/system/cpu/nohz_full\n1-\n"),
        ("kernel.rcu_nocbs", Pass, "CPU 3 offloaded", ""),
        ("kernel.rcu_nocbs", Pass, "as nohz_full implies", "=== /proc/cmdline\nquiet\n"),
        ("kernel.rcu_nocbs", Pass, "CPU 0-3 offloaded", "=== /proc/cmdline\nrcu_nocbs\n"),
        (
            "kernel.rcu_nocbs",
            Warn,
            "no CPU offloaded",
            "=== /proc/cmdline\nquiet\n=== /sys/devices/system/cpu/nohz_full removed\n",
        ),
        ("kernel.rcu_nocbs", Unreadable, "rcu_nocbs=x", "=== /proc/cmdline\nrcu_nocbs=x\n"),
    ]);
    for (verdict, found, content) in [
        (Pass, "tsc", "tsc"),
        (Warn, "kvm-clock", "kvm-clock"),
        (Fail, "hpet", "hpet"),
        (Unreadable, "makes no sense", "sundial"),
        (Unreadable, "makes no sense", ""),
    ] {
        check_for(&spec(3), ("kernel.clocksource", verdict, found, &format!("=== {CLOCK}\n{content}\n")));
    }
    check(&[("kernel.clocksource", Unreadable, "does not exist", &format!("=== {CLOCK} removed\n"))]);
}

#[test]
fn the_phase_against_the_tick() {
    const TICKING: &str = "=== /sys/devices/system/cpu/nohz_full removed\n";
    let with = |period_ns, phase_offset_ns| LoopSpec { period_ns, phase_offset_ns, ..spec(3) };
    let check_phase = |spec: &LoopSpec, verdict, found, changes: &str| {
        check_for(spec, ("kernel.tick_phase", verdict, found, changes));
    };
    check_phase(&with(1_000_000, 0), Pass, "the tick is off", "");
    check_phase(&with(1_000_000, 370_000), Pass, "at least 370 us away (tick every 4000 us)", TICKING);
    check_phase(&with(1_000_000, 0), Warn, "at least 0 us away", TICKING);
    // 3 kHz: the grid of both is a nanosecond, so the phase wanders through the tick.
    check_phase(&with(333_333, 100_000), Warn, "at least 0 us", TICKING);
    let unknown = format!("{TICKING}=== probe kernel_tick\nerror no clock\n");
    check_phase(&with(1_000_000, 370_000), Pass, "CONFIG_HZ unreadable", &unknown);
    check_phase(&with(1_000_000, 990_000), Warn, "at least 10 us away (CONFIG_HZ unreadable", &unknown);
    check_phase(
        &with(1_000_000, 0),
        Unreadable,
        "makes no sense",
        "=== /sys/devices/system/cpu/nohz_full\nx\n",
    );
}

#[test]
fn starvation() {
    const SERVER: &str = "=== /sys/kernel/debug/sched/fair_server/cpu3/runtime";
    const GROUP: &str = "=== /proc/self/cgroup\n4:cpu:/lab\n=== /sys/fs/cgroup/cpu/lab/cpu.rt_runtime_us";
    check(&[
        ("starvation.rt_throttling", Pass, "off", ""),
        (
            "starvation.rt_throttling",
            Pass,
            "1000000 us of every",
            "=== /proc/sys/kernel/sched_rt_runtime_us\n1000000\n",
        ),
        (
            "starvation.rt_throttling",
            Warn,
            "950000 us of every 1000000",
            "=== /proc/sys/kernel/sched_rt_runtime_us\n950000\n",
        ),
        (
            "starvation.rt_throttling",
            Fail,
            "no real-time thread",
            "=== /proc/sys/kernel/sched_rt_runtime_us\n0\n",
        ),
        (
            "starvation.rt_throttling",
            Unreadable,
            "makes no sense",
            "=== /proc/sys/kernel/sched_rt_runtime_us\n-7\n",
        ),
        (
            "starvation.rt_throttling",
            Unreadable,
            "does not exist",
            "=== /proc/sys/kernel/sched_rt_period_us removed\n",
        ),
        ("starvation.fair_server", Pass, "off", ""),
        ("starvation.fair_server", Pass, "has none", "=== /proc/sys/kernel/osrelease\n6.1.0-rt\n"),
        ("starvation.fair_server", Warn, "50000 us a second", &format!("{SERVER}\n50000000\n")),
        ("starvation.fair_server", Unreadable, "does not exist", "=== /sys/kernel/debug removed\n"),
        ("starvation.fair_server", Unreadable, "permission denied", "=== /sys/kernel/debug denied\n"),
        ("starvation.fair_server", Unreadable, "makes no sense", &format!("{SERVER}\nfifty\n")),
        // What root set and published counts where debugfs is closed, if root alone can have written it.
        ("starvation.fair_server", Pass, "off, as root read back", &published("", "", "set", "0")),
        (
            "starvation.fair_server",
            Warn,
            "50000 us a second",
            &format!("{SERVER}\n50000000\n{}", open_published()),
        ),
        ("starvation.fair_server", Unreadable, "permission denied", &published("", "", "kept", "50000000")),
        ("starvation.fair_server", Unreadable, "permission denied", &published(" uid 1000", "", "set", "0")),
        ("starvation.fair_server", Unreadable, "permission denied", &published("", " uid 1000", "set", "0")),
        ("starvation.fair_server", Unreadable, "permission denied", &published("", " mode 0666", "set", "0")),
        ("starvation.fair_server", Unreadable, "permission denied", &published(" mode 1777", "", "set", "0")),
        (
            "starvation.fair_server",
            Unreadable,
            "makes no sense",
            "=== /proc/sys/kernel/osrelease\nwho knows\n",
        ),
        ("starvation.rt_group", Pass, "no cgroup v1", ""),
        ("starvation.rt_group", Pass, "does not share", "=== /proc/self/cgroup\n4:cpu:/lab\n"),
        ("starvation.rt_group", Pass, "950000 us for cgroup /lab", &format!("{GROUP}\n950000\n")),
        ("starvation.rt_group", Fail, "0 us for cgroup /lab", &format!("{GROUP}\n0\n")),
        ("starvation.rt_group", Unreadable, "makes no sense", &format!("{GROUP}\nmuch\n")),
        ("starvation.rt_group", Unreadable, "makes no sense", "=== /proc/self/cgroup\ncpu\n"),
    ]);
}

#[test]
fn privilege() {
    const CAPABLE: &str =
        "=== /proc/self/status\nUid:\t0\t0\t0\t0\nGid:\t0\t0\t0\t0\nCapEff:\t0000000000804000\n";
    const LIMITED: &str =
        "=== /proc/self/limits\nMax locked memory  8388608 8388608 bytes\nMax realtime priority 0 0\n";
    check(&[
        ("privilege.rtprio", Pass, "limit 95", ""),
        ("privilege.rtprio", Pass, "CAP_SYS_NICE", CAPABLE),
        ("privilege.rtprio", Fail, "limit 0, wanted 80", LIMITED),
        ("privilege.rtprio", Unreadable, "makes no sense", "=== /proc/self/limits\nnothing\n"),
        ("privilege.rtprio", Unreadable, "makes no sense", "=== /proc/self/status\nCapEff:\tx\n"),
        ("privilege.memlock", Pass, "limit: unlimited", ""),
        ("privilege.memlock", Pass, "CAP_IPC_LOCK", CAPABLE),
        ("privilege.memlock", Fail, "limit 8192 KiB", LIMITED),
        (
            "privilege.memlock",
            Unreadable,
            "makes no sense",
            "=== /proc/self/limits\nMax locked memory lots lots\n",
        ),
        ("privilege.promotion", Pass, "SCHED_FIFO 80", ""),
        (
            "privilege.promotion",
            Fail,
            "SCHED_OTHER after asking",
            "=== probe promotion\nplaced=ok asked=1 policy=0 priority=0 limit=0\n",
        ),
        // The trap: accepted, and nothing happened.
        (
            "privilege.promotion",
            Fail,
            "SCHED_OTHER after asking",
            "=== probe promotion\nplaced=ok asked=ok policy=0 priority=0 limit=95\n",
        ),
        (
            "privilege.promotion",
            Fail,
            "not on CPU 3",
            "=== probe promotion\nplaced=22 asked=ok policy=1 priority=80 limit=95\n",
        ),
        ("privilege.promotion", Fail, "unreadable", "=== probe promotion\nnonsense\n"),
        ("privilege.irq_threads", Pass, "1 on this CPU, highest 50; the loop 80", ""),
        ("privilege.irq_threads", Pass, "none on this CPU", "=== /proc/72 removed\n"),
        ("privilege.irq_threads", Unreadable, "makes no sense", "=== /proc/72/stat\nnonsense\n"),
        ("privilege.irq_threads", Unreadable, "permission denied", "=== /proc/72/status denied\n"),
    ]);
    let low = LoopSpec { priority: Some(40), ..spec(3) };
    check_for(&low, ("privilege.irq_threads", Warn, "irq/31-nvme0q4 at 50, the loop at 40", ""));
    let ordinary = LoopSpec { priority: None, ..spec(3) };
    for id in ["privilege.rtprio", "privilege.promotion", "privilege.irq_threads"] {
        check_for(&ordinary, (id, Warn, "", ""));
    }
}

#[test]
fn interference() {
    const WIFI: &str = "=== /proc/irq/40/iwlwifi/\n=== /proc/irq/40/smp_affinity_list\n0-3\n=== /proc/irq/40/effective_affinity_list\n3\n";
    const PLAIN: &str = "=== /proc/cmdline\nquiet\n=== /sys/devices/system/cpu/isolated\n\n=== /sys/devices/system/cpu/nohz_full removed\n";
    const BALANCE: &str = "=== /proc/300/comm\nirqbalance\n";
    let plain = |more: &str| format!("{PLAIN}{more}").leak() as &str;
    check(&[
        ("interference.irq_affinity", Pass, "none", "=== /proc/irq/31 removed\n"),
        ("interference.irq_affinity", Pass, "isolcpus=managed_irq keeps them quiet", ""),
        ("interference.irq_affinity", Warn, "managed, which cannot be moved: 1 (31 nvme0q4)", PLAIN),
        ("interference.irq_affinity", Warn, "40 iwlwifi", WIFI),
        // No handler: nobody would be interrupted.
        ("interference.irq_affinity", Pass, "none", "=== /proc/irq/31/nvme0q4 removed\n"),
        // Before 6.11 a managed one's file looks writable, too: only the attempt tells.
        ("interference.irq_affinity", Warn, "whether 1 of them are managed, and cannot be moved", OLD_KERNEL),
        (
            "interference.irq_affinity",
            Pass,
            "managed, which cannot be moved: 1 (31 nvme0q4); isolcpus=managed_irq keeps them quiet",
            &format!("{OLD_KERNEL}{READ_BACK}\nkept /proc/irq/31/smp_affinity 8\n"),
        ),
        // Root's own attempt tells of the movable ones, too.
        (
            "interference.irq_affinity",
            Warn,
            "1 (40 iwlwifi); managed, which cannot be moved: 1 (31 nvme0q4)",
            &format!(
                "{WIFI}{OLD_KERNEL}{READ_BACK}\nkept /proc/irq/31/smp_affinity 8\nset /proc/irq/40/smp_affinity 7\n"
            ),
        ),
        // Sent elsewhere; it goes there when it next occurs.
        (
            "interference.irq_affinity",
            Pass,
            "none",
            "=== /proc/irq/31 removed\n=== /proc/irq/40/iwlwifi/\n=== /proc/irq/40/smp_affinity_list\n0-2\n\
             === /proc/irq/40/effective_affinity_list\n3\n",
        ),
        // The debug file of older kernels, where the affinity file looks writable.
        (
            "interference.irq_affinity",
            Pass,
            "managed, which cannot be moved: 1",
            "=== /proc/irq/31/smp_affinity_list mode 0644\n3\n=== /sys/kernel/debug/irq/irqs/31\ndstate: 0x3\n  IRQD_AFFINITY_MANAGED\n",
        ),
        (
            "interference.irq_affinity",
            Unreadable,
            "makes no sense",
            "=== /proc/irq/31/effective_affinity_list\nx\n",
        ),
        ("interference.irq_affinity", Unreadable, "does not exist", "=== /proc/irq removed\n"),
        ("interference.default_smp_affinity", Pass, "CPU 0-2", ""),
        ("interference.default_smp_affinity", Warn, "CPU 0-3", "=== /proc/irq/default_smp_affinity\nf\n"),
        (
            "interference.default_smp_affinity",
            Unreadable,
            "makes no sense",
            "=== /proc/irq/default_smp_affinity\nzz\n",
        ),
        (
            "interference.default_smp_affinity",
            Unreadable,
            "makes no sense",
            "=== /proc/irq/default_smp_affinity\n0\n",
        ),
        ("interference.workqueues", Pass, "CPU 0-2", ""),
        ("interference.workqueues", Pass, "no such mask", "=== /sys/devices/virtual/workqueue removed\n"),
        ("interference.workqueues", Warn, "CPU 0-3", "=== /sys/devices/virtual/workqueue/cpumask\nf\n"),
        (
            "interference.workqueues",
            Unreadable,
            "makes no sense",
            "=== /sys/devices/virtual/workqueue/cpumask\n-\n",
        ),
        ("interference.irqbalance", Pass, "not running", ""),
        ("interference.irqbalance", Pass, "leaves isolated CPUs alone", BALANCE),
        ("interference.irqbalance", Warn, "running", plain(BALANCE)),
        ("interference.irqbalance", Unreadable, "permission denied", "=== /proc/300/comm denied\n"),
        ("interference.thp", Pass, "madvise", ""),
        (
            "interference.thp",
            Warn,
            "always",
            "=== /sys/kernel/mm/transparent_hugepage/enabled\n[always] madvise never\n",
        ),
        ("interference.thp", Pass, "has none", "=== /sys/kernel/mm/transparent_hugepage removed\n"),
        (
            "interference.thp",
            Unreadable,
            "makes no sense",
            "=== /sys/kernel/mm/transparent_hugepage/enabled\nalways never\n",
        ),
        ("interference.ksm", Pass, "off", ""),
        ("interference.ksm", Pass, "has none", "=== /sys/kernel/mm/ksm removed\n"),
        ("interference.ksm", Pass, "separated", "=== /sys/kernel/mm/ksm/run\n2\n"),
        ("interference.ksm", Warn, "on", "=== /sys/kernel/mm/ksm/run\n1\n"),
        ("interference.ksm", Unreadable, "makes no sense", "=== /sys/kernel/mm/ksm/run\n9\n"),
        ("interference.numa_balancing", Pass, "off", ""),
        ("interference.numa_balancing", Pass, "has none", "=== /proc/sys/kernel/numa_balancing removed\n"),
        ("interference.numa_balancing", Warn, "on (1)", "=== /proc/sys/kernel/numa_balancing\n1\n"),
        (
            "interference.numa_balancing",
            Unreadable,
            "makes no sense",
            "=== /proc/sys/kernel/numa_balancing\non\n",
        ),
        ("interference.smt_sibling", Pass, "none", ""),
        (
            "interference.smt_sibling",
            Warn,
            "CPU 1 shares the core",
            "=== /sys/devices/system/cpu/cpu3/topology/thread_siblings_list\n1,3\n",
        ),
        (
            "interference.smt_sibling",
            Unreadable,
            "makes no sense",
            "=== /sys/devices/system/cpu/cpu3/topology/thread_siblings_list\n0-1\n",
        ),
        (
            "interference.smt_sibling",
            Unreadable,
            "does not exist",
            "=== /sys/devices/system/cpu/cpu3/topology removed\n",
        ),
        ("interference.watchdogs", Pass, "off", ""),
        ("interference.watchdogs", Pass, "not on this CPU", "=== /proc/sys/kernel/watchdog\n1\n"),
        (
            "interference.watchdogs",
            Warn,
            "soft lock-up watchdog on",
            "=== /proc/sys/kernel/watchdog\n1\n=== /proc/sys/kernel/watchdog_cpumask\n0-3\n",
        ),
        ("interference.watchdogs", Unreadable, "makes no sense", "=== /proc/sys/kernel/watchdog\nbark\n"),
        ("interference.timer_migration", Pass, "off", ""),
        ("interference.timer_migration", Pass, "has none", "=== /proc/sys/kernel/timer_migration removed\n"),
        (
            "interference.timer_migration",
            Pass,
            "not to isolated CPUs",
            "=== /proc/sys/kernel/timer_migration\n1\n",
        ),
        ("interference.timer_migration", Warn, "on", plain("=== /proc/sys/kernel/timer_migration\n1\n")),
        (
            "interference.timer_migration",
            Unreadable,
            "makes no sense",
            "=== /proc/sys/kernel/timer_migration\n2\n",
        ),
    ]);
}

#[test]
fn power() {
    const GOVERNOR: &str = "/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor";
    const EPP: &str = "/sys/devices/system/cpu/cpu3/cpufreq/energy_performance_preference";
    const ASPM: &str = "/sys/module/pcie_aspm/parameters/policy";
    let set = |path: &str, content: &str| format!("=== {path}\n{content}\n").leak() as &str;
    check(&[
        ("power.governor", Pass, "performance", ""),
        ("power.governor", Pass, "none", "=== /sys/devices/system/cpu/cpu3/cpufreq removed\n"),
        ("power.governor", Warn, "powersave", set(GOVERNOR, "powersave")),
        ("power.governor", Unreadable, "makes no sense", set(GOVERNOR, "warp")),
        ("power.epp", Pass, "performance", ""),
        ("power.epp", Pass, "has none", "=== /sys/devices/system/cpu/cpu3/cpufreq removed\n"),
        ("power.epp", Pass, "0", set(EPP, "0")),
        ("power.epp", Warn, "balance_power", set(EPP, "balance_power")),
        ("power.epp", Warn, "128", set(EPP, "128")),
        ("power.epp", Unreadable, "makes no sense", set(EPP, "300")),
        ("power.c_states", Pass, "C10, 890 us to leave; none while the driver holds", ""),
        ("power.c_states", Pass, "none in use", "=== /sys/devices/system/cpu/cpu3/cpuidle removed\n"),
        (
            "power.c_states",
            Pass,
            "POLL, 0 us",
            "=== /sys/devices/system/cpu/cpu3/cpuidle/state1/disable\n1\n=== probe dma_latency\nerror no\n",
        ),
        (
            "power.c_states",
            Warn,
            "cannot be held (Permission denied)",
            "=== probe dma_latency\nerror Permission denied\n",
        ),
        ("power.c_states", Fail, "limit in force is 2000000000 us", "=== probe dma_latency\nus=2000000000\n"),
        (
            "power.c_states",
            Unreadable,
            "makes no sense",
            "=== /sys/devices/system/cpu/cpu3/cpuidle/state1/latency\nlong\n",
        ),
        ("power.turbo", Pass, "off", ""),
        (
            "power.turbo",
            Pass,
            "on; for the most even times: echo 1 >",
            "=== /sys/devices/system/cpu/intel_pstate/no_turbo\n0\n",
        ),
        (
            "power.turbo",
            Pass,
            "echo 0 > /sys/devices/system/cpu/cpufreq/boost",
            "=== /sys/devices/system/cpu/intel_pstate removed\n=== /sys/devices/system/cpu/cpufreq/boost\n1\n",
        ),
        ("power.turbo", Pass, "no switch", "=== /sys/devices/system/cpu/intel_pstate removed\n"),
        (
            "power.turbo",
            Unreadable,
            "makes no sense",
            "=== /sys/devices/system/cpu/intel_pstate/no_turbo\n?\n",
        ),
        ("power.pcie_aspm", Pass, "performance", ""),
        ("power.pcie_aspm", Pass, "puts no links to sleep", "=== /sys/module/pcie_aspm removed\n"),
        (
            "power.pcie_aspm",
            Pass,
            "off at boot",
            &format!("=== {ASPM}\n[default] performance\n=== /proc/cmdline\npcie_aspm=off\n"),
        ),
        ("power.pcie_aspm", Warn, "as the firmware left it", set(ASPM, "[default] performance powersave")),
        ("power.pcie_aspm", Warn, "powersupersave", set(ASPM, "default performance [powersupersave]")),
        ("power.pcie_aspm", Unreadable, "makes no sense", set(ASPM, "[maximal]")),
        ("power.gpu", Pass, "card0 on: never switched off", ""),
        ("power.gpu", Pass, "no GPU", "=== /sys/class/drm removed\n"),
        ("power.gpu", Warn, "card0 auto", set("/sys/class/drm/card0/device/power/control", "auto")),
        (
            "power.gpu",
            Unreadable,
            "makes no sense",
            set("/sys/class/drm/card0/device/power/control", "maybe"),
        ),
    ]);
}

#[test]
fn firmware() {
    const VIRTUAL: &str = "=== /proc/cpuinfo\nflags\t\t: fpu hypervisor\n";
    const STAT: &str = "=== /proc/stat\ncpu  1 1 1 1 1 1 1 1 0 0\ncpu3 100 0 0 897 0 0 0 3 0 0\n";
    let gaps = |text: &str| format!("=== probe gaps\n{text}\n").leak() as &str;
    let virtual_gaps = |text: &str| format!("{VIRTUAL}=== probe gaps\n{text}\n").leak() as &str;
    check(&[
        ("firmware.virtualisation", Pass, "none seen", ""),
        (
            "firmware.virtualisation",
            Warn,
            "yes (KVM Box)",
            &format!("{VIRTUAL}=== /sys/class/dmi/id/product_name\nKVM Box\n"),
        ),
        (
            "firmware.virtualisation",
            Warn,
            "yes (QEMU Virtual Machine)",
            "=== /sys/class/dmi/id/product_name\nQEMU Virtual Machine\n",
        ),
        (
            "firmware.virtualisation",
            Pass,
            "none seen",
            "=== /sys/class/dmi/id/product_name\nPrecision 3660\n",
        ),
        ("firmware.virtualisation", Warn, "yes (xen)", "=== /sys/hypervisor/type\nxen\n"),
        ("firmware.virtualisation", Unreadable, "makes no sense", "=== /proc/cpuinfo\nnothing\n"),
        ("firmware.steal", Pass, "none since boot", ""),
        ("firmware.steal", Warn, "0.30 %", STAT),
        ("firmware.steal", Unreadable, "makes no sense", "=== /proc/stat\ncpu3 1 2 3\n"),
        ("firmware.steal", Unreadable, "makes no sense", "=== /proc/stat\ncpu3 1 2 3 4 5 6 7 x\n"),
        ("firmware.smi", Pass, "12 since boot, 0 an hour", ""),
        ("firmware.smi", Pass, "none since boot", "=== probe smi_count\ncount=0\n"),
        ("firmware.smi", Warn, "since boot, 100 an hour", "=== probe smi_count\ncount=24000\n"),
        ("firmware.smi", Unreadable, "hidden by the hypervisor", VIRTUAL),
        ("firmware.smi", Unreadable, "No such file", "=== probe smi_count\nerror No such file\n"),
        ("firmware.smi", Unreadable, "makes no sense", "=== /proc/uptime\nlong\n"),
        ("firmware.latency", Pass, "longest 6 us in 200 ms", ""),
        (
            "firmware.latency",
            Warn,
            "150 us in 200 ms, 3 longer than 20 us",
            gaps("largest_ns=150000 long_gaps=3 fifo=1 preemptions=0"),
        ),
        (
            "firmware.latency",
            Fail,
            "longest 900 us in 200 ms, 4 longer than 20 us; 2 SMIs",
            gaps("largest_ns=900000 long_gaps=4 fifo=1 preemptions=0 smi=2"),
        ),
        // Somebody else may have been the cause: another thread, or the hypervisor.
        (
            "firmware.latency",
            Unreadable,
            "other threads ran 2 times",
            gaps("largest_ns=900000 long_gaps=4 fifo=1 preemptions=2"),
        ),
        (
            "firmware.latency",
            Warn,
            "without real-time priority",
            gaps("largest_ns=900000 long_gaps=4 fifo=0 preemptions=0"),
        ),
        (
            "firmware.latency",
            Warn,
            "900 us",
            virtual_gaps("largest_ns=900000 long_gaps=4 fifo=1 preemptions=0"),
        ),
        ("firmware.latency", Unreadable, "cannot run on CPU 3", gaps("error cannot run on CPU 3")),
    ]);
}

#[test]
fn memory() {
    check(&[
        ("memory.lock", Pass, "9000 KiB locked, 8000 KiB resident", ""),
        (
            "memory.lock",
            Fail,
            "limit 8192 KiB",
            "=== probe memory_lock\nasked=12 locked=0 resident=8000 limit=8388608\n",
        ),
        (
            "memory.lock",
            Fail,
            "100 KiB locked, 8000 KiB resident",
            "=== probe memory_lock\nasked=ok locked=100 resident=8000\n",
        ),
        ("memory.lock", Unreadable, "unreadable", "=== probe memory_lock\nasked=ok locked=? resident=?\n"),
        ("memory.faults", Pass, "none", ""),
        ("memory.faults", Warn, "7 in 50 rounds", "=== probe loop_faults\nfaults=7\n"),
        ("memory.faults", Unreadable, "cannot run", "=== probe loop_faults\nerror cannot run\n"),
        ("memory.swap", Pass, "none", ""),
        (
            "memory.swap",
            Warn,
            "/dev/sda3",
            "=== /proc/swaps\nFilename Type Size Used Priority\n/dev/sda3 partition 1 0 -2\n",
        ),
        ("memory.swap", Unreadable, "makes no sense", "=== /proc/swaps\n/dev/sda3\n"),
        ("memory.compaction", Pass, "stay where they are", ""),
        ("memory.compaction", Pass, "has none", "=== /proc/sys/vm/compact_unevictable_allowed removed\n"),
        ("memory.compaction", Warn, "may be moved", "=== /proc/sys/vm/compact_unevictable_allowed\n1\n"),
        (
            "memory.compaction",
            Unreadable,
            "makes no sense",
            "=== /proc/sys/vm/compact_unevictable_allowed\nyes\n",
        ),
    ]);
}

#[test]
fn on_a_machine_with_one_cpu_nothing_is_sent_to_another() {
    let changes = "=== /sys/devices/system/cpu/online\n3\n=== /proc/irq/default_smp_affinity\n8\n=== /proc/irq/31/smp_affinity_list\n3\n";
    let findings = examine(&load_with("lab-rt", changes), &spec(3));
    for (id, found) in
        [("interference.irq_affinity", "no other CPU"), ("interference.default_smp_affinity", "no other")]
    {
        let judgement = &find(&findings, id).judgement;
        assert!(judgement.found.contains(found), "{judgement:?}");
        assert!(judgement.remedy.as_ref().unwrap().steps.is_empty(), "{judgement:?}");
    }
    assert_eq!(complaints(&findings).len(), 2);
}

/// Rather move the loop than boot again.
#[test]
fn where_another_cpu_is_isolated_the_remedy_names_it() {
    let findings = examine(&load_with("lab-rt", ""), &spec(2));
    let remedy = find(&findings, "kernel.isolcpus").judgement.remedy.as_ref().unwrap();
    assert!(
        remedy
            .text
            .starts_with("set real_time.cpu = 3 in the driver's configuration; or boot with isolcpus=")
    );
}
