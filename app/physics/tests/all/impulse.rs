//! How contacts between entities answer: impulses that reflect, springs that press, and depths that are let out.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, ContactStiffness, Integrator, MassProperties, Response, Settings};

const RADIUS: f64 = 0.02;

fn impulse(restitution: f64) -> Settings {
    Settings { response: Response::Impulse { restitution }, ..Settings::default() }
}

/// A ball whose lowest point is so high above the floor (m), moving.
fn ball(
    height: f64,
    mass: f64,
    mu: f64,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    settings: Settings,
) -> World {
    let ball =
        object(Sphere::new(RADIUS).unwrap(), Isometry3::translation(0.0, RADIUS + height, 0.0), 1000.0, mu);
    let body = body(&ball, mass).moving(velocity, spin);
    World::new(vec![floor(0.0, 2000.0, mu), ball], &[(1, body)], settings, 1)
}

fn dropped(height: f64, restitution: f64) -> World {
    ball(height, 0.1, 0.5, Vector3::zeros(), Vector3::zeros(), impulse(restitution))
}

/// Of a weight on a floor, as a height (m).
fn energy_m(body: &Body) -> f64 {
    body.kinetic_energy_j() / (body.mass.mass_kg * G) + body.centre_W.y - RADIUS
}

const AWAY: [Vector3<f64>; 1] = [Vector3::new(1.0, 1.0, 1.0)];

#[test]
fn a_ball_bounces_as_high_as_restitution_squared() {
    //= melder#6.1 type=test
    for restitution in [0.0, 0.3, 0.5, 0.8, 1.0] {
        for height in [0.05, 0.2, 0.3, 0.50123] {
            let mut world = dropped(height, restitution);
            let (mut highest, mut has_met) = (0.0_f64, false);
            for _ in 0..((2.0 * height / G).sqrt() * 2.1 / DT) as usize {
                world.step(&AWAY);
                has_met |= world.body().velocity_W.y > 0.0;
                highest = if has_met { highest.max(world.body().centre_W.y - RADIUS) } else { 0.0 };
            }
            let exact = restitution * restitution * height;
            // It turns where the tick begins in which it would meet the floor: up to v dt above it, and what it has not
            // fallen there it does not lose a share of.
            let early = (1.0 - restitution * restitution) * (2.0 * G * height).sqrt() * DT;
            // What gravity takes in the tick of the bounce, and the tick in which the highest point is looked at.
            let late = G * DT * DT;
            let off = highest - exact;
            assert!(
                (-late..=early + 1e-12).contains(&off),
                "e {restitution}, {height} m: {highest} for {exact}"
            );
        }
    }
}

#[test]
fn a_velocity_is_reflected_at_the_normal_and_only_if_it_approaches() {
    let settings = Settings { gravity_W: Vector3::zeros(), ..impulse(0.6) };
    let velocity = Vector3::new(0.7, -2.0, -0.4);
    let mut world = ball(1e-5, 0.1, 0.0, velocity, Vector3::zeros(), settings);
    world.step(&AWAY);
    let n = Vector3::y();
    let reflected = velocity - n * (1.6 * velocity.dot(&n));
    // A bounce is a million times harder than the ball.
    assert!((world.body().velocity_W - reflected).norm() < 1e-5, "{}", world.body().velocity_W);
    for _ in 0..5 {
        world.step(&AWAY);
        assert!((world.body().velocity_W - reflected).norm() < 1e-5);
    }
    let mut world = ball(-1e-4, 0.1, 0.0, -velocity, Vector3::zeros(), settings);
    world.step(&AWAY);
    assert_eq!(world.body().velocity_W, -velocity);
}

#[test]
fn a_ball_that_meets_the_floor_aslant_rolls_off_or_slides_as_coulomb_says() {
    for (mu, v_t, e) in [(0.5, 1.0, 0.5), (0.1, 3.0, 0.5), (0.3, 5.0, 0.9), (1.0, 2.0, 0.0)] {
        let settings = Settings { gravity_W: Vector3::zeros(), ..impulse(e) };
        let v_n = 2.0;
        let mut world = ball(1e-5, 0.1, mu, Vector3::new(v_t, -v_n, 0.0), Vector3::zeros(), settings);
        world.step(&AWAY);
        // Rolling takes 2/7 of the tangential velocity of a solid ball; friction gives mu (1 + e) v_n at most.
        let loses = (2.0 / 7.0 * v_t).min(mu * (1.0 + e) * v_n);
        let body = world.body();
        // Without a bounce it stops where it meets the floor, 1e-5 m on.
        let leaves = if e > 0.0 { e * v_n } else { -1e-5 / DT };
        let off = body.velocity_W - Vector3::new(v_t - loses, leaves, 0.0);
        assert!(off.norm() < 1e-4, "{}", body.velocity_W);
        let spin = -2.5 * loses / RADIUS;
        assert!(
            (body.angular_velocity_W().z - spin).abs() < 1e-3 * spin.abs(),
            "{}",
            body.angular_velocity_W()
        );
    }
}

#[test]
fn the_energy_of_a_bouncing_ball_never_grows() {
    for restitution in [0.0, 0.3, 0.5, 0.8, 1.0] {
        let mut world = dropped(0.3, restitution);
        let mut energy = energy_m(world.body());
        let mut bounces = 0;
        for _ in 0..20_000 {
            let before = world.body().velocity_W.y;
            world.step(&AWAY);
            bounces += usize::from(before < 0.0 && world.body().velocity_W.y > 0.0);
            let now = energy_m(world.body());
            // Roundings of heights below 1 m; and what a million to one lets sink is let out again.
            assert!(now < energy + 1e-9, "e {restitution}: {energy} then {now}");
            energy = now;
        }
        if restitution == 1.0 {
            // (g dt)^2 / 2 per mass and bounce, which is 4.9 um of height, and what a millionth of the velocity is: 1.2 um.
            let lost = 0.3 - energy;
            assert!(bounces > 35 && lost < f64::from(bounces as u32) * 0.7 * G * DT * DT, "{bounces} {lost}");
        } else {
            assert!(energy.abs() < 1e-7, "at rest: {energy}");
        }
    }
}

#[test]
fn a_ball_held_down_by_a_finger_rests_without_vibration() {
    for restitution in [0.0, 0.5, 0.9, 1.0] {
        for mass in [0.001, 0.1, 2.0] {
            let mut world = ball(0.01, mass, 0.5, Vector3::zeros(), Vector3::zeros(), impulse(restitution));
            let mut last = Vec::new();
            for tick in 0..6000 {
                let t = f64::from(tick) * DT;
                let depth = 2e-3 * ((t - 0.5) / 1.0).clamp(0.0, 1.0) + 0.02 * (t - 0.5).clamp(-0.5, 0.0);
                let force = world.step(&[Vector3::new(0.0, 2.0 * RADIUS - depth, 0.0)])[0];
                if tick >= 5000 {
                    last.push((force.y, world.body().velocity_W.norm()));
                }
            }
            let forces = last.iter().map(|(force, _)| *force);
            let (least, most) = forces.fold((f64::MAX, f64::MIN), |(a, b), f| (a.min(f), b.max(f)));
            let fastest = last.iter().map(|(_, speed)| *speed).fold(0.0, f64::max);
            // 2 N from 2 mm at 1000 N/m; a floor that gives a millionth of the body's mobility.
            assert!((least - 2.0).abs() < 0.01, "{least}");
            assert!(
                most - least < 1e-6 && fastest < 1e-6,
                "e {restitution}, {mass} kg: {least} to {most} N, {fastest} m/s"
            );
        }
    }
}

/// A box rests for so many seconds, and moves by no more than its share of what it may in ten minutes.
fn rest_for(seconds: u32) {
    let share = f64::from(seconds) / 600.0;
    for settings in [impulse(0.5), Settings::default()] {
        let cuboid = object(
            Cuboid::new([0.06, 0.04, 0.03]).unwrap(),
            Isometry3::translation(0.0, 0.021, 0.0),
            1000.0,
            0.5,
        );
        let body = body(&cuboid, 0.1);
        let mut world = World::new(vec![floor(0.0, 2000.0, 0.5), cuboid], &[(1, body)], settings, 1);
        for _ in 0..5000 {
            world.step(&AWAY);
        }
        let start = *world.body();
        let mut fastest = 0.0_f64;
        for _ in 0..1000 * seconds {
            world.step(&AWAY);
            fastest = fastest.max(world.body().velocity_W.norm());
        }
        let moved = (world.body().centre_W - start.centre_W).norm();
        let turned = world.body().orientation.angle_to(&start.orientation);
        assert!(
            moved < 1e-9 * share && turned < 1e-7 * share && fastest < 1e-7,
            "{:?}: {moved} {turned} {fastest}",
            settings.response
        );
    }
}

#[test]
fn a_box_on_the_floor_rests_for_a_minute() {
    rest_for(60);
}

/// `cargo test --release -p physics --test all impulse:: -- --ignored`
#[test]
#[ignore = "half a minute"]
fn a_box_on_the_floor_rests_for_an_hour() {
    rest_for(3600);
}

#[test]
fn springs_never_pull_and_press_with_depth_and_damping() {
    //= melder#6.2 type=test
    // Both surfaces' springs in series, both dampings together: of what the tick's end has.
    let k = 1000.0 * 2000.0 / 3000.0;
    for (depth, v) in [(9e-4, 0.0), (9e-4, -0.5), (9e-4, 0.3), (9e-4, 2.0), (1e-6, -1.0)] {
        let mass = 1e3;
        let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
        let mut world = ball(-depth, mass, 0.0, Vector3::y() * v, Vector3::zeros(), settings);
        world.step(&AWAY);
        let row = world.manipulation.rows()[0];
        // A tonne does not mind: its velocity is that of the beginning, but for a part in a million.
        let expected = (k * (depth - v * DT) - 1.0 * v).max(0.0);
        assert!((row.force_W.y - expected).abs() < 1e-5 * (expected + 1e-9), "{} {expected}", row.force_W.y);
    }
    let mut world =
        ball(0.3, 0.05, 0.5, Vector3::new(0.5, 0.0, 0.0), Vector3::z() * 20.0, Settings::default());
    for _ in 0..5000 {
        world.step(&AWAY);
        assert!(world.manipulation.rows().iter().all(|row| row.normal_W.dot(&row.force_W) >= 0.0));
    }
}

#[test]
fn a_spring_without_damping_gives_back_what_it_takes_but_for_the_tick() {
    // Backward Euler loses omega dt / 2 of the energy per radian: pi omega dt / 2 in half a swing.
    let (mass, k) = (0.5, 1000.0 * 2000.0 / 3000.0);
    let sphere =
        object(Sphere::new(RADIUS).unwrap(), Isometry3::translation(0.0, RADIUS + 0.05, 0.0), 1000.0, 0.0);
    let sphere = sphere.with_damping(0.0).unwrap();
    let body = body(&sphere, mass);
    let mut world = World::new(vec![floor(0.0, 2000.0, 0.0), sphere], &[(1, body)], Settings::default(), 1);
    let mut highest = 0.0_f64;
    for tick in 0..350 {
        world.step(&AWAY);
        highest = if tick > 150 { highest.max(world.body().centre_W.y - RADIUS) } else { 0.0 };
    }
    let lost = 1.0 - highest / 0.05;
    let expected = std::f64::consts::PI * (k / mass).sqrt() * DT;
    assert!(lost > 0.5 * expected && lost < 1.5 * expected, "{lost} {expected}");
}

#[test]
fn what_is_put_deep_into_the_floor_is_let_out_and_does_not_hop() {
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    for settings in [impulse(0.8), Settings::default(), Settings { contact_stiffness, ..Settings::default() }]
    {
        for integrator in [Integrator::Implicit, Integrator::ThesisEuler] {
            let settings = Settings { integrator, ..settings };
            for depth in [0.0006, 0.003, 0.01, 0.03] {
                let mut world = ball(-depth, 0.1, 0.5, Vector3::zeros(), Vector3::zeros(), settings);
                let mut highest = f64::MIN;
                let mut fastest = 0.0_f64;
                for _ in 0..3000 {
                    world.step(&AWAY);
                    highest = highest.max(world.body().centre_W.y - RADIUS);
                    fastest = fastest.max(world.body().velocity_W.norm());
                }
                let rests = world.body().centre_W.y - RADIUS;
                // The springs hang by m g / k = 1.5 mm; a tenth of a millimetre is a twitch. A
                // spring that is drawn at 0.2 m/s makes what hangs from it swing between none and twice that.
                assert!(highest < 1e-4 && fastest < 0.42, "{settings:?} {depth}: {highest} {fastest}");
                assert!(rests > -1.6e-3, "{rests}");
            }
        }
    }
}

#[test]
fn a_body_of_given_mass_is_stopped_at_its_rim_as_at_its_centre() {
    // A rod's end has a quarter of its mass: it is that which bounces.
    let rod = object(
        Cuboid::new([0.2, 0.01, 0.01]).unwrap(),
        Isometry3::translation(0.0, 0.0051, 0.0),
        1000.0,
        0.0,
    );
    let mass = MassProperties::of_shape(&rod.shape, 0.1).unwrap();
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    let pose = Isometry3::from_parts(
        Vector3::new(0.0, 0.1 * 0.3_f64.sin() + 0.005 * 0.3_f64.cos() + 1e-6, 0.0).into(),
        turn,
    );
    let rod = Entity { X_WB: pose, previous_X_WB: pose, ..rod };
    let body = Body::at_rest(mass, &pose).moving(Vector3::new(0.0, -1.0, 0.0), Vector3::zeros());
    let settings = Settings { gravity_W: Vector3::zeros(), ..impulse(0.5) };
    let mut world = World::new(vec![floor(0.0, 2000.0, 0.0), rod], &[(1, body)], settings, 1);
    world.step(&AWAY);
    let row = *world.manipulation.rows().iter().max_by(|a, b| a.force_W.y.total_cmp(&b.force_W.y)).unwrap();
    let body = world.body();
    let end = body.velocity_W + body.angular_velocity_W().cross(&row.arms_W[0]);
    assert!((end.y - 0.5).abs() < 1e-4, "{end}");
}

#[test]
fn a_bounce_that_a_finger_ends_within_the_tick_is_none() {
    // Pressed with 10 N, a gram that leaves with 1 m/s is back after 0.2 ms; without losses it would do so for ever.
    for (mass, stiffness) in [(1e-3, 5000.0), (1e-3, 1000.0), (5e-3, 5000.0)] {
        for restitution in [0.5, 1.0] {
            let at = Isometry3::translation(0.0, RADIUS + 1e-4, 0.0);
            let ball = object(Sphere::new(RADIUS).unwrap(), at, stiffness, 0.5).with_damping(0.0).unwrap();
            let body = body(&ball, mass).moving(Vector3::y() * -1.0, Vector3::zeros());
            let mut world =
                World::new(vec![floor(0.0, 2000.0, 0.5), ball], &[(1, body)], impulse(restitution), 1);
            let mut bounced = 0;
            for tick in 0..500 {
                world.step(&[Vector3::new(0.0, 2.0 * RADIUS + if tick == 0 { 1e-3 } else { -2e-3 }, 0.0)]);
                bounced += usize::from(tick >= 100 && world.body().velocity_W.y.abs() > 1e-3);
            }
            assert_eq!(bounced, 0, "{mass} kg, {stiffness} N/m, e {restitution}");
        }
    }
}

/// How high a ball comes back that is dropped from 0.2 m, as a share (m/m); who has which restitution and stiffness.
fn comes_back(ball_has: (Option<f64>, f64), floor_has: (Option<f64>, f64), scene: f64) -> f64 {
    let has = |entity: Entity, (restitution, stiffness): (Option<f64>, f64)| Entity {
        restitution,
        stiffness_n_per_m: stiffness,
        ..entity
    };
    let height = 0.2;
    let at = Isometry3::translation(0.0, RADIUS + height, 0.0);
    let ball = has(object(Sphere::new(RADIUS).unwrap(), at, 1.0, 0.5), ball_has);
    let body = body(&ball, 0.1);
    let mut world =
        World::new(vec![has(floor(0.0, 1.0, 0.5), floor_has), ball], &[(1, body)], impulse(scene), 1);
    let (mut highest, mut has_met) = (0.0_f64, false);
    for _ in 0..((2.0 * height / G).sqrt() * 2.1 / DT) as usize {
        world.step(&AWAY);
        has_met |= world.body().velocity_W.y > 0.0;
        highest = if has_met { highest.max(world.body().centre_W.y - RADIUS) } else { 0.0 };
    }
    highest / height
}

#[test]
fn a_ball_bounces_by_what_both_surfaces_give_back_of_their_share() {
    let composite = (0.64 * 2000.0 + 0.09 * 500.0) / 2500.0;
    for (ball, floor, scene, share) in [
        ((None, 500.0), (None, 2000.0), 0.5, 0.25),
        ((Some(0.8), 500.0), (None, 2000.0), 0.5, 0.64),
        ((None, 500.0), (Some(0.8), 2000.0), 0.5, 0.64),
        ((Some(0.8), 500.0), (Some(0.8), 2000.0), 0.0, 0.64),
        ((Some(0.8), 500.0), (Some(0.3), 2000.0), 0.0, composite),
        ((Some(0.0), 500.0), (Some(0.0), 2000.0), 1.0, 0.0),
    ] {
        let off = comes_back(ball, floor, scene) - share;
        // A tick early, v dt of 0.2 m of which a share would be lost, and a tick of falling late.
        let early = (1.0 - share) * (2.0 * G / 0.2_f64).sqrt() * DT;
        assert!((-G * DT * DT / 0.2..=early + 1e-12).contains(&off), "{ball:?} {floor:?}: {off}");
    }
}

#[test]
fn a_share_that_is_none_is_refused() {
    for wrong in [-0.1, 1.1, f64::NAN] {
        let refused = floor(0.0, 1000.0, 0.5).with_restitution(wrong).unwrap_err().to_string();
        assert!(refused.contains("restitution") && refused.contains("from 0 to 1"), "{refused}");
    }
    assert_eq!(floor(0.0, 1000.0, 0.5).with_restitution(1.0).unwrap().restitution, Some(1.0));
}
