//! Cost of a tick of bodies that press each other: a stack of cubes, four contact points on each face, at rest and shaken.
//!
//! `cargo bench -p physics --bench islands`; quote medians and ratios of one run. *At rest*: the whole tick of a stack on the
//! floor (contact points, forces, motion). *Cold*: the solver alone, which knows nothing of the last tick. *Falling*: the
//! solver alone, in a tick in which forces change. *Top*: of cubes of 50 g and 40 mm the top one is as heavy as so many, beside
//! MuJoCo's times by `tests/referee/stack_times.py`.
#![allow(missing_docs, reason = "the macros of criterion")]
#![allow(non_snake_case)] // Names carry their frame.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use haptics::{Cuboid, Entity, Friction, Plane};
use nalgebra::{Isometry3, Vector3};
use physics::{
    Body, ContactStiffness, Manipulation, MassProperties, Motion, Response, Row, Settings, Solver,
};

const DT: f64 = 1e-3;
const EDGE: f64 = 0.02;

fn with_friction(entity: Entity) -> Entity {
    entity.with_friction(Friction::coulomb(0.6).expect("in range")).expect("in range")
}

/// Cubes of 10 g on each other that have come to rest.
fn stack(count: usize, response: Response) -> (Vec<Entity>, Manipulation) {
    stack_of(&vec![0.01; count], EDGE, Settings { response, ..Settings::default() })
}

/// Cubes of these masses (kg), the lowest first.
fn stack_of(masses_kg: &[f64], edge_m: f64, settings: Settings) -> (Vec<Entity>, Manipulation) {
    let count = masses_kg.len();
    let plane = Plane::new(Vector3::y(), 0.0).expect("a normal");
    let floor = Entity::new(plane, Isometry3::identity(), 5000.0).expect("in range");
    let mut entities = vec![with_friction(floor)];
    entities.extend((0..count).map(|place| {
        let at = Isometry3::translation(0.0, edge_m * (place as f64 + 0.5), 0.0);
        let cube = Entity::new(Cuboid::new([edge_m; 3]).expect("in range"), at, 5000.0).expect("in range");
        with_friction(cube.with_damping(1.0).expect("in range"))
    }));
    let body = |entity: &Entity, mass_kg: f64| {
        Body::at_rest(MassProperties::of_shape(&entity.shape, mass_kg).expect("a mass"), &entity.X_WB)
    };
    let bodies: Vec<_> =
        (1..=count).map(|index| (index, body(&entities[index], masses_kg[index - 1]))).collect();
    let mut manipulation = Manipulation::new(&entities, &bodies, settings).expect("bodies");
    for _ in 0..3000 {
        manipulation.step(&mut entities, &mut [], DT);
    }
    (entities, manipulation)
}

/// The bodies as they would move without contacts.
fn falling(manipulation: &Manipulation) -> Vec<Motion> {
    let motion = |body: &Body| Motion {
        velocity_W: body.velocity_W - Vector3::y() * (9.81 * DT),
        angular_velocity_W: body.angular_velocity_W(),
        inverse_mass: 1.0 / body.mass.mass_kg,
        inverse_inertia_W: body.inverse_inertia_W(),
    };
    manipulation.bodies().iter().map(motion).collect()
}

fn stacks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stack of cubes");
    for count in [1, 2, 5, 10, 20] {
        for (name, response) in
            [("springs", Response::Force), ("impulses", Response::Impulse { restitution: 0.5 })]
        {
            let (mut entities, mut manipulation) = stack(count, response);
            group.bench_function(format!("{count}, {name}, at rest, whole tick"), |bench| {
                bench.iter(|| black_box(manipulation.step(&mut entities, &mut [], DT)));
            });
            let (rows, motions) = (manipulation.rows().to_vec(), falling(&manipulation));
            let mut solver = Solver::with_capacity(rows.len(), motions.len());
            let mut solve = |name: &str, rows: &[Row], motions: &[Motion]| {
                group.bench_function(format!("{count}, {name}"), |bench| {
                    let set_up = || (rows.to_vec(), motions.to_vec());
                    bench.iter_batched_ref(
                        set_up,
                        |(rows, motions)| black_box(solver.solve(rows, motions, DT)),
                        BatchSize::SmallInput,
                    );
                });
            };
            if response == Response::Force {
                solve("solver, warm", &rows, &motions);
                let mut shaken = motions.clone();
                for (place, motion) in shaken.iter_mut().enumerate() {
                    motion.velocity_W += Vector3::new(0.01, -0.02, 0.005) * (place as f64 * 1.7).sin();
                }
                solve("solver, shaken", &rows, &shaken);
                let cold: Vec<_> = rows.iter().map(|row| Row { force_W: Vector3::zeros(), ..*row }).collect();
                solve("solver, cold", &cold, &motions);
            }
        }
    }
    group.finish();
}

fn heavy_tops(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("top");
    for (count, times) in [2, 3, 5, 10].into_iter().flat_map(|count| [(count, 1.0), (count, 100.0)]) {
        let mut masses_kg = vec![0.05; count];
        masses_kg[count - 1] *= times;
        let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
        let settings = Settings { contact_stiffness, ..Settings::default() };
        let (mut entities, mut manipulation) = stack_of(&masses_kg, 0.04, settings);
        group.bench_function(format!("{count} cubes, {times} times"), |bench| {
            bench.iter(|| black_box(manipulation.step(&mut entities, &mut [], DT)));
        });
    }
    group.finish();
}

criterion_group!(benches, stacks, heavy_tops);
criterion_main!(benches);
