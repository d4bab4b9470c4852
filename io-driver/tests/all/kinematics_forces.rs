//! Velocities and forces: the Jacobian against differences, virtual work, and what happens in
//! the singularities.

use std::f64::consts::FRAC_PI_2;

use io_driver::kinematics::{Ideal, JointLimits, Kinematics, Mechanism, Premium};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

const L1: f64 = 0.215;
const L2: f64 = 0.170;
const REACH: f64 = L1 + L2;

/// Near the cube root of the unit roundoff, where the two errors of a central difference meet.
const STEP: f64 = 1e-5;

/// Error of a central difference of the tip along a unit direction of joint space, m/rad.
///
/// Cut off: `h^2/6` times the third derivative. Each coordinate is a sum of products of two
/// sines, half sines of a sum and of a difference of joints, which change at a rate of at most
/// sqrt 2, so it is at most `2 sqrt 2 (l1 + l2)` and over three coordinates sqrt 3 times that.
/// Rounding: both positions are within 4 units of the reach, divided by `2h`.
fn difference_error() -> f64 {
    let cut_off = STEP * STEP / 6.0 * 24.0_f64.sqrt() * REACH;
    let rounding = 8.0 * f64::EPSILON * REACH / (2.0 * STEP);
    cut_off + rounding
}

fn premium() -> Premium {
    Premium::new([L1, L2], JointLimits::UNBOUNDED)
}

/// Derivative of the tip along `direction` by central differences.
fn slope(mechanism: &impl Mechanism, joints: [f64; 3], direction: [f64; 3]) -> Vector3<f64> {
    let at = |h: f64| mechanism.forward(std::array::from_fn(|j| joints[j] + h * direction[j]));
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}

fn numeric_jacobian(mechanism: &impl Mechanism, joints: [f64; 3]) -> Matrix3<f64> {
    let axis = |j: usize| std::array::from_fn(|k| if k == j { 1.0 } else { 0.0 });
    Matrix3::from_columns(&[0, 1, 2].map(|j| slope(mechanism, joints, axis(j))))
}

/// Any angles at all, also those no real device can take.
fn any_joints() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-3.2..3.2_f64)
}

fn any_force() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-10.0..10.0_f64).prop_map(Vector3::from)
}

#[test]
fn the_jacobian_at_home_is_that_of_two_crossed_levers() {
    // x by the turret over l1, y by the upper arm l1, z by the forearm l2.
    let expected = Matrix3::new(L1, 0.0, 0.0, 0.0, L1, 0.0, 0.0, 0.0, L2);
    assert_eq!(premium().jacobian([0.0; 3]), expected);
}

#[test]
fn the_jacobian_is_the_slope_of_the_forward_map_everywhere() {
    for k in 0..21 * 21 * 21 {
        let joints = [k % 21, k / 21 % 21, k / 441].map(|i| 0.3 * f64::from(i) - 3.0);
        let error = premium().jacobian(joints) - numeric_jacobian(&premium(), joints);
        // joints + STEP is rounded too: half a unit of 3 in 2e-5 turns the slope by 2e-11.
        let tolerance = difference_error() + 4.0 * f64::EPSILON / STEP * REACH;
        assert!(error.amax() <= tolerance, "{joints:?}: {error}");
    }
}

#[test]
fn the_determinant_vanishes_exactly_in_the_documented_singularities() {
    for k in 0..1000 {
        let joints = [0.1, 0.7, 1.3].map(|rate| (rate * f64::from(k)).sin() * 3.0);
        let rho = L1 * joints[1].cos() + L2 * joints[2].sin();
        let expected = rho * L1 * L2 * (joints[2] - joints[1]).cos();
        let determinant = premium().jacobian(joints).determinant();
        // Six products of three numbers below the reach, a handful of roundings each.
        assert!((determinant - expected).abs() < 32.0 * f64::EPSILON * REACH.powi(3));
    }
}

#[test]
fn torque_on_the_axis_is_bounded_and_cannot_push_sideways() {
    // cos theta2 = 0 and sin theta3 = 0 put the tip on the axis, up to the rounding of pi/2.
    let joints = [0.4, FRAC_PI_2, 0.0];
    let sideways = Vector3::new(0.4_f64.cos(), 0.0, -(0.4_f64.sin()));
    let torque = premium().joint_torque(joints, 100.0 * sideways);
    // rho is l1 times the 6e-17 by which cos(pi/2) misses zero, plus rounding of the direction.
    assert!(torque.iter().all(|t| t.abs() < 100.0 * REACH * f64::EPSILON), "{torque:?}");
}

#[test]
fn torque_at_full_stretch_is_bounded_and_cannot_push_along_the_arm() {
    let joints = [0.0, 0.5, 0.5 + FRAC_PI_2];
    let along = Vector3::new(0.0, 0.5_f64.sin(), 0.5_f64.cos());
    let torque = premium().joint_torque(joints, 100.0 * along);
    assert!(torque.iter().all(|t| t.abs() < 400.0 * REACH * f64::EPSILON), "{torque:?}");
}

#[test]
fn conditioning_is_zero_in_the_singularities_and_sensible_at_home() {
    let home = premium().singularity([0.0; 3]);
    assert!((home.largest - L1).abs() < f64::EPSILON && (home.smallest - L2).abs() < f64::EPSILON);
    assert!(premium().singularity([0.4, FRAC_PI_2, 0.0]).inverse_condition() < 1e-15);
    assert!(premium().singularity([0.0, 0.5, 0.5 + FRAC_PI_2]).inverse_condition() < 1e-15);
}

#[test]
fn the_ideal_device_passes_forces_through_the_enum_as_well() {
    let ideal = Kinematics::Ideal(Ideal);
    assert_eq!(ideal.joint_torque([0.1, 0.2, 0.3], Vector3::new(1.0, 2.0, 3.0)), [1.0, 2.0, 3.0]);
    assert_eq!(ideal.jacobian([0.0; 3]), Matrix3::identity());
}

proptest! {
    #[test]
    fn motors_do_the_work_the_user_receives(
        joints in any_joints(), direction in any_joints(), force in any_force(),
    ) {
        let length = Vector3::from(direction).norm();
        prop_assume!(length > 1e-3);
        let direction = direction.map(|d| d / length);
        let torque = premium().joint_torque(joints, force);
        let by_motors = Vector3::from(torque).dot(&Vector3::from(direction));
        let on_user = force.dot(&slope(&premium(), joints, direction));
        let tolerance = (difference_error() + 4.0 * f64::EPSILON / STEP * REACH) * force.norm();
        prop_assert!((by_motors - on_user).abs() <= tolerance, "{by_motors} {on_user}");
    }

    /// Derivation in `Premium::reach_m`; 1e-12 for rounding.
    #[test]
    fn torque_is_never_longer_than_reach_times_force(joints in any_joints(), force in any_force()) {
        let torque = Vector3::from(premium().joint_torque(joints, force));
        prop_assert!(torque.norm() <= REACH * force.norm() * (1.0 + 1e-12));
        let largest = premium().singularity(joints).largest;
        prop_assert!(torque.norm() <= largest * force.norm() * (1.0 + 1e-12));
    }

    /// Oracle: nalgebra's singular values, which are exact to a few units of the largest.
    #[test]
    fn conditioning_is_that_of_the_jacobian(joints in any_joints()) {
        let ours = premium().singularity(joints);
        let theirs = premium().jacobian(joints).singular_values();
        prop_assert!((ours.largest - theirs.max()).abs() < 1e-14);
        prop_assert!((ours.smallest - theirs.min()).abs() < 1e-14);
    }

    #[test]
    fn the_enum_answers_like_the_mechanism_inside(joints in any_joints(), force in any_force()) {
        let (inside, outside) = (premium(), Kinematics::Premium(premium()));
        prop_assert_eq!(inside.forward(joints), outside.forward(joints));
        prop_assert_eq!(inside.jacobian(joints), outside.jacobian(joints));
        prop_assert_eq!(inside.joint_torque(joints, force), outside.joint_torque(joints, force));
        prop_assert_eq!(inside.singularity(joints), outside.singularity(joints));
        prop_assert_eq!(inside.inverse(force), outside.inverse(force));
    }

    #[test]
    fn no_joints_and_no_force_panic(q: [f64; 3], force: [f64; 3]) {
        let premium = premium();
        let _ = premium.forward(q);
        let _ = premium.joint_torque(q, force.into());
        let _ = (premium.singularity(q).inverse_condition(), premium.joint_limits().contains(q));
    }
}
