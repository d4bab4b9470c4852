//! Positions: closed forms, the published inverse as an oracle, and round trips over the whole
//! range of the joints.

use std::f64::consts::{FRAC_PI_2, PI};

use io_driver::kinematics::{Interval, JointLimits, Kinematics, Mechanism, Premium, Unreachable};
use nalgebra::Vector3;
use proptest::prelude::*;

const L1: f64 = 0.215;
const L2: f64 = 0.170;

fn premium() -> Premium {
    let degrees = |min: f64, max: f64| Interval { min: min.to_radians(), max: max.to_radians() };
    let joints = [degrees(-90.0, 90.0), degrees(-61.0, 113.0), degrees(-23.0, 167.0)];
    Premium::new([L1, L2], JointLimits { joints, elbow: degrees(-53.0, 54.0), elbow_sign: -1.0 })
}

/// Positions are sums of three products of numbers below the reach, each rounded, then added to
/// numbers of the same size: 64 half-units in the last place of the reach, 3e-15 m, hold them all.
fn rounding_m() -> f64 {
    64.0 * 0.5 * f64::EPSILON * premium().reach_m()
}

fn assert_near(a: Vector3<f64>, b: Vector3<f64>) {
    assert!((a - b).norm() <= rounding_m(), "{a} is not {b}");
}

/// Every pose within the stops on a grid of about three degrees, ends included.
fn all_poses() -> impl Iterator<Item = [f64; 3]> {
    let limits = premium().joint_limits();
    let grid = |i: Interval| (0..=60).map(move |k| i.min + (i.max - i.min) * f64::from(k) / 60.0);
    let [first, second, third] = limits.joints;
    grid(first)
        .flat_map(move |a| grid(second).flat_map(move |b| grid(third).map(move |c| [a, b, c])))
        .filter(move |&joints| limits.contains(joints))
}

/// The inverse as Cavusoglu, Feygin and Tendick print it; valid in front of the turret's axis.
fn published_inverse(tip: Vector3<f64>) -> [f64; 3] {
    let ahead = tip.z + L1;
    let big_r = tip.x.hypot(ahead);
    let r = big_r.hypot(tip.y - L2);
    let th2 = ((L1 * L1 + r * r - L2 * L2) / (2.0 * L1 * r)).acos() + (tip.y - L2).atan2(big_r);
    let th3 = th2 + ((L1 * L1 + L2 * L2 - r * r) / (2.0 * L1 * L2)).acos() - FRAC_PI_2;
    [tip.x.atan2(ahead), th2, th3]
}

#[test]
fn all_angles_are_zero_at_the_origin() {
    assert_eq!(premium().forward([0.0; 3]), Vector3::zeros());
    // 0.215^2 + 0.17^2 is not exact in binary; the elbow's sine inherits a few units.
    for angle in premium().inverse(Vector3::zeros()).unwrap() {
        assert!(angle.abs() <= 16.0 * f64::EPSILON, "{angle}");
    }
}

#[test]
fn the_turret_swings_the_tip_around_the_shoulder() {
    assert_near(premium().forward([FRAC_PI_2, 0.0, 0.0]), Vector3::new(L1, 0.0, -L1));
    assert_near(premium().forward([-FRAC_PI_2, 0.0, 0.0]), Vector3::new(-L1, 0.0, -L1));
}

#[test]
fn the_upper_arm_lifts_the_tip_without_turning_the_forearm() {
    // Upper arm upright: the shoulder (0, l2, -l1) plus l1 up, then the forearm hanging l2.
    assert_near(premium().forward([0.0, FRAC_PI_2, 0.0]), Vector3::new(0.0, L1, -L1));
}

#[test]
fn the_forearm_swings_forward_and_up() {
    assert_near(premium().forward([0.0, 0.0, FRAC_PI_2]), Vector3::new(0.0, L2, L2));
    assert_near(premium().forward([0.0, 0.0, PI]), Vector3::new(0.0, 2.0 * L2, 0.0));
}

#[test]
fn the_inverse_is_the_published_one_in_front_of_the_axis() {
    let premium = premium();
    for joints in all_poses() {
        let tip = premium.forward(joints);
        if tip.z + L1 < 1e-6 {
            continue;
        }
        let (ours, theirs) = (premium.inverse(tip).unwrap(), published_inverse(tip));
        for j in 0..3 {
            // Within the stops no argument of acos comes nearer to +-1 than sin 54 degrees for
            // the elbow and cos 20 degrees for the shoulder, so a unit in it stays below three
            // in the angle; the arguments carry about ten.
            assert!((ours[j] - theirs[j]).abs() < 64.0 * f64::EPSILON, "{ours:?} {theirs:?}");
        }
    }
}

#[test]
fn joints_survive_the_way_to_the_tip_and_back() {
    let premium = premium();
    let mut poses = 0;
    for joints in all_poses() {
        let conditioning = premium.singularity(joints);
        let rho = L1 * joints[1].cos() + L2 * joints[2].sin();
        // On the axis theta1 is anything; behind it both turrets fit at their stops.
        if rho.abs() < 1e-6 || (rho < 0.0 && joints[0].cos() < 1e-9) {
            continue;
        }
        let back = premium.inverse(premium.forward(joints)).unwrap();
        // An error of the position becomes one of the joints through the inverse Jacobian.
        let tolerance = rounding_m() / conditioning.smallest;
        for j in 0..3 {
            assert!((back[j] - joints[j]).abs() <= tolerance, "{joints:?} came back as {back:?}");
        }
        poses += 1;
    }
    assert!(poses > 50_000, "only {poses} poses were tried");
}

#[test]
fn some_poses_within_the_stops_lie_behind_the_axis() {
    // Guards the test above: without these the second turret branch would never be tried.
    let behind = all_poses().filter(|j| L1 * j[1].cos() + L2 * j[2].sin() < -1e-3).count();
    assert!(behind > 100, "{behind}");
}

#[test]
fn the_tip_survives_the_way_to_the_joints_and_back() {
    let premium = premium();
    let shoulder = Vector3::new(0.0, L2, -L1);
    let (mut reached, mut refused) = (0, 0);
    // A cube of 0.8 m around the shoulder holds all the tip can reach; 41 steps of 20 mm.
    for k in 0..41 * 41 * 41 {
        let steps = Vector3::new(k % 41, k / 41 % 41, k / 1681).map(|i| f64::from(i) - 20.0);
        let tip = shoulder + 0.02 * steps;
        match premium.inverse(tip) {
            Ok(joints) => {
                assert_near(premium.forward(joints), tip);
                assert!(joints[1].abs() <= PI, "the upper arm went the long way round: {joints:?}");
                reached += 1;
            }
            Err(_) => refused += 1,
        }
    }
    // The shell between the spheres of 45 mm and 385 mm has 29,800 cells of 8 cm^3.
    assert!((29_000..31_000).contains(&reached), "{reached}");
    assert!(refused > 30_000, "{refused}");
}

#[test]
fn out_of_reach_says_by_how_much() {
    let (premium, shoulder) = (premium(), Vector3::new(0.0, L2, -L1));
    let direction = Vector3::new(0.6, 0.48, 0.64);
    match premium.inverse(shoulder + (L1 + L2 + 0.01) * direction) {
        Err(Unreachable::TooFar { beyond_m, reach_m }) => {
            assert!((beyond_m - 0.01).abs() < rounding_m() && reach_m == L1 + L2, "{beyond_m}");
        }
        other => panic!("{other:?}"),
    }
    match premium.inverse(shoulder + 0.040 * direction) {
        Err(Unreachable::TooNear { short_m, hole_m }) => {
            assert!((short_m - 0.005).abs() < rounding_m() && hole_m == L1 - L2, "{short_m}");
        }
        other => panic!("{other:?}"),
    }
    let message = premium.inverse(Vector3::new(0.0, 0.0, 1.0)).unwrap_err().to_string();
    assert!(message.contains("beyond the reach") && message.contains("0.385"), "{message}");
}

#[test]
fn rounding_at_full_stretch_and_fold_is_no_reason_to_refuse() {
    let premium = premium();
    for k in -80..=80 {
        for elbow in [FRAC_PI_2, -FRAC_PI_2] {
            let shoulder = f64::from(k).to_radians();
            let tip = premium.forward([0.3, shoulder, shoulder + elbow]);
            assert_near(premium.forward(premium.inverse(tip).unwrap()), tip);
        }
    }
}

#[test]
fn the_turret_stays_where_it_was_zeroed_when_the_tip_is_on_its_axis() {
    let joints = premium().inverse(Vector3::new(0.0, 0.4, -L1)).unwrap();
    assert_eq!(joints[0], 0.0);
}

#[test]
fn links_of_equal_length_fold_to_the_shoulder_without_nan() {
    let equal = Premium::new([0.2, 0.2], JointLimits::UNBOUNDED);
    let joints = equal.inverse(Vector3::new(0.0, 0.2, -0.2)).unwrap();
    assert!(joints.iter().all(|q| q.is_finite()));
    assert!((equal.forward(joints) - Vector3::new(0.0, 0.2, -0.2)).norm() < rounding_m());
}

#[test]
fn a_position_that_is_not_finite_is_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(premium().inverse(Vector3::new(0.0, bad, 0.0)), Err(Unreachable::NotFinite));
    }
}

#[test]
fn kinematics_own_no_heap() {
    // What is Copy owns nothing on the heap, and the functions return arrays by value.
    fn holds_no_heap<T: Copy + Send>(_: &T) {}
    holds_no_heap(&Kinematics::Premium(premium()));
}

proptest! {
    #[test]
    fn no_position_panics(x: f64, y: f64, z: f64) {
        if let Ok(joints) = premium().inverse(Vector3::new(x, y, z)) {
            prop_assert!(joints.iter().all(|q| q.is_finite()));
        }
    }

    /// Also beyond the stops of the forearm: an unfolded elbow is what makes the pose unique.
    #[test]
    fn poses_with_an_unfolded_elbow_come_back_to_themselves(
        th1 in -1.57..1.57, th2 in -1.06..1.97, bend in -1.5..1.5,
    ) {
        let premium = premium();
        let joints = [th1, th2, th2 + bend];
        let smallest = premium.singularity(joints).smallest;
        prop_assume!(smallest > 1e-6);
        let back = premium.inverse(premium.forward(joints)).unwrap();
        for j in 0..3 {
            prop_assert!((back[j] - joints[j]).abs() <= rounding_m() / smallest);
        }
    }
}
