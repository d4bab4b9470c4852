//! Torsional and rolling friction of contacts between entities, against closed forms.
#![allow(non_snake_case)]

use crate::common;

use crate::noise::Noise;
use crate::thrown::{KINDS, shape};
use common::{G, body, object};
use haptics::{Capsule, Cuboid, Cylinder, Entity, Plane, Shape, Sphere};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, ContactStiffness, Manipulation, Settings, Sleep};

const R: f64 = 0.02;
const MASS: f64 = 0.1;
/// A ball swings on it at 2000 rad/s.
const STIFFNESS: f64 = MASS * 2000.0 * 2000.0;

/// Hard, so that a ball is as high above the ground as it is thick.
fn settings() -> Settings {
    Settings {
        contact_stiffness: ContactStiffness::Given { stiffness_n_per_m: STIFFNESS, damping_ratio: 1.0 },
        sleep: None,
        ..Settings::default()
    }
}

/// Things on a plane that falls by so much along x (rad), with these lengths: the plane's, that of each thing, the last one of
/// all further ones.
struct Slope {
    entities: Vec<Entity>,
    manipulation: Manipulation,
    dt_s: f64,
}

impl Slope {
    fn new(
        falls_rad: f64,
        things: Vec<(Shape, Isometry3<f64>, [Vector3<f64>; 2])>,
        lengths_m: &[[f64; 2]],
        rate_hz: f64,
    ) -> Self {
        let normal = Vector3::new(falls_rad.sin(), falls_rad.cos(), 0.0);
        let with = |at: usize, entity: Entity| {
            let [torsional_m, rolling_m] = lengths_m[at.min(lengths_m.len() - 1)];
            entity.with_turning_friction(torsional_m, rolling_m).unwrap()
        };
        let plane = object(Plane::new(normal, 0.0).unwrap(), Isometry3::identity(), 1000.0, 0.5);
        let (mut entities, mut bodies) = (vec![with(0, plane)], Vec::new());
        for (shape, X_WB, [velocity_W, turns_W]) in things {
            let entity = with(entities.len(), object(shape, X_WB, 1000.0, 0.5));
            bodies.push((entities.len(), body(&entity, MASS).moving(velocity_W, turns_W)));
            entities.push(entity);
        }
        let manipulation = Manipulation::new(&entities, &bodies, settings()).unwrap();
        Self { entities, manipulation, dt_s: rate_hz.recip() }
    }

    fn run(&mut self, seconds: f64) -> &Body {
        for _ in 0..(seconds / self.dt_s).round() as u32 {
            let made = self.manipulation.step(&mut self.entities, &mut [], self.dt_s);
            assert_eq!(made.unsolved, 0);
        }
        &self.manipulation.bodies()[0]
    }
}

/// A ball where it rests on the slope.
fn ball(falls_rad: f64, motion: [Vector3<f64>; 2]) -> (Shape, Isometry3<f64>, [Vector3<f64>; 2]) {
    let sunk_m = MASS * G * falls_rad.cos() / STIFFNESS;
    let at = Vector3::new(falls_rad.sin(), falls_rad.cos(), 0.0) * (R - sunk_m);
    (Sphere::new(R).unwrap().into(), Isometry3::from_parts(at.into(), UnitQuaternion::identity()), motion)
}

/// `I dw/dt = -s m g`, with `I = 2/5 m r^2`.
#[test]
fn a_ball_that_spins_is_braked_by_torsional_friction_and_stops() {
    for rate_hz in [500.0, 1000.0, 4000.0] {
        for s_m in [1e-5, 1e-4, 1e-3] {
            let brakes = 2.5 * s_m * G / (R * R);
            let (turns, seconds) = (0.5 * brakes, 0.4);
            let spins = ball(0.0, [Vector3::zeros(), Vector3::y() * turns]);
            let mut slope = Slope::new(0.0, vec![spins], &[[s_m, 0.0]], rate_hz);
            let left = slope.run(seconds).angular_velocity_W();
            let expected = turns - brakes * seconds;
            // The first tick has no force to go by yet, and there it has not settled on its depth: a tick's way each.
            assert!((left.y - expected).abs() < 2.5 * brakes / rate_hz, "{rate_hz} {s_m}: {left} {expected}");
            assert!(left.x.abs().max(left.z.abs()) < 1e-9, "{left}");
            let rests = slope.run(0.2).angular_velocity_W();
            assert!(rests.norm() < 1e-12, "{rate_hz} {s_m}: {rests}");
        }
    }
}

/// About the point of contact `(1 + 2/5) m r dv/dt = -rho m g`; of a cylinder, on a line, `(1 + 1/2)`.
#[test]
fn what_rolls_is_braked_by_rolling_friction_and_stops() {
    let lies = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let shapes: [(Shape, f64); 3] = [
        (Sphere::new(R).unwrap().into(), 1.4),
        (Cylinder::new(R, 0.05).unwrap().into(), 1.5),
        (Capsule::new(R, 0.0).unwrap().into(), 1.4),
    ];
    for rate_hz in [500.0, 1000.0, 4000.0] {
        for (shape, inertia) in &shapes {
            for rho_m in [2e-5, 1e-4, 5e-4] {
                let brakes = rho_m * G / (inertia * R);
                let (speed, seconds) = (0.5 * brakes, 0.4);
                // On two points it sinks by half as much; that settles within a few ticks.
                let at = Isometry3::from_parts(Vector3::new(0.0, R - 2e-6, 0.0).into(), lies);
                let rolls = [Vector3::x() * speed, Vector3::z() * (-speed / R)];
                let mut slope = Slope::new(0.0, vec![(shape.clone(), at, rolls)], &[[0.0, rho_m]], rate_hz);
                let left = slope.run(seconds).velocity_W;
                let expected = speed - brakes * seconds;
                assert!(
                    (left.x - expected).abs() < 4.0 * brakes / rate_hz + 1e-4 * speed,
                    "{rate_hz} {shape:?} {rho_m}: {left} {expected}"
                );
                // The spring of the patch swings out at 500 / s.
                let rests = slope.run(0.2).velocity_W;
                assert!(rests.norm() < 1e-6 * speed, "{rate_hz} {shape:?} {rho_m}: {rests}");
            }
        }
    }
}

/// It stays where the slope is below `rho / r`, and rolls with what is left beyond that.
#[test]
fn a_ball_on_a_slope_is_held_up_to_where_its_rolling_friction_ends() {
    let rho_m = 2e-4;
    let ends_rad = (rho_m / R).atan();
    for rate_hz in [1000.0, 4000.0] {
        for share in [0.5, 0.99] {
            let falls = share * ends_rad;
            let mut slope =
                Slope::new(falls, vec![ball(falls, [Vector3::zeros(); 2])], &[[0.0, rho_m]], rate_hz);
            // In the first two ticks it has no force to go by, and then a hundredth of what drives it to stop with.
            slope.run(1.0);
            let from = slope.manipulation.bodies()[0].centre_W;
            let way_m = (slope.run(10.0).centre_W - from).norm();
            assert!(way_m < 1e-12, "{rate_hz} {share}: {way_m}");
        }
        for share in [1.02, 2.0, 20.0] {
            let falls = share * ends_rad;
            let mut slope =
                Slope::new(falls, vec![ball(falls, [Vector3::zeros(); 2])], &[[0.0, rho_m]], rate_hz);
            let gains = G * (falls.sin() - rho_m / R * falls.cos()) / 1.4;
            let speed = slope.run(1.0).velocity_W.norm();
            // It is not there in the first two ticks, and then the spring of the patch, which swings at 500 / s, winds up.
            let early = G * falls.sin() * (3.0 / rate_hz + 5e-3);
            assert!((speed - gains).abs() < early, "{rate_hz} {share}: {speed} {gains}");
        }
    }
}

/// A ball spins on another one that is free to turn: what one loses the other gains, until both turn alike.
#[test]
fn what_spins_on_another_turns_it_with_what_it_loses() {
    let (s_m, turns) = (1e-3, 5.0);
    let brakes = 2.5 * s_m * G / (R * R);
    for rate_hz in [1000.0, 4000.0] {
        let lower = ball(0.0, [Vector3::zeros(); 2]);
        let on_it = Isometry3::translation(0.0, 3.0 * R - 6e-6, 0.0);
        let upper = (Shape::from(Sphere::new(R).unwrap()), on_it, [Vector3::zeros(), Vector3::y() * turns]);
        let lengths_m = [[0.0; 2], [0.0; 2], [s_m, 0.0]];
        let mut slope = Slope::new(0.0, vec![lower, upper], &lengths_m, rate_hz);
        for part in 1..=8 {
            let expected = (brakes * 0.01 * f64::from(part)).min(0.5 * turns);
            slope.run(0.01);
            let spins = [0, 1].map(|body| slope.manipulation.bodies()[body].angular_velocity_W().y);
            assert!((spins[0] + spins[1] - turns).abs() < 1e-9, "{rate_hz}: {spins:?}");
            // Three ticks until all of the weight is there.
            assert!((spins[0] - expected).abs() < 4.0 * brakes / rate_hz, "{rate_hz}: {spins:?} {expected}");
        }
    }
}

/// A torque that is no number would silence the contact.
#[test]
fn lengths_that_no_patch_has_are_refused() {
    let ball = object(Sphere::new(R).unwrap(), Isometry3::identity(), 1000.0, 0.5);
    for length_m in [-1e-9, 1.1, 1e308, f64::INFINITY, f64::NAN] {
        for [torsional_m, rolling_m] in [[length_m, 0.0], [0.0, length_m]] {
            let error = ball.clone().with_turning_friction(torsional_m, rolling_m).unwrap_err();
            assert!(error.to_string().contains("a number from 0 to 1"), "{error}");
        }
    }
}

/// Of a box it is left to its corners: it neither turns over at another angle nor slides otherwise.
#[test]
fn a_box_does_not_know_of_it() {
    for lengths_m in [[0.0; 2], [1e-2; 2]] {
        let at = Isometry3::translation(0.0, R - 1e-6, 0.0);
        let slides = [Vector3::new(0.3, 0.0, 0.1), Vector3::y()];
        let cube = (Shape::from(Cuboid::new([2.0 * R; 3]).unwrap()), at, slides);
        let mut slope = Slope::new(0.0, vec![cube.clone()], &[lengths_m], 1000.0);
        let mut without = Slope::new(0.0, vec![cube], &[[0.0; 2]], 1000.0);
        assert_eq!(slope.run(0.5), without.run(0.5));
    }
}

/// For how long things of all shapes move that are let fall into a box, in a heap, six seconds at most.
///
/// And how fast the fastest is then (m/s).
fn heap_moves(count: usize, seed: u64) -> [f64; 2] {
    const WALL_M: f64 = 0.12;
    let noise = &mut Noise::new(seed);
    let with = |entity: Entity| entity.with_turning_friction(2e-4, 2e-4).unwrap();
    let plane = |normal: Vector3<f64>, offset_m: f64| {
        let plane = Plane::new(normal, offset_m).unwrap();
        with(object(plane, Isometry3::identity(), 1000.0, 0.5))
    };
    let mut entities = vec![plane(Vector3::y(), 0.0)];
    let walls = [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()];
    entities.extend(walls.map(|normal| plane(normal, -WALL_M)));
    let mut bodies = Vec::new();
    for place in 0..count {
        let shape = shape(KINDS[noise.below(KINDS.len())], noise);
        let [x, y, z] = [place % 3, place / 9, place / 3 % 3].map(|at| 0.06 * at as f64);
        let at = Vector3::new(x - 0.06, y + 0.06, z - 0.06);
        let X_WB = Isometry3::from_parts(at.into(), noise.turn());
        let entity = with(object(shape, X_WB, 1000.0, 0.5));
        bodies.push((entities.len(), body(&entity, noise.log_within(0.01, 0.2))));
        entities.push(entity);
    }
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness, sleep: Some(Sleep::default()), ..Settings::default() };
    let mut manipulation = Manipulation::new(&entities, &bodies, settings).unwrap();
    let mut ticks = 0;
    while ticks < 6000 && !manipulation.awake().is_empty() {
        manipulation.step(&mut entities, &mut [], 1e-3);
        ticks += 1;
    }
    let speeds = manipulation.bodies().iter().map(|body| body.velocity_W.norm());
    [1e-3 * f64::from(ticks), speeds.fold(0.0, f64::max)]
}

#[test]
fn five_of_six_piles_of_mixed_shapes_come_to_rest_within_five_seconds() {
    let counts = [18, 24, 30, 36, 18, 24];
    let at_rest = counts.into_iter().enumerate().filter(|(at, count)| {
        let [moves_s, fastest] = heap_moves(*count, (*count + 100 * (at / 4)) as u64);
        moves_s < 5.0 && fastest == 0.0
    });
    // One that leans may take longer; which one, rounding decides.
    assert!(at_rest.count() >= 5);
}

#[test]
#[ignore = "a minute on two CPUs"]
fn of_48_piles_of_mixed_shapes_at_least_40_come_to_rest_within_five_seconds() {
    let mut at_rest = 0;
    for count in [18, 24, 30, 36] {
        at_rest += (0..12).filter(|k| heap_moves(count, count as u64 + 100 * k)[0] < 5.0).count();
    }
    assert!(at_rest >= 40, "{at_rest}");
}
