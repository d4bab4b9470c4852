//! Gathers pairs while end points are held together and moved about.
//!
//! Model: a pair is worth keeping where no other is near: it tells of another place. When enough have been kept and
//! they reach far enough in every direction, the transform is determined well; before that the direction with the
//! smallest extent is the one to move along.
//! Cost: [`Gathering::offer`] looks at the last pair kept, and at all of them only if the tip has moved on.

use nalgebra::{Matrix3, Vector3};

use crate::pairs::Pair;
use crate::spread::Spread;

/// Pairs that are far enough from each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Gathering {
    pairs: Vec<Pair>,
    step_m: f64,
}

/// How much of space the pairs have seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// Distinct pairs.
    pub count: usize,
    /// RMS extent along the main directions (m), largest first.
    pub rms_m: [f64; 3],
    /// The directions in F, unit vectors in columns.
    pub directions: Matrix3<f64>,
}

impl Gathering {
    /// None yet; they will be `step_m` apart.
    pub fn new(step_m: f64) -> Self {
        Self { pairs: Vec::new(), step_m }
    }

    /// Keeps the pair if it is finite, no other is near, and there is room. Says whether it did.
    pub fn offer(&mut self, fiducial: Vector3<f64>, other: Vector3<f64>) -> bool {
        let is_finite = fiducial.iter().chain(other.iter()).all(|number| number.is_finite());
        let is_near = |pair: &Pair| (pair.fiducial - fiducial).norm_squared() < self.step_m * self.step_m;
        if !is_finite || self.pairs.len() == MAX_KEPT || self.pairs.iter().rev().any(is_near) {
            return false;
        }
        // The line it will have below a header.
        self.pairs.push(Pair { line: self.pairs.len() + 2, fiducial, other });
        true
    }

    /// What was kept.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// How much of space they have seen.
    pub fn coverage(&self) -> Coverage {
        let points: Vec<_> = self.pairs.iter().map(|pair| pair.fiducial).collect();
        let Spread { rms_m, directions, .. } = Spread::of(&points);
        Coverage { count: points.len(), rms_m, directions }
    }
}

impl Coverage {
    /// Whether more would hardly help.
    pub fn is_enough(&self) -> bool {
        self.count >= ENOUGH_PAIRS && self.rms_m[2] >= ENOUGH_EXTENT_M
    }

    /// The axis of F (0 to 2) that lies nearest to the direction which has seen the least, unless that has seen
    /// enough. Of directions that have seen nothing yet, the one furthest from where the points are.
    pub fn wanting_axis(&self) -> Option<usize> {
        let wanting: Vec<usize> = (0..3).filter(|k| self.rms_m[*k] < ENOUGH_EXTENT_M).collect();
        let seen_along = |axis: usize| -> f64 {
            (0..3).map(|k| (self.directions[(axis, k)] * self.rms_m[k]).powi(2)).sum::<f64>()
        };
        let least = (0..3).min_by(|a, b| seen_along(*a).total_cmp(&seen_along(*b)));
        least.filter(|_| !wanting.is_empty())
    }
}

/// With noise of 0.1 mm, two hundred pairs tell a position to 0.007 mm.
const ENOUGH_PAIRS: usize = 200;
/// RMS (m): a slab of 70 mm, a third of a small device's workspace. With two hundred pairs of 0.1 mm noise the
/// rotation is then known to 0.02 degrees.
const ENOUGH_EXTENT_M: f64 = 0.02;
/// Comparing each with all others stays cheap.
const MAX_KEPT: usize = 5000;
