//! What the arm's own weight asks of its motors.
//!
//! Model: potential energy of the four bodies of a parallelogram linkage whose turret stands upright:
//!
//! ```text
//! V = g [ (m_a l1 + m_c l1 / 2 + m_be l5) sin theta2 - (m_a l2 / 2 + m_c l3 - m_df l6) cos theta3 ]
//! ```
//!
//! with each body's centre as [`Bodies`] says; the torques that hold it are its derivatives. The turret carries no
//! weight.
//! Frames and signs: base frame D, y up; heights above the shoulder. Joints are the mechanism's own, see
//! [`JointConvention`]; a positive torque turns its joint towards a larger angle.
//! Cost: a sine and a cosine each.
//! Reference: Cavusoglu, Feygin, Tendick, Presence 11(6), 2002, N2 and N3.

use super::JointConvention;

/// Standard gravity (m/s^2).
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Masses and where their centres are, by the paper's letters.
///
/// `a` is the forearm, its centre halfway; `c` the link parallel to the upper arm, its centre halfway and `l3` further
/// along the forearm; `be` the upper arm with its motor, its centre `l5` out on it; `df` the link that drives the
/// forearm, with its motor, its centre `l6` on the other side of the shoulder than the forearm's.
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
}

impl Gravity {
    /// Of an arm with these links (upper arm, forearm; m) and bodies, which names its joints so.
    pub fn new([l1, l2]: [f64; 2], bodies: &Bodies, convention: JointConvention) -> Self {
        let Bodies { mass_a_kg, mass_c_kg, mass_be_kg, mass_df_kg, l3_m, l5_m, l6_m } = *bodies;
        let upper_arm = mass_a_kg * l1 + mass_c_kg * l1 / 2.0 + mass_be_kg * l5_m;
        let forearm = mass_a_kg * l2 / 2.0 + mass_c_kg * l3_m - mass_df_kg * l6_m;
        Self {
            upper_arm_nm: GRAVITY_M_PER_S2 * upper_arm,
            forearm_nm: GRAVITY_M_PER_S2 * forearm,
            convention,
        }
    }

    /// Joint torques (N m) under which the arm rests where it is.
    pub fn holding_torque(&self, joints: [f64; 3]) -> [f64; 3] {
        let [_, theta2, theta3] = self.convention.linkage_angles(joints);
        self.convention.turned([0.0, self.upper_arm_nm * theta2.cos(), self.forearm_nm * theta3.sin()])
    }

    /// Energy of the arm's weight (J), zero with all centres at the shoulder's height.
    pub fn potential_energy(&self, joints: [f64; 3]) -> f64 {
        let [_, theta2, theta3] = self.convention.linkage_angles(joints);
        self.upper_arm_nm * theta2.sin() - self.forearm_nm * theta3.cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
}
