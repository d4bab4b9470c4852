//! Cost of a tick of bodies: per contact point, per body, and of a hand that holds one of ten.
//!
//! `cargo bench -p physics --bench step`; quote medians and ratios of one run.
#![allow(missing_docs, reason = "the macros of criterion")]
#![allow(non_snake_case)] // Names carry their frame.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use haptics::{Cuboid, Entity, Finger, Friction, Plane, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Integrator, Manipulation, MassProperties, Settings, Touch};

const DT: f64 = 1e-3;

fn floor() -> Entity {
    let plane = Plane::new(Vector3::y(), 0.0).expect("a normal");
    let entity = Entity::new(plane, Isometry3::identity(), 2000.0).expect("in range");
    entity.with_friction(Friction::coulomb(0.5).expect("in range")).expect("in range")
}

/// A box or a ball of 0.1 kg that stands there.
fn thing(x: f64, is_box: bool) -> Entity {
    let at = Isometry3::translation(x, 0.02, 0.0);
    let entity = if is_box {
        Entity::new(Cuboid::new([0.04; 3]).expect("in range"), at, 1000.0)
    } else {
        Entity::new(Sphere::new(0.02).expect("in range"), at, 1000.0)
    };
    let entity = entity.expect("in range").with_friction(Friction::coulomb(0.6).expect("in range"));
    entity.expect("in range").with_damping(1.0).expect("in range")
}

/// A floor and things on it that have come to rest.
struct Table {
    entities: Vec<Entity>,
    manipulation: Manipulation,
}

impl Table {
    fn new(count: usize, is_box: bool, integrator: Integrator) -> Self {
        let mut entities = vec![floor()];
        entities.extend((0..count).map(|place| thing(0.1 * place as f64, is_box)));
        let body = |entity: &Entity| {
            Body::at_rest(MassProperties::of_shape(&entity.shape, 0.1).expect("a mass"), &entity.X_WB)
        };
        let bodies: Vec<_> = (1..=count).map(|index| (index, body(&entities[index]))).collect();
        let settings = Settings { integrator, ..Settings::default() };
        let mut manipulation = Manipulation::new(&entities, &bodies, settings).expect("bodies");
        for _ in 0..3000 {
            manipulation.step(&mut entities, &mut [], DT);
        }
        Self { entities, manipulation }
    }
}

fn resting(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("at rest");
    for (name, is_box, counts) in
        [("balls, 1 point each", false, [1, 10]), ("boxes, 4 points each", true, [1, 10])]
    {
        for count in counts {
            let mut table = Table::new(count, is_box, Integrator::Implicit);
            group.bench_function(format!("{count} {name}"), |bench| {
                bench.iter(|| black_box(table.manipulation.step(&mut table.entities, &mut [], DT)));
            });
        }
    }
    for (name, integrator) in Integrator::NAMES {
        let mut table = Table::new(10, true, integrator);
        group.bench_function(format!("10 boxes, {name}"), |bench| {
            bench.iter(|| black_box(table.manipulation.step(&mut table.entities, &mut [], DT)));
        });
    }
    group.finish();
}

/// Three fingers carry the first of ten boxes to and fro: the whole tick, and that of the bodies alone.
fn held(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("three fingers hold one of 10 boxes");
    for (name, is_whole) in [("fingers and bodies", true), ("bodies", false)] {
        let mut table = Table::new(10, true, Integrator::Implicit);
        let finger =
            || Finger::new(0.0, table.entities.len()).expect("a finger").with_ramp_in(0.0).expect("in range");
        let mut fingers = [finger(), finger(), finger()];
        let mut touches = Vec::with_capacity(16);
        let mut tick = 0_u64;
        let hands = |fingers: &mut [Finger; 3], entities: &[Entity], touches: &mut Vec<Touch>, tick: u64| {
            let t = tick as f64 * DT;
            // Closes, lifts, and then swings.
            let x = 0.025 - 0.008 * (t / 0.5).min(1.0);
            let up = 0.03 * ((t - 0.5) / 1.0).clamp(0.0, 1.0) + 0.01 * (3.0 * (t - 1.5).max(0.0)).sin();
            let hips =
                [Vector3::new(x, 0.02, 0.0), Vector3::new(-x, 0.02, 0.01), Vector3::new(-x, 0.02, -0.01)];
            touches.clear();
            for (index, (finger, hip)) in fingers.iter_mut().zip(hips).enumerate() {
                finger.step(entities, &(hip + Vector3::y() * up), DT);
                touches.extend(finger.contacts().map(|contact| Touch::of(contact, index)));
            }
        };
        for _ in 0..1700 {
            hands(&mut fingers, &table.entities, &mut touches, tick);
            table.manipulation.step(&mut table.entities, &mut touches, DT);
            tick += 1;
        }
        assert_eq!(touches.len(), 3, "it is held");
        group.bench_function(name, |bench| {
            bench.iter(|| {
                if is_whole {
                    hands(&mut fingers, &table.entities, &mut touches, tick);
                    tick += 1;
                }
                black_box(table.manipulation.step(&mut table.entities, &mut touches, DT))
            });
        });
    }
    group.finish();
}

/// A body that turns freely, by how much it turns in a tick.
fn turning(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a free body that spins");
    for spin in [1.0, 100.0, 2000.0] {
        let entity = thing(0.0, true);
        let mass = MassProperties::of_shape(&entity.shape, 0.1).expect("a mass");
        let mass = mass.with_inertia([5e-5, 1e-4, 1.3e-4]).expect("possible");
        let body =
            Body::at_rest(mass, &entity.X_WB).moving(Vector3::zeros(), Vector3::new(0.3, 0.5, 0.8) * spin);
        let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
        let mut entities = vec![entity];
        let mut manipulation = Manipulation::new(&entities, &[(0, body)], settings).expect("a body");
        group.bench_function(format!("{spin} rad/s"), |bench| {
            bench.iter(|| black_box(manipulation.step(&mut entities, &mut [], DT)));
        });
    }
    group.finish();
}

criterion_group!(benches, resting, held, turning);
criterion_main!(benches);
