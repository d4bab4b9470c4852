//! What the files that come with the program say of the devices, and whether their numbers agree with each other.

use nalgebra::{Matrix3, Vector3};

use super::*;

#[test]
fn the_premium_is_the_one_of_the_paper() {
    let premium = premium();
    let Kinematics::Premium(mechanism) = premium.mechanism else { panic!("its kind says so") };
    assert_eq!(mechanism.link_lengths_m(), [0.215, 0.170]);
    assert_eq!(premium.encoders.reduction, [175.0 / 13.0, 11.3, 11.3]);
    assert_eq!(premium.motors.reduction, premium.encoders.reduction);
    assert_eq!((premium.peak_force_n, premium.continuous_force_n), (8.5, 1.4));
    assert_eq!(premium.joint_map().counts_to_angles([0; 3]), [0.0; 3]);
    assert_eq!(premium.motor_map().zero_codes(), [2048; 3]);
    let mass = premium.simulation.unwrap().dynamics.mass_matrix([0.0; 3]).diagonal();
    // The paper prints three digits.
    assert!((mass - Vector3::new(3.57e-3, 2.43e-3, 0.932e-3)).amax() < 5e-6, "{mass}");
}

#[test]
fn the_stops_are_the_published_degrees() {
    let limits = premium().mechanism.joint_limits();
    let degrees = |i: crate::kinematics::Interval| [i.min.to_degrees(), i.max.to_degrees()];
    let found = [limits.joints[0], limits.joints[1], limits.joints[2], limits.elbow].map(degrees);
    let published = [[-90.0, 90.0], [-61.0, 113.0], [-23.0, 167.0], [-53.0, 54.0]];
    for (found, published) in found.as_flattened().iter().zip(published.as_flattened()) {
        // The file gives 16 digits.
        assert!((found - published).abs() < 1e-13, "{found} {published}");
    }
}

/// How much of the workspace of an arm the tip can reach.
fn reached(ArmFile { mechanism, workspace, .. }: ArmFile) -> f64 {
    let inside = (0..9261).filter(|k| {
        let steps = [k % 21, k / 21 % 21, k / 441].map(|i| f64::from(i) / 20.0 - 0.5);
        let tip: [f64; 3] = std::array::from_fn(|i| workspace.centre_m[i] + workspace.size_m[i] * steps[i]);
        mechanism.inverse(tip.into()).is_ok_and(|q| mechanism.joint_limits().contains(q))
    });
    inside.count() as f64 / 9261.0
}

#[test]
fn most_of_the_workspace_is_within_the_stops() {
    // The Premium's file claims nine tenths, its corners are out of reach; the other one all of it.
    let part = reached(premium());
    assert!(part > 0.9 && part < 1.0, "{part}");
    assert_eq!(reached(arm(WOODEN)), 1.0);
}

#[test]
fn the_current_the_file_claims_gives_the_forces_it_claims() {
    let premium = premium();
    let peak = premium.motor_map().peak_joint_torque();
    // Home: x by the turret over l1, y by the upper arm l1, z by the forearm l2.
    let forces_n = [peak[0] / 0.215, peak[1] / 0.215, peak[2] / 0.170];
    for (found, claimed) in forces_n.iter().zip([8.1, 6.8, 8.6]) {
        assert!((found - claimed).abs() < 0.05, "{forces_n:?}");
    }
}

#[test]
fn the_wooden_arm_is_the_one_of_its_makers() {
    let wooden = arm(WOODEN);
    assert_eq!(wooden.kind, "wooden-haptics");
    let Kinematics::WoodenHaptics(mechanism) = wooden.mechanism else { panic!("its kind says so") };
    assert_eq!(mechanism.link_lengths_m(), [0.205, 0.245]);
    assert_eq!((wooden.encoders.counts_per_rev, wooden.encoders.reduction), (2000, [16.0, 12.0, 12.0]));
    assert_eq!((wooden.motors.torque_constant_nm_per_a, wooden.motors.peak_current_a), (0.0259, 3.0));
    assert_eq!(wooden.motor_map().zero_codes(), [32_768; 3]);
    // Zeroed with the upper arm upright and the forearm level: 80 + 205 - 80 mm up, 245 - 220 mm ahead.
    let zeroed = mechanism.forward(wooden.encoders.home_joint_angles_rad);
    assert!((zeroed - Vector3::new(0.0, 0.205, 0.025)).amax() < 1e-15, "{zeroed}");
}

#[test]
fn the_currents_and_encoders_of_the_wooden_arm_give_what_its_file_claims() {
    let wooden = arm(WOODEN);
    let at_origin = wooden.mechanism.inverse(Vector3::zeros()).unwrap();
    let peak = wooden.motor_map().peak_joint_torque();
    for (axis, claimed) in [5.6, 6.2, 4.8].into_iter().enumerate() {
        let push = Vector3::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 });
        let torque = wooden.mechanism.joint_torque(at_origin, push);
        let force_n = (0..3).map(|j| peak[j] / torque[j].abs()).fold(f64::INFINITY, f64::min);
        assert!((force_n - claimed).abs() < 0.06, "{axis}: {force_n}");
    }
    let [turret, upper_arm, _] = wooden.joint_map().rad_per_count();
    let mm = [1e3 * 0.220 * turret, 1e3 * 0.205 * upper_arm];
    assert!((mm[0] - 0.043).abs() < 5e-4 && (mm[1] - 0.054).abs() < 5e-4, "{mm:?}");
}

/// Rotors included; the file estimates the moments of inertia. Between half of the Premium's 75 g and three times that.
#[test]
fn the_tip_of_the_wooden_arm_weighs_what_a_wooden_arm_may_weigh() {
    let wooden = arm(WOODEN);
    let simulation = wooden.simulation.unwrap();
    let at_origin = wooden.mechanism.inverse(Vector3::zeros()).unwrap();
    let rotors = wooden.motors.reduction.map(|r| r * r * simulation.motor.rotor_inertia_kg_m2);
    let mass = simulation.dynamics.mass_matrix(at_origin) + Matrix3::from_diagonal(&rotors.into());
    let jacobian = wooden.mechanism.jacobian(at_origin);
    let mobility = jacobian * mass.try_inverse().unwrap() * jacobian.transpose();
    let kg = mobility.diagonal().map(f64::recip);
    assert!(kg.min() > 0.0375 && kg.max() < 0.225, "{kg}");
}

#[test]
fn the_rated_rise_is_what_the_continuous_current_makes_of_the_resistance() {
    // Winding to housing and housing to air, K/W, as the files' comments have them.
    for (text, kelvin_per_watt) in [(PREMIUM, 14.0 + 3.1), (WOODEN, 6.0 + 1.7)] {
        let arm = arm(text);
        let motor = arm.simulation.unwrap().motor;
        let cold_k = kelvin_per_watt * arm.heat.continuous_current_a.powi(2) * motor.resistance_ohm;
        // The resistance grows with the rise: rise = cold (1 + alpha rise).
        let rise_k = cold_k / (1.0 - motor.resistance_per_k * cold_k);
        assert!((motor.rated_rise_k / rise_k - 1.0).abs() < 0.02, "{rise_k} K, to the digits of the file");
    }
}

#[test]
fn friction_of_the_premium_is_the_data_sheet_s_at_the_tip() {
    let friction_nm = premium().simulation.unwrap().coulomb_nm;
    for (friction, lever_m) in friction_nm.into_iter().zip([0.215, 0.215, 0.170]) {
        // Rounded to two digits.
        assert!((friction / lever_m - 0.04).abs() < 1e-3, "{friction_nm:?}");
    }
}
