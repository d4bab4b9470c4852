//! Meshes on a plane: they fall, rest, slide and tip as what they stand for.
#![allow(non_snake_case)]

use crate::{common, meshes};

use common::*;
use haptics::mesh::{TriangleSoup, make};
use haptics::{Cuboid, Shape};
use meshes::{angle, build, cut_in_four};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use physics::Settings;
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points};

const EDGE: f64 = 0.05;
const MASS: f64 = 0.1;

fn cube(times: usize) -> Shape {
    let mut soup = make::cuboid([EDGE; 3]);
    (0..times).for_each(|_| soup = cut_in_four(&soup));
    build(soup).into()
}

/// Something on a slope about z, its lowest point `above` over it; x points up the slope.
fn on_slope(shape: Shape, lean: f64, mu: f64, mass: f64, above: f64) -> World {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), lean);
    let at = Isometry3::from_parts((turn * Vector3::new(0.0, above, 0.0)).into(), turn);
    let entity = object(shape, at, 1000.0, mu);
    let body = body(&entity, mass);
    World::new(vec![floor(lean, 2000.0, mu), entity], &[(1, body)], Settings::default(), 0)
}

/// Stiffnesses in series.
const K: f64 = 1000.0 * 2000.0 / 3000.0;

fn run(world: &mut World, ticks: usize) {
    for _ in 0..ticks {
        world.step(&[]);
        assert!(world.body().is_finite());
    }
}

#[test]
fn a_cube_of_twelve_triangles_moves_as_the_box_does_to_the_last_digits() {
    let low = EDGE / 2.0 - MASS * G / (4.0 * K);
    for lean in [0.0, 0.3, 0.6] {
        let form = Shape::from(Cuboid::new([EDGE; 3]).unwrap());
        let (mut one, mut other) =
            (on_slope(cube(0), lean, 0.5, MASS, low), on_slope(form, lean, 0.5, MASS, low));
        for _ in 0..1000 {
            one.step(&[]);
            other.step(&[]);
        }
        let apart = (one.body().centre_W - other.body().centre_W).norm();
        // The same four springs in another order: what the solver leaves open, 1e-10 of forces.
        assert!(apart < 1e-9, "{lean}: {apart:e}");
    }
}

#[test]
fn cubes_of_few_and_of_many_triangles_rest_hold_for_a_minute_and_slide_as_coulomb_says() {
    let mu: f64 = 0.5;
    for times in [0, 3, 6] {
        // Rest: as many springs as vertices, where these are not too many; else on some.
        let mut world = on_slope(cube(times), 0.0, mu, MASS, EDGE / 2.0 + 1e-3);
        run(&mut world, 2000);
        let pressed = world.manipulation.rows().iter().filter(|row| row.force_W.y > 0.0).count();
        let points = if times < 6 { ((1 << times) + 1_usize).pow(2) } else { pressed };
        let depth = MASS * G / (points as f64 * K);
        let height = world.body().centre_W.y - EDGE / 2.0;
        // The damper has brought it there to micrometres. One that touched first may stay as a fifth, off the middle.
        let allowed = if times < 6 { 1e-6 } else { 0.3 * depth };
        assert!((height + depth).abs() < allowed, "{times}: {height:e} {depth:e} on {points}");
        assert!(world.body().velocity_W.norm() < 1e-6);
        let lean = (0.95 * mu).atan();
        let mut world = on_slope(cube(times), lean, mu, MASS, EDGE / 2.0);
        run(&mut world, 2000);
        let start = world.body().centre_W;
        run(&mut world, 60_000);
        let crept = (world.body().centre_W - start).norm();
        // What the solver leaves open, 1e-10 of the forces, each tick anew.
        assert!(crept < 1e-8, "{times}: crept {crept:e}");
        let lean = 0.6_f64;
        let mut world = on_slope(cube(times), lean, mu, MASS, EDGE / 2.0);
        run(&mut world, 300);
        let v = world.body().velocity_W;
        run(&mut world, 300);
        let a = (world.body().velocity_W - v).norm() / 0.3;
        let expected = G * (lean.sin() - mu * lean.cos());
        assert!((a - expected).abs() < 1e-3 * expected, "{times}: {a} {expected}");
    }
}

/// Drops it from there, and lets it come to rest.
fn settled(soup: TriangleSoup, turn: Vector3<f64>, height: f64, ticks: usize) -> World {
    settled_of(soup, turn, height, ticks, 0.0)
}

/// The same with rolling friction (m).
fn settled_of(soup: TriangleSoup, turn: Vector3<f64>, height: f64, ticks: usize, rolling_m: f64) -> World {
    let pose =
        Isometry3::from_parts(Vector3::new(0.0, height, 0.0).into(), UnitQuaternion::from_scaled_axis(turn));
    let mut entity = object(build(soup), pose, 1000.0, 0.5);
    entity = entity.with_damping(3.0).unwrap().with_turning_friction(0.0, rolling_m).unwrap();
    let body = body(&entity, MASS);
    let mut world = World::new(vec![floor(0.0, 2000.0, 0.5), entity], &[(1, body)], Settings::default(), 0);
    run(&mut world, ticks);
    world
}

fn is_at_rest(world: &World) -> bool {
    let body = world.body();
    body.velocity_W.norm() < 1e-6 && body.angular_velocity_W().norm() < 1e-4
}

/// How far its lowest vertices are below the floor, lowest first (m).
fn depths(world: &World) -> Vec<f64> {
    let Shape::Mesh(mesh) = &world.entities[1].shape else { unreachable!() };
    let pose = world.entities[1].X_WB;
    let mut all: Vec<f64> = mesh.vertices().iter().map(|v| -(pose * Point3::from(*v)).y).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

#[test]
fn a_star_and_an_angle_come_to_rest_on_the_points_of_their_hull() {
    for (seed, soup) in [
        (0, make::star(5, 0.05, 0.02, 0.03)),
        (1, make::star(5, 0.05, 0.02, 0.03)),
        (2, angle()),
        (3, angle()),
        (4, cut_in_four(&cut_in_four(&angle()))),
        (5, cut_in_four(&cut_in_four(&make::star(5, 0.05, 0.02, 0.03)))),
    ] {
        let seed_f = f64::from(seed);
        let turn = Vector3::new((3.1 * seed_f).sin(), (1.7 * seed_f).cos(), (2.3 * seed_f).sin()) * 1.5;
        let world = settled(soup, turn, 0.1, 12_000);
        assert!(is_at_rest(&world), "{seed}: {:?}", world.body());
        // It stands on at least three points, none deeper than its weight presses a spring.
        let depths = depths(&world);
        assert!(depths[2] > 0.0 && depths[0] < 1.01 * MASS * G / K, "{seed}: {:?}", &depths[..5]);
        let (body, rows) = (world.body(), world.manipulation.rows());
        let pressed: Vec<_> = rows.iter().filter(|row| row.force_W.y > 0.0).collect();
        let total: f64 = pressed.iter().map(|row| row.force_W.y).sum();
        assert!((total - MASS * G).abs() < 1e-4 * MASS * G, "{seed}: {total}");
        assert!(body.centre_W.y > 0.0);
    }
}

#[test]
fn balls_of_a_hundred_thousand_triangles_dropped_on_the_floor_come_to_rest_and_stay() {
    let turn = Vector3::new(0.4, 0.2, -0.7);
    // Rolling friction as scenes have it; without, the smooth one sways on its facets for half a minute and more.
    for (soup, height) in
        [(make::bumpy_sphere(316, 159, 0.05), 0.06), (make::uv_sphere(316, 159, 0.05), 0.052)]
    {
        let mut world = settled_of(soup, turn, height, 8_000, 2e-4);
        let place = world.body().centre_W;
        assert!(is_at_rest(&world), "{:?}", world.body());
        run(&mut world, 5000);
        let moved = (world.body().centre_W - place).norm();
        // Five seconds at less than a micrometre per second.
        assert!(moved < 5e-6, "{moved:e}");
    }
}

#[test]
fn a_prism_on_a_slope_tips_over_its_vertex_where_its_centre_passes_it() {
    // A regular prism of 12 sides around y, fine or coarse, stands on a slope that falls towards a vertex of its base.
    let n = 12;
    let (radius, height) = (0.02, 0.06);
    let outline: Vec<[f64; 2]> = (0..n)
        .map(|i| std::f64::consts::TAU * f64::from(i) / f64::from(n))
        .map(|a| [radius * a.cos(), radius * a.sin()])
        .collect();
    let fan: Vec<[u32; 3]> = (1..n as u32 - 1).map(|i| [0, i, i + 1]).collect();
    let soup = meshes::prism(&outline, &fan, height);
    let standing = |mut soup: TriangleSoup| {
        soup.vertices.iter_mut().for_each(|v| *v = Vector3::new(v.x, v.z, -v.y));
        soup
    };
    for soup in [standing(soup.clone()), standing(cut_in_four(&cut_in_four(&soup)))] {
        let limit = (radius / (height / 2.0)).atan();
        for (share, falls) in [(0.95, false), (1.05, true)] {
            let shape = Shape::from(build(soup.clone()));
            // x points up the slope, a vertex of the base down.
            let mut world = on_slope(shape, share * limit, 2.0, MASS / 200.0, height / 2.0 - 1e-6);
            run(&mut world, 3000);
            let axis_W = world.body().orientation * Vector3::y();
            let start_W = Vector3::new(-(share * limit).sin(), (share * limit).cos(), 0.0);
            // On three vertices around the lowest one springs that give by 4 micrometres lean it by less than a milliradian.
            assert_eq!(axis_W.angle(&start_W) > 0.2, falls, "{share}: {}", axis_W.angle(&start_W));
        }
    }
}

/// Of all vertices, those within reach: slow and obvious.
fn brute(soup: &TriangleSoup, pose: &Isometry3<f64>, reach: f64) -> Vec<f64> {
    let mut heights: Vec<f64> =
        soup.vertices.iter().map(|v| (pose * Point3::from(*v)).y).filter(|y| *y <= reach).collect();
    heights.sort_by(f64::total_cmp);
    heights
}

#[test]
fn contact_points_are_vertices_the_deepest_is_among_them_and_few_are_all() {
    let plane = haptics::Plane::new(Vector3::y(), 0.0).unwrap().into();
    let here = Isometry3::identity();
    for (number, soup) in
        [make::cuboid([0.1, 0.05, 0.02]), make::star(7, 0.05, 0.02, 0.03), make::bumpy_sphere(60, 31, 0.05)]
            .into_iter()
            .enumerate()
    {
        let shape = Shape::from(build(soup.clone()));
        for seed in 0..400 {
            let s = f64::from(seed) + 0.1;
            let turn = UnitQuaternion::from_scaled_axis(
                Vector3::new(s.sin(), (1.3 * s).cos(), (0.7 * s).sin()) * 3.0,
            );
            let lowest = soup.vertices.iter().map(|v| (turn * v).y).fold(f64::INFINITY, f64::min);
            let down = 1e-3 * (1.0 - 3.0 * (2.1 * s).sin().abs());
            let pose = Isometry3::from_parts(Vector3::new(0.01, down - lowest, -0.02).into(), turn);
            let mut found = ContactPoints::default();
            let mut memory = PairMemory::default();
            for _ in 0..2 {
                found = ContactPoints::default();
                contact_points(
                    Solid { shape: &shape, X_W: &pose },
                    Solid { shape: &plane, X_W: &here },
                    1e-3,
                    &mut memory,
                    &mut found,
                );
            }
            let oracle = brute(&soup, &pose, 1e-3);
            let mut got: Vec<f64> = found.as_slice().iter().map(|point| point.gap_m).collect();
            got.sort_by(f64::total_cmp);
            if oracle.len() <= 8 && number < 2 {
                assert_eq!(got.len(), oracle.len(), "{number} {seed}");
                for (got, expected) in got.iter().zip(&oracle) {
                    assert!((got - expected).abs() < 1e-15);
                }
            } else {
                assert!((got[0] - oracle[0]).abs() < 1e-15, "{number} {seed}: {got:?} {}", oracle[0]);
            }
            for point in found.as_slice() {
                assert!((point.normal_W - Vector3::y()).norm() < 1e-12);
                assert!((point.point_W.y - point.gap_m).abs() < 1e-12);
            }
        }
    }
}

/// Against all vertices, one by one, as meshes turn and sink: up to 256 within reach all count, whoever stands for others.
#[test]
fn where_points_are_soft_they_have_the_force_the_torque_and_the_energy_of_all_vertices() {
    let floor = Shape::from(haptics::Plane::new(Vector3::y(), 0.0).unwrap());
    let here = Isometry3::identity();
    for soup in [make::uv_sphere(24, 13, 0.03), make::bumpy_sphere(40, 21, 0.03), {
        let quarters = cut_in_four(&cut_in_four(&make::cuboid([0.04; 3])));
        cut_in_four(&quarters)
    }] {
        let shape = Shape::from(build(soup));
        let Shape::Mesh(mesh) = &shape else { unreachable!() };
        let mut memory = PairMemory { is_soft: true, ..PairMemory::default() };
        let (mut grouped, mut alone) = (0, 0);
        for step in 0..4000 {
            let phase = f64::from(step) * 1e-3;
            let turn =
                UnitQuaternion::from_scaled_axis(Vector3::new(phase.sin(), 0.3 * phase, 0.7 * phase.cos()));
            let turn = if step % 1000 < 500 { turn } else { UnitQuaternion::identity() };
            let lowest_m = mesh.vertices().iter().map(|v| (turn * v).y).fold(f64::INFINITY, f64::min);
            let sunk_m = 2e-3 * (0.5 + 0.5 * (7.0 * phase).sin());
            let at = Vector3::new(0.1, -lowest_m - sunk_m, 0.0);
            let pose = Isometry3::from_parts(at.into(), turn);
            let mut found = ContactPoints::default();
            let (solid, below) = (Solid { shape: &shape, X_W: &pose }, Solid { shape: &floor, X_W: &here });
            contact_points(solid, below, 1e-3, &mut memory, &mut found);
            let points = mesh.vertices().iter().map(|v| (pose * Point3::from(*v)).coords);
            let low: Vec<_> = points.filter(|at| at.y <= 1e-3).collect();
            if low.len() > 256 {
                continue;
            }
            *if low.len() > 24 { &mut grouped } else { &mut alone } += 1;
            let sum = |all: &mut dyn Iterator<Item = (Vector3<f64>, f64, f64)>| {
                all.fold((0.0, Vector3::zeros(), 0.0), |(force, torque, energy), (at, depth, share)| {
                    let up = Vector3::y() * (share * depth);
                    (force + share * depth, torque + at.cross(&up), energy + share * depth * depth)
                })
            };
            let is = sum(&mut found.as_slice().iter().map(|p| (p.point_W, p.depth_m(), p.share)));
            let all = sum(&mut low.iter().map(|at| (*at, (-at.y).max(0.0), 1.0)));
            // Roundings of some hundred heights, of a tenth of a metre each.
            let off_m = 1e-17 * 256.0;
            assert!((is.0 - all.0).abs() < off_m, "{step}: {is:?} {all:?}");
            assert!((is.1 - all.1).norm() < 0.2 * off_m, "{step}: {is:?} {all:?}");
            assert!((is.2 - all.2).abs() < 4e-3 * off_m, "{step}: {is:?} {all:?}");
        }
        assert!(grouped > 300 && alone > 300, "{grouped} {alone}");
    }
}
