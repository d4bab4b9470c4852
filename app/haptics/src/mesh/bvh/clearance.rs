//! How far a finger may move before it can possibly touch: cheap, and never too much.
//!
//! Model: nodes are opened in the order of their boxes' distances; the least distance of those still closed is a
//! lower bound. After [`MOST_OPENED`] nodes it is taken as it is.

use nalgebra::Vector3;

use super::{Bvh, Child, Rounded, above};

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// A lower bound of the distance from a point to any face, at most `at_most_m` \[m\].
    ///
    /// Not more than 1e18 m. 0 if nothing better is known; so it is for a point that is not finite. A smaller `at_most_m` is answered
    /// faster.
    pub fn clearance(&self, p_B: &Vector3<f64>, at_most_m: f64) -> f64 {
        if !(at_most_m > 0.0 && p_B.iter().all(|coordinate| coordinate.is_finite())) {
            return 0.0;
        }
        let at_most_m = at_most_m.min(FARTHEST_M);
        let limit = above(at_most_m * at_most_m).min(f32::MAX);
        let p = Rounded::new(p_B);
        let mut closed = Closed { entries: [(0.0, Child(0)); MOST_CLOSED], len: 1 };
        for _ in 0..MOST_OPENED {
            let Some(nearest) = closed.nearest() else { return at_most_m };
            let (_, child) = closed.entries[nearest];
            if child.count() > 0 {
                break;
            }
            closed.remove(nearest);
            let node = &self.nodes[child.index()];
            for (squared_distance, child) in node.squared_distances(&p).into_iter().zip(node.children) {
                if squared_distance < limit {
                    closed.add(squared_distance, child);
                }
            }
        }
        match closed.nearest().map(|nearest| closed.entries[nearest].0) {
            // Nothing is left there of what makes a square too small rather than too large.
            Some(squared_distance) if squared_distance < f32::MIN_POSITIVE => 0.0,
            // The root was rounded to nearest.
            Some(squared_distance) => {
                (f64::from(squared_distance).sqrt() * (1.0 - f64::EPSILON)).min(at_most_m)
            }
            None => at_most_m,
        }
    }
}

/// Boxes that are not opened yet, with their squared distances \[m^2\].
struct Closed {
    entries: [(f32, Child); MOST_CLOSED],
    len: usize,
}

impl Closed {
    fn nearest(&self) -> Option<usize> {
        (0..self.len).reduce(|best, i| if self.entries[i].0 < self.entries[best].0 { i } else { best })
    }

    fn remove(&mut self, index: usize) {
        self.len -= 1;
        self.entries[index] = self.entries[self.len];
    }

    fn add(&mut self, squared_distance: f32, child: Child) {
        self.entries[self.len] = (squared_distance, child);
        self.len += 1;
    }
}

/// More is not promised, since its square would not fit into `f32`.
const FARTHEST_M: f64 = 1e18;
/// Nodes that are opened at most.
const MOST_OPENED: usize = 16;
/// Each opened node takes one off and puts at most 8 on.
const MOST_CLOSED: usize = 1 + 7 * MOST_OPENED;
