//! What the machine makes of a real-time thread: kind of kernel, throttling, fair server.
//!
//! The process cannot change these, but without them its own guarantees are worth less: a FIFO
//! thread on an ordinary kernel waits for spinlocks and soft interrupts, and one that spins is
//! stopped for tens of milliseconds a second.

use super::report::Guarantee;
use crate::cpu::current_cpu;
use crate::installed::MACHINE_UNIT;
use crate::read_back::ReadBack;
use std::fs::read_to_string;

/// What there is to say about a real-time thread on `cpu`, or else on the one it runs on now.
pub(super) fn circumstances(cpu: Option<usize>) -> Vec<Guarantee> {
    let read = |path: &str| read_to_string(path).ok();
    let release = read("/proc/sys/kernel/osrelease").unwrap_or_default();
    let cpu = cpu.unwrap_or_else(current_cpu);
    let server = fair_server_file(cpu);
    let mut guarantees = vec![
        judge_kernel(
            read("/sys/kernel/realtime").as_deref(),
            &read("/proc/sys/kernel/version").unwrap_or_default(),
            &release,
        ),
        judge_throttling(
            read("/proc/sys/kernel/sched_rt_runtime_us").as_deref(),
            read("/proc/sys/kernel/sched_rt_period_us").as_deref(),
        ),
    ];
    let told = ReadBack::of_this_machine();
    guarantees.extend(judge_fair_server(&release, read(&server).as_deref(), &server, told.as_ref()));
    guarantees
}

/// `realtime` is the sysfs file, which some real-time kernels lack; `version` is uname's.
pub(crate) fn judge_kernel(realtime: Option<&str>, version: &str, release: &str) -> Guarantee {
    let named = ["PREEMPT_RT", "PREEMPT RT"].iter().any(|name| version.contains(name));
    let obtained = named || realtime.is_some_and(|text| text.trim() == "1");
    let remedy = (!obtained).then(|| "install and boot a PREEMPT_RT kernel".to_owned());
    let kind = if obtained { "PREEMPT_RT" } else { "not PREEMPT_RT" };
    Guarantee::circumstance("kernel", "PREEMPT_RT", format!("{} {kind}", release.trim()), remedy)
}

/// `runtime` of -1 switches throttling off; one that fills the period has the same effect.
pub(crate) fn judge_throttling(runtime: Option<&str>, period: Option<&str>) -> Guarantee {
    let number = |text: Option<&str>| text.and_then(|text| text.trim().parse::<i64>().ok());
    let (found, obtained) = match (number(runtime), number(period)) {
        (Some(runtime), _) if runtime < 0 => ("off".to_owned(), true),
        (Some(runtime), Some(period)) => {
            (format!("{runtime} us of every {period} us for real-time threads"), runtime >= period)
        }
        _ => ("unreadable".to_owned(), false),
    };
    let remedy = (!obtained).then(|| {
        "sysctl kernel.sched_rt_runtime_us=-1, if the loop spins on a CPU of its own; one that sleeps \
         each tick is not throttled"
            .to_owned()
    });
    Guarantee::circumstance("rt throttling", "off", found, remedy)
}

/// Where the share of a CPU's fair server stands.
pub(crate) fn fair_server_file(cpu: usize) -> String {
    format!("/sys/kernel/debug/sched/fair_server/cpu{cpu}/runtime")
}

/// First kernel whose scheduler reserves time for ordinary threads on every CPU.
const FIRST_WITH_FAIR_SERVER: (u32, u32) = (6, 12);

/// None for kernels that have no fair server. What root `told` counts where this user cannot read `runtime`.
pub(crate) fn judge_fair_server(
    release: &str,
    runtime: Option<&str>,
    path: &str,
    told: Option<&ReadBack>,
) -> Option<Guarantee> {
    if version_of(release)? < FIRST_WITH_FAIR_SERVER {
        return None;
    }
    let told = told.and_then(|told| told.value(path));
    let runtime_ns: Option<u64> = runtime.or(told).and_then(|text| text.trim().parse().ok());
    let by_whom = if runtime.is_none() && told.is_some() { READ_BY_ROOT } else { "" };
    let found = match runtime_ns {
        Some(0) => format!("off{by_whom}"),
        Some(ns) => format!("{} us a second for ordinary threads{by_whom}", ns / 1_000),
        None => "unreadable (needs root, debugfs and no lockdown)".to_owned(),
    };
    let remedy = (runtime_ns != Some(0)).then(|| {
        format!(
            "as root: systemctl restart {MACHINE_UNIT} where its machine.conf names this CPU, or echo 0 > {path}, if the loop \
             spins on a CPU of its own"
        )
    });
    Some(Guarantee::circumstance("fair server", "off", found, remedy))
}

/// Of a setting that was published.
pub(crate) const READ_BY_ROOT: &str = ", as root read back when it was set";

/// Major and minor number of a kernel release such as `6.18.44-rt`.
pub(crate) fn version_of(release: &str) -> Option<(u32, u32)> {
    let mut numbers = release.split(|c: char| !c.is_ascii_digit());
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_back::Writers;

    /// uname's version strings as recorded on such kernels.
    const DEBIAN_RT: &str = "#1 SMP PREEMPT_RT Debian 6.12.117-1 (2025-12-04)\n";
    const OLD_RT: &str = "#1 SMP PREEMPT RT Mon Jan 6 12:00:00 UTC 2020\n";
    const ORDINARY: &str = "#1 SMP PREEMPT_DYNAMIC Tue Mar 4 10:00:00 UTC 2025\n";

    #[test]
    fn a_real_time_kernel_is_known_by_either_sign() {
        assert!(judge_kernel(Some("1\n"), ORDINARY, "6.12.0-rt").obtained);
        assert!(judge_kernel(None, DEBIAN_RT, "6.12.0").obtained);
        assert!(judge_kernel(None, OLD_RT, "4.19.0-rt").obtained);
        for realtime in [None, Some("0\n")] {
            let ordinary = judge_kernel(realtime, ORDINARY, "6.18.44\n");
            assert!(!ordinary.obtained && ordinary.circumstance);
            assert_eq!(ordinary.found, "6.18.44 not PREEMPT_RT");
        }
    }

    #[test]
    fn throttling_that_would_stop_a_spinning_thread_is_told() {
        let usual = judge_throttling(Some("950000\n"), Some("1000000\n"));
        assert!(!usual.obtained && usual.remedy.is_some());
        assert_eq!(usual.found, "950000 us of every 1000000 us for real-time threads");
        assert!(judge_throttling(Some("-1\n"), Some("1000000\n")).obtained);
        assert!(judge_throttling(Some("1000000"), Some("1000000")).obtained);
        assert_eq!(judge_throttling(None, None).found, "unreadable");
    }

    #[test]
    fn the_fair_server_is_told_where_there_is_one() {
        assert_eq!(judge_fair_server("6.11.9-generic", None, "path", None), None);
        assert_eq!(judge_fair_server("5.15.0", None, "path", None), None);
        assert_eq!(judge_fair_server("who knows", None, "path", None), None);
        assert!(judge_fair_server("6.18.44", Some("0\n"), "path", None).unwrap().obtained);
        let usual = judge_fair_server("7.0-rc1", Some("50000000\n"), "path", None).unwrap();
        assert_eq!((usual.obtained, usual.found.as_str()), (false, "50000 us a second for ordinary threads"));
        assert!(judge_fair_server("6.12.0", None, "path", None).unwrap().found.starts_with("unreadable"));
    }

    /// The driver's user may not enter debugfs, whatever root has set there.
    #[test]
    fn what_root_read_back_counts_where_the_driver_cannot_read() {
        let root = Writers { uid: 0, mode: 0o755 };
        let told = |text: &str| ReadBack::believed(root, root, text.to_owned());
        let judge = |runtime: Option<&str>, text: &str| {
            judge_fair_server("6.12.117", runtime, "/server", told(text).as_ref()).unwrap()
        };
        let off = judge(None, "set /server 0\n");
        assert!(off.obtained && off.remedy.is_none());
        assert_eq!(off.found, "off, as root read back when it was set");
        assert!(!judge(None, "kept /server 50000000\n").obtained, "the kernel refused");
        assert!(!judge(None, "set /another 0\n").obtained);
        assert!(!judge(Some("50000000\n"), "set /server 0\n").obtained, "what can be read counts");
    }
}
