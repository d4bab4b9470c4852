//! Objects on planes: falling, resting, sliding, against closed forms.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Friction, Sphere};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::Settings;

const EDGE: f64 = 0.05;
const MASS: f64 = 0.1;

/// A cube on a slope, its lower face in it by as much as carries it; x points up the slope.
fn cube_on(lean: f64, mu: f64) -> World {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), lean);
    let floor = floor(lean, 2000.0, mu);
    let depth = MASS * G * lean.cos() / (4.0 * 2000.0 * 1000.0 / 3000.0);
    let at = turn * Vector3::new(0.0, EDGE / 2.0 - depth, 0.0);
    let cube = object(Cuboid::new([EDGE; 3]).unwrap(), Isometry3::from_parts(at.into(), turn), 1000.0, mu);
    let body = body(&cube, MASS);
    World::new(vec![floor, cube], &[(1, body)], Settings::default(), 0)
}

#[test]
fn what_rests_is_as_deep_as_its_springs_have_to_be_and_is_never_pulled() {
    //= melder#6.2 type=test
    let ball = object(Sphere::new(0.02).unwrap(), Isometry3::translation(0.0, 0.0205, 0.0), 1000.0, 0.5);
    let body = body(&ball, MASS);
    let mut world = World::new(vec![floor(0.0, 2000.0, 0.5), ball], &[(1, body)], Settings::default(), 0);
    for _ in 0..5000 {
        world.step(&[]);
        assert!(world.manipulation.rows().iter().all(|row| row.normal_W.dot(&row.force_W) >= 0.0));
    }
    let depth = MASS * G / (2000.0 * 1000.0 / 3000.0);
    // It has come to rest but for what 5 s of damping leave of 1 mm.
    assert!((world.body().centre_W.y - (0.02 - depth)).abs() < 1e-9, "{:?}", world.body());
}

#[test]
fn what_falls_falls_as_galilei_says() {
    //= melder#5.7 type=test
    let ball = object(Sphere::new(0.02).unwrap(), Isometry3::translation(0.0, 3.0, 0.0), 1000.0, 0.5);
    let body = body(&ball, MASS);
    let mut world = World::new(vec![ball], &[(0, body)], Settings::default(), 0);
    for _ in 0..500 {
        world.step(&[]);
    }
    // The mean velocity of each tick is exact: 500 roundings of numbers near 3.
    assert!((world.body().centre_W.y - (3.0 - 0.5 * G * 0.25)).abs() < 1e-12);
    assert!((world.body().velocity_W.y + G * 0.5).abs() < 1e-12);
}

#[test]
fn a_ball_rolls_down_with_five_sevenths_of_what_a_block_would_slide_with() {
    let (lean, radius) = (0.3_f64, 0.02);
    let floor = floor(lean, 2000.0, 0.8);
    let k = 2000.0 * 1000.0 / 3000.0;
    let normal = Vector3::new(-lean.sin(), lean.cos(), 0.0);
    let at = normal * (radius - MASS * G * lean.cos() / k);
    let ball = object(
        Sphere::new(radius).unwrap(),
        Isometry3::from_parts(at.into(), UnitQuaternion::identity()),
        1000.0,
        0.8,
    );
    let body = body(&ball, MASS);
    let mut world = World::new(vec![floor, ball], &[(1, body)], Settings::default(), 0);
    let mut speed_after = |ticks: usize| {
        for _ in 0..ticks {
            world.step(&[]);
        }
        (world.body().velocity_W.norm(), world.body().angular_velocity_W().norm())
    };
    let (early, _) = speed_after(200);
    let (late, spin) = speed_after(500);
    let acceleration = (late - early) / 0.5;
    let expected = 5.0 / 7.0 * G * lean.sin();
    // The friction that turns it comes from a spring: rolling lags by what stretches it, 0.2 mm of a way of 0.5 m.
    assert!((acceleration - expected).abs() < 1e-3 * expected, "{acceleration} {expected}");
    assert!((spin * radius - late).abs() < 1e-3 * late, "{spin} {late}");
}

/// A cube on a slope of 0.95 times the friction angle creeps by less than this in so many minutes (m).
fn hold(minutes: usize, most: f64) {
    let mu: f64 = 0.5;
    let mut world = cube_on((0.95 * mu).atan(), mu);
    let mut run = |seconds: usize| {
        for _ in 0..1000 * seconds {
            world.step(&[]);
        }
        world.body().centre_W
    };
    let start = run(1);
    let crept = (run(60 * minutes) - start).norm();
    assert!(crept < most, "{crept}");
}

#[test]
fn for_five_minutes_a_cube_just_below_the_friction_angle_does_not_creep() {
    // What the solver leaves open, 1e-10 of the forces, each tick anew: the corners at the rim slide by that.
    hold(5, 1e-8);
}

#[test]
#[ignore = "the long version: cargo test --release -p physics --test all ramp:: -- --ignored"]
fn for_an_hour_a_cube_just_below_the_friction_angle_does_not_creep() {
    hold(60, 1e-7);
}

#[test]
fn a_cube_holds_just_below_the_friction_angle_and_slides_just_above_as_coulomb_says() {
    let mu: f64 = 0.5;
    let mut world = cube_on((0.95 * mu).atan(), mu);
    for _ in 0..1000 {
        world.step(&[]);
    }
    let start = world.body().centre_W;
    for _ in 0..60_000 {
        world.step(&[]);
    }
    let crept = (world.body().centre_W - start).norm();
    // What the solver leaves open, 1e-10 of the forces, each tick anew.
    assert!(crept < 1e-9, "{crept}");

    let lean = 0.6_f64;
    let mut world = cube_on(lean, mu);
    for _ in 0..300 {
        world.step(&[]);
    }
    let v = world.body().velocity_W;
    for _ in 0..300 {
        world.step(&[]);
    }
    let a = (world.body().velocity_W - v).norm() / 0.3;
    let expected = G * (lean.sin() - mu * lean.cos());
    assert!((a - expected).abs() < 1e-6 * expected, "{a} {expected}");
}

#[test]
fn what_slides_does_so_with_the_lower_ratio_until_it_stands() {
    let (hold, slide) = (0.6_f64, 0.3_f64);
    // On a slope of this tangent, going down at this speed (m/s).
    let slides = |tangent: f64, speed: f64| {
        let lean = tangent.atan();
        let mut world = cube_on(lean, hold);
        for entity in &mut world.entities {
            entity.friction = Friction::stiction(hold, slide).unwrap();
        }
        let down = Vector3::new(-lean.cos(), -lean.sin(), 0.0);
        let state = world.manipulation.bodies()[0].moving(down * speed, Vector3::zeros());
        (World::new(world.entities, &[(1, state)], Settings::default(), 0), down)
    };
    let speed_after = |world: &mut World, down: &Vector3<f64>, ticks: usize| {
        (0..ticks).for_each(|_| drop(world.step(&[])));
        world.body().velocity_W.dot(down)
    };
    // Between both it goes on.
    for tangent in [0.4_f64, 0.55] {
        let lean = tangent.atan();
        let (mut world, down) = slides(tangent, 0.3);
        let early = speed_after(&mut world, &down, 300);
        let late = speed_after(&mut world, &down, 300);
        let expected = G * (lean.sin() - slide * lean.cos());
        assert!(((late - early) / 0.3 / expected - 1.0).abs() < 1e-5, "{tangent}: {early} {late} {expected}");
    }
    // Below both it comes to a stop as it should, and stays.
    let lean = 0.2_f64.atan();
    let (mut world, down) = slides(0.2, 0.5);
    let brakes = G * (slide * lean.cos() - lean.sin());
    let early = speed_after(&mut world, &down, 100);
    let late = speed_after(&mut world, &down, 200);
    assert!(((early - late) / 0.2 / brakes - 1.0).abs() < 1e-5, "{early} {late} {brakes}");
    assert!(speed_after(&mut world, &down, 2000).abs() < 1e-6, "{:?}", world.body());
}
