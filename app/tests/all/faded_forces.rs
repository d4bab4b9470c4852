//! While forces fade nothing moves by itself, and while they come back what is held is held.

use bytemuck::Zeroable;
use phantom3::fast_step::FastStep;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::path::Path;
use world::Scene;

const SCENE: &str = r#"
[[finger]]
[[finger]]
[[entity]]
name = "cube"
mass_kg = 0.1
shape = { kind = "box", size_m = [0.04, 0.04, 0.04] }
stiffness_n_per_m = 1000
friction = { model = "coulomb", mu = 0.8 }
[[entity]]
name = "stone"
position_m = [0.5, 0, 0]
velocity_m_s = [0.3, 0, 0]
mass_kg = 0.1
shape = { kind = "sphere", radius_m = 0.02 }
stiffness_n_per_m = 1000
"#;

fn step() -> FastStep {
    let file = Path::new("scene.toml");
    let scene = Scene::parse(SCENE, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
    rig.fast_step().expect("a step")
}

/// Two fingers that press the cube from both sides, 2 mm deep.
fn tick(step: &mut FastStep, tick: u64) -> Row {
    let (mut frame, mut row, mut command) = (Frame::zeroed(), Row::empty(), Command::zeroed());
    (frame.tick, frame.device_count, frame.run_tick) = (tick + 1, 2, tick as i64);
    for (device, x) in frame.devices.iter_mut().zip([-1.0, 1.0]) {
        let deep_m = (1e-3 * tick as f64).min(2e-3);
        (device.flags, device.position_m_measured) =
            (DEVICE_POSITION_VALID, [x * (0.021 - deep_m), 0.0, 0.0]);
    }
    step.step(&frame, &mut command, &mut row);
    row
}

#[test]
fn what_flies_stands_still_while_forces_fade_and_what_is_held_is_not_lost_while_they_come_back() {
    let mut step = step();
    for at in 0..300 {
        tick(&mut step, at);
    }
    // The tick's row is of how it began.
    tick(&mut step, 300);
    let full_n = tick(&mut step, 301).fingers[0].force_on_user.norm();
    step.set_strength(0.999, true);
    tick(&mut step, 302);
    let before = [step.bodies()[0].position, step.bodies()[1].position];
    let velocity = step.bodies()[1].velocity;
    assert!(full_n > 1.0, "{full_n}");
    for at in 0..100 {
        let strength = 1.0 - f64::from(at + 1) / 100.0;
        step.set_strength(strength, true);
        let felt_n = tick(&mut step, 303 + at as u64).fingers[0].force_on_user.norm();
        assert_eq!([step.bodies()[0].position, step.bodies()[1].position], before);
        // As of something fixed: the implicit answer of what can move is less by k dt^2 / m, a hundredth.
        assert!((felt_n - strength * full_n).abs() < 0.02 * full_n, "{strength}: {felt_n} N of {full_n} N");
    }
    for at in 0..400 {
        step.set_strength((f64::from(at) / 100.0).min(1.0), false);
        let felt_n = tick(&mut step, 403 + at as u64).fingers[0].force_on_user.norm();
        assert!(felt_n < 1.02 * full_n, "{felt_n} N of {full_n} N");
    }
    let sunk_m = before[0].y - step.bodies()[0].position.y;
    assert!(sunk_m.abs() < 1e-4, "held as before: {sunk_m} m");
    // Rows tell how a tick begins, so 399 of 400 are in it.
    let flown = step.bodies()[1].position - before[1];
    assert!((flown.x - velocity.x * 0.399).abs() < 1e-9, "{flown:?}");
}
