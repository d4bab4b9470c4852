//! Parts that overlap without an edge in common, as artists join them: felt as one solid, of which crossings are concave edges.

use crate::common::flawed::together;
use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Csg, CsgPart, CsgTree, Cuboid, FingerOutput, Friction, Shape};
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

/// Four corners as two triangles: an open part.
fn with_sheet(mut all: TriangleSoup, corners: [[f64; 3]; 4]) -> TriangleSoup {
    let first = all.vertices.len() as u32;
    all.vertices.extend(corners.map(Vector3::from));
    all.faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    all
}

/// Up to `y = 0.02` a block, through whose sides a sheet goes at the height `y = 0`, leaned by so much.
fn block_with_shelf(lean: f64) -> TriangleSoup {
    let at = |x: f64, z: f64| [x, lean * (x + 0.02), z];
    with_sheet(
        make::cuboid([0.04; 3]),
        [at(-0.06, -0.01), at(-0.06, 0.01), at(0.061, 0.01), at(0.061, -0.01)],
    )
}

/// Along a way in x, 1 mm below the height that it has there.
fn slid(
    mesh: &Arc<Mesh>,
    friction: Friction,
    from_x: f64,
    to_x: f64,
    height: impl Fn(f64) -> f64,
) -> FingerOutput {
    let entity = touchable(mesh, friction);
    let mut finger = point_finger();
    step(&mut finger, &entity, &Vector3::new(from_x, height(from_x) + 1e-4, 1e-3));
    let at = |share: f64| from_x + (to_x - from_x) * share;
    let ticks = (0..=1000).map(|tick| at(f64::from(tick) * 1e-3));
    ticks.map(|x| step(&mut finger, &entity, &Vector3::new(x, height(x) - 1e-3, 1e-3))).last().unwrap()
}

#[test]
fn along_a_sheet_a_finger_comes_to_the_solid_that_it_goes_through_and_no_farther() {
    for lean in [0.0, 0.1, -0.1] {
        let closed = built(block_with_shelf(lean));
        for mesh in
            [Arc::clone(&closed), Arc::new(Mesh::build(block_with_shelf(lean)).unwrap().0.into_sheet())]
        {
            for friction in [Friction::None, Friction::coulomb(0.1).unwrap()] {
                let out = slid(&mesh, friction, -0.04, 0.0, |x| lean * (x + 0.02));
                assert!((out.god_object_W - Vector3::new(-0.02, 0.0, 1e-3)).norm() < 2e-3, "{lean}: {out:?}");
                assert!((out.force_on_user_W.x / K + 0.02).abs() < 1e-3, "{lean}: {out:?}");
            }
        }
    }
}

#[test]
fn along_a_floor_a_finger_comes_to_the_open_wall_that_stands_in_it() {
    for (lean, below) in [(0.0, -0.01), (0.15, -0.01), (0.1, -0.05)] {
        let wall = |y: f64, z: f64| [1.3e-3 + lean * y, y, z];
        let corners = [wall(below, -0.03), wall(below, 0.03), wall(0.05, 0.03), wall(0.05, -0.03)];
        let on_block = |wall: f64| Vector3::new(wall, 0.02, 1e-3);
        let solid = built(with_sheet(make::cuboid([0.04; 3]), corners));
        let floor = [[-0.06, 0.02, -0.02], [-0.06, 0.02, 0.02], [0.06, 0.02, 0.02], [0.06, 0.02, -0.02]];
        let sheets = built(with_sheet(with_sheet(TriangleSoup::default(), floor), corners));
        for mesh in [solid, sheets] {
            for (from_x, to_x) in [(-0.01, 0.011), (0.015, -0.008)] {
                let out = slid(&mesh, Friction::None, from_x, to_x, |_| 0.02);
                let met = on_block(1.3e-3 + lean * 0.02);
                assert!((out.god_object_W - met).norm() < 2e-3, "{lean}, from {from_x}: {out:?}");
                let pushed_m = out.force_on_user_W.x / K;
                assert!((pushed_m - (met.x - to_x)).abs() < 1e-3, "{lean}, from {from_x}: {out:?}");
            }
        }
    }
}

fn open_floor(cells: u32) -> TriangleSoup {
    sheet(cells, 0.12, |_, _| 0.0)
}

/// To where a wall stands in a floor, and from there back, along it, up it and away.
#[test]
fn a_finger_leaves_the_foot_of_an_open_wall_on_the_side_that_it_came_to() {
    let mut noise = Noise(5);
    for case in 0..60 {
        let (lean, turn) = (noise.between(-0.4, 0.4), noise.between(-0.5, 0.5));
        let wall = |y: f64, z: f64| [lean * y + turn * z, y, z];
        let corners = [wall(-0.03, -0.05), wall(-0.03, 0.05), wall(0.05, 0.05), wall(0.05, -0.05)];
        let block = |up: f64| {
            let mut block = make::cuboid([0.12, 0.04, 0.12]);
            block.vertices.iter_mut().for_each(|at| at.y += up);
            block
        };
        let ground = if case % 2 == 0 { block(-0.02) } else { open_floor(1 + case / 8) };
        let mesh = built(with_sheet(ground, corners));
        let friction = if case % 3 == 0 { Friction::coulomb(0.2).unwrap() } else { Friction::None };
        let entity = touchable(&mesh, friction);
        let sign = if case % 4 < 2 { 1.0 } else { -1.0 };
        // Through the wall's foot by 3 mm, 1 mm deep in the floor.
        let to_foot = [Vector3::new(-0.02 * sign, 1e-3, 0.0), Vector3::new(3e-3 * sign, -1e-3, 1e-3)];
        for end in [
            Vector3::new(-0.02 * sign, -1e-3, 2e-3),
            Vector3::new(-0.02 * sign, 0.02, -3e-3),
            Vector3::new(-0.03 * sign, 1e-3, 0.0),
            Vector3::new(3e-3 * sign, 0.06, 1e-3),
        ] {
            let mut finger = point_finger();
            let mut way = |from: Vector3<f64>, to: Vector3<f64>| {
                let hips = (0..=200).map(|tick| from + (to - from) * (f64::from(tick) / 200.0));
                hips.map(|hip| step(&mut finger, &entity, &hip)).last().unwrap()
            };
            let held = way(to_foot[0], to_foot[1]);
            assert!(held.force_on_user_W.x * sign < -1.0, "{case}: {held:?}");
            let out = way(to_foot[1], end);
            let depth_m = (-end.y).max(0.0);
            assert!((out.force_on_user_W.norm() - depth_m * K).abs() < 0.3, "{case}: {end:?}, {out:?}");
        }
    }
}

/// In some ticks on the way up its god-object moves by less than rounding: it is at the foot all the same.
#[test]
fn a_finger_that_goes_slowly_up_an_open_wall_leaves_its_foot() {
    let mut floor = open_floor(5);
    floor.vertices.iter_mut().for_each(|at| *at *= 2.0 / 3.0);
    let wall = |y: f64, z: f64| [0.1 * y, y, z];
    let mesh = built(with_sheet(
        floor,
        [wall(-0.01, -0.03), wall(-0.01, 0.03), wall(0.03, 0.03), wall(0.03, -0.03)],
    ));
    let entity = touchable(&mesh, Friction::None);
    let mut finger = point_finger();
    let hips = [
        [-0.02, 1e-3, 1e-3],
        [-0.02, -1e-3, 1e-3],
        [3e-3, -1e-3, 1.5e-3],
        [3e-3, 0.04, 1.7e-3],
        [-0.02, 0.04, 2e-3],
    ];
    let hips = hips.map(Vector3::from);
    for (from, to) in hips.iter().zip(&hips[1..]) {
        let ticks = ((to - from).norm() / 1e-4) as u32;
        for tick in 0..ticks {
            let hip = from + (to - from) * (f64::from(tick) / f64::from(ticks));
            let out = step(&mut finger, &entity, &hip);
            assert!(out.force_on_user_W.norm() < 4.0, "{hip:?}: {out:?}");
        }
    }
    assert!(step(&mut finger, &entity, &hips[4]).entity.is_none());
}

/// A post of six sides, closed or open, in a block or an open floor: to it from all around, up along it, and away.
#[test]
fn a_finger_leaves_a_post_of_many_sides_that_stands_in_an_open_floor() {
    for (case, is_closed) in (0..48).zip([true, false].into_iter().cycle()) {
        let mut noise = Noise(case);
        let (turn, middle) = (noise.between(0.0, 1.0), noise.between(-0.004, 0.004));
        let corner = |at: u32, y: f64| {
            let angle = turn + f64::from(at) * std::f64::consts::TAU / 6.0;
            Vector3::new(0.01 * angle.cos(), y, 0.01 * angle.sin())
        };
        let mut all = TriangleSoup::default();
        all.vertices.extend((0..12).map(|at| corner(at % 6, if at < 6 { -0.01 } else { 0.03 })));
        for (at, next) in (0..6).map(|at| (at, (at + 1) % 6)) {
            all.faces.extend([[at, at + 6, next + 6], [at, next + 6, next]]);
        }
        if is_closed {
            (1..5).for_each(|at| all.faces.extend([[0, at, at + 1], [6, at + 7, at + 6]]));
        }
        let all = together([all, open_floor(1 + case as u32 / 8)]);
        let entity = touchable(&built(all), Friction::None);
        let mut finger = point_finger();
        let hips = [
            Vector3::new(-0.02, 1e-3, middle),
            Vector3::new(-0.02, -1e-3, middle),
            Vector3::new(-0.004, -1e-3, middle),
            Vector3::new(-0.004, 0.02, middle),
            Vector3::new(-0.02, 0.02, middle),
            Vector3::new(-0.02, 1e-3, middle),
        ];
        let mut last = None;
        for (from, to) in hips.iter().zip(&hips[1..]) {
            let way = (0..=200).map(|tick| from + (to - from) * (f64::from(tick) / 200.0));
            last = way.map(|hip| step(&mut finger, &entity, &hip)).last();
            let held_m = last.as_ref().unwrap().force_on_user_W.norm() / K;
            assert!(held_m < 8e-3, "{case}: {to:?}, {last:?}");
        }
        assert!(last.unwrap().entity.is_none(), "{case}: {last:?}");
    }
}

#[test]
fn among_boxes_that_sheets_go_through_no_finger_gets_into_one() {
    let mut touched = 0;
    for seed in 0..40 {
        let mut noise = Noise(seed);
        let blocks = heap(&mut noise);
        let solid = Arc::new(Mesh::build(soup(&blocks)).unwrap().0);
        let mut all = soup(&blocks);
        for _ in 0..1 + seed % 3 {
            let turn = UnitQuaternion::new(noise.vector(1.0));
            let middle = noise.vector(0.02);
            let corner = |x: f64, z: f64| (middle + turn * Vector3::new(0.05 * x, 0.0, 0.05 * z)).into();
            all =
                with_sheet(all, [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)]);
        }
        let mesh = built(all);
        let entity = touchable(&mesh, Friction::None);
        let mut finger = point_finger();
        let mut roaming = Roaming::new(seed, 0.05, 3e-4);
        for tick in 0..6000 {
            let hip = roaming.next();
            let out = step(&mut finger, &entity, &hip);
            let told = || format!("{seed}, {tick}: {hip:?}\n{out:?}");
            if out.entity.is_none() {
                assert!(winding_number(&solid, &hip) < 0.5, "lost: {}", told());
                continue;
            }
            touched += 1;
            if winding_number(&solid, &out.god_object_W) > 0.6 {
                let mut beside = (0..2000).map(|_| out.god_object_W + noise.vector(1e-9));
                assert!(beside.any(|p| winding_number(&solid, &p) < 0.5), "inside: {}", told());
            }
        }
    }
    assert!(touched > 50_000, "{touched}");
}
