//! What a loop built on this crate does to the system: nothing that is not asked for.

use patience::BoundedThread;
use rt_core::alloc_guard::{self, CountingAllocator};
use rt_core::epitaph::{EpitaphKind, EpitaphRef, empty_epitaph};
use rt_core::histogram::Histogram;
use rt_core::log::{LogLevel, channel};
use rt_core::periodic::{Periodic, PeriodicConfig, Wake};
use rt_core::usage::ResourceUsage;
use std::hint::black_box;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const PERIOD_NS: u64 = 500_000;
const WAITS: usize = 1_000;

/// One tick of a loop that does what loops do: wait, record, now and then log.
fn tick(periodic: &mut Periodic, histogram: &mut Histogram, log: &mut rt_core::log::RtLog) -> Wake {
    let wake = periodic.wait();
    histogram.record(wake.latency_ns());
    if wake.tick.is_multiple_of(100) {
        log.push(LogLevel::Info, wake.tick, "latency {} ns", &[wake.latency_ns() as f64]);
    }
    wake
}

#[test]
fn a_hybrid_loop_neither_allocates_nor_faults_once_warm() {
    alloc_guard::assert_installed();
    let mut periodic = Periodic::new(PeriodicConfig::hybrid(PERIOD_NS));
    let mut histogram = Histogram::new();
    let (mut log, drain) = channel(16);
    // Touches the whole queue, and lets the dynamic linker bind what the loop calls.
    for _ in 0..64 {
        log.push(LogLevel::Info, 0, "warm", &[]);
        tick(&mut periodic, &mut histogram, &mut log);
    }
    // A loop that faults by itself does so in every run. A page taken away under memory pressure is
    // the machine's doing and comes once: this test does not lock its memory, for want of rights.
    let mut faults = Vec::new();
    for _ in 0..3 {
        let before = ResourceUsage::of_thread();
        let (completed, heap_calls) = alloc_guard::count(|| {
            (0..WAITS).filter(|_| !tick(&mut periodic, &mut histogram, &mut log).interrupted).count()
        });
        let usage = ResourceUsage::of_thread().delta(&before);
        assert_eq!((completed, heap_calls), (WAITS, 0));
        faults.push(usage.minor_faults + usage.major_faults);
        if usage.minor_faults + usage.major_faults == 0 {
            break;
        }
    }
    assert_eq!(faults.last(), Some(&0), "page faults in each run of {WAITS} waits: {faults:?}");
    assert!(drain.lost() > 0, "nobody drained: the full log was part of the test");
}

#[test]
fn a_loop_that_allocates_is_caught() {
    let mut periodic = Periodic::new(PeriodicConfig::hybrid(PERIOD_NS));
    let allocating_tick = || drop(black_box(vec![periodic.wait()]));
    assert_eq!(alloc_guard::count(allocating_tick).1, 2, "one allocation, one release");
}

#[test]
fn last_words_need_no_heap() {
    let words = empty_epitaph();
    let long = "x".repeat(1_000);
    let ((), heap_calls) = alloc_guard::count(|| {
        assert!(EpitaphRef::new(&words).write(EpitaphKind::Fault, 1, &long));
    });
    assert_eq!(heap_calls, 0);
}

#[test]
fn other_threads_do_not_disturb_the_count_and_counts_nest() {
    let noise = std::thread::spawn(|| (0..10_000).for_each(|n| drop(black_box(vec![n]))));
    let (inner, outer) = alloc_guard::count(|| {
        let ((), inner) = alloc_guard::count(|| drop(black_box(Box::new(1))));
        drop(black_box(Box::new(2)));
        inner
    });
    assert_eq!((inner, outer), (2, 4));
    noise.bounded_join().unwrap();
}
