//! What passivity costs: by how much forces are changed, on material that is passive and on sources that are not.
//!
//! `cargo test --release -p haptics --test all passivity_fidelity:: -- --nocapture` prints the table.
#![allow(non_snake_case)]

use crate::{common, sources};

use common::*;
use haptics::mesh::{Mesh, make};
use haptics::passivity::{Passivity, PassivitySpec, Port, Springs};
use haptics::{Csg, CsgPart, CsgTree, Cuboid, Entity, Finger, Friction, Plane, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use sources::Source;
use std::f64::consts::TAU;
use std::sync::Arc;

const RATES_HZ: [f64; 3] = [500.0, 1000.0, 4000.0];
const SECONDS: f64 = 20.0;
/// Where a finger is (m), by time (s).
type Path<'a> = &'a dyn Fn(f64) -> Vector3<f64>;
/// Positions come in steps of a Premium's counts (m).
const COUNT_M: f64 = 3e-5;

/// What became of a run of twenty seconds.
#[derive(Debug, Default)]
struct Cost {
    /// Of the wanted force, and of its change (N).
    wanted_rms: f64,
    changed_rms: f64,
    changed_most: f64,
    /// Fed by the wanted force, and by the rendered one (J).
    wanted_j: f64,
    rendered_j: f64,
    /// The most that either ever had fed (J).
    wanted_most_j: f64,
    rendered_most_j: f64,
    ticks: usize,
    changed_ticks: usize,
}

/// Runs a source along a path twice: seen only, and kept passive.
fn cost(dt: f64, source: &mut Source, path: Path<'_>) -> Cost {
    let port = |x, k| {
        let (wanted, stored) = source(&x, k);
        Port::new(x, wanted, dt).storing(stored)
    };
    cost_of(dt, port, path)
}

/// The same of what is told at the port.
fn cost_of(dt: f64, mut port: impl FnMut(Vector3<f64>, usize) -> Port, path: Path<'_>) -> Cost {
    let usual = PassivitySpec::usual(dt);
    let mut seen = Passivity::new(PassivitySpec { bound_j: 1e9, ..usual }, dt).unwrap();
    let mut kept = Passivity::new(usual, dt).unwrap();
    let mut cost = Cost { ticks: (SECONDS / dt) as usize, ..Cost::default() };
    for k in 0..cost.ticks {
        let x = path(k as f64 * dt).map(|x| (x / COUNT_M).round() * COUNT_M);
        let port = port(x, k);
        let wanted = port.force_on_user_W;
        cost.wanted_j = seen.step(&port).energy_j;
        let out = kept.step(&port);
        cost.rendered_j = out.energy_j;
        cost.wanted_rms += wanted.norm_squared();
        cost.changed_rms += out.changed_n * out.changed_n;
        cost.changed_most = cost.changed_most.max(out.changed_n);
        cost.changed_ticks += usize::from(out.force_on_user_W != wanted);
        cost.wanted_most_j = cost.wanted_most_j.max(cost.wanted_j);
        cost.rendered_most_j = cost.rendered_most_j.max(cost.rendered_j);
    }
    cost.wanted_rms = (cost.wanted_rms / cost.ticks as f64).sqrt();
    cost.changed_rms = (cost.changed_rms / cost.ticks as f64).sqrt();
    cost
}

/// Entities, as a finger of this radius (m) feels them.
fn felt(radius_m: f64, entities: Vec<Entity>, dt: f64) -> impl FnMut(Vector3<f64>, usize) -> Port {
    let mut finger = Finger::new(radius_m, entities.len()).unwrap();
    let mut springs = Springs::new(entities.len());
    move |x, _| {
        let force = finger.step(&entities, &x, dt).force_on_user_W;
        let (stored_j, pressing) = springs.of(&finger, 1.0, &x);
        Port { pressing, ..Port::new(x, force, dt).storing(stored_j) }
    }
}

fn made(normal: Vector3<f64>, k: f64, b: f64, friction: Friction) -> Entity {
    let entity = Entity::new(Plane::new(normal, 0.0).unwrap(), Isometry3::identity(), k).unwrap();
    entity.with_damping(b).unwrap().with_friction(friction).unwrap()
}

/// Twice a second from 2 mm above to 5 mm below, while it goes 20 mm to and fro.
fn pressing_and_sliding(t: f64) -> Vector3<f64> {
    let y = 0.002 - 0.007 * (0.5 - 0.5 * (2.0 * TAU * t).cos());
    Vector3::new(0.02 * (3.0 * t).sin(), y, 0.01 * (1.3 * t).sin())
}

/// Round the y axis, 2 mm below.
fn circling(t: f64) -> Vector3<f64> {
    Vector3::new(0.01 * (TAU * t).cos(), -0.002, 0.01 * (TAU * t).sin())
}

/// Deep on the way to the right, not so on the way back.
fn rubbing(t: f64) -> Vector3<f64> {
    Vector3::new(0.01 * (TAU * t).cos(), -0.003 + 0.002 * (TAU * t).sin(), 0.0)
}

/// The same at 0.25 m/s, round the z axis.
fn circling_fast(t: f64) -> Vector3<f64> {
    Vector3::new(0.02 * (2.0 * TAU * t).cos(), 0.02 * (2.0 * TAU * t).sin(), 0.0)
}

fn told(rate: f64, name: &str, cost: &Cost) {
    println!(
        "{rate:>5.0} Hz  {name:<34} wanted {:6.3} N rms, changed {:6.3} N rms, {:6.3} N at most, in {:5.1} % of ticks; \
         fed {:8.2} mJ (most {:8.2}), kept {:7.2} mJ (most {:5.2})",
        cost.wanted_rms,
        cost.changed_rms,
        cost.changed_most,
        100.0 * cost.changed_ticks as f64 / cost.ticks as f64,
        1e3 * cost.wanted_j,
        1e3 * cost.wanted_most_j,
        1e3 * cost.rendered_j,
        1e3 * cost.rendered_most_j,
    );
}

#[test]
fn passive_contacts_with_and_without_friction_cost_nothing() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        // What pays for sampling, once more than that: Colgate's condition with half of it in the wall.
        let damped = |k: f64, friction| made(Vector3::y(), k, k * dt, friction);
        let bare = |k: f64, friction| made(Vector3::y(), k, 0.0, friction);
        let cases: Vec<(&str, Vec<Entity>)> = vec![
            ("damped, 1 N/mm", vec![damped(1000.0, Friction::None)]),
            ("damped, 2 N/mm", vec![damped(2000.0, Friction::None)]),
            ("no damping, 0.5 N/mm", vec![bare(500.0, Friction::None)]),
            ("Coulomb, 1 N/mm", vec![bare(1000.0, Friction::coulomb(0.5).unwrap())]),
            ("stiction, 1 N/mm", vec![bare(1000.0, stiction())]),
            ("viscous, 1 N/mm", vec![bare(1000.0, Friction::viscous(5.0).unwrap())]),
        ];
        for (name, entities) in cases {
            let cost = cost_of(dt, felt(0.0, entities, dt), &pressing_and_sliding);
            told(rate, name, &cost);
            assert!(cost.wanted_rms > 0.5, "it was felt");
            assert_eq!((cost.changed_ticks, cost.changed_most), (0, 0.0), "{name} at {rate} Hz");
        }
    }
}

/// In a bowl, over a hill and across facets friction drags the god-object behind where the normal turns: what the normal
/// force then gives back friction has taken, and it is not taken for activity.
#[test]
fn rough_bowls_hills_and_facets_cost_nothing() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        let rough = |shape: Shape, k: f64| {
            let entity = Entity::new(shape, Isometry3::identity(), k).unwrap();
            let entity = entity.with_damping(k * dt).unwrap();
            vec![entity.with_friction(Friction::coulomb(0.8).unwrap()).unwrap()]
        };
        let bowl = || {
            let ball = CsgPart::new(Sphere::new(0.04).unwrap(), Isometry3::identity());
            let block = CsgPart::new(Cuboid::new([0.2; 3]).unwrap(), Isometry3::identity());
            Shape::from(Arc::new(Csg::build(&CsgTree::difference([block, ball])).unwrap()))
        };
        let facets = || {
            let (mesh, _) = Mesh::build(make::uv_sphere(24, 13, 0.04)).unwrap();
            Shape::from(Arc::new(mesh))
        };
        let hill = || Shape::from(Sphere::new(0.04).unwrap());
        // Round and round, 3 mm deep, and deeper and shallower.
        let round = |t: f64, r: f64| {
            let r = r + 0.002 * (1.7 * TAU * t).sin();
            Vector3::new(r * (TAU * 0.5 * t).cos(), r * (TAU * 0.5 * t).sin(), 0.004 * (0.7 * t).sin())
        };
        let inside = |t: f64| round(t, 0.043 - 0.013 * (1.0 - t).max(0.0));
        let outside = |t: f64| round(t, 0.037 + 0.013 * (1.0 - t).max(0.0));
        for (name, shape, k, path) in [
            ("a rough bowl, 1 N/mm", bowl(), 1000.0, &inside as Path<'_>),
            ("a rough hill, 1 N/mm", hill(), 1000.0, &outside),
            ("rough facets, 1 N/mm", facets(), 1000.0, &outside),
            ("a rough bowl, 2 N/mm", bowl(), 2000.0, &inside),
        ] {
            let cost = cost_of(dt, felt(0.0, rough(shape, k), dt), path);
            told(rate, name, &cost);
            assert!(cost.wanted_rms > 1.0, "it was felt: {}", cost.wanted_rms);
            if (k, rate) == (2000.0, 4000.0) {
                // Rounding alone gives more than is paid for: a smooth bowl is cut at this rate, too.
                assert!(cost.changed_rms < 0.07 * cost.wanted_rms, "{name} at {rate} Hz: {cost:?}");
                continue;
            }
            assert_eq!((cost.changed_ticks, cost.changed_most), (0, 0.0), "{name} at {rate} Hz");
        }
    }
}

/// Without friction it costs a tenth of a newton at 4 kHz, too: what rounding gives back where it is 20 mm deep.
#[test]
fn a_deep_rough_corner_costs_hardly_more_than_a_smooth_one() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        let wall = |normal| made(normal, 1000.0, 1000.0 * dt, Friction::coulomb(0.3).unwrap());
        let entities = vec![wall(Vector3::y()), wall(Vector3::x())];
        let cost = cost_of(dt, felt(0.0, entities, dt), &pressing_and_sliding);
        told(rate, "a corner, Coulomb, damped, 1 N/mm", &cost);
        assert!(cost.changed_rms < 1e-3 * cost.wanted_rms && cost.changed_most < 0.3, "{rate} Hz: {cost:?}");
        assert!(rate > 1000.0 || cost.changed_ticks == 0);
    }
}

#[test]
fn what_is_active_is_kept_to_its_bound_and_the_rest_is_left() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        let late = (3e-3 / dt) as usize;
        let spec = PassivitySpec::usual(dt);
        let cases: [(&str, Source, Path); 5] = [
            ("no damping, 4 N/mm", sources::wall(4000.0), &pressing_and_sliding),
            ("3 ms late, 1 N/mm", sources::late_wall(1000.0, late), &pressing_and_sliding),
            ("turns in a circle", sources::whirl(100.0), &|t| circling(-t)),
            ("leans by 0.3 rad, 1 N/mm", sources::leaning_wall(1000.0, 0.3), &rubbing),
            ("negative friction, 1 N", sources::chase(1.0), &circling_fast),
        ];
        for (name, mut source, path) in cases {
            let cost = cost(dt, &mut source, path);
            told(rate, name, &cost);
            // No way is longer than 0.26 m/s.
            let paid_j = SECONDS * (spec.recovery_w + spec.device_friction_n * 0.26);
            assert!(cost.rendered_most_j <= spec.bound_j + paid_j, "{name} at {rate} Hz");
            assert!(
                cost.changed_rms > 0.0 && cost.changed_most <= 20.0 * (1.0 + 1e-12),
                "{name} at {rate} Hz"
            );
        }
    }
}

#[test]
fn brakes_and_shaded_facets_are_left() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        // Force against the turn is a brake. What a facet gives on one half it takes on the other, and that is less than
        // what the spring holds meanwhile.
        let cases: [(&str, Source, Path); 2] = [
            ("turns against the finger", sources::whirl(100.0), &circling),
            ("shaded facets of 4 mm, 1 N/mm", sources::shaded_wall(1000.0, 0.2, 4e-3), &pressing_and_sliding),
        ];
        for (name, mut source, path) in cases {
            let cost = cost(dt, &mut source, path);
            told(rate, name, &cost);
            assert_eq!(cost.changed_ticks, 0, "{name} at {rate} Hz: {cost:?}");
        }
    }
}

/// The price of forgetting credit: over a whole turn this wall takes energy, but on half of it, it pushes the finger
/// along by more than a spring could have stored, which for all that is known here is no different from an engine.
#[test]
fn a_force_that_gives_back_later_than_a_spring_would_is_taken_for_active() {
    for rate in RATES_HZ {
        let mut source = sources::leaning_wall(1000.0, 0.3);
        let cost = cost(1.0 / rate, &mut source, &|t| rubbing(-t));
        told(rate, "leans, rubbed the other way", &cost);
        assert!(cost.wanted_j < 0.0, "it takes");
        let bound_j = PassivitySpec::usual(1.0 / rate).bound_j;
        assert!(cost.rendered_j < cost.wanted_j + bound_j, "and is not made to take less: {cost:?}");
        // Only what pushes is taken away: all that is felt of a force of 1000 N/m * 5 mm * sin 0.3 at most.
        assert!(cost.changed_most < 1000.0 * 5e-3 && cost.changed_rms < 0.25 * cost.wanted_rms, "{cost:?}");
    }
}
