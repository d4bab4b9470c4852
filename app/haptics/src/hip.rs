//! The haptic interaction point of a tick: where it is, and how fast it moves if somebody knows.
//!
//! Problem: positions of a real device come in steps of 0.03 mm, and damping by their differences rattles. Whoever
//! reads the device's counters can do better than a library that sees positions only.

use nalgebra::Vector3;

/// Where a finger's device has it, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hip {
    /// Where it is \[m\].
    pub position_W: Vector3<f64>,
    /// How fast it moves \[m/s\]. `None`, and what is not finite: by the difference to the last tick.
    pub velocity_W: Option<Vector3<f64>>,
}

/// A HIP of which only the position is known.
impl From<&Vector3<f64>> for Hip {
    fn from(position_W: &Vector3<f64>) -> Self {
        Self { position_W: *position_W, velocity_W: None }
    }
}
