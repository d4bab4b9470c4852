//! What is refused because it would swing, and that what is allowed does not.

use crate::common::*;
use crate::effects::{Felt, limits, moving};
use haptics::{Field, Guide, Limits, MOST_FORCE_N, Magnetism, ParameterError, Region, Track, Vibration};
use nalgebra::Vector3;
use std::collections::VecDeque;
use std::f64::consts::FRAC_1_PI;

fn limit_named_in(error: ParameterError, parameter: &str, limit: f64) {
    let said = error.to_string();
    assert!(said.starts_with(&format!("{parameter} is ")), "{said}");
    assert!(said.contains(&format!("at most {limit:.4}, ")), "{said}");
}

#[test]
fn limits_are_what_their_formulas_say() {
    let at_1_khz = limits();
    // pi/4 0.03 kg / 4 ms; 3 N s/m / 3 ms; 0.03 kg / (2 pi 10 Hz 1.5 ms); 0.4 / 1 ms.
    assert!((at_1_khz.damping_n_s_per_m() - 5.890_486).abs() < 1e-6);
    assert!((at_1_khz.stiffness_n_per_m() - 1000.0).abs() < 1e-9);
    assert!((at_1_khz.mass_kg(10.0) - FRAC_1_PI).abs() < 1e-12);
    assert!((at_1_khz.mass_kg(1e6) - 0.015).abs() < 1e-12, "half the device's own");
    assert!((at_1_khz.frequency_hz() - 400.0).abs() < 1e-9);
    let heavy = at_1_khz.with_device_mass(0.3).unwrap();
    assert!((heavy.damping_n_s_per_m() / at_1_khz.damping_n_s_per_m() - 10.0).abs() < 1e-12);
    assert!(Limits::at(2e-3).unwrap().damping_n_s_per_m() < at_1_khz.damping_n_s_per_m());
    assert!(Limits::at(0.0).is_err() && Limits::at(f64::NAN).is_err());
    assert!(at_1_khz.with_device_mass(-1.0).is_err());
}

#[test]
fn whatever_is_above_a_limit_is_refused_with_the_limit() {
    let limits = limits();
    let (all, line) = (Region::everywhere(), || Track::line(Vector3::zeros(), Vector3::x()).unwrap());
    let just_above = |limit: f64| limit * 1.001;
    let damping = limits.damping_n_s_per_m();
    limit_named_in(
        Field::viscous([0.0, just_above(damping), 0.0], all, &limits).unwrap_err(),
        "damping_n_s_per_m",
        damping,
    );
    let mass = limits.mass_kg(7.0);
    limit_named_in(Field::inertial(just_above(mass), 7.0, all, &limits).unwrap_err(), "mass_kg", mass);
    limit_named_in(Field::constant([8.0, 8.0, 0.0], all).unwrap_err(), "force_n", MOST_FORCE_N);
    let k = limits.stiffness_n_per_m();
    limit_named_in(Guide::new(line(), just_above(k), 1.0, &limits).unwrap_err(), "stiffness_n_per_m", k);
    limit_named_in(
        Guide::new(line(), k, just_above(damping), &limits).unwrap_err(),
        "damping_n_s_per_m",
        damping,
    );
    let force = k * 0.01 / 6.75;
    limit_named_in(Magnetism::new(just_above(force), 0.01, &limits).unwrap_err(), "force_n", force);
    let hz = limits.frequency_hz();
    limit_named_in(Vibration::new(just_above(hz), 0.1, 1.0, &limits).unwrap_err(), "frequency_hz", hz);
    limit_named_in(Vibration::new(100.0, 1.1, 1.0, &limits).unwrap_err(), "amplitude_n", 1.0);
    let guide = || Guide::new(line(), 500.0, 1.0, &limits).unwrap();
    limit_named_in(guide().with_force_limit(11.0).unwrap_err(), "force_limit_n", MOST_FORCE_N);
    limit_named_in(guide().with_break_away(6.0).unwrap_err(), "break_away_n", 5.0);
    // Lets go at 4 mm and must not capture there.
    let latch = guide().with_capture(0.0039).unwrap().with_break_away(2.0);
    limit_named_in(latch.unwrap_err(), "capture_m", 0.0038);
    assert!(Field::viscous([damping; 3], all, &limits).is_ok(), "the limit itself is allowed");
}

#[test]
fn values_that_are_none_are_refused() {
    let (limits, all) = (limits(), Region::everywhere());
    let line = || Track::line(Vector3::zeros(), Vector3::x()).unwrap();
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(Field::viscous([bad, 0.0, 0.0], all, &limits).is_err());
        assert!(Field::inertial(bad, 10.0, all, &limits).is_err());
        assert!(Field::inertial(0.1, bad, all, &limits).is_err());
        assert!(Guide::new(line(), bad, 1.0, &limits).is_err());
        assert!(Guide::new(line(), 100.0, bad, &limits).is_err());
        let guide = || Guide::new(line(), 100.0, 1.0, &limits).unwrap();
        assert!(guide().with_deadband(bad).is_err() && guide().with_capture(bad).is_err());
        assert!(guide().with_break_away(bad).is_err() && guide().with_force_limit(bad).is_err());
        assert!(Magnetism::new(bad, 0.01, &limits).is_err() && Magnetism::new(0.1, bad, &limits).is_err());
        assert!(Vibration::new(bad, 0.1, 1.0, &limits).is_err());
        assert!(Vibration::new(100.0, bad, 1.0, &limits).is_err());
        assert!(Vibration::new(100.0, 0.1, bad, &limits).is_err());
    }
    let nowhere = Vector3::new(f64::NAN, 0.0, 0.0);
    assert!(Field::constant(nowhere, all).is_err());
    for bad in [nowhere, Vector3::zeros(), Vector3::x() * 1e-200, Vector3::x() * f64::INFINITY] {
        assert!(Track::line(Vector3::zeros(), bad).is_err() && Track::plane(Vector3::zeros(), bad).is_err());
        assert!(Track::path(&[Vector3::y(), Vector3::y() + bad]).is_err());
    }
    assert!(Track::line(nowhere, Vector3::x()).is_err() && Track::path(&[nowhere, Vector3::x()]).is_err());
    assert!(Track::path(&[Vector3::x()]).is_err());
    let many: Vec<_> = (0..257).map(|i| Vector3::x() * f64::from(i)).collect();
    assert!(Track::path(&many).is_err() && Track::path(&many[1..]).is_ok());
}

/// A mass on a line that starts at 0.1 m/s or 1 mm off, in a hand of this damping or none. Its force is held for a
/// tick, comes one tick late, and the velocity is told 2.5 ms late. Its largest speed (m/s) in the first and in the
/// last tenth of two seconds.
fn swing(mut felt: Felt, mass_kg: f64, hand_n_s_per_m: f64, start_m: f64) -> (f64, f64) {
    let parts = 10;
    // It rested before, as far as anybody was told.
    let (mut x, mut v, mut last) = (start_m, 0.1, Vector3::zeros());
    let mut speeds: VecDeque<f64> = std::iter::repeat_n(0.0, 25).collect();
    let (mut first_m_s, mut end_m_s) = (0.0f64, 0.0f64);
    for tick in 0..2000 {
        let force = last;
        last = felt.beside(moving(Vector3::x() * x, Vector3::x() * speeds[0]));
        for _ in 0..parts {
            let dt = DT / f64::from(parts);
            v += (force.x - hand_n_s_per_m * v) / mass_kg * dt;
            x += v * dt;
            speeds.pop_front();
            speeds.push_back(v);
        }
        let seen = if tick < 200 { &mut first_m_s } else { &mut end_m_s };
        if !(200..1800).contains(&tick) {
            *seen = seen.max(v.abs());
        }
    }
    (first_m_s, end_m_s)
}

/// The device that the limits are for.
const MASS: f64 = Limits::DEFAULT_DEVICE_MASS_KG;
/// A hand that holds it lightly.
const HAND: f64 = 3.0;

fn field(field: Field) -> Felt {
    Felt::new(vec![field], vec![], vec![])
}

#[test]
fn dampers_at_the_limit_calm_the_least_device_and_three_times_of_it_would_not() {
    let at = |times: f64| {
        // Limits of a heavier device let it through.
        let heavy = limits().with_device_mass(1.0).unwrap();
        let damping = times * limits().damping_n_s_per_m();
        swing(field(Field::viscous([damping; 3], Region::everywhere(), &heavy).unwrap()), MASS, 0.0, 0.0)
    };
    let (_, end) = at(1.0);
    assert!(end < 1e-6, "{end}");
    // The margin is two in the frequency domain.
    let (first, end) = at(3.0);
    assert!(end >= first, "{first} {end}");
}

#[test]
fn masses_at_the_limit_leave_the_least_device_calm_and_four_times_of_it_would_not() {
    for cutoff in [3.0, 10.0, 30.0] {
        let at = |times: f64| {
            let heavy = limits().with_device_mass(1.0).unwrap();
            let mass = times * limits().mass_kg(cutoff);
            let made = Field::inertial(mass, cutoff, Region::everywhere(), &heavy).unwrap();
            swing(field(made), MASS, 0.0, 0.0)
        };
        let ((first, end), (wild, wilder)) = (at(1.0), at(4.0));
        // Nothing brakes it: it goes on at the speed that both masses share.
        assert!(end <= first, "{cutoff} Hz: {first} {end}");
        assert!(wilder > 2.0 * wild.min(0.1), "{cutoff} Hz: {wild} {wilder}");
    }
}

#[test]
fn guides_at_their_limits_come_to_rest_in_a_light_hand() {
    let (k, b) = (limits().stiffness_n_per_m(), limits().damping_n_s_per_m());
    for damping in [0.0, 0.5 * b, b] {
        let track = Track::plane(Vector3::zeros(), Vector3::x()).unwrap();
        let guide = Guide::new(track, k, damping, &limits()).unwrap();
        let (first, end) = swing(Felt::new(vec![], vec![guide], vec![]), MASS, HAND, 1e-3);
        assert!(end < 1e-3 * first, "{damping}: {first} {end}");
    }
}
