//! The layouts of three Phantoms (Melder 5.1, figure 5.1): do the arms reach a common space without meeting?
//!
//! The figure is a photograph without numbers, so the poses are chosen here, by these tests' own measures: the cube
//! that all three tips reach, and the distance between the arms, as capsules, over precision grasps of a 5 cm cube.
//! How the driver's simulated arms stand there: `three_phantoms_driver.rs`.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use io_driver::config::DriverConfig;
use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::kinematics::{Kinematics, Mechanism};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};
use world::Layout;

fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(name)
}

fn layout(hand: &str) -> [Isometry3<f64>; 3] {
    let layout = Layout::load(config(&format!("layouts/three-phantoms-{hand}.toml"))).expect("in order");
    [0, 1, 2].map(|device| layout.placement(device).rigid().expect("rigid"))
}

fn premium() -> ArmFile {
    let text = builtin("premium-1.5").expect("built in");
    match DeviceFile::parse(text, Path::new("premium-1.5")).expect("in order") {
        DeviceFile::Arm(arm) => *arm,
        DeviceFile::Ideal(_) => panic!("an arm"),
    }
}

/// A rod of some thickness, in W (m).
struct Capsule {
    ends: [Point3<f64>; 2],
    radius_m: f64,
}

/// What is in the way of other arms. Radii are chosen: about those of the real arms, generously: tubes of 12 mm, a body with
/// motors of 120 mm on a column.
fn capsules(arm: &ArmFile, X_WD: &Isometry3<f64>, joints: [f64; 3]) -> [Capsule; 4] {
    let Kinematics::Premium(premium) = &arm.mechanism else { panic!("a Premium") };
    let [l1, l2] = premium.link_lengths_m();
    let ahead = Vector3::new(joints[0].sin(), 0.0, joints[0].cos());
    let along = |angle: f64| ahead * angle.cos() + Vector3::y() * angle.sin();
    let down = ahead * joints[2].sin() - Vector3::y() * joints[2].cos();
    let shoulder = Point3::new(0.0, l2, -l1);
    let elbow = shoulder + along(joints[1]) * l1;
    // The parallelogram's rod runs below the upper arm, on the forearm's side.
    let beside = down * 0.0325;
    let rod =
        |a: Point3<f64>, b: Point3<f64>, radius_m: f64| Capsule { ends: [X_WD * a, X_WD * b], radius_m };
    [
        rod(shoulder, shoulder - Vector3::y() * 0.2, 0.06),
        rod(shoulder, elbow, 0.02),
        rod(shoulder + beside, elbow + beside, 0.01),
        rod(elbow, elbow + down * l2, 0.01),
    ]
}

/// Smallest distance between the surfaces of two rods (m); negative: they meet.
fn distance(a: &Capsule, b: &Capsule) -> f64 {
    let (p, d) = (a.ends[0], a.ends[1] - a.ends[0]);
    let (q, e) = (b.ends[0], b.ends[1] - b.ends[0]);
    let r = p - q;
    let (dd, ee, de, dr, er) = (d.dot(&d), e.dot(&e), d.dot(&e), d.dot(&r), e.dot(&r));
    let denominator = dd * ee - de * de;
    let mut s = if denominator > 1e-12 { ((de * er - dr * ee) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let t = ((de * s + er) / ee).clamp(0.0, 1.0);
    s = ((de * t - dr) / dd).clamp(0.0, 1.0);
    (r + d * s - e * t).norm() - a.radius_m - b.radius_m
}

/// Joint angles that bring the tip there, if stops and workspace allow it.
fn reach(arm: &ArmFile, X_WD: &Isometry3<f64>, tip_W: &Point3<f64>) -> Option<[f64; 3]> {
    let tip_D = X_WD.inverse() * tip_W;
    let joints = arm.mechanism.inverse(tip_D.coords).ok()?;
    let from_centre = tip_D.coords - Vector3::from(arm.workspace.centre_m);
    let is_inside = (0..3).all(|i| from_centre[i].abs() <= arm.workspace.size_m[i] / 2.0);
    (is_inside && arm.mechanism.joint_limits().contains(joints)).then_some(joints)
}

/// Tips of thumb, index and middle finger on a cube of 50 mm about the origin, held by a right hand: the thumb on the
/// left face, the others on the right one, side by side as fingers are.
const GRASP_M: [[f64; 3]; 3] = [[-0.025, 0.0, 0.0], [0.025, 0.006, -0.012], [0.025, -0.006, 0.012]];

/// Smallest distance between two arms that hold the cube at this pose (m); `None`: a tip cannot be there.
fn clearance(
    arm: &ArmFile,
    bases: &[Isometry3<f64>; 3],
    grasp: &[[f64; 3]; 3],
    X_WB: &Isometry3<f64>,
) -> Option<f64> {
    let mut arms = Vec::new();
    for (base, tip) in bases.iter().zip(grasp) {
        arms.push(capsules(arm, base, reach(arm, base, &(X_WB * Point3::from(*tip)))?));
    }
    let pairs = [(0, 1), (0, 2), (1, 2)].into_iter();
    let distances = pairs.flat_map(|(i, j)| {
        arms[i].iter().flat_map(|a| arms[j].iter().map(|b| distance(a, b))).collect::<Vec<_>>()
    });
    Some(distances.fold(f64::INFINITY, f64::min))
}

/// Edge of the largest cube about the origin in which all three tips reach every place (m), to a millimetre.
fn common_cube_m(arm: &ArmFile, bases: &[Isometry3<f64>; 3]) -> f64 {
    let all_reach = |half: f64| {
        let steps = || (-4..=4).map(|i| f64::from(i) / 4.0 * half);
        steps().all(|x| {
            steps().all(|y| {
                steps().all(|z| bases.iter().all(|base| reach(arm, base, &Point3::new(x, y, z)).is_some()))
            })
        })
    };
    (1..200)
        .map(|half_mm| f64::from(half_mm) * 0.5e-3)
        .take_while(|half| all_reach(*half))
        .last()
        .map_or(0.0, |half| 2.0 * half)
}

/// Cubes held in the middle of the common workspace: 27 places within 60 mm, each turned in 27 ways.
fn grasps() -> impl Iterator<Item = Isometry3<f64>> {
    let thrice = |step: f64| {
        let ways = [-step, 0.0, step];
        ways.into_iter().flat_map(move |x| {
            ways.into_iter().flat_map(move |y| ways.into_iter().map(move |z| Vector3::new(x, y, z)))
        })
    };
    thrice(0.03).flat_map(move |place| {
        thrice(30f64.to_radians())
            .map(move |turn| Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(turn)))
    })
}

fn least_clearance(bases: &[Isometry3<f64>; 3], grasp: &[[f64; 3]; 3]) -> f64 {
    let arm = premium();
    let held = grasps().map(|X_WB| {
        clearance(&arm, bases, grasp, &X_WB).unwrap_or_else(|| panic!("a tip does not reach {X_WB}"))
    });
    held.fold(f64::INFINITY, f64::min)
}

fn mirrored(point: [f64; 3]) -> [f64; 3] {
    [-point[0], point[1], point[2]]
}

#[test]
fn all_three_tips_reach_a_common_cube_of_at_least_ten_centimetres() {
    for hand in ["right", "left"] {
        let edge_m = common_cube_m(&premium(), &layout(hand));
        assert!(edge_m >= 0.10, "{hand}: {edge_m} m");
    }
}

#[test]
fn arms_do_not_meet_while_they_hold_a_cube_and_turn_it() {
    // Two forearms of 20 mm whose tips are 26.8 mm apart leave 6.8 mm at the tips themselves.
    let right = least_clearance(&layout("right"), &GRASP_M);
    let left = least_clearance(&layout("left"), &GRASP_M.map(mirrored));
    for (hand, clearance_m) in [("right", right), ("left", left)] {
        assert!(clearance_m > 5.0e-3, "{hand}: {clearance_m} m");
    }
}

#[test]
fn three_upright_arms_would_meet() {
    // What the leaning arms are good for, and that the measure sees a collision.
    let upright = layout("right").map(|base| {
        let ahead = base.rotation * Vector3::z();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), ahead.x.atan2(ahead.z));
        Isometry3::from_parts(Translation3::new(0.0, -0.1, 0.0), turn)
    });
    assert!(least_clearance(&upright, &GRASP_M) < 0.0);
}

#[test]
fn the_left_hands_layout_is_the_mirror_image_of_the_right_hands() {
    for (right, left) in layout("right").iter().zip(layout("left")) {
        // A Premium is its own mirror image: its x turns over with the world's.
        for p in [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]] {
            let mirror_of_right = mirrored((right * Point3::from(p)).coords.into());
            let gap = (left * Point3::from(mirrored(p))).coords - Vector3::from(mirror_of_right);
            // The files have nine digits.
            assert!(gap.norm() < 1e-8, "{gap}");
        }
    }
}

#[test]
fn no_base_stands_in_front_where_the_hand_comes_from() {
    for hand in ["right", "left"] {
        for base in layout(hand) {
            let turret = base * Point3::new(0.0, 0.17, -0.215);
            assert!(turret.z <= 0.0 || turret.x.abs() > 0.2, "{hand}: {turret}");
        }
    }
}

#[test]
fn the_drivers_arms_begin_in_the_middle_with_fingertips_three_centimetres_apart_and_do_not_meet() {
    let config = DriverConfig::load(&config("driver/three-phantoms.toml")).expect("in order");
    let starts: Vec<[f64; 3]> = config
        .devices
        .iter()
        .map(|device| device.backend.wish().expect("simulated").start_m.into())
        .collect();
    let grasp: [[f64; 3]; 3] = starts.try_into().expect("three");
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let apart_m = (Vector3::from(grasp[i]) - Vector3::from(grasp[j])).norm();
        // The file has millimetres.
        assert!((apart_m - 0.03).abs() < 1e-3, "{i} {j}: {apart_m} m");
    }
    let middle: Vector3<f64> = grasp.into_iter().map(Vector3::from).sum::<Vector3<f64>>() / 3.0;
    assert!(middle.norm() < 1e-3, "{middle}");
    let clearance_m = clearance(&premium(), &layout("right"), &grasp, &Isometry3::identity());
    assert!(clearance_m.expect("each tip reaches its start, inside its workspace") > 5e-3, "{clearance_m:?}");
}

#[test]
fn rods_are_as_far_apart_as_geometry_says() {
    let rod = |a: [f64; 3], b: [f64; 3]| Capsule { ends: [a.into(), b.into()], radius_m: 0.1 };
    let along_x = rod([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    for (other, expected) in [
        (rod([0.0, 1.0, -1.0], [0.0, 1.0, 1.0]), 0.8),   // crossing
        (rod([0.0, 0.5, 0.0], [2.0, 0.5, 0.0]), 0.3),    // beside
        (rod([4.0, 4.0, 0.0], [5.0, 4.0, 0.0]), 4.8),    // end to end: 3, 4, 5
        (rod([0.0, 0.15, 0.0], [0.0, 1.0, 0.0]), -0.05), // overlapping
    ] {
        // Sums of numbers below 10.
        assert!((distance(&along_x, &other) - expected).abs() < 1e-14);
        assert!((distance(&other, &along_x) - expected).abs() < 1e-14);
    }
}
