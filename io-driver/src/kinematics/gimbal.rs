//! Orientation of an instrumented gimbal's last link, from the joints of the arm and those of the gimbal.
//!
//! Problem: a thimble or a stylus turns about the tip without moving it; three more encoders tell how.
//! Model: a chain of rotations, each about an axis that the former carries along, in the linkage's angles:
//!
//! ```text
//! R_DG = Ry(theta1) Rx(-theta3) Ry(yaw) Rx(pitch) Rz(roll)
//!        turret     forearm     gimbal of the Premium's 6-DOF handle
//! ```
//!
//! Frames and signs: base frame D, x right, y up, z to the user. At home, with all five angles zero, the link's
//! axes are those of D: yaw turns about the forearm, which hangs (y); pitch about the fork across it (x); roll about
//! the stylus, which points to the user (z). Right-handed: a positive yaw turns the stylus to the right, a positive
//! pitch its far end up, seen by the user. `theta3` is the forearm's absolute angle forward of hanging, hence -theta3
//! about x. The upper arm is not in the chain: a parallelogram keeps the forearm's angle free of it.
//! Invariants: a unit quaternion for all finite angles; no panic.
//! Cost: five sine-cosine pairs, four products; no allocation.

use super::{Kinematics, Premium, WoodenHaptics};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Orientation in D of the link that carries the gimbal; at home that of D.
pub fn carrier(kinematics: &Kinematics, joints_rad: [f64; 3]) -> UnitQuaternion<f64> {
    let convention = match kinematics {
        Kinematics::Premium(_) => Premium::CONVENTION,
        Kinematics::WoodenHaptics(_) => WoodenHaptics::CONVENTION,
        Kinematics::Ideal(_) => return UnitQuaternion::identity(),
    };
    let [turret, _, forearm] = convention.linkage_angles(joints_rad);
    about(Vector3::y(), turret) * about(Vector3::x(), -forearm)
}

/// Orientation in D of the gimbal's last link: its yaw, pitch and roll (rad) on the link that carries it.
pub fn orientation(carrier: UnitQuaternion<f64>, gimbal_rad: [f64; 3]) -> UnitQuaternion<f64> {
    let [yaw, pitch, roll] = gimbal_rad;
    carrier * about(Vector3::y(), yaw) * about(Vector3::x(), pitch) * about(Vector3::z(), roll)
}

/// Yaw, pitch and roll (rad) that give the last link this orientation in D: the inverse of [`orientation`]. The pitch is
/// within a quarter turn; at one, yaw and roll turn about the same axis, and the roll is all of it.
pub fn angles(carrier: UnitQuaternion<f64>, orientation: UnitQuaternion<f64>) -> [f64; 3] {
    let r = (carrier.inverse() * orientation).to_rotation_matrix();
    let sin_pitch = -r[(1, 2)];
    if sin_pitch.abs() > 1.0 - 1e-12 {
        return [0.0, sin_pitch.signum() * FRAC_PI_2, (-r[(0, 1)]).atan2(r[(0, 0)])];
    }
    [r[(0, 2)].atan2(r[(2, 2)]), sin_pitch.asin(), r[(1, 0)].atan2(r[(1, 1)])]
}

/// The same for a gimbal that had the `former` angles a moment ago: its axes do not leap. Each may turn round and round, the
/// pitch may go through a quarter turn, and at one the yaw stays what it was. Right while no axis turns by a quarter
/// turn in that moment.
pub fn angles_after(
    former: [f64; 3],
    carrier: UnitQuaternion<f64>,
    orientation: UnitQuaternion<f64>,
) -> [f64; 3] {
    let [mut yaw, pitch, mut roll] = angles(carrier, orientation);
    if pitch.abs() == FRAC_PI_2 {
        (yaw, roll) = (former[0], roll + pitch.signum() * former[0]);
    }
    // Turning all three half a turn round, the pitch backwards, is the same orientation.
    let [one, other] = [[yaw, pitch, roll], [yaw + PI, PI - pitch, roll + PI]].map(|a| unwound(a, former));
    if distance(one, former) <= distance(other, former) { one } else { other }
}

/// The same directions, each within half a turn of the former angle.
fn unwound(angles: [f64; 3], former: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| angles[i] + TAU * ((former[i] - angles[i]) / TAU).round())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}

fn about(axis: Vector3<f64>, angle_rad: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{JointLimits, Mechanism, Premium};
    use nalgebra::{Matrix3, Rotation3};
    use proptest::prelude::*;

    fn premium() -> Kinematics {
        Kinematics::Premium(Premium::new([0.215, 0.170], JointLimits::UNBOUNDED))
    }

    fn wooden() -> Kinematics {
        Kinematics::WoodenHaptics(WoodenHaptics::new(
            [0.080, 0.205, 0.245],
            [0.220, 0.080],
            JointLimits::UNBOUNDED,
        ))
    }

    /// Written out element by element, without a library's notion of a rotation.
    fn matrix(axis: usize, angle: f64) -> Matrix3<f64> {
        let (s, c) = angle.sin_cos();
        match axis {
            0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
            1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
            _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
        }
    }

    proptest! {
        #[test]
        fn the_orientation_is_the_chain_of_elementary_rotations(
            joints in prop::array::uniform3(-1.5..1.5_f64), gimbal in prop::array::uniform3(-7.0..7.0_f64),
        ) {
            let found = orientation(carrier(&premium(), joints), gimbal);
            let written_out = matrix(1, joints[0]) * matrix(0, -joints[2])
                * matrix(1, gimbal[0]) * matrix(0, gimbal[1]) * matrix(2, gimbal[2]);
            // Five products of numbers up to one.
            prop_assert!((found.to_rotation_matrix().into_inner() - written_out).amax() < 1e-14);
            let by_library = Rotation3::from_axis_angle(&Vector3::y_axis(), joints[0])
                * Rotation3::from_axis_angle(&Vector3::x_axis(), -joints[2])
                * Rotation3::from_axis_angle(&Vector3::y_axis(), gimbal[0])
                * Rotation3::from_axis_angle(&Vector3::x_axis(), gimbal[1])
                * Rotation3::from_axis_angle(&Vector3::z_axis(), gimbal[2]);
            prop_assert!((found.to_rotation_matrix().into_inner() - by_library.into_inner()).amax() < 1e-14);
            prop_assert!((found.norm() - 1.0).abs() < 1e-14);
        }

        #[test]
        fn the_carrier_is_the_link_that_the_forward_kinematics_moves(
            joints in prop::array::uniform3(-1.5..1.5_f64), step in -0.3..0.3_f64,
        ) {
            // Turning the forearm alone moves the tip on a circle about the elbow, in which the link's own
            // downward direction, as long as the forearm, points from elbow to tip.
            for (kinematics, forearm_m) in [(premium(), 0.170), (wooden(), 0.245)] {
                let tip_less_elbow = |joints| carrier(&kinematics, joints) * Vector3::new(0.0, -forearm_m, 0.0);
                let other = [joints[0], joints[1], joints[2] + step];
                let moved = kinematics.forward(other) - kinematics.forward(joints);
                prop_assert!((tip_less_elbow(other) - tip_less_elbow(joints) - moved).amax() < 1e-14);
            }
        }
    }

    #[test]
    fn at_home_it_is_the_base_frame_and_each_axis_turns_the_stylus_as_documented() {
        let home = carrier(&premium(), [0.0, 0.3, 0.0]);
        assert_eq!(orientation(home, [0.0; 3]), UnitQuaternion::identity());
        let stylus = |gimbal| orientation(home, gimbal) * Vector3::z();
        assert!(stylus([0.1, 0.0, 0.0]).x > 0.09, "yaw turns it to the right");
        // Its near end, towards the user, sinks, so the far end rises.
        assert!(stylus([0.0, 0.1, 0.0]).y < -0.09);
        assert_eq!(stylus([0.0, 0.0, 0.1]), Vector3::z(), "roll turns it about itself");
    }

    #[test]
    fn the_angles_of_an_orientation_give_it_back() {
        let carrier = UnitQuaternion::from_euler_angles(0.3, -0.8, 0.2);
        for angles in
            [[0.0; 3], [0.5, -1.2, 3.0], [-3.0, 1.5, -0.1], [0.7, FRAC_PI_2, 0.4], [0.0, -FRAC_PI_2, 2.0]]
        {
            let turned = orientation(carrier, angles);
            let again = orientation(carrier, super::angles(carrier, turned));
            // An arc sine next to a quarter turn has the square root of an ulp.
            assert!(turned.angle_to(&again) < 1e-7, "{angles:?}");
        }
    }
    /// Turns a gimbal in steps of `step` from `from`, and gives the largest error of the angles that are found one
    /// after the other from nothing but the orientation.
    fn largest_error(from: [f64; 3], step: [f64; 3], steps: i32) -> f64 {
        let carrier = UnitQuaternion::from_euler_angles(0.3, -0.8, 0.2);
        let mut found = angles(carrier, orientation(carrier, from));
        let mut largest = 0.0_f64;
        for n in 0..=steps {
            let wanted = std::array::from_fn(|i| from[i] + step[i] * f64::from(n));
            found = angles_after(found, carrier, orientation(carrier, wanted));
            largest =
                found.iter().zip(wanted).map(|(a, b): (&f64, f64)| (a - b).abs()).fold(largest, f64::max);
        }
        largest
    }

    #[test]
    fn the_angles_of_a_gimbal_that_turns_go_on_without_a_leap() {
        // Beside a quarter turn of pitch yaw and roll are the quotients of numbers that are as small as its cosine,
        // and an arc sine has the square root of an ulp.
        for (axis, step) in [([0.03, 0.0, 0.0], 700), ([0.0, 0.0, -0.03], 700), ([0.02, 0.001, -0.03], 700)] {
            assert!(largest_error([0.5, -0.4, 0.2], axis, step) < 1e-6, "{axis:?}");
        }
        // Through a quarter turn, and exactly onto it.
        assert!(largest_error([0.5, 0.0, 0.2], [0.0, FRAC_PI_2 / 100.0, 0.0], 150) < 1e-6);
        assert!(largest_error([-0.5, 0.0, 0.2], [0.0, -FRAC_PI_2 / 100.0, 0.0], 150) < 1e-6);
    }
}
