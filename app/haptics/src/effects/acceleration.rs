//! Acceleration from positions that come in steps.
//!
//! Problem: the second difference of positions in steps of q = 0.03 mm at 1 kHz comes in steps of 30 m/s^2: felt as
//! a mass of 0.1 kg that is a rattle of 3 N.
//!
//! Model: `a = w^2 s^2 / (s + w)^2 x`, a critically damped low-pass of corner w. Through it a mass m is felt as a
//! mass, a damper `m w / 2` and a spring `m w^2` in a row: passive at every frequency, a mass below the corner and
//! a soft spring above. Lag: `2 atan(f / cutoff)`. Between ticks the finger is taken to go straight, for which the solution
//! is exact: no tick is too long, and none may be missed.
//! Noise: the impulse response has an integral of absolute values of `w^2 (2 + 2 e^-2)`, so positions that are off
//! by q/2 at most make at most `1.14 w^2 q`: 0.135 m/s^2 for 0.03 mm and 10 Hz, 14 mN of 0.1 kg.

use nalgebra::Vector3;

use crate::frame::is_finite;

/// The filter's state for one finger, of all three axes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct AccelerationFilter {
    previous_W: Option<Vector3<f64>>,
    /// The smoothed place, from the finger \[m\].
    offset_W: Vector3<f64>,
    /// Of the smoothed place \[m/s\].
    velocity_W: Vector3<f64>,
    /// The most by which the last step can have changed the acceleration \[m/s^2\].
    most_change: f64,
}

impl AccelerationFilter {
    /// The finger is at `position_W`; `corner` is w \[rad/s\]. Gives its acceleration \[m/s^2\].
    pub(super) fn step(
        &mut self,
        position_W: &Vector3<f64>,
        velocity_W: &Vector3<f64>,
        corner: f64,
        dt_s: f64,
    ) -> Vector3<f64> {
        let Some(previous_W) = self.previous_W.replace(*position_W) else {
            // As if it had moved at this speed for ever.
            self.velocity_W = *velocity_W;
            self.offset_W = velocity_W * (-2.0 / corner);
            return Vector3::zeros();
        };
        if dt_s.is_nan() || dt_s <= 0.0 {
            return Vector3::zeros();
        }
        let speed_W = (position_W - previous_W) / dt_s;
        // Against the steady state of this speed: e'' = -w^2 e - 2 w e'.
        let e = self.offset_W + speed_W * (2.0 / corner);
        let rate = self.velocity_W - speed_W;
        let slope = rate + e * corner;
        // Its derivative is -w^2 e' - 2 w e''; within a tick neither of them doubles.
        let second = (e * corner + rate * 2.0) * corner;
        self.most_change = 2.0 * dt_s * corner * (corner * rate.norm() + 2.0 * second.norm());
        let decay = (-corner * dt_s).exp();
        let (e, rate) = ((e + slope * dt_s) * decay, (rate - slope * (corner * dt_s)) * decay);
        self.offset_W = e - speed_W * (2.0 / corner);
        self.velocity_W = rate + speed_W;
        let acceleration = e * -(corner * corner) - rate * (2.0 * corner);
        if is_finite(&acceleration) {
            return acceleration;
        }
        *self = Self::default();
        Vector3::zeros()
    }

    /// The most by which the last step can have changed the acceleration \[m/s^2\].
    pub(super) fn most_change(&self) -> f64 {
        self.most_change
    }
}
