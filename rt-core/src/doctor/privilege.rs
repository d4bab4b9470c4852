//! May the loop become real-time and lock its memory, and does it really?

use super::machine::{Machine, Obstacle};
use super::step::{Action, Step};
use super::{Check, Group, Judged, Judgement, Remedy};
use crate::cpu::parse_cpu_list;
use crate::installed::GROUP as REAL_TIME_GROUP;
use crate::setup::memory::field;
use crate::setup::scheduling::judge_fifo;
use crate::sys::sched::Policy;
use nix::errno::Errno;

/// These checks.
pub const GROUP: Group = Group {
    name: "privilege",
    checks: &[
        Check {
            id: "privilege.rtprio",
            title: "right to real-time priority",
            why: "Without RLIMIT_RTPRIO or CAP_SYS_NICE the kernel refuses SCHED_FIFO.",
            run: rtprio,
        },
        Check {
            id: "privilege.memlock",
            title: "right to lock memory",
            why: "Without RLIMIT_MEMLOCK=unlimited or CAP_IPC_LOCK memory cannot be locked for good, and a page that \
                  was taken away costs milliseconds.",
            run: memlock,
        },
        Check {
            id: "privilege.promotion",
            title: "promotion, tried",
            why: "A promotion may be refused for reasons that no limit shows, or be accepted and silently do nothing; \
                  so a thread was really promoted and its policy read back.",
            run: promotion,
        },
        Check {
            id: "privilege.irq_threads",
            title: "interrupt threads",
            why: "Interrupt threads above the loop's priority preempt it; at the same priority they wait for each other.",
            run: irq_threads,
        },
    ],
};

const LIMITS: &str = "/proc/self/limits";
const STATUS: &str = "/proc/self/status";
const CAP_IPC_LOCK: u32 = 14;
const CAP_SYS_NICE: u32 = 23;

fn rtprio(machine: &Machine<'_>) -> Judged {
    let Some(priority) = machine.spec.priority else {
        return Ok(Judgement::warn("the configuration asks for no real-time priority", ask_for_priority()));
    };
    if has_capability(machine, CAP_SYS_NICE)? {
        return Ok(Judgement::pass("CAP_SYS_NICE"));
    }
    let limit = hard_limit(machine, "Max realtime priority")?;
    let found = limit.map_or_else(|| "limit: unlimited".to_owned(), |limit| format!("limit {limit}"));
    if limit.is_none_or(|limit| limit >= u64::from(priority)) {
        return Ok(Judgement::pass(found));
    }
    Ok(Judgement::fail(format!("{found}, wanted {priority}"), limits("rtprio 95", "cap_sys_nice")))
}

fn ask_for_priority() -> Remedy {
    Remedy::words("set real_time.priority = 80 in the driver's configuration")
}

fn memlock(machine: &Machine<'_>) -> Judged {
    if has_capability(machine, CAP_IPC_LOCK)? {
        return Ok(Judgement::pass("CAP_IPC_LOCK"));
    }
    match hard_limit(machine, "Max locked memory")? {
        None => Ok(Judgement::pass("limit: unlimited")),
        Some(bytes) => {
            let found = format!("limit {} KiB", bytes / 1024);
            Ok(Judgement::fail(found, limits("memlock unlimited", "cap_ipc_lock")))
        }
    }
}

fn limits(item: &str, capability: &str) -> Remedy {
    let what = "let members of the group take real-time priority and lock memory";
    let text = format!(
        "\"@{REAL_TIME_GROUP} - {item}\" in /etc/security/limits.d, membership in that group, a new login (in a systemd unit: \
         LimitRTPRIO=95, LimitMEMLOCK=infinity); or setcap {capability}+ep on the program"
    );
    Remedy::steps(text, [Step { what: what.into(), action: Action::Limits }])
}

fn has_capability(machine: &Machine<'_>, bit: u32) -> Result<bool, Obstacle> {
    let status = machine.text(STATUS)?;
    let bits = field(&status, "CapEff:").and_then(|bits| u64::from_str_radix(bits, 16).ok());
    bits.map(|bits| bits >> bit & 1 == 1).ok_or_else(|| Obstacle::garbled(STATUS, &status))
}

/// The hard limit, which a process may take without asking; none for "unlimited".
fn hard_limit(machine: &Machine<'_>, name: &str) -> Result<Option<u64>, Obstacle> {
    let limits = machine.text(LIMITS)?;
    let garbled = || Obstacle::garbled(LIMITS, &limits);
    let line = limits.lines().find_map(|line| line.strip_prefix(name)).ok_or_else(garbled)?;
    match line.split_whitespace().nth(1) {
        Some("unlimited") => Ok(None),
        word => word.and_then(|word| word.parse().ok()).map(Some).ok_or_else(garbled),
    }
}

fn promotion(machine: &Machine<'_>) -> Judged {
    let (cpu, Some(priority)) = (machine.spec.cpu, machine.spec.priority) else {
        return Ok(Judgement::warn("not tried: the configuration asks for none", ask_for_priority()));
    };
    let probe = machine.probes.promotion(cpu, priority);
    let errno = |raw: i32| Errno::from_raw(raw);
    let found = probe.found.map(|(policy, priority)| Policy { policy, priority }).map_err(errno);
    let guarantee = judge_fifo(priority, probe.asked.map_err(errno), found, probe.rtprio_limit);
    if let (true, Err(raw)) = (guarantee.obtained, probe.placed) {
        let found = format!("{}, but not on CPU {cpu}: {}", guarantee.found, errno(raw));
        let text = "choose a CPU open to this process, or widen its cpuset";
        return Ok(Judgement::fail(found, Remedy::words(text)));
    }
    Ok(match guarantee.remedy {
        None => Judgement::pass(guarantee.found),
        Some(remedy) => Judgement::fail(format!("{} after asking", guarantee.found), Remedy::words(remedy)),
    })
}

/// An interrupt's thread.
struct IrqThread {
    name: String,
    priority: i64,
}

fn irq_threads(machine: &Machine<'_>) -> Judged {
    let Some(priority) = machine.spec.priority.map(i64::from) else {
        return Ok(Judgement::warn("the loop has no real-time priority", ask_for_priority()));
    };
    let threads = irq_threads_on(machine)?;
    let above: Vec<&IrqThread> = threads.iter().filter(|thread| thread.priority >= priority).collect();
    let highest = threads.iter().map(|thread| thread.priority).max();
    let Some(worst) = above.iter().max_by_key(|thread| thread.priority) else {
        let found = highest.map_or_else(
            || "none on this CPU".to_owned(),
            |highest| format!("{} on this CPU, highest {highest}; the loop {priority}", threads.len()),
        );
        return Ok(Judgement::pass(found));
    };
    let found = format!(
        "{} at {}, the loop at {priority} ({} such threads)",
        worst.name,
        worst.priority,
        above.len()
    );
    let text = format!(
        "set real_time.priority above {} in the driver's configuration (at most 98), or move those interrupts away",
        worst.priority
    );
    Ok(Judgement::warn(found, Remedy::steps(text.clone(), [Step::by_hand(text)])))
}

fn irq_threads_on(machine: &Machine<'_>) -> Result<Vec<IrqThread>, Obstacle> {
    let mut threads = Vec::new();
    for (pid, name) in processes(machine)? {
        if !name.starts_with("irq/") {
            continue;
        }
        let (stat_file, status_file) = (format!("/proc/{pid}/stat"), format!("/proc/{pid}/status"));
        let (stat, status) = (machine.text(&stat_file)?, machine.text(&status_file)?);
        let priority = real_time_priority(&stat).ok_or_else(|| Obstacle::garbled(stat_file, &stat))?;
        let cpus = field(&status, "Cpus_allowed_list:").and_then(parse_cpu_list);
        let cpus = cpus.ok_or_else(|| Obstacle::garbled(status_file, &status))?;
        if cpus.contains(&machine.spec.cpu) {
            threads.push(IrqThread { name, priority });
        }
    }
    Ok(threads)
}

/// Number and name of every process that did not end while we looked.
pub(super) fn processes(machine: &Machine<'_>) -> Result<Vec<(String, String)>, Obstacle> {
    let names = machine.names("/proc")?;
    let pids = names.into_iter().filter(|name| name.bytes().all(|byte| byte.is_ascii_digit()));
    let mut processes = Vec::new();
    for pid in pids {
        match machine.text_if_any(&format!("/proc/{pid}/comm")) {
            Ok(Some(name)) => processes.push((pid, name.trim().to_owned())),
            // A process may give itself any name, and end at any time.
            Ok(None) | Err(Obstacle::Garbled { .. } | Obstacle::Failed { .. }) => {}
            Err(obstacle) => return Err(obstacle),
        }
    }
    Ok(processes)
}

/// proc(5), stat: field 40, counted behind the name's parenthesis, in which anything may stand.
fn real_time_priority(stat: &str) -> Option<i64> {
    let (_, fields) = stat.rsplit_once(')')?;
    fields.split_whitespace().nth(40 - 3)?.parse().ok()
}
