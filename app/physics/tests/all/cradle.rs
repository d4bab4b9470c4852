//! Bodies that meet each other under the impulse response: Newton's cradle, and what is kept.
#![allow(non_snake_case)]

use crate::{common, noise};

use common::*;
use haptics::{Cuboid, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use noise::Noise;
use physics::{Body, Response, Settings};

const RADIUS: f64 = 0.02;

fn weightless(restitution: f64) -> Settings {
    Settings {
        gravity_W: Vector3::zeros(),
        response: Response::Impulse { restitution },
        ..Settings::default()
    }
}

/// Balls in a row along x with such gaps (m), of which the first ones come with 1 m/s from 5 mm away.
fn cradle(count: usize, coming: usize, gap_m: f64, mu: f64, restitution: f64) -> World {
    let (mut entities, mut bodies) = (Vec::new(), Vec::new());
    for place in 0..count {
        let comes = place < coming;
        let x = place as f64 * (2.0 * RADIUS + gap_m) - if comes { 0.005 } else { 0.0 };
        let ball = object(Sphere::new(RADIUS).unwrap(), Isometry3::translation(x, 0.0, 0.0), 1000.0, mu);
        let velocity = if comes { Vector3::x() } else { Vector3::zeros() };
        bodies.push((place, body(&ball, 0.1).moving(velocity, Vector3::zeros())));
        entities.push(ball);
    }
    World::new(entities, &bodies, weightless(restitution), 0)
}

fn speeds(world: &World) -> Vec<f64> {
    world.manipulation.bodies().iter().map(|body| body.velocity_W.x).collect()
}

/// What balls of the same mass in a row leave with, by going from one collision to the next: slow and obvious. Of those that
/// meet at once, the fastest meet first.
fn by_hand(mut v: Vec<f64>, mut gaps: Vec<f64>, restitution: f64) -> Vec<f64> {
    // Roundings of places decide nothing.
    let open = |gap: f64| if gap > 1e-12 { gap } else { 0.0 };
    for _ in 0..100_000 {
        let approach: Vec<f64> = v.windows(2).map(|pair| pair[0] - pair[1]).collect();
        let when = |at: &usize| (gaps[*at] / approach[*at], -approach[*at]);
        let meets = (0..gaps.len()).filter(|&at| approach[at] > 1e-6);
        let Some(at) = meets.min_by(|a, b| when(a).partial_cmp(&when(b)).unwrap()) else { break };
        let after = gaps[at] / approach[at];
        gaps.iter_mut().zip(&approach).for_each(|(gap, approach)| *gap = open(*gap - approach * after));
        let (sum, difference) = (v[at] + v[at + 1], v[at] - v[at + 1]);
        (v[at], v[at + 1]) = (0.5 * (sum - restitution * difference), 0.5 * (sum + restitution * difference));
    }
    v
}

#[test]
fn as_many_balls_leave_newtons_cradle_as_come() {
    for gap_m in [0.0, 1e-6] {
        for (count, coming) in [(5, 1), (5, 2), (5, 3), (3, 1), (7, 2)] {
            let mut world = cradle(count, coming, gap_m, 0.3, 1.0);
            for _ in 0..60 {
                world.step(&[]);
            }
            for (place, speed) in speeds(&world).into_iter().enumerate() {
                let leaves = if place >= count - coming { 1.0 } else { 0.0 };
                // Roundings of a million times what balls weigh, in some meetings.
                assert!(
                    (speed - leaves).abs() < 1e-9,
                    "gap {gap_m}, {coming} of {count}: {:?}",
                    speeds(&world)
                );
            }
        }
    }
}

#[test]
fn what_loses_energy_leaves_as_if_balls_had_met_one_at_a_time() {
    for gap_m in [0.0, 1e-6] {
        for restitution in [0.8, 0.5] {
            for coming in [1, 2] {
                let mut world = cradle(5, coming, gap_m, 0.0, restitution);
                let mut order = vec![0.0; 5];
                order[..coming].fill(1.0);
                let mut gaps = vec![gap_m; 4];
                gaps[coming - 1] += 0.005;
                let expected = by_hand(order, gaps, restitution);
                for _ in 0..2000 {
                    world.step(&[]);
                }
                for (speed, hand) in speeds(&world).into_iter().zip(&expected) {
                    // What is slower than 1e-6 m/s rests.
                    assert!(
                        (speed - hand).abs() < 1e-5,
                        "e {restitution}, gap {gap_m}, {coming}: {:?} for {expected:?}",
                        speeds(&world)
                    );
                }
            }
        }
    }
}

#[test]
fn without_restitution_all_go_on_together() {
    for gap_m in [0.0, 1e-6] {
        let mut world = cradle(5, 1, gap_m, 0.0, 0.0);
        for _ in 0..40 {
            world.step(&[]);
        }
        // A stop gives way by a part in a million.
        assert!(speeds(&world).iter().all(|speed| (speed - 0.2).abs() < 1e-5), "{:?}", speeds(&world));
    }
}

/// Momentum, and angular momentum about the origin.
fn momenta(bodies: &[Body]) -> (Vector3<f64>, Vector3<f64>) {
    bodies.iter().fold((Vector3::zeros(), Vector3::zeros()), |(p, L), body| {
        let own = body.velocity_W * body.mass.mass_kg;
        (p + own, L + body.angular_momentum_W + body.centre_W.cross(&own))
    })
}

/// Two bodies that fly at each other and turn.
fn pair(seed: u64, response: Response) -> World {
    let noise = &mut Noise::new(seed);
    let mut entities = Vec::new();
    let mut bodies = Vec::new();
    for side in [-1.0, 1.0] {
        let shape: Shape = if noise.chance(0.3) {
            Sphere::new(noise.within(0.01, 0.03)).unwrap().into()
        } else {
            Cuboid::new([0; 3].map(|_| noise.within(0.02, 0.06))).unwrap().into()
        };
        let at = Vector3::x() * (side * 0.08) + noise.vector(0.01);
        let X_WB = Isometry3::from_parts(at.into(), noise.turn());
        let mu = noise.within(0.0, 1.0);
        let entity = object(shape, X_WB, noise.log_within(100.0, 5000.0), mu);
        let mass = noise.log_within(0.01, 1.0);
        let velocity = Vector3::x() * (-side * noise.within(0.2, 1.0)) + noise.vector(0.1);
        bodies.push((entities.len(), body(&entity, mass).moving(velocity, noise.vector(10.0))));
        entities.push(entity);
    }
    let settings = Settings { response, ..weightless(0.0) };
    World::new(entities, &bodies, settings, 0)
}

#[test]
fn two_that_meet_in_free_space_keep_momentum_and_angular_momentum_and_gain_no_energy() {
    let impulse = |restitution| Response::Impulse { restitution };
    for response in [impulse(1.0), impulse(0.8), impulse(0.0), Response::Force] {
        let mut met = 0;
        for seed in 0..150 {
            let mut world = pair(seed, response);
            let (p, L) = momenta(world.manipulation.bodies());
            let energy =
                |world: &World| world.manipulation.bodies().iter().map(Body::kinetic_energy_j).sum::<f64>();
            let scale: f64 = world
                .manipulation
                .bodies()
                .iter()
                .map(|body| body.mass.mass_kg * body.velocity_W.norm())
                .sum();
            let mut last = energy(&world);
            for tick in 0..400 {
                world.step(&[]);
                let (p_now, L_now) = momenta(world.manipulation.bodies());
                assert!(
                    (p_now - p).norm() < 1e-9 * scale,
                    "{response:?}, seed {seed}, {tick}: {}",
                    p_now - p
                );
                // 0.1 m is as far apart as they are.
                assert!(
                    (L_now - L).norm() < 1e-9 * scale * 0.1,
                    "{response:?}, seed {seed}, {tick}: {}",
                    (L_now - L).norm() / (scale * 0.1)
                );
                met +=
                    usize::from(world.manipulation.rows().iter().any(|row| row.force_W != Vector3::zeros()));
                if response != Response::Force {
                    let now = energy(&world);
                    // The middle of a turn by h is wrong by h^3; a depth is let out.
                    let turns: f64 = world
                        .manipulation
                        .bodies()
                        .iter()
                        .map(|body| (body.angular_velocity_W().norm() * DT).powi(2))
                        .sum();
                    assert!(
                        now <= last * (1.0 + turns + 1e-6) + 1e-9,
                        "{response:?}, seed {seed}, {tick}: {last} then {now}"
                    );
                    last = now;
                }
            }
        }
        assert!(met > 100, "{response:?}: {met}");
    }
}

#[test]
fn a_ball_that_meets_one_before_a_wall_comes_back() {
    // It passes all it has to the ball, the wall gives it back, and the ball passes it on.
    let mut world = cradle(3, 1, 1e-5, 0.0, 1.0);
    let wall = haptics::Plane::new(-Vector3::x(), -(5.0 * RADIUS + 3e-5)).unwrap();
    let wall = haptics::Entity::new(wall, Isometry3::identity(), 5000.0).unwrap();
    let mut entities = world.entities.clone();
    entities.push(wall);
    let bodies: Vec<_> = world.manipulation.bodies().iter().copied().enumerate().collect();
    world = World::new(entities, &bodies, weightless(1.0), 0);
    for _ in 0..60 {
        world.step(&[]);
    }
    let speeds = speeds(&world);
    // What is reflected at the wall together with nothing else gives way by a part in a million.
    assert!((speeds[0] + 1.0).abs() < 1e-5 && speeds[1].abs() < 1e-5 && speeds[2].abs() < 1e-5, "{speeds:?}");
}
