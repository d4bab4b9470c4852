//! The driver's tick, without a clock: a commander in the same process answers, is late, lies or leaves.

use crate::common;

use common::{Bench, Log, PEAK_N, command, publish, usual_device};
use io_driver::device::{Extras, Reading};
use io_driver::safety::switches::Switches;
use nalgebra::Vector3;
use shm_abi::frame::{DEVICE_HAS_BUTTONS, DEVICE_POSITION_VALID, LIMIT_HEAT, LIMIT_SATURATION};
use shm_abi::{Command, DriverState, DriverView, FaultReason, Frame, ReplyKind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

const UP: [f64; 3] = [0.0, 2.0, 0.0];

#[test]
fn a_reply_drives_the_motors_of_the_same_tick() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let (_, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, [0.5, 0.0, 0.0]));
    assert_eq!(force, Vector3::new(0.5, 0.0, 0.0));
    let (frame, _) = bench.silent_tick();
    assert_eq!(frame.previous.reply, ReplyKind::Fresh as u64);
    assert_eq!(frame.previous.command_tick, frame.tick - 1);
    assert_eq!(frame.devices[0].force_on_user_n_applied, [0.5, 0.0, 0.0]);
    assert_eq!(frame.devices[0].position_m_measured, [0.1, 0.2, 0.3]);
}

#[test]
fn in_next_tick_mode_the_reply_to_the_former_tick_is_fresh() {
    let mut bench = Bench::new(1);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let mut former = bench.tick;
    for _ in 0..20 {
        let (frame, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick - 1, UP));
        assert_eq!(force, Vector3::from(UP));
        assert_eq!(frame.tick, former + 1);
        former = frame.tick;
    }
    assert_eq!(bench.counter(|c| &c.replies_missed), 0);
}

#[test]
fn without_replies_the_force_is_held_then_ramps_to_zero_and_stays_there() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let share: Vec<f64> = (0..8).map(|_| bench.silent_tick().1.y / UP[1]).collect();
    // Two ticks of age are allowed, then two ticks of ramp.
    assert_eq!(share, [1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(bench.counter(|c| &c.replies_missed), 8);
    // A fresh reply brings it back, from zero.
    let back: Vec<f64> = (0..6)
        .map(|_| bench.tick(|frame, view| publish(&commander, view, frame.tick, UP)).1.y / UP[1])
        .collect();
    assert_eq!(back, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]);
}

#[test]
fn a_lease_that_has_never_answered_misses_no_reply() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    for _ in 0..5 {
        bench.silent_tick();
    }
    let counted =
        |bench: &Bench| (bench.counter(|c| &c.replies_missed), bench.counter(|c| &c.ticks_commanded));
    assert_eq!(counted(&bench), (0, 0));
    bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
    bench.silent_tick();
    assert_eq!(counted(&bench), (1, 2));
}

#[test]
fn a_late_reply_is_better_than_an_older_one() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let (late, _) = bench.silent_tick();
    let (_, force) = bench.tick(|_, view| publish(&commander, view, late.tick, [1.0, 0.0, 0.0]));
    assert_eq!(force, Vector3::new(1.0, 0.0, 0.0), "one tick old, and held");
}

#[test]
fn when_a_lease_ends_its_force_ramps_out_before_the_next_lease_begins() {
    let mut bench = Bench::new(0);
    let first = bench.lease(1);
    bench.ramp_in(&first, UP);
    bench.cycle.end_lease(1);
    let second = bench.lease(2);
    let answer = |frame: &Frame, view: &DriverView| {
        publish(&first, view, frame.tick, [7.0, 0.0, 0.0]);
        publish(&second, view, frame.tick, [0.0, 0.0, 3.0]);
    };
    let (frame, force) = bench.tick(answer);
    assert_eq!(
        (frame.lease, force),
        (0, Vector3::new(0.0, 1.0, 0.0)),
        "half of the first lease's last force"
    );
    let (frame, force) = bench.tick(answer);
    assert_eq!((frame.lease, force), (0, Vector3::zeros()));
    let forces: Vec<f64> = (0..5).map(|_| bench.tick(answer).1.z / 3.0).collect();
    assert_eq!(
        forces,
        [0.0, 0.25, 0.5, 0.75, 1.0],
        "the second lease ramps in; the first is not heard any more"
    );
    assert_eq!(bench.silent_tick().0.lease, 2);
}

#[test]
fn a_lease_that_ends_before_it_began_is_forgotten() {
    let mut bench = Bench::new(0);
    let first = bench.lease(1);
    bench.ramp_in(&first, UP);
    assert!(bench.cycle.end_lease(1).is_none());
    let _second = bench.lease(2);
    assert!(bench.cycle.end_lease(2).is_some(), "handed back for dropping");
    assert_eq!(bench.silent_tick().0.lease, 0, "nobody commands");
    assert!(bench.cycle.lease().is_none());
}

#[test]
fn what_is_not_believed_is_counted_and_has_no_effect() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(3);
    bench.ramp_in(&commander, UP);
    let mut lie = |change: fn(&mut Command)| {
        bench.ramp_in(&commander, UP);
        let refused = bench.counter(|c| &c.commands_refused);
        let (_, force) = bench.tick(|frame, view| {
            let mut wrong = command(&commander, frame.tick, [5.0, 0.0, 0.0]);
            change(&mut wrong);
            commander.publish(&wrong, view);
        });
        assert_eq!(force, Vector3::from(UP), "the last good command is held");
        assert_eq!(bench.counter(|c| &c.commands_refused), refused + 1);
    };
    lie(|c| c.devices[0].force_on_user_n[2] = f64::NAN);
    lie(|c| c.devices[0].force_on_user_n[0] = f64::INFINITY);
    lie(|c| c.lease = 2);
    lie(|c| c.device_count = 2);
    lie(|c| c.tick += 1);
    lie(|c| c.tick = u64::MAX - 1);
}

#[test]
fn an_answer_given_too_early_does_not_hide_the_right_one() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    bench.tick(|frame, view| publish(&commander, view, frame.tick + 1, UP));
    let (_, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, [1.0, 0.0, 0.0]));
    assert_eq!(force, Vector3::new(1.0, 0.0, 0.0));
}

#[test]
fn a_force_above_the_peak_is_cut_to_it_in_its_direction() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, [f64::MAX, 0.0, -f64::MAX]);
    let (_, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, [30.0, 0.0, -40.0]));
    // Two roundings on the way.
    assert!((force - Vector3::new(0.6, 0.0, -0.8) * PEAK_N).norm() < 1e-14 * PEAK_N);
    assert!(bench.counter(|c| &c.forces_limited) > 0);
}

#[test]
fn a_device_that_cannot_be_read_or_written_means_zero_force_until_somebody_clears_it() {
    type Cause = (fn(&mut Log), FaultReason);
    let causes: [Cause; 3] = [
        (|log| log.next_reading = Some(Err(FaultReason::DeviceRead)), FaultReason::DeviceRead),
        (
            |log| log.next_reading = Some(Ok(Reading::at(Vector3::new(f64::NAN, 0.0, 0.0)))),
            FaultReason::PositionNotFinite,
        ),
        (|log| log.fail_write = true, FaultReason::DeviceWrite),
    ];
    for (cause, reason) in causes {
        let mut bench = Bench::new(0);
        let commander = bench.lease(1);
        bench.ramp_in(&commander, UP);
        cause(&mut bench.log.lock().unwrap());
        bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
        bench.log.lock().unwrap().fail_write = false;
        for _ in 0..10 {
            let (frame, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
            assert_eq!(frame.state, DriverState::Fault as u64);
            assert_eq!(frame.fault, reason as u64);
            assert_eq!(force, Vector3::zeros());
        }
        assert!(bench.log.lock().unwrap().releases > 0, "the motors were switched off as well");
        assert_eq!(bench.counter(|c| &c.faults), 1);
        bench.cycle.clear_fault();
        bench.ramp_in(&commander, UP);
        let (frame, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
        assert_eq!((frame.state, force), (DriverState::Active as u64, Vector3::from(UP)));
    }
}

#[test]
fn until_the_position_is_valid_the_driver_is_zeroing_and_renders_nothing() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    for _ in 0..10 {
        let unknown = Reading { is_valid: false, ..Reading::at(Vector3::zeros()) };
        bench.log.lock().unwrap().next_reading = Some(Ok(unknown));
        let (frame, force) = bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
        assert_eq!((frame.state, frame.devices[0].flags), (DriverState::Zeroing as u64, 0));
        assert_eq!(force, Vector3::zeros());
    }
    bench.ramp_in(&commander, UP);
}

#[test]
fn dropping_the_cycle_switches_the_motors_off() {
    let bench = Bench::new(0);
    let log = Arc::clone(&bench.log);
    drop(bench);
    assert!(log.lock().unwrap().releases > 0);
}

#[test]
fn what_is_fresh_is_told_as_soon_as_it_comes_and_what_is_older_is_waited_for_on() {
    for freshness in [0, 1] {
        let mut bench = Bench::new(freshness);
        let commander = bench.lease(1);
        bench.ramp_in(&commander, UP);
        bench.cycle.sense(bench.tick + 1, 0);
        bench.tick += 1;
        // The reply to the tick before is there, which is as fresh as they come where one tick is allowed.
        assert_eq!(bench.cycle.take_reply(), freshness == 1);
        publish(&commander, &bench.view, bench.tick, UP);
        assert!(bench.cycle.take_reply());
        bench.cycle.actuate();
        bench.cycle.sense(bench.tick + 2, 0);
        bench.tick += 2;
        assert!(!bench.cycle.take_reply(), "a tick was skipped: it is two ticks old");
        bench.cycle.actuate();
        assert_eq!(bench.silent_tick().0.previous.reply, ReplyKind::Held as u64);
    }
}

#[test]
fn what_a_device_cuts_because_its_motors_are_warm_is_counted_and_nothing_else_is() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    for (limits, derated) in
        [(0, 0), (LIMIT_HEAT, 1), (LIMIT_SATURATION, 1), (LIMIT_HEAT | LIMIT_SATURATION, 2)]
    {
        bench.log.lock().unwrap().limits = limits;
        bench.tick(|frame, view| publish(&commander, view, frame.tick, UP));
        assert_eq!(bench.counter(|c| &c.forces_derated), derated);
        assert_eq!(bench.counter(|c| &c.forces_limited) + bench.counter(|c| &c.forces_slewed), 0);
    }
}

#[test]
fn a_bell_is_looked_into_once_a_tick_and_tells_how_long_the_answer_was_on_its_way() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let trips = |bench: &Bench| bench.view.round_trip_ns.count.load(Ordering::Relaxed);
    let (before, refused) = (trips(&bench), bench.counter(|c| &c.commands_refused));
    let tick = bench.tick + 1;
    bench.cycle.sense(tick, 0);
    assert_eq!((bench.cycle.tick(), bench.cycle.seen_reply()), (tick, Some(tick - 1)));
    assert!(!bench.cycle.take_reply());
    assert_eq!(trips(&bench), before, "nobody has answered this tick");
    publish(&commander, &bench.view, tick, UP);
    assert!(bench.cycle.take_reply() && bench.cycle.take_reply());
    assert_eq!((bench.cycle.seen_reply(), trips(&bench)), (Some(tick), before + 1));
    assert_eq!(bench.counter(|c| &c.commands_refused), refused, "the same answer is no second one");
    bench.cycle.actuate();
    bench.tick = tick;
    let (frame, _) = bench.tick(|_, view| publish(&commander, view, tick, UP));
    assert!(frame.previous.round_trip_ns > 0);
    assert_eq!(trips(&bench), before + 1, "an answer to the tick before makes no round trip");
}

#[test]
fn nobody_has_answered_a_lease_that_begins() {
    let mut bench = Bench::new(0);
    assert_eq!(bench.cycle.seen_reply(), None);
    let _commander = bench.lease(1);
    for _ in 0..10 {
        bench.silent_tick();
    }
    assert_eq!(bench.cycle.seen_reply(), None);
    let counted = [bench.counter(|c| &c.replies_missed), bench.counter(|c| &c.ticks_commanded)];
    assert_eq!(counted, [0, 0], "nobody has promised anything yet");
}

#[test]
fn a_cycle_takes_what_its_devices_take_without_the_wait_for_the_answer() {
    const TAKES: Duration = Duration::from_millis(1);
    const WAITS: Duration = Duration::from_millis(20);
    let mut bench = Bench::new(0);
    bench.log.lock().unwrap().takes = TAKES;
    let begun = Instant::now();
    bench.tick(|_, _| std::thread::sleep(WAITS));
    let most = (begun.elapsed() - WAITS).as_nanos();
    let took = u128::from(bench.view.cycle_ns.sum_ns.load(Ordering::Relaxed));
    assert!((2 * TAKES.as_nanos()..=most).contains(&took), "{took} ns of {most} ns");
}

#[test]
fn buttons_and_orientation_are_told_of_the_devices_that_have_them() {
    let mut bench = Bench::of(0, vec![usual_device(), usual_device()], Switches::default());
    let has = Extras { orientation: true, buttons: true };
    bench.logs[1].lock().unwrap().extras = has;
    let (frame, _) = bench.silent_tick();
    assert_eq!(frame.devices[0].flags, DEVICE_POSITION_VALID);
    assert_eq!(frame.devices[1].flags, DEVICE_POSITION_VALID | DEVICE_HAS_BUTTONS);
    assert_eq!(bench.cycle.extras(), [Extras::default(), has]);
}

#[test]
#[should_panic(expected = "answers do not let the force through in full")]
fn a_driver_that_never_lets_the_force_through_fails_its_test_with_words() {
    let mut bench = Bench::new(0);
    let commander = bench.lease(1);
    bench.log.lock().unwrap().fail_write = true;
    bench.ramp_in(&commander, UP);
}
