//! Does memory stay where it is: can it be locked, does a loop fault, is there swap, are locked pages moved?

use super::machine::{Machine, Obstacle, if_any, one_line};
use super::step::{Action, Step};
use super::{Check, Group, Judged, Judgement, Remedy};
use crate::setup::memory::judge_lock;
use nix::errno::Errno;

/// These checks.
pub const GROUP: Group = Group {
    name: "memory",
    checks: &[
        Check {
            id: "memory.lock",
            title: "locking, tried",
            why: "A page that the kernel took away comes back from disk: milliseconds. All memory was really locked and \
                  the count read back.",
            run: lock,
        },
        Check {
            id: "memory.faults",
            title: "page faults, tried",
            why: "A loop that uses only memory which it touched before should cause none; if it does, somebody moves \
                  pages.",
            run: faults,
        },
        Check {
            id: "memory.swap",
            title: "swap",
            why: "What is not locked may be swapped out: libraries of the application, and whatever a missing right \
                  left unlocked.",
            run: swap,
        },
        Check {
            id: "memory.compaction",
            title: "compaction",
            why: "When the kernel makes room for large blocks it may move locked pages, too: whoever uses one meanwhile \
                  waits until it has been copied, milliseconds at worst.",
            run: compaction,
        },
    ],
};

fn lock(machine: &Machine<'_>) -> Judged {
    let probe = machine.probes.memory_lock();
    let guarantee = judge_lock(probe.asked.map_err(Errno::from_raw), &probe.status, probe.limit);
    Ok(match guarantee.remedy {
        None => Judgement::pass(guarantee.found),
        Some(remedy) if guarantee.found == "unreadable" => {
            Judgement::unreadable("the count of locked pages is unreadable", Remedy::words(remedy))
        }
        Some(remedy) => {
            let step = Step { what: "let members of the group lock memory".into(), action: Action::Limits };
            let steps = probe.limit.map(|_| step);
            let found = match probe.limit {
                Some(bytes) => format!("{}, limit {} KiB", guarantee.found, bytes / 1024),
                None => guarantee.found,
            };
            Judgement::fail(found, Remedy::steps(remedy, steps))
        }
    })
}

fn faults(machine: &Machine<'_>) -> Judged {
    Ok(match machine.probes.loop_faults(machine.spec.cpu) {
        Ok(0) => Judgement::pass("none in 50 rounds over 1 MiB"),
        Ok(count) => {
            let text =
                "switch off what moves pages: NUMA balancing, KSM, transparent huge pages, memory compaction";
            Judgement::warn(format!("{count} in 50 rounds over 1 MiB"), Remedy::words(text))
        }
        Err(error) => {
            let text = "choose a CPU that is open to this process";
            Judgement::unreadable(one_line(&error, 60), Remedy::words(text))
        }
    })
}

fn swap(machine: &Machine<'_>) -> Judged {
    const SWAPS: &str = "/proc/swaps";
    let text = machine.text(SWAPS)?;
    if !text.starts_with("Filename") {
        return Err(Obstacle::garbled(SWAPS, &text));
    }
    let areas: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    if areas.is_empty() {
        return Ok(Judgement::pass("none"));
    }
    let step = Step { what: "no swapping".into(), action: Action::SwapOff };
    let text = "swapoff -a, and take the swap lines out of /etc/fstab (systemd: mask the swap units)";
    Ok(Judgement::warn(one_line(&areas.join(", "), 60), Remedy::steps(text, [step])))
}

fn compaction(machine: &Machine<'_>) -> Judged {
    const SWITCH: &str = "/proc/sys/vm/compact_unevictable_allowed";
    match if_any(machine.number::<u8>(SWITCH))? {
        None => Ok(Judgement::pass("this kernel has none")),
        Some(0) => Ok(Judgement::pass("locked pages stay where they are")),
        Some(1) => {
            let step =
                Step::sysctl("leave locked pages where they are", "vm.compact_unevictable_allowed", 0, 1);
            Ok(Judgement::warn(
                "locked pages may be moved",
                Remedy::steps("sysctl vm.compact_unevictable_allowed=0", [step]),
            ))
        }
        Some(other) => Err(Obstacle::garbled(SWITCH, &other.to_string())),
    }
}
