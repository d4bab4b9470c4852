//! While forces fade, an object gets what its finger is made to feel, times -1.

use bytemuck::Zeroable;
use nalgebra::Vector3;
use phantom3::fast_step::FastStep;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::{FingerRow, Row};
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::path::Path;
use world::Scene;

const DT: f64 = 1e-3;
const MASS: f64 = 0.1;

/// A cube that floats, with keys of its own, and a finger with some of its own.
fn step(cube: &str, finger: &str) -> FastStep {
    let text = format!(
        "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n{finger}\n[[entity]]\nname = \"cube\"\nmass_kg = {MASS}\nrotation_locked = true\n\
         shape = {{ kind = \"box\", size_m = [0.04, 0.04, 0.04] }}\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 1\n\
         friction = {{ model = \"coulomb\", mu = 0.5 }}\n{cube}\n"
    );
    let file = Path::new("scene.toml");
    let scene = Scene::parse(&text, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
    rig.fast_step().expect("a step")
}

fn tick(step: &mut FastStep, tick: u64, hip: [f64; 3]) -> FingerRow {
    let (mut frame, mut row, mut command) = (Frame::zeroed(), Row::empty(), Command::zeroed());
    (frame.tick, frame.device_count, frame.run_tick) = (tick + 1, 1, tick as i64);
    (frame.devices[0].flags, frame.devices[0].position_m_measured) = (DEVICE_POSITION_VALID, hip);
    frame.devices[0].flags |= shm_abi::frame::DEVICE_ORIENTATION_MEASURED;
    frame.devices[0].orientation_wxyz_measured = [1.0, 0.0, 0.0, 0.0];
    frame.devices[0].buttons = 1;
    step.step(&frame, &mut command, &mut row);
    // The device stands as the world does.
    assert_eq!(Vector3::from(command.devices[0].force_on_user_n), row.fingers[0].force_on_user);
    row.fingers[0]
}

/// A finger presses from the side, goes along with the cube as it flies off, and rubs; what it gives is counted. Says how much
/// it was at most, at full strength and faded to less than a half.
fn pressed(cube: &str, finger: &str) -> [f64; 2] {
    let mut step = step(cube, finger);
    let (mut momentum, mut most_n) = (Vector3::zeros(), [0.0_f64; 2]);
    for at in 0..600 {
        // Full for a while, then down to nothing within a tenth of a second, and back.
        let strength = ((at as f64 - 350.0).abs() / 100.0 - 0.5).clamp(0.0, 1.0);
        step.set_strength(strength);
        let t_s = at as f64 * DT;
        let before = step.bodies()[0].position;
        let felt = tick(&mut step, at, [before.x - 0.0205 + 1e-3 * (10.0 * t_s).min(1.0), 0.01 * t_s, 0.0]);
        // As the tick began: what it has got by then. Roundings of 0.1 kg m/s in a thousand sums.
        let state = step.bodies()[0];
        assert!((state.velocity * MASS - momentum).norm() < 1e-13, "tick {at}, {strength}: {state:?}");
        momentum -= felt.force_on_user * DT;
        let most_n = &mut most_n[usize::from(strength < 0.5)];
        *most_n = most_n.max(felt.force_on_user.norm());
        assert!(strength > 0.0 || felt.force_on_user == Vector3::zeros(), "{felt:?}");
    }
    most_n
}

#[test]
fn what_a_faded_touch_gives_the_object_is_what_the_user_feels_of_it() {
    let [full_n, faded_n] = pressed("", "");
    assert!(full_n > 0.1 && faded_n > 0.01, "{full_n} {faded_n}");
}

#[test]
fn so_it_is_of_a_soft_finger_and_of_a_tie() {
    for finger in ["soft = true", "attach = { button = 0, orientation = \"locked\" }"] {
        let [full_n, faded_n] = pressed("", finger);
        assert!(full_n > 0.1 && faded_n > 0.01, "{finger}: {full_n} {faded_n}");
    }
}

#[test]
fn so_it_is_of_a_magnetic_object() {
    let [full_n, faded_n] = pressed("magnetism = { force_n = 1.0, distance_m = 0.01 }", "");
    assert!(full_n > 0.1 && faded_n > 0.01, "{full_n} {faded_n}");
}
