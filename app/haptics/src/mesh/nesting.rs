//! Outermost of the boxes around each of many boxes.
//!
//! Problem: a file of a hundred thousand stones has as many closed parts; comparing each with each takes minutes.
//!
//! Model: a binary tree over the boxes, cut at the median of their middles along the widest axis. What contains a box lies
//! below nodes whose boxes contain it; the largest of these boxes is an outermost one, since what contained that would contain
//! the box too. Nodes whose largest box is no larger than one that was found are passed over.
//!
//! Cost: n log n for boxes that lie beside or within one another; each with each only if most overlap without being nested.

use nalgebra::Vector3;

type Box3 = [Vector3<f64>; 2];

/// For each box the largest one that contains it on all sides, or itself.
pub(super) fn outermost(boxes: &[Box3]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    let mut nodes = Vec::with_capacity(2 * boxes.len() / MOST_IN_LEAF + 1);
    if !boxes.is_empty() {
        add_node(&mut nodes, &mut order, 0, boxes);
    }
    (0..boxes.len()).map(|of| largest_around(of, &nodes, &order, boxes).unwrap_or(of)).collect()
}

struct Node {
    /// Around all boxes below.
    around: Box3,
    /// Of the largest box below.
    size_m: f64,
    /// In the order of boxes.
    first: usize,
    count: usize,
    /// One child follows its parent, this is the other; a leaf has none.
    other: Option<usize>,
}

/// Adds the tree over a part of the order that begins at `first`.
fn add_node(nodes: &mut Vec<Node>, order: &mut [usize], first: usize, boxes: &[Box3]) {
    let of_all = |pick: fn(&Box3) -> Box3| {
        let nothing = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        order
            .iter()
            .map(|&i| pick(&boxes[i]))
            .fold(nothing, |[a, b], [low, high]| [a.inf(&low), b.sup(&high)])
    };
    let around = of_all(|whole| *whole);
    let middles = of_all(|[low, high]| [low + high; 2]);
    let size_m = order.iter().map(|&i| size_m(&boxes[i])).fold(0.0, f64::max);
    let (node, count) = (nodes.len(), order.len());
    nodes.push(Node { around, size_m, first, count, other: None });
    if count <= MOST_IN_LEAF {
        return;
    }
    let axis = (middles[1] - middles[0]).imax();
    let middle = |i: usize| boxes[i][0][axis] + boxes[i][1][axis];
    let half = count / 2;
    order.select_nth_unstable_by(half, |&i, &j| middle(i).total_cmp(&middle(j)).then(i.cmp(&j)));
    let (left, right) = order.split_at_mut(half);
    add_node(nodes, left, first, boxes);
    nodes[node].other = Some(nodes.len());
    add_node(nodes, right, first + half, boxes);
}

/// Of equal ones the first.
fn largest_around(of: usize, nodes: &[Node], order: &[usize], boxes: &[Box3]) -> Option<usize> {
    let (mut best, mut open) = (None, vec![0]);
    let mut least_m = size_m(&boxes[of]);
    while let Some(index) = open.pop() {
        let node = &nodes[index];
        if node.size_m < least_m || !contains(&node.around, &boxes[of]) {
            continue;
        }
        if let Some(other) = node.other {
            // The one with the larger box is looked at first.
            let is_first_larger = nodes[index + 1].size_m >= nodes[other].size_m;
            open.extend(if is_first_larger { [other, index + 1] } else { [index + 1, other] });
            continue;
        }
        for &i in &order[node.first..node.first + node.count] {
            let is_better = size_m(&boxes[i]) > least_m || best.is_none_or(|best| i < best);
            if size_m(&boxes[i]) >= least_m && is_better && contains(&boxes[i], &boxes[of]) {
                (best, least_m) = (Some(i), size_m(&boxes[i]));
            }
        }
    }
    best
}

fn contains([low, high]: &Box3, [inner_low, inner_high]: &Box3) -> bool {
    (0..3).all(|i| low[i] < inner_low[i] && inner_high[i] < high[i])
}

fn size_m([low, high]: &Box3) -> f64 {
    (high - low).sum()
}

const MOST_IN_LEAF: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    /// A number from 0 to 1.
    fn next(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f64 / (1 << 24) as f64
    }

    #[test]
    fn the_outermost_is_the_largest_of_all_that_contain_a_box() {
        let mut state = 7;
        for count in [0, 1, 3, 4, 5, 30, 300] {
            for coarse in [4.0, 1e6] {
                // On a coarse grid many are equal or touch.
                let boxes: Vec<Box3> = (0..count)
                    .map(|_| {
                        let spread = 0.5_f64.powi((8.0 * next(&mut state)) as i32);
                        let low = Vector3::from_fn(|_, _| (coarse * next(&mut state)).floor());
                        [low, low.map(|x| x + 1.0 + (coarse * spread * next(&mut state)).floor())]
                    })
                    .collect();
                let found = outermost(&boxes);
                assert_eq!(found.len(), count);
                for (of, &outermost) in found.iter().enumerate() {
                    let around = (0..count).filter(|&i| contains(&boxes[i], &boxes[of]));
                    let expected = around
                        .min_by(|&i, &j| size_m(&boxes[j]).total_cmp(&size_m(&boxes[i])).then(i.cmp(&j)));
                    assert_eq!(outermost, expected.unwrap_or(of), "box {of} of {count}");
                }
            }
        }
    }
}
