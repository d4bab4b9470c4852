//! Damping of contacts in the fast step: by which velocity.

use super::*;
use bytemuck::Zeroable;
use haptics::Finger;
use haptics::Plane;
use nalgebra::{Isometry3, UnitQuaternion};

const PERIOD_NS: u64 = 1_000_000;
const K: f64 = 1000.0;
const B: f64 = 5.0;

/// A finger over a damped floor, its device upside down.
fn step() -> FastStep {
    let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
        device: 0,
        mount: Mount::new(Isometry3::from_parts(Vector3::zeros().into(), turn)),
    };
    FastStep::new(vec![finger], vec![floor.unwrap().with_damping(B).unwrap()], PERIOD_NS)
}

/// The force upwards (N) at this height (m), told to rise at this speed (m/s) in the world.
fn force(step: &mut FastStep, tick: u64, height: f64, rising: f64) -> f64 {
    let mut frame = Frame::zeroed();
    (frame.tick, frame.device_count) = (tick, 1);
    frame.devices[0].flags = DEVICE_POSITION_VALID;
    // The device stands on its head.
    frame.devices[0].position_m_measured[1] = -height;
    frame.devices[0].velocity_m_per_s_estimated[1] = -rising;
    let mut command = Command::zero(tick, 1, 1);
    step.step(&frame, &mut command, &mut Row::empty());
    -command.devices[0].force_on_user_n[1]
}

#[test]
fn every_finger_feels_the_floor() {
    let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K);
    let finger = |device| DeviceFinger {
        finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
        device,
        mount: Mount::new(Isometry3::identity()),
    };
    let mut step = FastStep::new((0..3).map(finger).collect(), vec![floor.unwrap()], PERIOD_NS);
    let mut frame = Frame::zeroed();
    (frame.tick, frame.device_count) = (1, 3);
    for device in &mut frame.devices[..3] {
        device.flags = DEVICE_POSITION_VALID;
        device.position_m_measured[1] = -1e-3;
    }
    let mut command = Command::zero(1, 1, 3);
    step.step(&frame, &mut command, &mut Row::empty());
    // A product of two numbers.
    assert!(command.devices[..3].iter().all(|device| (device.force_on_user_n[1] - K * 1e-3).abs() < 1e-15));
}

#[test]
fn damping_goes_by_what_the_driver_estimates_however_many_ticks_were_missed() {
    let mut step = step();
    step.meet_driver(2, 0);
    force(&mut step, 1, -1e-3, 0.0);
    for tick in [2, 3, 10] {
        // A sum of numbers near 1; the turn by pi leaves 1e-16 of each axis in the others.
        assert!((force(&mut step, tick, -1e-3, -0.1) - (K * 1e-3 + B * 0.1)).abs() < 1e-12);
    }
}

#[test]
fn a_driver_that_tells_no_velocities_is_not_taken_for_one_at_rest() {
    let mut step = step();
    step.meet_driver(0, 0);
    force(&mut step, 1, -1.0e-3, 0.0);
    assert!((force(&mut step, 2, -1.1e-3, 0.0) - (K * 1.1e-3 + B * 0.1)).abs() < 1e-12);
    let after_a_gap = force(&mut step, 12, -2.1e-3, 0.0);
    assert!((after_a_gap - (K * 2.1e-3 + B * 0.1)).abs() < 1e-12, "1 mm in ten ticks");
    step.meet_driver(1, 0);
    assert!((force(&mut step, 13, -2.2e-3, 0.0) - K * 2.2e-3).abs() < 1e-12, "1.1 tells");
}
