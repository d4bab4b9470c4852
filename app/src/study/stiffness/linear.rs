//! The sampled loop without friction and encoder: an oracle that shares no line with the simulation.
//!
//! Model: a mass (the arm along one axis) with its damping, held through a grasp by a hand's mass, held through an arm
//! by the ground; a wall that is looked at once a tick and pushes through an amplifier, a first-order lag, with the
//! value of the tick from some way into it on:
//!
//! ```text
//! m x'' = f - b x' - k1 (x - h) - b1 (x' - h')        M h'' = k1 (x - h) + b1 (x' - h') - k2 h - b2 h'
//! f'    = w (u - f)                                  u_k = -K x_k - B (x_k - x_(k-1)) / T
//! ```
//!
//! Everything between two ticks is solved exactly, by a matrix exponential; the loop is stable if no eigenvalue of a
//! tick's map is outside the unit circle. The contact never ends: this is the wall pressed, not tapped.
//! Reference: Gillespie and Cutkosky, Stable user-specific haptic rendering of the virtual wall, IMECE 1996.

use nalgebra::{SMatrix, SVector, Schur, Vector2};

/// The numbers of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop {
    /// Apparent mass of the arm (kg).
    pub mass_kg: f64,
    /// Its viscous friction (N s/m).
    pub viscous_n_s_per_m: f64,
    /// Bandwidth of the amplifier (Hz).
    pub amplifier_hz: f64,
    /// The hand; `None`: nobody.
    pub hand: Option<Hand>,
    /// Damping of the wall (N s/m).
    pub damping_n_s_per_m: f64,
    /// Length of a tick (s).
    pub period_s: f64,
    /// From the reading to the motors: whole ticks, 0 or 1, and a part of one (s).
    pub delay: (u8, f64),
}

/// A hand along one axis: grasp and arm as stiffness (N/m) and damping (N s/m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// Mass between the two (kg).
    pub mass_kg: f64,
    /// Between tip and hand.
    pub grasp: Vector2<f64>,
    /// Between hand and ground.
    pub arm: Vector2<f64>,
}

/// Tip and its velocity, hand and its velocity, force of the motor.
const STATES: usize = 5;
/// Of the QR algorithm on a tick's map, which takes some three for each eigenvalue.
const MOST_ITERATIONS: usize = 1000;
/// Besides these the last two values and the last position.
const SAMPLED: usize = STATES + 3;

type Flow = SMatrix<f64, STATES, STATES>;
type Push = SVector<f64, STATES>;

impl Loop {
    /// Whether a wall of this stiffness (N/m) is quiet.
    pub fn is_stable(&self, stiffness_n_per_m: f64) -> bool {
        let map = self.tick(stiffness_n_per_m);
        // Numbers beyond all bounds are not stable, nor is what the iteration finds no eigenvalues of.
        map.iter().all(|number| number.is_finite())
            && Schur::try_new(map, f64::EPSILON, MOST_ITERATIONS).is_some_and(|schur| {
                schur.complex_eigenvalues().iter().all(|eigenvalue| eigenvalue.norm() < 1.0)
            })
    }

    /// The map of a tick.
    fn tick(&self, stiffness: f64) -> SMatrix<f64, SAMPLED, SAMPLED> {
        let (whole, part_s) = self.delay;
        let (flow_1, push_1) = self.pass(part_s);
        let (flow_2, push_2) = self.pass(self.period_s - part_s);
        // The values that act before and after the part of the tick: (place among the sampled ones, or the new one).
        let (before, after) = if whole == 0 { (STATES, None) } else { (STATES + 1, Some(STATES)) };
        let slope = self.damping_n_s_per_m / self.period_s;
        let mut new_value = SVector::<f64, SAMPLED>::zeros();
        new_value[0] = -stiffness - slope;
        new_value[SAMPLED - 1] = slope;
        let mut map = SMatrix::<f64, SAMPLED, SAMPLED>::zeros();
        map.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&(flow_2 * flow_1));
        let mut add = |push: Push, value: Option<usize>| match value {
            Some(place) => {
                let mut column = map.fixed_view_mut::<STATES, 1>(0, place);
                column += push;
            }
            None => {
                let mut rows = map.fixed_view_mut::<STATES, SAMPLED>(0, 0);
                rows += push * new_value.transpose();
            }
        };
        add(flow_2 * push_1, Some(before));
        add(push_2, after);
        map.set_row(STATES, &new_value.transpose());
        map[(STATES + 1, STATES)] = 1.0;
        map[(SAMPLED - 1, 0)] = 1.0;
        map
    }

    /// What a time does to the states, and what a value that stands meanwhile adds.
    fn pass(&self, dt_s: f64) -> (Flow, Push) {
        let mut generator = SMatrix::<f64, { STATES + 1 }, { STATES + 1 }>::zeros();
        generator.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&self.rates());
        let bandwidth = std::f64::consts::TAU * self.amplifier_hz;
        generator[(4, STATES)] = bandwidth;
        let map = (generator * dt_s).exp();
        (
            map.fixed_view::<STATES, STATES>(0, 0).into_owned(),
            map.fixed_view::<STATES, 1>(0, STATES).into_owned(),
        )
    }

    fn rates(&self) -> Flow {
        let bandwidth = std::f64::consts::TAU * self.amplifier_hz;
        // A hand that is nobody's is a mass by itself, at rest.
        let Hand { mass_kg: hand_kg, grasp, arm } =
            self.hand.unwrap_or(Hand { mass_kg: 1.0, grasp: Vector2::zeros(), arm: Vector2::new(1.0, 1.0) });
        let (m, b) = (self.mass_kg, self.viscous_n_s_per_m);
        Flow::from_row_slice(&[
            0.0,
            1.0,
            0.0,
            0.0,
            0.0,
            -grasp.x / m,
            -(b + grasp.y) / m,
            grasp.x / m,
            grasp.y / m,
            1.0 / m,
            0.0,
            0.0,
            0.0,
            1.0,
            0.0,
            grasp.x / hand_kg,
            grasp.y / hand_kg,
            -(grasp.x + arm.x) / hand_kg,
            -(grasp.y + arm.y) / hand_kg,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            -bandwidth,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Loop = Loop {
        mass_kg: 0.05,
        viscous_n_s_per_m: 1.0,
        amplifier_hz: 1e6,
        hand: None,
        damping_n_s_per_m: 0.0,
        period_s: 1e-3,
        delay: (0, 0.0),
    };

    /// The largest stable stiffness, by halving.
    fn limit(system: &Loop) -> f64 {
        let (mut low, mut high) = (1.0, 1e6);
        while high / low > 1.0 + 1e-6 {
            let middle = f64::sqrt(low * high);
            *(if system.is_stable(middle) { &mut low } else { &mut high }) = middle;
        }
        low
    }

    #[test]
    fn a_mass_with_a_damper_follows_the_closed_form_of_the_sampled_wall() {
        // For m, b and a wall sampled with T, the characteristic polynomial by hand, with a = exp(-b T / m):
        // z^2 + (K c1 - 1 - a) z + a + K c2 = 0, stable while a + K c2 < 1 (Jury). c1 + c2 are the ZOH's.
        for (mass, damping, period) in
            [(0.05, 1.0, 1e-3), (0.05, 0.2, 1e-3), (0.2, 3.0, 0.5e-3), (0.03, 0.5, 4e-3)]
        {
            let system = Loop { mass_kg: mass, viscous_n_s_per_m: damping, period_s: period, ..FREE };
            let a = f64::exp(-damping * period / mass);
            let lag = mass / damping;
            let c2 = (lag - lag * a - period * a) / damping;
            let closed = (1.0 - a) / c2;
            let found = limit(&system);
            // The amplifier's 1 MHz is a delay of 0.16 us, of the half tick that holding costs.
            assert!((found / closed - 1.0).abs() < 2e-3, "{mass} {damping} {period}: {found} {closed}");
            // Colgate's bound for any hand is below what this one mass stands, and near it for short ticks.
            assert!(2.0 * damping / period <= closed * (1.0 + 1e-9));
        }
    }

    #[test]
    fn damping_beyond_all_bounds_is_not_stable_and_is_told_at_once() {
        for damping_n_s_per_m in [1e100, 1e300, 1e308, f64::INFINITY, f64::NAN] {
            let system = Loop { damping_n_s_per_m, ..FREE };
            assert!(!system.is_stable(1000.0), "{damping_n_s_per_m}");
        }
    }

    #[test]
    fn a_tick_of_delay_costs_a_factor_of_three() {
        let late = limit(&Loop { delay: (1, 0.0), ..FREE });
        let ratio = limit(&FREE) / late;
        // b / (T/2) against b / (3T/2), for a tick that is short against m / b = 50 ms.
        assert!((ratio - 3.0).abs() < 0.05, "{ratio}");
        let half = limit(&FREE) / limit(&Loop { delay: (0, 0.5e-3), ..FREE });
        assert!((half - 2.0).abs() < 0.05, "{half}");
        // A whole tick told as a part of one is the same.
        let part = limit(&Loop { delay: (0, 1e-3), ..FREE });
        assert!((part / late - 1.0).abs() < 1e-5, "{part} {late}");
    }

    #[test]
    fn damping_of_the_wall_and_of_a_hand_help() {
        let hand = Hand { mass_kg: 0.2, grasp: Vector2::new(500.0, 3.0), arm: Vector2::new(100.0, 6.0) };
        assert!(limit(&Loop { hand: Some(hand), ..FREE }) > 1.5 * limit(&FREE));
        assert!(limit(&Loop { damping_n_s_per_m: 5.0, ..FREE }) > 2.0 * limit(&FREE));
    }
}
