//! Parts that overlap without an edge in common, as artists join them: felt as one solid, of which crossings are concave edges.

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Csg, CsgPart, CsgTree, Cuboid, Friction, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A box and its place.
type Block = ([f64; 3], Isometry3<f64>);

fn soup(blocks: &[Block]) -> TriangleSoup {
    let mut all = TriangleSoup::default();
    for (size_m, place) in blocks {
        let block = make::cuboid(*size_m);
        let first = all.vertices.len() as u32;
        all.vertices.extend(block.vertices.iter().map(|v| (place * nalgebra::Point3::from(*v)).coords));
        all.faces.extend(block.faces.iter().map(|face| face.map(|v| v + first)));
    }
    all
}

fn moved(size_m: [f64; 3], by: [f64; 3]) -> Block {
    (size_m, Isometry3::translation(by[0], by[1], by[2]))
}

/// A floor whose top is at y = 0, and a wall that comes out of it, its near side at x = 0.
fn floor_and_wall() -> Vec<Block> {
    vec![moved([0.2, 0.02, 0.2], [0.0, -0.01, 0.0]), moved([0.02, 0.1, 0.1], [0.01, 0.03, 0.004])]
}

#[test]
fn along_a_floor_a_finger_comes_to_the_wall_that_stands_in_it_and_up_along_it() {
    let mesh = built(soup(&floor_and_wall()));
    let entity = touchable(&mesh, Friction::None);
    let mut finger = point_finger();
    step(&mut finger, &entity, &Vector3::new(-0.03, 1e-3, 0.01));
    let check = |finger: &mut _, hip: Vector3<f64>, god: Vector3<f64>| {
        let out = step(finger, &entity, &hip);
        assert!((out.god_object_W - god).norm() < 1e-15, "{hip:?}: {out:?}");
        assert!((out.force_on_user_W - (god - hip) * K).norm() < 1e-12, "{hip:?}: {out:?}");
    };
    // Over a diagonal of the floor, into the wall's foot, and along that.
    for tick in 0..=400 {
        let x = -0.03 + 1e-4 * f64::from(tick);
        check(&mut finger, Vector3::new(x, -1e-3, 0.01), Vector3::new(x.min(0.0), 0.0, 0.01));
    }
    for tick in 0..=300 {
        let z = 0.01 - 1e-4 * f64::from(tick);
        check(&mut finger, Vector3::new(3e-3, -1e-3, z), Vector3::new(0.0, 0.0, z));
    }
    for tick in 0..=100 {
        let y = -1e-3 + 1e-4 * f64::from(tick);
        check(&mut finger, Vector3::new(3e-3, y, -0.02), Vector3::new(0.0, y.max(0.0), -0.02));
    }
    // Down again, and away from the wall.
    check(&mut finger, Vector3::new(3e-3, -2e-3, -0.02), Vector3::new(0.0, 0.0, -0.02));
    check(&mut finger, Vector3::new(-3e-3, -2e-3, -0.02), Vector3::new(-3e-3, 0.0, -0.02));
    // Into it at once, and past its end.
    check(&mut finger, Vector3::new(5e-3, -2e-3, 0.03), Vector3::new(0.0, 0.0, 0.03));
    check(&mut finger, Vector3::new(5e-3, -2e-3, 0.0541), Vector3::new(5e-3, 0.0, 0.0541));
}

#[test]
fn in_the_corner_of_three_parts_a_finger_rests_and_leaves_it_again() {
    let mut blocks = floor_and_wall();
    blocks.push(moved([0.1, 0.08, 0.02], [-0.02, 0.02, -0.03]));
    let mesh = built(soup(&blocks));
    for friction in [Friction::None, Friction::coulomb(0.3).unwrap()] {
        let entity = touchable(&mesh, friction.clone());
        let mut finger = point_finger();
        step(&mut finger, &entity, &Vector3::new(-0.01, 1e-3, -0.01));
        let hip = Vector3::new(2e-3, -1.5e-3, -0.023);
        for _ in 0..5 {
            let out = step(&mut finger, &entity, &hip);
            assert!((out.god_object_W - Vector3::new(0.0, 0.0, -0.02)).norm() < 2e-3, "{out:?}");
            let is_there = (out.god_object_W - Vector3::new(0.0, 0.0, -0.02)).norm() < 1e-15;
            assert!(is_there || !matches!(friction, Friction::None), "{out:?}");
            assert!((out.force_on_user_W - (out.god_object_W - hip) * K).norm() < 1e-12, "{out:?}");
        }
        // Along each of the three lines, and off.
        for (hip, god) in [
            ([2e-3, -1.5e-3, -0.01], [0.0, 0.0, -0.01]),
            ([-0.01, -1.5e-3, -0.023], [-0.01, 0.0, -0.02]),
            ([2e-3, 0.01, -0.023], [0.0, 0.01, -0.02]),
        ] {
            step(&mut finger, &entity, &Vector3::new(2e-3, -1.5e-3, -0.023));
            let out = step(&mut finger, &entity, &Vector3::from(hip));
            let off_m = (out.god_object_W - Vector3::from(god)).norm();
            assert!(
                off_m < if matches!(friction, Friction::None) { 1e-15 } else { 3e-3 },
                "{hip:?}: {out:?}"
            );
        }
        assert!(step(&mut finger, &entity, &Vector3::new(-1e-3, 1e-3, -0.019)).entity.is_none());
    }
}

/// Boxes that go through each other anyhow.
fn heap(noise: &mut Noise) -> Vec<Block> {
    let count = 2 + (noise.uniform() * 5.0) as usize;
    (0..count)
        .map(|_| {
            let size_m = [0.0; 3].map(|_| noise.between(0.01, 0.06));
            let turn = UnitQuaternion::new(noise.vector(1.0));
            (size_m, Isometry3::from_parts(Translation3::from(noise.vector(0.02)), turn))
        })
        .collect()
}

#[test]
fn boxes_that_overlap_feel_as_the_solid_that_they_are_together() {
    let (mut touched, mut differ) = (0, 0);
    for seed in 0..60 {
        let mut noise = Noise(seed);
        let blocks = heap(&mut noise);
        let mesh = Arc::new(Mesh::build(soup(&blocks)).unwrap().0);
        let parts = blocks
            .iter()
            .map(|(size_m, place)| CsgPart { pose: *place, ..CsgPart::from(Cuboid::new(*size_m).unwrap()) });
        let solid = Shape::from(Arc::new(Csg::build(&CsgTree::union(parts)).unwrap()));
        let entities = [touchable(&mesh, Friction::None), entity(solid, Friction::None)];
        let mut fingers = [point_finger(), point_finger()];
        let mut roaming = Roaming::new(seed, 0.05, 3e-4);
        for tick in 0..8000 {
            let hip = roaming.next();
            let [on_mesh, on_solid] = [0, 1].map(|i| step(&mut fingers[i], &entities[i], &hip));
            let told = || format!("{seed}, {tick}: {hip:?}\n{on_mesh:?}\n{on_solid:?}");
            if on_mesh.entity.is_none() {
                assert!(winding_number(&mesh, &hip) < 0.5, "lost: {}", told());
                continue;
            }
            touched += 1;
            if (on_mesh.god_object_W - on_solid.god_object_W).norm() > 1e-9 {
                differ += 1;
                let mut beside = (0..2000).map(|_| on_mesh.god_object_W + noise.vector(1e-9));
                assert!(beside.any(|p| winding_number(&mesh, &p) < 0.5), "inside: {}", told());
            }
        }
    }
    // Solids joined of others are held against oracles of their own. Where four and more faces meet, a walk that knows two at
    // a time may rest although there is a way on: 84 of 146,747 ticks.
    assert!(touched > 100_000 && differ * 500 < touched, "{differ} of {touched}");
}
