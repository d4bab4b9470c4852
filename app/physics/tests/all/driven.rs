//! Plates that somebody moves: what lies on them is carried by friction, lifted, turned along and woken.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::Cuboid;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Integrator, Settings, Sleep};

const EDGE: f64 = 0.05;
const MASS: f64 = 0.1;
const THICK: f64 = 0.02;
const MU: f64 = 0.5;
/// Of the springs of one corner.
const K: f64 = 2000.0 * 1000.0 / 3000.0;
/// Of both (N s/m).
const DAMPING: f64 = 2.0;

/// A cube on a plate, as deep in it as carries it; entity 0 is the plate, its top at y = 0.
fn cube_on_plate(settings: Settings, off_m: f64) -> World {
    let plate = object(Cuboid::new([1.0, THICK, 1.0]).unwrap(), at(0.0, -0.5 * THICK), 2000.0, MU);
    let depth = MASS * G / (4.0 * K);
    let cube = object(Cuboid::new([EDGE; 3]).unwrap(), at(off_m, 0.5 * EDGE - depth), 1000.0, MU);
    let body = body(&cube, MASS);
    World::new(vec![plate, cube], &[(1, body)], settings, 0)
}

fn at(x: f64, y: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, 0.0)
}

/// Drives the plate's place (m) along this function of time.
fn drive(world: &mut World, ticks: usize, place: impl Fn(f64) -> Vector3<f64>) {
    let from = world.entities[0].X_WB;
    for tick in 1..=ticks {
        let to =
            Isometry3::from_parts((from.translation.vector + place(tick as f64 * DT)).into(), from.rotation);
        assert!(world.manipulation.drive(0, to));
        world.step(&[]);
        assert_eq!(world.entities[0].X_WB, to);
    }
}

#[test]
fn a_plate_that_speeds_up_by_less_than_friction_holds_carries_what_lies_on_it() {
    for (_, integrator) in Integrator::NAMES {
        let mut world = cube_on_plate(Settings { integrator, ..Settings::default() }, 0.0);
        let acceleration = 0.4 * MU * G;
        drive(&mut world, 600, |t| Vector3::x() * (0.5 * acceleration * t * t));
        let behind = world.entities[0].X_WB.translation.x - world.body().centre_W.x;
        // Four springs hold m a, and four others its moment about the feet, which leans it by as much.
        let held_m = MASS * acceleration / (4.0 * K);
        // Of a force that is known when a tick begins dampers take a part: by then the plate is faster by a dt.
        let damped_m = match integrator {
            Integrator::Implicit | Integrator::Rk4 => 0.0,
            Integrator::ThesisEuler | Integrator::ThesisEulerGyroscopic | Integrator::ThesisEulerPrinted => {
                DAMPING * acceleration * DT / K
            }
        };
        let expected = 2.0 * held_m - damped_m;
        // What still swings after 0.6 s; and springs lean by 3 mrad.
        assert!((behind / expected - 1.0).abs() < 0.01, "{integrator:?}: {behind:e} {expected:e}");
        // The plate's velocity is that of the middle of the tick, and within a tick it does not change.
        let slower = acceleration * 0.6 - world.body().velocity_W.x;
        assert!(slower.abs() < acceleration * DT, "{integrator:?}: {slower}");
    }
}

#[test]
fn beyond_what_friction_holds_it_slips_and_speeds_up_by_mu_g() {
    let mut world = cube_on_plate(Settings::default(), 0.0);
    drive(&mut world, 300, |t| Vector3::x() * (0.5 * 2.0 * MU * G * t * t));
    // Until the springs were stretched by mu g m / 4 k, 0.2 mm, it got less.
    let expected = MU * G * 0.3;
    let got = world.body().velocity_W.x;
    assert!((got - expected).abs() < 0.02 * expected, "{got} {expected}");
}

#[test]
fn a_plate_that_goes_up_lifts_with_the_weight_and_a_cube_goes_down_with_it() {
    for (integrator, speed) in
        Integrator::NAMES.iter().flat_map(|(_, integrator)| [(*integrator, 0.2), (*integrator, -0.2)])
    {
        let mut world = cube_on_plate(Settings { integrator, ..Settings::default() }, 0.0);
        // On and on at the same speed, after a tenth of a second in which it gets there.
        drive(&mut world, 900, |t| {
            let t_up = 0.1;
            Vector3::y() * (if t < t_up { speed * t * t / (2.0 * t_up) } else { speed * (t - 0.5 * t_up) })
        });
        let deep = world.entities[0].X_WB.translation.y + 0.5 * (THICK + EDGE) - world.body().centre_W.y;
        let expected = MASS * G / (4.0 * K);
        // It has come to rest against the plate, but for what 0.8 s of damping leave.
        assert!((deep - expected).abs() < 1e-6, "{integrator:?} {speed}: {deep} {expected}");
        assert!(
            (world.body().velocity_W.y - speed).abs() < 1e-4,
            "{integrator:?} {speed}: {:?}",
            world.body().velocity_W
        );
    }
}

#[test]
fn what_lies_on_a_turning_plate_goes_around_with_it() {
    for (_, integrator) in Integrator::NAMES {
        goes_around(integrator);
    }
}

fn goes_around(integrator: Integrator) {
    let (off, omega) = (0.2, 2.0_f64);
    let mut world = cube_on_plate(Settings { integrator, ..Settings::default() }, off);
    let from = world.entities[0].X_WB;
    let mut angle = 0.0;
    for tick in 1..=2000 {
        // omega^2 r, 0.8 m/s^2, is less than mu g.
        angle += omega * DT * (f64::from(tick) / 500.0).min(1.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        world.manipulation.drive(0, Isometry3::from_parts(from.translation, turn));
        world.step(&[]);
    }
    let expected = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle) * Vector3::new(off, 0.0, 0.0);
    let place = world.body().centre_W;
    let apart = Vector3::new(place.x - expected.x, 0.0, place.z - expected.z).norm();
    // A third of a millimetre of springs and lean, on 0.2 m.
    assert!(apart < 1e-3, "{integrator:?}: {apart}");
}

#[test]
fn whoever_sleeps_on_a_plate_wakes_when_it_is_moved_and_a_tick_later_the_plate_rests() {
    let mut world = cube_on_plate(Settings { sleep: Some(Sleep::default()), ..Settings::default() }, 0.0);
    for _ in 0..3000 {
        world.step(&[]);
    }
    assert!(world.manipulation.awake().is_empty());
    drive(&mut world, 100, |t| Vector3::x() * (0.5 * t * t));
    assert_eq!(world.manipulation.awake(), [0]);
    assert!(world.body().velocity_W.x > 0.09, "{:?}", world.body());
    world.step(&[]);
    assert_eq!(world.entities[0].previous_X_WB, world.entities[0].X_WB);
    for _ in 0..3000 {
        world.step(&[]);
    }
    assert!(world.manipulation.awake().is_empty(), "it slid, stopped, and sleeps again");
}

#[test]
fn a_body_cannot_be_driven() {
    let mut world = cube_on_plate(Settings::default(), 0.0);
    assert!(!world.manipulation.drive(1, Isometry3::identity()));
}
