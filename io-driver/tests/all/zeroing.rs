//! A device that has to be zeroed: what it gets until then, when a zero is granted, and what follows it.

use crate::common;

use common::{Bench, publish, usual_device};
use io_driver::device::Reading;
use io_driver::safety::switches::Switches;
use io_driver::zeroing::{DeviceSet, ZeroRefusal};
use nalgebra::Vector3;
use shm_abi::frame::{DEVICE_NOT_ZEROED, DEVICE_POSITION_VALID};
use shm_abi::{CommanderMemory, DriverState, FaultReason, Frame};

/// Half a second at the bench's rate.
const REST_TICKS: usize = 500;
const PUSH: [f64; 3] = [0.0, 4.0, 0.0];
const FIRST: DeviceSet = DeviceSet(1);

/// A bench whose device counts, and has been zeroed or not.
fn bench(needs_zero: bool) -> Bench {
    // So fast that only a jump is a fault.
    let info = shm_abi::segment::DeviceInfo { speed_limit_m_per_s: 20.0, ..usual_device() };
    let bench = Bench::with(0, info, Switches::default());
    bench.log.lock().unwrap().needs_zero = Some(needs_zero);
    bench
}

fn rest(bench: &mut Bench) {
    for _ in 0..REST_TICKS {
        bench.silent_tick();
    }
}

fn zero(bench: &mut Bench) -> Result<(), ZeroRefusal> {
    bench.cycle.zero(FIRST);
    bench.cycle.zero_verdict().expect("it was asked").map(drop)
}

fn push(bench: &mut Bench, commander: &CommanderMemory) -> (Frame, Vector3<f64>) {
    bench.tick(|frame, view| publish(commander, view, frame.tick, PUSH))
}

fn flags(frame: &Frame) -> u64 {
    frame.devices[0].flags
}

fn state(frame: &Frame) -> Option<DriverState> {
    DriverState::from_word(frame.state)
}

#[test]
fn until_it_is_zeroed_a_device_shows_its_counts_and_gets_no_force_whoever_pushes() {
    let mut bench = bench(true);
    let commander = bench.lease(1);
    bench.log.lock().unwrap().counts = [11, -12, 13, 0, 0, 0];
    for _ in 0..2 * REST_TICKS {
        let (frame, force) = push(&mut bench, &commander);
        assert_eq!((state(&frame), frame.authority), (Some(DriverState::Zeroing), 0.0));
        assert_eq!(flags(&frame), DEVICE_NOT_ZEROED);
        assert_eq!(frame.devices[0].encoder_counts[..3], [11, -12, 13]);
        assert_eq!(force, Vector3::zeros());
    }
}

#[test]
fn a_zero_is_refused_until_the_arm_has_stood_still_and_then_the_driver_goes_on() {
    let mut bench = bench(true);
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Moving(0)), "nobody has looked at it yet");
    for tick in 0..REST_TICKS {
        bench.log.lock().unwrap().counts[1] = (tick / 100) as i64;
        bench.silent_tick();
    }
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Moving(0)), "four counts in half a second");
    assert_eq!(state(&bench.silent_tick().0), Some(DriverState::Zeroing), "and nothing has changed");
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Ok(()));
    let first = bench.silent_tick().0;
    assert_eq!((flags(&first), state(&first)), (0, Some(DriverState::Zeroing)), "told once");
    let second = bench.silent_tick().0;
    assert_eq!((flags(&second), state(&second)), (DEVICE_POSITION_VALID, Some(DriverState::Idle)));
}

#[test]
fn a_commander_in_zeroing_is_pushed_from_nothing_once_the_device_is_zeroed() {
    let mut bench = bench(true);
    let commander = bench.lease(1);
    for _ in 0..REST_TICKS {
        push(&mut bench, &commander);
    }
    assert_eq!(zero(&mut bench), Ok(()), "nothing is let through, so nobody is disturbed");
    let authorities: Vec<f64> = (0..7).map(|_| push(&mut bench, &commander).0.authority).collect();
    assert_eq!(
        authorities,
        [0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.0],
        "withheld once, then the ramp of four ticks"
    );
}

#[test]
fn a_zero_is_refused_while_somebody_commands_and_while_the_force_ramps_out() {
    let mut bench = bench(false);
    rest(&mut bench);
    let commander = bench.lease(1);
    push(&mut bench, &commander);
    assert_eq!(bench.cycle.safety().authority(), 0.25);
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Commanded));
    bench.ramp_in(&commander, PUSH);
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Commanded));
    bench.cycle.end_lease(1);
    bench.silent_tick();
    assert!(bench.cycle.safety().authority() > 0.0);
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Commanded), "it still pushes");
    assert_eq!(flags(&bench.silent_tick().0), DEVICE_POSITION_VALID, "and nothing has changed");
    bench.silent_tick();
    assert_eq!(zero(&mut bench), Ok(()));
}

#[test]
fn a_zero_that_moves_the_pose_is_no_jump() {
    let mut bench = bench(false);
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Ok(()));
    for x in [0.9, 0.9, 0.9] {
        bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(Vector3::new(x, 0.2, 0.3))));
        let (frame, _) = bench.silent_tick();
        assert_ne!(state(&frame), Some(DriverState::Fault));
        assert_eq!(frame.devices[0].velocity_m_per_s_estimated, [0.0; 3]);
    }
}

/// A commander that has contacts and sleeps through the tick in which the device was not valid would find its
/// finger somewhere else.
#[test]
fn a_commander_that_slept_through_a_zero_has_to_see_the_device_invalid_before_it_pushes_again() {
    let mut bench = bench(false);
    let commander = bench.lease(1);
    bench.ramp_in(&commander, PUSH);
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Ok(()), "it fell silent long ago");
    for _ in 0..10 {
        let (frame, force) = bench.silent_tick();
        assert_eq!((flags(&frame), force), (0, Vector3::zeros()), "it still sleeps");
    }
    let (seen, force) = push(&mut bench, &commander);
    assert_eq!((flags(&seen), force), (0, Vector3::zeros()));
    assert_eq!(flags(&push(&mut bench, &commander).0), DEVICE_POSITION_VALID);
}

#[test]
fn a_commander_that_comes_after_a_zero_does_not_have_to_wait() {
    let mut bench = bench(false);
    let former = bench.lease(1);
    bench.ramp_in(&former, PUSH);
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Ok(()));
    bench.silent_tick();
    bench.cycle.end_lease(1);
    bench.silent_tick();
    let commander = bench.lease(2);
    assert_eq!(flags(&push(&mut bench, &commander).0), DEVICE_POSITION_VALID);
}

fn jump(bench: &mut Bench) -> Frame {
    bench.log.lock().unwrap().next_reading = Some(Ok(Reading::at(Vector3::new(0.9, 0.2, 0.3))));
    bench.silent_tick().0
}

#[test]
fn a_jump_costs_the_zero_and_clearing_the_fault_leads_to_zeroing() {
    let mut bench = bench(false);
    bench.silent_tick();
    let jumped = jump(&mut bench);
    assert_eq!((state(&jumped), jumped.fault), (Some(DriverState::Fault), FaultReason::PositionJump as u64));
    assert_eq!(flags(&jumped), DEVICE_NOT_ZEROED, "at once");
    bench.cycle.clear_fault();
    let commander = bench.lease(1);
    for _ in 0..REST_TICKS {
        let (frame, force) = push(&mut bench, &commander);
        assert_eq!((state(&frame), force), (Some(DriverState::Zeroing), Vector3::zeros()));
    }
    assert_eq!(zero(&mut bench), Ok(()));
    for _ in 0..7 {
        push(&mut bench, &commander);
    }
    assert_eq!(bench.cycle.safety().authority(), 1.0, "and it goes on");
}

#[test]
fn in_the_fault_state_a_zero_is_granted_and_the_fault_stays() {
    let mut bench = bench(false);
    bench.silent_tick();
    jump(&mut bench);
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Ok(()));
    bench.silent_tick();
    let frame = bench.silent_tick().0;
    assert_eq!((state(&frame), flags(&frame)), (Some(DriverState::Fault), DEVICE_POSITION_VALID));
    bench.cycle.clear_fault();
    assert_eq!(state(&bench.silent_tick().0), Some(DriverState::Idle));
}

#[test]
fn a_fault_that_says_nothing_about_counters_leaves_the_zero() {
    let mut bench = bench(false);
    bench.log.lock().unwrap().next_reading = Some(Err(FaultReason::DeviceRead));
    assert_eq!(state(&bench.silent_tick().0), Some(DriverState::Fault));
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Moving(0)), "it could not be read a moment ago");
    bench.cycle.clear_fault();
    let frame = bench.silent_tick().0;
    assert_eq!((state(&frame), flags(&frame)), (Some(DriverState::Idle), DEVICE_POSITION_VALID));
}

#[test]
fn a_device_without_counters_is_not_zeroed_and_its_jump_costs_nothing() {
    let mut bench = bench(false);
    bench.log.lock().unwrap().needs_zero = None;
    rest(&mut bench);
    assert_eq!(zero(&mut bench), Err(ZeroRefusal::Innate));
    jump(&mut bench);
    bench.cycle.clear_fault();
    assert_eq!(state(&bench.silent_tick().0), Some(DriverState::Idle));
}

#[test]
fn the_devices_that_have_to_be_zeroed_are_told_by_their_places() {
    let bench = Bench::of(0, vec![usual_device(); 4], Switches::default());
    let needs = [None, Some(true), Some(false), Some(true)];
    for (log, needs_zero) in bench.logs.iter().zip(needs) {
        log.lock().unwrap().needs_zero = needs_zero;
    }
    assert_eq!(bench.cycle.not_zeroed(), DeviceSet(0b1010));
    bench.logs[3].lock().unwrap().needs_zero = Some(false);
    assert_eq!(bench.cycle.not_zeroed(), DeviceSet(0b0010));
    bench.logs[1].lock().unwrap().needs_zero = None;
    assert_eq!(bench.cycle.not_zeroed(), DeviceSet(0));
}
