//! What one finger alone can do (Melder ch. 5.3.4), three together, and what is felt through what is held (ch. 6.3, 8.2.6).
#![allow(non_snake_case)]

use crate::common;

use std::f64::consts::PI;

use common::*;
use haptics::Cuboid;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, FingerSettings, LimitSurface, MassProperties, Settings, SoftFinger, TorsionModel};

const EDGE: f64 = 0.05;

/// A cube of 0.1 kg at rest on a floor, and so many fingers.
fn on_floor(mu_floor: f64, fingers: usize) -> World {
    let sunk = 0.1 * G / (4.0 * 1000.0 * 5000.0 / 6000.0);
    let at = Isometry3::translation(0.0, EDGE / 2.0 - sunk, 0.0);
    let cube = object(Cuboid::new([EDGE; 3]).unwrap(), at, 1000.0, 0.5);
    let state = body(&cube, 0.1);
    // The ratio between both is the geometric mean.
    World::new(
        vec![floor(0.0, 5000.0, mu_floor * mu_floor / 0.5), cube],
        &[(1, state)],
        Settings::default(),
        fingers,
    )
}

#[test]
fn a_finger_pushes_a_cube_straight_through_its_centre_and_turns_it_beside() {
    let push = |off: f64| {
        let mut world = on_floor(0.3, 1);
        let mut force = Vector3::zeros();
        for tick in 0..2000 {
            let t = f64::from(tick) * DT;
            // At the height of the floor's friction nearly: else it tips.
            force = world.step(&[Vector3::new(-0.03 + 0.05 * t, 0.01, off)])[0];
        }
        (*world.body(), force)
    };
    let (straight, force) = push(0.0);
    // It leans on the floor's springs, but it does not turn about the vertical.
    let turn = straight.orientation.scaled_axis();
    assert!(turn.y.abs() < 1e-9 && turn.norm() < 3e-3, "{turn}");
    assert!(straight.centre_W.z.abs() < 1e-8);
    // As far as the finger goes until the end of the tick, less what presses it, mu m g; and it leans by 2 mrad over 15 mm.
    // The finger holds on to the face that leans: it lifts a little.
    let friction = 0.3 * (0.1 * G + force.y);
    let expected = -0.03 + 0.05 * 2.0 - friction / 1000.0 + EDGE / 2.0;
    assert!((straight.centre_W.x - expected).abs() < 5e-5, "{} {expected}", straight.centre_W.x);
    assert!((force.x + friction).abs() < 1e-3 * friction, "{force}");
    for off in [0.01, -0.01] {
        let (turned, _) = push(off);
        // Pushed at +z towards +x it turns about +y.
        let angle = turned.orientation.scaled_axis().y;
        assert!(angle * off.signum() > 0.3, "{off}: {angle}");
    }
}

#[test]
fn a_finger_under_an_object_lifts_it_while_it_stays_below_the_centre() {
    // A pole of 0.1 kg on the finger, and a hand that follows it, or does not.
    let balance = |follows: bool| {
        let size = [0.03, 0.1, 0.03];
        let start = Isometry3::translation(1e-4, 0.1 + 0.05, 0.0);
        let pole = object(Cuboid::new(size).unwrap(), start, 1000.0, 1.0);
        let state = body(&pole, 0.1);
        let mut world = World::new(vec![pole], &[(0, state)], Settings::default(), 1);
        let mut hip = Vector3::new(0.0, 0.1 + 0.1 * G / 1000.0, 0.0);
        let (mut fell_s, mut velocity) = (None, Vector3::zeros());
        for tick in 0..4000 {
            world.step(&[hip]);
            let body = *world.body();
            let top_W = body.orientation * Vector3::y();
            if top_W.y < 0.8 || world.touches.is_empty() {
                fell_s = fell_s.or(Some(f64::from(tick) * DT));
            }
            if follows {
                // Speeded up to where it leans, by more than g, and more so the faster it does: as one balances a broom.
                let spin = body.angular_velocity_W();
                velocity.x += (30.0 * top_W.x - 6.0 * spin.z) * DT;
                velocity.z += (30.0 * top_W.z + 6.0 * spin.x) * DT;
                hip += velocity * DT;
            }
        }
        (fell_s, world)
    };
    let (fell_s, _) = balance(false);
    // From 0.1 mm beside the centre to 50 mm: e^(w t), w^2 = m g h / (J + m h^2), takes ln(1000) / w.
    let h: f64 = 0.05;
    let inertia = (0.1_f64.powi(2) + 0.03_f64.powi(2)) / 12.0 + h * h;
    let expected = (2.0 * 0.6 * h / 1e-4_f64).ln() / (G * h / inertia).sqrt();
    let fell_s = fell_s.expect("it falls when nobody follows");
    assert!((fell_s / expected - 1.0).abs() < 0.3, "{fell_s} {expected}");
    let (fell_s, world) = balance(true);
    assert_eq!(fell_s, None);
    assert!((world.body().orientation * Vector3::y()).y > 0.99);
}

#[test]
fn a_finger_under_a_hook_lifts_it_and_it_hangs_below_the_finger() {
    // A bar whose centre of mass hangs 60 mm below its middle, as a cup's hangs below its handle.
    let handle = Cuboid::new([0.08, 0.02, 0.02]).unwrap();
    let bar = object(handle, Isometry3::translation(0.0, 0.2, 0.0), 1000.0, 1.0);
    let mass = MassProperties::of_shape(&bar.shape, 0.2).unwrap();
    let mass = mass.with_inertia([2e-4, 2e-4, 2e-4]).unwrap().with_centre(Vector3::new(0.01, -0.06, 0.0));
    let state = Body::at_rest(mass, &bar.X_WB);
    let mut world = World::new(vec![bar], &[(0, state)], Settings::default(), 1);
    let mut felt = Vector3::zeros();
    for tick in 0..12_000 {
        let t = (f64::from(tick) * DT).min(2.0);
        let up = 0.05 * (0.5 - 0.5 * (PI * t / 2.0).cos());
        felt = world.step(&[Vector3::new(0.0, 0.192 + up, 0.0)])[0];
    }
    let body = world.body();
    assert!(!world.touches.is_empty(), "it hangs on the finger");
    // The centre came to be below the finger: the bar leans by 10 mm to 50 mm; it still swings, for nothing damps a point.
    assert!(body.centre_W.x.abs() < 0.011, "{}", body.centre_W);
    // Never above: it is a stable grasp.
    assert!(body.centre_W.y < 0.2, "{}", body.centre_W);
    assert!((felt.y + 0.2 * G).abs() < 0.2 * 0.2 * G, "{felt}");
}

#[test]
fn three_fingers_under_a_plate_carry_what_their_levers_say() {
    // Statics: N1 + N2 + N3 = m g, and no torque about the centre.
    let size = [0.12, 0.02, 0.12];
    let plate = object(Cuboid::new(size).unwrap(), Isometry3::translation(0.0, 0.1, 0.0), 1000.0, 1.0);
    let state = body(&plate, 0.3);
    let mut world = World::new(vec![plate], &[(0, state)], Settings::default(), 3);
    let at = [(0.05, 0.01), (-0.03, 0.05), (-0.02, -0.04)];
    let mut forces = Vec::new();
    for _ in 0..8000 {
        let hips = at.map(|(x, z)| Vector3::new(x, 0.091, z));
        forces = world.step(&hips);
    }
    // Three equations for three unknown: [1 1 1; x; z] N = [m g; 0; 0], about where the centre is now.
    let centre = world.body().centre_W;
    let matrix = nalgebra::Matrix3::from_fn(|row, column| {
        let touch = &world.touches[column].point_W;
        [1.0, touch.x - centre.x, touch.z - centre.z][row]
    });
    let expected = matrix.try_inverse().unwrap() * Vector3::new(0.3 * G, 0.0, 0.0);
    for (finger, force) in forces.iter().enumerate() {
        // The plate leans by some millimetres over 100, so that tangential forces carry a little, too.
        assert!((-force.y - expected[finger]).abs() < 0.02 * 0.3 * G, "{finger}: {force} {expected}");
        assert!(-force.y > 0.0);
    }
    let sum: f64 = forces.iter().map(|force| -force.y).sum();
    assert!((sum - 0.3 * G).abs() < 1e-3 * 0.3 * G, "{sum}");
}

#[test]
fn a_surface_is_felt_through_the_cube_that_is_held_against_it() {
    let sunk = 0.1 * G / (4.0 * 1000.0 * 5000.0 / 6000.0);
    let mut world = on_floor(0.0, 2);
    let hips = |y: f64| [-1.0, 1.0].map(|side| Vector3::new(side * (EDGE / 2.0 - 4e-3), y, 0.0));
    let hold = |world: &mut World, seconds: f64, from: f64, to: f64| {
        let ticks = (seconds / DT) as usize;
        let mut sum = Vector3::zeros();
        for tick in 0..ticks {
            let share = 0.5 - 0.5 * (PI * tick as f64 / ticks as f64).cos();
            sum = world.step(&hips(from + (to - from) * share)).iter().sum();
        }
        sum
    };
    let middle = EDGE / 2.0 - sunk;
    hold(&mut world, 0.5, middle, middle);
    hold(&mut world, 1.0, middle, middle + 0.02);
    let lifted = hold(&mut world, 3.0, middle + 0.02, middle + 0.02);
    assert!((lifted.y + 0.1 * G).abs() < 1e-4, "its weight: {lifted}");
    // Pressed against the floor by 1 mm: two springs of the fingers, four of the floor, in series.
    hold(&mut world, 1.0, middle + 0.02, middle - 1e-3);
    let pressed = hold(&mut world, 3.0, middle - 1e-3, middle - 1e-3);
    let floor_n = 4.0 * 1000.0 * 5000.0 / 6000.0;
    let floor_force: f64 = world.manipulation.rows().iter().skip(2).map(|row| row.force_W.y).sum();
    // What is felt is the floor's force less the weight.
    assert!((pressed.y - (floor_force - 0.1 * G)).abs() < 1e-4, "{pressed} {floor_force}");
    // From where floor and weight balance, the springs in series.
    let expected = 1e-3 / (1.0 / 2000.0 + 1.0 / floor_n);
    assert!((pressed.y - expected).abs() < 0.01 * expected, "{pressed} {expected}");
}

#[test]
fn the_gyroscopic_torque_of_a_held_spinning_object_is_felt() {
    // A disc (a flat box) of 0.2 kg that spins about x, between two fingers on its axis, which lead the axis round y.
    let size = [0.04, 0.06, 0.06];
    let disc = object(Cuboid::new(size).unwrap(), Isometry3::identity(), 2000.0, 0.8);
    let mass = MassProperties::of_shape(&disc.shape, 0.2).unwrap();
    let spin = 60.0;
    let state = Body::at_rest(mass, &disc.X_WB).moving(Vector3::zeros(), Vector3::x() * spin);
    let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
    let mut world = World::new(vec![disc], &[(0, state)], settings, 2);
    let span = 0.02 - 3e-3;
    let turn = 0.5;
    let (mut along, mut sum, mut count) = (0.0, Vector3::zeros(), 0);
    for tick in 0..3000 {
        let t = f64::from(tick) * DT;
        // Begun smoothly.
        along += turn * (t / 1.0).min(1.0) * DT;
        let axis = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), along) * Vector3::x();
        let forces = world.step(&[-axis * span, axis * span]);
        if t >= 1.5 {
            // Torque of the fingers on the disc about its centre, in the frame that turns along.
            let centre = world.body().centre_W;
            let torque: Vector3<f64> = world
                .touches
                .iter()
                .map(|touch| (touch.point_W - centre).cross(&-forces[touch.finger]))
                .sum();
            let back = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -along);
            sum += back * torque;
            count += 1;
        }
    }
    let torque = sum / f64::from(count);
    let spin_now = world.body().angular_velocity_W().norm();
    // T = omega x L: about y times along x is along -z.
    let expected = -turn * mass.principal_kg_m2.x * spin_now;
    // Points brake no spin; of the mean over 1.5 s a little is the swaying with which it began.
    assert!((spin_now / spin - 1.0).abs() < 1e-3, "{spin_now}");
    assert!((torque.z / expected - 1.0).abs() < 1e-3, "{torque} {expected}");
    assert!(torque.x.abs() + torque.y.abs() < 1e-3 * expected.abs(), "{torque}");
}

#[test]
fn soft_pads_brake_what_spins_between_them() {
    let size = [0.04, 0.06, 0.06];
    let disc = object(Cuboid::new(size).unwrap(), Isometry3::identity(), 2000.0, 0.8);
    let mass = MassProperties::of_shape(&disc.shape, 0.2).unwrap();
    let pad_radius_m = 5e-3;
    let soft = SoftFinger::default()
        .with_model(TorsionModel::Coulomb { pad_radius_m, limit_surface: LimitSurface::Ellipse });
    let state = Body::at_rest(mass, &disc.X_WB).moving(Vector3::zeros(), Vector3::x() * 60.0);
    let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
    let mut world = World::new(vec![disc], &[(0, state)], settings, 2)
        .with_fingers(FingerSettings { soft, attachment: None });
    let hip = Vector3::x() * (0.02 - 3e-3);
    let mut felt = Vector3::zeros();
    for tick in 0..100 {
        world.step(&[-hip, hip]);
        if tick == 50 {
            felt = world.ticks[0].torque_on_user_W;
        }
    }
    // 2 (2/3 a mu N) for 0.1 s.
    let torque = 2.0 / 3.0 * pad_radius_m * 0.8 * 2000.0 * 3e-3;
    let expected = 60.0 - 2.0 * torque / mass.principal_kg_m2.x * 0.1;
    let spin = world.body().angular_velocity_W().x;
    // Two ticks of the hundred before the spring is stretched.
    assert!((spin - expected).abs() < 0.03 * (60.0 - expected), "{spin} {expected}");
    // What the user feels is the disc's pull along with it.
    assert!((felt.x - torque).abs() < 1e-6 * torque, "{felt} {torque}");
}
