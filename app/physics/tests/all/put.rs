//! Who is put elsewhere at once by somebody: what springs hold there is theirs, and what was before is forgotten.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Entity};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Settings, Standing};

const EDGE: f64 = 0.05;
const MASS: f64 = 0.1;
/// Of the springs of one corner: both of this stiffness.
const SOFT: f64 = 1000.0;
const K: f64 = 0.5 * SOFT;

fn at(x: f64, y: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, 0.0)
}

fn block(edges: [f64; 3], place: Isometry3<f64>, mu: f64, damping: f64) -> Entity {
    object(Cuboid::new(edges).unwrap(), place, SOFT, mu).with_damping(damping).unwrap()
}

/// Puts an entity elsewhere, whether it is a body that is held or none at all.
fn put(world: &mut World, entity: usize, to_W: Isometry3<f64>) {
    let World { entities, manipulation, .. } = world;
    if manipulation.is_body(entity) {
        manipulation.put(entity, &to_W, entities);
    } else {
        // It is there, and has not come from anywhere.
        (0..2).for_each(|_| entities[entity].move_to(to_W));
        manipulation.was_moved(entity, entities);
    }
}

/// What carries a cube, and which of its pair with the cube it is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Carrier {
    /// No body.
    Plate,
    /// A body that is held, of a lower number than the cube.
    First,
    /// Of a higher one.
    Second,
}

const CARRIERS: [Carrier; 3] = [Carrier::Plate, Carrier::First, Carrier::Second];

/// A cube above something whose top is at y = 0; says which entities they are.
fn carried(carrier: Carrier, settings: Settings, gap: f64, mu: f64, damping: f64) -> (World, [usize; 2]) {
    let plate = block([0.4, EDGE, 0.4], at(0.0, -0.5 * EDGE), mu, damping);
    let cube = block([EDGE; 3], at(0.0, 0.5 * EDGE + gap), mu, damping);
    let states: [Body; 2] = [body(&plate, 1.0), body(&cube, MASS)];
    let (entities, order) = match carrier {
        Carrier::Second => (vec![cube, plate], [1, 0]),
        _ => (vec![plate, cube], [0, 1]),
    };
    let bodies: Vec<_> = (0..2)
        .filter(|&entity| entity == order[1] || carrier != Carrier::Plate)
        .map(|entity| (entity, states[usize::from(entity == order[1])]))
        .collect();
    let mut world = World::new(entities, &bodies, settings, 0);
    if let Some(body) = world.manipulation.body_of(order[0]) {
        assert!(world.manipulation.take_hold(body, &mut world.entities));
        assert_eq!(world.manipulation.standing(body), Standing::Elsewhere);
    }
    (world, order)
}

fn cube<'w>(world: &'w World, order: &[usize; 2]) -> &'w Body {
    &world.manipulation.bodies()[world.manipulation.body_of(order[1]).unwrap()]
}

/// How fast four springs, pressed so deep (m) when they are let go, throw a mass: implicit Euler, a spring at a time.
fn thrown_m_s(mut depth: f64) -> f64 {
    let (mut v, per_tick) = (0.0, 4.0 * K / MASS * DT);
    loop {
        let next = (v + per_tick * depth) / (1.0 + per_tick * DT);
        depth -= next * DT;
        if depth < 0.0 {
            return v;
        }
        v = next;
    }
}

#[test]
fn what_is_put_into_what_hovers_near_it_throws_it_with_all_that_its_springs_hold() {
    let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
    for carrier in CARRIERS {
        let (mut world, order) = carried(carrier, settings, 5e-4, 0.0, 0.0);
        // They are looked at, and do not touch.
        (0..3).for_each(|_| drop(world.step(&[])));
        assert_eq!(world.manipulation.springs().count(), 1, "{carrier:?}");
        // Less than the millimetre beyond which overlap is let out slowly.
        let depth = 4e-4;
        put(&mut world, order[0], at(0.0, -0.5 * EDGE + 5e-4 + depth));
        let held_j = 4.0 * 0.5 * K * depth * depth;
        for tick in 0..100 {
            world.step(&[]);
            let now_j = cube(&world, &order).kinetic_energy_j() + world.manipulation.elastic_energy_j();
            assert!(now_j <= held_j * (1.0 + 1e-12), "{carrier:?}, {tick}: {now_j} of {held_j} J");
        }
        let (v, expected) = (cube(&world, &order).velocity_W, thrown_m_s(depth));
        // Roundings of some twenty ticks, of places of 25 mm in depths of 0.4 mm.
        assert!((v - Vector3::y() * expected).norm() < 1e-10 * expected, "{carrier:?}: {v} {expected}");
    }
}

#[test]
fn what_is_put_into_what_rests_on_it_carries_it_at_its_depth_again() {
    let sunk = MASS * G / (4.0 * K);
    for carrier in CARRIERS {
        for up in [3e-4, 5e-3, -3e-4, -5e-3] {
            let (mut world, order) = carried(carrier, Settings::default(), -sunk, 0.5, 2.0);
            (0..2000).for_each(|_| drop(world.step(&[])));
            put(&mut world, order[0], at(0.0, -0.5 * EDGE + up));
            // Half a second to be let out or to fall, and 8 N s/m on 0.1 kg fall by e in 25 ms.
            let mut fastest = 0.0_f64;
            for _ in 0..3000 {
                world.step(&[]);
                fastest = fastest.max(cube(&world, &order).velocity_W.y);
            }
            let off = cube(&world, &order).centre_W.y - (up + 0.5 * EDGE - sunk);
            assert!(off.abs() < 1e-9, "{carrier:?}, {up}: {off}");
            // It is let out at 0.2 m/s at most; what is not deep is thrown by its springs, or bounces by less than it fell.
            assert!(fastest < 0.32, "{carrier:?}, {up}: {fastest} m/s");
        }
    }
}

#[test]
fn what_is_put_aside_under_what_rests_on_it_drags_nothing_along() {
    let sunk = MASS * G / (4.0 * K);
    for carrier in CARRIERS {
        let (mut world, order) = carried(carrier, Settings::default(), -sunk, 0.5, 2.0);
        (0..500).for_each(|_| drop(world.step(&[])));
        put(&mut world, order[0], at(0.02, -0.5 * EDGE));
        for tick in 0..500 {
            world.step(&[]);
            let state = cube(&world, &order);
            let moved = state.centre_W - Vector3::y() * (0.5 * EDGE - sunk);
            // Roundings: it rested, and rests.
            // Roundings: it rested, and rests.
            // Roundings: it rested, and rests.
            assert!(moved.norm() < 1e-15, "{carrier:?}, tick {tick}: {moved}");
        }
    }
}
