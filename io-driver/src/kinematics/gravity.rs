//! What the arm's own weight asks of its motors.
//!
//! Model: the four bodies of a parallelogram linkage have one moment of weight, mass times place summed, times g:
//!
//! ```text
//! G2 = g (m_a l1 + m_c l1 / 2 + m_be l5),   G3 = g (m_a l2 / 2 + m_c l3 - m_df l6)
//! moment = (sin theta1, 0, cos theta1) (G2 cos theta2 + G3 sin theta3) + (0, 1, 0) (G2 sin theta2 - G3 cos theta3)
//! V = moment . up
//! ```
//!
//! with each body's centre as [`Bodies`] says, and `up` the world's up as the base sees it; the torques that hold the
//! arm are the slopes of V. In an upright base `up` is y, and the turret carries no weight; in one that leans, all three
//! joints do.
//! Frames and signs: base frame D, y along the turret's axis; world W, y up. Joints are the mechanism's own, see
//! [`JointConvention`]; a positive torque turns its joint towards a larger angle.
//! Invariant: a base that is turned about y is an upright one, bit for bit.
//! Cost: three sine-cosine pairs.
//! Reference: Cavusoglu, Feygin, Tendick, Presence 11(6), 2002, N2 and N3, for the upright base; the rest is geometry.

#![allow(non_snake_case)] // Frames are capital letters: R_WD turns what is in D to W.

use nalgebra::{UnitQuaternion, Vector3};

use super::{JointConvention, LinkagePose};

/// Standard gravity (m/s^2).
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Masses and where their centres are, by the paper's letters.
///
/// `a` is the forearm, its centre halfway; `c` the link parallel to the upper arm, its centre halfway and
/// `l3` further along the forearm; `be` the upper arm with its motor, its centre `l5` out on it; `df` the
/// link that drives the forearm, with its motor, its centre `l6` from the shoulder, away from where the
/// forearm points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bodies {
    /// Forearm (kg).
    pub mass_a_kg: f64,
    /// Parallel link (kg).
    pub mass_c_kg: f64,
    /// Upper arm and motor (kg).
    pub mass_be_kg: f64,
    /// Driving link and motor (kg).
    pub mass_df_kg: f64,
    /// Lever of the parallel link (m).
    pub l3_m: f64,
    /// Lever of the upper arm's body (m); negative: it balances.
    pub l5_m: f64,
    /// Lever of the driving link's body (m).
    pub l6_m: f64,
}

/// The torques that hold an arm against its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gravity {
    upper_arm_nm: f64,
    forearm_nm: f64,
    convention: JointConvention,
    /// The world's up, of length 1.
    up_D: Vector3<f64>,
}

/// The moment of weight (N m) in the arm's plane, which the turret turns.
struct Moment {
    /// Away from the turret's axis, in the plane.
    ahead: f64,
    /// Along the turret's axis.
    along: f64,
}

impl Gravity {
    /// Of an arm with these links (upper arm, forearm; m) and bodies, which names its joints so, in an upright base.
    pub fn new([l1, l2]: [f64; 2], bodies: &Bodies, convention: JointConvention) -> Self {
        let Bodies { mass_a_kg, mass_c_kg, mass_be_kg, mass_df_kg, l3_m, l5_m, l6_m } = *bodies;
        let upper_arm = mass_a_kg * l1 + mass_c_kg * l1 / 2.0 + mass_be_kg * l5_m;
        let forearm = mass_a_kg * l2 / 2.0 + mass_c_kg * l3_m - mass_df_kg * l6_m;
        Self {
            upper_arm_nm: GRAVITY_M_PER_S2 * upper_arm,
            forearm_nm: GRAVITY_M_PER_S2 * forearm,
            convention,
            up_D: Vector3::y(),
        }
    }

    /// The same arm in a base that stands in the world like this.
    pub fn in_base(self, R_WD: &UnitQuaternion<f64>) -> Self {
        Self { up_D: R_WD.inverse_transform_vector(&Vector3::y()), ..self }
    }

    /// Joint torques (N m) under which the arm rests where it is.
    pub fn holding_torque(&self, joints: [f64; 3]) -> [f64; 3] {
        self.holding_torque_at(&LinkagePose::at(self.convention.linkage_angles(joints)))
    }

    /// The same, for whoever has the sines and cosines.
    pub fn holding_torque_at(&self, pose: &LinkagePose) -> [f64; 3] {
        let LinkagePose { sin: [sin1, sin2, sin3], cos: [cos1, cos2, cos3] } = *pose;
        let Moment { ahead, .. } = self.moment(pose);
        let up = self.up_D;
        let (up_ahead, up_across) = (up.x * sin1 + up.z * cos1, up.x * cos1 - up.z * sin1);
        self.convention.turned([
            up_across * ahead,
            self.upper_arm_nm * (up.y * cos2 - up_ahead * sin2),
            self.forearm_nm * (up.y * sin3 + up_ahead * cos3),
        ])
    }

    /// Energy of the arm's weight (J), zero with all centres at the shoulder's height.
    pub fn potential_energy(&self, joints: [f64; 3]) -> f64 {
        let pose = LinkagePose::at(self.convention.linkage_angles(joints));
        let LinkagePose { sin: [sin1, ..], cos: [cos1, ..] } = pose;
        let Moment { ahead, along } = self.moment(&pose);
        let up = self.up_D;
        (up.x * sin1 + up.z * cos1) * ahead + up.y * along
    }

    fn moment(&self, LinkagePose { sin, cos }: &LinkagePose) -> Moment {
        Moment {
            ahead: self.upper_arm_nm * cos[1] + self.forearm_nm * sin[2],
            along: self.upper_arm_nm * sin[1] - self.forearm_nm * cos[2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Quaternion;
    use std::f64::consts::FRAC_PI_2;

    const L: [f64; 2] = [0.215, 0.170];
    const BODIES: Bodies = Bodies {
        mass_a_kg: 0.0202,
        mass_c_kg: 0.0249,
        mass_be_kg: 0.2359,
        mass_df_kg: 0.1906,
        l3_m: 0.0325,
        l5_m: -0.0368,
        l6_m: 0.0527,
    };

    /// Counts its upper arm downwards from upright, and the turret the wrong way round.
    const OTHER: JointConvention =
        JointConvention { sign: [-1.0, -1.0, 1.0], offset_rad: [0.0, FRAC_PI_2, 0.0] };

    /// Heights of the bodies' centres above the shoulder, from the drawing and nothing else.
    fn potential([_, th2, th3]: [f64; 3]) -> f64 {
        let height_a = L[0] * th2.sin() - L[1] / 2.0 * th3.cos();
        let height_c = L[0] / 2.0 * th2.sin() - BODIES.l3_m * th3.cos();
        let height_be = BODIES.l5_m * th2.sin();
        let height_df = BODIES.l6_m * th3.cos();
        let weights = [
            (BODIES.mass_a_kg, height_a),
            (BODIES.mass_c_kg, height_c),
            (BODIES.mass_be_kg, height_be),
            (BODIES.mass_df_kg, height_df),
        ];
        weights.iter().map(|(mass, height)| mass * GRAVITY_M_PER_S2 * height).sum()
    }

    #[test]
    fn the_potential_energy_is_that_of_the_drawing() {
        for convention in [JointConvention::LINKAGE, OTHER] {
            let gravity = Gravity::new(L, &BODIES, convention);
            for step in 0..400 {
                let joints = [0.3, 0.01 * f64::from(step) - 1.0, 0.007 * f64::from(step) - 0.5];
                let drawn = potential(convention.linkage_angles(joints));
                // Four products of some 0.1 J, each rounded.
                assert!((gravity.potential_energy(joints) - drawn).abs() < 1e-16, "{joints:?}");
            }
        }
    }

    #[test]
    fn the_holding_torque_is_the_slope_of_the_potential_energy() {
        for convention in [JointConvention::LINKAGE, OTHER] {
            let gravity = Gravity::new(L, &BODIES, convention);
            for step in 0..400 {
                let joints = [0.3, 0.01 * f64::from(step) - 1.0, 0.007 * f64::from(step) - 0.5];
                let torque = gravity.holding_torque(joints);
                for (joint, torque) in torque.into_iter().enumerate() {
                    let moved = |by: f64| {
                        let mut joints = joints;
                        joints[joint] += by;
                        potential(convention.linkage_angles(joints))
                    };
                    let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                    // Second-order difference: 0.1 J * (1e-5)^2, and rounding 1e-17 / 1e-5.
                    assert!((torque - slope).abs() < 1e-10, "joint {joint} at {joints:?}");
                }
            }
        }
    }

    #[test]
    fn at_home_the_paper_s_numbers_come_out() {
        let gravity = Gravity::new(L, &BODIES, JointConvention::LINKAGE);
        let [turret, upper_arm, forearm] = gravity.holding_torque([0.0; 3]);
        // g (0.0202*0.215 + 0.0249*0.1075 - 0.2359*0.0368), by hand.
        assert!((upper_arm - 9.80665 * (0.004_343 + 0.002_676_75 - 0.008_681_12)).abs() < 1e-8);
        assert_eq!((turret, forearm), (0.0, 0.0));
    }

    #[test]
    fn a_base_that_is_turned_about_its_own_y_is_upright_bit_for_bit() {
        let upright = Gravity::new(L, &BODIES, OTHER);
        for (w, y) in [(1.0, 0.0), (0.6, 0.8), (0.7, -0.71), (0.0, 1.0)] {
            let turned = upright.in_base(&UnitQuaternion::new_normalize(Quaternion::new(w, 0.0, y, 0.0)));
            for step in 0..100 {
                let joints = [0.05, 0.04, 0.028].map(|rate| rate * f64::from(step) - 1.0);
                assert_eq!(turned.holding_torque(joints), upright.holding_torque(joints));
                assert_eq!(turned.potential_energy(joints), upright.potential_energy(joints));
                assert_eq!(turned.holding_torque(joints)[0], 0.0, "the turret carries nothing");
            }
        }
    }

    /// As it was reckoned when every base stood upright: recordings of runs do not change.
    #[test]
    fn upright_the_torques_are_the_two_products_they_always_were() {
        let Gravity { upper_arm_nm, forearm_nm, .. } = Gravity::new(L, &BODIES, JointConvention::LINKAGE);
        let gravity = Gravity::new(L, &BODIES, JointConvention::LINKAGE).in_base(&UnitQuaternion::identity());
        for step in 0..400 {
            let [_, theta2, theta3] = [0.3, 0.01 * f64::from(step) - 1.0, 0.007 * f64::from(step) - 0.5];
            let torque = gravity.holding_torque([0.3, theta2, theta3]);
            assert_eq!(torque, [0.0, upper_arm_nm * theta2.cos(), forearm_nm * theta3.sin()]);
            let energy = gravity.potential_energy([0.3, theta2, theta3]);
            assert_eq!(energy, upper_arm_nm * theta2.sin() - forearm_nm * theta3.cos());
        }
    }

    #[test]
    fn on_its_left_side_the_turret_carries_what_the_upper_arm_did() {
        // A quarter turn about z brings the base's y to the world's -x, and the world's up is the base's x.
        let side = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
        let upright = Gravity::new(L, &BODIES, JointConvention::LINKAGE);
        let [turret, upper_arm, forearm] = upright.in_base(&side).holding_torque([0.0; 3]);
        // cos(90 degrees) is 6e-17.
        assert!((turret - upright.holding_torque([0.0; 3])[1]).abs() < 1e-16);
        assert!(upper_arm.abs() < 1e-16 && forearm.abs() < 1e-16);
    }
}
