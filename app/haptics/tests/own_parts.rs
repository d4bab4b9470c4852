//! Somebody's own shape, friction law and contact algorithm, those of `examples/own_parts.rs`, through a finger.
#![allow(non_snake_case)]

mod common;
#[path = "../examples/own_parts.rs"]
#[allow(dead_code)]
mod example;

use common::meshes::*;
use common::*;
use example::{Ageing, EggCarton, Honey, drag};
use haptics::{Algorithm, ContactState, Friction, Shape, Sphere};
use nalgebra::Vector3;

#[test]
fn the_example_runs() {
    example::main().unwrap();
}

#[test]
fn on_an_own_shape_the_frictionless_god_object_is_the_nearest_point_nearby() {
    let (height_m, period_m) = (2e-3, 0.03);
    let carton = entity(Shape::own(EggCarton { height_m, period_m }), Friction::None);
    let height = |x: f64, z: f64| {
        let per_m = std::f64::consts::TAU / period_m;
        height_m * (x * per_m).sin() * (z * per_m).cos()
    };
    for (tick, hip, out) in drag(&carton).unwrap() {
        assert_eq!(out.entity.is_some(), hip.y <= height(hip.x, hip.z), "tick {tick}");
        if out.entity.is_none() {
            continue;
        }
        let god = out.god_object_W;
        assert!((god.y - height(god.x, god.z)).abs() < 1e-15, "on the surface");
        let distance = |x: f64, z: f64| (Vector3::new(x, height(x, z), z) - hip).norm();
        let here = distance(god.x, god.z);
        // Steps of 10 um; the gap at rest is below 1e-12 of the depth.
        for (dx, dz) in [(1e-5, 0.0), (-1e-5, 0.0), (0.0, 1e-5), (0.0, -1e-5)] {
            assert!(distance(god.x + dx, god.z + dz) > here - 1e-12, "tick {tick}: {hip:?}, {out:?}");
        }
    }
}

#[test]
fn an_own_law_remembers_how_long_it_has_been_touched() {
    let (mu_fresh, mu_aged) = (0.2, 0.8);
    let law = Friction::own(Ageing { mu_fresh, mu_aged, ageing_s: 0.05 });
    let felt = drag(&table(law)).unwrap();
    let ratio_of = |out: &haptics::FingerOutput| out.force_on_user_W.x.abs() / out.force_on_user_W.y;
    let (most, rest) = felt
        .iter()
        .filter(|(_, _, out)| out.entity.is_some())
        .fold((0.0_f64, 0.0), |(most, _), tick| (most.max(ratio_of(&tick.2)), ratio_of(&tick.2)));
    // 0.17 s of rest and more until it breaks away: all but e^-3.4 of the way from fresh to aged.
    assert!(most > 0.75 && most < mu_aged, "{most}");
    // Sliding, it is fresh in every tick: the ratio is asked for to 12 digits.
    assert!((rest - mu_fresh).abs() < 1e-11, "{rest}");
    assert_eq!(felt.last().unwrap().2.friction, ContactState::Slip);
}

#[test]
fn an_own_algorithm_renders_every_kind_of_shape_and_begins_anew_with_each_contact() {
    let honey = || Algorithm::own(Honey { time_constant_s: 0.02 });
    let ball = entity(Sphere::new(0.1).unwrap(), Friction::None).with_algorithm(honey());
    let mesh = touchable(&uv_sphere(316), Friction::None).with_algorithm(honey());
    for (name, entity) in [("closed form", ball), ("mesh", mesh)] {
        let mut finger = point_finger();
        let mut at = |x: f64, y: f64| step(&mut finger, &entity, &Vector3::new(x, y, 0.003));
        at(0.0, 0.12);
        // Straight down on the first touch: nothing lags yet. A fine mesh's facets are tilted by a hundredth.
        let first = at(0.0, 0.095);
        assert!(first.force_on_user_W.x.abs() < 0.02 * first.force_on_user_W.y, "{name}: {first:?}");
        // Sideways at 0.1 m/s the nearest point leads the HIP by 0.5 mm after 10 mm, and the god-object lags 2.1 mm
        // behind that point, which is its speed times the time constant: -0.8 N, on facets tilted by a hundredth.
        let lagging = (0..200).map(|i| at(1e-4 * f64::from(i), 0.095)).nth(99).unwrap();
        assert!((lagging.force_on_user_W.x + 0.8).abs() < 0.1, "{name}: {lagging:?}");
        // Away and back somewhere else: the old place is forgotten.
        at(0.0, 0.12);
        let again = at(-0.01, 0.095);
        assert!(again.god_object_W.x < -0.009, "{name}: {again:?}");
    }
}
