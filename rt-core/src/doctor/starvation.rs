//! Who takes the CPU away from a real-time thread on purpose: throttling, fair server, cgroups.

use super::machine::{Machine, Obstacle, if_any};
use super::step::Step;
use super::{Check, Group, Judged, Judgement, Remedy};
use crate::setup::kernel::{fair_server_file, judge_fair_server, judge_throttling};

/// These checks.
pub const GROUP: Group = Group {
    name: "starvation",
    checks: &[
        Check {
            id: "starvation.rt_throttling",
            title: "real-time throttling",
            why: "By default the kernel stops real-time threads for 50 ms of each second in which they would use all \
                  of it. A loop that sleeps each tick is not touched, one that spins all the time is.",
            run: throttling,
        },
        Check {
            id: "starvation.fair_server",
            title: "fair server",
            why: "Kernels from 6.12 on reserve 50 ms a second on each CPU for ordinary threads that wait there, even \
                  with throttling switched off.",
            run: fair_server,
        },
        Check {
            id: "starvation.rt_group",
            title: "cgroup's real-time share",
            why: "With RT_GROUP_SCHED a fresh `cpu` cgroup has no real-time share, and SCHED_FIFO is refused in it \
                  with EPERM, whatever the rights.",
            run: rt_group,
        },
    ],
};

const RUNTIME: &str = "/proc/sys/kernel/sched_rt_runtime_us";
const PERIOD: &str = "/proc/sys/kernel/sched_rt_period_us";

fn throttling(machine: &Machine<'_>) -> Judged {
    let (runtime_us, period_us): (i64, i64) = (machine.number(RUNTIME)?, machine.number(PERIOD)?);
    if runtime_us < -1 || period_us <= 0 {
        return Err(Obstacle::garbled(RUNTIME, &format!("{runtime_us} of {period_us}")));
    }
    let guarantee = judge_throttling(Some(&runtime_us.to_string()), Some(&period_us.to_string()));
    if guarantee.obtained {
        return Ok(Judgement::pass(guarantee.found));
    }
    let step = Step::sysctl(
        "never stop a real-time thread (one that runs wild then keeps its CPU)",
        "kernel.sched_rt_runtime_us",
        -1,
        runtime_us,
    );
    let remedy = Remedy::steps("sysctl kernel.sched_rt_runtime_us=-1", [step]);
    Ok(match runtime_us {
        0 => Judgement::fail("0: no real-time thread may run at all", remedy),
        _ => Judgement::warn(guarantee.found, remedy),
    })
}

fn fair_server(machine: &Machine<'_>) -> Judged {
    const RELEASE: &str = "/proc/sys/kernel/osrelease";
    let release = machine.line(RELEASE)?;
    if !release.starts_with(|c: char| c.is_ascii_digit()) {
        return Err(Obstacle::garbled(RELEASE, &release));
    }
    let path = fair_server_file(machine.spec.cpu);
    let runtime_ns = machine.number::<u64>(&path);
    let text = runtime_ns.as_ref().ok().map(u64::to_string);
    let told = machine.read_back();
    let Some(guarantee) = judge_fair_server(&release, text.as_deref(), &path, told.as_ref()) else {
        return Ok(Judgement::pass("this kernel has none"));
    };
    let step =
        |former: &str| Step::put("reserve nothing for ordinary threads on this CPU", &path, "0", former);
    match runtime_ns {
        Ok(0) => Ok(Judgement::pass(guarantee.found)),
        Err(Obstacle::Denied(_) | Obstacle::Absent(_)) if guarantee.obtained => {
            Ok(Judgement::pass(guarantee.found))
        }
        Ok(ns) => {
            let remedy = Remedy::steps(format!("echo 0 > {path}"), [step(&ns.to_string())]);
            Ok(Judgement::warn(guarantee.found, remedy))
        }
        Err(Obstacle::Garbled { path, found }) => Err(Obstacle::Garbled { path, found }),
        Err(obstacle) => Ok(unreadable_server(machine, &obstacle, &path, step("50000000"))),
    }
}

/// Under lockdown nobody may read or change it; otherwise root may, where debugfs is mounted.
fn unreadable_server(machine: &Machine<'_>, obstacle: &Obstacle, path: &str, step: Step) -> Judgement {
    let lockdown = machine.chosen("/sys/kernel/security/lockdown").is_ok_and(|mode| mode != "none");
    if lockdown {
        let text = "kernel lockdown (Secure Boot) closes debugfs: switch Secure Boot off, or let the loop sleep each \
                    tick (real_time.wait = \"futex\")";
        return Judgement::unreadable(
            "closed by kernel lockdown",
            Remedy::steps(text, [Step::by_hand(text)]),
        );
    }
    const MOUNT: &str = "mount -t debugfs none /sys/kernel/debug";
    let (text, what) = match obstacle {
        Obstacle::Absent(_) => {
            (format!("as root: {MOUNT}; echo 0 > {path}"), format!("{} (before: {MOUNT})", step.what))
        }
        _ => (format!("as root: echo 0 > {path}"), step.what),
    };
    Judgement::unreadable(obstacle.to_string(), Remedy::steps(text, [Step { what, action: step.action }]))
}

fn rt_group(machine: &Machine<'_>) -> Judged {
    let groups = machine.text("/proc/self/cgroup")?;
    let is_line = |line: &str| line.splitn(3, ':').count() == 3;
    if groups.trim().is_empty() || !groups.lines().all(is_line) {
        return Err(Obstacle::garbled("/proc/self/cgroup", &groups));
    }
    let Some((controllers, group)) = groups.lines().find_map(cpu_group) else {
        return Ok(Judgement::pass("no cgroup v1 `cpu` controller"));
    };
    // Where the two are mounted together, either name leads there.
    let mounts = [format!("/sys/fs/cgroup/{controllers}"), "/sys/fs/cgroup/cpu".to_owned()];
    for mount in mounts {
        let path = format!("{mount}{}/cpu.rt_runtime_us", group.trim_end_matches('/'));
        if let Some(runtime_us) = if_any(machine.number::<i64>(&path))? {
            return Ok(judge_share(group, &path, runtime_us));
        }
    }
    Ok(Judgement::pass("the kernel does not share real-time among cgroups"))
}

/// Controllers and path of the hierarchy that has the `cpu` controller of version 1.
fn cpu_group(line: &str) -> Option<(&str, &str)> {
    let (_, rest) = line.split_once(':')?;
    let (controllers, group) = rest.split_once(':')?;
    controllers.split(',').any(|name| name == "cpu").then_some((controllers, group))
}

fn judge_share(group: &str, path: &str, runtime_us: i64) -> Judgement {
    if runtime_us != 0 {
        return Judgement::pass(format!("{runtime_us} us for cgroup {group}"));
    }
    let put = Step::put("give this cgroup a real-time share", path, "100000", "0");
    let text = format!(
        "echo 100000 > {path} (its parents need a share first), or start the driver from the root cgroup, \
         or boot with rt_group_sched=0 (kernel 6.14 or newer)"
    );
    Judgement::fail(
        format!("0 us for cgroup {group}: SCHED_FIFO is refused there"),
        Remedy::steps(text, [put]),
    )
}
