//! Viscous, inertial and constant fields: their closed forms, their rims, and what noise does to them.

use crate::solids;
use std::f64::consts::TAU;

use crate::common::*;
use crate::effects::{Felt, limits, moving};
use haptics::{Cuboid, Field, MOST_FORCE_N, Region, Sphere};
use nalgebra::{Isometry3, Vector3};

const B: f64 = 4.0;
const RIM: f64 = 0.005;

fn alone(field: Field) -> Felt {
    Felt::new(vec![field], vec![], vec![])
}

fn viscous(region: Region) -> Field {
    Field::viscous([B; 3], region, &limits()).unwrap()
}

/// A box of 0.1 m turned and shifted.
fn tilted() -> (Cuboid, Isometry3<f64>) {
    let X_WB = Isometry3::new(Vector3::new(0.02, -0.01, 0.03), Vector3::new(0.4, -0.7, 1.1));
    (Cuboid::new([0.1, 0.06, 0.08]).unwrap(), X_WB)
}

#[test]
fn a_viscous_field_pulls_with_b_times_the_velocity_against_it() {
    let mut felt = alone(viscous(Region::everywhere()));
    let v = Vector3::new(0.1, -0.2, 0.05);
    // One product of each component.
    assert_eq!(felt.beside(moving(Vector3::zeros(), v)), -v * B);
    // Nobody tells a velocity: by the difference of positions, rounded to 1e-17 m over 1 ms.
    let force = felt.beside(&(v * 1e-3));
    assert!((force + v * B).norm() < B * 1e-13, "{force}");
    assert_eq!(
        felt.beside(moving(v, Vector3::zeros())),
        Vector3::zeros(),
        "at rest, whatever the positions say"
    );
}

#[test]
fn an_estimate_that_is_not_finite_leaves_the_difference() {
    let mut felt = alone(viscous(Region::everywhere()));
    felt.beside(&Vector3::zeros());
    let force = felt.beside(moving(Vector3::x() * 1e-4, Vector3::repeat(f64::NAN)));
    assert!((force + Vector3::x() * (0.1 * B)).norm() < 1e-12, "{force}");
}

#[test]
fn a_viscous_field_damps_each_axis_of_its_region_by_its_own() {
    let (form, X_WB) = tilted();
    let damping = Vector3::new(5.0, 0.0, 1.5);
    let region = Region::within(form, X_WB, RIM).unwrap();
    let v = Vector3::new(0.1, 0.3, -0.2);
    let R = X_WB.rotation.to_rotation_matrix();
    let expected = -(R.matrix() * nalgebra::Matrix3::from_diagonal(&damping) * R.matrix().transpose() * v);
    for region in [region, Region::everywhere_turned(X_WB)] {
        let mut felt = alone(Field::viscous(damping, region, &limits()).unwrap());
        let force = felt.beside(moving(X_WB.translation.vector, v));
        // Two rotations of a vector of less than 1 N.
        assert!((force - expected).norm() < 1e-14, "{force} {expected}");
    }
}

#[test]
fn a_viscous_field_never_gives_energy() {
    let (form, X_WB) = tilted();
    let region = Region::within(form, X_WB, RIM).unwrap();
    let mut felt = alone(Field::viscous([5.0, 0.0, 1.5], region, &limits()).unwrap());
    let (mut noise, mut damped) = (Noise(3), 0);
    for _ in 0..10_000 {
        let (at, v) = (X_WB.translation.vector + noise.vector(0.03), noise.vector(0.3));
        let power = felt.beside(moving(at, v)).dot(&v);
        // -v B v is rounded against itself.
        assert!(power <= 1e-15, "{power} W");
        damped += u32::from(power < -1e-6);
    }
    assert!((1000..9999).contains(&damped), "inside and outside: {damped}");
}

#[test]
fn the_rim_fades_by_three_squares_less_two_cubes() {
    let region =
        Region::within(Sphere::new(0.05).unwrap(), Isometry3::translation(0.1, 0.0, 0.0), RIM).unwrap();
    let weight = |depth: f64| region.weight(&Vector3::new(0.1, 0.05 - depth, 0.0));
    for (depth, expected) in [(-0.01, 0.0), (0.25 * RIM, 0.15625), (0.5 * RIM, 0.5), (0.05, 1.0)] {
        // A depth of 1e-3 m is the difference of numbers near 0.05, which are rounded to 7e-18: 1e-14 of the rim.
        assert!((weight(depth) - expected).abs() < 1e-13, "{depth} {}", weight(depth));
    }
    assert_eq!(region.weight(&Vector3::repeat(f64::NAN)), 0.0);
    assert_eq!(region.weight(&Vector3::repeat(f64::INFINITY)), 0.0);
}

/// The steepest slope of the weight is 1.5 over the rim's width, and no form's depth changes faster than its point
/// moves, but for an ellipsoid's, which is another measure.
#[test]
fn no_region_is_entered_with_a_step() {
    let mut noise = Noise(11);
    for solid in solids::all() {
        let rim = 0.01 * solid.size_m;
        let region = Region::within(solid.form, Isometry3::identity(), rim).unwrap();
        let step_m = 4e-3 * rim;
        let (mut partly, mut steepest) = (0, 0.0f64);
        for _ in 0..200 {
            let along = noise.vector(1.0).normalize() * step_m;
            let from = solid.point(noise.uniform(), noise.uniform()) - along * 250.0;
            let weights: Vec<f64> = (0..500).map(|i| region.weight(&(from + along * f64::from(i)))).collect();
            partly += weights.iter().filter(|w| (0.01..0.99).contains(*w)).count();
            let steps = weights.windows(2).map(|pair| (pair[1] - pair[0]).abs() / step_m);
            steepest = steps.fold(steepest, f64::max);
        }
        assert!(partly > 500, "{}: {partly}", solid.name);
        // Twice that for measures that are no distances; a step would be 1 in 0.004 rims, eighty times as much.
        let most = 2.0 * 1.5 / rim;
        assert!(steepest <= most, "{}: {steepest} of {most}", solid.name);
    }
}

#[test]
fn an_inertial_field_is_felt_as_its_mass_as_late_as_its_filter_says() {
    let (mass, cutoff, amplitude) = (0.2, 10.0, 0.02);
    for hz in [0.5, 2.0, 10.0] {
        let mut felt = alone(Field::inertial(mass, cutoff, Region::everywhere(), &limits()).unwrap());
        let (w, corner) = (TAU * hz, TAU * cutoff);
        let expected_n = mass * amplitude * w * w * corner * corner / (w * w + corner * corner);
        let lag = 2.0 * (w / corner).atan();
        let mut worst = 0.0f64;
        for tick in 0..4000 {
            let t = f64::from(tick) * DT;
            let force = felt.beside(&(Vector3::y() * (amplitude * (w * t).sin()))).y;
            // -m a of a sine is in phase with it. By 1 s a filter of 10 Hz has forgotten 27 powers of e.
            if t > 1.0 {
                worst = worst.max((force - expected_n * (w * t - lag).sin()).abs());
            }
        }
        // Straight from tick to tick a sine loses (w T)^2 / 12 of itself, at 10 Hz 3e-4, and gains ripples that the
        // filter passes with corner^2: 2e-3 of the force at most.
        assert!(worst < 3e-3 * expected_n, "{hz} Hz: {worst} of {expected_n} N");
    }
}

#[test]
fn positions_in_steps_are_no_rattle_of_an_inertial_field() {
    let (mass, cutoff, q) = (0.1, 10.0, 3e-5);
    let corner = TAU * cutoff;
    // Every reading is off by q / 2 at most; the impulse response has w^2 (2 + 2 / e^2) of absolute integral, and 1 %
    // more for a reading that stands for a tick.
    let bound_n = mass * corner * corner * (1.0 + (-2.0f64).exp()) * q * 1.01;
    assert!(bound_n < 0.0137, "14 mN, as documented: {bound_n}");
    let field = || alone(Field::inertial(mass, cutoff, Region::everywhere(), &limits()).unwrap());
    let (mut exact, mut stepped) = (field(), field());
    let mut noise = Noise(5);
    let (mut worst, mut square, mut naive) = (0.0f64, 0.0, 0.0f64);
    let mut last = [0.0; 3];
    for tick in 0..20_000 {
        // A hand that strokes, rests and trembles by some steps.
        let t = f64::from(tick) * DT;
        let stroke = if (t as u64).is_multiple_of(2) { 0.03 * (2.0 * t).sin() } else { 0.01 };
        let x = stroke + noise.gaussian() * q;
        let read = (x / q).round() * q;
        let force = exact.beside(&(Vector3::x() * x)).x;
        let off = stepped.beside(&(Vector3::x() * read)).x - force;
        worst = worst.max(off.abs());
        square += off * off;
        last = [last[1], last[2], read];
        naive = naive.max(mass * (last[2] - 2.0 * last[1] + last[0]).abs() / (DT * DT));
    }
    assert!(worst <= bound_n, "{worst} of {bound_n} N");
    assert!((square / 20_000.0).sqrt() < 0.25 * bound_n, "and far less in the mean");
    assert!(naive > 3.0, "the second difference would rattle with newtons: {naive}");
}

#[test]
fn coming_at_a_steady_speed_into_a_mass_gives_no_jerk() {
    let region = Region::within(Sphere::new(0.05).unwrap(), Isometry3::identity(), RIM).unwrap();
    let mut felt = alone(Field::inertial(0.2, 10.0, region, &limits()).unwrap());
    let v = Vector3::x() * 0.3;
    for tick in 0..400 {
        let force = felt.beside(moving(Vector3::x() * (-0.06 + 0.3e-3 * f64::from(tick)), v));
        // The filter began at that speed; positions of 0.06 m are rounded to 7e-18, times 0.2 w^2.
        assert!(force.norm() < 1e-10, "{tick}: {force}");
    }
}

#[test]
fn ticks_that_were_missed_do_not_shake_a_mass() {
    let mut every = alone(Field::inertial(0.2, 10.0, Region::everywhere(), &limits()).unwrap());
    let mut fifth = alone(Field::inertial(0.2, 10.0, Region::everywhere(), &limits()).unwrap());
    let mut noise = Noise(2);
    let (mut at, mut v) = (Vector3::zeros(), Vector3::zeros());
    every.beside(&at);
    fifth.beside(&at);
    for round in 0..200 {
        v += noise.vector(0.05);
        let mut force = Vector3::zeros();
        for _ in 0..5 {
            at += v * 1e-3;
            force = every.beside(&at);
        }
        fifth.dt_s = 5e-3;
        let coarse = fifth.beside(&at);
        // The solution for a straight way is exact: only roundings of positions over 1 ms differ, times m w.
        assert!((force - coarse).norm() < 1e-10, "{round}: {force} {coarse}");
    }
}

#[test]
fn a_constant_field_is_the_same_everywhere_within() {
    let wind = Vector3::new(0.5, -1.0, 0.25);
    let mut felt = alone(Field::constant(wind, Region::everywhere()).unwrap());
    let mut noise = Noise(1);
    for _ in 0..100 {
        assert_eq!(felt.beside(&noise.vector(1.0)), wind);
    }
    let region = Region::within(Sphere::new(0.05).unwrap(), Isometry3::identity(), RIM).unwrap();
    let mut felt = alone(Field::constant(wind, region).unwrap());
    assert_eq!(felt.beside(&(Vector3::x() * 0.0501)), Vector3::zeros());
    assert_eq!(felt.beside(&(Vector3::x() * 0.0449)), wind);
}

#[test]
fn fields_add_and_none_pulls_more_than_its_bound() {
    let fields =
        vec![viscous(Region::everywhere()), Field::constant([1.0, 0.0, 0.0], Region::everywhere()).unwrap()];
    let mut felt = Felt::new(fields, vec![], vec![]);
    let v = Vector3::y() * 0.1;
    assert_eq!(felt.beside(moving(Vector3::zeros(), v)), Vector3::new(1.0, -0.1 * B, 0.0));
    let mut felt = alone(viscous(Region::everywhere()));
    let force = felt.beside(moving(Vector3::zeros(), Vector3::new(300.0, 400.0, 0.0)));
    // Scaled: two roundings.
    assert!((force + Vector3::new(0.6, 0.8, 0.0) * MOST_FORCE_N).norm() < 1e-14, "{force}");
}

#[test]
fn after_a_reset_a_force_comes_on_within_the_ramp() {
    let wind = Field::constant([1.0, 0.0, 0.0], Region::everywhere()).unwrap();
    let mut felt = alone(wind);
    felt.state.set_ramp_in(0.1).unwrap();
    for round in 0..2 {
        for tick in 1..=150 {
            let expected = (f64::from(tick) / 100.0).min(1.0);
            // A hundred sums of 0.01.
            assert!((felt.beside(&Vector3::zeros()).x - expected).abs() < 1e-13, "{round} {tick}");
        }
        felt.state.reset();
    }
}
