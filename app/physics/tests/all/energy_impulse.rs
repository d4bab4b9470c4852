//! Nothing that is left to itself gains energy where impulses answer: random balls and boxes on random planes and each other; and,
//! to rounding, bodies that turn evenly and are thrown at walls, into wedges, at chains and heaps of others.
//! More of these: `SEEDS=10000 cargo test --release -p physics --test all energy_impulse::`.
#![allow(non_snake_case)]

use crate::{common, noise, thrown};

use common::*;
use haptics::{Cuboid, Entity, Friction, Plane, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use noise::Noise;
use physics::collide::bounding_ball;
use physics::{Body, Response, Row, Settings};
use thrown::{KINDS, PLANES, Recipe, scene};

/// What a scene had when a tick began, and what the tick may make of it (J).
fn step(world: &mut World) -> [f64; 2] {
    let before: Vec<Body> = world.manipulation.bodies().to_vec();
    world.step(&[]);
    let (mut energy_j, mut allowed_j) = (0.0, 0.0);
    for body in &before {
        let kinetic_j = body.kinetic_energy_j();
        energy_j += kinetic_j + body.mass.mass_kg * G * body.centre_W.y;
        // The middle of a turn of h is wrong by h^3.
        let turn = body.angular_velocity_W().norm() * DT;
        allowed_j += kinetic_j * turn.powi(3) + 1e-13 * energy_j.abs();
    }
    for row in world.manipulation.rows() {
        energy_j += springs_j(row);
        allowed_j += allowed_for_j(row, world, &before);
    }
    [energy_j, allowed_j]
}

/// What its springs hold as the tick found them (J); impulses are none.
fn springs_j(row: &Row) -> f64 {
    let [along, across] = row.stiffness;
    let rest_n = row.normal_W.dot(&row.rest_W);
    let across_n = (row.rest_W - row.normal_W * rest_n).norm();
    let pressed_j = if along > 0.0 { rest_n.max(0.0).powi(2) / along } else { 0.0 };
    0.5 * (pressed_j + across_n.powi(2) / across)
}

/// An impulse stops velocities, not places: a point on an arm that turns is `omega^2 r dt^2` from where its velocity would have
/// it (half of it for the arc, as much again for what the velocity changes by), and its force works along that. What is too deep
/// is let out, against what presses.
fn allowed_for_j(row: &Row, world: &World, before: &[Body]) -> f64 {
    let arc_m = |body: usize| {
        let after = &world.manipulation.bodies()[body];
        let spin = before[body].angular_velocity_W().norm().max(after.angular_velocity_W().norm());
        let (_, size_m) = bounding_ball(&world.entities[body + PLANES].shape).unwrap();
        spin * spin * size_m * DT * DT
    };
    let arc_m = arc_m(row.body) + row.other.map_or(0.0, arc_m);
    let [along, across] = row.stiffness;
    let is_let_out = along == 0.0 && across < 1e4;
    let let_out_m_s =
        if is_let_out { (row.normal_W.dot(&row.rest_W) / row.damping[0]).max(0.0) } else { 0.0 };
    let weight_n = before[row.body].mass.mass_kg * G;
    2.0 * let_out_m_s * DT * row.force_W.norm()
        + arc_m * (row.force_W.norm() + weight_n)
        + 0.5 * across * arc_m * arc_m
}

/// How much energy a scene gained beyond that, as a share of all that it lost.
fn gained(seed: u64, response: Response, ticks: usize) -> f64 {
    let recipe = Recipe { kinds: &KINDS[..2], bodies: 3, is_deep: false, response, turning_m: 0.0 };
    let mut world = scene(seed, &recipe);
    let [first_j, mut allowed_j] = step(&mut world);
    let (mut was_j, mut least_j, mut gained_j) = (first_j, first_j, 0.0);
    for _ in 1..ticks {
        let [now_j, next_allowed_j] = step(&mut world);
        gained_j += (now_j - was_j - allowed_j).max(0.0);
        least_j = least_j.min(now_j);
        (was_j, allowed_j) = (now_j, next_allowed_j);
    }
    gained_j / (first_j - least_j)
}

#[test]
fn energy_never_grows_where_impulses_answer() {
    let (mut any, mut worst) = (0, 0.0_f64);
    let seeds = seeds_or(30);
    for seed in 0..seeds {
        for restitution in [0.0, 0.5, 1.0] {
            let gained = gained(seed, Response::Impulse { restitution }, 2000);
            any += usize::from(gained > 0.0);
            worst = worst.max(gained);
        }
    }
    assert!(any == 0, "{any} of {} runs, {worst:e}", 3 * seeds);
}

/// As many as whoever runs the tests wants, or so many.
fn seeds_or(usual: u64) -> u64 {
    std::env::var("SEEDS").ok().and_then(|seeds| seeds.parse().ok()).unwrap_or(usual)
}

/// Where something is thrown to in a weightless world.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Target {
    Wall,
    /// Two walls that meet at 40 to 120 degrees.
    Wedge,
    /// Two to four others in a row before a wall, which touch or nearly do.
    Chain,
    /// Others of any weight, one beside the other.
    Heap,
}

fn surface(shape: impl Into<Shape>, X_WB: Isometry3<f64>, noise: &mut Noise) -> Entity {
    let mu = if noise.chance(0.2) { 0.0 } else { noise.within(0.1, 1.5) };
    let entity = Entity::new(shape, X_WB, 1000.0).unwrap();
    entity.with_friction(Friction::coulomb(mu).unwrap()).unwrap()
}

/// Of the same inertia about all axes: such a body turns on by itself without any error, so that what it has is known to rounding.
fn even(noise: &mut Noise) -> (Shape, f64) {
    let size = noise.within(0.02, 0.05);
    if noise.chance(0.3) {
        return (Sphere::new(0.5 * size).unwrap().into(), 0.5 * size);
    }
    (Cuboid::new([size; 3]).unwrap().into(), 0.5 * size * 3.0_f64.sqrt())
}

/// Something that comes along -y, obliquely and spinning, to walls around the origin.
fn thrown_at(target: Target, seed: u64) -> World {
    let noise = &mut Noise::new(seed);
    let half_rad = match target {
        Target::Wedge => noise.within(0.35, 1.05),
        _ => std::f64::consts::FRAC_PI_2,
    };
    let mut entities = Vec::new();
    for side in [-1.0, 1.0] {
        let normal = Vector3::new(side * half_rad.cos(), half_rad.sin(), 0.0);
        entities.push(surface(Plane::new(normal, 0.0).unwrap(), Isometry3::identity(), noise));
    }
    let others = match target {
        Target::Wall | Target::Wedge => 0,
        Target::Chain | Target::Heap => 2 + noise.below(3),
    };
    let (mut bodies, mut y) = (Vec::new(), 0.0);
    for at in 0..=others {
        let (shape, radius) = even(noise);
        let gap = [1e-6, 1e-4, 0.01][noise.below(3)];
        let place = match target {
            Target::Heap if at < others => Vector3::new(0.09 * at as f64 - 0.1, radius + gap, 0.0),
            Target::Wedge => Vector3::new(0.0, radius / half_rad.sin() + gap, 0.0),
            _ => Vector3::new(noise.within(-0.003, 0.003), y + radius + gap, noise.within(-0.003, 0.003)),
        };
        y = if target == Target::Heap { 0.1 } else { y + 2.0 * radius + gap };
        let thing = surface(shape, Isometry3::from_parts(place.into(), noise.turn()), noise);
        let mass_kg = noise.log_within(0.01, 1.0);
        let mut state = body(&thing, mass_kg);
        if at == others {
            let velocity =
                Vector3::new(noise.within(-2.0, 2.0), -noise.within(0.5, 2.0), noise.within(-1.0, 1.0));
            state = state.moving(velocity, noise.vector(40.0));
        }
        bodies.push((entities.len(), state));
        entities.push(thing);
    }
    let restitution = noise.within(0.3, 1.0);
    let response = Response::Impulse { restitution };
    let settings = Settings { gravity_W: Vector3::zeros(), response, ..Settings::default() };
    World::new(entities, &bodies, settings, 0)
}

/// How much kinetic energy grows in a tick at most, as a share of what was there at first.
fn gained_by_impacts(target: Target, seed: u64) -> f64 {
    let mut world = thrown_at(target, seed);
    let kinetic_j =
        |world: &World| world.manipulation.bodies().iter().map(Body::kinetic_energy_j).sum::<f64>();
    let first_j = kinetic_j(&world);
    let (mut was_j, mut most_j) = (first_j, 0.0_f64);
    for _ in 0..60 {
        world.step(&[]);
        let now_j = kinetic_j(&world);
        most_j = most_j.max(now_j - was_j);
        was_j = now_j;
    }
    most_j / first_j
}

/// What a corner is deep by that came on an arm which turns, `omega^2 r dt^2` (some 10 um), is let out in a tenth of a second:
/// 3 of 24,000 gain 2e-6 to 5e-5 by that, all others nothing but roundings. Without its cut restitution gives up to 39, 20, 14 and
/// 3 % of all there is to 11, 15, 14 and 2 of the 400 that are thrown at walls, wedges, chains and heaps.
const NOTHING: f64 = 1e-4;

#[test]
fn no_impact_gives_energy_however_oblique_and_however_many_meet() {
    let seeds = seeds_or(400);
    for target in [Target::Wall, Target::Wedge, Target::Chain, Target::Heap] {
        for seed in 0..seeds {
            let gained = gained_by_impacts(target, seed);
            assert!(gained < NOTHING, "{target:?} {seed}: {gained:e}");
        }
    }
}
