//! Meshes that touch in several places at once: pegs in holes, balls in cups, arches over bars.
//!
//! In every way that they are put there: `cargo test --release -p physics --test all meshes_places:: -- --ignored` (half a minute).
#![allow(non_snake_case)]

use crate::{common, meshes};

use std::f64::consts::FRAC_PI_2;

use crate::noise::Noise;
use crate::thrown::{KINDS, shape};
use common::*;
use haptics::mesh::{TriangleSoup, make};
use haptics::{Cuboid, Cylinder, Entity, Friction, Shape};
use meshes::{angle, block_with_hole, build, cells, cut_in_four};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use physics::Settings;
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points};

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

/// What carries it, once it rests: in no direction in which anything presses it does it move, and along the others, where
/// nothing stops it without friction, as fast as ever.
fn carried(world: &mut World, told: &str) -> Vector3<f64> {
    let pressing = |world: &World| -> Matrix3<f64> {
        let forces = world.manipulation.rows().iter().map(|row| row.force_W * row.normal_W.transpose());
        forces.sum::<Matrix3<f64>>()
    };
    let ways = pressing(world).symmetric_eigen();
    // What leans by hundredths presses by their squares along what is free.
    let is_free = |way: usize| ways.eigenvalues[way] < 1e-3 * ways.eigenvalues.max();
    let velocity = |world: &World| ways.eigenvectors.tr_mul(&world.body().velocity_W);
    let start = velocity(world);
    for _ in 0..300 {
        world.step(&[]);
        let now = velocity(world);
        for way in 0..3 {
            let from = if is_free(way) { start[way] } else { 0.0 };
            // What is left of the swing; a leaning cylinder that spins wobbles by a hundred times as much.
            assert!((now[way] - from).abs() < 1e-9, "{told}: {now} {start}");
        }
    }
    let forces = world.manipulation.rows().iter().map(|row| row.force_W);
    forces.sum()
}

fn fine(mut soup: TriangleSoup, times: usize) -> Shape {
    (0..times).for_each(|_| soup = cut_in_four(&soup));
    build(soup).into()
}

fn cuboid(size: [f64; 3]) -> Shape {
    Cuboid::new(size).unwrap().into()
}

/// Ticks until nothing swings any more: dampers of 2 N s/m, of which two or more press, bring 50 g to rest in hundredths of a
/// second.
const SETTLED: usize = 600;

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

/// How deep the middle of a peg is in what carries it, per force (m/N): it stands on four springs, a cylinder lies on two.
///
/// Walls are 30 mm high and it is 40 mm: what pulls it to a wall pulls 5 mm above the middle of that, and turns it on the
/// springs of wall and floor.
fn gives(name: &str, axis: usize) -> f64 {
    let is_round = name == "cylinder";
    let (on_wall, on_floor_m2) =
        if is_round { (2.0, 4.0 * 0.5 * 0.01 * 0.01) } else { (4.0, 4.0 * 0.01 * 0.01) };
    let turns_m2 = on_wall * 0.015 * 0.015 + on_floor_m2;
    match axis {
        1 => 1.0 / (4.0 * K),
        _ => (1.0 / on_wall + 0.005 * 0.005 / turns_m2) / K,
    }
}

#[test]
fn a_peg_in_a_hole_is_stopped_by_floor_and_walls_and_comes_out_again() {
    let ways = [Vector3::new(-0.7, -0.7, 0.0), Vector3::new(0.5, -0.5, 0.7)];
    for (number, (hole_name, hole)) in holes().iter().enumerate() {
        for (turn, (name, peg)) in (number..).zip(&pegs()) {
            // Each peg goes both ways, one in each hole.
            for way in [ways[turn % 2]] {
                let gravity_W = way.normalize() * G;
                let walls = vec![fixed(hole.clone(), Isometry3::identity())];
                let at = Isometry3::translation(0.0, 0.0201, 0.0);
                let mut world = inside(walls, peg.clone(), at, gravity_W);
                run(&mut world, SETTLED);
                let told = format!("{name} in {hole_name}, {way:?}: {}", world.body().centre_W);
                let carried_W = carried(&mut world, &told);
                assert!((carried_W + gravity_W * MASS).norm() < 1e-6, "{told} {carried_W}");
                let centre_W = world.body().centre_W;
                for axis in 0..3 {
                    let rests = if axis == 1 { 0.02 } else { HALF - 0.01 };
                    let sunk_m = if axis == 1 { rests - centre_W.y } else { centre_W[axis].abs() - rests };
                    let expected_m = MASS * gravity_W[axis].abs() * gives(name, axis);
                    if gravity_W[axis] != 0.0 {
                        // It leans by half a hundredth: springs are that much nearer to each other, or apart.
                        assert!(
                            (sunk_m / expected_m - 1.0).abs() < 5e-3,
                            "{told} {axis}: {sunk_m} {expected_m}"
                        );
                    }
                }
                // A cylinder may go on turning about its axis.
                let (axis_W, spin_W) =
                    (world.entities[1].X_WB.rotation * Vector3::y(), world.body().angular_velocity_W());
                assert!(axis_W.angle(&Vector3::y()) < 6e-3, "{told}: {axis_W}");
                let spins = if *name == "cylinder" { spin_W.cross(&axis_W) } else { spin_W };
                assert!(spins.norm() < 1e-6, "{told}: {spin_W}");
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

#[test]
fn a_corner_in_a_corner_is_as_deep_in_each_side_as_if_that_was_alone() {
    let hole = fine(block_with_hole(HALF, 0.0), 1);
    for times in [0, 2] {
        let peg = fine(make::cuboid(PEG), times);
        for deep in
            [Vector3::new(1e-4, 2e-4, 0.0), Vector3::new(3e-4, 1e-4, 2e-4), Vector3::new(2e-4, 2e-4, 1e-4)]
        {
            let play = HALF - 0.01;
            let at = Isometry3::translation(play + deep.x, 0.02 - deep.y, play + deep.z);
            let (mut memory, mut sides) = (PairMemory::default(), [0; 3]);
            // In the first tick nobody knows yet what else is pressed.
            for tick in 0..3 {
                let mut found = ContactPoints::default();
                let solid = |shape, X_W| Solid { shape, X_W };
                contact_points(
                    solid(&peg, &at),
                    solid(&hole, &Isometry3::identity()),
                    1e-3,
                    &mut memory,
                    &mut found,
                );
                for point in found.as_slice().iter().filter(|point| point.gap_m < 0.0) {
                    let side = point.normal_W.iamax();
                    let told = format!("{times} {deep:?} {tick}: {point:?}");
                    assert!(point.normal_W[side].abs() > 1.0 - 1e-9, "{told}");
                    let expected_m = [deep.x, deep.y, deep.z][side];
                    // Roundings of centimetres; a crossing is looked for a ten-millionth of them farther inside.
                    assert!((point.depth_m() - expected_m).abs() < 2e-8, "{told}");
                    sides[side] += 1;
                }
            }
            assert!((0..3).all(|side| sides[side] > 0 || deep[side] == 0.0), "{deep:?}: {sides:?}");
        }
    }
}

/// A prism upright in the hole, over an outline of so many points, of which every other one may be nearer (m).
fn upright(points: u32, inner: f64) -> Shape {
    let outline: Vec<_> = (0..points)
        .map(|at| {
            let (sin, cos) = (f64::from(at) / f64::from(points) * std::f64::consts::TAU).sin_cos();
            [cos, sin].map(|part| part * if at % 2 == 1 { inner } else { 0.01 })
        })
        .collect();
    // Its middle sees all of it, and is a point in the plane of both ends.
    let outline: Vec<_> = outline.into_iter().chain([[0.0; 2]]).collect();
    let fan: Vec<_> = (0..points).map(|at| [points, at, (at + 1) % points]).collect();
    let mut soup = meshes::prism(&outline, &fan, 0.02);
    // Of the sides those that go through the middle are none.
    let is_middle = |vertex: &u32| vertex % (points + 1) == points;
    soup.faces.retain(|face| {
        let ends = face.iter().all(|vertex| *vertex <= points) || face.iter().all(|vertex| *vertex > points);
        ends || !face.iter().any(is_middle)
    });
    let (last, side) = (points - 1, points + 1);
    soup.faces.extend([[last, last + side, side], [last, side, 0]]);
    build(soup).into()
}

/// Every prism in every hole, in each `of`-th way that they are turned and pulled.
fn prisms_come_to_rest(of: usize) {
    let ways = [[0.5, -0.5, 0.7], [-0.45, -0.63, -0.72], [-0.61, -0.49, -0.55]].map(Vector3::from);
    let prisms = [(12, 0.01), (8, 0.01), (40, 0.01), (18, 0.008)];
    let ways: Vec<_> = ways.iter().flat_map(|way| [0.0, FRAC_PI_2].map(|turned| (way, turned))).collect();
    for (number, (hole_name, hole)) in holes().iter().enumerate() {
        for (turn, (points, inner)) in (number..).zip(prisms) {
            for (way, turned) in ways.iter().skip(turn % of).step_by(of) {
                let at = Isometry3::from_parts(
                    Vector3::new(0.0, 0.0101, 0.0).into(),
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), *turned),
                );
                let gravity_W = way.normalize() * G;
                let walls = vec![fixed(hole.clone(), Isometry3::identity())];
                let mut world = inside(walls, upright(points, inner), at, gravity_W);
                // A frictionless fit rocks in its corner for seconds; one that flickers never ends.
                for _ in 0..8 {
                    run(&mut world, SETTLED);
                    if world.body().velocity_W.norm() < 1e-12 {
                        break;
                    }
                }
                let told =
                    format!("{points} {inner} in {hole_name}, {turned}, {way:?}: {}", world.body().centre_W);
                let carried_W = carried(&mut world, &told);
                assert!((carried_W + gravity_W * MASS).norm() < 1e-6, "{told} {carried_W}");
                assert!(world.body().angular_velocity_W().norm() < 1e-6, "{told}");
            }
        }
    }
}

#[test]
fn what_touches_with_many_points_as_good_as_each_other_rests_on_the_same_ones() {
    prisms_come_to_rest(5);
}

#[test]
#[ignore = "half a minute; see the top of the file"]
fn whichever_way_it_is_pulled_what_touches_with_many_points_rests_on_the_same_ones() {
    prisms_come_to_rest(1);
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
            run(&mut world, SETTLED);
            run(&mut oracle, SETTLED);
            let told = format!("{name} in {hole_name}");
            let weight_W = gravity_W * MASS;
            for world in [&mut world, &mut oracle] {
                let carried_W = carried(world, &told);
                assert!((carried_W + weight_W).norm() < 1e-6, "{told}: {carried_W}");
            }
            // Depths of 0.15 mm are told along one normal or the other, and they lean by hundredths; crossings are the
            // fewest.
            let apart_m = (world.body().centre_W - oracle.body().centre_W).norm();
            assert!(apart_m < 1e-6, "{told}: {apart_m:e}");
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
    let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
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
                run(&mut world, SETTLED);
                let told = format!("{name}, {times}, {side}: {}", world.body().centre_W);
                let carried_W = carried(&mut world, &told);
                assert!((carried_W + gravity_W * MASS).norm() < 1e-6, "{told} {carried_W}");
                let at_W = world.entities[1].X_WB.translation.vector;
                // 0.5 mm of play, and what springs give.
                assert!((at_W.x - side * 5e-4).abs() < 4e-4, "{told}: {at_W}");
                assert!((at_W.y - top).abs() < 4e-4, "{told}: {at_W}");
            }
        }
    }
}

/// Every peg in every hole, in each of these ways: along, and spinning.
fn throw_pegs(throws: &[(f64, f64)]) {
    for (hole_name, hole) in &holes() {
        for (name, peg) in &pegs() {
            for &(way, spin) in throws {
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
                for tick in 0..1500 {
                    world.step(&[]);
                    let told = format!("{name} in {hole_name} {way} {tick}: {} of {most}", energy(&world));
                    assert!(energy(&world) < most * 1.05, "{told}");
                    assert!(tick < 1499 || energy(&world) < 0.5 * most, "{told}");
                }
            }
        }
    }
}

#[test]
fn a_peg_thrown_about_in_its_hole_gains_no_energy() {
    throw_pegs(&[(0.1, 0.5)]);
}

#[test]
#[ignore = "half a minute; see the top of the file"]
fn a_peg_thrown_about_in_many_ways_gains_no_energy() {
    throw_pegs(&[(-0.07, -1.0), (0.2, 0.0), (0.05, 5.0), (-0.15, 2.0)]);
}

/// A thing that does not move touches in every tick if it does in any: the plane of the last tick's points
/// may show none of them.
#[test]
fn what_stands_still_does_not_touch_in_every_other_tick_only() {
    let noise = &mut Noise::new(3);
    let (mesh, X_WM): (Shape, _) = (build(angle()).into(), Isometry3::identity());
    let mut pressed = 0;
    for scene in 0..3000 {
        let shape = shape(KINDS[noise.below(KINDS.len())], noise);
        let (turn, way) = (noise.turn(), noise.direction());
        let (inside, outside) = (noise.vector(0.02), noise.log_within(1e-7, 1e-5));
        let touch = |away_m: f64, memory: &mut PairMemory| {
            let X_W = Isometry3::from_parts((inside + way * away_m).into(), turn);
            let mut found = ContactPoints::default();
            let (a, b) = (Solid { shape: &shape, X_W: &X_W }, Solid { shape: &mesh, X_W: &X_WM });
            contact_points(a, b, 1e-3, memory, &mut found);
            found.as_slice().iter().any(|point| point.gap_m < 0.0)
        };
        // From where they come apart, so much nearer.
        let (mut near_m, mut far_m) = (0.0, 0.2);
        for _ in 0..50 {
            let middle_m = 0.5 * (near_m + far_m);
            let is_in = touch(middle_m, &mut PairMemory::default());
            (near_m, far_m) = if is_in { (middle_m, far_m) } else { (near_m, middle_m) };
        }
        let memory = &mut PairMemory::default();
        let at_m = near_m - outside;
        let touches: Vec<bool> = (0..8).map(|_| touch(at_m, memory)).collect();
        let changes = touches[2..].windows(2).filter(|two| two[0] != two[1]).count();
        assert!(changes <= 1, "{scene}: {touches:?}");
        pressed += usize::from(touches[7]);
    }
    assert!(pressed > 1500, "{pressed}");
}
