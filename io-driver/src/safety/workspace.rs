//! The workspace's edge: beyond it a force fades out.
//!
//! Problem: far out the mechanism nears its stops and singularities, the calibration is worth little, and a
//! force that pushes an arm out there has nobody behind it.
//! Model: full force inside the box; outside it falls linearly with the distance from the box, to nothing at
//! the margin. Continuous, so that nobody feels the edge as a blow; no fault, so that coming back is enough.
//! Cost: a few comparisons.

use nalgebra::Vector3;

/// A box in the base frame D with a margin around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Smallest corner (m).
    pub min_m: Vector3<f64>,
    /// Largest corner (m).
    pub max_m: Vector3<f64>,
    /// So far outside nothing is left (m); positive.
    pub margin_m: f64,
}

impl Edge {
    /// The share of the force that is left at a position of the tip, 0 to 1; 0 for one that is not a number.
    pub fn share(&self, tip: Vector3<f64>) -> f64 {
        let outside = (self.min_m - tip).sup(&(tip - self.max_m)).sup(&Vector3::zeros());
        let share = 1.0 - outside.norm() / self.margin_m;
        // `max` takes the number of the two, and NaN is none.
        if tip.iter().any(|c| c.is_nan()) { 0.0 } else { share.max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge() -> Edge {
        Edge { min_m: Vector3::repeat(-0.1), max_m: Vector3::new(0.1, 0.2, 0.3), margin_m: 0.02 }
    }

    #[test]
    fn the_force_is_whole_inside_half_in_mid_margin_and_gone_beyond() {
        let at = |x: f64, y: f64, z: f64| edge().share(Vector3::new(x, y, z));
        assert_eq!(at(0.0, 0.0, 0.0), 1.0);
        assert_eq!(at(0.1, 0.2, 0.3), 1.0, "the edge itself is inside");
        // One difference and one quotient of numbers near 0.1: a few 1e-15.
        assert!((at(0.11, 0.0, 0.0) - 0.5).abs() < 1e-14);
        assert!((at(0.0, -0.105, 0.0) - 0.75).abs() < 1e-14);
        // Off a corner the distance counts: a 3-4-5 triangle, 10 mm away.
        assert!((at(0.106, 0.208, 0.0) - 0.5).abs() < 1e-13);
        assert_eq!(at(0.13, 0.0, 0.0), 0.0);
        assert_eq!(at(f64::INFINITY, 0.0, 0.0), 0.0);
        assert_eq!(at(f64::NAN, 0.0, 0.0), 0.0);
    }

    #[test]
    fn a_device_without_edge_keeps_its_force_everywhere() {
        let nowhere = Edge {
            min_m: Vector3::repeat(f64::NEG_INFINITY),
            max_m: Vector3::repeat(f64::INFINITY),
            margin_m: 0.02,
        };
        assert_eq!(nowhere.share(Vector3::new(1e9, -3.0, 0.0)), 1.0);
    }
}
