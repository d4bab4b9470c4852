//! Devices that are carried through the world, as a camera moves.

use super::*;
use bytemuck::Zeroable;
use haptics::Finger;
use haptics::{Friction, Plane, Shape};
use nalgebra::Isometry3;
use std::path::Path;

const PERIOD_NS: u64 = 1_000_000;

/// Two fingers 0.1 m apart over a table with much friction, attached to the camera.
fn step_and_layout() -> (FastStep, Layout) {
    let text = "master = 0\nattached_to = \"camera\"\n[[device]]\n[[device]]\nposition_m = [0.1, 0, 0]\n";
    let layout = Layout::parse(text, Path::new("l.toml")).unwrap();
    let table: Shape = Plane::new([0.0, 1.0, 0.0].into(), 0.0).unwrap().into();
    let table = Entity::new(table, Isometry3::identity(), 1000.0).unwrap();
    let table = table.with_friction(Friction::Coulomb { mu: 2.0 }).unwrap();
    let finger = |device| DeviceFinger {
        finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
        device,
        mount: Mount::placed(&layout.placement(device)),
    };
    (FastStep::new(vec![finger(0), finger(1)], vec![table], PERIOD_NS), layout)
}

fn frame(tick: u64, tip_D: [f64; 3]) -> Frame {
    let mut frame = Frame::zeroed();
    (frame.tick, frame.device_count) = (tick, 2);
    for device in &mut frame.devices[..2] {
        (device.flags, device.position_m_measured) = (DEVICE_POSITION_VALID, tip_D);
    }
    frame
}

fn feel(step: &mut FastStep, tick: u64, tip_D: [f64; 3]) -> Row {
    let (mut command, mut row) = (Command::zeroed(), Row::empty());
    step.step(&frame(tick, tip_D), &mut command, &mut row);
    row
}

const ABOVE: [f64; 3] = [0.0, 0.01, 0.0];
const INSIDE: [f64; 3] = [0.0, -0.005, 0.0];

fn at(x: f64, y: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, 0.0)
}

#[test]
fn a_camera_that_moves_like_a_hand_carries_touching_fingers_along_and_keeps_their_contacts() {
    let (mut step, layout) = step_and_layout();
    feel(&mut step, 1, ABOVE);
    let before = feel(&mut step, 2, INSIDE).fingers[0];
    let mut row = Row::empty();
    for tick in 1..=4 {
        assert!(step.set_layout(&layout.clone().with_camera(at(tick as f64 * 0.9e-3, 0.0))));
        row = feel(&mut step, 2 + tick, INSIDE);
    }
    for (index, finger) in row.fingers[..2].iter().enumerate() {
        let x = index as f64 * 0.1;
        // A sum of two numbers of about 0.1.
        assert!((finger.hip.x - x - 3.6e-3).abs() < 1e-15);
        // mu d = 10 mm: the god-object sticks where the finger came in, and the spring of 3.6 mm is felt.
        assert!((finger.god_object.x - x).abs() < 1e-15, "{finger:?}");
        // 1000 N/m, depth 5 mm.
        assert!((finger.force_on_user - Vector3::new(-3.6, 5.0, 0.0)).norm() < 1e-12, "{finger:?}");
    }
    assert_eq!(before.god_object.y, row.fingers[0].god_object.y);
}

#[test]
fn a_finger_that_is_carried_into_a_damped_table_is_damped() {
    let (step, layout) = step_and_layout();
    let damped = step.entities[0].clone().with_damping(5.0).unwrap();
    let mut step = FastStep::new(step.fingers, vec![damped], PERIOD_NS);
    step.meet_driver(MINOR_WITH_VELOCITIES, 0);
    feel(&mut step, 1, ABOVE);
    feel(&mut step, 2, INSIDE);
    assert!(step.set_layout(&layout.with_camera(at(0.0, -0.5e-3))));
    // 0.5 m/s downwards, though the device says that it rests: 2.5 N beside the spring's 5.5 N; then it does rest.
    for (tick, force) in [(3, 8.0), (4, 5.5)] {
        let row = feel(&mut step, tick, INSIDE);
        assert!((row.fingers[0].force_on_user.y - force).abs() < 1e-12, "{:?}", row.fingers[0]);
    }
}

#[test]
fn a_jump_is_refused_while_a_finger_touches_and_changes_nothing() {
    let (mut step, layout) = step_and_layout();
    feel(&mut step, 1, ABOVE);
    let before = feel(&mut step, 2, INSIDE);
    assert!(!step.set_layout(&layout.with_camera(at(0.0, 0.5))));
    assert_eq!(feel(&mut step, 3, INSIDE).fingers[..2], before.fingers[..2]);
}

#[test]
fn a_jump_in_free_space_sweeps_nobody_through_the_table() {
    let (mut step, layout) = step_and_layout();
    feel(&mut step, 1, ABOVE);
    // To 0.3 m aside and 3 mm into the table. Swept, the finger would have come in near x = 0.23, and the spring
    // to there would be felt; as a first step it comes in straight above.
    assert!(step.set_layout(&layout.with_camera(at(0.3, -0.013))));
    let finger = feel(&mut step, 2, ABOVE).fingers[0];
    assert!((finger.hip - Vector3::new(0.3, -0.003, 0.0)).norm() < 1e-15);
    assert!((finger.force_on_user - Vector3::new(0.0, 3.0, 0.0)).norm() < 1e-12, "{finger:?}");
}
