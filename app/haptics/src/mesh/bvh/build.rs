//! Builds the hierarchy top-down over faces that are already in spatial order.
//!
//! A range of faces is cut into `WIDTH` parts by repeatedly cutting the part with the largest surface in two. The
//! cut is the cheapest of at most [`CANDIDATES`] by the surface area heuristic; boxes of blocks of 4, 16, 64 ...
//! faces make each candidate cost the same however long the range is.
//!
//! Invariant: a subtree with `levels` left holds at most `WIDTH^levels` faces. Cuts are free while any of them
//! keeps this, and even otherwise, so faces that no heuristic can tell apart cannot make the tree deep.

use std::ops::Range;

use nalgebra::Vector3;

use super::{Bvh, Child, LONGEST_RUN, Node, STACK, above, below, larger, smaller};
use crate::mesh::Face;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Around `faces`, whose spatial order it relies on for speed only. Takes memory for boxes of all faces while
    /// it builds.
    ///
    /// # Panics
    /// If a face names a vertex that is not there, or there are more than [`Link::MAX_FACES`](crate::mesh::Link)
    /// faces.
    pub fn build(faces: &[Face], vertices: &[Vector3<f64>]) -> Self {
        assert!(faces.len() < 1 << Child::INDEX_BITS, "too many faces for a hierarchy");
        let mut lower_B = Vector3::repeat(f64::INFINITY);
        let mut upper_B = Vector3::repeat(f64::NEG_INFINITY);
        let boxes = faces.iter().map(|face| {
            let [a, b, c] = face.vertices.map(|vertex| vertices[vertex as usize]);
            let (lower, upper) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            (lower_B, upper_B) = (lower_B.inf(&lower), upper_B.sup(&upper));
            Bounds::outward(&lower, &upper)
        });
        let pyramid = Pyramid::new(boxes.collect());
        let mut nodes = Vec::with_capacity(faces.len() / LONGEST_RUN);
        add_subtree::<WIDTH>(&mut nodes, &pyramid, 0..faces.len(), levels_for(faces.len(), WIDTH));
        if faces.is_empty() {
            (lower_B, upper_B) = (Vector3::zeros(), Vector3::zeros());
        }
        Self { nodes: nodes.into_boxed_slice(), lower_B, upper_B }
    }
}

/// Depth that a tree may have: what even cuts need, and some more for better ones.
fn levels_for(faces: usize, width: usize) -> u32 {
    let needed = faces.max(2).next_power_of_two().ilog2().div_ceil(width.ilog2());
    let most = ((STACK - 1) / (width - 1)) as u32;
    debug_assert!(needed <= most);
    (needed + FREE_LEVELS).min(most)
}

/// Returns the index of the subtree's root.
fn add_subtree<const WIDTH: usize>(
    nodes: &mut Vec<Node<WIDTH>>,
    pyramid: &Pyramid,
    faces: Range<usize>,
    levels: u32,
) -> usize {
    let index = nodes.len();
    nodes.push(Node::EMPTY);
    if faces.is_empty() {
        return index;
    }
    let capacity = WIDTH.saturating_pow(levels - 1);
    let parts: Parts<WIDTH> =
        if faces.len() <= capacity { Parts::by_area(pyramid, faces) } else { Parts::even(pyramid, faces) };
    for (slot, part) in parts.parts[..parts.len].iter().enumerate() {
        let child = match part.faces.len() {
            count @ ..=LONGEST_RUN => Child::run(part.faces.start, count),
            _ => Child::node(add_subtree(nodes, pyramid, part.faces.clone(), levels - 1)),
        };
        nodes[index].set(slot, &part.bounds, child);
    }
    index
}

impl<const WIDTH: usize> Node<WIDTH> {
    fn set(&mut self, slot: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.bounds[0][axis][slot] = bounds.lower[axis];
            self.bounds[1][axis][slot] = bounds.upper[axis];
        }
        self.children[slot] = child;
    }
}

/// A range of faces cut into at most `WIDTH` parts.
struct Parts<const WIDTH: usize> {
    parts: [Part; WIDTH],
    len: usize,
}

#[derive(Clone)]
struct Part {
    faces: Range<usize>,
    bounds: Bounds,
}

impl<const WIDTH: usize> Parts<WIDTH> {
    fn by_area(pyramid: &Pyramid, faces: Range<usize>) -> Self {
        let bounds = pyramid.bounds(faces.clone());
        let mut parts = [const { Part { faces: 0..0, bounds: Bounds::NOTHING } }; WIDTH];
        parts[0] = Part { faces, bounds };
        let mut len = 1;
        while len < WIDTH {
            let area = |part: &Part| part.bounds.half_area();
            let divisible = (0..len).filter(|&i| parts[i].faces.len() > LONGEST_RUN);
            let Some(largest) = divisible.max_by(|&i, &j| area(&parts[i]).total_cmp(&area(&parts[j]))) else {
                break;
            };
            let (left, right) = cut(pyramid, parts[largest].faces.clone());
            parts[largest] = left;
            parts[len] = right;
            len += 1;
        }
        Self { parts, len }
    }

    fn even(pyramid: &Pyramid, faces: Range<usize>) -> Self {
        let share = faces.len().div_ceil(WIDTH);
        let parts = std::array::from_fn(|i| {
            let start = (faces.start + i * share).min(faces.end);
            let faces = start..(start + share).min(faces.end);
            Part { bounds: pyramid.bounds(faces.clone()), faces }
        });
        let len = parts.iter().filter(|part: &&Part| !part.faces.is_empty()).count();
        Self { parts, len }
    }
}

/// Where the sum of (surface of a part x its faces) is least; of equals, nearest to the middle.
fn cut(pyramid: &Pyramid, faces: Range<usize>) -> (Part, Part) {
    let block = pyramid.block_for(faces.len());
    let mut at = [0; CANDIDATES + 2];
    let mut before = [Bounds::NOTHING; CANDIDATES + 2];
    let mut count = 0;
    let (mut start, mut all) = (faces.start, Bounds::NOTHING);
    while start < faces.end {
        let end = ((start / block + 1) * block).min(faces.end);
        all = all.with(&pyramid.bounds(start..end));
        (at[count], before[count]) = (end, all);
        (start, count) = (end, count + 1);
    }
    let (mut best, mut best_cost) = (0, (f32::INFINITY, usize::MAX));
    let (mut after, mut best_after) = (Bounds::NOTHING, Bounds::NOTHING);
    for i in (0..count - 1).rev() {
        after = after.with(&pyramid.bounds(at[i]..at[i + 1]));
        let (left, right) = (at[i] - faces.start, faces.end - at[i]);
        let cost = before[i].half_area() * left as f32 + after.half_area() * right as f32;
        if (cost, left.abs_diff(right)) <= best_cost || i + 2 == count {
            (best, best_cost, best_after) = (i, (cost, left.abs_diff(right)), after);
        }
    }
    let left = Part { faces: faces.start..at[best], bounds: before[best] };
    (left, Part { faces: at[best]..faces.end, bounds: best_after })
}

/// Boxes of blocks of 1, 4, 16, 64 ... faces.
struct Pyramid {
    levels: Vec<Vec<Bounds>>,
}

impl Pyramid {
    fn new(faces: Vec<Bounds>) -> Self {
        let mut levels = vec![faces];
        while let Some(finest) = levels.last().filter(|level| level.len() > 1) {
            let coarser = finest.chunks(4).map(|four| four.iter().fold(Bounds::NOTHING, |a, b| a.with(b)));
            let coarser = coarser.collect();
            levels.push(coarser);
        }
        Self { levels }
    }

    /// Faces per block, so that a range of this length has at most [`CANDIDATES`] blocks.
    fn block_for(&self, faces: usize) -> usize {
        let mut block = 1;
        while faces / block > CANDIDATES - 1 {
            block *= 4;
        }
        block
    }

    /// Box of a range: the largest blocks in it, and what sticks out at its ends.
    fn bounds(&self, faces: Range<usize>) -> Bounds {
        let (mut start, mut end) = (faces.start, faces.end);
        let mut all = Bounds::NOTHING;
        for level in &self.levels {
            while start < end && start % 4 != 0 {
                all = all.with(&level[start]);
                start += 1;
            }
            while start < end && end % 4 != 0 {
                end -= 1;
                all = all.with(&level[end]);
            }
            if start >= end {
                break;
            }
            (start, end) = (start / 4, end / 4);
        }
        all
    }
}

/// A box in `f32`; the fourth number is not used and fills a vector register.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    lower: [f32; 4],
    upper: [f32; 4],
}

impl Bounds {
    const NOTHING: Self = Self { lower: [f32::INFINITY; 4], upper: [f32::NEG_INFINITY; 4] };

    /// The smallest box in `f32` that contains a box in `f64`.
    fn outward(lower: &Vector3<f64>, upper: &Vector3<f64>) -> Self {
        let mut bounds = Self { lower: [0.0; 4], upper: [0.0; 4] };
        for axis in 0..3 {
            bounds.lower[axis] = below(lower[axis]);
            bounds.upper[axis] = above(upper[axis]);
        }
        bounds
    }

    #[inline(always)]
    fn with(&self, other: &Self) -> Self {
        let mut both = *self;
        for axis in 0..4 {
            both.lower[axis] = smaller(self.lower[axis], other.lower[axis]);
            both.upper[axis] = larger(self.upper[axis], other.upper[axis]);
        }
        both
    }

    fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| self.upper[axis] - self.lower[axis]);
        x * y + y * z + z * x
    }
}

/// Most places at which a cut is considered.
const CANDIDATES: usize = 64;
/// Levels beyond those that even cuts need: cuts may leave up to `WIDTH^3` times as many faces on one side.
const FREE_LEVELS: u32 = 4;
