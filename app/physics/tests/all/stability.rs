//! Whatever is held: a gram or ten kilograms, between soft or stiff fingers, moved or shaken.
//!
//! Thousands of hands: `cargo test --release -p physics --test all stability:: -- --ignored` (a minute).
#![allow(non_snake_case)]

use crate::{common, noise};

use std::f64::consts::PI;

use common::*;
use haptics::{Cuboid, Sphere};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use noise::Noise;
use physics::{Integrator, Settings};

const HALF: f64 = 0.02;
/// Ticks until the fingers have closed, the object is lifted, the hand has been shaken, and holds still.
const CLOSED: usize = 300;
const LIFTED: usize = 800;
const SHAKEN: usize = 1800;
const STILL: usize = 3300;

/// A hand and what it holds.
#[derive(Debug, Clone)]
struct Case {
    mass: f64,
    stiffness: f64,
    damping: f64,
    fingers: usize,
    is_box: bool,
    squeeze: f64,
    shake: Vector3<f64>,
    hz: f64,
}

impl Case {
    fn new(seed: u64) -> Self {
        let noise = &mut Noise::new(seed);
        Self {
            mass: noise.log_within(1e-3, 10.0),
            stiffness: noise.log_within(10.0, 5000.0),
            damping: if noise.chance(0.5) { 1.0 } else { 0.0 },
            fingers: 1 + noise.below(3),
            is_box: noise.chance(0.5),
            squeeze: noise.log_within(2e-4, 5e-3),
            shake: noise.direction() * 0.005,
            hz: noise.within(1.0, 12.0),
        }
    }

    /// The hand before it does anything, without squeeze: points on the object's surface.
    fn points(&self) -> Vec<Vector3<f64>> {
        let x = Vector3::x() * HALF;
        match (self.fingers, self.is_box) {
            (1, _) => vec![Vector3::y() * HALF],
            (2, _) => vec![x, -x],
            (_, true) => vec![x, Vector3::new(-HALF, 0.0, 0.01), Vector3::new(-HALF, 0.0, -0.01)],
            _ => (0..3)
                .map(|i| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), f64::from(i) * PI / 1.5) * x)
                .collect(),
        }
    }

    fn world(&self, integrator: Integrator) -> World {
        let at = Isometry3::translation(0.0, HALF, 0.0);
        let object = if self.is_box {
            object(Cuboid::new([2.0 * HALF; 3]).unwrap(), at, self.stiffness, 0.8)
        } else {
            object(Sphere::new(HALF).unwrap(), at, self.stiffness, 0.8)
        };
        let object = object.with_damping(self.damping).unwrap();
        let body = body(&object, self.mass);
        let settings = Settings { integrator, ..Settings::default() };
        World::new(vec![floor(0.0, 2000.0, 0.8), object], &[(1, body)], settings, self.fingers)
    }

    fn hips(&self, tick: usize) -> Vec<Vector3<f64>> {
        let t = tick as f64 * DT;
        let share =
            |from: usize, to: usize| ((tick as f64 - from as f64) / (to - from) as f64).clamp(0.0, 1.0);
        let depth = share(0, CLOSED) * (0.005 + self.squeeze) - 0.005;
        // A single finger only presses.
        let up = if self.fingers == 1 { 0.0 } else { 0.015 * (1.0 - (share(CLOSED, LIFTED) * PI).cos()) };
        let swings = if (LIFTED..SHAKEN).contains(&tick) {
            let (begins, ends) = (share(LIFTED, LIFTED + 200), share(SHAKEN - 200, SHAKEN));
            self.shake * (2.0 * PI * self.hz * t).sin() * begins * (1.0 - ends)
        } else {
            Vector3::zeros()
        };
        let centre = Vector3::y() * (HALF + up);
        self.points().iter().map(|point| centre + point * (1.0 - depth / HALF) + swings).collect()
    }

    /// The object's largest speed ever, and its mean one at the beginning and at the end of when the hand holds still (m/s); how
    /// far it is in the end from where the hand is (m).
    fn run(&self, integrator: Integrator) -> [f64; 4] {
        let mut world = self.world(integrator);
        let (mut most, mut first, mut last) = (0.0_f64, 0.0, 0.0);
        for tick in 0..STILL {
            let before = *world.body();
            let forces = world.step(&self.hips(tick));
            assert!(forces.iter().all(|f| f.iter().all(|x| x.is_finite())) && world.body().is_finite());
            self.assert_reaction(&world, &before);
            let speed = world.body().velocity_W.norm();
            most = most.max(speed);
            if (SHAKEN..SHAKEN + 300).contains(&tick) {
                first += speed * speed / 300.0;
            } else if tick >= STILL - 300 {
                last += speed * speed / 300.0;
            }
        }
        let off = world.body().centre_W - Vector3::y() * (HALF + if self.fingers == 1 { 0.0 } else { 0.03 });
        [most, first.sqrt(), last.sqrt(), off.norm()]
    }

    /// What the users feel in a tick, and what the floor does, is what the body got.
    fn assert_reaction(&self, world: &World, before: &physics::Body) {
        let body = world.body();
        if body.velocity_W.norm() > 49.0 {
            // Speeds that are cut are no longer made of forces.
            return;
        }
        let floor: Vector3<f64> =
            world.manipulation.rows()[world.touches.len()..].iter().map(|r| r.force_W).sum();
        let users: Vector3<f64> = world.touches.iter().map(|touch| touch.force_on_user_W).sum();
        let weight = Vector3::new(0.0, -G * self.mass, 0.0);
        let got = (body.velocity_W - before.velocity_W) * self.mass;
        let given = (floor - users + weight) * DT;
        // Roundings of each summand.
        let parts =
            world.touches.iter().map(|touch| touch.force_on_user_W.norm()).sum::<f64>() + floor.norm();
        let size = (parts + weight.norm()) * DT + before.velocity_W.norm() * self.mass;
        assert!((got - given).norm() <= 1e-14 * size, "{self:?}: {got} {given}");
    }
}

impl Case {
    /// As fast as all that the fingers' springs and those of the floor under the weight have ever held could make it, in a hand
    /// that moves.
    fn physical_m_s(&self) -> f64 {
        let spring_j = 0.5 * self.stiffness * (self.squeeze + 0.01).powi(2) * self.fingers as f64;
        let floor = self.stiffness * 2000.0 / (self.stiffness + 2000.0);
        // On a soft spring a weight falls to where it is carried, and goes on as far again.
        let falls_m_s = G * (self.mass / floor).sqrt();
        (2.0 * spring_j / self.mass).sqrt() + 2.0 * PI * self.hz * 0.005 + 2.0 * falls_m_s
    }
}

fn hold_all(seeds: std::ops::Range<u64>) {
    let (mut quick, mut damped, hands) = (0, 0, seeds.end - seeds.start);
    for seed in seeds {
        let case = Case::new(seed);
        let [most, first, last, off] = case.run(Integrator::Implicit);
        assert!(most < case.physical_m_s(), "seed {seed}: {most} m/s, {case:?}");
        // Swings that the 0.3 s in which speeds are averaged hold twice at least do not grow; nothing hums.
        if (case.stiffness / case.mass).sqrt() > 40.0 {
            quick += 1;
            assert!(last < 1.2 * first + 1e-3, "seed {seed}: {first} then {last} m/s, {case:?}");
            // Without damping what a hand has shaken goes on; half of what the fingers did is a lot.
            assert!(last < 0.5, "seed {seed}: {last} m/s, {case:?}");
        }
        // With 1 N s/m at what is lighter than 50 g 1.5 s are thirty times what swings need to die down. What has
        // been dropped may roll, and what two fingers hold goes on turning about them.
        if case.damping > 0.0 && case.mass < 0.05 && case.fingers != 2 && off < 0.003 {
            damped += 1;
            assert!(last < 1e-3, "seed {seed}: {last} m/s, {case:?}");
        }
    }
    assert!(3 * quick > hands && 20 * damped > hands, "{quick} {damped} of {hands}");
}

#[test]
fn whatever_a_hand_holds_stays_calm() {
    hold_all(0..150);
}

#[test]
#[ignore = "a minute; see the top of the file"]
fn whatever_thousands_of_hands_hold_stays_calm() {
    hold_all(150..6000);
}

#[test]
fn the_corners_of_what_is_promised_are_calm_too() {
    for mass in [1e-3, 0.1, 10.0] {
        for stiffness in [10.0, 500.0, 5000.0] {
            for damping in [0.0, 1.0] {
                for fingers in 1..=3 {
                    for is_box in [false, true] {
                        let shake = Vector3::new(0.003, 0.004, 0.001);
                        let case =
                            Case { mass, stiffness, damping, fingers, is_box, squeeze: 2e-3, shake, hz: 8.0 };
                        let [most, first, last, _] = case.run(Integrator::Implicit);
                        assert!(most < case.physical_m_s(), "{most} m/s, {case:?}");
                        if (stiffness / mass).sqrt() > 40.0 {
                            assert!(last < 1.2 * first + 1e-3, "{first} then {last} m/s, {case:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn the_integrators_of_the_thesis_throw_a_gram_away() {
    // k dt^2 / m is 10 here.
    let case = Case {
        mass: 1e-3,
        stiffness: 5000.0,
        damping: 0.0,
        fingers: 2,
        is_box: false,
        squeeze: 1e-3,
        shake: Vector3::x() * 1e-3,
        hz: 3.0,
    };
    for integrator in [Integrator::ThesisEuler, Integrator::Rk4] {
        let [most, ..] = case.run(integrator);
        assert!(most > 1.0, "{integrator:?} {most}");
    }
    let [most, _, last, _] = case.run(Integrator::Implicit);
    // Undamped: what closing and shaking left goes on.
    assert!(most < 0.5 && last < 5e-3, "{most} {last}");
}

#[test]
fn forces_on_users_are_what_bodies_got_with_every_integrator() {
    // Asserted in every tick of the run; of objects heavy enough for all of them.
    for (_, integrator) in Integrator::NAMES {
        for seed in 0..8 {
            let case = Case::new(seed);
            let mass = 0.2 + case.mass;
            let case = Case { mass, stiffness: case.stiffness.min(1000.0), ..case };
            let [most, ..] = case.run(integrator);
            assert!(most < case.physical_m_s() + 1.0, "{integrator:?} {most} {case:?}");
        }
    }
}
