//! The vertex that lies farthest out: in a direction, or on two counts at once.
//!
//! Problem: a body of a million triangles that stands on a plane touches it with thousands of vertices. Those that hold it
//! lie deep *and* far out; a tick has a microsecond to find one.
//!
//! Model: a count is a linear function of the vertex ([`Linear`]). What is sought makes the product of two counts largest,
//! both being positive; a count that is 1 everywhere leaves the other alone. Boxes bound either count from above, hence the
//! product; those that cannot beat what was found, or lie beyond a limit, are left out. Limits are counts, too: what makes
//! one of them negative does not count.
//! Cost: some tens of nodes where a vertex sticks out; as many as are allowed where very many lie about as far out, and
//! then the best of those seen is the answer.

use nalgebra::Vector3;

use super::stack::Stack;
use super::{Bvh, Node, Triangles, above, larger, smaller};

/// A linear function of a point, `along . x + base`, or `at_most` where that is less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Its gradient.
    pub along_B: Vector3<f64>,
    /// Its value at the origin.
    pub base: f64,
    /// It grows no larger: the tighter, the fewer boxes need be looked at.
    pub at_most: f64,
}

impl Linear {
    /// The same everywhere.
    pub const ONE: Self = Self::new(Vector3::new(0.0, 0.0, 0.0), 1.0);

    /// Without a limit.
    pub const fn new(along_B: Vector3<f64>, base: f64) -> Self {
        Self { along_B, base, at_most: f64::INFINITY }
    }

    /// How far a point is from a plane through `from_B`, along this.
    pub fn from(from_B: &Vector3<f64>, along_B: Vector3<f64>) -> Self {
        Self::new(along_B, -along_B.dot(from_B))
    }

    /// The same, growing no larger than this.
    #[must_use]
    pub fn at_most(self, at_most: f64) -> Self {
        Self { at_most, ..self }
    }

    /// Its value there.
    #[inline]
    pub fn at(&self, point_B: &Vector3<f64>) -> f64 {
        smaller(self.along_B.dot(point_B) + self.base, self.at_most)
    }

    /// As the nodes see it.
    fn rounded(&self, extent_m: f64) -> Rounded {
        // Three products, their sum and a number rounded to `f32`: less than eight roundings of the largest.
        let size = self.along_B.amax() * extent_m * 3.0 + self.base.abs();
        let base = above(self.base + size * 8.0 * f64::from(f32::EPSILON));
        let along = [0, 1, 2].map(|axis| self.along_B[axis] as f32);
        Rounded { along, base, at_most: above(self.at_most) }
    }
}

#[derive(Clone, Copy)]
struct Rounded {
    along: [f32; 3],
    base: f32,
    at_most: f32,
}

impl<const WIDTH: usize> Node<WIDTH> {
    /// Upper bounds of a linear function in each child's box.
    #[inline(always)]
    fn at_most(&self, function: &Rounded) -> [f32; WIDTH] {
        let mut sum = [function.base; WIDTH];
        for axis in 0..3 {
            let along = function.along[axis];
            // Which of the two bounds is larger, the sign tells.
            let side = &self.bounds[usize::from(along >= 0.0)][axis];
            for i in 0..WIDTH {
                sum[i] += along * side[i];
            }
        }
        for bound in &mut sum {
            *bound = smaller(*bound, function.at_most);
        }
        sum
    }

    /// A slot without a child has an inverted box.
    #[inline(always)]
    fn has_child(&self, i: usize) -> bool {
        self.bounds[0][0][i] <= self.bounds[1][0][i]
    }
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// The vertex with the largest product of two counts, as a corner of a face (three times its number plus that of the
    /// corner), and that product, if it is larger than `more_than` >= 0.
    ///
    /// Of vertices that are equal, that which was seen first. At most `MOST_LIMITS` limits are heeded. After so many nodes
    /// and runs of faces the best of those seen is the answer.
    pub fn outlying(
        &self,
        triangles: Triangles<'_>,
        counts: [&Linear; 2],
        limits: &[Linear],
        more_than: f64,
        most_visits: usize,
    ) -> Option<(u32, f64)> {
        let extent_m = self.extent_m();
        let [first, second] = counts.map(|count| count.rounded(extent_m));
        let limits = &limits[..limits.len().min(MOST_LIMITS)];
        let mut rounded_limits = [first; MOST_LIMITS];
        for (rounded, limit) in rounded_limits.iter_mut().zip(limits) {
            *rounded = limit.rounded(extent_m);
        }
        let rounded_limits = &rounded_limits[..limits.len()];
        let mut best: Option<(u32, f64)> = None;
        let mut most = larger(more_than, 0.0);
        let mut limit = key(most);
        let mut stack = Stack::<f32>::new();
        for visits in 0_usize.. {
            let Some((bound, child)) = stack.pop() else { break };
            if visits >= most_visits {
                break;
            }
            // The root has none.
            if bound > limit && visits > 0 {
                continue;
            }
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                let keys = node.keys(&first, &second, rounded_limits);
                stack.push(&keys, &node.children, limit);
                continue;
            }
            for face in child.index()..child.index() + child.count() {
                for (corner, vertex) in triangles.faces[face].vertices.into_iter().enumerate() {
                    let point_B = &triangles.vertices[vertex as usize];
                    let [f, g] = counts.map(|count| count.at(point_B));
                    if f > 0.0
                        && g > 0.0
                        && f * g > most
                        && limits.iter().all(|limit| limit.at(point_B) >= 0.0)
                    {
                        most = f * g;
                        best = Some(((3 * face + corner) as u32, most));
                        limit = key(most);
                    }
                }
            }
        }
        best
    }

    /// Visits the vertices at which no limit is negative, as corners of faces, each as often as faces meet there, until
    /// `visit` says `false`, or so many nodes and runs of faces were looked at; says whether all were visited.
    pub fn for_each_vertex_within(
        &self,
        triangles: Triangles<'_>,
        limits: &[Linear],
        mut visit: impl FnMut(u32) -> bool,
        most_visits: usize,
    ) -> bool {
        let extent_m = self.extent_m();
        let limits = &limits[..limits.len().min(MOST_LIMITS)];
        let mut rounded = [Linear::ONE.rounded(extent_m); MOST_LIMITS];
        for (rounded, limit) in rounded.iter_mut().zip(limits) {
            *rounded = limit.rounded(extent_m);
        }
        let one = Linear::ONE.rounded(extent_m);
        let mut stack = Stack::<f32>::new();
        let mut visits = 0;
        while let Some((_, child)) = stack.pop() {
            visits += 1;
            if visits > most_visits {
                return false;
            }
            if child.count() == 0 {
                let node = &self.nodes[child.index()];
                stack.push(&node.keys(&one, &one, &rounded[..limits.len()]), &node.children, 0.0);
                continue;
            }
            for face in child.index()..child.index() + child.count() {
                for (corner, vertex) in triangles.faces[face].vertices.into_iter().enumerate() {
                    let point_B = &triangles.vertices[vertex as usize];
                    let counts = limits.iter().all(|limit| limit.at(point_B) >= 0.0);
                    if counts && !visit((3 * face + corner) as u32) {
                        return false;
                    }
                }
            }
        }
        true
    }
}

impl<const WIDTH: usize> Node<WIDTH> {
    /// The best that each child may hold, times -1; infinite where it holds nothing.
    #[inline(always)]
    fn keys(&self, first: &Rounded, second: &Rounded, limits: &[Rounded]) -> [f32; WIDTH] {
        let (f, g) = (self.at_most(first), self.at_most(second));
        let mut keys = [f32::INFINITY; WIDTH];
        for i in 0..WIDTH {
            if f[i] > 0.0 && g[i] > 0.0 && self.has_child(i) {
                keys[i] = -f[i] * g[i];
            }
        }
        for limit in limits {
            let most = self.at_most(limit);
            for i in 0..WIDTH {
                if most[i] < 0.0 {
                    keys[i] = f32::INFINITY;
                }
            }
        }
        keys
    }
}

/// What a box must not exceed to be looked at.
fn key(more_than: f64) -> f32 {
    // Twice the rounding of the product.
    above(-more_than * (1.0 - 4.0 * f64::from(f32::EPSILON)))
}

/// As many as a box has sides.
const MOST_LIMITS: usize = 6;
