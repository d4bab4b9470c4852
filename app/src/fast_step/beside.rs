//! What is felt beside contacts, in the fast step: by which velocity, and when it is forgotten.

use super::*;
use bytemuck::Zeroable;
use haptics::Finger;
use haptics::{Limits, Region, Track};
use nalgebra::Isometry3;

const PERIOD_NS: u64 = 1_000_000;
const B: f64 = 4.0;

/// A finger in free space with a damper everywhere, and a guide to the ground that captures at 1 mm.
fn step() -> FastStep {
    let limits = Limits::at(1e-3).unwrap();
    let field = Field::viscous([B; 3], Region::everywhere(), &limits).unwrap();
    let ground = Track::plane(Vector3::zeros(), Vector3::y()).unwrap();
    let guide = Guide::new(ground, 100.0, 0.0, &limits).unwrap().with_capture(1e-3).unwrap();
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 0).unwrap(),
        device: 0,
        mount: Mount::new(Isometry3::identity()),
    };
    let mut step = FastStep::new(vec![finger], Vec::new(), PERIOD_NS).with_effects(vec![field], vec![guide]);
    step.meet_driver(1, 0);
    step
}

/// The force along y (N) of a finger here that moves so, as the row and the command have it.
fn force(step: &mut FastStep, tick: u64, flags: u64, y: f64, rising: f64) -> f64 {
    let mut frame = Frame::zeroed();
    (frame.tick, frame.device_count) = (tick, 1);
    frame.devices[0].flags = flags;
    frame.devices[0].position_m_measured[1] = y;
    frame.devices[0].velocity_m_per_s_estimated[1] = rising;
    let (mut command, mut row) = (Command::zero(tick, 1, 1), Row::empty());
    step.step(&frame, &mut command, &mut row);
    assert_eq!(
        command.devices[0].force_on_user_n[1], row.fingers[0].force_on_user.y,
        "recorded as commanded"
    );
    row.fingers[0].force_on_user.y
}

/// Rests on the ground until the guide has it: 50 ms.
fn capture(step: &mut FastStep) {
    for tick in 1..=60 {
        force(step, tick, DEVICE_POSITION_VALID, 0.0, 0.0);
    }
    assert!((force(step, 61, DEVICE_POSITION_VALID, 0.01, 0.0) + 1.0).abs() < 1e-12, "held, 10 mm up");
}

#[test]
fn damping_of_fields_goes_by_the_drivers_estimate_and_without_one_by_positions() {
    let mut told = step();
    force(&mut told, 1, DEVICE_POSITION_VALID, 0.5, 0.0);
    // The positions say 0.2 m/s.
    assert_eq!(force(&mut told, 2, DEVICE_POSITION_VALID, 0.5002, 0.1), -B * 0.1);
    let mut untold = step();
    untold.meet_driver(0, 0);
    force(&mut untold, 1, DEVICE_POSITION_VALID, 0.5, 0.0);
    // Positions near 0.5 m are rounded to 6e-17, over 1 ms.
    assert!((force(&mut untold, 2, DEVICE_POSITION_VALID, 0.5002, 0.1) + B * 0.2).abs() < 1e-12);
}

#[test]
fn a_position_that_is_not_valid_gives_no_force_and_is_forgotten() {
    let mut step = step();
    capture(&mut step);
    assert_eq!(force(&mut step, 62, 0, 0.01, 0.0), 0.0);
    assert_eq!(force(&mut step, 63, DEVICE_POSITION_VALID, 0.01, 0.0), 0.0, "no longer captured");
}

#[test]
fn a_lost_connection_is_a_new_beginning() {
    let mut step = step();
    capture(&mut step);
    step.reset();
    assert_eq!(force(&mut step, 62, DEVICE_POSITION_VALID, 0.01, 0.0), 0.0);
}
