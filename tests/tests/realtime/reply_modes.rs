//! When the motors are written: on arrival of the reply, at a fixed phase, or at once with the reply before.
//!
//! The frames tell for each tick when it was due, which tick's command drove the motors, and when they were
//! written. Asserted are orders of events and, between the modes, medians on either side of the budget, half a
//! millisecond apart: no stall of a shared machine moves a median so far.

use crate::in_turn;
use bytemuck::Zeroable;
use shm_abi::{DriverView, Frame, ReplyKind};
use system_tests::driver::Driver;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;

const BUDGET_NS: u64 = 500_000;
/// Of each mode. As many ticks are waited for as it takes: a loaded machine answers few of them.
const ANSWERED: usize = 300;

/// A tick and what the frame after it tells of it.
struct Done {
    tick: u64,
    deadline_ns: u64,
    after: Frame,
}

impl Done {
    /// From the deadline to the motors.
    fn written_after_ns(&self) -> u64 {
        self.after.previous.written_ns - self.deadline_ns
    }
}

/// Ticks that were answered, in a mode. Those without an answer in time are left out: they are another test's.
fn answered(mode: &str) -> Vec<Done> {
    answered_on("real", mode)
}

fn answered_on(clock: &str, mode: &str) -> Vec<Done> {
    let driver = Driver::start(&format!(
        "clock = \"{clock}\"\n[real_time]\npriority = 0\nlock_memory = false\n[reply]\nmode = \"{mode}\"\nbudget_us = 500\n\
         [[device]]\nbackend = \"ideal\"\npeak_force_n = 8.5\n"
    ));
    let observer = driver.observe();
    let commander = Commander::start(driver.command(), [0.0, 1.0, 0.0]);
    let view = &observer.driver;
    wait_for("the whole force", || view.read_latest().is_some_and(|frame| frame.authority == 1.0));
    let mut next = view.latest_tick().expect("a tick");
    let mut done = Vec::new();
    wait_for(&format!("{ANSWERED} answered ticks, {mode}"), || {
        // What a frame's tick came to stands in the frame after it.
        let told = view.latest_tick().unwrap_or(next);
        done.extend((next..told).filter_map(|tick| read(view, tick)));
        next = next.max(told);
        done.len() >= ANSWERED
    });
    drop(commander);
    done
}

fn read(view: &DriverView, tick: u64) -> Option<Done> {
    let (mut frame, mut after) = (Frame::zeroed(), Frame::zeroed());
    view.read_frame(tick, &mut frame).ok()?;
    view.read_frame(tick + 1, &mut after).ok()?;
    let is_fresh = after.previous.reply == ReplyKind::Fresh as u64;
    is_fresh.then_some(Done { tick, deadline_ns: frame.deadline_ns, after })
}

fn median(done: &[Done], of: impl Fn(&Done) -> u64) -> u64 {
    let mut values: Vec<u64> = done.iter().map(of).collect();
    values.sort_unstable();
    values[values.len() / 2]
}

#[test]
fn on_arrival_the_motors_are_written_as_soon_as_the_same_ticks_reply_is_there() {
    let _turn = in_turn();
    let done = answered("same-tick");
    for tick in &done {
        assert_eq!(tick.after.previous.command_tick, tick.tick);
        assert!(tick.after.previous.round_trip_ns > 0);
    }
    let waited_ns = median(&done, |tick| tick.written_after_ns() - tick.after.previous.round_trip_ns);
    assert!(median(&done, Done::written_after_ns) < BUDGET_NS);
    assert!(waited_ns < BUDGET_NS / 2, "nothing is waited for but the reply: {waited_ns} ns");
}

#[test]
fn at_a_fixed_phase_no_reply_is_applied_before_its_time() {
    let _turn = in_turn();
    let done = answered("fixed-phase");
    for tick in &done {
        assert_eq!(tick.after.previous.command_tick, tick.tick);
        assert!(tick.written_after_ns() >= BUDGET_NS, "tick {} at {}", tick.tick, tick.written_after_ns());
    }
    assert!(
        median(&done, |tick| tick.after.previous.round_trip_ns) < BUDGET_NS,
        "the replies were there before"
    );
}

#[test]
fn in_next_tick_mode_the_reply_before_drives_the_motors_at_once() {
    let _turn = in_turn();
    let done = answered("next-tick");
    for tick in &done {
        assert_eq!(tick.after.previous.command_tick + 1, tick.tick, "a delay of one tick, always");
    }
    assert!(median(&done, Done::written_after_ns) < BUDGET_NS, "no reply is waited for");
}

#[test]
fn in_lockstep_a_reply_for_the_next_tick_is_waited_for_and_drives_that_one() {
    let _turn = in_turn();
    let done = answered_on("lockstep", "next-tick");
    for tick in &done {
        assert_eq!(tick.after.previous.command_tick + 1, tick.tick, "a delay of one tick, always");
    }
    assert!(
        done.windows(2).all(|pair| pair[0].tick + 1 == pair[1].tick),
        "in lockstep every tick is answered"
    );
}
