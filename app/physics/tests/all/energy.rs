//! Nothing that is left to itself gains energy: random bodies of all shapes on random planes and on each other.
//!
//! Measured in every tick: kinetic energy, gravity's, and that of the springs between entities, as their account has it and as
//! the rows press. What overlaps at first counts with all of its depth. Tolerances are those of turning in finite
//! steps and of rounding; see [`slack_j`].
//! Thousands of scenes: `cargo test --release -p physics --test all energy:: -- --ignored` (some minutes).
#![allow(non_snake_case)]

use crate::{common, thrown};

use common::*;
use haptics::Cuboid;
use nalgebra::{Isometry3, Vector3};
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points};
use physics::{Body, Contacts, Response, Row, Settings, Standing, Surfacing};
use thrown::{KINDS, PLANES, Recipe, scene};

/// Kinetic energy and gravity's (J).
fn of_bodies_j(world: &World) -> f64 {
    let of = |body: &Body| body.kinetic_energy_j() + body.mass.mass_kg * G * body.centre_W.y;
    world.manipulation.bodies().iter().map(of).sum()
}

/// How much may be made in a tick (J): the middle of a turn of h is wrong by h^3; and the roundings of some hundred operations.
fn slack_j(world: &World) -> f64 {
    let of = |body: &Body| {
        let turn = body.angular_velocity_W().norm() * DT;
        let kinetic_j = body.kinetic_energy_j();
        let potential_j = body.mass.mass_kg * G * body.centre_W.norm();
        kinetic_j * turn.powi(3) + 1e-13 * (kinetic_j + potential_j + world.manipulation.elastic_energy_j())
    };
    world.manipulation.bodies().iter().map(of).sum()
}

/// What the springs held that pressed in the last tick, when it began (J).
fn pressing_j(rows: &[Row]) -> f64 {
    let of = |row: &Row| {
        let [along, across] = row.stiffness;
        let rest_n = row.normal_W.dot(&row.rest_W);
        let across_n = (row.rest_W - row.normal_W * rest_n).norm();
        // Impulses are no springs, and what does not touch yet holds nothing.
        let pressed_j = if along > 0.0 { rest_n.max(0.0).powi(2) / along } else { 0.0 };
        0.5 * (pressed_j + across_n.powi(2) / across)
    };
    rows.iter().map(of).sum()
}

/// What springs between all that overlaps would hold at their full length (J). Which points a mesh stands on depends on how far it
/// may move in the tick: they are asked for from there on.
fn overlap_j(world: &World) -> f64 {
    let solid = |at: usize| Solid { shape: &world.entities[at].shape, X_W: &world.entities[at].X_WB };
    let fastest = |at: usize| {
        let Some(body) = at.checked_sub(PLANES).map(|body| &world.manipulation.bodies()[body]) else {
            return 0.0;
        };
        let (centre_B, radius_m) = bounding_ball(&world.entities[at].shape).unwrap();
        let falling_W = body.velocity_W - Vector3::y() * (G * DT);
        let farthest_m = radius_m + (centre_B - body.mass.centre_B).norm();
        falling_W.norm() + body.angular_velocity_W().norm() * farthest_m
    };
    let mut all_j = 0.0;
    for a in PLANES..world.entities.len() {
        for b in (0..PLANES).chain(a + 1..world.entities.len()) {
            let reach_m = 1e-3 + (fastest(a) + fastest(b)) * DT;
            let surfacing = Surfacing::between(&world.entities[a], &world.entities[b], &Contacts::default());
            let mut found = ContactPoints::default();
            let mut memory = PairMemory { is_soft: true, ..PairMemory::default() };
            contact_points(solid(a), solid(b), reach_m, &mut memory, &mut found);
            let squares: f64 = found.as_slice().iter().map(|p| p.share * p.depth_m().powi(2)).sum();
            all_j += 0.5 * surfacing.stiffness_n_per_m * squares;
        }
    }
    all_j
}

/// Steps, and panics in the first tick in which energy grows.
fn assert_never_grows(seed: u64, recipe: &Recipe, ticks: usize) {
    assert_never_grows_after(seed, recipe, ticks, |_, _| ());
}

/// The same, with this done before each tick.
fn assert_never_grows_after(
    seed: u64,
    recipe: &Recipe,
    ticks: usize,
    mut before: impl FnMut(&mut World, usize),
) {
    let mut world = scene(seed, recipe);
    let mut was_j = of_bodies_j(&world) + overlap_j(&world);
    for tick in 0..ticks {
        let slack = slack_j(&world);
        let held: Vec<_> = world.manipulation.springs().map(|(pair, held_j, _)| (pair, held_j)).collect();
        before(&mut world, tick);
        world.step(&[]);
        let is_stepped = |entity: &usize| {
            let body = world.manipulation.body_of(*entity);
            body.is_some_and(|body| world.manipulation.standing(body) == Standing::Awake)
        };
        // Who waits has rows of another tick.
        let pressed =
            |(pair, _, rows): &([usize; 2], f64, &[Row])| !rows.is_empty() && pair.iter().any(is_stepped);
        for (pair, _, rows) in world.manipulation.springs().filter(pressed) {
            // What one pair owes is no other one's: it presses with nothing, the others with what is theirs.
            let known = held.iter().find(|(known, _)| *known == pair);
            let (held_j, pressing_j) = (known.map_or(0.0, |known| known.1.max(0.0)), pressing_j(rows));
            // In the first tick there is no account yet.
            assert!(
                tick == 0 || pressing_j <= held_j + slack,
                "{recipe:?} {seed}, tick {tick}, {pair:?}: {pressing_j} J press of {held_j} J"
            );
        }
        let now_j = of_bodies_j(&world) + world.manipulation.elastic_energy_j();
        let grown_j = now_j - was_j - slack.max(slack_j(&world));
        assert!(grown_j <= 0.0, "{recipe:?} {seed}, tick {tick}: {was_j} J, then {now_j} J: {grown_j}");
        was_j = now_j;
    }
}

/// Each kind alone, then all together.
fn throw_all(scenes: u64, ticks: usize) {
    for seed in 0..scenes {
        for is_deep in [false, true] {
            for kind in 0..KINDS.len() {
                let kinds = &KINDS[kind..=kind];
                let alone = Recipe { kinds, bodies: 1, is_deep, response: Response::Force, turning_m: 0.0 };
                assert_never_grows(seed, &alone, ticks);
            }
            let together =
                Recipe { kinds: &KINDS, bodies: 3, is_deep, response: Response::Force, turning_m: 0.0 };
            assert_never_grows(seed, &together, ticks);
        }
    }
}

#[test]
fn energy_never_grows_where_springs_answer() {
    throw_all(15, 1500);
}

/// Bodies that wait are fixed meanwhile, and go on as they were: near a place that moves, or all in turns.
#[test]
fn energy_never_grows_where_not_all_are_stepped_in_a_tick() {
    let (kinds, response) = (&KINDS[..], Response::Force);
    let recipe = Recipe { kinds, bodies: 3, is_deep: false, response, turning_m: 0.0 };
    let mut waited = 0;
    for seed in 0..6 {
        for most in [1, 3, 7] {
            assert_never_grows_after(seed, &recipe, 3000, |world, tick| {
                let near_W = Vector3::new(0.1 * (0.01 * tick as f64).sin(), 0.0, 0.0);
                world.manipulation.step_at_most(most, (seed % 2 == 0).then_some(near_W).into_iter());
                waited += world.made.held;
            });
        }
    }
    assert!(waited > 10_000, "{waited}");
}

/// Springs of turning have their energy in the account.
#[test]
fn energy_never_grows_where_contacts_resist_turning() {
    for seed in 0..8 {
        for turning_m in [1e-5, 1e-3, 0.03] {
            for kind in 0..=KINDS.len() {
                let all = kind == KINDS.len();
                let (kinds, bodies) = if all { (&KINDS[..], 3) } else { (&KINDS[kind..=kind], 1) };
                let recipe = |response| Recipe { kinds, bodies, is_deep: seed % 2 == 1, response, turning_m };
                assert_never_grows(seed, &recipe(Response::Force), 1500);
                assert_grows_by_no_impulse(seed, &recipe(Response::Bounce { restitution: 0.0 }), 1500);
            }
        }
    }
}

#[test]
#[ignore = "some minutes; see the top of the file"]
fn energy_never_grows_in_thousands_of_scenes() {
    throw_all(250, 4000);
}

/// A light mesh on the tube of a heavy ring (141), a ring through a cone (153): where they touch was not found for some ticks.
/// A pair that owes beside one that presses (90, 161).
#[test]
fn what_is_found_late_or_beside_a_debt_gains_nothing_either() {
    for (seed, kind, is_deep) in
        [(141, None, false), (153, None, true), (90, Some(9), true), (161, Some(7), true)]
    {
        let kinds = kind.map_or(&KINDS[..], |kind: usize| &KINDS[kind..=kind]);
        let bodies = if kind.is_some() { 1 } else { 3 };
        assert_never_grows(
            seed,
            &Recipe { kinds, bodies, is_deep, response: Response::Force, turning_m: 0.0 },
            4000,
        );
    }
}

/// A corner comes up deep inside another box when the upper one slides over the lower one's edge, without friction that would
/// pay for it.
#[test]
fn a_corner_that_comes_up_deep_presses_with_no_more_than_was_worked_for() {
    let [lower, upper] = [0.0, 0.0385].map(|y| {
        let at = Isometry3::translation(if y > 0.0 { 0.024 } else { 0.0 }, y, 0.004);
        object(Cuboid::new([0.04, 0.04, 0.04]).unwrap(), at, 1000.0, 0.0).with_damping(0.0).unwrap()
    });
    let state = body(&upper, 0.3).moving(Vector3::new(-0.3, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0));
    let mut world = World::new(vec![lower, upper], &[(1, state)], Settings::default(), 0);
    world.step(&[]);
    let mut was_j = of_bodies_j(&world) + world.manipulation.elastic_energy_j();
    let (mut least, mut most) = (usize::MAX, 0);
    for _ in 0..150 {
        let pressed = world.manipulation.rows().iter().filter(|row| row.force_W.norm() > 0.0).count();
        (least, most) = (least.min(pressed), most.max(pressed));
        world.step(&[]);
        let now_j = of_bodies_j(&world) + world.manipulation.elastic_energy_j();
        assert!(now_j <= was_j + slack_j(&world), "{was_j} J, then {now_j} J");
        was_j = now_j;
    }
    assert!(least < most, "corners come and go: {least} to {most}");
}

/// 10 kg that are put as deep into the floor as they will stand are let out of it slowly, and so fall at first. What damps
/// that must not be taken from what they stood on.
#[test]
fn what_was_placed_deep_comes_to_rest_on_all_of_its_depth() {
    let (mass, stiffness) = (10.0, 5000.0);
    let sunk = mass * G / (4.0 * stiffness / 2.0);
    let pose = Isometry3::translation(0.0, 0.025 - sunk, 0.0);
    let cube = object(Cuboid::new([0.05; 3]).unwrap(), pose, stiffness, 0.5).with_damping(20.0).unwrap();
    let state = body(&cube, mass);
    let mut world = World::new(vec![floor(0.0, stiffness, 0.5), cube], &[(1, state)], Settings::default(), 0);
    (0..20_000).for_each(|_| drop(world.step(&[])));
    // Swinging with 80 N s/m on 10 kg falls by e in 0.25 s: rounding is what is left after 20 s.
    let off = world.body().centre_W.y - (0.025 - sunk);
    assert!(off.abs() < 1e-9, "{off}");
}

/// The like where what meets is reflected.
fn assert_grows_by_no_impulse(seed: u64, recipe: &Recipe, ticks: usize) {
    let mut world = scene(seed, recipe);
    world.step(&[]);
    // What comes down in a tick to leave in the next has less in between.
    let mut last_j = [of_bodies_j(&world) + world.manipulation.elastic_energy_j(); 3];
    for tick in 0..ticks {
        let slack = slack_j(&world);
        world.step(&[]);
        let now_j = of_bodies_j(&world) + world.manipulation.elastic_energy_j();
        let was_j = last_j.into_iter().fold(f64::MIN, f64::max);
        // What is stopped a million times harder than it moves stops a millionth of a way off.
        let allowed_j = 1e-6 * was_j.abs();
        let grown_j = now_j - was_j - slack.max(slack_j(&world)) - allowed_j;
        assert!(grown_j <= 0.0, "{recipe:?} {seed}, tick {tick}: {last_j:?} J, then {now_j} J: {grown_j}");
        last_j = [last_j[1], last_j[2], now_j];
    }
}

/// Impulses reflect what meets; what they give where arms turn is owed.
#[test]
fn energy_never_grows_where_springs_let_go_what_meets() {
    for restitution in [0.0, 0.6, 1.0] {
        for seed in 0..10 {
            for kind in 0..=KINDS.len() {
                let all = kind == KINDS.len();
                let (kinds, bodies) = if all { (&KINDS[..], 3) } else { (&KINDS[kind..=kind], 1) };
                let response = Response::Bounce { restitution };
                let recipe = Recipe { kinds, bodies, is_deep: seed % 2 == 1, response, turning_m: 0.0 };
                assert_grows_by_no_impulse(seed, &recipe, 1500);
            }
        }
    }
}
