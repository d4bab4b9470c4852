//! What the arm's own weight asks of its motors.
//!
//! Model: potential energy of the four moving bodies of a Premium, whose turret stands upright:
//!
//! ```text
//! V = g [ (m_a l1 + m_c l1 / 2 + m_be l5) sin theta2 - (m_a l2 / 2 + m_c l3 - m_df l6) cos theta3 ]
//! ```
//!
//! up to a constant; the torques that hold it are its derivatives. The turret carries no weight.
//! Frames and signs: base frame D, y up; a positive torque turns its joint towards a larger angle.
//! Cost: a sine and a cosine.
//! Reference: Cavusoglu, Feygin, Tendick, Presence 11(6), 2002, N2 and N3.

/// Standard gravity (m/s^2).
const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Masses and lever arms, by the paper's letters: `a` forearm, `c` link parallel to the upper arm, `be` upper
/// arm with its motor, `df` the link that drives the forearm, with its motor.
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
}

impl Gravity {
    /// Of an arm with these links (upper arm, forearm; m) and bodies.
    pub fn new([l1, l2]: [f64; 2], bodies: &Bodies) -> Self {
        let Bodies { mass_a_kg, mass_c_kg, mass_be_kg, mass_df_kg, l3_m, l5_m, l6_m } = *bodies;
        let upper_arm = mass_a_kg * l1 + mass_c_kg * l1 / 2.0 + mass_be_kg * l5_m;
        let forearm = mass_a_kg * l2 / 2.0 + mass_c_kg * l3_m - mass_df_kg * l6_m;
        Self { upper_arm_nm: GRAVITY_M_PER_S2 * upper_arm, forearm_nm: GRAVITY_M_PER_S2 * forearm }
    }

    /// Joint torques (N m) under which the arm rests where it is.
    pub fn holding_torque(&self, joints: [f64; 3]) -> [f64; 3] {
        [0.0, self.upper_arm_nm * joints[1].cos(), self.forearm_nm * joints[2].sin()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Heights of the bodies' centres above the shoulder, from the drawing and nothing else.
    fn potential(joints: [f64; 3]) -> f64 {
        let [_, th2, th3] = joints;
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
    fn the_holding_torque_is_the_slope_of_the_potential_energy() {
        let gravity = Gravity::new(L, &BODIES);
        for step in 0..400 {
            let angle = f64::from(step) * 0.01 - 1.0;
            let joints = [0.3, angle, 0.7 * angle + 0.2];
            let torque = gravity.holding_torque(joints);
            for (joint, torque) in torque.into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut joints = joints;
                    joints[joint] += by;
                    potential(joints)
                };
                let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                // Second-order difference: 0.1 J * (1e-5)^2, and rounding 1e-17 / 1e-5.
                assert!((torque - slope).abs() < 1e-10, "joint {joint} at {angle}");
            }
        }
    }

    #[test]
    fn at_home_the_paper_s_numbers_come_out() {
        let [turret, upper_arm, forearm] = Gravity::new(L, &BODIES).holding_torque([0.0; 3]);
        // g (0.0202*0.215 + 0.0249*0.1075 - 0.2359*0.0368), by hand.
        assert!((upper_arm - 9.80665 * (0.004_343 + 0.002_676_75 - 0.008_681_12)).abs() < 1e-8);
        assert_eq!((turret, forearm), (0.0, 0.0));
    }
}
