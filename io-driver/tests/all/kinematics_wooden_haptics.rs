//! WoodenHaptics: its makers' formulas as an oracle, round trips, velocities and forces.

use std::f64::consts::{FRAC_PI_2, PI};

use io_driver::kinematics::{Interval, JointLimits, Kinematics, Mechanism, Unreachable, WoodenHaptics};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

const LN: f64 = 0.080;
const LB: f64 = 0.205;
const LC: f64 = 0.245;
const ORIGIN: [f64; 2] = [0.220, 0.080];

/// Near the cube root of the unit roundoff, where the two errors of a central difference meet.
const STEP: f64 = 1e-5;

fn arm() -> WoodenHaptics {
    let degrees = |min: f64, max: f64| Interval { min: min.to_radians(), max: max.to_radians() };
    let joints = [degrees(-80.0, 80.0), degrees(-45.0, 100.0), degrees(-10.0, 135.0)];
    let limits = JointLimits { joints, elbow: degrees(25.0, 150.0), elbow_sign: 1.0 };
    WoodenHaptics::new([LN, LB, LC], ORIGIN, limits)
}

/// Their position, with z up and x to the user, turned into ours.
fn published_forward([a, b, c]: [f64; 3]) -> Vector3<f64> {
    let x = a.cos() * (LB * b.sin() + LC * c.sin()) - 0.22;
    let y = a.sin() * (LB * b.sin() + LC * c.sin());
    let z = LN + LB * b.cos() - LC * c.cos() - 0.08;
    Vector3::new(y, z, x)
}

/// Their torques from a force (fx, fy, fz) in their frame: the rows of J^T, written out.
fn published_torque([a, b, c]: [f64; 3], force_on_user: Vector3<f64>) -> [f64; 3] {
    let (fx, fy, fz) = (force_on_user.z, force_on_user.x, force_on_user.y);
    let rho = LB * b.sin() + LC * c.sin();
    [
        -a.sin() * rho * fx + a.cos() * rho * fy,
        LB * a.cos() * b.cos() * fx + LB * a.sin() * b.cos() * fy - LB * b.sin() * fz,
        LC * a.cos() * c.cos() * fx + LC * a.sin() * c.cos() * fy + LC * c.sin() * fz,
    ]
}

/// Positions are sums of three products of numbers below the reach, of angles that carry the rounding of pi/2
/// besides; 64 half-units in the last place of the reach, 3e-15 m, hold them all.
fn rounding_m() -> f64 {
    64.0 * 0.5 * f64::EPSILON * arm().reach_m()
}

/// Error of a central difference of the tip along a unit direction of joint space, m/rad: as for the Premium,
/// cut off `h^2 / 6 * sqrt 24` times the reach, and rounding over `2 h`, also of the angles themselves.
fn difference_error() -> f64 {
    let reach = arm().reach_m();
    STEP * STEP / 6.0 * 24.0_f64.sqrt() * reach + 16.0 * f64::EPSILON * reach / STEP
}

fn slope(joints: [f64; 3], direction: [f64; 3]) -> Vector3<f64> {
    let at = |h: f64| arm().forward(std::array::from_fn(|j| joints[j] + h * direction[j]));
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}

/// Every pose within the stops on a grid of about three degrees, ends included.
fn all_poses() -> impl Iterator<Item = [f64; 3]> {
    let limits = arm().joint_limits();
    let grid = |i: Interval| (0..=50).map(move |k| i.min + (i.max - i.min) * f64::from(k) / 50.0);
    let [first, second, third] = limits.joints;
    grid(first)
        .flat_map(move |a| grid(second).flat_map(move |b| grid(third).map(move |c| [a, b, c])))
        .filter(move |&joints| limits.contains(joints))
}

fn any_joints() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-3.2..3.2_f64)
}

#[test]
fn the_tip_is_where_the_makers_formula_puts_it() {
    for joints in all_poses() {
        assert!((arm().forward(joints) - published_forward(joints)).norm() <= rounding_m(), "{joints:?}");
    }
}

#[test]
fn an_upright_arm_with_a_level_forearm_is_above_the_origin() {
    let tip = arm().forward([0.0, 0.0, FRAC_PI_2]);
    assert!((tip - Vector3::new(0.0, LB, LC - 0.22)).norm() <= rounding_m(), "{tip}");
    let right = arm().forward([FRAC_PI_2, 0.0, FRAC_PI_2]);
    assert!((right - Vector3::new(LC, LB, -0.22)).norm() <= rounding_m(), "{right}");
}

#[test]
fn the_upper_arm_swings_forward_and_down() {
    let raised = arm().forward([0.0, 0.3, FRAC_PI_2]);
    let lowered = arm().forward([0.0, 0.5, FRAC_PI_2]);
    assert!(lowered.y < raised.y && lowered.z > raised.z);
}

#[test]
fn joints_survive_the_way_to_the_tip_and_back() {
    let arm = arm();
    let mut poses = 0;
    for joints in all_poses() {
        let [_, b, c] = joints;
        let rho = LB * b.sin() + LC * c.sin();
        // On the axis A is anything. Stops at +-80 degrees leave one turret for each other position.
        if rho.abs() < 1e-6 {
            continue;
        }
        let back = arm.inverse(arm.forward(joints)).unwrap();
        // An error of the position becomes one of the joints through the inverse Jacobian.
        let tolerance = rounding_m() / arm.singularity(joints).smallest;
        for j in 0..3 {
            assert!((back[j] - joints[j]).abs() <= tolerance, "{joints:?} came back as {back:?}");
        }
        poses += 1;
    }
    assert!(poses > 50_000, "only {poses} poses were tried");
}

#[test]
fn the_tip_survives_the_way_to_the_joints_and_back() {
    let (arm, shoulder) = (arm(), Vector3::new(0.0, 0.0, -0.22));
    let (mut reached, mut refused) = (0, 0);
    // A cube of 1 m around the shoulder holds all the tip can reach; 41 steps of 25 mm.
    for k in 0..41 * 41 * 41 {
        let steps = Vector3::new(k % 41, k / 41 % 41, k / 1681).map(|i| f64::from(i) - 20.0);
        let tip = shoulder + 0.025 * steps;
        match arm.inverse(tip) {
            Ok(joints) => {
                assert!((arm.forward(joints) - tip).norm() <= rounding_m(), "{tip}");
                reached += 1;
            }
            Err(_) => refused += 1,
        }
    }
    // The shell between the spheres of 40 mm and 450 mm has 24,400 cells of 15.6 cm^3.
    assert!((23_500..25_500).contains(&reached), "{reached}");
    assert!(refused > 30_000, "{refused}");
}

#[test]
fn out_of_reach_says_by_how_much() {
    let (arm, shoulder) = (arm(), Vector3::new(0.0, 0.0, -0.22));
    let direction = Vector3::new(0.6, 0.48, 0.64);
    match arm.inverse(shoulder + (LB + LC + 0.01) * direction) {
        Err(Unreachable::TooFar { beyond_m, .. }) => assert!((beyond_m - 0.01).abs() < rounding_m()),
        other => panic!("{other:?}"),
    }
    match arm.inverse(shoulder + 0.035 * direction) {
        Err(Unreachable::TooNear { short_m, .. }) => assert!((short_m - 0.005).abs() < rounding_m()),
        other => panic!("{other:?}"),
    }
    assert_eq!(arm.inverse(Vector3::new(f64::NAN, 0.0, 0.0)), Err(Unreachable::NotFinite));
}

#[test]
fn the_jacobian_is_the_slope_of_the_forward_map_everywhere() {
    for k in 0..21 * 21 * 21 {
        let joints = [k % 21, k / 21 % 21, k / 441].map(|i| 0.3 * f64::from(i) - 3.0);
        let axis = |j: usize| std::array::from_fn(|k| if k == j { 1.0 } else { 0.0 });
        let numeric = Matrix3::from_columns(&[0, 1, 2].map(|j| slope(joints, axis(j))));
        let error = arm().jacobian(joints) - numeric;
        assert!(error.amax() <= difference_error(), "{joints:?}: {error}");
    }
}

#[test]
fn the_singularities_are_the_axis_and_the_stretched_and_the_folded_elbow() {
    for k in 0..1000 {
        let joints @ [_, b, c] = [0.1, 0.7, 1.3].map(|rate| (rate * f64::from(k)).sin() * 3.0);
        let expected = (LB * b.sin() + LC * c.sin()) * LB * LC * (b + c).sin();
        let determinant = arm().jacobian(joints).determinant();
        // Counted forward of upright, the upper arm turns the determinant's sign as well.
        assert!((determinant.abs() - expected.abs()).abs() < 64.0 * f64::EPSILON * arm().reach_m().powi(3));
    }
    for (b, c) in [(0.4, PI - 0.4), (0.4, -0.4), (0.0, 0.0)] {
        assert!(arm().singularity([0.3, b, c]).inverse_condition() < 1e-15, "{b} {c}");
    }
}

#[test]
fn kinematics_own_no_heap() {
    fn holds_no_heap<T: Copy + Send>(_: &T) {}
    holds_no_heap(&Kinematics::WoodenHaptics(arm()));
}

proptest! {
    #[test]
    fn torques_are_the_makers_own(
        joints in any_joints(), force in prop::array::uniform3(-10.0..10.0_f64),
    ) {
        let torque = arm().joint_torque(joints, force.into());
        for (ours, theirs) in torque.into_iter().zip(published_torque(joints, force.into())) {
            // Sums of three products of at most 0.45 m and 10 N, a handful of roundings each.
            prop_assert!((ours - theirs).abs() < 64.0 * f64::EPSILON * 4.5, "{ours} {theirs}");
        }
    }

    #[test]
    fn motors_do_the_work_the_user_receives(
        joints in any_joints(), direction in any_joints(), force in prop::array::uniform3(-10.0..10.0_f64),
    ) {
        let length = Vector3::from(direction).norm();
        prop_assume!(length > 1e-3);
        let direction = direction.map(|d| d / length);
        let force = Vector3::from(force);
        let by_motors = Vector3::from(arm().joint_torque(joints, force)).dot(&Vector3::from(direction));
        let on_user = force.dot(&slope(joints, direction));
        prop_assert!((by_motors - on_user).abs() <= difference_error() * force.norm());
    }

    #[test]
    fn no_position_and_no_joints_panic(position: [f64; 3], joints: [f64; 3]) {
        if let Ok(joints) = arm().inverse(position.into()) {
            prop_assert!(joints.iter().all(|q| q.is_finite()));
        }
        let _ = (arm().forward(joints), arm().jacobian(joints), arm().singularity(joints));
        let _ = arm().joint_limits().contains(joints);
    }
}
