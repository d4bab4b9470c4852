//! Meshes that touch in several places at once: pegs in holes, balls in cups, arches over bars.
#![allow(non_snake_case)]

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use common::*;
use haptics::mesh::{TriangleSoup, make};
use haptics::{Cuboid, Cylinder, Entity, Friction, Shape};
use meshes::{block_with_hole, build, cells, cut_in_four};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::Settings;

const MASS: f64 = 0.05;
/// Stiffnesses in series: 1000 and 2000 N/m.
const K: f64 = 2000.0 / 3.0;

fn fixed(shape: Shape, X_WB: Isometry3<f64>) -> Entity {
    Entity::new(shape, X_WB, 2000.0).unwrap().with_friction(Friction::coulomb(0.0).unwrap()).unwrap()
}

/// Something in what is fixed, with gravity along this.
fn inside(walls: Vec<Entity>, shape: Shape, at: Isometry3<f64>, gravity_W: Vector3<f64>) -> World {
    let entity = object(shape, at, 1000.0, 0.0).with_damping(2.0).unwrap();
    let body = body(&entity, MASS);
    let number = walls.len();
    let settings = Settings { gravity_W, ..Settings::default() };
    World::new(walls.into_iter().chain([entity]).collect(), &[(number, body)], settings, 0)
}

fn run(world: &mut World, ticks: usize) {
    for _ in 0..ticks {
        world.step(&[]);
        assert!(world.body().is_finite());
    }
}

/// What carries it, in the mean of half a second, in which it is nowhere faster than this.
///
/// Of meshes more vertices touch than a pair has room for; which of them count may change with movements of micrometres,
/// and goes on for ever without friction.
fn pressed(world: &mut World, fastest_m_s: f64, told: &str) -> Vector3<f64> {
    let mut sum_W = Vector3::zeros();
    for _ in 0..500 {
        world.step(&[]);
        assert!(world.body().velocity_W.norm() < fastest_m_s, "{told} {}", world.body().velocity_W);
        sum_W += world.manipulation.rows().iter().map(|row| row.force_W).sum::<Vector3<f64>>();
    }
    sum_W / 500.0
}

/// Along a bar without friction nothing stops it.
fn fastest_m_s(names: [&str; 2]) -> f64 {
    if names.iter().any(|name| name.contains("fine") || name.contains("mesh")) { 1e-2 } else { 1e-4 }
}

fn fine(mut soup: TriangleSoup, times: usize) -> Shape {
    (0..times).for_each(|_| soup = cut_in_four(&soup));
    build(soup).into()
}

fn cuboid(size: [f64; 3]) -> Shape {
    Cuboid::new(size).unwrap().into()
}

/// Half the hole, and half the peg in it: 0.5 mm of play on all sides.
const HALF: f64 = 0.0105;
const PEG: [f64; 3] = [0.02, 0.04, 0.02];

fn pegs() -> Vec<(&'static str, Shape)> {
    vec![
        ("box", cuboid(PEG)),
        ("cylinder", Cylinder::new(0.01, 0.04).unwrap().into()),
        ("mesh", fine(make::cuboid(PEG), 0)),
        ("fine mesh", fine(make::cuboid(PEG), 3)),
    ]
}

fn holes() -> Vec<(&'static str, Shape)> {
    vec![("hole", fine(block_with_hole(HALF, 0.0), 0)), ("fine hole", fine(block_with_hole(HALF, 0.0), 3))]
}

#[test]
fn a_peg_in_a_hole_is_stopped_by_floor_and_walls_and_comes_out_again() {
    for (hole_name, hole) in &holes() {
        for (name, peg) in &pegs() {
            for way in [Vector3::new(-0.7, -0.7, 0.0), Vector3::new(0.5, -0.5, 0.7)] {
                let gravity_W = way.normalize() * G;
                let walls = vec![fixed(hole.clone(), Isometry3::identity())];
                let at = Isometry3::translation(0.0, 0.0201, 0.0);
                let mut world = inside(walls, peg.clone(), at, gravity_W);
                run(&mut world, 3000);
                let told = format!("{name} in {hole_name}, {way:?}: {}", world.body().centre_W);
                // What rests is carried, by one spring a side or a few, and it leans.
                let pressed_W = pressed(&mut world, fastest_m_s([name, hole_name]), &told);
                assert!((pressed_W + gravity_W * MASS).norm() < 2e-3, "{told} {pressed_W}");
                let centre_W = world.body().centre_W;
                for axis in 0..3 {
                    let rests = if axis == 1 { 0.02 } else { HALF - 0.01 };
                    let load_n = MASS * gravity_W[axis].abs();
                    let sunk_m = if axis == 1 { rests - centre_W.y } else { centre_W[axis].abs() - rests };
                    if load_n > 0.01 {
                        // Leaning by a hundredth lifts its middle by 0.1 mm.
                        let least_m = load_n / (20.0 * K) - 1e-4;
                        assert!(sunk_m > least_m && sunk_m < load_n / (0.9 * K), "{told} {axis}: {sunk_m:e}");
                    }
                }
                // A cylinder may have turned about its axis.
                let tilted = (world.entities[1].X_WB.rotation * Vector3::y()).angle(&Vector3::y());
                assert!(tilted < 0.03, "{told}: {tilted}");
                // Without friction nothing stops its spin.
                let spin_W = world.body().angular_velocity_W();
                assert!(spin_W.xz().norm() < 0.5, "{told}: {spin_W}");
                // Pulled as hard it comes out, and no wall holds it.
                let out_W = Vector3::new(gravity_W.x, 9.81, gravity_W.z);
                let walls = vec![fixed(hole.clone(), Isometry3::identity())];
                let mut world = inside(walls, peg.clone(), world.entities[1].X_WB, out_W);
                run(&mut world, 400);
                assert!(world.body().centre_W.y > 0.06, "{told} -> {}", world.body().centre_W);
            }
        }
    }
}

/// Walls and floor of the hole as boxes of which each knows but itself.
fn hole_of_boxes() -> Vec<Entity> {
    let side = 0.5 * (0.05 - HALF);
    let wall = |size, x, z| fixed(cuboid(size), Isometry3::translation(x, 0.0, z));
    vec![
        fixed(cuboid([0.1, 0.03, 0.1]), Isometry3::translation(0.0, -0.015, 0.0)),
        wall([2.0 * side, 0.06, 0.1], HALF + side, 0.0),
        wall([2.0 * side, 0.06, 0.1], -HALF - side, 0.0),
        wall([0.1, 0.06, 2.0 * side], 0.0, HALF + side),
        wall([0.1, 0.06, 2.0 * side], 0.0, -HALF - side),
    ]
}

#[test]
fn a_hole_of_triangles_holds_a_peg_as_one_of_boxes_does() {
    let gravity_W = Vector3::new(0.5, -0.6, 0.4).normalize() * G;
    let at = Isometry3::from_parts(
        Vector3::new(0.0, 0.0202, 0.0).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.004, -0.003, 0.005)),
    );
    for (name, peg) in pegs().iter().filter(|(name, _)| *name != "cylinder") {
        for (hole_name, hole) in &holes() {
            let mut world =
                inside(vec![fixed(hole.clone(), Isometry3::identity())], peg.clone(), at, gravity_W);
            let mut oracle = inside(hole_of_boxes(), cuboid(PEG), at, gravity_W);
            run(&mut world, 3000);
            run(&mut oracle, 3000);
            let told = format!("{name} in {hole_name}");
            let weight_W = gravity_W * MASS;
            for (world, name) in [(&mut world, *name), (&mut oracle, "box")] {
                let pressed_W = pressed(world, fastest_m_s([name, hole_name]), &told);
                assert!((pressed_W + weight_W).norm() < 2e-3, "{told}: {pressed_W}");
            }
            // Fine meshes stand on more springs: within the depths of 0.1 mm.
            let apart_m = (world.body().centre_W - oracle.body().centre_W).norm();
            assert!(
                apart_m < 1.5e-4,
                "{told}: {apart_m:e} {} {}",
                world.body().centre_W,
                oracle.body().centre_W
            );
        }
    }
}

/// 60 x 60 x 20 mm, with a slot of 20 mm between its legs, which point down.
fn arch() -> TriangleSoup {
    cells([&[-0.03, -0.0105, 0.0105, 0.03], &[-0.04, 0.0, 0.02], &[-0.01, 0.01]], |[x, y, _]| {
        y == 1 || x != 1
    })
}

#[test]
fn an_arch_over_a_bar_hangs_on_it_and_is_held_by_it_on_either_side() {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    let upside = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let bars: [(&str, Shape, UnitQuaternion<f64>); 4] = [
        ("box", cuboid([0.02, 0.02, 0.1]), UnitQuaternion::identity()),
        ("mesh", fine(make::cuboid([0.02, 0.02, 0.1]), 0), UnitQuaternion::identity()),
        ("fine mesh", fine(make::cuboid([0.02, 0.02, 0.1]), 4), UnitQuaternion::identity()),
        ("arch", fine(arch(), 0), turned * upside),
    ];
    for times in [0, 2] {
        let arch = fine(arch(), times);
        for (name, bar, turn) in &bars {
            for side in [1.0, -1.0] {
                let gravity_W = Vector3::new(0.6 * side, -0.8, 0.0) * G;
                // Its slot's top is on the bar's, 10 mm up; of the other arch, 0.
                let top = if *name == "arch" { 0.0 } else { 0.01 };
                let walls = vec![fixed(bar.clone(), Isometry3::from_parts(Vector3::zeros().into(), *turn))];
                let at = Isometry3::translation(0.0, top + 1e-4, 0.0);
                let mut world = inside(walls, arch.clone(), at, gravity_W);
                run(&mut world, 4000);
                let told = format!("{name}, {times}, {side}: {}", world.body().centre_W);
                let pressed_W =
                    pressed(&mut world, fastest_m_s([name, if times > 0 { "fine" } else { "" }]), &told);
                assert!((pressed_W + gravity_W * MASS).norm() < 2e-3, "{told} {pressed_W}");
                let at_W = world.entities[1].X_WB.translation.vector;
                // 0.5 mm of play, and what springs give.
                assert!((at_W.x - side * 5e-4).abs() < 4e-4, "{told}: {at_W}");
                assert!((at_W.y - top).abs() < 4e-4, "{told}: {at_W}");
            }
        }
    }
}

#[test]
fn a_peg_thrown_about_in_its_hole_gains_no_energy() {
    for (hole_name, hole) in &holes() {
        for (name, peg) in &pegs() {
            for (way, spin) in [(0.1, 0.5), (-0.07, -1.0)] {
                let start = Isometry3::translation(0.0, 0.0201, 0.0);
                let peg = object(peg.clone(), start, 1000.0, 0.0).with_damping(0.2).unwrap();
                let thrown =
                    body(&peg, MASS).moving(Vector3::new(way, 0.1, 0.7 * way), Vector3::repeat(spin));
                let walls = fixed(hole.clone(), Isometry3::identity()).with_damping(0.0).unwrap();
                let mut world = World::new(vec![walls, peg], &[(1, thrown)], Settings::default(), 0);
                let energy = |world: &World| {
                    let body = world.body();
                    body.kinetic_energy_j() + MASS * G * (body.centre_W.y - 0.0195)
                };
                let most = energy(&world);
                for tick in 0..3000 {
                    world.step(&[]);
                    let told = format!("{name} in {hole_name} {way} {tick}: {} of {most}", energy(&world));
                    assert!(energy(&world) < most * 1.05, "{told}");
                    assert!(tick < 2999 || energy(&world) < 0.5 * most, "{told}");
                }
            }
        }
    }
}
