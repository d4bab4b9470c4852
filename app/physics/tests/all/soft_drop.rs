//! Gravity-induced drop: what two fingers hold, and what swings between them.
#![allow(non_snake_case)]

use crate::{common, held};

use std::f64::consts::{FRAC_PI_2, PI};

use common::*;
use held::*;
use physics::{Integrator, LimitSurface, Settings, SoftFinger, TorsionModel};

/// A pad that bears friction and torsion in full at once, as the thesis has it.
fn uncoupled() -> SoftFinger {
    let limit_surface = LimitSurface::Uncoupled;
    SoftFinger::default().with_model(TorsionModel::Coulomb { pad_radius_m: 6e-3, limit_surface })
}

/// `K(sin(angle / 2)) 2 / pi`: by how much a pendulum of this amplitude is slower than a small one (Gauss).
fn slower(amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, (0.5 * amplitude).cos());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    1.0 / a
}

#[test]
fn between_point_fingers_a_cube_swings_as_a_physical_pendulum() {
    for (arm, amplitude) in [(0.02, 0.05), (0.02, 1.0), (0.015, 2.0), (0.005, FRAC_PI_2)] {
        let mut held = Held::new(SoftFinger::POINT, 5000.0, 2.0, arm, amplitude);
        let (mut crossings, mut before) = (Vec::new(), held.angle());
        for tick in 1..6000 {
            held.squeeze(10.0);
            let angle = held.angle();
            if before * angle < 0.0 {
                crossings.push((f64::from(tick) - angle / (angle - before)) * DT);
            }
            before = angle;
        }
        let period = crossings[2] - crossings[0];
        let small = 2.0 * PI * (held.inertia() / held.weight_moment()).sqrt();
        let expected = small * slower(amplitude);
        // The axis gives, by m g / 2k = 0.1 mm and what swinging adds to it, of an arm of 5 mm at least; the pads' damping
        // takes a little of the amplitude.
        assert!((period / expected - 1.0).abs() < 3e-3, "{arm} {amplitude}: {period} {expected}");
    }
}

#[test]
fn a_cube_that_swings_comes_to_rest_below_the_axis_when_turning_is_damped() {
    let soft = SoftFinger::default().with_model(TorsionModel::of_name("viscous").unwrap());
    let mut held = Held::new(soft, 500.0, 0.5, 0.01, FRAC_PI_2);
    let force = 1.1 * held.needed();
    held.relax(0.5, 3.0 * force, force);
    let mut least = f64::INFINITY;
    for _ in 0..20_000 {
        held.squeeze(force);
        least = least.min(held.angle());
    }
    let body = held.world.body();
    // Without swinging back: it crept down from the one side. The last of it is slow: e^(-t (1 - s) m g L / b).
    assert!(least > -1e-3 && held.angle() < 0.02, "{least} {}", held.angle());
    // Below the axis, as far as it ever was, and the pads' springs longer by m g / 2k.
    let lower = held.arm + MASS * G / (2.0 * held.stiffness);
    assert!((body.centre_W.y + lower).abs() < 1e-4, "{} {lower}", body.centre_W.y);
}

#[test]
fn an_ordinary_grasp_holds_an_object_off_its_centre_and_lets_it_drop_when_it_is_relaxed() {
    for (stiffness, mu) in [(500.0, 0.5), (2000.0, 0.5), (500.0, 1.0)] {
        let mut held = Held::new(uncoupled(), stiffness, mu, 0.005, FRAC_PI_2);
        let needed = held.needed();
        held.squeeze_for(0.5, 3.0 * needed);
        held.relax(0.5, 3.0 * needed, 1.5 * needed);
        held.squeeze_for(3.0, 1.5 * needed);
        // The pads are springs: m g L / 2 over 0.5 N m/rad each.
        let given = held.weight_moment() / 2.0 / 0.5;
        assert!((FRAC_PI_2 - held.angle() - given).abs() < 1e-3, "{stiffness} {mu}: {}", held.angle());
        held.relax(0.5, 1.5 * needed, 1.1 * needed);
        held.squeeze_for(3.0, 1.1 * needed);
        // It turns until the torque of gravity is what the pads hold: m g L sin(angle) = 2 (2/3 a mu N), a = 6 mm.
        let held_nm = 2.0 * 2.0 / 3.0 * 6e-3 * mu * 1.1 * needed;
        let stops = (held_nm / held.weight_moment()).asin();
        assert!(held.angle() < stops + 1e-3, "{stiffness} {mu}: {} {stops}", held.angle());
        // It is still held, not fallen: its springs are stretched by what it weighs, and no more.
        let lower = held.arm * held.angle().cos() + MASS * G / (2.0 * stiffness);
        assert!((held.world.body().centre_W.y + lower).abs() < 1e-3, "{}", held.world.body().centre_W.y);
    }
}

#[test]
fn torsional_friction_holds_up_to_what_a_disc_holds_and_slips_above() {
    for arm in [0.006, 0.01, 0.015] {
        let after = |share: f64| {
            let mut held = Held::new(uncoupled(), 2000.0, 0.5, arm, FRAC_PI_2);
            // m g L = 2 (2/3 a mu N)
            let limit = held.weight_moment() / (2.0 * 2.0 / 3.0 * 6e-3 * held.mu);
            held.squeeze_for(0.5, 2.0 * limit);
            held.relax(1.0, 2.0 * limit, share * limit);
            held.squeeze_for(2.0, share * limit);
            FRAC_PI_2 - held.angle()
        };
        // The pads give by m g L / (2 0.5 N m/rad), and the arm gets shorter by the cosine of that: under 0.02 %.
        let given = MASS * G * arm;
        let holds = after(1.01);
        assert!((holds - given).abs() < 1e-3 * given + 1e-4, "{arm}: {holds} {given}");
        // A hundredth less than needed: it turns until the arm is a hundredth shorter, cos(0.14) = 0.99, and as far
        // beyond as it was fast.
        let slips = after(0.99);
        assert!(slips > 0.13, "{arm}: {slips}");
    }
}

#[test]
fn pads_hold_with_every_integrator() {
    for (name, integrator) in Integrator::NAMES {
        for model in ["coulomb", "viscous"] {
            let soft = SoftFinger::default().with_model(TorsionModel::of_name(model).unwrap());
            let settings = Settings { integrator, ..Settings::default() };
            let mut held = Held::in_a_world_of(settings, soft, [500.0, 0.5], 0.005, FRAC_PI_2);
            // Coulomb's pads need 1.6 times what friction needs: of torsion they need 1.25 times as much.
            let force = 1.7 * held.needed();
            held.squeeze_for(0.5, 2.0 * force);
            held.relax(0.5, 2.0 * force, force);
            held.squeeze_for(3.0, force);
            // Coulomb's pads give by m g L / 2 over 0.5 N m/rad each; the others' hold gravity as a whole.
            let given = if model == "coulomb" { held.weight_moment() / 2.0 / 0.5 } else { 0.0 };
            let turned = FRAC_PI_2 - held.angle();
            assert!((turned - given).abs() < 1e-3, "{name} {model}: {turned}");
            assert!(held.world.body().angular_velocity_W().norm() < 1e-6, "{name} {model}");
        }
    }
}

#[test]
fn a_held_object_does_not_turn_in_ten_minutes() {
    hold_for(600.0);
}

#[test]
#[ignore = "half a minute"]
fn a_held_object_does_not_turn_in_an_hour() {
    hold_for(3600.0);
}

fn hold_for(seconds: f64) {
    let mut held = Held::new(SoftFinger::default(), 500.0, 0.5, 0.005, FRAC_PI_2);
    let force = 1.5 * held.needed();
    held.squeeze_for(0.5, 3.0 * force);
    held.relax(0.5, 3.0 * force, force);
    held.squeeze_for(4.0, force);
    let start = *held.world.body();
    held.squeeze_for(seconds, force);
    let end = held.world.body();
    // What the solver leaves open of each tick, to either side.
    assert!(end.orientation.angle_to(&start.orientation) < 1e-9, "{}", held.angle());
    assert!((end.centre_W - start.centre_W).norm() < 1e-10);
}

#[test]
fn viscous_torsion_settles_as_a_damped_pendulum_with_a_share_of_its_weight() {
    let (critical, damping) = (4.5e-6, 4e-3);
    let model = TorsionModel::Viscous { critical_area_m2: critical, damping_nm_s_per_rad: damping };
    let (arm, start) = (0.02, 0.1);
    let mut held = Held::new(SoftFinger::default().with_model(model), 5000.0, 2.0, arm, start);
    let force = 2.0;
    //= melder#5.16 type=test
    let area = PI * (held.mu * force / held.stiffness).powi(2);
    let share = 1.0 - area / critical;
    assert!((0.2..0.8).contains(&share), "{share}");
    // J q'' + b q' + share m g L q = 0, both roots real.
    let (j, c) = (held.inertia(), share * held.weight_moment());
    let root = (damping * damping / 4.0 - j * c).sqrt();
    let (fast, slow) = ((-damping / 2.0 - root) / j, (-damping / 2.0 + root) / j);
    for tick in 1..=1500 {
        held.squeeze(force);
        let t = f64::from(tick) * DT;
        let expected = start * (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow);
        // The sine of 0.1 is 0.1 to 0.2 %; half a tick of 1 ms to a time constant of 0.4 s; the pads' springs.
        assert!((held.angle() - expected).abs() < 0.005 * start, "{t}: {} {expected}", held.angle());
    }
    assert!(held.angle() < 0.1 * start);
}

#[test]
fn viscous_torsion_holds_above_the_critical_area_at_once_and_without_sagging() {
    let mut held = Held::new(
        SoftFinger::default().with_model(TorsionModel::of_name("viscous").unwrap()),
        500.0,
        0.5,
        0.005,
        FRAC_PI_2,
    );
    let force = 1.5 * held.needed();
    held.squeeze_for(1.0, 2.0 * force);
    held.relax(0.5, 2.0 * force, force);
    held.squeeze_for(5.0, force);
    // The tangential springs of the pads sag under it, not the torsion.
    assert!((held.angle() - FRAC_PI_2).abs() < 1e-4, "{}", held.angle());
    held.relax(0.5, force, 1.05 * held.needed());
    held.squeeze_for(10.0, 1.05 * held.needed());
    assert!(held.angle() < 0.1, "{}", held.angle());
}

#[test]
fn stick_slip_torsion_holds_above_one_area_drops_below_another_and_goes_in_jerks_between() {
    // The smallest of those below carries the cube with 6 % to spare.
    let (at_rest, turning) = (7e-6, 4.5e-6);
    let model = TorsionModel::StickSlip {
        critical_area_at_rest_m2: at_rest,
        critical_area_turning_m2: turning,
        damping_nm_s_per_rad: 1e-3,
    };
    let run = |area: f64| {
        let mut held = Held::new(SoftFinger::default().with_model(model), 500.0, 0.5, 0.005, FRAC_PI_2);
        let force = held.stiffness * (area / PI).sqrt() / held.mu;
        assert!(force > 1.01 * held.needed());
        held.squeeze_for(0.5, 2.0 * force);
        held.relax(0.2, 2.0 * force, force);
        let (mut stops, mut was_fast, mut fastest) = (0, false, 0.0_f64);
        for _ in 0..2000 {
            held.squeeze(force);
            let spin = held.world.body().angular_velocity_W().x.abs();
            fastest = fastest.max(spin);
            stops += usize::from(was_fast && spin < 0.02);
            was_fast = if spin > 0.2 { true } else { was_fast && spin >= 0.02 };
        }
        (FRAC_PI_2 - held.angle(), stops, fastest)
    };
    let (turned, ..) = run(1.02 * at_rest);
    assert!(turned.abs() < 1e-3, "{turned}");
    let (turned, stops, fastest) = run(0.5 * (at_rest + turning));
    assert!(turned > 0.05 && turned < 1.5 && stops > 10 && fastest < 1.0, "{turned} {stops} {fastest}");
    let (turned, _, fastest) = run(0.75 * turning);
    assert!(turned > 0.8 && fastest > 0.8, "{turned} {fastest}");
}

#[test]
fn a_grip_that_trembles_about_the_critical_area_lets_the_object_down_and_never_lifts_it() {
    for model in ["viscous", "stick-slip", "coulomb"] {
        let soft = SoftFinger::default().with_model(TorsionModel::of_name(model).unwrap());
        let mut held = Held::new(soft, 500.0, 0.5, 0.005, FRAC_PI_2);
        // The default's 4.5 mm^2; what Coulomb's pads hold is about that.
        let force = held.stiffness * (4.5e-6 / PI).sqrt() / held.mu;
        held.squeeze_for(0.5, 2.0 * force);
        held.relax(0.5, 2.0 * force, force);
        // What the pads' springs gave at most, they may give back.
        let springs =
            held.weight_moment().powi(2) / (2.0 * 1.0) + (MASS * G).powi(2) / (4.0 * held.stiffness);
        let (start, mut seed) = (held.energy(), 1_u64);
        for _ in 0..5000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let noise = (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
            held.squeeze(force * (1.0 + 0.1 * noise));
            assert!(held.energy() < start + springs, "{model}: {} {start}", held.energy());
        }
        let turned = FRAC_PI_2 - held.angle();
        assert!((0.0..1.5).contains(&turned), "{model}: {turned}");
    }
}

#[test]
fn torsion_takes_energy_and_never_gives_any() {
    let [alone, shared] = [LimitSurface::Uncoupled, LimitSurface::Ellipse]
        .map(|limit_surface| move |pad_radius_m| TorsionModel::Coulomb { pad_radius_m, limit_surface });
    let viscous = TorsionModel::Viscous { critical_area_m2: 1e3, damping_nm_s_per_rad: 3e-4 };
    let pads = [alone(1e-5), alone(5e-5), shared(1e-5), shared(5e-5)];
    for model in [TorsionModel::None, viscous].into_iter().chain(pads) {
        let mut held = Held::new(SoftFinger::default().with_model(model), 5000.0, 2.0, 0.02, 2.0);
        held.squeeze_for(0.1, 10.0);
        // What the tangential springs hold of it: they are stretched by the weight and by what swinging adds to it.
        let springs = (5.0 * MASS * G).powi(2) / (4.0 * held.stiffness);
        let mut most = held.energy() + springs;
        let first = most;
        for _ in 0..50 {
            let mut highest = f64::NEG_INFINITY;
            for _ in 0..100 {
                held.squeeze(10.0);
                highest = highest.max(held.energy());
            }
            assert!(highest <= most, "{model:?}: {highest} {most}");
            most = highest + springs;
        }
        let taken = first - most;
        assert!(model == TorsionModel::None || taken > 0.1 * held.weight_moment(), "{model:?}: {taken}");
    }
}
