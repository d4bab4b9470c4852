//! What acts between a finger and a body without a touch: the body gets what the user feels, with the sign turned.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{Cuboid, Effects, Entity, FingerEffects, Limits, Magnetism, Moment};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Integrator, MAX_PULLS, Manipulation, Pull, Settings};

const HALF: f64 = 0.02;
const MASS: f64 = 0.05;

fn weightless(integrator: Integrator) -> Settings {
    Settings { gravity_W: Vector3::zeros(), integrator, ..Settings::default() }
}

fn cube(mass_kg: f64, settings: Settings) -> (Vec<Entity>, Manipulation) {
    let cube = object(Cuboid::new([2.0 * HALF; 3]).unwrap(), Isometry3::identity(), 1000.0, 0.5);
    let body = body(&cube, mass_kg);
    let entities = vec![cube];
    let manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
    (entities, manipulation)
}

fn pull(point_W: Vector3<f64>, force_on_user_W: Vector3<f64>, stiffness_n_per_m: f64) -> Pull {
    Pull { entity: 0, finger: 0, point_W, force_on_user_W, stiffness_n_per_m }
}

#[test]
fn momentum_is_minus_what_the_user_got_whatever_the_integrator() {
    for (name, integrator) in Integrator::NAMES {
        let (mut entities, mut manipulation) = cube(MASS, weightless(integrator));
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for tick in 0..50 {
            let t = f64::from(tick) * DT;
            let force_W = Vector3::new(0.3, (40.0 * t).sin(), -0.2);
            let mut pulls = [pull(Vector3::new(HALF, 0.01, -0.005), force_W, 200.0)];
            let before = manipulation.bodies()[0];
            manipulation.step_pulled(&mut entities, &mut [], &mut pulls, &mut [], DT);
            let after = manipulation.bodies()[0];
            let impulse = -pulls[0].force_on_user_W * DT;
            linear += (after.velocity_W - before.velocity_W) * MASS - impulse;
            let arm = pulls[0].point_W - before.centre_W;
            angular += after.angular_momentum_W - before.angular_momentum_W - arm.cross(&impulse);
            // The body gave way, and the force with it; never along another line.
            assert!(pulls[0].force_on_user_W.cross(&force_W).norm() < 1e-15, "{name}");
            assert!(pulls[0].force_on_user_W.norm() < force_W.norm() + 1e-15, "{name}");
        }
        // Momenta of 0.05 N s are summed up over 50 ticks. Of the others rk4 lets the arm go round within the tick, and the
        // thesis' way changes angular velocities: their angular momenta are right to the tick's length.
        assert!(linear.norm() < 1e-16, "{name}: {linear}");
        if integrator == Integrator::Implicit {
            assert!(angular.norm() < 1e-17, "{name}: {angular}");
        }
    }
}

#[test]
fn a_pull_on_a_body_counts_as_no_contact_and_holds_its_weight() {
    let (mut entities, mut manipulation) = cube(MASS, Settings::default());
    let weight = MASS * G;
    for _ in 0..100 {
        let mut pulls = [pull(Vector3::y() * HALF, Vector3::y() * -weight, 0.0)];
        manipulation.step_pulled(&mut entities, &mut [], &mut pulls, &mut [], DT);
        assert_eq!(pulls[0].force_on_user_W, Vector3::y() * -weight);
    }
    let body = manipulation.bodies()[0];
    // Two forces of 0.5 N take each other away, a hundred times.
    assert!(body.velocity_W.norm() < 1e-15 && body.centre_W.norm() < 1e-15, "{body:?}");
    let quality = manipulation.grasp_quality(0).unwrap();
    assert!(quality.contacts == 0 && quality.residual < 1e-15, "{quality:?}");
}

#[test]
fn what_moves_nothing_is_not_felt() {
    let (mut entities, mut manipulation) = cube(MASS, weightless(Integrator::Implicit));
    let force = Vector3::x() * 0.01;
    let mut pulls = vec![pull(Vector3::zeros(), force, 0.0); MAX_PULLS + 1];
    pulls[1].entity = 7;
    pulls[2].force_on_user_W.x = f64::NAN;
    pulls[3].point_W.z = f64::INFINITY;
    pulls[4].stiffness_n_per_m = f64::NAN;
    pulls[5].stiffness_n_per_m = -1.0;
    manipulation.step_pulled(&mut entities, &mut [], &mut pulls, &mut [], DT);
    let felt: Vector3<f64> = pulls.iter().map(|pull| pull.force_on_user_W).sum();
    let got = manipulation.bodies()[0].velocity_W * MASS / DT;
    // 59 summands of 0.01 N.
    assert!((felt + got).norm() < 1e-14 && (felt.x - 0.59).abs() < 1e-14, "{felt} {got}");
}

/// A finger beside a magnetic cube in free space: the largest speed of the cube within a second, and the energy that there
/// was at first and at last (J).
fn beside_a_magnet(mass_kg: f64, magnetism: Magnetism, gap_m: f64) -> (f64, [f64; 2]) {
    let (mut entities, mut manipulation) = cube(mass_kg, weightless(Integrator::Implicit));
    entities[0] = entities[0].clone().with_magnetism(magnetism).with_damping(0.0).unwrap();
    let effects = Effects::new(Vec::new(), Vec::new(), &entities);
    let mut felt = FingerEffects::new(&effects).with_ramp_in(0.0).unwrap();
    let finger = haptics::Finger::new(0.0, 1).unwrap();
    // Off the middle, so that it turns, too.
    let hip = Vector3::new(HALF + gap_m, 0.004, 0.0);
    let (mut fastest, mut energies) = (0.0_f64, [0.0; 2]);
    for tick in 0..1000 {
        let moment = Moment { t_s: f64::from(tick) * DT, dt_s: DT };
        felt.step(&effects, &entities, &finger, &hip, moment);
        let energy = manipulation.bodies()[0].kinetic_energy_j() + felt.stored_j();
        energies = if tick == 0 { [energy; 2] } else { [energies[0], energy] };
        let mut pulls: Vec<Pull> = felt
            .reactions()
            .iter()
            .map(|of| pull(of.point_W, of.force_on_user_W, of.stiffness_n_per_m))
            .collect();
        manipulation.step_pulled(&mut entities, &mut [], &mut pulls, &mut [], DT);
        let body = manipulation.bodies()[0];
        fastest = fastest.max(body.velocity_W.norm());
        if body.centre_W.x > gap_m {
            break;
        }
    }
    (fastest, energies)
}

#[test]
fn a_magnet_draws_its_body_to_the_finger_and_gives_it_what_the_potential_says() {
    let limits = Limits::at(DT).unwrap();
    let magnetism = Magnetism::new(1.0, 0.01, &limits).unwrap();
    let (fastest, [first, last]) = beside_a_magnet(0.1, magnetism, 0.008);
    assert!(fastest > 0.05, "{fastest}");
    // From 8 mm to the surface a magnet gives 27/48 F0 D, less what it has given: 4 mJ here. Where the force is held for a tick
    // in which it grows by its slope, up to 3 N / 10 mm, energies are off by F' v^2 dt^2, summed with changing sign:
    // 300 N/m x (0.3 m/s)^2 x 1e-6 s^2 x 80 ticks = 2 uJ; and falling forces cost as much as they give way.
    assert!((last - first).abs() < 0.03 * 27.0 / 48.0 * 0.01, "{first} {last}");
}

/// How far a body of 0.1 g swings, that starts 1 mm from the middle of a pull of 1000 N/m, if so much of that is told (m).
fn swings(told_n_per_m: f64) -> f64 {
    let (mut entities, mut manipulation) = cube(1e-4, weightless(Integrator::Implicit));
    let (middle, k) = (Vector3::x() * 1e-3, 1000.0);
    let mut farthest = 0.0_f64;
    for _ in 0..2000 {
        let off = manipulation.bodies()[0].centre_W - middle;
        farthest = farthest.max(off.norm());
        let mut pulls = [pull(manipulation.bodies()[0].centre_W, off * k, told_n_per_m)];
        manipulation.step_pulled(&mut entities, &mut [], &mut pulls, &mut [], DT);
    }
    farthest
}

#[test]
fn a_light_body_gives_way_to_a_stiff_pull_and_does_not_rattle() {
    // k dt^2 / m is 10; by itself a spring of 4 and more throws its body about.
    assert!(swings(0.0) > 10e-3, "{}", swings(0.0));
    // With k dt^2 added to the mass it is 10 / 11, and the longest swing of symplectic Euler 1 / sqrt(1 - 10 / 44) of the first.
    let farthest = swings(1000.0);
    assert!(farthest < 1e-3 / (1.0_f64 - 10.0 / 44.0).sqrt() + 1e-12, "{farthest}");
}

#[test]
fn a_body_that_turns_is_pulled_where_its_surface_is_nearest() {
    let limits = Limits::at(DT).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    let pose = Isometry3::from_parts(Vector3::new(0.1, 0.0, 0.0).into(), turn);
    let magnetism = Magnetism::new(1.0, 0.01, &limits).unwrap();
    let cube = object(Cuboid::new([2.0 * HALF; 3]).unwrap(), pose, 1000.0, 0.0).with_magnetism(magnetism);
    let nearest = pose * nalgebra::Point3::new(0.01, HALF, -0.003);
    let hip = nearest.coords + turn * Vector3::y() * 0.002;
    let entities = [cube];
    let effects = Effects::new(Vec::new(), Vec::new(), &entities);
    let mut felt = FingerEffects::new(&effects).with_ramp_in(0.0).unwrap();
    let finger = haptics::Finger::new(0.0, 1).unwrap();
    let force = felt.step(&effects, &entities, &finger, &hip, Moment { t_s: 0.0, dt_s: DT });
    let [reaction] = felt.reactions() else { panic!("{:?}", felt.reactions()) };
    assert_eq!((reaction.entity, reaction.force_on_user_W), (0, force));
    // Numbers of 0.1 m.
    assert!((reaction.point_W - nearest.coords).norm() < 1e-16, "{reaction:?}");
    let slope = (magnetism.pull_n(0.002 + 1e-7) - magnetism.pull_n(0.002 - 1e-7)) / 2e-7;
    // h^2 / 6 of the third derivative, 40 F0 / D^3; and rounding of 1 N over 2e-7 m.
    assert!((reaction.stiffness_n_per_m - slope).abs() < 1e-7, "{slope} {reaction:?}");
}
