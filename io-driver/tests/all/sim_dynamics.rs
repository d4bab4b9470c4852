//! Mass, Coriolis and weight of the Premium 1.5 against the paper's numbers, against loose bodies, and
//! against each other.

use std::f64::consts::FRAC_PI_2;

use io_driver::kinematics::gravity::{Bodies, GRAVITY_M_PER_S2};
use io_driver::kinematics::{Interval, JointConvention, JointLimits, Mechanism, Premium, WoodenHaptics};
use io_driver::sim::dynamics::{Dynamics, Inertias};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use crate::rigid_bodies;

const LINKS: [f64; 2] = [0.215, 0.170];

const BODIES: Bodies = Bodies {
    mass_a_kg: 0.0202,
    mass_c_kg: 0.0249,
    mass_be_kg: 0.2359,
    mass_df_kg: 0.1906,
    l3_m: 0.0325,
    l5_m: -0.0368,
    l6_m: 0.0527,
};

const INERTIAS: Inertias = Inertias {
    a_kg_m2: [0.4864e-4, 0.001843e-4, 0.4864e-4],
    c_kg_m2: [0.959e-4, 0.959e-4, 0.0051e-4],
    be_kg_m2: [11.09e-4, 10.06e-4, 0.591e-4],
    df_kg_m2: [7.11e-4, 0.629e-4, 6.246e-4],
    base_yy_kg_m2: 11.87e-4,
};

/// Counts its upper arm downwards from upright, and the turret the wrong way round.
const OTHER: JointConvention =
    JointConvention { sign: [-1.0, -1.0, 1.0], offset_rad: [0.0, FRAC_PI_2, 0.25] };

/// Of the RE25's rotor at each joint: reduction squared times 10.3 g cm^2.
const ROTORS_KG_M2: [f64; 3] =
    [10.3e-7 * 175.0 * 175.0 / 169.0, 10.3e-7 * 11.3 * 11.3, 10.3e-7 * 11.3 * 11.3];

/// Near the cube root of the unit roundoff, where the two errors of a central difference meet.
const STEP: f64 = 1e-5;

/// All elements of M are below this (kg m^2) and change with the angles as sines and cosines of at most twice
/// an angle: their third derivatives are below eight times it.
const LARGEST_KG_M2: f64 = 5e-3;

/// Error of a central difference of an element of M: cut off `h^2 / 6` times the third derivative along a
/// direction of at most 3 rad/s a joint, so (2 * 3 * sqrt 2)^3 at most; rounding, ten units of the element
/// over `2 h`.
const SLOPE_ERROR: f64 = LARGEST_KG_M2 * (STEP * STEP / 6.0 * 620.0 + 10.0 * f64::EPSILON / (2.0 * STEP));

fn premium() -> Dynamics {
    Dynamics::new(LINKS, &BODIES, &INERTIAS, JointConvention::LINKAGE)
}

fn mechanism() -> Premium {
    let degrees = |min: f64, max: f64| Interval { min: min.to_radians(), max: max.to_radians() };
    let joints = [degrees(-90.0, 90.0), degrees(-61.0, 113.0), degrees(-23.0, 167.0)];
    Premium::new(LINKS, JointLimits { joints, elbow: degrees(-53.0, 54.0), elbow_sign: -1.0 })
}

fn any_joints() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-3.2..3.2_f64)
}

fn any_rates() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-3.0..3.0_f64)
}

fn any_convention() -> impl Strategy<Value = JointConvention> {
    prop::sample::select(vec![JointConvention::LINKAGE, OTHER])
}

/// Any way for a base to stand.
fn any_base() -> impl Strategy<Value = UnitQuaternion<f64>> {
    prop::array::uniform3(-3.0..3.0_f64).prop_map(|turn| UnitQuaternion::from_scaled_axis(turn.into()))
}

fn moved(joints: [f64; 3], direction: [f64; 3], by: f64) -> [f64; 3] {
    std::array::from_fn(|j| joints[j] + by * direction[j])
}

/// An arm whose only mass is a kilogram in the middle of a forearm of twice the length: at the tip of the
/// real one.
fn point_mass_at_the_tip([l1, l2]: [f64; 2], convention: JointConvention) -> Dynamics {
    let none = [0.0; 3];
    let bodies = Bodies {
        mass_a_kg: 1.0,
        mass_c_kg: 0.0,
        mass_be_kg: 0.0,
        mass_df_kg: 0.0,
        l3_m: 0.0,
        l5_m: 0.0,
        l6_m: 0.0,
    };
    let inertias =
        Inertias { a_kg_m2: none, c_kg_m2: none, be_kg_m2: none, df_kg_m2: none, base_yy_kg_m2: 0.0 };
    Dynamics::new([l1, 2.0 * l2], &bodies, &inertias, convention)
}

/// Derivative of M along a direction of joint space, by central differences.
fn slope(dynamics: &Dynamics, joints: [f64; 3], direction: [f64; 3]) -> Matrix3<f64> {
    let at = |h: f64| dynamics.mass_matrix(moved(joints, direction, h));
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}

fn axis(j: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == j { 1.0 } else { 0.0 })
}

/// The masses that a push on the tip along x, y, z meets: the free tip's `1 / (e^T J M^-1 J^T e)`, and the
/// one of a tip led along the axis without stepping aside, `e^T J^-T M J^-1 e`.
fn apparent_masses_kg(mass_matrix: Matrix3<f64>, joints: [f64; 3]) -> (Vector3<f64>, Vector3<f64>) {
    let jacobian = mechanism().jacobian(joints);
    let mobility = jacobian * mass_matrix.try_inverse().unwrap() * jacobian.transpose();
    let led = mobility.try_inverse().unwrap();
    (mobility.diagonal().map(f64::recip), led.diagonal())
}

#[test]
fn at_home_the_mass_matrix_is_the_paper_s() {
    let mass = premium().mass_matrix([0.0; 3]);
    let expected = Matrix3::from_diagonal(&Vector3::new(3.57e-3, 2.43e-3, 0.932e-3));
    // The paper prints three digits.
    assert!((mass - expected).amax() < 5e-6, "{mass}");
    assert_eq!((mass[(0, 1)], mass[(0, 2)], mass[(1, 2)]), (0.0, 0.0, 0.0));
}

#[test]
fn at_home_the_tip_weighs_what_the_paper_says() {
    let (free, led) = apparent_masses_kg(premium().mass_matrix([0.0; 3]), [0.0; 3]);
    let grams = free * 1e3;
    // Two digits are known.
    assert!((grams - Vector3::new(77.0, 52.0, 32.0)).amax() < 0.5, "{grams}");
    // At home both M and J are diagonal, so a push along an axis moves the tip along it: the definitions
    // agree.
    assert!((led - free).amax() < 1e-12, "{led}");
}

#[test]
fn at_home_with_rotors_the_tip_weighs_what_the_data_sheet_says_but_sideways() {
    let mass = premium().mass_matrix([0.0; 3]) + Matrix3::from_diagonal(&ROTORS_KG_M2.into());
    let grams = apparent_masses_kg(mass, [0.0; 3]).0 * 1e3;
    assert!((grams - Vector3::new(81.0, 55.0, 37.0)).amax() < 0.5, "{grams}");
    assert!(grams.y < 75.0 && grams.z < 75.0, "{grams}");
    // Sideways the whole turret turns. 81 g are 8 % more than the sheet's 75 g, which names no direction;
    // units differ among each other by up to 20 %.
    assert!(grams.x < 1.2 * 75.0, "{grams}");
}

#[test]
fn away_from_home_a_tip_that_may_step_aside_is_lighter() {
    let joints = [0.3, 0.6, 0.9];
    let (free, led) = apparent_masses_kg(premium().mass_matrix(joints), joints);
    assert!((0..3).all(|i| free[i] <= led[i] * (1.0 + 1e-12)), "{free} {led}");
    assert!(free.y < 0.99 * led.y, "{free} {led}");
}

#[test]
fn every_motion_within_the_stops_has_energy() {
    let (dynamics, limits) = (premium(), mechanism().joint_limits());
    let [_, second, third] = limits.joints;
    let grid = |i: Interval, k: u32| i.min + (i.max - i.min) * f64::from(k) / 200.0;
    let mut poses = 0;
    for k in 0..201 * 201 {
        let joints = [0.0, grid(second, k % 201), grid(third, k / 201)];
        if limits.contains(joints) {
            let mass = dynamics.mass_matrix(joints);
            let smallest = mass.symmetric_eigenvalues().min();
            // The lightest motion is the forearm's own; nowhere is it a tenth of what it is at home.
            assert!(mass == mass.transpose() && smallest > 1e-4, "{joints:?}: {smallest}");
            poses += 1;
        }
    }
    assert!(poses > 10_000, "{poses}");
}

#[test]
fn free_motion_keeps_its_energy_with_and_without_weight() {
    let dynamics = premium();
    for weight in [0.0, 1.0] {
        let mut state = ([0.1, 0.2, 0.4], [2.0, -3.0, 4.0]);
        let energy = |(joints, rates): ([f64; 3], [f64; 3])| {
            dynamics.kinetic_energy(joints, rates) + weight * dynamics.potential_energy(joints)
        };
        let before = energy(state);
        let (mut turned, dt) = (0.0_f64, 5e-5);
        for _ in 0..40_000 {
            state = runge_kutta(&dynamics, state, weight, dt);
            turned = turned.max(state.0[1].abs());
        }
        // The recurrence is of fourth order: 2 s of some (w dt)^4 = (5e-4)^4 per radian turned, 1e-12 of the
        // energy; ten times that for the rounding of 40,000 steps.
        assert!((energy(state) / before - 1.0).abs() < 1e-11, "{}", energy(state) / before - 1.0);
        assert!(turned > 1.0, "it has moved: {turned}");
    }
}

/// A step of the classical fourth-order scheme for the arm left to itself.
fn runge_kutta(
    dynamics: &Dynamics,
    (joints, rates): ([f64; 3], [f64; 3]),
    weight: f64,
    dt: f64,
) -> ([f64; 3], [f64; 3]) {
    let acceleration = |joints: [f64; 3], rates: [f64; 3]| -> [f64; 3] {
        let coriolis = dynamics.coriolis(joints, rates) * Vector3::from(rates);
        let torque = -coriolis - weight * Vector3::from(dynamics.holding_torque(joints));
        (dynamics.mass_matrix(joints).try_inverse().unwrap() * torque).into()
    };
    let (v1, a1) = (rates, acceleration(joints, rates));
    let (v2, a2) = {
        let v = moved(rates, a1, 0.5 * dt);
        (v, acceleration(moved(joints, v1, 0.5 * dt), v))
    };
    let (v3, a3) = {
        let v = moved(rates, a2, 0.5 * dt);
        (v, acceleration(moved(joints, v2, 0.5 * dt), v))
    };
    let (v4, a4) = {
        let v = moved(rates, a3, dt);
        (v, acceleration(moved(joints, v3, dt), v))
    };
    let mean = |k1: [f64; 3], k2: [f64; 3], k3: [f64; 3], k4: [f64; 3]| {
        std::array::from_fn(|j| (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]) / 6.0)
    };
    (moved(joints, mean(v1, v2, v3, v4), dt), moved(rates, mean(a1, a2, a3, a4), dt))
}

proptest! {
    #[test]
    fn the_energy_is_that_of_the_bodies_one_by_one(
        joints in any_joints(), rates in any_rates(), convention in any_convention(),
    ) {
        let bodies = rigid_bodies::bodies(LINKS, &BODIES, &INERTIAS);
        let dynamics = Dynamics::new(LINKS, &BODIES, &INERTIAS, convention);
        let (angles, rates_of_linkage) = (convention.linkage_angles(joints), convention.turned(rates));
        let expected = rigid_bodies::kinetic_energy(&bodies, angles, rates_of_linkage);
        // Speeds by differences of length 1e-5: 3^3 (1e-5)^2 / 6 = 5e-10 of them, rounding 1e-16 / 1e-5 of 1
        // m; the energy has their squares, and is at most half of 5e-3 * 27 J.
        let tolerance = 4.0 * 0.5 * LARGEST_KG_M2 * 27.0 * 1e-9;
        prop_assert!((dynamics.kinetic_energy(joints, rates) - expected).abs() < tolerance);
    }

    #[test]
    fn the_coriolis_matrix_is_made_of_the_christoffel_symbols_of_the_mass_matrix(
        joints in any_joints(), rates in any_rates(), convention in any_convention(),
    ) {
        let dynamics = Dynamics::new(LINKS, &BODIES, &INERTIAS, convention);
        let slopes = [0, 1, 2].map(|j| slope(&dynamics, joints, axis(j)));
        let expected = Matrix3::from_fn(|i, j| {
            let symbol = |k: usize| 0.5 * (slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)]);
            (0..3).map(|k| symbol(k) * rates[k]).sum()
        });
        let error = (dynamics.coriolis(joints, rates) - expected).amax();
        // Three symbols of three slopes, halved, at rates up to 3.
        prop_assert!(error <= 3.0 * 1.5 * 3.0 * SLOPE_ERROR, "{error}");
    }

    #[test]
    fn what_the_mass_matrix_gains_the_coriolis_matrix_takes(
        joints in any_joints(), rates in any_rates(), convention in any_convention(),
    ) {
        let dynamics = Dynamics::new(LINKS, &BODIES, &INERTIAS, convention);
        let skew = slope(&dynamics, joints, rates) - 2.0 * dynamics.coriolis(joints, rates);
        let error = (skew + skew.transpose()).amax();
        prop_assert!(error <= 2.0 * SLOPE_ERROR, "{skew}");
    }

    #[test]
    fn the_weight_is_that_of_the_bodies_one_by_one_however_the_base_stands(
        joints in any_joints(), convention in any_convention(), base in any_base(),
    ) {
        let bodies = rigid_bodies::bodies(LINKS, &BODIES, &INERTIAS);
        let dynamics = Dynamics::new(LINKS, &BODIES, &INERTIAS, convention).in_base(&base);
        let angles = convention.linkage_angles(joints);
        let expected = rigid_bodies::potential_energy(&bodies, angles, &base.to_rotation_matrix());
        // Five products of up to 0.1 J with places that are turned twice: a few dozen roundings.
        prop_assert!((dynamics.potential_energy(joints) - expected).abs() < 64.0 * f64::EPSILON * 0.1);
    }

    #[test]
    fn the_weight_is_the_slope_of_the_potential_energy(
        joints in any_joints(), direction in any_rates(), convention in any_convention(), base in any_base(),
    ) {
        let upright = Dynamics::new(LINKS, &BODIES, &INERTIAS, convention);
        for dynamics in [upright, upright.in_base(&base)] {
            let at = |h: f64| dynamics.potential_energy(moved(joints, direction, h));
            let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            let torque = Vector3::from(dynamics.holding_torque(joints)).dot(&Vector3::from(direction));
            // 0.1 J, third derivative at most (3 * sqrt 3)^3 = 140, times (1e-5)^2 / 6; rounding 1e-17 / 1e-5 thrice.
            prop_assert!((slope - torque).abs() < 5e-10, "{slope} {torque}");
        }
    }

    /// Turning the turret turns the world about the base's y, the other way round.
    #[test]
    fn in_a_leaning_base_the_turret_s_angle_turns_where_up_is(
        joints in any_joints(), turret in -3.2..3.2_f64, base in any_base(),
    ) {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turret);
        let turned = premium().in_base(&(base * turn)).holding_torque(joints);
        let moved = premium().in_base(&base).holding_torque([joints[0] + turret, joints[1], joints[2]]);
        for (turned, moved) in turned.into_iter().zip(moved) {
            prop_assert!((turned - moved).abs() < 64.0 * f64::EPSILON * 0.1, "{turned} {moved}");
        }
    }

    /// Weight makes and loses no energy of a leaning arm that moves freely, either.
    #[test]
    fn a_leaning_arm_that_falls_keeps_its_energy(
        joints in any_joints(), rates in any_rates(), base in any_base(),
    ) {
        let dynamics = premium().in_base(&base);
        let energy = |(joints, rates)| {
            dynamics.kinetic_energy(joints, rates) + dynamics.potential_energy(joints)
        };
        let mut motion = (joints, rates);
        let before = energy(motion);
        for _ in 0..200 {
            motion = runge_kutta(&dynamics, motion, 1.0, 1e-4);
        }
        // Rates stay below 10 rad/s: (rate * step)^4 a radian turned, of at most 0.1 J; far above rounding.
        prop_assert!((energy(motion) - before).abs() < 1e-11, "{}", energy(motion) - before);
    }

    /// At rest the energy of weight and push together has no slope but the motors' torque.
    #[test]
    fn weight_and_a_push_at_the_tip_are_held_by_the_transposed_jacobian(
        joints in any_joints(), force in prop::array::uniform3(-10.0..10.0_f64), direction in any_rates(),
    ) {
        let (dynamics, mechanism, force) = (premium(), mechanism(), Vector3::from(force));
        // The user pushes back with -force.
        let at = |h: f64| {
            let joints = moved(joints, direction, h);
            dynamics.potential_energy(joints) + force.dot(&mechanism.forward(joints))
        };
        let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        let torque = Vector3::from(dynamics.holding_torque(joints))
            + Vector3::from(mechanism.joint_torque(joints, force));
        // 7 J along up to 5.2 rad/s, cut off (5.2 * 1e-5)^2 / 6, rounding 1e-15 / 1e-5.
        prop_assert!((slope - torque.dot(&Vector3::from(direction))).abs() < 7.0 * 5.2 * 1e-9, "{slope}");
    }

    /// Ties the dynamics to each mechanism's kinematics, conventions of its joints included.
    #[test]
    fn a_mass_at_the_tip_is_seen_through_the_jacobian(joints in any_joints(), base in any_base()) {
        let up = base.inverse_transform_vector(&Vector3::y());
        let wooden = WoodenHaptics::new([0.080, 0.205, 0.245], [0.220, 0.080], JointLimits::UNBOUNDED);
        let premium = mechanism();
        let arms: [(&dyn Mechanism, Dynamics); 2] = [
            (&premium, point_mass_at_the_tip(premium.link_lengths_m(), Premium::CONVENTION)),
            (&wooden, point_mass_at_the_tip(wooden.link_lengths_m(), WoodenHaptics::CONVENTION)),
        ];
        for (arm, dynamics) in arms {
            let jacobian = arm.jacobian(joints);
            // Products of two numbers below 0.45 m, a handful of roundings each.
            let error = (dynamics.mass_matrix(joints) - jacobian.transpose() * jacobian).amax();
            prop_assert!(error < 32.0 * f64::EPSILON * 0.45 * 0.45, "{error}");
            let weight = arm.joint_torque(joints, up * GRAVITY_M_PER_S2);
            for (held, weight) in dynamics.in_base(&base).holding_torque(joints).into_iter().zip(weight) {
                prop_assert!((held - weight).abs() < 32.0 * f64::EPSILON * 4.5, "{held} {weight}");
            }
        }
    }

    #[test]
    fn upright_the_turret_s_angle_changes_nothing(joints in any_joints(), turret in -3.2..3.2_f64) {
        let turned = [turret, joints[1], joints[2]];
        prop_assert_eq!(premium().mass_matrix(turned), premium().mass_matrix(joints));
        prop_assert_eq!(premium().holding_torque(turned), premium().holding_torque(joints));
    }
}
