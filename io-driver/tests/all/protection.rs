//! The driver's guards in its tick: what each lets through, what it tells, what it is left by.

use crate::common;

use bytemuck::Zeroable;
use common::{Bench, PERIOD_NS, publish, usual_device};
use io_driver::device::Reading;
use io_driver::mail::mail;
use io_driver::safety::switches::{Switch, Switches};
use nalgebra::Vector3;
use rt_core::clock::monotonic_ns;
use shm_abi::frame::{
    INPUT_DEAD_MAN_HELD, INPUT_DEAD_MAN_PRESENT, INPUT_EMERGENCY_STOP, LIMIT_PEAK, LIMIT_SLEW,
    LIMIT_WORKSPACE,
};
use shm_abi::segment::DeviceInfo;
use shm_abi::{CommanderMemory, DriverState, FaultReason, Frame};

const UP: [f64; 3] = [0.0, 2.0, 0.0];

fn bench(info: DeviceInfo) -> Bench {
    Bench::with(0, info, Switches::default())
}

/// A tick at that position with those buttons, answered with that force.
fn tick_at(
    bench: &mut Bench,
    commander: &CommanderMemory,
    position: Vector3<f64>,
    buttons: u64,
    force: [f64; 3],
) -> (Frame, Vector3<f64>) {
    bench.log.lock().unwrap().next_reading = Some(Ok(Reading { buttons, ..Reading::at(position) }));
    bench.tick(|frame, view| publish(commander, view, frame.tick, force))
}

fn rest() -> Vector3<f64> {
    Vector3::new(0.1, 0.2, 0.3)
}

#[test]
fn a_step_of_the_command_becomes_a_ramp_and_its_end_is_an_end() {
    let mut bench = bench(DeviceInfo { slew_n_per_s: 1000.0, ..usual_device() });
    let commander = bench.lease(1);
    bench.ramp_in(&commander, [0.0; 3]);
    let forces: Vec<f64> =
        (0..4).map(|_| tick_at(&mut bench, &commander, rest(), 0, [0.0, 3.0, 0.0]).1.y).collect();
    assert_eq!(forces, [1.0, 2.0, 3.0, 3.0]);
    let (frame, force) = tick_at(&mut bench, &commander, rest(), 0, [0.0; 3]);
    assert_eq!((force, frame.devices[0].limits), (Vector3::zeros(), 0));
    assert_eq!(bench.counter(|c| &c.forces_slewed), 2);
    tick_at(&mut bench, &commander, rest(), 0, [9.0, 0.0, 0.0]);
    let told = bench.silent_tick().0.devices[0].limits;
    assert_eq!(told, LIMIT_SLEW | LIMIT_PEAK, "the frame after tells what acted");
}

#[test]
fn a_reversed_command_passes_through_zero_and_never_jumps_by_more_than_the_step() {
    let mut bench = bench(DeviceInfo { slew_n_per_s: 1000.0, ..usual_device() });
    let commander = bench.lease(1);
    bench.ramp_in(&commander, [0.0; 3]);
    let mut force = |y: f64| tick_at(&mut bench, &commander, rest(), 0, [0.0, y, 0.0]).1.y;
    let pushed: Vec<f64> = (0..3).map(|_| force(3.0)).collect();
    assert_eq!(pushed, [1.0, 2.0, 3.0]);
    let reversed: Vec<f64> = (0..5).map(|_| force(-3.0)).collect();
    assert_eq!(reversed, [0.0, -1.0, -2.0, -3.0, -3.0]);
}

/// An hour ahead, so that every deadline is in time however slow this test is.
fn far_ahead() -> u64 {
    monotonic_ns() + 3_600_000_000_000
}

/// At full force in real time, with the next deadline.
fn pushing(info: DeviceInfo, force: [f64; 3]) -> (Bench, CommanderMemory, u64) {
    let mut bench = bench(info).in_real_time();
    let commander = bench.lease(1);
    let mut deadline_ns = far_ahead();
    for _ in 0..10 {
        bench.tick_due_at(deadline_ns, |frame, view| publish(&commander, view, frame.tick, force));
        deadline_ns += PERIOD_NS;
    }
    (bench, commander, deadline_ns)
}

#[test]
fn skipped_deadlines_age_a_command_and_ramp_a_force_out_by_their_time() {
    // Two milliseconds of age, two of ramp: the third, fourth... millisecond after the last reply.
    for (late_ms, share) in [(1, 1.0), (2, 1.0), (3, 0.0), (30, 0.0)] {
        let (mut bench, _commander, deadline_ns) = pushing(usual_device(), UP);
        // The deadline is one period after the last reply's.
        let (_, force) = bench.tick_due_at(deadline_ns + (late_ms - 1) * PERIOD_NS, |_, _| {});
        assert_eq!(force.y / UP[1], share, "{late_ms} ms");
    }
    let (mut bench, _commander, deadline_ns) = pushing(usual_device(), UP);
    let share = |bench: &mut Bench, at_ms: u64| {
        bench.tick_due_at(deadline_ns + at_ms * PERIOD_NS, |_, _| {}).1.y / UP[1]
    };
    assert_eq!([0, 1, 2].map(|ms| share(&mut bench, ms)), [1.0, 1.0, 0.5]);
    assert_eq!(share(&mut bench, 9), 0.0);
}

#[test]
fn skipped_deadlines_let_no_force_grow_by_more_than_a_tick() {
    let info = DeviceInfo { slew_n_per_s: 1000.0, ..usual_device() };
    let (mut bench, commander, mut deadline_ns) = pushing(info, [0.0; 3]);
    let mut pushed = |passed_ms: u64| {
        deadline_ns += passed_ms * PERIOD_NS;
        bench
            .tick_due_at(deadline_ns, |frame, view| publish(&commander, view, frame.tick, [0.0, 8.0, 0.0]))
            .1
            .y
    };
    // Two milliseconds are skipped, as long as a command may be old.
    assert_eq!([1, 3, 1, 3].map(&mut pushed), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!([30, 1, 1].map(&mut pushed), [0.0, 1.0, 2.0], "longer, and the force begins anew");
    // And authority likewise: four ticks in, however much of that time they take.
    let mut bench = self::bench(usual_device()).in_real_time();
    let commander = bench.lease(1);
    let mut deadline_ns = far_ahead();
    let mut share = || {
        deadline_ns += 3 * PERIOD_NS;
        bench.tick_due_at(deadline_ns, |frame, view| publish(&commander, view, frame.tick, UP)).1.y / UP[1]
    };
    assert_eq!([0; 6].map(|_| share()), [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]);
}

/// Ticks that are made up for follow each other at once: together they are no more time than really passed.
#[test]
fn a_loop_that_catches_up_lets_no_force_grow_faster_than_time_goes() {
    let mut bench = bench(DeviceInfo { slew_n_per_s: 1000.0, ..usual_device() }).in_real_time();
    let commander = bench.lease(1);
    let mut tick = |deadline_ns: u64, y: f64| {
        bench.tick_due_at(deadline_ns, |frame, view| publish(&commander, view, frame.tick, [0.0, y, 0.0]))
    };
    // The ramp, in as much time as it takes.
    patience::until("a force that is let through in full", || tick(monotonic_ns(), 0.0).0.authority >= 1.0);
    let began = monotonic_ns();
    let due = began - 20 * PERIOD_NS;
    let pushed: Vec<f64> = (0..10).map(|k| tick(due + k * PERIOD_NS, 8.0).1.y).collect();
    // A newton a millisecond; a tick may have begun up to a period before.
    let most_n = 1.0 + (monotonic_ns() - began) as f64 / 1e6;
    assert!(pushed[9] <= most_n, "{pushed:?} within {most_n} ms");
    assert!(pushed[9] > 0.0);
}

#[test]
fn a_device_that_could_not_be_read_for_a_while_may_be_farther_away_afterwards() {
    for (ticks, fault) in [(2, FaultReason::PositionJump), (3, FaultReason::DeviceRead)] {
        let mut bench = bench(DeviceInfo { speed_limit_m_per_s: 1.0, ..usual_device() });
        bench.log.lock().unwrap().needs_zero = Some(false);
        bench.silent_tick();
        for _ in 0..ticks {
            bench.log.lock().unwrap().next_reading = Some(Err(FaultReason::DeviceRead));
            bench.silent_tick();
        }
        // 25 m/s for three or four ticks: 75 or 100 mm.
        bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(rest() + Vector3::x() * 0.09)));
        let (frame, _) = bench.silent_tick();
        assert_eq!(frame.fault, FaultReason::DeviceRead as u64, "the first reason stands");
        let lost = bench.log.lock().unwrap().needs_zero == Some(true);
        assert_eq!(lost, fault == FaultReason::PositionJump, "a jump costs the zero");
    }
}

#[test]
fn outside_the_workspace_the_force_fades_and_inside_it_is_back() {
    let mut bench =
        bench(DeviceInfo { workspace_min_m: [-0.5; 3], workspace_max_m: [0.1, 0.5, 0.5], ..usual_device() });
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    for (x, share) in [(0.1, 1.0), (0.105, 0.75), (0.11, 0.5), (0.12, 0.0), (0.4, 0.0), (0.09, 1.0)] {
        let (_, force) = tick_at(&mut bench, &commander, Vector3::new(x, 0.2, 0.3), 0, UP);
        // One difference of numbers near 0.1 over 0.02: some ulps of 1e-16 / 0.02.
        assert!((force.y - 2.0 * share).abs() < 1e-13, "at {x}: {force}");
        assert_eq!(bench.silent_tick().0.devices[0].limits & LIMIT_WORKSPACE != 0, share < 1.0);
    }
    assert!(bench.counter(|c| &c.forces_faded) >= 4);
}

#[test]
fn a_device_that_is_too_fast_is_a_fault_while_a_force_drives_it_and_none_before() {
    let mut bench = bench(DeviceInfo { speed_limit_m_per_s: 1.0, ..usual_device() });
    let at = |tick: u64| Vector3::x() * (1.2e-3 * tick as f64);
    for tick in 0..20 {
        bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(at(tick))));
        assert_eq!(bench.silent_tick().0.state, DriverState::Idle as u64, "a hand may");
    }
    let commander = bench.lease(1);
    let mut ticks = 20;
    let state = loop {
        let (frame, force) = tick_at(&mut bench, &commander, at(ticks), 0, UP);
        ticks += 1;
        if frame.state != DriverState::Idle as u64 && frame.state != DriverState::Active as u64 {
            assert_eq!(force, Vector3::zeros());
            break frame;
        }
        assert!(ticks < 30, "nobody noticed");
    };
    assert_eq!((state.state, state.fault), (DriverState::Fault as u64, FaultReason::Overspeed as u64));
}

#[test]
fn the_velocity_is_told_in_the_frame() {
    let mut bench = bench(usual_device());
    for tick in 0..20 {
        bench.log.lock().unwrap().next_reading =
            Some(Ok(Reading::at(Vector3::new(0.3, -0.2, 0.1) * (1e-3 * f64::from(tick)))));
        let (frame, _) = bench.silent_tick();
        let velocity = Vector3::from(frame.devices[0].velocity_m_per_s_estimated);
        // Differences of numbers below 0.01 over 1 ms.
        assert!(tick == 0 || (velocity - Vector3::new(0.3, -0.2, 0.1)).norm() < 1e-13);
    }
}

#[test]
fn the_velocity_is_told_too_when_a_hand_is_faster_than_a_force_may_make_it() {
    let mut bench = bench(DeviceInfo { speed_limit_m_per_s: 1.0, ..usual_device() });
    let mut told = 0.0;
    for tick in 0..20 {
        let position = Vector3::x() * (1.2e-3 * f64::from(tick));
        bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(position)));
        told = bench.silent_tick().0.devices[0].velocity_m_per_s_estimated[0];
    }
    // A quotient of differences of numbers below 0.1.
    assert!((told - 1.2).abs() < 1e-12, "{told}");
}

#[test]
fn a_position_that_jumps_is_a_fault_even_without_a_force() {
    let mut bench = bench(DeviceInfo { speed_limit_m_per_s: 1.0, ..usual_device() });
    bench.silent_tick();
    bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(rest() + Vector3::x() * 0.05)));
    let (frame, _) = bench.silent_tick();
    assert_eq!(frame.fault, FaultReason::PositionJump as u64);
    bench.cycle.clear_fault();
    assert_eq!(bench.silent_tick().0.state, DriverState::Idle as u64, "what was before is forgotten");
}

/// Else whoever may ask for it could switch amplifiers under force, and blind the guards once a tick.
#[test]
fn asking_to_leave_a_fault_that_is_none_changes_nothing() {
    let mut bench = bench(DeviceInfo { speed_limit_m_per_s: 1.0, ..usual_device() });
    let commander = bench.lease(1);
    bench.ramp_in(&commander, UP);
    let mut frame = Frame::zeroed();
    for tick in 0..20 {
        bench.cycle.clear_fault();
        frame = tick_at(&mut bench, &commander, rest() + Vector3::x() * (1.2e-3 * f64::from(tick)), 0, UP).0;
        if frame.fault != 0 {
            break;
        }
    }
    assert_eq!(frame.fault, FaultReason::Overspeed as u64);
    assert_eq!(bench.log.lock().unwrap().rearms, 0);
}

/// Who asked to leave some other fault cannot have known of it.
#[test]
fn an_emergency_stop_outlasts_a_request_to_leave_a_fault_of_the_same_tick() {
    for stop_comes_first in [true, false] {
        let mut bench = bench(usual_device());
        let (sender, mut inbox) = mail();
        bench.cycle.fault(FaultReason::DeviceRead);
        if stop_comes_first {
            sender.urgent.stop(None, monotonic_ns());
        }
        sender.urgent.clear_fault(u64::MAX, |_| true).unwrap();
        if !stop_comes_first {
            sender.urgent.stop(None, monotonic_ns());
        }
        inbox.deliver(&mut bench.cycle);
        assert_eq!(bench.silent_tick().0.fault, FaultReason::EmergencyStop as u64);
    }
}

#[test]
fn an_emergency_stop_is_zero_at_once_and_is_not_left_while_it_is_pressed() {
    let stop = Switch { device: 0, button: 3, normally_closed: true };
    let switches = Switches { emergency_stop: Some(stop), dead_man: None };
    let mut bench = Bench::with(0, usual_device(), switches);
    const CLOSED: u64 = 0b1000;
    let commander = bench.lease(1);
    for _ in 0..10 {
        tick_at(&mut bench, &commander, rest(), CLOSED, UP);
    }
    assert_eq!(tick_at(&mut bench, &commander, rest(), CLOSED, UP).1, Vector3::from(UP));
    let (frame, force) = tick_at(&mut bench, &commander, rest(), 0, UP);
    assert_eq!((frame.fault, force), (FaultReason::EmergencyStop as u64, Vector3::zeros()));
    assert_eq!(frame.inputs, INPUT_EMERGENCY_STOP);
    assert!(bench.log.lock().unwrap().releases > 0);
    bench.cycle.clear_fault();
    let (frame, force) = tick_at(&mut bench, &commander, rest(), 0, UP);
    assert_eq!((frame.fault, force), (FaultReason::EmergencyStop as u64, Vector3::zeros()));
    for _ in 0..5 {
        let (frame, force) = tick_at(&mut bench, &commander, rest(), CLOSED, UP);
        assert_eq!(
            (frame.state, force),
            (DriverState::Fault as u64, Vector3::zeros()),
            "until it is asked for"
        );
    }
    bench.cycle.clear_fault();
    assert_eq!(bench.log.lock().unwrap().rearms, 2);
    let mut last = Vector3::zeros();
    for _ in 0..6 {
        last = tick_at(&mut bench, &commander, rest(), CLOSED, UP).1;
    }
    assert_eq!(last, Vector3::from(UP));
}

#[test]
fn a_dead_mans_switch_lets_force_through_while_it_is_held() {
    let switch = Switch { device: 0, button: 0, normally_closed: false };
    let switches = Switches { emergency_stop: None, dead_man: Some(switch) };
    let mut bench = Bench::with(0, usual_device(), switches);
    let commander = bench.lease(1);
    for _ in 0..20 {
        let (frame, force) = tick_at(&mut bench, &commander, rest(), 0, UP);
        assert_eq!((force, frame.inputs), (Vector3::zeros(), INPUT_DEAD_MAN_PRESENT));
        assert_eq!(frame.state, DriverState::Idle as u64);
    }
    let held: Vec<f64> = (0..6).map(|_| tick_at(&mut bench, &commander, rest(), 1, UP).1.y / 2.0).collect();
    assert_eq!(held, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]);
    let (frame, force) = tick_at(&mut bench, &commander, rest(), 0, UP);
    assert_eq!(frame.inputs & INPUT_DEAD_MAN_HELD, 0);
    assert_eq!(force.y, 1.0, "half of it, on the way out");
    assert_eq!(tick_at(&mut bench, &commander, rest(), 0, UP).1, Vector3::zeros());
    assert_eq!(bench.counter(|c| &c.ticks_unattended), 22);
    assert_eq!(bench.counter(|c| &c.faults), 0);
}
