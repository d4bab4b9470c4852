//! Whatever fingers with pads, gimbals and buttons do: numbers stay numbers, nothing allocates, and what the users feel is
//! what the bodies got.
#![allow(non_snake_case)]

use crate::{common, counting, noise};

use common::*;
use counting::CALLS;
use haptics::Cuboid;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use noise::Noise;
use physics::{
    Attachment, FingerSettings, FingerTick, HeldOrientation, Integrator, Settings, SoftFinger, TorsionModel,
};

fn settings(noise: &mut Noise) -> FingerSettings {
    let name = TorsionModel::NAMES[noise.below(4)];
    let soft = SoftFinger {
        stiffness_nm_per_rad: noise.log_within(1e-3, 100.0),
        damping_nm_s_per_rad: noise.within(0.0, 0.1),
        gimbal_area_m2: if noise.chance(0.5) { 0.0 } else { noise.within(0.0, 1e-5) },
        ..SoftFinger::default().with_model(TorsionModel::of_name(name).unwrap())
    };
    let attachment = Attachment {
        stiffness_n_per_m: noise.log_within(10.0, 5000.0),
        damping_n_s_per_m: noise.within(0.0, 50.0),
        most_force_n: noise.log_within(0.1, 100.0),
        orientation: HeldOrientation::of_name(HeldOrientation::NAMES[noise.below(3)]).unwrap(),
        stiffness_nm_per_rad: noise.log_within(1e-3, 100.0),
        damping_nm_s_per_rad: noise.within(0.0, 0.1),
        most_torque_nm: noise.log_within(1e-3, 10.0),
        fade_s: noise.within(0.0, 0.1),
    };
    FingerSettings { soft: soft.validated().unwrap(), attachment: Some(attachment.validated().unwrap()) }
}

/// Two cubes on a floor, and three fingers.
fn world(noise: &mut Noise, settings: Settings) -> World {
    let mut entities = vec![floor(0.0, noise.log_within(100.0, 5000.0), 0.5)];
    let mut bodies = Vec::new();
    for (number, x) in [(1, -0.05), (2, 0.05)] {
        let at = Isometry3::translation(x, 0.0249, 0.0);
        let stiffness = noise.log_within(10.0, 5000.0);
        let cube = object(Cuboid::new([0.05; 3]).unwrap(), at, stiffness, noise.within(0.0, 1.5));
        bodies.push((number, body(&cube, noise.log_within(1e-3, 10.0))));
        entities.push(cube);
    }
    World::new(entities, &bodies, settings, 3)
}

/// What a finger does in a tick: mostly near the cubes, at times what no finger can do.
fn act(noise: &mut Noise, hip: &mut Vector3<f64>, tick: &mut FingerTick) {
    *hip += noise.vector(1e-3);
    if noise.chance(0.003) {
        *hip = Vector3::new(noise.within(-0.1, 0.1), noise.within(0.0, 0.1), noise.within(-0.03, 0.03));
    }
    tick.is_button_held ^= noise.chance(0.01);
    let turn = tick.gimbal.unwrap_or_default() * UnitQuaternion::from_scaled_axis(noise.vector(0.02));
    tick.gimbal = match noise.below(100) {
        0 => None,
        1 => Some(noise.turn()),
        2 => Some(UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 1.0, 0.0))),
        3 => Some(UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 0.0))),
        _ => Some(turn).filter(|turn| turn.coords.iter().all(|x| x.is_finite())),
    };
    tick.hip_velocity_W = match noise.below(50) {
        0 => Some(Vector3::repeat(f64::INFINITY)),
        1 => Some(noise.vector(10.0)),
        _ => None,
    };
}

#[test]
fn nothing_that_fingers_do_makes_a_number_that_is_none() {
    let (mut tied, mut turned) = (0, 0);
    for seed in 0..150 {
        let noise = &mut Noise::new(seed);
        let integrator = Integrator::NAMES[seed as usize % 4].1;
        let mut world = world(noise, Settings { integrator, ..Settings::default() });
        let fingers = [settings(noise), settings(noise), settings(noise)];
        world.manipulation = world.manipulation.with_fingers(&fingers);
        let mut hips =
            [Vector3::new(-0.07, 0.03, 0.0), Vector3::new(-0.03, 0.03, 0.0), Vector3::new(0.05, 0.05, 0.0)];
        for _ in 0..1000 {
            for (hip, tick) in hips.iter_mut().zip(&mut world.ticks) {
                act(noise, hip, tick);
            }
            let mut given = hips;
            if noise.chance(0.005) {
                given[noise.below(3)] = Vector3::new(f64::NAN, 0.0, f64::INFINITY);
            }
            let forces = world.step(&given);
            assert!(forces.iter().all(|f| f.iter().all(|x| x.is_finite())), "seed {seed}");
            for tick in &world.ticks {
                assert!(tick.torque_on_user_W.iter().all(|x| x.is_finite()), "seed {seed}");
                assert!(tick.attached.is_none_or(|entity| entity > 0));
                tied += usize::from(tick.attached.is_some());
                turned += usize::from(tick.torque_on_user_W != Vector3::zeros());
            }
            for body in world.manipulation.bodies() {
                assert!(body.is_finite(), "seed {seed}");
                // The limits of the settings.
                assert!(body.velocity_W.norm() <= 50.0 * (1.0 + 1e-9));
                assert!(body.angular_velocity_W().norm() <= 2000.0 * (1.0 + 1e-9));
            }
        }
    }
    assert!(tied > 10_000 && turned > 10_000, "{tied} {turned}");
}

#[test]
fn what_the_users_feel_is_what_the_body_got_times_minus_one() {
    for seed in 0..100 {
        let noise = &mut Noise::new(1000 + seed);
        let integrator = Integrator::NAMES[seed as usize % 4].1;
        let gravity_W = noise.vector(10.0);
        let settings_all = Settings { gravity_W, integrator, ..Settings::default() };
        // In the air: only fingers touch it.
        let mass = noise.log_within(0.05, 2.0);
        let cube = object(Cuboid::new([0.05; 3]).unwrap(), Isometry3::identity(), 1000.0, 0.8);
        let state = body(&cube, mass);
        let mut world = World::new(vec![cube], &[(0, state)], settings_all, 3);
        let mut fingers = [settings(noise), settings(noise), settings(noise)];
        for finger in &mut fingers {
            // For explicit integrators, not too stiff.
            finger.soft.stiffness_nm_per_rad = 0.01;
            finger.soft.damping_nm_s_per_rad = 1e-4;
            let attachment = finger.attachment.as_mut().unwrap();
            attachment.stiffness_n_per_m = 200.0;
            attachment.damping_n_s_per_m = 0.2;
            attachment.stiffness_nm_per_rad = 0.01;
            attachment.damping_nm_s_per_rad = 1e-4;
        }
        world.manipulation = world.manipulation.with_fingers(&fingers);
        let mut turned = 0;
        for tick in 0..400 {
            let t = f64::from(tick) * DT;
            for (at, finger) in world.ticks.iter_mut().enumerate() {
                finger.is_button_held = t > 0.1 * (at as f64 + 1.0);
                finger.gimbal = Some(UnitQuaternion::from_euler_angles(t, -0.5 * t, 0.0));
            }
            let before = *world.body();
            let x = 0.022;
            let forces = world.step(&[
                Vector3::new(-x, 0.001, 0.0),
                Vector3::new(x, 0.0, 0.002),
                Vector3::new(0.0, -x, 0.01 * t),
            ]);
            let after = world.body();
            let sum: Vector3<f64> = forces.iter().sum();
            let gain = (after.velocity_W - before.velocity_W) * mass;
            let got = (gravity_W * mass - sum) * DT;
            let size = forces.iter().map(Vector3::norm).sum::<f64>() + mass * gravity_W.norm();
            // Roundings of velocities of up to metres per second times the mass.
            assert!(
                (gain - got).norm() < 1e-12 * (size * DT + mass * before.velocity_W.norm() + mass),
                "seed {seed}"
            );
            let mut torque = Vector3::zeros();
            for touch in &world.touches {
                torque -= (touch.point_W - before.centre_W).cross(&touch.force_on_user_W);
            }
            for row in world.manipulation.rows().iter().filter(|row| row.tie_n.is_some()) {
                torque += row.arms_W[0].cross(&row.force_W);
            }
            torque -= world.ticks.iter().map(|tick| tick.torque_on_user_W).sum::<Vector3<f64>>();
            let gain = after.angular_momentum_W - before.angular_momentum_W;
            turned += usize::from(world.ticks.iter().any(|tick| tick.torque_on_user_W.norm() > 1e-6));
            if integrator == Integrator::Implicit {
                // The arms are those of the tick's beginning.
                let sizes = size * 0.1 + torque.norm() + before.angular_momentum_W.norm() / DT;
                assert!((gain - torque * DT).norm() < 1e-12 * sizes, "seed {seed}: {gain} {}", torque * DT);
            }
        }
        let is_soft = fingers.iter().any(|finger| finger.soft.model != TorsionModel::None);
        assert!(!is_soft || turned > 0 || integrator != Integrator::Implicit, "seed {seed}");
    }
}

#[test]
fn a_tick_of_soft_fingers_never_allocates() {
    let noise = &mut Noise::new(5);
    for integrator in Integrator::NAMES {
        let settings_all = Settings { integrator: integrator.1, ..Settings::default() };
        let mut world = world(noise, settings_all);
        let fingers = [settings(noise), settings(noise), settings(noise)];
        world.manipulation = world.manipulation.with_fingers(&fingers);
        let mut hips =
            [Vector3::new(-0.07, 0.03, 0.0), Vector3::new(-0.03, 0.03, 0.0), Vector3::new(0.05, 0.05, 0.0)];
        let mut calls = 0;
        for _ in 0..3000 {
            for (hip, tick) in hips.iter_mut().zip(&mut world.ticks) {
                act(noise, hip, tick);
            }
            world.step(&hips);
            // The world's step allocates: what it gathered once more, without it.
            let before = CALLS.get();
            world.manipulation.step_with(&mut world.entities, &mut world.touches, &mut world.ticks, DT);
            for body in 0..2 {
                let _ = world.manipulation.grasp_quality(body);
            }
            calls += CALLS.get() - before;
        }
        assert_eq!(calls, 0, "{integrator:?}");
    }
}

#[test]
fn pads_are_calm_whatever_the_weight_and_however_stiff_they_are() {
    for mass in [0.001, 0.01, 0.1, 1.0, 10.0] {
        for k in [50.0, 500.0, 5000.0] {
            for (stiffness_nm_per_rad, damping_nm_s_per_rad) in
                [(0.05, 0.0), (0.5, 2e-3), (50.0, 0.0), (50.0, 0.2)]
            {
                let soft = SoftFinger { stiffness_nm_per_rad, damping_nm_s_per_rad, ..SoftFinger::default() };
                let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
                let cube = object(Cuboid::new([0.05; 3]).unwrap(), Isometry3::identity(), k, 0.8);
                let state = body(&cube, mass);
                let mut world = World::new(vec![cube], &[(0, state)], settings, 2)
                    .with_fingers(FingerSettings { soft, attachment: None });
                let noise = &mut Noise::new(3);
                let (mut fastest, mut rounds) = (0.0_f64, 0);
                for tick in 0..3000 {
                    let t = f64::from(tick) * DT;
                    // A hand that trembles at 10 Hz and sways; encoders' steps.
                    let sway = Vector3::new(0.0, 0.02 * (3.0 * t).sin(), 1e-3 * (60.0 * t).sin());
                    let hips =
                        [-0.023, 0.023].map(|x| Vector3::new(x, 0.001, 0.0) + sway + noise.vector(1.5e-5));
                    world.step(&hips);
                    fastest = fastest.max(world.body().angular_velocity_W().x.abs());
                    rounds = rounds.max(world.made.sweeps);
                }
                // What 0.06 m/s do at an arm of some millimetres, and no more.
                assert!(fastest < 3.0, "{mass} kg, {k} N/m, {stiffness_nm_per_rad}: {fastest}");
                // Torques of stiff pads stand at either limit until they are all but found.
                assert!(rounds < 60, "{mass} kg, {k} N/m, {stiffness_nm_per_rad}: {rounds}");
            }
        }
    }
}
