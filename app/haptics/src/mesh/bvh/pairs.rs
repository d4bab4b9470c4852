//! Pairs of faces whose boxes overlap.
//!
//! Problem: which of a million faces pass through one another; to compare each with each would take days.
//! Model: the tree against itself: two children are opened if their boxes overlap, down to pairs of faces.
//! Cost: about linear for a surface, of which most pairs are neighbours; for loading only.

use super::{Bvh, Child};

/// A child and its box.
#[derive(Clone, Copy)]
struct Part {
    child: Child,
    low: [f32; 3],
    high: [f32; 3],
}

impl Part {
    fn overlaps(&self, other: &Self, gap: f32) -> bool {
        let reaches = |low: f32, high: f32| low - gap <= high;
        (0..3).all(|axis| {
            reaches(self.low[axis], other.high[axis]) && reaches(other.low[axis], self.high[axis])
        })
    }

    fn faces(&self) -> std::ops::Range<u32> {
        let first = self.child.index() as u32;
        first..first + self.child.count() as u32
    }
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Visits pairs of faces, by their numbers, whose runs have boxes that overlap, or nearly by this gap \[m\], each pair once, until `visit` says
    /// `false`; says whether it never did.
    #[inline(always)]
    pub(in crate::mesh) fn for_each_pair(&self, gap_m: f64, mut visit: impl FnMut(u32, u32) -> bool) -> bool {
        // Differences of bounds are rounded, too.
        let gap = if gap_m > 0.0 { (2.0 * gap_m + 1e-6 * self.extent_m()) as f32 } else { 0.0 };
        let root = Part { child: Child::node(0), low: [f32::NEG_INFINITY; 3], high: [f32::INFINITY; 3] };
        let mut waiting = vec![(root, root)];
        while let Some((a, b)) = waiting.pop() {
            let is_same = a.child == b.child;
            if a.child.count() > 0 && b.child.count() > 0 {
                let pairs = a.faces().flat_map(|i| b.faces().map(move |j| (i, j)));
                if !pairs.filter(|(i, j)| !is_same || i < j).all(|(i, j)| visit(i, j)) {
                    return false;
                }
                continue;
            }
            let others = self.parts(&b);
            for (i, part) in self.parts(&a).iter().enumerate() {
                let Some(part) = part else { continue };
                let others = others.iter().skip(if is_same { i } else { 0 }).flatten();
                waiting.extend(others.filter(|other| part.overlaps(other, gap)).map(|other| (*part, *other)));
            }
        }
        true
    }

    /// The children of a node; of a run, itself.
    fn parts(&self, part: &Part) -> [Option<Part>; WIDTH] {
        let mut parts = [None; WIDTH];
        if part.child.count() > 0 {
            parts[0] = Some(*part);
            return parts;
        }
        let node = &self.nodes[part.child.index()];
        for (i, part) in parts.iter_mut().enumerate() {
            let side = |side: usize| [0, 1, 2].map(|axis| node.bounds[side][axis][i]);
            let (low, high) = (side(0), side(1));
            *part = (low[0] <= high[0]).then_some(Part { child: node.children[i], low, high });
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{Mesh, make};

    #[test]
    fn every_pair_whose_boxes_overlap_is_visited_once() {
        for soup in
            [make::torus(20, 12, 0.1, 0.04), make::cuboid([0.1, 0.2, 0.3]), make::uv_sphere(3, 2, 1e3)]
        {
            let (mesh, _) = Mesh::build(soup).unwrap();
            let bounds = |face: usize| {
                let [a, b, c] = mesh.triangles().corners(&mesh.faces[face]);
                (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
            };
            let overlap = |i: usize, j: usize| {
                let ([low, high], [other_low, other_high]) =
                    (<[_; 2]>::from(bounds(i)), <[_; 2]>::from(bounds(j)));
                (0..3).all(|axis| low[axis] <= other_high[axis] && other_low[axis] <= high[axis])
            };
            let mut visited = std::collections::BTreeSet::new();
            assert!(mesh.bvh.for_each_pair(0.0, |i, j| {
                assert!(i != j && visited.insert((i.min(j), i.max(j))), "{i} {j}");
                true
            }));
            for i in 0..mesh.faces.len() {
                for j in i + 1..mesh.faces.len() {
                    assert!(visited.contains(&(i as u32, j as u32)) || !overlap(i, j), "{i} {j}");
                }
            }
            assert!(!mesh.bvh.for_each_pair(0.0, |_, _| false));
        }
    }
}
