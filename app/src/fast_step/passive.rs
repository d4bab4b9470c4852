//! A finger that is kept passive, in the fast step.

use super::*;
use crate::row::FingerRow;
use bytemuck::Zeroable;
use haptics::Finger;
use haptics::Plane;
use haptics::passivity::PassivitySpec;
use nalgebra::{Isometry3, UnitQuaternion};

const PERIOD_NS: u64 = 1_000_000;
const K: f64 = 1000.0;

/// A finger over a floor, its device upside down, kept passive by a bound of 1 uJ.
fn step() -> FastStep {
    let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
        device: 0,
        mount: Mount::new(Isometry3::from_parts(Vector3::zeros().into(), turn)),
    };
    let spec = PassivitySpec::for_motion(1e-3, 0.0, 0.0).with_bound(1e-6);
    let spec = PassivitySpec { device_friction_n: 0.0, ..spec };
    FastStep::new(vec![finger], vec![floor], PERIOD_NS).with_passivities([Passivity::new(spec, 1e-3).ok()])
}

/// The finger at this height (m), where motors held this force upwards (N), of the command of that tick.
fn feel(step: &mut FastStep, tick: u64, height: f64, applied: f64, command_tick: u64) -> (FingerRow, f64) {
    let mut frame = Frame::zeroed();
    (frame.tick, frame.device_count) = (tick, 1);
    (frame.previous.authority, frame.previous.command_tick) = (1.0, command_tick);
    frame.devices[0].flags = DEVICE_POSITION_VALID;
    frame.devices[0].position_m_measured[1] = -height;
    frame.devices[0].force_on_user_n_applied[1] = -applied;
    let (mut command, mut row) = (Command::zero(tick, 1, 1), Row::empty());
    step.step(&frame, &mut command, &mut row);
    (row.fingers[0], -command.devices[0].force_on_user_n[1])
}

#[test]
fn what_counts_is_the_force_that_the_motors_held_and_the_command_is_what_is_left() {
    let mut step = step();
    feel(&mut step, 1, 1e-3, 0.0, 0);
    let (pressed, commanded) = feel(&mut step, 2, -1e-3, 0.0, 1);
    assert_eq!((pressed.energy_j, pressed.controlled_n), (0.0, 0.0));
    assert!((commanded - 1.0).abs() < 1e-12, "pressed in by 2 mm a tick, it takes energy: {commanded}");
    // It wanted a newton, of which the driver let 0.4 N through; out by half a millimetre.
    let (released, commanded) = feel(&mut step, 3, -0.5e-3, 0.4, 2);
    assert!((released.energy_j - 0.2e-3).abs() < 1e-15, "{released:?}");
    // More than the bound: nothing is left of 0.5 N.
    assert_eq!((commanded, released.force_on_user), (0.0, Vector3::zeros()));
    assert!((released.controlled_n - 0.5).abs() < 1e-12, "{released:?}");
}

#[test]
fn a_device_that_is_carried_does_no_work_and_one_that_is_lost_moved_nowhere() {
    let mut step = step();
    feel(&mut step, 1, -1e-3, 0.0, 0);
    feel(&mut step, 2, -1e-3, 1.0, 1);
    let camera = Isometry3::translation(0.0, 0.5e-3, 0.0);
    let text = "master = 0\nattached_to = \"camera\"\n[[device]]\norientation_wxyz = [0, 0, 0, 1]\n";
    let layout = Layout::parse(text, std::path::Path::new("l.toml")).unwrap();
    assert!(step.set_layout(&layout.with_camera(camera)));
    assert!(feel(&mut step, 3, -1e-3, 1.0, 2).0.energy_j.abs() < 1e-15);
    let mut lost = Frame::zeroed();
    (lost.tick, lost.device_count) = (4, 1);
    step.step(&lost, &mut Command::zero(4, 1, 1), &mut Row::empty());
    assert!(feel(&mut step, 5, -0.2e-3, 1.0, 4).0.energy_j.abs() < 1e-15);
}

#[test]
fn a_driver_that_writes_a_tick_late_is_told_from_one_that_does_not() {
    // It comes out by 0.5 mm a tick and wants 0.5 N. Of a microjoule that makes 2 mN; but where the newton of the tick
    // before is still to come, that alone may feed half a millijoule.
    for (late, left) in [(0, 2e-3), (1, 0.0)] {
        let mut step = step();
        feel(&mut step, 2, 1e-3, 0.0, 1 - late);
        feel(&mut step, 3, -1e-3, 0.0, 2 - late);
        let (_, commanded) = feel(&mut step, 4, -0.5e-3, 0.0, 3 - late);
        // The margin of the multiplier.
        assert!((commanded - left).abs() < 1e-8, "{late}: {commanded}");
    }
}

const MASS_KG: f64 = 0.1;
const FLIES: Vector3<f64> = Vector3::new(0.0, 0.3, 0.0);

/// A ball without weight that flies upwards, to a passive finger and nothing else.
fn with_a_ball() -> FastStep {
    let pose = Isometry3::identity();
    let ball = Entity::new(haptics::Sphere::new(0.02).unwrap(), pose, K).unwrap();
    let mass = physics::MassProperties::of_shape(&ball.shape, MASS_KG).unwrap();
    let body = Body::at_rest(mass, &pose).with_rotation_locked().moving(FLIES, Vector3::zeros());
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
        device: 0,
        mount: Mount::new(pose),
    };
    let spec = PassivitySpec::for_motion(1e-3, 0.0, 0.0).with_bound(1e-6);
    let spec = PassivitySpec { device_friction_n: 0.0, ..spec };
    let settings = physics::Settings { gravity_W: Vector3::zeros(), ..physics::Settings::default() };
    FastStep::new(vec![finger], vec![ball], PERIOD_NS)
        .with_objects(&[(0, body)], settings, ListSettings::default(), &[HandFinger::default()], false)
        .unwrap()
        .with_passivities([Passivity::new(spec, 1e-3).ok()])
}

#[test]
fn what_a_finger_is_kept_from_feeling_no_ball_gets_either() {
    let mut step = with_a_ball();
    let (mut applied, mut felt_n_s, mut most_felt) = (Vector3::zeros(), Vector3::zeros(), 0.0_f64);
    let (mut cut, mut last_cut_n) = (0, 0.0);
    for tick in 1..400_u64 {
        // It goes before the ball, slower than that: the ball pushes the hand along. Then it is gone.
        let height = if tick < 300 { 0.025 + 1e-4 * tick as f64 } else { 0.5 };
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count, frame.run_tick) = (tick, 1, tick as i64);
        (frame.previous.authority, frame.previous.command_tick) = (1.0, tick - 1);
        frame.devices[0].flags = DEVICE_POSITION_VALID;
        frame.devices[0].position_m_measured[1] = height;
        frame.devices[0].force_on_user_n_applied = applied.into();
        let (mut command, mut row) = (Command::zero(tick, 1, 1), Row::empty());
        step.step(&frame, &mut command, &mut row);
        applied = Vector3::from(command.devices[0].force_on_user_n);
        assert_eq!(applied, row.fingers[0].force_on_user);
        felt_n_s += applied * 1e-3;
        most_felt = most_felt.max(applied.norm());
        cut += u64::from(row.fingers[0].controlled_n > 0.01);
        if row.fingers[0].entity.is_some() {
            last_cut_n = row.fingers[0].controlled_n;
        }
    }
    let got_n_s = (step.bodies()[0].velocity - FLIES) * MASS_KG;
    assert!(cut > 5 && most_felt > 1e-3, "{cut} ticks cut, {most_felt} N");
    // The last tick's is not paid back any more. Roundings of 0.01 N s in 400 sums.
    let kept_n_s = Vector3::y() * last_cut_n * 1e-3;
    assert!((got_n_s + felt_n_s + kept_n_s).norm() < 1e-14, "{got_n_s} {felt_n_s} {kept_n_s}");
}

/// A grain lies on a floor; a finger that presses it against that is kept from giving energy back, and leaves.
#[test]
fn what_a_floor_bore_flings_no_grain_when_the_finger_has_left() {
    const GRAIN_KG: f64 = 1e-3;
    const RADIUS_M: f64 = 0.02;
    let pose = Isometry3::translation(0.0, RADIUS_M, 0.0);
    let ball = Entity::new(haptics::Sphere::new(RADIUS_M).unwrap(), pose, K).unwrap();
    let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K).unwrap();
    let mass = physics::MassProperties::of_shape(&ball.shape, GRAIN_KG).unwrap();
    let body = Body::at_rest(mass, &pose).with_rotation_locked();
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 2).unwrap().with_ramp_in(0.0).unwrap(),
        device: 0,
        mount: Mount::new(Isometry3::identity()),
    };
    let spec = PassivitySpec::for_motion(1e-3, 0.0, 0.0).with_bound(1e-6);
    let spec = PassivitySpec { device_friction_n: 0.0, ..spec };
    let settings = physics::Settings::default();
    let mut step = FastStep::new(vec![finger], vec![ball, floor], PERIOD_NS)
        .with_objects(&[(0, body)], settings, ListSettings::default(), &[HandFinger::default()], false)
        .unwrap()
        .with_passivities([Passivity::new(spec, 1e-3).ok()]);
    let (mut cut_n, mut fastest_m_s) = (0.0_f64, 0.0_f64);
    // It presses slowly, is held to have felt nothing on the way in and all on the way out, and leaves.
    let depth_m = |tick: u64| match tick {
        0..=100 => 2e-5 * tick as f64,
        101..=110 => 2e-3 - 1e-4 * (tick - 100) as f64,
        _ => -0.1,
    };
    for tick in 1..200_u64 {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count, frame.run_tick) = (tick, 1, tick as i64);
        (frame.previous.authority, frame.previous.command_tick) = (1.0, tick - 1);
        frame.devices[0].flags = DEVICE_POSITION_VALID;
        frame.devices[0].position_m_measured[1] = 2.0 * RADIUS_M - depth_m(tick);
        frame.devices[0].force_on_user_n_applied[1] = if tick > 100 { 0.5 } else { 0.0 };
        let (mut command, mut row) = (Command::zero(tick, 1, 1), Row::empty());
        step.step(&frame, &mut command, &mut row);
        if tick == 110 {
            cut_n = row.fingers[0].controlled_n;
        }
        if tick > 110 {
            fastest_m_s = fastest_m_s.max(step.bodies()[0].velocity.norm());
        }
    }
    assert!(cut_n > 0.3, "{cut_n} N were cut in the last tick that touches");
    // It falls back on the floor from less than a millimetre, 0.14 m/s. A newton more for a tick gives a gram 1 m/s.
    assert!(fastest_m_s < 0.15, "{fastest_m_s} m/s");
}
