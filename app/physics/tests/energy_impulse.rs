//! Nothing that is left to itself gains energy where impulses answer: random balls and boxes on random planes and each other.
#![allow(non_snake_case)]

mod common;
#[path = "common/meshes.rs"]
mod meshes;
#[path = "common/noise.rs"]
mod noise;
#[path = "common/thrown.rs"]
mod thrown;

use common::*;
use physics::collide::bounding_ball;
use physics::{Body, Response, Row};
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
    let recipe = Recipe { kinds: &KINDS[..2], bodies: 3, is_deep: false, response };
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
    for seed in 0..100 {
        for restitution in [0.0, 0.5, 1.0] {
            let gained = gained(seed, Response::Impulse { restitution }, 2000);
            any += usize::from(gained > 0.0);
            worst = worst.max(gained);
        }
    }
    assert!(any == 0, "{any} of 300 runs, {worst:e}");
}
