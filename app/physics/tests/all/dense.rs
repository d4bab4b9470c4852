//! Contacts of so many things in one place that they have no room: what is fixed holds all the same.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Begins, Body, ContactStiffness, Manipulation, Settings};

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
    // Boxes, each with 26 beside it: fewer than there is room for, and more.
    let blocks = [([5, 4, 5], [0.04; 3], 5e-4, false), ([8, 6, 8], [0.04; 3], 0.0, true)];
    for (counts, size, apart, is_full) in blocks {
        let mut world = block(counts, size, apart);
        world.makes_room = false;
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

/// Each card is near all others. Until there was room for all of their contacts they lay in each other.
#[test]
fn a_deck_of_cards_sinks_in_by_what_it_weighs_at_most() {
    const CARDS: usize = 300;
    let mut world = block([1, CARDS, 1], [0.04, 5e-5, 0.04], 5e-6);
    (0..40).for_each(|_| drop(world.step(&[])));
    let lowest = world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(f64::MAX, f64::min);
    // On the lowest one's four points, each of (1000 / s)^2 times a card's mass.
    assert!(2.5e-5 - lowest < CARDS as f64 * G / 4e6, "{lowest} m");
    assert_eq!(world.manipulation.left_out(), 0);
}

#[test]
fn a_block_has_the_room_that_it_needs() {
    let mut world = block([8, 6, 8], [0.04; 3], 0.0);
    (0..20).for_each(|_| drop(world.step(&[])));
    assert_eq!(world.manipulation.left_out(), 0);
}

#[test]
fn a_heap_has_the_room_that_it_needs() {
    // Of 600 balls, which fall in a column and flow apart; balls were in each other by 3 mm and more when there was room for
    // three of each.
    let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
    for at in 0..600 {
        let [x, y, z] = [at % 8, at / 64, at / 8 % 8].map(|place| f64::from(place) * 0.0215);
        let lean = f64::from(at * 7919 % 600) * 1e-6;
        let X_WB = Isometry3::translation(x + lean, 0.011 + y, z - lean);
        entities.push(object(Sphere::new(0.01).unwrap(), X_WB, 1000.0, 0.5));
    }
    let bodies: Vec<(usize, Body)> = (1..entities.len()).map(|at| (at, body(&entities[at], 0.01))).collect();
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let mut world = World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0);
    for tick in 0..400 {
        world.step(&[]);
        let lowest = world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(f64::MAX, f64::min);
        // By 0.2 mm where columns of ten have fallen on them.
        assert!(lowest > 0.0095, "tick {tick}: {lowest} m");
    }
    assert_eq!(world.manipulation.left_out(), 0);
    let centres: Vec<_> = world.manipulation.bodies().iter().map(|body| body.centre_W).collect();
    let pairs =
        centres.iter().enumerate().flat_map(|(at, one)| centres[..at].iter().map(move |other| one - other));
    let nearest = pairs.map(|way_W| way_W.norm()).fold(f64::MAX, f64::min);
    // The weight of ten balls sinks in by 1e-4 of their radius on contacts by mass.
    assert!(nearest > 0.0198, "{nearest} m");
}

/// Balls in rows without gravity, which all come to one place.
fn collapse() -> (World, Settings) {
    let mut entities: Vec<Entity> = Vec::new();
    for at in 0..1000 {
        let [x, y, z] = [at % 10, at / 10 % 10, at / 100].map(|place| f64::from(place) * 0.035 - 0.1575);
        entities.push(object(Sphere::new(0.01).unwrap(), Isometry3::translation(x, y, z), 1000.0, 0.0));
    }
    let moving = |at: usize| {
        let still = body(&entities[at], 0.01);
        still.moving(still.centre_W * -20.0, Vector3::zeros())
    };
    let bodies: Vec<(usize, Body)> = (0..entities.len()).map(|at| (at, moving(at))).collect();
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let gravity_W = Vector3::zeros();
    let settings = Settings { contact_stiffness, gravity_W, ..Settings::default() };
    (World::new(entities, &bodies, settings, 0), settings)
}

/// Room that is made in the middle of a tick, instead of before it, changes nothing, and there is none to spare.
#[test]
fn without_deadlines_no_pair_is_left_out_and_things_move_as_with_room_for_all() {
    let ((mut world, _), (mut growing, settings)) = (collapse(), collapse());
    let bodies: Vec<_> = growing.manipulation.bodies().iter().copied().enumerate().collect();
    let begins = Begins { has_deadlines: false, ..Begins::default() };
    growing.manipulation = Manipulation::begin(&growing.entities, &bodies, settings, begins).unwrap();
    growing.makes_room = false;
    let mut most_pairs = 0;
    for tick in 0..40 {
        for world in [&mut world, &mut growing] {
            world.step(&[]);
        }
        assert!(world.manipulation.bodies() == growing.manipulation.bodies(), "tick {tick}");
        most_pairs = most_pairs.max(growing.manipulation.pair_count());
    }
    assert_eq!([&world, &growing].map(|world| world.manipulation.left_out()), [0; 2]);
    assert!(most_pairs > 6000, "{most_pairs}: more than have room at first");
    let room = growing.manipulation.pair_room();
    assert!((most_pairs..most_pairs + 256).contains(&room), "{room} for {most_pairs}");
}

/// Cubes over a floor, which come down in the same tick: more points than have room at first.
#[test]
fn without_deadlines_no_contact_point_is_left_out() {
    let falling = || {
        let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
        for at in 0..2500 {
            let [x, z] = [at % 50, at / 50].map(|place| f64::from(place) * 0.04);
            let cube = Cuboid::new([0.02; 3]).unwrap();
            entities.push(object(cube, Isometry3::translation(x, 0.06, z), 1000.0, 0.5));
        }
        let moving = |at: usize| body(&entities[at], 0.01).moving(Vector3::y() * -10.0, Vector3::zeros());
        let bodies: Vec<(usize, Body)> = (1..entities.len()).map(|at| (at, moving(at))).collect();
        let settings = Settings::default();
        (World::new(entities, &bodies, settings, 0), bodies, settings)
    };
    let ((mut world, _, _), (mut growing, bodies, settings)) = (falling(), falling());
    let begins = Begins { has_deadlines: false, ..Begins::default() };
    growing.manipulation = Manipulation::begin(&growing.entities, &bodies, settings, begins).unwrap();
    growing.makes_room = false;
    for tick in 0..10 {
        for world in [&mut world, &mut growing] {
            world.step(&[]);
        }
        assert!(world.manipulation.bodies() == growing.manipulation.bodies(), "tick {tick}");
    }
    assert_eq!([&world, &growing].map(|world| world.manipulation.left_out()), [0; 2]);
    assert_eq!(growing.manipulation.rows().len(), 10_000);
}

/// Things that met while there was no room for them are in each other when there is: nobody has put them there, and they gain
/// nothing by it.
#[test]
fn nothing_is_gained_by_room_that_comes_late() {
    let (mut world, _) = collapse();
    let energy_j =
        |world: &World| world.manipulation.bodies().iter().map(Body::kinetic_energy_j).sum::<f64>();
    let (begin_j, mut was_j) = (energy_j(&world), energy_j(&world));
    for tick in 0..60 {
        world.makes_room = tick >= 30;
        world.step(&[]);
        let now_j = energy_j(&world) + world.manipulation.elastic_energy_j();
        assert!(now_j < was_j + 1e-9 * begin_j, "tick {tick}: {now_j} J after {was_j} J of {begin_j} J");
        was_j = now_j;
    }
    assert!(world.manipulation.left_out() > 1000, "{}", world.manipulation.left_out());
}
