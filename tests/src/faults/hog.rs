//! A thread that takes a CPU with more right than anybody, for a bounded time. It runs in a process of its own.

use rt_core::setup::{SetupRequest, apply};
use std::time::{Duration, Instant};

/// Takes the CPU for so many milliseconds, `"1 300"`; says what it did.
///
/// # Panics
/// If the words are others.
pub fn take(words: &str) -> String {
    let (cpu, ms) = words.split_once(' ').expect("a CPU and a time");
    let until = Instant::now() + Duration::from_millis(ms.parse().expect("a time"));
    let request = SetupRequest { fifo_priority: Some(90), cpu: cpu.parse().ok(), ..SetupRequest::default() };
    let (report, _guards) = apply(&request);
    if !["scheduling", "cpu"].iter().all(|name| report.find(name).is_some_and(|item| item.obtained)) {
        return format!("skipped: no right to take a CPU\n{report}");
    }
    while Instant::now() < until {
        std::hint::spin_loop();
    }
    format!("took CPU {cpu} for {ms} ms")
}
