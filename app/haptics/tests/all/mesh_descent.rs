//! The walk over a mesh against a slow and obvious one, tick by tick.
#![allow(non_snake_case)]

use crate::{common, mesh_oracle};

use common::meshes::*;
use common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, make};
use mesh_oracle::descent::Descent;
use std::sync::Arc;

/// What came of comparing two god-objects on the same HIPs.
#[derive(Debug, Default)]
struct Compared {
    touching: usize,
    /// In another place, where a god-object may rest just as well.
    parted: usize,
}

/// Follows a roaming HIP with both.
fn compare(mesh: &Arc<Mesh>, seed: u64, ticks: usize, size: f64, step_m: f64) -> Compared {
    let mut roaming = Roaming::new(seed, size, step_m);
    let entity = touchable(mesh, Friction::None);
    let (mut finger, mut oracle) = (point_finger(), Descent::new(mesh));
    let mut compared = Compared::default();
    for tick in 0..ticks {
        let hip = roaming.next();
        let (fast, slow) = (step(&mut finger, &entity, &hip), oracle.step(&hip));
        assert_eq!(
            fast.entity.is_some(),
            slow.is_some(),
            "seed {seed}, tick {tick}, HIP {hip:?}: {fast:?}, {slow:?}"
        );
        let Some(slow) = slow else { continue };
        compared.touching += 1;
        // Where the distance is flat, a rounding of its square moves its minimum more than a position's.
        if (fast.god_object_W - slow).norm() > 1e-9 {
            let may_rest = oracle.is_at_rest(&fast.god_object_W, &hip);
            assert!(may_rest, "seed {seed}, tick {tick}, HIP {hip:?}: {fast:?}, {slow:?}");
            oracle.god_object = Some(fast.god_object_W);
            compared.parted += 1;
        }
    }
    compared
}

fn check_all(seeds: std::ops::Range<u64>) {
    let ball = built(make::uv_sphere(8, 4, 0.1));
    let bumpy = built(make::bumpy_sphere(12, 6, 0.1));
    for (name, mesh, size) in [
        ("cube", cube(), 0.06),
        ("plate", plate(), 0.06),
        ("wedge", built(wedge(10.0)), 0.05),
        ("blunt wedge", built(wedge(100.0)), 0.05),
        ("groove", built(wedge(260.0)), 0.08),
        ("star", star(), 0.06),
        ("ball", ball, 0.07),
        ("bumpy", bumpy, 0.07),
    ] {
        for seed in seeds.clone() {
            let compared = compare(&mesh, seed, 10_000, size, 1e-3);
            assert!(compared.touching > 200, "{name}: {compared:?}");
            // Over a convex edge two ways may lead downhill, and each takes one: deep in a ball now and then.
            let few = compared.touching / if matches!(name, "ball" | "bumpy") { 50 } else { 1000 };
            assert!(compared.parted <= few, "{name}: {compared:?}");
        }
    }
}

#[test]
fn on_small_meshes_the_walk_is_the_obvious_descent() {
    check_all(0..2);
}

/// `cargo test --release -p haptics --test all mesh_descent:: -- --ignored`
#[test]
#[ignore = "the long version, half a minute"]
fn on_small_meshes_the_walk_is_the_obvious_descent_for_four_million_ticks() {
    check_all(100..150);
}
