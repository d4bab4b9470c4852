//! Bodies that rest are not stepped, and nobody can tell that they were not.

use crate::common;

use common::{DT, World, body, floor, object};
use haptics::{Cuboid, Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Settings, Sleep, Standing};

const SIZE: f64 = 0.05;

/// So many cubes of 100 g on each other, each a hair deep in the one below.
fn stack(cubes: usize, sleep: Option<Sleep>) -> World {
    let mut entities = vec![floor(0.0, 2000.0, 0.5)];
    for at in 0..cubes {
        let pose = Isometry3::translation(0.0, SIZE * (at as f64 + 0.5) - 1e-4 * (at as f64 + 1.0), 0.0);
        entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), pose, 1000.0, 0.5));
    }
    let bodies: Vec<(usize, Body)> = (1..=cubes).map(|at| (at, body(&entities[at], 0.1))).collect();
    World::new(entities, &bodies, Settings { sleep, ..Settings::default() }, 1)
}

const AWAY: Vector3<f64> = Vector3::new(0.0, 1.0, 0.0);

/// Steps until nobody is awake, and says after how long (s).
fn fall_asleep(world: &mut World) -> f64 {
    for tick in 0..20_000 {
        world.step(&[AWAY]);
        if world.manipulation.awake().is_empty() {
            return f64::from(tick) * DT;
        }
    }
    panic!("still awake: {:?}", world.manipulation.awake());
}

#[test]
fn a_stack_at_rest_falls_asleep_as_one_and_is_not_stepped() {
    let mut world = stack(3, Some(Sleep::default()));
    let after_s = fall_asleep(&mut world);
    assert!(after_s > Sleep::default().after_s, "{after_s}");
    let poses: Vec<_> = world.entities.iter().map(|entity| entity.X_WB).collect();
    for _ in 0..1000 {
        world.step(&[AWAY]);
        assert_eq!((world.made.awake, world.made.rows), (0, 0));
    }
    assert!(
        world
            .entities
            .iter()
            .zip(poses)
            .all(|(entity, was)| entity.X_WB == was && entity.previous_X_WB == was)
    );
}

#[test]
fn a_stack_that_is_touched_wakes_as_one_and_does_not_twitch() {
    let mut world = stack(3, Some(Sleep::default()));
    fall_asleep(&mut world);
    let rested: Vec<_> = world.entities.iter().map(|entity| entity.X_WB.translation.vector).collect();
    let top = rested[3].y + SIZE / 2.0;
    // A finger that lies on it with 1e-9 m, 1 uN; it comes slowly, for contacts are damped.
    world.step(&[Vector3::new(0.0, top + 1e-9, 0.0)]);
    for tick in 0..200 {
        world.step(&[Vector3::new(0.0, top - 1e-9, 0.0)]);
        assert_eq!(world.manipulation.awake(), [0, 1, 2], "tick {tick}");
        for (entity, rested) in world.entities.iter().zip(&rested) {
            // What it had not yet come to rest by: 1e-6 m/s, decaying; and what the finger presses it.
            let moved = (entity.X_WB.translation.vector - rested).norm();
            assert!(moved < 1e-8, "tick {tick}: {moved:e}");
        }
    }
}

#[test]
fn a_stack_that_slept_is_pushed_like_one_that_did_not() {
    let mut worlds = [stack(3, Some(Sleep::default())), stack(3, None)];
    for tick in 0..20_000 {
        worlds.iter_mut().for_each(|world| drop(world.step(&[AWAY])));
        if tick == 10_000 {
            assert_eq!(worlds[0].made.awake, 0, "asleep by then");
        }
        if tick < 10_000 {
            continue;
        }
        break;
    }
    let forces: Vec<_> = worlds
        .iter_mut()
        .map(|world| {
            let mut most = Vector3::zeros();
            for tick in 0..600 {
                let hip = Vector3::new(-0.03 + 1e-4 * f64::from(tick), 0.5 * SIZE, 0.0);
                most = world.step(&[hip])[0].inf(&most);
            }
            most
        })
        .collect();
    // It pushes against friction, mu 3 m g and more; asleep or not, but for what was left of coming to rest.
    assert!(forces[0].x < -1.0 && (forces[0] - forces[1]).norm() < 1e-6, "{forces:?}");
    let [one, other] = &worlds;
    for (one, other) in one.entities.iter().zip(&other.entities) {
        let apart = (one.X_WB.translation.vector - other.X_WB.translation.vector).norm();
        assert!(apart < 1e-7, "{apart:e}");
    }
}

/// Two balls without gravity, the second at rest.
fn balls(speed: f64) -> World {
    let ball = |x: f64| object(Sphere::new(0.02).unwrap(), Isometry3::translation(x, 0.0, 0.0), 2000.0, 0.3);
    let entities: Vec<Entity> = vec![ball(-0.3), ball(0.0)];
    let mut first = body(&entities[0], 0.05);
    first.velocity_W.x = speed;
    let bodies = [(0, first), (1, body(&entities[1], 0.1))];
    let settings =
        Settings { gravity_W: Vector3::zeros(), sleep: Some(Sleep::default()), ..Settings::default() };
    World::new(entities, &bodies, settings, 1)
}

#[test]
fn one_that_sleeps_is_awake_before_it_is_hit() {
    let mut world = balls(0.3);
    let momentum = |world: &World| -> Vector3<f64> {
        world.manipulation.bodies().iter().map(|body| body.velocity_W * body.mass.mass_kg).sum()
    };
    let before = momentum(&world);
    let mut slept = false;
    for _ in 0..2000 {
        world.step(&[AWAY]);
        slept |= world.manipulation.standing(1) == Standing::Asleep;
        // Roundings of 0.015 kg m/s over some hundred ticks of contact.
        assert!((momentum(&world) - before).norm() < 1e-16, "{:?}", momentum(&world));
    }
    assert!(slept && world.manipulation.bodies()[1].velocity_W.x > 0.05);
}

#[test]
fn what_begins_to_move_ever_so_slowly_does_not_sleep() {
    let ball = object(Sphere::new(0.02).unwrap(), Isometry3::identity(), 2000.0, 0.3);
    let state = body(&ball, 0.05);
    // 1e-5 m/s^2: 5 times the threshold by when it might sleep.
    let settings = Settings {
        gravity_W: Vector3::new(0.0, -1e-5, 0.0),
        sleep: Some(Sleep::default()),
        ..Settings::default()
    };
    let mut world = World::new(vec![ball], &[(0, state)], settings, 1);
    for _ in 0..3000 {
        world.step(&[AWAY]);
        assert_eq!(world.made.awake, 1);
    }
    // g t^2 / 2, and half a tick's rounding of it.
    assert!((world.body().centre_W.y + 0.5e-5 * 9.0).abs() < 1e-9);
}

#[test]
fn what_turns_does_not_sleep_and_what_sleeps_does_not_move_at_all() {
    // 1e-4 rad/s, ten times the threshold, in the middle of nowhere.
    let mut world = balls(0.0);
    let mut bodies: Vec<_> = world.manipulation.bodies().iter().copied().enumerate().collect();
    bodies[0].1 = bodies[0].1.moving(Vector3::zeros(), Vector3::new(0.0, 1e-4, 0.0));
    // Slower than that: it falls asleep, and is still.
    bodies[1].1 = bodies[1].1.moving(Vector3::x() * 5e-7, Vector3::new(0.0, 5e-6, 0.0));
    let settings =
        Settings { gravity_W: Vector3::zeros(), sleep: Some(Sleep::default()), ..Settings::default() };
    world = World::new(world.entities, &bodies, settings, 1);
    (0..2000).for_each(|_| drop(world.step(&[AWAY])));
    assert_eq!(world.manipulation.awake(), [0]);
    let sleeper = world.manipulation.bodies()[1];
    assert_eq!((sleeper.velocity_W, sleeper.angular_momentum_W), (Vector3::zeros(), Vector3::zeros()));
}

#[test]
fn what_a_finger_touches_does_not_sleep_under_it() {
    let mut world = stack(1, Some(Sleep::default()));
    (0..2000).for_each(|_| drop(world.step(&[Vector3::new(0.0, SIZE, 0.0)])));
    let top = world.entities[1].X_WB.translation.vector.y + 0.5 * SIZE;
    for _ in 0..3000 {
        world.step(&[Vector3::new(0.0, top - 1e-5, 0.0)]);
        assert_eq!(world.manipulation.standing(0), Standing::Awake);
    }
}
