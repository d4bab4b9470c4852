//! Fingers on objects that move.
#![allow(non_snake_case)]

use crate::common;

use std::f64::consts::PI;

use common::*;
use haptics::Cuboid;
use nalgebra::{Isometry3, Vector3};
use physics::Settings;

/// Two fingers close on a cube until they squeeze it so deep (m), lift it by 50 mm and hold it; where it is in the end.
fn lifted(mass: f64, stiffness: f64, mu: f64, squeeze: f64) -> World {
    let floor = floor(0.0, 2000.0, 0.5);
    let cube =
        object(Cuboid::new([0.05; 3]).unwrap(), Isometry3::translation(0.0, 0.025, 0.0), stiffness, mu);
    let body = body(&cube, mass);
    let mut world = World::new(vec![floor, cube], &[(1, body)], Settings::default(), 2);
    for tick in 0..4000 {
        let t = f64::from(tick) * DT;
        let close = (t / 0.5).min(1.0) * (0.01 + squeeze) - 0.01;
        // At most 0.06 m/s^2: less than a hundredth of the weight on top of it.
        let up = 0.025 * (1.0 - ((t - 1.0).clamp(0.0, 2.0) * PI / 2.0).cos());
        let x = 0.025 - close;
        let forces = world.step(&[Vector3::new(x, 0.025 + up, 0.0), Vector3::new(-x, 0.025 + up, 0.0)]);
        assert!(forces.iter().flat_map(|f| f.iter()).all(|x| x.is_finite()));
    }
    world
}

#[test]
fn two_fingers_lift_what_their_friction_carries_and_nothing_heavier() {
    let mu = 0.5;
    for (mass, stiffness) in [(0.1, 500.0), (0.02, 500.0), (0.005, 5000.0), (0.3, 2000.0)] {
        // m g = 2 mu k d
        let needed = mass * G / (2.0 * mu * stiffness);
        let height = |share: f64| lifted(mass, stiffness, mu, share * needed).body().centre_W.y;
        // Carried, the springs hang by m g / 2k; they were met when the cube had sunk into the floor, on four springs in
        // series with the floor's.
        let series = stiffness * 2000.0 / (stiffness + 2000.0);
        let hangs = mass * G * (0.5 / stiffness + 0.25 / series);
        // So near the limit it slips by some hundredths of a millimetre while it is speeded up.
        let held = height(1.05);
        assert!((held - (0.075 - hangs)).abs() < 1e-4, "{mass} kg at {stiffness} N/m: {held}");
        let left = height(0.95);
        assert!(left < 0.026, "{mass} kg at {stiffness} N/m: {left}");
    }
}
