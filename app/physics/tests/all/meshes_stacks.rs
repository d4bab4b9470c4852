//! Blocks of triangles that stand on each other, however finely they are cut, as boxes do.
#![allow(non_snake_case)]

use std::f64::consts::FRAC_PI_2;

use crate::noise::Noise;
use crate::{common, meshes};

use common::*;
use haptics::{Entity, Shape};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{ContactStiffness, Settings};

const MASS: f64 = 0.05;

/// A block whose edges are cut into so many.
fn block(size: [f64; 3], cuts: [usize; 3]) -> Shape {
    let planes: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let share = |cut: usize| cut as f64 / cuts[axis] as f64 - 0.5;
        (0..=cuts[axis]).map(|cut| size[axis] * share(cut)).collect()
    });
    let planes = [&planes[0][..], &planes[1][..], &planes[2][..]];
    meshes::build(meshes::cells(planes, |_| true)).into()
}

/// The way of the highest of some from where it was put, and its lean, after a second (m, rad). They are put
/// 0.1 mm above each other, each with a turn about the vertical and a way aside.
fn moved(shape: &Shape, height: f64, places: &[(f64, [f64; 2])]) -> [f64; 2] {
    let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
    for (at, (turn, [x, z])) in places.iter().enumerate() {
        let y = height * (at as f64 + 0.5) + 1e-4 * (at as f64 + 1.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), *turn);
        let X_WB = Isometry3::from_parts(Vector3::new(*x, y, *z).into(), turn);
        entities.push(object(shape.clone(), X_WB, 1000.0, 0.5));
    }
    let bodies: Vec<_> = (1..entities.len()).map(|at| (at, body(&entities[at], MASS))).collect();
    let last = entities[entities.len() - 1].X_WB;
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness, ..Settings::default() };
    let mut world = World::new(entities, &bodies, settings, 0);
    for _ in 0..1000 {
        world.step(&[]);
    }
    let now = world.entities[world.entities.len() - 1].X_WB;
    let falls = Vector3::y() * (1e-4 * places.len() as f64);
    let leans = (now.rotation * Vector3::y()).dot(&Vector3::y()).min(1.0).acos();
    [(now.translation.vector - last.translation.vector + falls).norm(), leans]
}

#[test]
fn planks_that_cross_lie_on_each_other_however_finely_they_are_cut() {
    const SIZE: [f64; 3] = [0.075, 0.015, 0.025];
    let noise = &mut Noise::new(3);
    for cuts in [[1; 3], [2; 3], [4; 3], [8; 3], [15, 3, 5], [30, 6, 10]] {
        let plank = block(SIZE, cuts);
        for turned in [FRAC_PI_2, noise.within(1.1, 1.5), noise.within(0.7, 1.1), noise.within(0.3, 0.7)] {
            let aside = [noise.within(-0.008, 0.008), noise.within(-0.008, 0.008)];
            let [moved_m, leans] = moved(&plank, SIZE[1], &[(0.0, [0.0; 2]), (turned, aside)]);
            assert!(moved_m < 1e-4 && leans < 3e-3, "{cuts:?}, {turned}: {moved_m} m, {leans} rad");
        }
    }
}

#[test]
fn cubes_that_are_put_a_little_aside_stand_on_each_other() {
    for cuts in [1, 2, 5] {
        let cube = block([0.03; 3], [cuts; 3]);
        for aside in [0.0, 1e-4, 7e-4, 2e-3] {
            let places: Vec<_> =
                (0..6).map(|at| (0.0, [if at % 2 == 0 { aside } else { -aside }, 0.0])).collect();
            let [moved_m, leans] = moved(&cube, 0.03, &places);
            assert!(moved_m < 1e-4 && leans < 3e-3, "{cuts}, {aside}: {moved_m} m, {leans} rad");
        }
    }
}

/// With both ends of the edge that it comes down on beside the other one.
#[test]
fn cubes_that_come_down_on_an_edge_lie_flat_on_each_other() {
    const HALF_M: f64 = 0.02;
    let cube = block([2.0 * HALF_M; 3], [1; 3]);
    for rolled in [2.0, 4.0, 7.0, 15.0_f64].map(f64::to_radians) {
        for turned in [45.0, 44.0, 30.0, 20.0, 10.0_f64].map(f64::to_radians) {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turned)
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rolled);
            let above_m = HALF_M * (1.0 + rolled.cos() + rolled.sin()) + 1e-3;
            let X_WB = Isometry3::from_parts(Vector3::new(0.0, above_m, 0.0).into(), turn);
            let entities = vec![
                object(cube.clone(), Isometry3::identity(), 1000.0, 0.5),
                object(cube.clone(), X_WB, 1000.0, 0.5),
            ];
            let bodies = [(1, body(&entities[1], MASS))];
            let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
            let settings = Settings { contact_stiffness, ..Settings::default() };
            let mut world = World::new(entities, &bodies, settings, 0);
            for _ in 0..600 {
                world.step(&[]);
            }
            let now = world.entities[1].X_WB;
            let leans = (now.rotation * Vector3::y()).y.min(1.0).acos();
            let deep_m = 2.0 * HALF_M - now.translation.y;
            // As deep as a corner comes in a tick of its fall, where only what is in each other is found.
            assert!(
                (-1e-6..1e-4).contains(&deep_m) && leans < 6e-3,
                "{rolled} {turned}: {deep_m} m, {leans} rad"
            );
        }
    }
}
