//! A step never allocates: counted over ticks that gather, solve and move with every integrator and response.
#![allow(non_snake_case)]

use crate::{common, counting};

use common::*;
use counting::CALLS;
use haptics::{Cuboid, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Integrator, Pull, Response, Settings, Touch};

#[test]
fn a_step_never_allocates() {
    for (name, integrator) in Integrator::NAMES {
        for response in [Response::Force, Response::Impulse { restitution: 0.7 }] {
            let at = |x: f64| Isometry3::translation(x, 0.05, 0.0);
            let mut entities =
                vec![floor(0.1, 2000.0, 0.4), object(Sphere::new(0.02).unwrap(), at(-0.2), 500.0, 0.5)];
            for place in 0..4 {
                let x = f64::from(place) * 0.1;
                entities.push(object(Cuboid::new([0.05, 0.04, 0.03]).unwrap(), at(x), 1000.0, 0.5));
            }
            let bodies: Vec<_> = entities
                .iter()
                .enumerate()
                .skip(1)
                .map(|(index, entity)| (index, body(entity, 0.3)))
                .collect();
            let bodies: Vec<_> = bodies
                .into_iter()
                .map(|(index, body)| (index, body.moving(Vector3::zeros(), Vector3::new(3.0, 1.0, -2.0))))
                .collect();
            let settings = Settings { integrator, response, ..Settings::default() };
            let mut world = World::new(entities, &bodies, settings, 3);
            let (mut touched, mut counted, mut rows) = (0, 0, 0);
            for tick in 0..4000 {
                let t = f64::from(tick) * DT;
                let centre = world.body().centre_W;
                for (index, finger) in world.fingers.iter_mut().enumerate() {
                    let side = if index == 0 { 1.0 } else { -1.0 };
                    let hip = centre
                        + Vector3::new(side * (0.021 - 0.002 * (3.0 * t).sin()), 0.001 * index as f64, 0.0);
                    finger.step(&world.entities, &hip, DT);
                }
                world.touches.clear();
                for (index, finger) in world.fingers.iter().enumerate() {
                    world.touches.extend(finger.contacts().map(|contact| Touch::of(contact, index)));
                }
                touched += world.touches.len();
                let mut pulls = [Pull {
                    entity: 1,
                    finger: 0,
                    point_W: centre,
                    force_on_user_W: Vector3::new(0.01, -0.02, 0.0),
                    stiffness_n_per_m: 50.0,
                }; 3];
                let before = CALLS.get();
                let made = world.manipulation.step_pulled(
                    &mut world.entities,
                    &mut world.touches,
                    &mut pulls,
                    &mut [],
                    DT,
                );
                counted += CALLS.get() - before;
                rows += made.rows;
            }
            assert_eq!(counted, 0, "{name}, {response:?}");
            assert!(touched > 500 && rows > 10_000, "{name}, {response:?}: {touched} {rows}");
        }
    }
}

#[test]
fn nor_does_one_of_bodies_that_press_each_other() {
    for response in [Response::Force, Response::Impulse { restitution: 0.7 }] {
        let mut entities = vec![floor(0.1, 2000.0, 0.4)];
        for place in 0..6 {
            let at = Isometry3::translation(0.003 * f64::from(place), 0.01 + 0.021 * f64::from(place), 0.0);
            entities.push(object(Cuboid::new([0.02; 3]).unwrap(), at, 1000.0, 0.5));
        }
        let bodies: Vec<_> =
            entities.iter().enumerate().skip(1).map(|(index, entity)| (index, body(entity, 0.1))).collect();
        let settings = Settings { response, ..Settings::default() };
        let mut world = World::new(entities, &bodies, settings, 0);
        let (mut counted, mut joined) = (0, 0);
        for _ in 0..1500 {
            let before = CALLS.get();
            world.manipulation.step(&mut world.entities, &mut [], DT);
            counted += CALLS.get() - before;
            joined += usize::from(world.manipulation.islands().iter().any(|bodies| bodies.len() > 1));
        }
        assert_eq!(counted, 0, "{response:?}");
        assert!(joined > 300, "{response:?}: {joined}");
    }
}
