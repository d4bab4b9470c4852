//! Fuzz targets of the application: recordings, orders, and whole scenes that are made ready to run.

#![allow(non_snake_case)] // Names carry their frame.

use crate::check_message;
use bytemuck::Zeroable;
use haptics::{Shape, Surface};
use nalgebra::{Point3, Vector3};
use phantom3::control::words;
use phantom3::fast_step::FastStep;
use phantom3::record::read::RecordedRun;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::path::Path;
use tempfile::TempDir;
use world::{Scene, ShapeSpec};

/// Lines of orders, with and without their times.
pub fn orders(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for line in text.lines() {
        let order = match words::split_time(line) {
            Ok(order) => order.map_or(line, |(at_s, order)| {
                assert!(at_s.is_finite() && at_s >= 0.0, "{line}: at {at_s} s");
                order
            }),
            Err(error) => {
                check_message(&error);
                line
            }
        };
        if let Err(error) = words::parse(order) {
            check_message(&error);
        }
    }
}

/// A recording as a table.
pub fn replay_csv(bytes: &[u8]) {
    read_through(bytes, "fuzz.csv");
}

/// A recording as MCAP.
pub fn replay_mcap(bytes: &[u8]) {
    read_through(bytes, "fuzz.mcap");
}

/// A scene with everything but files, ready to run, and a few hundred ticks of it at the most, in which the fingers go
/// through some of its things.
pub fn rig(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let file = Path::new("/nowhere/at/all/scene.toml");
    let Ok(scene) = Scene::parse(text, file) else { return };
    if scene.entities.len() > MOST_ENTITIES || scene.entities.iter().any(|entity| in_a_file(&entity.shape)) {
        return;
    }
    match Rig::new(file, Scene { hand: None, ..scene }, None, None, HandMode::Kinematic, 1_000_000) {
        Ok(rig) => match rig.fast_step() {
            Ok(step) => {
                touch(&rig, step);
            }
            Err(error) => check_message(&error.to_string()),
        },
        Err(error) => check_message(&error.to_string()),
    }
}

/// All fingers go in loops about the first few things, from beside them through their middle and along below their faces;
/// in how many ticks any of them was touched.
fn touch(rig: &Rig, mut step: FastStep) -> u32 {
    let things = step.entities().iter().filter(|entity| entity.is_haptic);
    let places: Vec<(Vector3<f64>, f64)> = things
        .map(|entity| (entity.X_WB.translation.vector, way_m(&entity.shape)))
        .filter(|(place_W, _)| place_W.iter().all(|m| m.abs() < FARTHEST_M))
        .take(MOST_TOUCHED)
        .collect();
    let (mut frame, mut command, mut row) = (Frame::zeroed(), Command::zeroed(), Row::empty());
    let mut touched = 0;
    frame.device_count = rig.device_count() as u64;
    for (place_W, way_m) in places {
        for tick in 0..TICKS {
            frame.tick += 1;
            frame.run_tick = frame.tick.cast_signed();
            let part_rad = TAU * f64::from(tick) / f64::from(TICKS);
            for device in 0..rig.device_count() {
                let along = |times: f64| (times * part_rad + 0.3 * device as f64).cos();
                let hip_W = place_W + 0.9 * way_m * Vector3::new(along(1.0), along(3.0), along(2.0));
                let told = &mut frame.devices[device];
                told.flags = DEVICE_POSITION_VALID;
                told.position_m_measured = (rig.base_in_world(device).inverse() * Point3::from(hip_W)).into();
            }
            step.step(&frame, &mut command, &mut row);
            touched += u32::from(row.fingers.iter().any(|finger| finger.entity.is_some()));
            for finger in &row.fingers[..rig.scene.fingers.len()] {
                let force = finger.force_on_user;
                assert!(force.iter().all(|n| n.is_finite()), "{force} N in tick {tick} about {place_W}");
            }
        }
    }
    touched
}

/// About how far the surface is from the middle of a shape (m).
fn way_m(shape: &Shape) -> f64 {
    let way_m = match shape {
        Shape::Form(form) => form.signed_distance(&Vector3::zeros()).abs(),
        // Half the cube around it.
        Shape::Csg(solid) => 0.5 * solid.extent_m(),
        _ => 1.0,
    };
    if way_m.is_finite() { way_m.clamp(1e-4, 1.0) } else { 1.0 }
}

fn in_a_file(shape: &ShapeSpec) -> bool {
    matches!(shape, ShapeSpec::Mesh(_) | ShapeSpec::Nurbs(_))
}

/// Rows until the end or the first that is wrong.
fn read_through(bytes: &[u8], name: &str) {
    let file = DIRECTORY.with_borrow(|directory| directory.path().join(name));
    std::fs::write(&file, bytes).expect("our own directory");
    let mut recorded = match RecordedRun::open(&file) {
        Ok(recorded) => recorded,
        Err(error) => return check_message(&error.to_string()),
    };
    let mut last = None;
    loop {
        match recorded.next_row() {
            Ok(Some((row, _))) => {
                assert!(last < Some(row.run_tick), "ticks rise");
                last = Some(row.run_tick);
            }
            Ok(None) => return,
            Err(error) => return check_message(&error.to_string()),
        }
    }
}

thread_local! {
    /// In memory, where there is such a place: a run of the fuzzer writes a million files.
    static DIRECTORY: RefCell<TempDir> = RefCell::new(
        tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a directory"),
    );
}

/// More are a matter of time only.
const MOST_ENTITIES: usize = 200;
/// So many things are touched, each in so many ticks.
const MOST_TOUCHED: usize = 4;
const TICKS: u32 = 64;
/// Beyond it no device is.
const FARTHEST_M: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fingers_of_a_scene_touch_its_things() {
        let solid = "kind = \"csg\", op = \"union\", children = [\
            { shape = { kind = \"sphere\", radius_m = 0.03 } }, { shape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] } }]";
        for shape in ["kind = \"sphere\", radius_m = 0.02", "kind = \"box\", size_m = [0.2, 0.1, 1.0]", solid]
        {
            let text = format!(
                "[[finger]]\n[[finger]]\nradius_m = 0.005\n[[entity]]\nshape = {{ {shape} }}\nposition_m = [0.1, 0.0, 0.2]\n"
            );
            let file = Path::new("scene.toml");
            let scene = Scene::parse(&text, file).expect("a scene");
            let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
            let touched = touch(&rig, rig.fast_step().expect("a step"));
            // From beside a ball they come in for a third of the way; in the middle of a long box they begin.
            println!("{shape}: {touched} ticks");
            assert!((TICKS / 6..=TICKS).contains(&touched), "{shape}: {touched} of {TICKS} ticks");
        }
    }
}
