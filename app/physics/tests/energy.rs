//! Nothing that is left to itself gains energy: random bodies on random planes.
#![allow(non_snake_case)]

mod common;
#[path = "common/noise.rs"]
mod noise;

use common::*;
use haptics::{Cuboid, Entity, Plane, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use noise::Noise;
use physics::{Body, Response, Settings};

/// Planes with things above them.
struct Scene {
    world: World,
    /// Of each body, the farthest of its points from its centre (m).
    sizes: Vec<f64>,
}

impl Scene {
    fn new(seed: u64, response: Response) -> Self {
        let noise = &mut Noise::new(seed);
        let plane = |noise: &mut Noise, normal: Vector3<f64>| {
            let entity = Entity::new(
                Plane::new(normal, 0.0).unwrap(),
                Isometry3::identity(),
                noise.log_within(100.0, 5000.0),
            );
            let mu = noise.within(0.0, 1.5);
            entity.unwrap().with_friction(haptics::Friction::coulomb(mu).unwrap()).unwrap()
        };
        // A floor that may lean, and a wall across it.
        let lean = noise.vector(0.3);
        let wall = Vector3::x() + Vector3::y() * noise.within(0.0, 0.5);
        let mut entities = vec![plane(noise, Vector3::y() + lean), plane(noise, wall)];
        let (mut bodies, mut sizes) = (Vec::new(), Vec::new());
        for place in 0..1 + noise.below(3) {
            let (shape, size): (Shape, f64) = if noise.chance(0.4) {
                let radius = noise.within(0.005, 0.04);
                (Sphere::new(radius).unwrap().into(), radius)
            } else {
                let edges = [0; 3].map(|_| noise.within(0.01, 0.08));
                (Cuboid::new(edges).unwrap().into(), 0.5 * Vector3::from(edges).norm())
            };
            let at =
                Vector3::new(0.15 + 0.2 * place as f64, noise.within(0.35, 0.5), noise.within(-0.1, 0.1));
            let X_WB = Isometry3::from_parts(at.into(), noise.turn());
            let (stiffness, mu) = (noise.log_within(10.0, 5000.0), noise.within(0.0, 1.5));
            let entity = object(shape, X_WB, stiffness, mu);
            let damping = if noise.chance(0.5) { 0.0 } else { noise.within(0.0, 2.0) };
            let entity = entity.with_damping(damping).unwrap();
            let mass = noise.log_within(1e-3, 10.0);
            let (velocity, spin) = (noise.vector(1.0), noise.vector(30.0));
            bodies.push((entities.len(), body(&entity, mass).moving(velocity, spin)));
            entities.push(entity);
            sizes.push(size);
        }
        let settings = Settings { response, ..Settings::default() };
        Self { world: World::new(entities, &bodies, settings, 0), sizes }
    }

    /// Steps; the energy that all had when the tick began (J), and what of it may be made of turning in finite steps.
    fn step(&mut self) -> (f64, f64) {
        let before: Vec<Body> = self.world.manipulation.bodies().to_vec();
        self.world.step(&[]);
        let (mut energy, mut allowed) = (0.0, 0.0);
        for body in &before {
            let height = body.centre_W.y;
            energy += body.kinetic_energy_j() + body.mass.mass_kg * G * height;
            // The middle of a turn of h is wrong by h^3.
            let turn = body.angular_velocity_W().norm() * DT;
            allowed += body.kinetic_energy_j() * turn.powi(3) + 1e-13 * energy.abs();
        }
        for row in self.world.manipulation.rows() {
            // The springs as the tick found them.
            let k = row.stiffness[1];
            let rest_n = row.normal_W.dot(&row.rest_W);
            let across = row.rest_W - row.normal_W * rest_n;
            energy += 0.5 * across.norm_squared() / k;
            // Impulses are no springs.
            if row.stiffness[0] > 0.0 {
                energy += 0.5 * rest_n.max(0.0).powi(2) / k;
            }
            // A point on an arm that turns is omega^2 r dt^2 from where its velocity would have it: half of it for the arc, as
            // much again for what the velocity changes by. Its force works along that.
            let (body, after) = (&before[row.body], &self.world.manipulation.bodies()[row.body]);
            let spin = body.angular_velocity_W().norm().max(after.angular_velocity_W().norm());
            let arc = spin * spin * self.sizes[row.body] * DT * DT;
            let is_impact = row.stiffness[0] == 0.0 && k > 1e4;
            if row.stiffness[0] == 0.0 && !is_impact {
                // What is too deep is let out, against what presses.
                let let_out_m_s = (rest_n / row.damping[0]).max(0.0);
                allowed += 2.0 * let_out_m_s * DT * row.force_W.norm();
            }
            allowed += arc * (row.force_W.norm() + body.mass.mass_kg * G) + 0.5 * k * arc * arc;
        }
        (energy, allowed)
    }
}

fn assert_energy_never_grows(seed: u64, response: Response, ticks: usize) -> f64 {
    let mut scene = Scene::new(seed, response);
    let (first, mut allowed) = scene.step();
    let mut was = first;
    let (mut sum, mut most) = (0.0, f64::MIN);
    for tick in 1..ticks {
        let (energy, next_allowed) = scene.step();
        if energy > was + allowed {
            println!("seed {seed}, tick {tick}: {was} then {energy}: {:e} allowed {allowed:e}", energy - was);
        }
        sum += allowed;
        most = most.max((energy - was) / allowed);
        (was, allowed) = (energy, next_allowed);
    }
    let _ = sum;
    most
}

#[test]
fn energy_never_grows_where_springs_answer() {
    for seed in 0..300 {
        let most = assert_energy_never_grows(seed, Response::Force, 2000);
        let _ = most;
    }
}

#[test]
fn energy_never_grows_where_impulses_answer() {
    for seed in 0..300 {
        for restitution in [0.0, 0.5, 1.0] {
            assert_energy_never_grows(seed, Response::Impulse { restitution }, 2000);
        }
    }
}

#[test]
fn probe() {
    for e in [0.0, 0.5, 1.0] {
        let mut scene = Scene::new(264, Response::Impulse { restitution: e });
        let mut was = 1e9;
        let mut n = 0;
        for tick in 0..330 {
            let before: Vec<Body> = scene.world.manipulation.bodies().to_vec();
            let (energy, _) = scene.step();
            if energy > was + 1e-6 && n < 4 && tick > 100 {
                n += 1;
                println!("e {e} {tick} {energy} {was}");
                for (b, body) in before.iter().enumerate() {
                    println!(
                        "  body {b} m {} ke {} y {} w {:?} v {:?}",
                        body.mass.mass_kg,
                        body.kinetic_energy_j(),
                        body.centre_W.y,
                        body.angular_velocity_W().as_slice(),
                        body.velocity_W.as_slice()
                    );
                }
                for row in scene.world.manipulation.rows() {
                    println!(
                        "     {} {:?} rest {:?} f {:?} k {:?} b {:?} mu {} {:?}",
                        row.body,
                        row.held,
                        row.rest_W.as_slice(),
                        row.force_W.as_slice(),
                        row.stiffness,
                        row.damping,
                        row.mu_hold,
                        row.normal_W.as_slice()
                    );
                }
            }
            was = energy;
        }
    }
}
