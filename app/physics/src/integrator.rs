//! From forces to motion: where a body is after a tick.

use nalgebra::{UnitQuaternion, Vector3};

use crate::body::Body;

/// How forces become motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Contact forces of the end of the tick; the angular momentum is carried in W and turned into a turn at the tick's
    /// middle.
    #[default]
    Implicit,
}

impl Integrator {
    /// Moves a body whose momenta are those of the end of the tick. `falls_W`: it fell freely all the tick, with this
    /// acceleration (m/s^2).
    pub(crate) fn advance(self, body: &mut Body, falls_W: Option<Vector3<f64>>, dt_s: f64) {
        body.centre_W += body.velocity_W * dt_s;
        if let Some(falls_W) = falls_W {
            // The mean of both ends' velocities, which is exact.
            body.centre_W -= falls_W * (0.5 * dt_s * dt_s);
        }
        turn(body, dt_s);
    }
}

/// `q exp(omega dt)`, with the angular velocity of the tick's middle.
fn turn(body: &mut Body, dt_s: f64) {
    if body.rotation_locked || body.angular_momentum_W == Vector3::zeros() {
        return;
    }
    let start = body.orientation;
    let mut turn_W = body.angular_velocity_W() * dt_s;
    for _ in 0..MIDPOINT_ROUNDS {
        body.orientation = UnitQuaternion::from_scaled_axis(turn_W * 0.5) * start;
        let next_W = body.angular_velocity_W() * dt_s;
        let change = (next_W - turn_W).norm_squared();
        turn_W = next_W;
        if change < 1e-32 {
            break;
        }
    }
    body.orientation =
        UnitQuaternion::new_normalize((UnitQuaternion::from_scaled_axis(turn_W) * start).into_inner());
}

/// Rounds to find the middle of a turn.
const MIDPOINT_ROUNDS: usize = 8;
