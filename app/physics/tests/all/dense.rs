//! Contacts of so many things in one place that they have no room: what is fixed holds all the same.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Entity};
use nalgebra::Isometry3;
use physics::{Body, ContactStiffness, Settings};

/// Things of one size in rows, so far apart, on a floor; the lowest are the last.
fn block(counts: [usize; 3], size: [f64; 3], apart: f64) -> World {
    let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
    for y in (0..counts[1]).rev() {
        for (x, z) in (0..counts[0]).flat_map(|x| (0..counts[2]).map(move |z| (x, z))) {
            let at = |axis: usize, place: usize| (size[axis] + apart) * place as f64;
            let X_WB = Isometry3::translation(at(0, x), 0.5 * size[1] + at(1, y), at(2, z));
            entities.push(object(Cuboid::new(size).unwrap(), X_WB, 1000.0, 0.5));
        }
    }
    let bodies: Vec<(usize, Body)> = (1..entities.len()).map(|at| (at, body(&entities[at], 0.1))).collect();
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0)
}

#[test]
fn nothing_falls_through_the_floor_for_want_of_room() {
    // Boxes, each with 26 beside it: fewer than there is room for, and more; and cards, each near all others.
    let blocks = [
        ([5, 4, 5], [0.04; 3], 5e-4, false),
        ([8, 6, 8], [0.04; 3], 0.0, true),
        ([1, 300, 1], [0.04, 5e-5, 0.04], 5e-6, true),
    ];
    for (counts, size, apart, is_full) in blocks {
        let mut world = block(counts, size, apart);
        for _ in 0..40 {
            world.step(&[]);
        }
        let lowest = world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(f64::MAX, f64::min);
        let sunk_m = 0.5 * size[1] - lowest;
        let left_out = world.manipulation.left_out();
        // By itself it would have fallen by 8 mm. Where contacts are left out things lie in each other, and on the floor.
        assert!(sunk_m < 0.5 * size[1] && sunk_m < 1e-3, "{counts:?}: {sunk_m} m");
        assert_eq!(left_out > 0, is_full, "{counts:?}: {left_out}");
    }
}
