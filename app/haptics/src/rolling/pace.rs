//! How far to go for what is asked for, where the ground is bent.
//!
//! Problem: along a tangent plane the way to a deep HIP is too long on hollow ground, so that a ball swings to and fro, and too
//! short on round ground.
//!
//! Model: the last step shows how much of what was asked for a step takes away; the next one is as much longer or
//! shorter (the secant).

use nalgebra::Vector3;

/// What the last step took away.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// Where it began, and the way that was asked for there.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl Pace {
    /// The way to go from `centre_B` when `asked_B` is asked for.
    pub(super) fn step(&mut self, centre_B: &Vector3<f64>, asked_B: &Vector3<f64>) -> Vector3<f64> {
        let Some((before_B, asked_before_B)) = self.last.replace((*centre_B, *asked_B)) else {
            return *asked_B;
        };
        let moved_B = centre_B - before_B;
        let slope = (asked_before_B - asked_B).dot(&moved_B) / moved_B.norm_squared();
        // Where nothing is taken away the ground falls off; the way is as long as may be.
        let share = if slope > 0.0 { (1.0 / slope).clamp(SHORTEST, LONGEST) } else { 1.0 };
        asked_B * share
    }
}

const SHORTEST: f64 = 1.0 / 64.0;
const LONGEST: f64 = 8.0;
