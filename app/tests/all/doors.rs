//! Doors through the whole fast step: what a finger is commanded there.
#![allow(non_snake_case)] // Names carry their frame: W is the world.

use bytemuck::Zeroable;
use nalgebra::Vector3;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::path::Path;
use world::Scene;

/// A solid hull with an opening of 50 by 100 mm, and a room behind it.
const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"hull\"\nshape = { kind = \"box\", size_m = [0.1, 0.12, 0.1] }\n\
                     position_m = [0, 0.06, 0]\nstiffness_n_per_m = 2000\n\
                     [[environment]]\nname = \"inside\"\nkind = \"room\"\nsize_m = [0.4, 0.3, 0.4]\n\
                     position_m = [0, 0.15, -0.15]\nstiffness_n_per_m = 2000\n\
                     door = { of = \"hull\", position_m = [0, 0, 0.05], size_m = [0.05, 0.1] }\n";

#[test]
fn a_finger_that_slides_off_a_wall_into_the_opening_is_let_go_within_twenty_ticks() {
    let file = Path::new("scene.toml");
    let scene = Scene::parse(SCENE, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
    // Into the hull's front beside the opening, and along it; 40 mm deep: 80 N.
    let mut step = rig.fast_step().expect("a step");
    let way = |tick: u64| {
        let pressing = Vector3::new(0.04, 0.06, (0.08 - 5e-4 * tick as f64).max(0.01));
        let along_m = 5e-4 * tick.saturating_sub(200) as f64;
        pressing - Vector3::x() * along_m.min(0.04)
    };
    let (mut last_W, mut most_n, mut jump_n) = (Vector3::zeros(), 0.0_f64, 0.0_f64);
    for tick in 0..400 {
        let (mut frame, mut row) = (Frame::zeroed(), Row::empty());
        (frame.tick, frame.device_count, frame.run_tick) = (tick + 1, 1, tick as i64);
        (frame.devices[0].flags, frame.devices[0].position_m_measured) =
            (DEVICE_POSITION_VALID, way(tick).into());
        step.step(&frame, &mut Command::zeroed(), &mut row);
        let force_W = row.fingers[0].force_on_user;
        assert_eq!(step.cuts().count(), 0, "tick {tick}");
        jump_n = jump_n.max((force_W - last_W).norm());
        most_n = most_n.max(force_W.norm());
        last_W = force_W;
    }
    assert!(most_n > 79.0 && last_W == Vector3::zeros(), "{most_n} {last_W:?}");
    // A twentieth of it in a tick.
    assert!(jump_n < 0.05 * most_n * 1.01, "{jump_n} of {most_n}");
}
