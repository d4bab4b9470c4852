//! An instrumented gimbal turns what two fingers hold, about the line between them.
#![allow(non_snake_case)]

use crate::{common, held};

use std::f64::consts::PI;

use common::*;
use held::*;
use nalgebra::{UnitQuaternion, Vector3};
use physics::{LimitSurface, SoftFinger, TorsionModel};

/// Turns the gimbals of these fingers by 30 degrees about an axis in a second, and holds still for another; how far the
/// cube has turned then (rotation vector, rad).
fn turned(soft: SoftFinger, force: f64, fingers: [bool; 2], axis: Vector3<f64>) -> Vector3<f64> {
    let mut held = Held::new(soft, 500.0, 0.5, 0.0, 0.0);
    held.squeeze_for(0.5, 2.5 * force);
    held.relax(0.5, 2.5 * force, force);
    let start = held.world.body().orientation;
    for tick in 0..2000 {
        let t = (f64::from(tick) * DT).min(1.0);
        let angle = PI / 6.0 * (0.5 - 0.5 * (PI * t).cos());
        // Whatever the gimbal's zero is.
        let gimbal = UnitQuaternion::from_scaled_axis(axis * angle)
            * UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0);
        for (tick, has_one) in held.world.ticks.iter_mut().zip(fingers) {
            tick.gimbal = has_one.then_some(gimbal);
        }
        held.squeeze(force);
    }
    (held.world.body().orientation * start.inverse()).scaled_axis()
}

fn model(name: &str) -> SoftFinger {
    SoftFinger::default().with_model(TorsionModel::of_name(name).unwrap())
}

#[test]
fn a_gimbal_turns_the_held_object_by_what_it_turns() {
    let force = 1.5 * MASS * G;
    for name in ["coulomb", "viscous", "stick-slip"] {
        for fingers in [[true, true], [true, false], [false, true]] {
            let angle = turned(model(name), force, fingers, Vector3::x());
            // Nothing holds it back: the springs of the pads are relaxed in the end, but for 0.1 kg that was speeded up
            // and stopped again.
            assert!((angle - Vector3::x() * (PI / 6.0)).norm() < 1e-4, "{name} {fingers:?}: {angle}");
        }
    }
}

#[test]
fn only_the_turn_about_the_line_between_the_fingers_counts() {
    let force = 1.5 * MASS * G;
    for axis in [Vector3::y(), Vector3::z()] {
        let angle = turned(model("coulomb"), force, [true, true], axis);
        assert!(angle.norm() < 1e-6, "{angle}");
    }
}

#[test]
fn below_the_critical_area_the_object_does_not_follow() {
    let force = 1.5 * MASS * G;
    let area = PI * (0.5 * force / 500.0_f64).powi(2);
    let with = |gimbal_area_m2| SoftFinger { gimbal_area_m2, ..SoftFinger::default() };
    let follows = turned(with(0.98 * area), force, [true, false], Vector3::x());
    assert!((follows.x - PI / 6.0).abs() < 1e-4, "{follows}");
    let stays = turned(with(1.02 * area), force, [true, false], Vector3::x());
    assert!(stays.norm() < 1e-6, "{stays}");
    // The pads of the thesis' models hold nothing below the area from which they hold.
    let critical = TorsionModel::Viscous { critical_area_m2: 1.02 * area, damping_nm_s_per_rad: 1e-3 };
    let stays = turned(SoftFinger::default().with_model(critical), force, [true, true], Vector3::x());
    assert!(stays.norm() < 1e-6, "{stays}");
}

#[test]
fn a_gimbal_turns_no_more_than_torsional_friction_lets_it() {
    // The cube's centre 15 mm in front of the axis; pads that hold a tenth less than its weight turn it up to where
    // its weight is that.
    let model = TorsionModel::Coulomb { pad_radius_m: 6e-3, limit_surface: LimitSurface::Uncoupled };
    let mut held = Held::new(SoftFinger::default().with_model(model), 2000.0, 0.5, 0.015, 0.3);
    let limit = held.weight_moment() / (2.0 * 2.0 / 3.0 * 6e-3 * held.mu);
    let force = 0.9 * limit;
    held.squeeze_for(0.5, 1.5 * force);
    held.relax(0.5, 1.5 * force, force);
    for tick in 0..6000 {
        let t = (f64::from(tick) * DT).min(5.0);
        let gimbal = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5 * t);
        held.world.ticks.iter_mut().for_each(|tick| tick.gimbal = Some(gimbal));
        held.squeeze(force);
    }
    // m g L sin(angle) = 0.9 m g L; about that it rocks by what was left of its speed when it began to slip, until the
    // gimbal stops: sliding friction that does not change its direction damps nothing.
    let expected = 0.9_f64.asin();
    assert!((held.angle() - expected).abs() < 0.015, "{} {expected}", held.angle());
}
