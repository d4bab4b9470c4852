//! Things that overlap are let out slowly, whatever they are, however deep, and also where another way out becomes the shortest one.
#![allow(non_snake_case)]

use crate::common;
use crate::noise::Noise;
use crate::thrown::{KINDS, shape};

use common::*;
use haptics::{Cuboid, Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, ContactStiffness, Settings};

/// The fastest that either of two gets that are placed into each other (m/s), and after which time none of their springs
/// presses any more (s). The second has this share of the first one's mass.
fn let_out(noise: &mut Noise, contact_stiffness: ContactStiffness, share: f64) -> [f64; 2] {
    let [one, other] = [0; 2].map(|_| shape(KINDS[noise.below(KINDS.len())], noise));
    let entities: Vec<Entity> = [(one, Vector3::zeros()), (other, noise.vector(0.02))]
        .map(|(shape, at_W)| object(shape, Isometry3::from_parts(at_W.into(), noise.turn()), 1000.0, 0.5))
        .into();
    let bodies: Vec<(usize, Body)> =
        [1.0, share].iter().enumerate().map(|(at, share)| (at, body(&entities[at], 0.1 * share))).collect();
    let settings = Settings { gravity_W: Vector3::zeros(), contact_stiffness, ..Settings::default() };
    let mut world = World::new(entities, &bodies, settings, 0);
    let [mut fastest_m_s, mut pressed_s] = [0.0_f64; 2];
    for tick in 0..3000 {
        world.step(&[]);
        let speeds = world.manipulation.bodies().iter().map(|body| body.velocity_W.norm());
        fastest_m_s = speeds.fold(fastest_m_s, f64::max);
        if world.manipulation.rows().iter().any(|row| row.force_W != Vector3::zeros()) {
            pressed_s = DT * f64::from(tick);
        }
    }
    [fastest_m_s, pressed_s]
}

/// A plate is driven down through what lies on the floor, and stops a hand's breadth below it.
#[test]
fn what_is_driven_through_things_does_not_shoot_them_out() {
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness, ..Settings::default() };
    for (seed, kind) in KINDS.into_iter().enumerate() {
        let plate = object(
            Cuboid::new([0.3, 0.02, 0.3]).unwrap(),
            Isometry3::translation(0.0, 0.1, 0.0),
            1000.0,
            0.5,
        );
        let noise = &mut Noise::new(seed as u64);
        let thing = object(shape(kind, noise), Isometry3::translation(0.0, 0.03, 0.0), 1000.0, 0.5);
        let entities = vec![floor(0.0, 1000.0, 0.5), plate, thing];
        let bodies = [(2, body(&entities[2], 0.1))];
        let mut world = World::new(entities, &bodies, settings, 0);
        for tick in 0..1500 {
            if (300..700).contains(&tick) {
                let y = 0.1 - 0.14 * f64::from(tick - 299) / 400.0;
                assert!(world.manipulation.drive(1, Isometry3::translation(0.0, y, 0.0)));
            }
            world.step(&[]);
            let fastest_m_s = world.manipulation.bodies()[0].velocity_W.norm();
            // Two springs at the most that they hold, one after the other, and what falls over.
            assert!(fastest_m_s < 2.0, "{kind:?} at {tick}: {fastest_m_s} m/s");
        }
    }
}

/// Six plates of ten kilograms on three balls of a gram, on a plate that is driven along: nothing is squeezed.
#[test]
fn what_is_driven_along_carries_what_it_carried() {
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness, ..Settings::default() };
    let at = Isometry3::translation;
    let plate = |size_m: [f64; 3], y: f64| object(Cuboid::new(size_m).unwrap(), at(0.0, y, 0.0), 1000.0, 0.5);
    let mut entities = vec![plate([0.3, 0.02, 0.3], -0.01)];
    for [x, z] in [[0.04, 0.0], [-0.02, 0.035], [-0.02, -0.035]] {
        entities.push(object(Sphere::new(0.01).unwrap(), at(x, 0.01, z), 1000.0, 0.5));
    }
    entities.extend((0..6).map(|above| plate([0.12, 0.04, 0.12], 0.04 + 0.04 * f64::from(above))));
    let mass_kg = |index: usize| if index < 4 { 1e-3 } else { 10.0 };
    let bodies: Vec<_> = (1..10).map(|index| (index, body(&entities[index], mass_kg(index)))).collect();
    let mut world = World::new(entities, &bodies, settings, 0);
    for tick in 0..700 {
        if tick >= 300 {
            assert!(world.manipulation.drive(0, at(1e-4 * f64::from(tick - 299), -0.01, 0.0)));
        }
        world.step(&[]);
    }
    let lowered_m = 0.04 - world.entities[4].X_WB.translation.y;
    assert!(lowered_m < 2e-4, "{lowered_m} m");
}

#[test]
fn what_is_placed_into_each_other_comes_out_slowly() {
    let by_mass = ContactStiffness::ByMass { damping_ratio: 1.0 };
    for (name, contact_stiffness) in [("by mass", by_mass), ("as felt", ContactStiffness::AsFelt)] {
        for share in [1.0, 0.01] {
            let mut free = 0;
            for seed in 0..100 {
                let [fastest_m_s, pressed_s] = let_out(&mut Noise::new(seed), contact_stiffness, share);
                // Depths fall by 0.2 m/s at most; at the end of an arm what turns out of another is a little faster.
                assert!(fastest_m_s < 0.35, "{name}, {share}, {seed}: {fastest_m_s} m/s");
                free += usize::from(pressed_s < 2.0);
            }
            // Rings about bars have no way out.
            assert!(free > 85, "{name}, {share}: {free}");
        }
    }
}
