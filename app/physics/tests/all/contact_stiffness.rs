//! Contacts between entities whose stiffness is their own: how deep things rest, and how they come to it, at any rate.
#![allow(non_snake_case)]

use crate::{common, meshes};

use common::{G, body, floor, object};
use haptics::mesh::Mesh;
use haptics::{Cuboid, Cylinder, Entity, Shape, Sphere};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, BodyError, ContactStiffness, Manipulation, MassProperties, Response, Settings};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const BY_MASS: ContactStiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
/// [rad/s]: as the heaviest body would swing.
const OMEGA: f64 = 1000.0;
const RATES_HZ: [f64; 4] = [500.0, 1000.0, 4000.0, 8000.0];

fn settings(contact_stiffness: ContactStiffness) -> Settings {
    Settings { contact_stiffness, ..Settings::default() }
}

/// Things on a floor, all of them as soft for fingers as things are.
struct Table {
    entities: Vec<Entity>,
    manipulation: Manipulation,
    dt_s: f64,
}

impl Table {
    fn new(things: Vec<(Entity, f64)>, settings: Settings, rate_hz: f64) -> Self {
        let mut entities = vec![floor(0.0, 1000.0, 0.5)];
        let mut bodies = Vec::new();
        for (entity, mass_kg) in things {
            bodies.push((entities.len(), body(&entity, mass_kg)));
            entities.push(entity);
        }
        let manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
        Self { entities, manipulation, dt_s: rate_hz.recip() }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / self.dt_s).round() as u32 {
            let made = self.manipulation.step(&mut self.entities, &mut [], self.dt_s);
            assert_eq!(made.unsolved, 0);
        }
    }

    fn body(&self, index: usize) -> &Body {
        &self.manipulation.bodies()[index]
    }
}

/// On its corners, 28 mm from where its mass is.
#[test]
fn a_box_whose_mass_is_nearly_all_in_its_middle_stands_as_deep_as_any_other() {
    let entity = cube(0.04, 0.03);
    let shape = &entity.shape;
    let of = |share: f64| {
        let moment = share * 0.1 / 6.0 * 0.04 * 0.04;
        MassProperties::of_shape(shape, 0.1).unwrap().with_inertia([moment; 3]).unwrap().fitting(shape)
    };
    assert!(matches!(of(0.99e-3), Err(BodyError::Concentrated { axis: "x", .. })));
    let mut entities = vec![floor(0.0, 1000.0, 0.5), entity.clone()];
    let body = Body::at_rest(of(1.01e-3).unwrap(), &entity.X_WB);
    let mut manipulation = Manipulation::new(&entities, &[(1, body)], settings(BY_MASS)).unwrap();
    for _ in 0..1000 {
        manipulation.step(&mut entities, &mut [], 1e-3);
    }
    // m g / 4 on points of m 10^6.
    let deep_m = 0.02 - entities[1].X_WB.translation.y;
    assert!((deep_m - G / 4e6).abs() < 1e-9, "{deep_m}");
}

fn ball(radius_m: f64, height_m: f64) -> Entity {
    object(Sphere::new(radius_m).unwrap(), Isometry3::translation(0.0, height_m, 0.0), 1000.0, 0.5)
}

fn cube(edge_m: f64, middle_m: f64) -> Entity {
    object(Cuboid::new([edge_m; 3]).unwrap(), Isometry3::translation(0.0, middle_m, 0.0), 1000.0, 0.5)
}

#[test]
fn whatever_it_weighs_the_heaviest_rests_on_a_point_as_deep_as_gravity_over_a_square() {
    for rate_hz in RATES_HZ {
        for mass_kg in [1e-4, 0.1, 20.0] {
            let mut table = Table::new(vec![(ball(0.02, 0.03), mass_kg)], settings(BY_MASS), rate_hz);
            table.run(2.0);
            let depth_m = 0.02 - table.body(0).centre_W.y;
            let speed_m_s = table.body(0).velocity_W.norm();
            // Roundings of numbers of 0.02 m.
            assert!((depth_m - G / OMEGA.powi(2)).abs() < 1e-15, "{rate_hz} {mass_kg}: {depth_m}");
            assert!(speed_m_s < 1e-12, "{rate_hz} {mass_kg}: {speed_m_s}");
        }
    }
}

#[test]
fn what_is_light_beside_what_is_heavy_rests_less_deep_and_carries_it() {
    for (light_kg, heavy_kg) in [(0.05, 0.5), (0.01, 1.0), (0.001, 20.0)] {
        for rate_hz in RATES_HZ {
            let things = vec![(cube(0.02, 0.01), light_kg), (cube(0.02, 0.03), heavy_kg)];
            let mut table = Table::new(things, settings(BY_MASS), rate_hz);
            table.run(3.0);
            // Four corners each: springs that share the load.
            let k = 4.0 * heavy_kg * OMEGA.powi(2);
            let below_m = (light_kg + heavy_kg) * G / k;
            let above_m = below_m + heavy_kg * G / k;
            let found = [0.01 - table.body(0).centre_W.y, 0.03 - table.body(1).centre_W.y];
            for (found_m, depth_m) in found.into_iter().zip([below_m, above_m]) {
                // They fell into each other: where nobody has worked for all of a depth (`pair/ledger.rs`), it is a little more.
                assert!(
                    (found_m - depth_m).abs() < 0.01 * depth_m,
                    "{light_kg} {heavy_kg} {rate_hz}: {found:?}"
                );
            }
        }
    }
}

/// Critically damped, nothing comes back; the speed of a fall of 1 mm is gone in a few swings' time.
#[test]
fn what_lands_comes_to_rest_without_a_swing() {
    for rate_hz in RATES_HZ {
        for mass_kg in [0.01, 20.0] {
            let mut table = Table::new(vec![(ball(0.02, 0.021), mass_kg)], settings(BY_MASS), rate_hz);
            // It falls for 14.3 ms.
            table.run(0.045);
            let rest_m = 0.02 - G / OMEGA.powi(2);
            for _ in 0..100 {
                table.run(1.0 / rate_hz);
                let (at_m, speed_m_s) = (table.body(0).centre_W.y, table.body(0).velocity_W.y);
                // exp(-1000 * 30.7 ms) of 0.14 m/s, and a tick's share; never above where it rests.
                assert!(speed_m_s.abs() < 1e-6 && at_m < rest_m + 1e-9, "{rate_hz} {at_m} {speed_m_s}");
            }
        }
    }
}

#[test]
fn entities_and_scenes_that_say_a_stiffness_have_it() {
    let given = |k| ContactStiffness::Given { stiffness_n_per_m: k, damping_ratio: 1.0 };
    let soft = ball(0.02, 0.02).with_contact_stiffness(2e3).unwrap();
    let two = [(soft, BY_MASS, 2e3), (ball(0.02, 0.02), given(1e4), 1e4)];
    for (ball, stiffness, k) in two {
        for rate_hz in RATES_HZ {
            let mut table = Table::new(vec![(ball.clone(), 0.1)], settings(stiffness), rate_hz);
            table.run(2.0);
            let depth_m = 0.02 - table.body(0).centre_W.y;
            assert!((depth_m - 0.1 * G / k).abs() < 1e-15, "{rate_hz} {k}: {depth_m}");
        }
    }
}

/// A box leans by its moment over `k w^2 - m g h`, until its upper points bear nothing: it tips at `w / (2 h)` of its weight less
/// by `m g h / (k w^2)`, with `h` the height of its centre.
#[test]
fn on_soft_points_a_box_tips_earlier_by_its_weight_times_its_height_over_its_stiffness() {
    let (width_m, height_m, mass_kg) = (0.04, 0.05, 0.5);
    let has_tipped = |k: f64, slope: f64, rate_hz: f64| {
        let lean = slope.atan();
        let gravity_W = Vector3::new(lean.sin(), -lean.cos(), 0.0) * G;
        // Damped so much that it leans without swinging over.
        let stiffness = ContactStiffness::Given { stiffness_n_per_m: k, damping_ratio: 8.0 };
        let at = Isometry3::translation(0.0, height_m + mass_kg * gravity_W.y / (4.0 * k), 0.0);
        let shape = Cuboid::new([width_m, 2.0 * height_m, width_m]).unwrap();
        let mut entities = vec![floor(0.0, 1000.0, 1.0), object(shape, at, 1000.0, 1.0)];
        let bodies = [(1, body(&entities[1], mass_kg))];
        let settings = Settings { gravity_W, ..settings(stiffness) };
        let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
        for _ in 0..(5.0 * rate_hz) as u32 {
            manipulation.step(&mut entities, &mut [], rate_hz.recip());
        }
        entities[1].X_WB.rotation.angle() > 0.5
    };
    for rate_hz in RATES_HZ {
        for k in [500.0, 1000.0, 4000.0, 1e6] {
            // The form leaves out that points which lean move, too: an eighth of the softening at most.
            let softening = mass_kg * G * height_m / (k * width_m * width_m);
            let slope = width_m / (2.0 * height_m) * (1.0 - softening);
            let within = 0.005 + 0.125 * softening;
            for (share, tips) in [(1.0 - within, false), (1.0 + within, true)] {
                assert_eq!(has_tipped(k, share * slope, rate_hz), tips, "{rate_hz} {k} {share}");
            }
        }
    }
}

/// An integrator that takes the forces of a tick's beginning would throw a light body off a spring for a heavy one.
#[test]
fn of_an_integrator_that_is_not_implicit_contacts_are_as_felt() {
    use physics::Integrator::{Rk4, ThesisEuler};
    for integrator in [Rk4, ThesisEuler] {
        let settings = Settings { integrator, ..settings(BY_MASS) };
        let things = vec![(ball(0.02, 0.02), 0.1)];
        let mut table = Table::new(things, settings, 1000.0);
        table.run(5.0);
        // Two surfaces of 1000 N/m.
        let depth_m = 0.02 - table.body(0).centre_W.y;
        assert!((depth_m - 0.1 * G / 500.0).abs() < 1e-6, "{integrator:?}: {depth_m}");
    }
}

#[test]
fn a_tower_of_forty_stands_and_sinks_by_a_sum() {
    const EDGE_M: f64 = 0.02;
    let things = (0..40).map(|place| (cube(EDGE_M, EDGE_M * (f64::from(place) + 0.5)), 0.1)).collect();
    let mut table = Table::new(things, settings(BY_MASS), 1000.0);
    table.run(5.0);
    let one_m = G / (4.0 * OMEGA.powi(2));
    let mut sunk_m = 0.0;
    for place in 0..40 {
        sunk_m += one_m * f64::from(40 - place);
        let found_m = EDGE_M * (f64::from(place) + 0.5) - table.body(place as usize).centre_W.y;
        // Sixty of its slowest swings, critically damped, and roundings of numbers near 1.
        assert!((found_m - sunk_m).abs() < 1e-9, "{place}: {found_m} {sunk_m}");
    }
}

/// As a column under its own weight (Euler): `n^3 = 7.84 (1000 / s)^2 edge / g`, which is 25 cubes of 20 mm.
#[test]
fn a_tower_that_is_not_quite_straight_stands_up_to_where_its_springs_buckle() {
    const EDGE_M: f64 = 0.02;
    let leans_m = |count: u32| {
        let aside = |place: u32| if place.is_multiple_of(3) { 1e-4 } else { 0.0 };
        let thing = |place: u32| {
            let at = Isometry3::translation(aside(place), EDGE_M * (f64::from(place) + 0.5), 0.0);
            (object(Cuboid::new([EDGE_M; 3]).unwrap(), at, 1000.0, 0.5), 0.1)
        };
        let mut table = Table::new((0..count).map(thing).collect(), settings(BY_MASS), 1000.0);
        table.run(2.5);
        table.body(count as usize - 1).centre_W.xz().norm()
    };
    let (below_m, beyond_m) = (leans_m(20), leans_m(32));
    assert!(below_m < 1e-3 && beyond_m > 2e-2, "{below_m} {beyond_m}");
}

/// A ball that begins on the ground without having sunk in swings about its depth of rest as a damped spring does, whatever comes back
/// of an impact: this is none.
#[test]
fn what_settles_on_its_spring_goes_beyond_its_rest_by_what_damping_leaves() {
    let (mass_kg, k) = (0.1, 2e3);
    for damping_ratio in [0.1, 0.3, 0.6] {
        let overshoot = (-PI * damping_ratio / (1.0_f64 - damping_ratio * damping_ratio).sqrt()).exp();
        let stiffness = ContactStiffness::Given { stiffness_n_per_m: k, damping_ratio };
        for response in [Response::Force, Response::Bounce { restitution: 0.7 }] {
            let settings = Settings { response, ..settings(stiffness) };
            let mut table = Table::new(vec![(ball(0.02, 0.02), mass_kg)], settings, 8000.0);
            let mut deepest_m = 0.0_f64;
            for _ in 0..4000 {
                table.run(1.0 / 8000.0);
                deepest_m = deepest_m.max(0.02 - table.body(0).centre_W.y);
            }
            let found = deepest_m * k / (mass_kg * G) - 1.0;
            // Implicit ticks damp by omega dt / 2 more: 0.009.
            let less =
                (-PI * (damping_ratio + 0.01) / (1.0 - (damping_ratio + 0.01_f64).powi(2)).sqrt()).exp();
            assert!(
                (less - 0.005..overshoot + 0.005).contains(&found),
                "{damping_ratio} {response:?}: {found} {overshoot}"
            );
        }
    }
}

/// A finger presses a cube down without weight: its spring takes the force, and no impulse.
#[test]
fn what_is_pressed_steadily_or_fast_is_held_by_its_spring() {
    for restitution in [0.0, 0.7] {
        let response = Response::Bounce { restitution };
        let settings = Settings { response, gravity_W: Vector3::zeros(), ..settings(BY_MASS) };
        let cube = cube(0.02, 0.01);
        let bodies = [(1, body(&cube, 0.1))];
        let mut world = common::World::new(vec![floor(0.0, 1000.0, 0.5), cube], &bodies, settings, 1);
        let mut force_n = 0.0;
        for tick in 0..2000 {
            // Down by 5 mm at 0.1 m/s.
            let down_m = (f64::from(tick) * 1e-4).min(5e-3);
            force_n = world.step(&[Vector3::new(0.0, 0.0201 - down_m, 0.0)])[0].norm();
        }
        let depth_m = 0.01 - world.body().centre_W.y;
        let expected_m = force_n / (4.0 * 0.1 * OMEGA.powi(2));
        assert!(
            force_n > 4.0 && (depth_m - expected_m).abs() < 1e-9,
            "{restitution}: {force_n} N, {depth_m} {expected_m}"
        );
        assert!(world.body().velocity_W.norm() < 1e-9, "{restitution}: {}", world.body().velocity_W);
    }
}

/// As deep as they carry each other: two springs of 1000 N/m in each of four corners.
#[test]
fn stacks_that_begin_at_rest_as_felt_stay_where_they_are() {
    for (cubes, rate_hz) in [(1, 1000.0), (3, 500.0), (3, 1000.0), (5, 1000.0), (5, 8000.0)] {
        let mut top_m = 0.0;
        let stack = (0..cubes).map(|below| {
            let depth_m = 0.1 * G * f64::from(cubes - below) / (4.0 * 500.0);
            let centre_m = top_m + 0.02 - depth_m;
            top_m = centre_m + 0.02;
            let shape = Cuboid::new([0.04; 3]).unwrap();
            (object(shape, Isometry3::translation(0.0, centre_m, 0.0), 1000.0, 0.5), 0.1)
        });
        let stack: Vec<(Entity, f64)> = stack.collect();
        let before: Vec<f64> = stack.iter().map(|(cube, _)| cube.X_WB.translation.y).collect();
        let mut table = Table::new(stack, settings(ContactStiffness::AsFelt), rate_hz);
        for _ in 0..20 {
            table.run(0.05);
            for (cube, before) in table.entities[1..].iter().zip(&before) {
                let moved_m = cube.X_WB.translation.y - before;
                // The deepest is 2.5 mm deep.
                assert!(moved_m.abs() < 1e-7, "{cubes} at {rate_hz} Hz: {moved_m}");
            }
        }
    }
}

/// Upright along z.
fn can(sides: u32) -> Arc<Mesh> {
    can_of(sides, |_| true)
}

/// With those of the corners that are left in.
fn can_of(sides: u32, is_left: impl Fn(u32) -> bool) -> Arc<Mesh> {
    let corner = |side: u32| {
        let angle = TAU * f64::from(side) / f64::from(sides);
        [0.03 * angle.cos(), 0.03 * angle.sin()]
    };
    let outline: Vec<[f64; 2]> = (0..sides).filter(|side| is_left(*side)).map(corner).collect();
    let triangles: Vec<[u32; 3]> = (1..outline.len() as u32 - 1).map(|side| [0, side, side + 1]).collect();
    meshes::build(meshes::prism(&outline, &triangles, 0.08))
}

/// On a plane and on a box, dropped flat and on their sides.
#[test]
fn round_meshes_as_felt_stand_and_lie_where_they_fall() {
    let settings = settings(ContactStiffness::AsFelt);
    for (sides, leans_most) in [(8, 1e-6), (24, 1e-6), (48, 2e-4), (300, 2e-4)] {
        for (turn, low_m) in [(-FRAC_PI_2, 0.04), (0.0, 0.03)] {
            for on_box in [false, true] {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn);
                let at = Isometry3::from_parts(Vector3::new(0.0, low_m + 0.002, 0.0).into(), turn);
                let mut table =
                    Table::new(vec![(object(can(sides), at, 1000.0, 0.5), 0.3)], settings, 1000.0);
                if on_box {
                    let slab = Isometry3::translation(0.0, -0.05, 0.0);
                    table.entities[0] = object(Cuboid::new([0.5, 0.1, 0.5]).unwrap(), slab, 1000.0, 0.5);
                }
                let axis_W = turn * Vector3::z();
                let leans = (0..4000).fold(0.0, |most: f64, _| {
                    table.run(1e-3);
                    most.max((table.entities[1].X_WB.rotation * Vector3::z()).angle(&axis_W))
                });
                assert!(leans < leans_most, "{sides} {low_m} {on_box}: {leans}");
                // Less than a facet.
                let went_m = table.entities[1].X_WB.translation.vector.xz().norm();
                assert!(went_m < 1e-3, "{sides} {low_m} {on_box}: {went_m}");
                assert!(table.body(0).velocity_W.norm() < 5e-3, "{sides} {low_m} {on_box}");
            }
        }
    }
}

/// Of thousands of vertices within reach every sixteenth counts.
#[test]
fn finely_cut_cans_as_felt_that_fall_flat_stand_upright() {
    let settings = settings(ContactStiffness::AsFelt);
    for (sides, rate_hz) in [(1000, 1000.0), (1000, 4000.0), (3000, 1000.0), (3000, 4000.0)] {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2);
        let at = Isometry3::from_parts(Vector3::new(0.0, 0.042, 0.0).into(), turn);
        let mut can = Table::new(vec![(object(can(sides), at, 1000.0, 0.5), 0.3)], settings, rate_hz);
        can.run(1.0);
        let leans = (can.entities[1].X_WB.rotation * Vector3::z()).angle(&Vector3::y());
        // 0.02 degrees: those that count of the finest are not quite as many on each side. It rocked by some degrees.
        assert!(leans < 3.5e-4, "{sides} {rate_hz}: {leans} rad");
        let turns = can.body(0).angular_velocity_W().norm();
        assert!(turns < 1e-6, "{sides} {rate_hz}: {turns} rad/s");
    }
}

/// With rolling friction as scenes have it; with none they roll to and fro for tens of seconds.
#[test]
fn round_meshes_as_felt_that_roll_come_to_rest_by_their_rolling_friction() {
    let settings = Settings { sleep: Some(physics::Sleep::default()), ..settings(ContactStiffness::AsFelt) };
    let sphere = |nu: usize, nv: usize| meshes::build(haptics::mesh::make::uv_sphere(nu, nv, 0.03));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.5, -0.7));
    let lies = UnitQuaternion::identity();
    let things = [
        (can(200), lies, 0.3),
        (can(300), lies, 0.3),
        (can(3000), lies, 0.3),
        (sphere(32, 17), turn, 0.1),
        (sphere(100, 51), turn, 0.1),
    ];
    for (mesh, turn, mass_kg) in things {
        for rate_hz in [1000.0, 4000.0] {
            let faces = mesh.faces().len();
            let at = Isometry3::from_parts(Vector3::new(0.0, 0.032, 0.0).into(), turn);
            let thing = object(mesh.clone(), at, 1000.0, 0.5).with_turning_friction(2e-4, 2e-4).unwrap();
            let mut table = Table::new(vec![(thing, mass_kg)], settings, rate_hz);
            table.run(0.5);
            let turns = table.body(0).angular_velocity_W().norm();
            assert!(turns < 0.03, "{faces} {rate_hz}: {turns} rad/s");
            table.run(4.5);
            assert!(table.manipulation.awake().is_empty(), "{faces} {rate_hz}: awake");
        }
    }
}

/// A ball of triangles on a slope: `rho / r` is where it begins to roll, however many vertices bear it.
#[test]
fn a_ball_of_triangles_as_felt_is_held_by_rolling_friction_up_to_where_a_ball_is() {
    let (rho_m, r, mass_kg) = (1e-3, 0.03, 0.1);
    let ball = meshes::build(haptics::mesh::make::uv_sphere(100, 51, r));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.5, -0.7));
    for rate_hz in [1000.0, 4000.0] {
        let way_m = |share: f64| {
            let lean = (share * rho_m / r).atan();
            let gravity_W = Vector3::new(lean.sin(), -lean.cos(), 0.0) * G;
            let settings = Settings { gravity_W, ..settings(ContactStiffness::AsFelt) };
            let at = Isometry3::from_parts(Vector3::new(0.0, r, 0.0).into(), turn);
            let ball = object(ball.clone(), at, 1000.0, 0.5).with_turning_friction(0.0, rho_m).unwrap();
            let mut table = Table::new(vec![(ball, mass_kg)], settings, rate_hz);
            table.run(1.0);
            let from_m = table.entities[1].X_WB.translation.x;
            table.run(2.0);
            table.entities[1].X_WB.translation.x - from_m
        };
        // Facets of 2 mm hold it, too, and let it go no earlier.
        assert!(way_m(0.9) < 1e-6, "{rate_hz}: {}", way_m(0.9));
        assert!(way_m(2.0) > 0.02, "{rate_hz}: {}", way_m(2.0));
    }
}

/// Stand-in for a floor: its top is at height 0, and things come down there at this x.
fn supports() -> Vec<(&'static str, Entity, f64)> {
    let slab = Isometry3::translation(0.0, -0.05, 0.0);
    let flat = |_: f64, _: f64| 0.0;
    let of = |shape: Shape, at| object(shape, at, 1000.0, 0.5);
    let origin = Isometry3::identity();
    vec![
        ("box", of(Cuboid::new([0.08, 0.1, 0.08]).unwrap().into(), slab), 0.0),
        ("rim", of(Cuboid::new([1.0, 0.1, 1.0]).unwrap().into(), slab), 0.465),
        ("cylinder", of(Cylinder::new(0.3, 0.1).unwrap().into(), slab), 0.1),
        ("sheet", of(meshes::build(meshes::terrain(1, 1.0, flat)).into(), origin), 0.1),
        ("fine sheet", of(meshes::build(meshes::terrain(32, 1.0, flat)).into(), origin), 0.1),
        ("slab", of(meshes::build(meshes::block(32, 1.0, 0.1, flat)).into(), origin), 0.1),
    ]
}

/// Each vertex stands for itself, and what springs hold does not come and go with those that stand for many.
#[test]
fn round_meshes_as_felt_stand_on_rims_cylinders_and_meshes() {
    let settings = settings(ContactStiffness::AsFelt);
    for (name, support, x) in supports() {
        for (sides, lean, rate_hz) in
            [(8, 0.05, 1000.0), (48, 0.0, 1000.0), (48, 0.05, 1000.0), (48, 0.05, 4000.0)]
        {
            let up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean - FRAC_PI_2);
            let at = Isometry3::from_parts(Vector3::new(x, 0.0435, 0.0).into(), up);
            let mut table = Table::new(vec![(object(can(sides), at, 1000.0, 0.5), 0.3)], settings, rate_hz);
            table.entities[0] = support.clone();
            let energy_j = |table: &Table| {
                let body = table.body(0);
                body.kinetic_energy_j() + 0.3 * G * body.centre_W.y + table.manipulation.elastic_energy_j()
            };
            let mut most_j = energy_j(&table);
            for _ in 0..(3.0 * rate_hz) as u32 {
                table.run(table.dt_s);
                let now_j = energy_j(&table);
                // What the solver leaves, 1e-10 of forces along millimetres.
                assert!(now_j < most_j + 1e-10, "{name} {sides} {lean} {rate_hz}: {:e}", now_j - most_j);
                most_j = most_j.min(now_j);
            }
            let body = table.body(0);
            let turns = body.angular_velocity_W().norm();
            // A hundredth of the rate at which such a can rocked for ever.
            assert!(turns < 0.01, "{name} {sides} {lean} {rate_hz}: {turns} rad/s");
            let leans = (table.entities[1].X_WB.rotation * Vector3::z()).angle(&Vector3::y());
            // A hundredth of how far it rocked. What the finest ones lean, springs left out on one side make.
            assert!(leans < 1e-3, "{name} {sides} {lean} {rate_hz}: {leans} rad");
        }
    }
}

/// As on a plane.
#[test]
fn balls_of_triangles_as_felt_roll_as_far_on_cylinders_and_meshes() {
    let settings = settings(ContactStiffness::AsFelt);
    let ball = meshes::build(haptics::mesh::make::uv_sphere(32, 16, 0.03));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.5, -0.7));
    let way_m = |support: Option<Entity>| {
        let at = Isometry3::from_parts(Vector3::new(-0.2, 0.03, 0.0).into(), turn);
        let mut table = Table::new(vec![(object(ball.clone(), at, 1000.0, 0.5), 0.3)], settings, 1000.0);
        let moving = table.body(0).moving(Vector3::x() * 0.3, Vector3::z() * -10.0);
        table.manipulation = Manipulation::new(&table.entities, &[(1, moving)], settings).unwrap();
        if let Some(support) = support {
            table.entities[0] = support;
        }
        table.run(1.0);
        table.entities[1].X_WB.translation.x + 0.2
    };
    let expected_m = way_m(None);
    for (name, support, _) in supports().into_iter().filter(|(_, _, x)| *x == 0.1) {
        let found_m = way_m(Some(support));
        // On a fine sheet it is braked by a tenth: where more than one place is known, few vertices stand for all for a while.
        assert!((found_m / expected_m - 1.0).abs() < 0.12, "{name}: {found_m} of {expected_m}");
    }
}

/// Limits that docs/contacts.md tells, as large as it tells them: degrees and rad/s after so many seconds.
#[test]
fn where_meshes_as_felt_lean_and_sway_they_do_by_no_more_than_is_told() {
    let settings = settings(ContactStiffness::AsFelt);
    let up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2);
    let across = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    let plane = floor(0.0, 1000.0, 0.5);
    let bowl = meshes::build(meshes::block(64, 0.6, 0.1, |x, z| 2.0 * (x * x + z * z)));
    let bowl = object(bowl, Isometry3::identity(), 1000.0, 0.5);
    let lies = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    let pipe = Isometry3::from_parts(Vector3::new(0.0, -0.05, 0.0).into(), lies);
    let pipe = object(Cylinder::new(0.05, 1.0).unwrap(), pipe, 1000.0, 0.5);
    // Half of its rim has a fifth of the corners of the other half.
    let uneven = can_of(80, |side| side < 40 || side % 5 == 0);
    let cases = [
        ("uneven rim", plane.clone(), uneven, up, 1, 2.0, 0.35, 1e-3),
        ("in a bowl", bowl, can(48), up, 1, 3.0, 1.5, 3.0),
        ("48 across a pipe", pipe.clone(), can(48), across, 1, 2.0, 1e-3, 1e-3),
        ("8 across a pipe", pipe, can(8), across, 1, 2.0, 1e-3, 1e-3),
        ("three on each other", plane, can(48), up, 3, 2.0, 0.1, 0.1),
    ];
    let mut found = Vec::new();
    for (name, support, mesh, turn, count, seconds, leans_most, turns_most) in cases {
        // A stack is slow to compute.
        for rate_hz in [1000.0, 4000.0].into_iter().take(if count > 1 { 1 } else { 2 }) {
            let half_m = if turn == up { 0.04 } else { 0.03 };
            let thing = |place: u32| {
                let middle_m = half_m + 0.002 + (2.0 * half_m + 0.0005) * f64::from(place);
                let at = Isometry3::from_parts(Vector3::new(0.0, middle_m, 0.0).into(), turn);
                let thing = object(mesh.clone(), at, 1000.0, 0.5);
                (thing.with_turning_friction(2e-4, 2e-4).unwrap(), 0.3)
            };
            let mut table = Table::new((0..count).map(thing).collect(), settings, rate_hz);
            table.entities[0] = support.clone();
            table.run(seconds);
            let axis_W = turn * Vector3::z();
            let lean = |entity: &Entity| (entity.X_WB.rotation * Vector3::z()).angle(&axis_W).to_degrees();
            let leans = table.entities[1..].iter().map(lean).fold(0.0, f64::max);
            let spins = table.manipulation.bodies().iter().map(|body| body.angular_velocity_W().norm());
            found.push((name, rate_hz, leans, leans_most, spins.fold(0.0, f64::max), turns_most));
        }
    }
    let is_told = |(_, _, leans, leans_most, turns, turns_most): &(_, _, f64, f64, f64, f64)| {
        leans < leans_most && turns < turns_most
    };
    assert!(found.iter().all(is_told), "{found:#?}");
}

/// One that lies in a hollow touches with both ends. Where a search tried the same of its many faces in each tick, the other end was
/// found when it was 13 to 30 mm deep, and a sheet was gone through.
#[test]
fn finely_cut_cans_that_lie_across_a_hollow_are_borne_at_both_ends() {
    let height = |x: f64, z: f64| 2.0 * (x * x + z * z);
    for (name, hollow) in
        [("sheet", meshes::terrain(64, 0.6, height)), ("block", meshes::block(64, 0.6, 0.1, height))]
    {
        let hollow = meshes::build(hollow);
        for (sides, rate_hz) in [(200, 1000.0), (200, 4000.0), (300, 1000.0), (300, 4000.0)] {
            let mesh = can(sides);
            let at = Isometry3::translation(0.0, 0.036, 0.0);
            let thing = object(mesh.clone(), at, 1000.0, 0.5).with_turning_friction(2e-4, 2e-4).unwrap();
            let mut table = Table::new(vec![(thing, 0.3)], settings(BY_MASS), rate_hz);
            table.entities[0] = object(hollow.clone(), Isometry3::identity(), 1000.0, 0.5);
            let deep_m = |table: &Table| {
                let deep_m = |at: &Vector3<f64>| {
                    let at_W = table.entities[1].X_WB * nalgebra::Point3::from(*at);
                    height(at_W.x, at_W.z) - at_W.y
                };
                mesh.vertices().iter().map(deep_m).fold(0.0, f64::max)
            };
            let mut deepest_m = 0.0_f64;
            for _ in 0..(0.5 * rate_hz) as u32 {
                table.run(table.dt_s);
                deepest_m = deepest_m.max(deep_m(&table));
            }
            // Nine ticks at 0.3 m/s.
            assert!(deepest_m < 2.7e-3, "{name} {sides} {rate_hz}: {deepest_m}");
            table.run(1.0);
            // Facets of 9.4 mm are 0.09 mm above their paraboloid.
            assert!(deep_m(&table) < 1.2e-4, "{name} {sides} {rate_hz}: {}", deep_m(&table));
        }
    }
}

/// As one sways, other corners of many bear it; on hard contacts it does not sway.
#[test]
fn round_meshes_that_are_put_down_stand_upright_and_rest_within_a_second() {
    for (sides, rate_hz) in [(8, 1000.0), (48, 500.0), (48, 1000.0), (48, 4000.0), (200, 1000.0)] {
        let mesh = can(sides);
        for lean in [0.0, 0.02, 0.1] {
            let up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean - FRAC_PI_2);
            let turn = up * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
            let at = Isometry3::from_parts(Vector3::new(0.0, 0.05, 0.0).into(), turn);
            let can = object(mesh.clone(), at, 1000.0, 0.5);
            let mut table = Table::new(vec![(can, 0.3)], settings(BY_MASS), rate_hz);
            table.run(1.0);
            let (body, axis) = (table.body(0), table.entities[1].X_WB.rotation * Vector3::z());
            let leans = axis.y.abs().min(1.0).acos();
            // It rests 3.3 um deep on three corners or more, 30 mm apart at least: by so much one may be deeper than another.
            assert!(leans < 3.3e-6 / 0.03, "{sides}, {rate_hz} Hz, {lean}: {leans} rad");
            assert!(body.velocity_W.norm() < 1e-6, "{sides}, {rate_hz} Hz, {lean}: {}", body.velocity_W);
        }
    }
}

/// Six stacks of six, a tenth of a millimetre apart, that lean on each other.
#[test]
fn a_dense_pile_is_solved_and_comes_to_rest() {
    // Where edges cross of two cubes that are turned by next to nothing, there had been four more
    // points, or none.
    let softer = ContactStiffness::Given { stiffness_n_per_m: 0.02 * 500.0_f64.powi(2), damping_ratio: 1.0 };
    // What is softer sways for longer: the slowest sway falls by e in 0.45 s at 500 rad/s.
    for (name, stiffness, seconds) in
        [("as felt", ContactStiffness::AsFelt, 1.0), ("500 rad/s", softer, 3.5), ("by mass", BY_MASS, 1.0)]
    {
        let places = (0..36).map(|n| [n / 12, n / 2 % 6, n % 2].map(f64::from));
        let things = places.map(|[x, y, z]| {
            let at = Isometry3::translation(0.0201 * x, 0.011 + 0.0205 * y, 0.0201 * z);
            (object(Cuboid::new([0.02; 3]).unwrap(), at, 1000.0, 0.5), 0.02)
        });
        let mut table = Table::new(things.collect(), settings(stiffness), 1000.0);
        // As they land, one tick or another may be unsolved.
        for _ in 0..500 {
            table.manipulation.step(&mut table.entities, &mut [], table.dt_s);
        }
        table.run(seconds);
        let speeds = table.manipulation.bodies().iter().map(|body| body.velocity_W.norm());
        let fastest = speeds.fold(0.0, f64::max);
        // A thousandth of what can be seen to move in a second.
        assert!(fastest < 1e-6, "{name}: {fastest}");
    }
}
