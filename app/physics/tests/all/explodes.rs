//! Nothing explodes: whatever is asked, every number stays finite and every speed below its bound, and what is lost is reported.
//!
//! Thousands of hands: `cargo test --release -p physics --test all explodes:: -- --ignored` (a minute).
#![allow(non_snake_case)]

use crate::{common, noise};

use common::*;
use haptics::{Cuboid, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use noise::Noise;
use physics::{Body, Integrator, Manipulation, Parked, Reason, Response, Settings, Touch};

fn assert_within(world: &World, settings: &Settings, what: &str) {
    for body in world.manipulation.bodies() {
        assert!(body.is_finite(), "{what}: {body:?}");
        // Roundings of the cut.
        assert!(body.velocity_W.norm() <= settings.most_speed_m_s * (1.0 + 1e-12), "{what}: {body:?}");
        let spin = body.angular_velocity_W().norm();
        assert!(spin <= settings.most_spin_rad_s * (1.0 + 1e-9), "{what}: {spin} rad/s");
        assert!(body.centre_W.norm() <= settings.world_radius_m, "{what}: {body:?}");
    }
    for touch in &world.touches {
        assert!(touch.force_on_user_W.iter().all(|x| x.is_finite()), "{what}: {touch:?}");
    }
}

/// Objects that may overlap each other, the floor and the fingers from the start.
fn crowded(noise: &mut Noise, settings: Settings, fingers: usize) -> World {
    let mut entities = vec![floor(noise.within(-0.3, 0.3), 2000.0, 0.5)];
    let mut bodies = Vec::new();
    for _ in 0..1 + noise.below(4) {
        let shape: Shape = if noise.chance(0.5) {
            Sphere::new(noise.log_within(1e-3, 0.1)).unwrap().into()
        } else {
            Cuboid::new([0; 3].map(|_| noise.log_within(1e-3, 0.2))).unwrap().into()
        };
        let X_WB = Isometry3::from_parts(noise.vector(0.05).into(), noise.turn());
        let (stiffness, mu) = (noise.log_within(10.0, 5000.0), noise.within(0.0, 2.0));
        let entity = object(shape, X_WB, stiffness, mu).with_damping(noise.within(0.0, 5.0)).unwrap();
        let own = body(&entity, noise.log_within(1e-3, 10.0));
        let (velocity, spin) = (noise.vector(20.0), noise.vector(1000.0));
        bodies.push((
            entities.len(),
            if noise.chance(0.2) { own.with_rotation_locked() } else { own.moving(velocity, spin) },
        ));
        entities.push(entity);
    }
    World::new(entities, &bodies, settings, fingers)
}

fn jump_about(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let noise = &mut Noise::new(seed);
        let (_, integrator) = Integrator::NAMES[noise.below(4)];
        let response =
            if noise.chance(0.7) { Response::Force } else { Response::Impulse { restitution: noise.unit() } };
        let settings = Settings { integrator, response, ..Settings::default() };
        let mut world = crowded(noise, settings, 3);
        let mut hips = [noise.vector(0.05), noise.vector(0.05), noise.vector(0.05)];
        for tick in 0..1000 {
            for hip in &mut hips {
                *hip += noise.vector(1e-3);
                if noise.chance(0.01) {
                    *hip += noise.direction() * 0.5;
                }
                if noise.chance(0.01) || hip.norm() > 1.0 {
                    // Right into the first of the bodies.
                    *hip = world.body().centre_W + noise.vector(0.01);
                }
            }
            let mut asked = hips;
            if noise.chance(0.02) {
                asked[noise.below(3)][noise.below(3)] =
                    if noise.chance(0.5) { f64::NAN } else { f64::INFINITY };
            }
            let forces = world.step(&asked);
            assert!(forces.iter().all(|f| f.iter().all(|x| x.is_finite())));
            assert_within(&world, &settings, &format!("seed {seed}, tick {tick}, {settings:?}"));
        }
    }
}

#[test]
fn fingers_that_jump_half_a_metre_in_a_tick_throw_nothing_beyond_its_bounds() {
    jump_about(0..100);
}

#[test]
#[ignore = "a minute; see the top of the file"]
fn thousands_of_hands_that_jump_throw_nothing_beyond_its_bounds() {
    jump_about(100..5000);
}

#[test]
fn any_length_of_tick_is_survived() {
    for seed in 0..100 {
        let noise = &mut Noise::new(seed);
        let settings = Settings::default();
        let mut world = crowded(noise, settings, 0);
        for _ in 0..500 {
            let dt = match noise.below(8) {
                0 => f64::NAN,
                1 => 0.0,
                2 => -1e-3,
                3 => f64::INFINITY,
                _ => noise.log_within(1e-9, 1.0),
            };
            world.made = world.manipulation.step(&mut world.entities, &mut [], dt);
            assert_within(&world, &settings, &format!("seed {seed}, {dt} s"));
        }
    }
    let mut world = crowded(&mut Noise::new(1), Settings::default(), 0);
    let before = world.manipulation.bodies().to_vec();
    for dt in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        world.manipulation.step(&mut world.entities, &mut [], dt);
    }
    assert_eq!(world.manipulation.bodies(), before, "time that is none moves nothing");
}

#[test]
fn touches_that_are_no_numbers_press_nothing() {
    let breaks: [&dyn Fn(&mut Touch); 5] = [
        &|touch| touch.point_W.x = f64::NAN,
        &|touch| touch.normal_W.y = f64::INFINITY,
        &|touch| touch.force_on_user_W.z = f64::NAN,
        &|touch| touch.force_on_user_W = Vector3::repeat(1e300),
        &|touch| touch.entity = 77,
    ];
    for (_, integrator) in Integrator::NAMES {
        for change in breaks {
            let ball = object(Sphere::new(0.02).unwrap(), Isometry3::identity(), 1000.0, 0.5);
            let settings = Settings { integrator, gravity_W: Vector3::zeros(), ..Settings::default() };
            let mut world = World::new(vec![ball.clone()], &[(0, body(&ball, 0.1))], settings, 0);
            let mut touch = Touch {
                entity: 0,
                finger: 0,
                point_W: Vector3::new(0.02, 0.0, 0.0),
                normal_W: Vector3::x(),
                force_on_user_W: Vector3::x(),
                is_sticking: true,
                stiffness_n_per_m: 1000.0,
                label: 0,
                held_by_waiting_n: 0.0,
            };
            change(&mut touch);
            for _ in 0..10 {
                let mut touches = [touch];
                world.manipulation.step(&mut world.entities, &mut touches, DT);
                assert!(
                    world.body().is_finite() && world.body().velocity_W.norm() <= settings.most_speed_m_s
                );
            }
            assert!(world.manipulation.parked().len() <= 1);
        }
    }
}

#[test]
fn what_leaves_the_world_is_parked_and_told_once() {
    let ball = |x: f64| object(Sphere::new(0.02).unwrap(), Isometry3::translation(x, 0.0, 0.0), 1000.0, 0.5);
    let entities = vec![ball(0.0), ball(1.0), ball(2.0)];
    let fast = body(&entities[1], 0.1).moving(Vector3::x() * 30.0, Vector3::zeros());
    let bodies: Vec<(usize, Body)> = vec![(0, body(&entities[0], 0.1)), (1, fast)];
    let settings = Settings { gravity_W: Vector3::zeros(), world_radius_m: 5.0, ..Settings::default() };
    let mut world = World::new(entities, &bodies, settings, 0);
    let mut told = Vec::new();
    for _ in 0..1000 {
        world.step(&[]);
        let parked = world.manipulation.parked();
        told.extend_from_slice(&parked[parked.len() - world.made.parked..]);
    }
    assert_eq!(told, [Parked { entity: 1, why: Reason::LeftTheWorld }]);
    assert_eq!(world.manipulation.parked(), told);
    // It stands where it was seen last.
    let body = world.manipulation.bodies()[1];
    assert!(body.centre_W.norm() <= 5.0 && body.velocity_W == Vector3::zeros());
    assert_eq!(world.entities[1].previous_X_WB, world.entities[1].X_WB);
}

#[test]
fn what_is_lost_to_a_number_that_is_none_is_parked_and_told() {
    let ball = object(Sphere::new(0.02).unwrap(), Isometry3::identity(), 1000.0, 0.5);
    let lost = Body { velocity_W: Vector3::new(f64::NAN, 0.0, 0.0), ..body(&ball, 0.1) };
    let other = object(Sphere::new(0.02).unwrap(), Isometry3::translation(0.5, 1.0, 0.0), 1000.0, 0.5);
    let bodies = [(1, lost), (2, body(&other, 0.1))];
    for (_, integrator) in Integrator::NAMES {
        let settings = Settings { integrator, ..Settings::default() };
        let entities = vec![floor(0.0, 2000.0, 0.5), ball.clone(), other.clone()];
        let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
        let mut entities = entities;
        let made = manipulation.step(&mut entities, &mut [], DT);
        assert_eq!(made.parked, 1);
        assert_eq!(manipulation.parked(), [Parked { entity: 1, why: Reason::NotANumber }]);
        assert!(manipulation.bodies().iter().all(Body::is_finite));
        for _ in 0..100 {
            manipulation.step(&mut entities, &mut [], DT);
        }
        // The other one has not noticed.
        assert!((manipulation.bodies()[1].velocity_W.y + G * 0.101).abs() < 1e-9);
    }
}
