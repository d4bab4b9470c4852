//! Finds faces of a mesh by where they are: a hierarchy of boxes.
//!
//! Problem: a finger in free space asks a thousand times a second whether its last step met one of a million
//! faces; only a handful may be looked at.
//!
//! Model: a tree of nodes with `WIDTH` children each. A node holds the boxes of its children, one array of
//! `WIDTH` numbers per bound, so that one instruction tests all children at once. Each child stands for a run
//! of consecutive faces: faces are stored in spatial order, so a run is small in space. Where runs are cut is
//! decided by the surface area heuristic (MacDonald & Booth 1990).
//!
//! Frames and signs: object frame B, as the mesh.
//!
//! Invariants: a box in `f32` contains the `f64` geometry it stands for (bounds are rounded outward). The depth
//! is bounded by the number of faces alone, whatever their shape, so that a query's stack has a constant size.
//!
//! Cost: queries neither allocate nor recurse; how many nodes they visit depends on the geometry nearby, except
//! [`Bvh::clearance`], which visits a constant number.

mod build;
mod clearance;
mod closest;
mod inside;
mod nearest;
mod segment;
mod stack;

use nalgebra::Vector3;

use super::Face;
pub use nearest::Nearest;
pub use segment::Hit;

/// A hierarchy of boxes around the faces of a mesh.
///
/// It does not hold the faces: each query is handed those it was built from, as [`Triangles`].
///
/// `WIDTH` is the number of children of a node: 2, 4 or 8. Meshes use 4, the fastest of the three (`cargo bench
/// -p haptics --bench mesh_queries` compares them).
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh<const WIDTH: usize = 4> {
    nodes: Box<[Node<WIDTH>]>,
    lower_B: Vector3<f64>,
    upper_B: Vector3<f64>,
}

/// The faces and vertices that a hierarchy was built from.
#[derive(Debug, Clone, Copy)]
pub struct Triangles<'a> {
    /// In the order in which the hierarchy saw them.
    pub faces: &'a [Face],
    /// In the object's frame B \[m\].
    pub vertices: &'a [Vector3<f64>],
}

impl<'a> Triangles<'a> {
    fn corners(self, face: &Face) -> [Vector3<f64>; 3] {
        face.vertices.map(|vertex| self.vertices[vertex as usize])
    }
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// What it occupies \[bytes\].
    pub fn size_bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// Largest absolute coordinate of the geometry \[m\]: what tolerances are relative to.
    fn extent_m(&self) -> f64 {
        self.lower_B.amax().max(self.upper_B.amax())
    }
}

/// The boxes of `WIDTH` children: `bounds[0]` lower, `bounds[1]` upper, then axis, then child.
///
/// A slot without a child has an inverted, infinite box, which no query meets.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
struct Node<const WIDTH: usize> {
    bounds: [[[f32; WIDTH]; 3]; 2],
    children: [Child; WIDTH],
}

impl<const WIDTH: usize> Node<WIDTH> {
    const EMPTY: Self = Self {
        bounds: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]],
        children: [Child(0); WIDTH],
    };

    /// Squared distances of a point from the boxes \[m^2\], too small rather than too large.
    ///
    /// In `f64`, unlike the segment's test: with it a point far from a small mesh still tells the boxes apart.
    #[inline(always)]
    fn squared_distances(&self, p: &Vector3<f64>) -> [f64; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            let (lower, upper) = (&self.bounds[0][axis], &self.bounds[1][axis]);
            for i in 0..WIDTH {
                let outside = larger(f64::from(lower[i]) - p[axis], p[axis] - f64::from(upper[i]));
                let outside = larger(outside, 0.0);
                sum[i] += outside * outside;
            }
        }
        // Three squares and two sums, each rounded by half a unit in the last place.
        sum.map(|squared| squared * (1.0 - 4.0 * f64::EPSILON))
    }
}

/// A child of a node: another node, or a run of faces.
///
/// Packed into a word: bits 0-28 index of the node or of the first face, bits 29-31 number of faces, 0 for a node.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Child(u32);

impl Child {
    const INDEX_BITS: u32 = 29;

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn run(first: usize, count: usize) -> Self {
        debug_assert!((1..=LONGEST_RUN).contains(&count) && first < 1 << Self::INDEX_BITS);
        Self((count as u32) << Self::INDEX_BITS | first as u32)
    }

    fn index(self) -> usize {
        (self.0 & ((1 << Self::INDEX_BITS) - 1)) as usize
    }

    /// How many faces; 0 says that it is a node.
    fn count(self) -> usize {
        (self.0 >> Self::INDEX_BITS) as usize
    }
}

/// Most faces in a run that has one box. One box per face is faster near the surface, but doubles the memory.
const LONGEST_RUN: usize = 2;
/// Entries of a query's stack. A node takes one off and puts at most `WIDTH` on, so this bounds the depth.
const STACK: usize = 64;

/// Without a care for NaN, which compiles to one instruction where `f64::max` takes three.
#[inline(always)]
fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}
