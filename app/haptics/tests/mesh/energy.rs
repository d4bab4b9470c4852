//! Closed frictionless loops: what a finger is given, a finger has paid.
//!
//! A force that is held for a tick while the HIP moves on by `x` does the work `F . x`, where the potential
//! `U = k |G - H|^2 / 2` falls by `F . x - x . U'' x / 2`. So a loop gives the user half of `x . U'' x` per tick, and
//! no more than `k |x|^2 / 2`, since no distance from a surface curves faster than that from a point. This is what
//! the zero-order hold explains. Crossing a convex edge the god-object finds a nearer place and the spring relaxes:
//! that is lost to the user, never given.

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::Mesh;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Work on the user over a closed loop that began and ended at rest there, and the hold's share of it at most \[J\].
struct Work {
    on_user_j: f64,
    of_hold_j: f64,
    /// How much the spring can have lost at edges: what it held on average, for scale.
    held_j: f64,
}

fn around(mesh: &Arc<Mesh>, hips: &[Vector3<f64>]) -> Work {
    let entity = touchable(mesh, Friction::None);
    let mut finger = point_finger();
    // Once round to get there, from outside.
    step(&mut finger, &entity, &(hips[0] * 3.0));
    hips.iter().for_each(|hip| {
        step(&mut finger, &entity, hip);
    });
    let mut work = Work { on_user_j: 0.0, of_hold_j: 0.0, held_j: 0.0 };
    for (i, hip) in hips.iter().enumerate() {
        let out = step(&mut finger, &entity, hip);
        assert!(out.entity.is_some(), "{hip:?}");
        let moves = hips[(i + 1) % hips.len()] - hip;
        work.on_user_j += out.force_on_user_W.dot(&moves);
        work.of_hold_j += 0.5 * K * moves.norm_squared();
        work.held_j += out.force_on_user_W.norm_squared() / (2.0 * K * hips.len() as f64);
    }
    work
}

/// A loop around a place under a surface, tilted so that it goes in and out, too.
fn ring(middle: Vector3<f64>, radius: f64, noise: &mut Noise, ticks: usize) -> Vec<Vector3<f64>> {
    let (a, b) = (unit_vector(noise), unit_vector(noise));
    let at = |i: usize| TAU * i as f64 / ticks as f64;
    (0..ticks).map(|i| middle + (a * at(i).cos() + b * (2.0 * at(i)).sin()) * radius).collect()
}

#[test]
fn on_flat_sides_and_concave_edges_a_loop_gives_what_the_hold_explains_and_no_more() {
    let mut noise = Noise(8);
    for (name, mesh, middle) in [
        ("flat side", cube(), Vector3::new(0.01, 0.04, -0.02)),
        ("concave edge", built(wedge(270.0)), Vector3::new(0.0, -0.01, 0.0)),
        ("sharp concave edge", built(wedge(330.0)), Vector3::new(0.0, -0.01, 0.0)),
    ] {
        for _ in 0..50 {
            let work = around(&mesh, &ring(middle, 5e-3, &mut noise, 500));
            let (given, hold) = (work.on_user_j, work.of_hold_j);
            // Roundings of a sum of 500 terms of some mJ.
            assert!((-1e-14..=hold + 1e-14).contains(&given), "{name}: {given} J, of the hold {hold} J");
        }
    }
}

#[test]
fn on_round_meshes_no_loop_gives_more_than_the_hold_explains() {
    let mut noise = Noise(9);
    for (name, mesh, most_lost) in [
        ("coarse ball", uv_sphere(32), 0.5),
        ("fine ball", uv_sphere(316), 0.05),
        ("bumpy ball", bumpy_sphere(316), 0.5),
    ] {
        for _ in 0..20 {
            let middle = unit_vector(&mut noise) * 0.09;
            let work = around(&mesh, &ring(middle, 3e-3, &mut noise, 500));
            let (given, hold) = (work.on_user_j, work.of_hold_j);
            assert!(given <= hold + 1e-14, "{name}: {given} J given, of the hold {hold} J");
            // Lost at the edges is a small part of what the spring holds; on a ball the hold takes, too.
            assert!(given >= -hold - most_lost * work.held_j, "{name}: {given} J, held {} J", work.held_j);
        }
    }
}

#[test]
fn the_finer_the_ticks_the_less_a_loop_gives() {
    let mesh = built(wedge(270.0));
    let given = |ticks| {
        let mut noise = Noise(10);
        around(&mesh, &ring(Vector3::new(0.0, -0.01, 0.0), 5e-3, &mut noise, ticks)).on_user_j
    };
    let (coarse, fine) = (given(500), given(5000));
    // Ten times the ticks of a tenth of the length: a tenth, but for where within a tick edges are crossed.
    assert!((coarse / fine - 10.0).abs() < 0.5, "{coarse} J, {fine} J");
}
