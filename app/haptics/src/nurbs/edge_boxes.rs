//! Boxes around the edges of patches: which of them are near each other.
//!
//! Problem: a file of a hundred thousand patches has four times as many edges; comparing each with each takes hours.
//!
//! Model: boxes sorted by where they begin along the axis on which all together reach farthest. What is near a box begins
//! between its end and the longest length before its beginning.
//!
//! Cost: n log n, and for each box those that lie beside it along that axis; each with each only if one is about as long as all
//! together.

use nalgebra::Vector3;

/// Lowest and highest coordinates.
pub(super) type Box3 = [Vector3<f64>; 2];

/// Boxes and their order along one axis.
pub(super) struct EdgeBoxes<'b> {
    boxes: &'b [Box3],
    axis: usize,
    order: Vec<usize>,
    longest: f64,
}

impl<'b> EdgeBoxes<'b> {
    pub(super) fn new(boxes: &'b [Box3]) -> Self {
        let nothing = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        let around = boxes.iter().fold(nothing, |[a, b], [low, high]| [a.inf(low), b.sup(high)]);
        let axis = (around[1] - around[0]).imax();
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|&i, &j| boxes[i][0][axis].total_cmp(&boxes[j][0][axis]));
        let longest = boxes.iter().map(|[low, high]| high[axis] - low[axis]).fold(0.0, f64::max);
        Self { boxes, axis, order, longest }
    }

    /// Numbers above `i` of boxes that are no farther from it than `slack` on any axis, ascending.
    pub(super) fn later_near(&self, i: usize, slack: f64) -> Vec<usize> {
        let a = &self.boxes[i];
        let low = |k: &usize| self.boxes[*k][0][self.axis];
        // Once more the slack, so that no rounding leaves one out.
        let first = a[0][self.axis] - self.longest - 2.0 * slack;
        let begin = self.order.partition_point(|k| low(k) < first);
        let beside = self.order[begin..].iter().take_while(|k| low(k) <= a[1][self.axis] + slack);
        let mut near: Vec<usize> =
            beside.copied().filter(|&j| j > i && is_near(a, &self.boxes[j], slack)).collect();
        near.sort_unstable();
        near
    }
}

fn is_near(a: &Box3, b: &Box3, slack: f64) -> bool {
    (0..3).all(|c| a[0][c] <= b[1][c] + slack && b[0][c] <= a[1][c] + slack)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_boxes_are_those_that_a_comparison_of_each_with_each_finds() {
        let mut state = 5_u64;
        let mut next = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % below) as f64
        };
        let mut pairs = 0;
        for count in [0, 1, 2, 50, 300] {
            for longest in [1, 4, 30] {
                // On a grid, so that many touch or are apart by the slack.
                let boxes: Vec<Box3> = (0..count)
                    .map(|_| {
                        let low = Vector3::new(next(40), next(20), next(3));
                        [low, low + Vector3::from_fn(|_, _| next(longest))]
                    })
                    .collect();
                let sorted = EdgeBoxes::new(&boxes);
                for (i, slack) in (0..count).flat_map(|i| [0.0, 1.0].map(|slack| (i, slack))) {
                    let expected: Vec<usize> =
                        (i + 1..count).filter(|&j| is_near(&boxes[i], &boxes[j], slack)).collect();
                    assert_eq!(sorted.later_near(i, slack), expected, "{i} of {count}, {slack}");
                    pairs += expected.len();
                }
            }
        }
        assert!(pairs > 1000, "{pairs}");
    }
}
