//! Round bars of triangles that cross: between their ends they have no vertex.
#![allow(non_snake_case)]

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::{common, meshes};

use common::*;
use haptics::{Capsule, Cuboid, Cylinder, Entity, Shape};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{ContactStiffness, Settings};

const RADIUS_M: f64 = 0.01;
const LENGTH_M: f64 = 0.08;

/// Along z, with so many sides, cut into pieces along it; a corner is on x where it is turned by nothing (rad).
fn bar(sides: u32, pieces: usize, turn: f64) -> Shape {
    let corner = |at: u32| {
        let (sin, cos) = (TAU * f64::from(at) / f64::from(sides) + turn).sin_cos();
        [RADIUS_M * cos, RADIUS_M * sin]
    };
    let outline: Vec<_> = (0..sides).map(corner).collect();
    let fan: Vec<_> = (2..sides).map(|at| [0, at - 1, at]).collect();
    let mut soup = meshes::prism(&outline, &fan, LENGTH_M);
    // Of each side its two triangles become those of so many pieces, with rings of corners between them.
    soup.faces.truncate(2 * fan.len());
    let [low, high] = [soup.vertices[0].z, soup.vertices[sides as usize].z];
    let mut rings: Vec<Vec<u32>> = vec![(0..sides).collect()];
    for piece in 1..pieces {
        let z = low + (high - low) * piece as f64 / pieces as f64;
        let first = soup.vertices.len() as u32;
        soup.vertices.extend(outline.iter().map(|[x, y]| Vector3::new(*x, *y, z)));
        rings.push((first..first + sides).collect());
    }
    rings.push((sides..2 * sides).collect());
    let faces_up = low > high;
    for two in rings.windows(2) {
        for at in 0..sides as usize {
            let next = (at + 1) % sides as usize;
            for [a, b, c] in
                [[two[0][at], two[0][next], two[1][next]], [two[0][at], two[1][next], two[1][at]]]
            {
                soup.faces.push(if faces_up { [a, c, b] } else { [a, b, c] });
            }
        }
    }
    meshes::build(soup).into()
}

/// Height of the middle of the one above that of the other after 0.3 s (m); the lower one is fixed.
fn rests_m(lower: &Shape, upper: &Shape, crossed: f64) -> f64 {
    // Forms are along y.
    let lying = |shape: &Shape| match shape {
        Shape::Form(_) => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
        _ => UnitQuaternion::identity(),
    };
    let above = Vector3::y() * (2.0 * RADIUS_M + 1e-4);
    let crossed = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), crossed);
    let poses = [
        Isometry3::from_parts(Vector3::zeros().into(), lying(lower)),
        Isometry3::from_parts(above.into(), crossed * lying(upper)),
    ];
    let entities: Vec<Entity> = [lower, upper]
        .into_iter()
        .zip(poses)
        .map(|(shape, at)| object(shape.clone(), at, 1000.0, 0.5))
        .collect();
    let bodies = [(1, body(&entities[1], 0.05))];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let mut world = World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0);
    for _ in 0..300 {
        world.step(&[]);
    }
    world.entities[1].X_WB.translation.y
}

/// From the middle of a bar down to its side, or to its corner (m).
fn reaches_m(sides: u32, is_corner: bool) -> f64 {
    if is_corner { RADIUS_M } else { RADIUS_M * (PI / f64::from(sides)).cos() }
}

/// 9.8 um deep on one point; and as deep as a tick goes where only what is in each other is found, of the bluntest.
fn assert_rests(at_m: f64, expected_m: f64, most_m: f64, told: &str) {
    assert!((-most_m..1e-6).contains(&(at_m - expected_m)), "{told}: {:e} m", at_m - expected_m);
}

#[test]
fn round_bars_that_cross_lie_on_each_other_however_many_sides_they_have() {
    for (sides, most_m) in
        [(4, 6e-5), (6, 6e-5), (8, 2e-5), (12, 2e-5), (16, 2e-5), (24, 2e-5), (48, 2e-5), (64, 2e-5)]
    {
        for (pieces, crossed) in
            [1, 2, 7].into_iter().flat_map(|pieces| [FRAC_PI_2, 1.2, 0.7].map(|by| (pieces, by)))
        {
            for is_corner in [false, true] {
                // On one corner few sides do not balance.
                if is_corner && sides < 8 {
                    continue;
                }
                let turn = FRAC_PI_2 + if is_corner { 0.0 } else { PI / f64::from(sides) };
                let bar = bar(sides, pieces, turn);
                let at_m = rests_m(&bar, &bar, crossed);
                let told = format!("{sides} sides, {pieces} pieces, {is_corner}, {crossed}");
                assert_rests(at_m, 2.0 * reaches_m(sides, is_corner), most_m, &told);
            }
        }
    }
}

#[test]
fn round_bars_of_triangles_and_closed_forms_lie_across_each_other() {
    let forms: [Shape; 3] = [
        Cylinder::new(RADIUS_M, LENGTH_M).unwrap().into(),
        Capsule::new(RADIUS_M, LENGTH_M).unwrap().into(),
        Cuboid::new([2.0 * RADIUS_M, LENGTH_M, 2.0 * RADIUS_M]).unwrap().into(),
    ];
    for (number, form) in forms.iter().enumerate() {
        for (sides, crossed) in
            [8, 16, 33, 64].into_iter().flat_map(|sides| [FRAC_PI_2, 0.9].map(|by| (sides, by)))
        {
            for is_corner in [false, true] {
                let turn = FRAC_PI_2 + if is_corner { 0.0 } else { PI / f64::from(sides) };
                // Of an odd number a side is opposite a corner.
                let is_corner_below = if sides % 2 == 1 { !is_corner } else { is_corner };
                let bar = bar(sides, 1, turn);
                for (at_m, is_corner, what) in [
                    (rests_m(&bar, form, crossed), is_corner, "above"),
                    (rests_m(form, &bar, crossed), is_corner_below, "below"),
                ] {
                    let told = format!("{number} {what}, {sides} sides, {is_corner}, {crossed}");
                    assert_rests(at_m, RADIUS_M + reaches_m(sides, is_corner), 3e-5, &told);
                }
            }
        }
    }
}

/// Across two that lie free on a floor, off the middle, in either order.
#[test]
fn a_round_bar_lies_across_two_others_wherever_they_are() {
    for (sides, apart_m) in
        [8, 12, 16, 48].into_iter().flat_map(|sides| [0.024, 0.03, 0.04, 0.06].map(|by| (sides, by)))
    {
        for is_first in [false, true] {
            let shape = bar(sides, 1, FRAC_PI_2 + PI / f64::from(sides));
            let reach_m = reaches_m(sides, false);
            let across = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
            let above = Isometry3::from_parts((Vector3::y() * (3.0 * reach_m + 2e-4)).into(), across);
            let below = |x: f64| Isometry3::translation(x, reach_m + 1e-4, 0.0);
            let mut poses = vec![below(-0.5 * apart_m), below(0.5 * apart_m)];
            poses.insert(if is_first { 0 } else { 2 }, above);
            let mut entities: Vec<Entity> = vec![floor(0.0, 1000.0, 0.5)];
            entities.extend(poses.iter().map(|at| object(shape.clone(), *at, 1000.0, 0.5)));
            let bodies: Vec<_> = (1..4).map(|at| (at, body(&entities[at], 0.05))).collect();
            let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
            let settings = Settings { contact_stiffness, ..Settings::default() };
            let mut world = World::new(entities, &bodies, settings, 0);
            for _ in 0..300 {
                world.step(&[]);
            }
            let at_m = world.entities[if is_first { 1 } else { 3 }].X_WB.translation.y;
            let told = format!("{sides} sides, {apart_m} m apart, {is_first}");
            assert_rests(at_m - 2.0 * reach_m, reach_m, 3e-5, &told);
        }
    }
}

/// Depth of two convex bars in each other (m): the least overlap along all normals and all that is across two edges.
fn depth_m(sides: u32, poses: [&Isometry3<f64>; 2]) -> f64 {
    let corner = |at: f64| {
        let (sin, cos) = (TAU * at / f64::from(sides) + FRAC_PI_2).sin_cos();
        Vector3::new(RADIUS_M * cos, RADIUS_M * sin, 0.5 * LENGTH_M)
    };
    let corners: Vec<_> = (0..sides).map(|at| corner(f64::from(at))).collect();
    let points = poses.map(|at| {
        let flipped = corners.iter().map(|point| Vector3::new(point.x, point.y, -point.z));
        corners
            .iter()
            .copied()
            .chain(flipped)
            .map(|point| at * nalgebra::Point3::from(point))
            .collect::<Vec<_>>()
    });
    let edges = poses.map(|at| {
        let sides = (0..sides).map(|at| corner(f64::from(at) + 1.0) - corner(f64::from(at)));
        sides.chain([Vector3::z()]).map(|edge| at * edge).collect::<Vec<_>>()
    });
    let of_both = edges[0].iter().flat_map(|a| edges[1].iter().map(|b| a.cross(b)));
    let of_one = edges.iter().flat_map(|of| of.iter().flat_map(|a| of.iter().map(|b| a.cross(b))));
    let overlap_m = |axis: Vector3<f64>| {
        let [a, b] = [0, 1].map(|at| {
            let along = points[at].iter().map(|point| axis.dot(&point.coords));
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
        });
        (a[1] - b[0]).min(b[1] - a[0])
    };
    let axes = of_both.chain(of_one).filter_map(|axis| axis.try_normalize(1e-9 * RADIUS_M));
    axes.map(overlap_m).fold(f64::INFINITY, f64::min)
}

/// One bar lies with an edge across another one's, aside of the middle and turned about its axis by so much of a half side, 0.1 mm
/// above it; how deep it gets before it has rolled off (m).
fn deepest_m(sides: u32, crossed: f64, aside_m: f64, turned: f64) -> f64 {
    let shape = bar(sides, 1, FRAC_PI_2);
    let about = |axis, by: f64| UnitQuaternion::from_axis_angle(&axis, by);
    let turn = about(Vector3::y_axis(), crossed) * about(Vector3::z_axis(), turned * PI / f64::from(sides));
    let lower = Isometry3::identity();
    let above = |high_m: f64| {
        Isometry3::from_parts((turn * Vector3::z() * aside_m + Vector3::y() * high_m).into(), turn)
    };
    let [mut low_m, mut high_m] = [0.0, 3.0 * RADIUS_M];
    for _ in 0..30 {
        let middle_m = 0.5 * (low_m + high_m);
        let is_low = depth_m(sides, [&lower, &above(middle_m)]) > -1e-4;
        *(if is_low { &mut low_m } else { &mut high_m }) = middle_m;
    }
    let entities = [lower, above(high_m)].map(|at| object(shape.clone(), at, 1000.0, 0.5)).to_vec();
    let bodies = [(1, body(&entities[1], 0.05))];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let mut world = World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0);
    let mut deepest_m = 0.0_f64;
    for tick in 0..500 {
        world.step(&[]);
        if tick % 5 == 0 {
            deepest_m = deepest_m.max(depth_m(sides, [&lower, &world.entities[1].X_WB]));
        }
    }
    deepest_m
}

#[test]
fn bars_that_do_not_balance_on_an_edge_roll_off_and_hardly_sink_in() {
    let (mut all, mut deep) = (0, 0);
    for sides in [3, 4, 6, 12] {
        for crossed in [0.5_f64, 3.0, 30.0, 60.0, 90.0].map(f64::to_radians) {
            for (aside_m, turned) in [(0.0, 0.0), (0.0, 0.7), (0.02, 0.0), (0.02, 0.3), (0.036, 0.3)] {
                let deepest_m = deepest_m(sides, crossed, aside_m, turned);
                // Sharp ones are held by an edge or a face in turn, and slip by a twentieth of their width then.
                assert!(
                    deepest_m < 1.2e-3,
                    "{sides} sides, {crossed}, {aside_m} m, {turned}: {deepest_m:e} m"
                );
                (all, deep) = (all + 1, deep + usize::from(deepest_m > 2e-4));
            }
        }
    }
    assert!(all >= 6 * deep, "{deep} of {all}");
}

/// Its lower edges go in and out by the slopes, far below where these would meet.
#[test]
fn a_plank_lies_across_a_wall_with_sloping_sides_until_its_middle_is_past_the_top() {
    let (top_m, slope) = (0.01, 2.0);
    let outline =
        [[-top_m, 0.0], [-top_m - 0.03 / slope, -0.03], [top_m + 0.03 / slope, -0.03], [top_m, 0.0]];
    let wall: Shape = meshes::build(meshes::prism(&outline, &[[0, 1, 2], [0, 2, 3]], LENGTH_M)).into();
    let corners = [[-0.05, 0.005], [-0.05, -0.005], [0.05, -0.005], [0.05, 0.005]];
    let plank: Shape = meshes::build(meshes::prism(&corners, &[[0, 1, 2], [0, 2, 3]], 0.03)).into();
    for (aside_m, lies) in [(0.0, true), (0.8 * top_m, true), (1.3 * top_m, false)] {
        let above = Isometry3::translation(aside_m, 0.005 + 1e-4, 0.0);
        let entities = vec![
            object(wall.clone(), Isometry3::identity(), 1000.0, 0.5),
            object(plank.clone(), above, 1000.0, 0.5),
        ];
        let bodies = [(1, body(&entities[1], 0.05))];
        let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
        let mut world =
            World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0);
        for _ in 0..600 {
            world.step(&[]);
        }
        let at_m = world.entities[1].X_WB.translation.y;
        assert!(((at_m - 0.005).abs() < 3e-5) == lies, "{aside_m} m: {at_m} m");
    }
}

/// A ring along z with so many sides, 10 mm wide within and 20 mm without, as long as it is wide.
fn ring(sides: u32) -> Shape {
    let rings = [(2.0, 1.0), (2.0, -1.0), (1.0, -1.0), (1.0, 1.0)];
    let corner = |at: u32, (wide, end): (f64, f64)| {
        let (sin, cos) = (TAU * f64::from(at) / f64::from(sides)).sin_cos();
        Vector3::new(wide * RADIUS_M * cos, wide * RADIUS_M * sin, end * RADIUS_M)
    };
    let vertices = rings.into_iter().flat_map(|ring| (0..sides).map(move |at| corner(at, ring))).collect();
    let mut faces = vec![];
    for (ring, at) in (0..4).flat_map(|ring| (0..sides).map(move |at| (ring, at))) {
        let [next, beyond] = [(at + 1) % sides, (ring + 1) % 4];
        let [a, b, c, d] =
            [[ring, at], [beyond, at], [beyond, next], [ring, next]].map(|[ring, at]| ring * sides + at);
        faces.extend([[a, b, c], [a, c, d]]);
    }
    meshes::build(haptics::mesh::TriangleSoup { vertices, faces }).into()
}

/// The axle is in the ring's hole as long as its corners are on the inner side of all of its faces.
#[test]
fn a_ring_that_spins_comes_to_hang_on_an_axle_however_close_it_fits() {
    for (sides, wide, turned) in [8, 12, 24, 48]
        .into_iter()
        .flat_map(|sides| [(0.8, 0.0), (0.95, 0.1)].map(|(wide, by)| (sides, wide, by)))
    {
        let axle_corner = |at: u32| {
            let (sin, cos) = (TAU * f64::from(at) / f64::from(sides) + turned).sin_cos();
            [wide * RADIUS_M * cos, wide * RADIUS_M * sin]
        };
        let outline: Vec<_> = (0..sides).map(axle_corner).collect();
        let fan: Vec<_> = (2..sides).map(|at| [0, at - 1, at]).collect();
        let axle: Shape = meshes::build(meshes::prism(&outline, &fan, LENGTH_M)).into();
        let entities =
            [axle, ring(sides)].map(|shape| object(shape, Isometry3::identity(), 1000.0, 0.3)).to_vec();
        let bodies = [(1, body(&entities[1], 0.05).moving(Vector3::zeros(), Vector3::z() * 5.0))];
        let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
        let mut world =
            World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0);
        for _ in 0..1500 {
            world.step(&[]);
        }
        let X_WR = world.entities[1].X_WB;
        let apothem_m = RADIUS_M * (PI / f64::from(sides)).cos();
        let mut deepest_m = f64::NEG_INFINITY;
        for (corner, z) in outline.iter().flat_map(|corner| [-RADIUS_M, 0.0, RADIUS_M].map(|z| (corner, z))) {
            let at = X_WR.inverse_transform_point(&nalgebra::Point3::new(corner[0], corner[1], z));
            for side in 0..sides {
                let (sin, cos) = (TAU * (f64::from(side) + 0.5) / f64::from(sides)).sin_cos();
                deepest_m = deepest_m.max(at.x * cos + at.y * sin - apothem_m);
            }
        }
        // Of many sides it is round about: a hole's edges are hollow, and not all of an axle's are seen.
        assert!((-2e-5..5e-4).contains(&deepest_m), "{sides} sides, {wide} wide: {deepest_m:e} m");
    }
}
