//! Energy that comes back of an impact: the share of its energy that the scene says, at any rate.
#![allow(non_snake_case)]

use crate::common;
use crate::noise::Noise;

use common::{G, body, floor, object};
use haptics::{Cuboid, Cylinder, Ellipsoid, Entity, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, ContactStiffness, Integrator, Manipulation, Response, Settings};

const RADIUS_M: f64 = 0.02;
const RATES_HZ: [f64; 4] = [500.0, 1000.0, 4000.0, 8000.0];

/// Springs that let go what meets them, by mass and as felt; and impulses alone.
fn responses(restitution: f64) -> [Settings; 3] {
    let bounce = Response::Bounce { restitution };
    let by_mass = ContactStiffness::ByMass { damping_ratio: 1.0 };
    [(bounce, by_mass), (bounce, ContactStiffness::AsFelt), (Response::Impulse { restitution }, by_mass)]
        .map(|(response, contact_stiffness)| Settings { response, contact_stiffness, ..Settings::default() })
}

fn ball(height_m: f64) -> Entity {
    let at = Isometry3::translation(0.0, RADIUS_M + height_m, 0.0);
    object(Sphere::new(RADIUS_M).unwrap(), at, 1000.0, 0.5)
}

/// Energy over weight, as a height of the lowest point (m).
fn energy_m(body: &Body) -> f64 {
    body.kinetic_energy_j() / (body.mass.mass_kg * G) + body.centre_W.y - RADIUS_M
}

/// A ball that falls from a height: what of its energy it has once it rises; `None`: it does not.
fn kept(height_m: f64, mass_kg: f64, settings: Settings, rate_hz: f64) -> Option<f64> {
    let ball = ball(height_m);
    let bodies = [(1, body(&ball, mass_kg))];
    let mut entities = vec![floor(0.0, 1000.0, 0.5), ball];
    let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
    let ticks = 4.0 * (2.0 * height_m / G).sqrt() * rate_hz + 10.0;
    for _ in 0..ticks as u32 {
        manipulation.step(&mut entities, &mut [], rate_hz.recip());
        let body = &manipulation.bodies()[0];
        if body.velocity_W.y > 0.0 {
            return Some(energy_m(body) / height_m);
        }
    }
    None
}

#[test]
fn a_bounce_keeps_restitution_squared_of_the_energy_at_any_rate() {
    let (mut seen, mut worst) = (0, 0.0_f64);
    for restitution in [0.1, 0.3, 0.5, 0.8, 0.95, 1.0] {
        for settings in responses(restitution) {
            for rate_hz in RATES_HZ {
                for height_m in [5e-4, 3e-3, 0.0201, 0.2, 0.7] {
                    let leaves_m_s = restitution * (2.0 * G * height_m).sqrt();
                    // What leaves more slowly than gravity makes it in two ticks rests, or may.
                    if leaves_m_s < 2.0 * G / rate_hz {
                        continue;
                    }
                    for mass_kg in [1e-3, 0.3, 10.0] {
                        let kept = kept(height_m, mass_kg, settings, rate_hz).expect("a bounce");
                        let off = kept / restitution.powi(2) - 1.0;
                        // An impulse is a million times harder than what it stops: of the velocity that it changes by
                        // (1 + 1/e) v, and of the energy twice that. It never gives more but for roundings.
                        let share = 2e-6 * (1.0 + 1.0 / restitution);
                        assert!(
                            (-2.0 * share..1e-9).contains(&off),
                            "e {restitution}, {height_m} m, {mass_kg} kg, {rate_hz} Hz: {off:e}, {settings:?}"
                        );
                        (seen, worst) = (seen + 1, worst.max(off.abs()));
                    }
                }
            }
        }
    }
    assert!(seen > 500, "{seen}, worst {worst:e}");
}

/// After the last bounce a spring holds it, as deep as springs do.
#[test]
fn what_has_bounced_comes_to_rest_on_its_spring() {
    for rate_hz in RATES_HZ {
        for restitution in [0.2, 0.7] {
            let [settings, ..] = responses(restitution);
            let ball = ball(0.05);
            let bodies = [(1, body(&ball, 0.1))];
            let mut entities = vec![floor(0.0, 1000.0, 0.5), ball];
            let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
            let mut was_m = 0.05;
            for _ in 0..(3.0 * rate_hz) as u32 {
                manipulation.step(&mut entities, &mut [], rate_hz.recip());
                let now_m = energy_m(&manipulation.bodies()[0]);
                // The spring's own energy is not in it: at rest it is as deep as 10 um.
                assert!(now_m < was_m + 1e-9 || now_m < 4e-5, "{rate_hz} {restitution}: {was_m} {now_m}");
                was_m = now_m;
            }
            let depth_m = RADIUS_M - manipulation.bodies()[0].centre_W.y;
            assert!((depth_m - G / 1000.0_f64.powi(2)).abs() < 1e-12, "{rate_hz} {restitution}: {depth_m}");
        }
    }
}

/// By the scene as by either of the two.
#[test]
fn an_entity_that_says_its_restitution_bounces_off_springs_too() {
    let stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness: stiffness, ..Settings::default() };
    let rises_m = |floor: Entity, settings: Settings| {
        let ball = ball(0.05);
        let bodies = [(1, body(&ball, 0.1).moving(Vector3::new(0.0, -1.0, 0.0), Vector3::zeros()))];
        let mut entities = vec![floor, ball];
        let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
        let heights = (0..200).map(|_| {
            manipulation.step(&mut entities, &mut [], 1e-3);
            manipulation.bodies()[0].centre_W.y - RADIUS_M
        });
        // It comes down within 50 ms.
        heights.skip(50).fold(f64::MIN, f64::max)
    };
    let hard = floor(0.0, 1000.0, 0.5);
    assert!(rises_m(hard.clone(), settings) < 0.0, "critically damped");
    let exact_m = 0.36 * (0.05 + 0.5 / G);
    let rises = rises_m(hard.clone().with_restitution(0.6).unwrap(), settings);
    // Of the highest point up to half a tick is missed.
    assert!((rises - exact_m).abs() < 1e-5, "{rises} {exact_m}");
    // Forces that are known when a tick begins reflect nothing.
    let explicit = Settings { integrator: Integrator::Rk4, ..settings };
    let [without, with] = [hard.clone(), hard.with_restitution(0.6).unwrap()];
    assert_eq!(rises_m(without, explicit), rises_m(with, explicit));
}

/// Three alike in a row, at rest and touching; a fourth comes.
#[test]
fn newtons_cradle_goes_where_springs_press_what_rests() {
    for rate_hz in RATES_HZ {
        let [settings, ..] = responses(1.0);
        let settings = Settings { gravity_W: Vector3::zeros(), ..settings };
        let at =
            |x: f64| object(Sphere::new(RADIUS_M).unwrap(), Isometry3::translation(x, 0.0, 0.0), 1000.0, 0.0);
        let mut entities: Vec<Entity> = (0..3).map(|n| at(2.0 * RADIUS_M * f64::from(n))).collect();
        entities.push(at(-2.0 * RADIUS_M - 0.01));
        let mut bodies: Vec<(usize, Body)> = (0..4).map(|n| (n, body(&entities[n], 0.1))).collect();
        bodies[3].1 = bodies[3].1.moving(Vector3::x(), Vector3::zeros());
        let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
        for _ in 0..(0.05 * rate_hz) as u32 {
            manipulation.step(&mut entities, &mut [], rate_hz.recip());
        }
        let speeds: Vec<f64> = manipulation.bodies().iter().map(|body| body.velocity_W.x).collect();
        for (speed_m_s, expected) in speeds.iter().zip([0.0, 0.0, 1.0, 0.0]) {
            // Three impulses, each right to parts in a million.
            assert!((speed_m_s - expected).abs() < 1e-5, "{rate_hz}: {speeds:?}");
        }
    }
}

/// A box that lands flat has four points that all meet; and one that tumbles has energy that never grows.
#[test]
fn boxes_bounce_flat_as_balls_do_and_tumble_without_a_gain() {
    for rate_hz in RATES_HZ {
        for settings in responses(0.5) {
            let flat = Isometry3::translation(0.0, 0.06, 0.0);
            let turned = Isometry3::new(Vector3::new(0.0, 0.06, 0.0), Vector3::new(0.4, 0.2, 0.7));
            for (at, is_flat) in [(flat, true), (turned, false)] {
                let cube = object(Cuboid::new([0.04; 3]).unwrap(), at, 1000.0, 0.5);
                let bodies = [(1, body(&cube, 0.1))];
                let mut entities = vec![floor(0.0, 1000.0, 0.5), cube];
                let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
                let energy_m = |body: &Body| {
                    body.kinetic_energy_j() / (body.mass.mass_kg * G) + body.centre_W.y - RADIUS_M
                };
                let (mut was_m, mut first_m) = (energy_m(&manipulation.bodies()[0]), None);
                for _ in 0..(0.4 * rate_hz) as u32 {
                    manipulation.step(&mut entities, &mut [], rate_hz.recip());
                    let body = &manipulation.bodies()[0];
                    let now_m = energy_m(body);
                    // Springs as felt hold millimetres' worth.
                    let held_m = manipulation.elastic_energy_j() / (0.1 * G);
                    assert!(now_m < was_m + held_m + 1e-6, "{rate_hz} {is_flat}: {was_m} {now_m}");
                    was_m = was_m.min(now_m + held_m);
                    if body.velocity_W.y > 0.0 {
                        first_m = first_m.or(Some(now_m));
                    }
                }
                if is_flat {
                    // As for balls; four points, each a part in a million soft.
                    let kept = first_m.expect("a bounce") / 0.04;
                    assert!((kept - 0.25).abs() < 1e-4, "{rate_hz}: {kept} {settings:?}");
                }
            }
        }
    }
}

/// As many as a room holds, in one tick.
#[test]
fn all_of_four_hundred_balls_that_land_at_once_bounce() {
    const HEIGHT_M: f64 = 0.0201;
    let settings = Settings { response: Response::Bounce { restitution: 0.8 }, ..Settings::default() };
    let place = |at: u32| Vector3::new(f64::from(at % 20), 0.0, f64::from(at / 20)) * 0.1;
    let mut entities = vec![floor(0.0, 1000.0, 0.5)];
    entities.extend((0..400).map(|at| {
        let mut ball = ball(HEIGHT_M);
        ball.move_to(ball.X_WB.translation * ball.X_WB.rotation * nalgebra::Translation3::from(place(at)));
        ball
    }));
    let bodies: Vec<_> = (1..=400).map(|at| (at, body(&entities[at], 0.1))).collect();
    let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
    let mut highest_m = vec![0.0_f64; 400];
    for _ in 0..200 {
        manipulation.step(&mut entities, &mut [], 1e-3);
        for (highest_m, body) in highest_m.iter_mut().zip(manipulation.bodies()) {
            *highest_m = if body.velocity_W.y > 0.0 { highest_m.max(energy_m(body)) } else { *highest_m };
        }
    }
    // Parts in a million, as one by one.
    assert!(highest_m.iter().all(|m| (m / (0.64 * HEIGHT_M) - 1.0).abs() < 1e-5), "{highest_m:?}");
}

/// A light ball between a wall and a heavy one that comes bounces pi times the root of their ratio as often: far from the wall over
/// many ticks, near it all within one, and beyond 128 times what is left is lost.
#[test]
fn a_light_ball_between_a_wall_and_a_heavy_one_turns_it_back_or_stops_it() {
    let settings = Settings { gravity_W: Vector3::zeros(), ..responses(1.0)[0] };
    for (rate_hz, height_m) in RATES_HZ.into_iter().flat_map(|hz| [1e-4, 0.02].map(|height_m| (hz, height_m)))
    {
        for ratio in [20.0, 100.0, 1e4, 1e6] {
            let mut entities = vec![floor(0.0, 1000.0, 0.0), ball(height_m), ball(0.1)];
            let heavy = body(&entities[2], 1e-3 * ratio).moving(-Vector3::y(), Vector3::zeros());
            let bodies = [(1, body(&entities[1], 1e-3)), (2, heavy)];
            let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
            let began_j = heavy.kinetic_energy_j();
            let mut left = 1.0;
            for _ in 0..(0.1 * rate_hz) as usize {
                manipulation.step(&mut entities, &mut [], rate_hz.recip());
                let all_j: f64 = manipulation.bodies().iter().map(Body::kinetic_energy_j).sum();
                left = all_j / began_j;
                assert!(left < 1.0 + 1e-9, "{rate_hz} Hz, {height_m} m, {ratio}: {left}");
            }
            let is_kept = left > 0.995;
            let is_told = if ratio < 1000.0 { is_kept } else { height_m > 1e-3 || !is_kept };
            assert!(is_told, "{rate_hz} Hz, {height_m} m, {ratio}: {left}");
        }
    }
}

/// One corner comes after the other, within a tick or two, and each bounce drives another one down.
#[test]
fn what_tumbles_without_friction_keeps_its_energy_in_every_bounce() {
    let shapes: [Shape; 3] = [
        Cuboid::new([0.04, 0.03, 0.05]).unwrap().into(),
        Ellipsoid::new([0.03, 0.02, 0.025]).unwrap().into(),
        Cylinder::new(0.02, 0.05).unwrap().into(),
    ];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings {
        response: Response::Bounce { restitution: 1.0 },
        contact_stiffness,
        ..Settings::default()
    };
    for (rate_hz, shape) in RATES_HZ.into_iter().flat_map(|hz| shapes.iter().map(move |shape| (hz, shape))) {
        for seed in 0..10 {
            let noise = &mut Noise::new(seed);
            let X_WB = Isometry3::from_parts(Vector3::new(0.0, 0.15, 0.0).into(), noise.turn());
            let thing = object(shape.clone(), X_WB, 1000.0, 0.0).with_turning_friction(0.0, 0.0).unwrap();
            let state = body(&thing, 0.1).moving(noise.vector(0.5), noise.vector(20.0));
            let energy_j = |body: &Body| body.kinetic_energy_j() + body.mass.mass_kg * G * body.centre_W.y;
            let began_j = energy_j(&state);
            let mut was_j = began_j;
            let mut entities = vec![floor(0.0, 1000.0, 0.0), thing];
            let mut manipulation = Manipulation::new(&entities, &[(1, state)], settings).unwrap();
            for tick in 0..(1.5 * rate_hz) as u32 {
                manipulation.step(&mut entities, &mut [], rate_hz.recip());
                let now_j = energy_j(&manipulation.bodies()[0]);
                // Gravity is worth 5 mm/s between the ends of a tick of 2 ms and a bounce in it, of some 2 m/s: 1e-5 of squares;
                // and bodies that turn by 40 mrad in a tick swing by as much of their energy, in the air too.
                let (lost, gained) = ((was_j - now_j) / began_j, now_j / began_j - 1.0);
                assert!(lost < 2e-4 && gained < 2e-4, "{rate_hz}, {seed}, {tick}: {lost:e} {gained:e}");
                was_j = now_j;
            }
        }
    }
}

/// Coins and cards so small that rolling friction reaches as far as they do: their edges come down one after the other.
#[test]
fn what_is_small_beside_its_rolling_friction_gains_nothing_from_a_bounce() {
    let shapes: [Shape; 2] =
        [Cylinder::new(5e-4, 2e-4).unwrap().into(), Cuboid::new([1e-3, 2e-4, 8e-4]).unwrap().into()];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings {
        response: Response::Bounce { restitution: 1.0 },
        contact_stiffness,
        ..Settings::default()
    };
    for (at, shape) in shapes.iter().enumerate() {
        for rolling_m in [2e-4, 1e-2] {
            for seed in 0..20 {
                let noise = &mut Noise::new(seed);
                let X_WB = Isometry3::from_parts(Vector3::new(0.0, 2e-3, 0.0).into(), noise.turn());
                let thing = object(shape.clone(), X_WB, 1000.0, 0.3)
                    .with_turning_friction(rolling_m, rolling_m)
                    .unwrap();
                let state = body(&thing, 1e-4).moving(noise.vector(0.05), noise.vector(50.0));
                let energy_j =
                    |body: &Body| body.kinetic_energy_j() + body.mass.mass_kg * G * body.centre_W.y;
                let began_j = energy_j(&state);
                let mut entities = vec![floor(0.0, 1000.0, 0.3), thing];
                let mut manipulation = Manipulation::new(&entities, &[(1, state)], settings).unwrap();
                for tick in 0..2000 {
                    manipulation.step(&mut entities, &mut [], 1.0 / 4000.0);
                    let gained = energy_j(&manipulation.bodies()[0]) / began_j;
                    // Between two ticks gravity is worth g h, and a bounce is told by the tick's middle.
                    assert!(gained < 1.01, "{at}, {rolling_m}, {seed}, {tick}: {gained}");
                }
            }
        }
    }
}

/// Boxes that fall on each other and on a floor, which all bounce: an impulse that is passed on to the floor is no debt of who
/// passes it on, for which it would sink.
#[test]
fn what_was_hit_rests_on_its_springs_and_not_below_them() {
    let mut noise = Noise::new(7);
    for case in 0..60 {
        let restitution = [0.3, 0.6, 0.9, 0.95][case % 4];
        let rate_hz = RATES_HZ[case % 3];
        let [low, high] = [[0.1, 0.03, 0.06], [0.06; 3]].map(|size| Cuboid::new(size).unwrap());
        let beside = Vector3::new(noise.within(-0.04, 0.04), 0.25, noise.within(-0.02, 0.02));
        let mut entities = vec![
            floor(0.0, 1000.0, 0.3),
            object(low, Isometry3::translation(0.0, 0.01501, 0.0), 1000.0, 0.3),
            object(high, Isometry3::from_parts(beside.into(), noise.turn()), 1000.0, 0.3),
        ];
        for entity in &mut entities[1..] {
            entity.restitution = Some(restitution);
        }
        let mass_kg = noise.log_within(0.01, 0.5);
        let bodies = [mass_kg, mass_kg * noise.within(0.5, 4.0)]
            .into_iter()
            .zip(1..)
            .map(|(mass_kg, at)| (at, body(&entities[at], mass_kg)));
        let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
        let settings = Settings { contact_stiffness, ..Settings::default() };
        let mut manipulation = Manipulation::new(&entities, &bodies.collect::<Vec<_>>(), settings).unwrap();
        for _ in 0..(4.0 * rate_hz) as u32 {
            manipulation.step(&mut entities, &mut [], rate_hz.recip());
        }
        let sunk_m = 0.015 - manipulation.bodies()[0].centre_W.y;
        // The heavier one on a point of its stiffness.
        let deepest_m = 2.0 * G / 1000.0_f64.powi(2);
        assert!(sunk_m < deepest_m, "{case}: {sunk_m} m, e {restitution}, {rate_hz} Hz");
    }
}
