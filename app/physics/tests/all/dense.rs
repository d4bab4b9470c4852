//! So many things in one place that their contacts have no room: what is fixed holds all the same.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Entity};
use nalgebra::Isometry3;
use physics::{Body, ContactStiffness, Settings};

/// Things of one size in rows, so far apart, on a floor.
fn block(counts: [usize; 3], size: [f64; 3], apart: f64, mass: f64) -> World {
    let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
    for x in 0..counts[0] {
        for (y, z) in (0..counts[1]).flat_map(|y| (0..counts[2]).map(move |z| (y, z))) {
            let at = |axis: usize, place: usize| (size[axis] + apart) * place as f64;
            let X_WB = Isometry3::translation(at(0, x), 0.5 * size[1] + at(1, y), at(2, z));
            entities.push(object(Cuboid::new(size).unwrap(), X_WB, 1000.0, 0.5));
        }
    }
    let bodies: Vec<(usize, Body)> = (1..entities.len()).map(|at| (at, body(&entities[at], mass))).collect();
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0)
}

#[test]
fn nothing_falls_through_the_floor_for_want_of_room() {
    // Boxes, each with 26 beside it; and cards, each near all others.
    let blocks = [([5, 4, 5], [0.04; 3], 5e-4, 0.1), ([1, 100, 1], [0.04, 5e-4, 0.04], 2e-4, 0.002)];
    for (at, (counts, size, apart, mass)) in blocks.into_iter().enumerate() {
        let mut world = block(counts, size, apart, mass);
        for _ in 0..150 {
            world.step(&[]);
        }
        let lowest = world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(f64::MAX, f64::min);
        // By itself it would have fallen by 0.1 m. Where pairs are left out cards lie in each other, and on the floor.
        assert!(lowest > 0.0, "{counts:?}: {lowest} m");
        assert_eq!(
            world.manipulation.left_out() > 0,
            at == 1,
            "{counts:?}: {}",
            world.manipulation.left_out()
        );
    }
}
