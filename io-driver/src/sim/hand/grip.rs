//! Presses harder when what is held begins to slip.

use nalgebra::Vector3;

/// How a person minds what is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripSpec {
    /// Friction that is believed in before anything was felt.
    pub believed_friction: f64,
    /// Share by which the grip exceeds the smallest that holds.
    pub margin: f64,
    /// From a slip to the answer (s).
    pub latency_s: f64,
    /// How fast the grip grows (N/s).
    pub rise_n_per_s: f64,
    /// How fast it eases off (N/s).
    pub ease_n_per_s: f64,
    /// The hardest grip (N).
    pub max_force_n: f64,
}

/// What a finger feels in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(non_snake_case)]
pub struct Felt {
    /// The force on the user of the last tick (N), in D.
    pub force_on_user_D: Vector3<f64>,
    /// Centre of the tips of the fingers that hold together with this one (m), in D; `None`: there are none.
    pub partners_centroid_D: Option<Vector3<f64>>,
}
