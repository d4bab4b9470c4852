//! What the filter costs a loop: the same calls in one process, before and after it is put into force.
//!
//! A measurement, not a gate: `cargo test --release -p rt-core --test sandbox_cost -- --ignored --nocapture`.
//! Ratios within one run; absolute numbers are the machine's.

use rt_core::sandbox::{AllowedCall, Only, shut};
use std::sync::atomic::AtomicU32;
use std::time::Instant;

/// Rounds of which the median is taken, and calls in each.
const ROUNDS: usize = 201;
const CALLS: u32 = 2000;

type Measured = [(&'static str, fn()); 3];

/// Calls that return at once: what is measured is the way into the kernel and back, where the filter stands.
const MEASURED: Measured = [
    ("clock_nanosleep (refused time, no condition)", || {
        let no_time = libc::timespec { tv_sec: 0, tv_nsec: -1 };
        // SAFETY: the time is ours and only read.
        let error = unsafe {
            libc::clock_nanosleep(
                libc::CLOCK_MONOTONIC,
                libc::TIMER_ABSTIME,
                &raw const no_time,
                std::ptr::null_mut(),
            )
        };
        assert_eq!(error, libc::EINVAL);
    }),
    ("futex (nobody to wake, no condition)", || {
        let word = AtomicU32::new(0);
        // SAFETY: the word is ours; waking touches nothing.
        let woken = unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAKE, 1) };
        assert_eq!(woken, 0);
    }),
    ("fcntl (no such descriptor, one condition)", || {
        // SAFETY: there is no such descriptor.
        assert_eq!(unsafe { libc::fcntl(-1, libc::F_GETFD) }, -1);
    }),
];

/// As long as the driver's list, most of it standing before the hot ones by number.
fn calls() -> Vec<AllowedCall> {
    let call = |number, only| AllowedCall { name: "padding", number, only, reason: "padding" };
    let mut calls: Vec<AllowedCall> = (0..40).map(|number| call(number, Only::Any)).collect();
    let more = [
        libc::SYS_clock_nanosleep,
        libc::SYS_futex,
        libc::SYS_exit_group,
        libc::SYS_gettid,
        libc::SYS_getpid,
    ];
    calls.extend(more.iter().filter(|number| **number >= 40).map(|number| call(*number, Only::Any)));
    let quiet =
        [libc::SYS_sigaltstack, libc::SYS_munmap, libc::SYS_madvise, libc::SYS_exit, libc::SYS_pread64];
    calls.extend(quiet.iter().filter(|number| **number >= 40).map(|number| call(*number, Only::Any)));
    calls.retain(|call| call.number != libc::SYS_fcntl);
    calls.push(call(libc::SYS_fcntl, Only::OneOf(1, &[libc::F_GETFD as u32])));
    calls
}

/// Median time of a call (ns).
fn cost_ns(f: fn()) -> f64 {
    let mut rounds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let begun = Instant::now();
            (0..CALLS).for_each(|_| f());
            begun.elapsed().as_nanos() as f64 / f64::from(CALLS)
        })
        .collect();
    rounds.sort_by(f64::total_cmp);
    rounds[ROUNDS / 2]
}

#[test]
#[ignore = "a measurement, and the filter stays for the rest of the process"]
fn the_filter_costs_the_loop_little() {
    let before = MEASURED.map(|(_, f)| cost_ns(f));
    let guarantee = shut(&calls(), &[]);
    println!("{guarantee}");
    assert!(guarantee.obtained);
    for ((name, f), before) in MEASURED.iter().zip(before) {
        let after = cost_ns(*f);
        println!(
            "{name}: {before:.0} ns without, {after:.0} ns with: {:+.0} ns, x {:.2}",
            after - before,
            after / before
        );
    }
    // The runner's own end is not on the list.
    std::process::exit(0)
}
