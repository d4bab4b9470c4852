//! Set-up on the machine at hand: whatever it grants, the report says the truth.
//!
//! A program of its own, since locked memory and a tuned allocator last as long as the process. The
//! expectations are formed by other means than the crate's: `/proc`, not the system calls.

use patience::prelude::*;
use rt_core::cpu;
use rt_core::setup::{self, Guarantee, SetupReport, SetupRequest};
use std::fs::read_to_string;

/// Everything at once, on a thread of its own, which ends before anything else runs.
#[test]
fn the_report_says_what_is_in_force() {
    let cpu = *cpu::online_cpus().last().unwrap();
    let request = SetupRequest {
        // Lowest: enough to see it, and no harm to the machine.
        fifo_priority: Some(1),
        cpu: Some(cpu),
        lock_memory: true,
        prefault_stack_bytes: 256 << 10,
        prefault_heap_bytes: 4 << 20,
        timer_slack_ns: Some(1),
        dma_latency_us: Some(100),
    };
    let thread = std::thread::spawn(move || check_in_force(&request, cpu));
    let report = thread.bounded_join().unwrap();
    println!("{report}");
    let names: Vec<_> =
        report.guarantees.iter().filter(|g| g.name != "fair server").map(|g| g.name).collect();
    let expected = ["cpu", "cpu isolation", "memory locked", "heap prefaulted", "stack prefaulted"];
    assert_eq!(names[..5], expected);
    assert_eq!(names[5..], ["timer slack", "dma latency", "scheduling", "kernel", "rt throttling"]);
    for guarantee in &report.guarantees {
        assert_eq!(guarantee.obtained, guarantee.remedy.is_none(), "{guarantee}");
    }
}

fn check_in_force(request: &SetupRequest, cpu: usize) -> SetupReport {
    let (report, guards) = setup::apply(request);
    let item = |name| report.find(name).unwrap();
    let status = read_to_string("/proc/thread-self/status").unwrap();

    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
    check(item("cpu"), cpu::parse_cpu_list(allowed) == Some(vec![cpu]));

    let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap();
    assert!(!item("memory locked").obtained || !locked.trim().starts_with("0 "), "{locked}");

    // proc(5), stat: field 41 is the policy; fields are counted behind the name's parenthesis.
    let stat = read_to_string("/proc/thread-self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let (priority, policy) = (fields[40 - 3], fields[41 - 3]);
    check(item("scheduling"), (priority, policy) == ("1", "1"));

    // Neither needs rights; glibc alone can be told to keep its pages.
    assert!(item("stack prefaulted").obtained, "{report}");
    assert!(item("heap prefaulted").obtained || !cfg!(target_env = "gnu"), "{report}");

    check(item("dma latency"), guards.holds_dma_latency());
    check_that_children_are_not_real_time();
    report
}

fn check(guarantee: &Guarantee, in_force: bool) {
    assert_eq!(guarantee.obtained, in_force, "{guarantee}");
    if !in_force {
        println!("not tested in force on this machine: {guarantee}");
    }
}

/// A thread that inherited the priority would preempt the loop that started it.
fn check_that_children_are_not_real_time() {
    let stat =
        std::thread::spawn(|| read_to_string("/proc/thread-self/stat").unwrap()).bounded_join().unwrap();
    let policy = stat.rsplit_once(')').unwrap().1.split_whitespace().nth(41 - 3).unwrap().to_owned();
    assert_eq!(policy, "0");
}

#[test]
fn asking_for_nothing_changes_and_reports_nothing() {
    let (report, guards) = setup::apply(&SetupRequest::default());
    assert!(report.guarantees.is_empty() && !guards.holds_dma_latency());
}

#[test]
fn what_cannot_be_had_is_missing_and_not_fatal() {
    let request = SetupRequest {
        fifo_priority: Some(200),
        cpu: Some(100_000),
        prefault_heap_bytes: 1 << 60,
        ..SetupRequest::default()
    };
    let thread = std::thread::spawn(move || setup::apply(&request).0);
    let report = thread.bounded_join().unwrap();
    for name in ["scheduling", "cpu", "heap prefaulted"] {
        assert!(!report.find(name).unwrap().obtained, "{report}");
    }
    assert!(!report.all_requests_obtained());
}
