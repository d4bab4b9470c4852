//! What a driver does about deadlines that it missed: skip, catch up, or stop.
//!
//! The loop stands still for a while in a tick of the test's choice. Nothing is asserted about time but the
//! tie between tick numbers and deadlines, and that as many deadlines passed as the standstill is long.

use crate::in_turn;
use io_driver::meter;
use shm_abi::{DriverState, FaultReason, Frame};
use std::sync::atomic::Ordering;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::stand::{RATE_HZ, Setup, Stand};

const PERIOD_NS: u64 = (1e9 / RATE_HZ) as u64;
/// The tick after which the loop stands still, and for how long.
const STALL_AT: u64 = 300;
const STALL_MS: u64 = 40;
const STALL_TICKS: u64 = STALL_MS * 1_000_000 / PERIOD_NS;

/// A driver that stalls once, and its frames from before until long after.
fn stalled(policy: &str) -> (Stand, Vec<Frame>) {
    let setup = Setup {
        config: format!("[real_time.overruns]\n{policy}"),
        ..Setup::new("real").sabotaged(&format!("hang:{STALL_MS}@{STALL_AT}"))
    };
    let stand = Stand::start(setup);
    let view = stand.view();
    wait_for("the ticks after the stall", || view.latest_tick() > Some(STALL_AT + STALL_TICKS + 200));
    let mut frames = Vec::new();
    for tick in STALL_AT - 50..STALL_AT + STALL_TICKS + 150 {
        let mut frame: Frame = bytemuck::Zeroable::zeroed();
        if view.read_frame(tick, &mut frame).is_ok() {
            frames.push(frame);
        }
    }
    (stand, frames)
}

/// The longest wake error that the driver tells (ns); it counts from the first deadline that was left out.
fn longest_wake_error_ns(stand: &Stand) -> u64 {
    meter::read(&stand.view().wake_error_ns).max()
}

/// Deadlines stay on their grid whatever happened.
fn check_grid(frames: &[Frame]) {
    for pair in frames.windows(2) {
        let ticks = pair[1].tick - pair[0].tick;
        assert_eq!(pair[1].deadline_ns - pair[0].deadline_ns, ticks * PERIOD_NS);
    }
}

fn skipped_after_the_stall(frames: &[Frame]) -> u64 {
    let next = frames.iter().map(|frame| frame.tick).find(|tick| *tick > STALL_AT);
    next.expect("it goes on") - STALL_AT - 1
}

#[test]
fn by_default_missed_deadlines_are_left_out_and_counted() {
    let _turn = in_turn();
    let (stand, frames) = stalled("");
    check_grid(&frames);
    let skipped = skipped_after_the_stall(&frames);
    assert!(skipped >= STALL_TICKS - 1);
    assert!(longest_wake_error_ns(&stand) >= skipped * PERIOD_NS, "{} ns", longest_wake_error_ns(&stand));
    assert!(stand.view().counters.overruns.load(Ordering::Relaxed) >= STALL_TICKS - 1);
    assert!(frames.iter().all(|frame| frame.state == DriverState::Idle as u64));
    stand.finish();
}

#[test]
fn a_driver_that_catches_up_does_the_last_few_at_once() {
    let _turn = in_turn();
    let (stand, frames) = stalled("policy = \"catch-up\"\nticks = 30\n");
    check_grid(&frames);
    let first = frames.iter().position(|frame| frame.tick > STALL_AT).expect("it goes on");
    let made_up: Vec<&Frame> =
        frames[first..].iter().take_while(|frame| frame.read_ns > frame.deadline_ns + PERIOD_NS).collect();
    assert!(made_up.len() >= 29, "{} ticks were done late", made_up.len());
    for pair in made_up.windows(2) {
        assert_eq!(pair[1].tick, pair[0].tick + 1, "none is left out among them");
    }
    assert!(skipped_after_the_stall(&frames) >= STALL_TICKS - 31);
    // What was left out, and those that were made up for at once, but for one that was due meanwhile.
    assert!(longest_wake_error_ns(&stand) >= (STALL_TICKS - 1) * PERIOD_NS);
    stand.finish();
}

#[test]
fn a_driver_that_must_not_miss_many_stops_the_motors() {
    let _turn = in_turn();
    let (stand, frames) = stalled("policy = \"fault\"\nticks = 70\n");
    let last = frames.last().unwrap();
    // The stall is 80 ticks long; one of the machine's own before it would do as well.
    assert_eq!(last.state, DriverState::Fault as u64);
    assert_eq!(last.fault, FaultReason::Overrun as u64);
    stand.finish();
}

#[test]
fn fewer_misses_than_allowed_are_no_fault() {
    let _turn = in_turn();
    let (stand, frames) = stalled("policy = \"fault\"\nticks = 900\n");
    assert!(frames.iter().all(|frame| frame.state == DriverState::Idle as u64));
    stand.finish();
}
