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

mod boxes;
mod build;
mod clearance;
mod closest;
mod inside;
mod nearest;
mod outlying;
mod pairs;
mod ray;
mod segment;
mod stack;

use nalgebra::Vector3;

pub(super) use self::inside::normal_at;
use super::Face;
pub(in crate::mesh) use closest::closest_on;
pub use nearest::Nearest;
pub(crate) use nearest::TooMany;
pub use outlying::Linear;
pub use segment::Hit;
pub(in crate::mesh) use segment::Leaving;
#[cfg(test)]
pub(crate) use stack::POPPED;

/// A hierarchy of boxes around the faces of a mesh.
///
/// It does not hold the faces: each query is handed those it was built from, as [`Triangles`].
///
/// `WIDTH` is the number of children of a node: 2, 4 or 8. Meshes use 4: half as long as 2 near the surface, and 8 gains
/// nothing more (`cargo bench -p haptics --bench mesh_queries` compares them).
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
    #[inline(always)]
    pub(super) fn corners(self, face: &Face) -> [Vector3<f64>; 3] {
        let [a, b, c] = face.vertices;
        [self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]]
    }
}

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// What it occupies \[bytes\].
    pub fn size_bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// The box around all faces: lowest and highest coordinates \[m\].
    pub fn bounds_B(&self) -> [Vector3<f64>; 2] {
        [self.lower_B, self.upper_B]
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

    /// Squared distances of a point from the boxes \[m^2\], too small rather than too large, unless they are below the
    /// normal numbers of `f32`.
    // Inlined, the compiler takes the lanes apart again where they are sorted.
    #[inline(never)]
    fn squared_distances(&self, p: &Rounded) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            let (lower, upper) = (&self.bounds[0][axis], &self.bounds[1][axis]);
            for i in 0..WIDTH {
                let outside = larger(lower[i] - p.upper[axis], p.lower[axis] - upper[i]);
                let outside = larger(outside, 0.0);
                sum[i] += outside * outside;
            }
        }
        // A difference, its square and two sums, each rounded by half a unit in the last place.
        for squared in &mut sum {
            *squared *= 1.0 - 4.0 * f32::EPSILON;
        }
        sum
    }
}

/// A point between two of `f32`.
struct Rounded {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl Rounded {
    #[inline]
    fn new(p: &Vector3<f64>) -> Self {
        Self { lower: [below(p.x), below(p.y), below(p.z)], upper: [above(p.x), above(p.y), above(p.z)] }
    }
}

/// The largest `f32` that is not above a number.
#[inline]
fn below(number: f64) -> f32 {
    let nearest = number as f32;
    if f64::from(nearest) > number { nearest.next_down() } else { nearest }
}

/// The smallest `f32` that is not below a number.
#[inline]
fn above(number: f64) -> f32 {
    let nearest = number as f32;
    if f64::from(nearest) < number { nearest.next_up() } else { nearest }
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

/// Most faces in a run that has one box. On a million faces, runs of one took 66 instead of 37 bytes per face and gained
/// nothing; runs of four took 23, and steps near the surface twice as long.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, make};

    /// Checks a subtree; returns the first face after it, and the most entries its visit may need on a stack.
    fn check<const WIDTH: usize>(
        tree: &Bvh<WIDTH>,
        node: usize,
        first: usize,
        triangles: Triangles<'_>,
        around: &[[f32; 3]; 2],
    ) -> (usize, usize) {
        let node = &tree.nodes[node];
        let (mut runs, mut deepest) = (Vec::new(), 0);
        for (i, child) in node.children.iter().enumerate() {
            let bounds = [0, 1].map(|side| [0, 1, 2].map(|axis| node.bounds[side][axis][i]));
            if bounds[0][0] > bounds[1][0] {
                continue;
            }
            for axis in 0..3 {
                assert!(bounds[0][axis] >= around[0][axis] && bounds[1][axis] <= around[1][axis]);
            }
            runs.push((*child, bounds));
        }
        let start = |child: &Child| match child.count() {
            0 => leftmost(tree, child.index()),
            _ => child.index(),
        };
        runs.sort_by_key(|(child, _)| start(child));
        let mut next = first;
        for (child, bounds) in runs {
            if child.count() == 0 {
                let (end, depth) = check(tree, child.index(), next, triangles, &bounds);
                (next, deepest) = (end, deepest.max(depth));
                continue;
            }
            assert_eq!(child.index(), next, "every face once");
            next += child.count();
            for face in &triangles.faces[child.index()..next] {
                for corner in triangles.corners(face) {
                    for axis in 0..3 {
                        assert!(f64::from(bounds[0][axis]) <= corner[axis], "outward");
                        assert!(f64::from(bounds[1][axis]) >= corner[axis], "outward");
                    }
                }
            }
        }
        (next, deepest + WIDTH - 1)
    }

    fn leftmost<const WIDTH: usize>(tree: &Bvh<WIDTH>, node: usize) -> usize {
        let node = &tree.nodes[node];
        let used = (0..WIDTH).filter(|&i| node.bounds[0][0][i] <= node.bounds[1][0][i]);
        let first = used.map(|i| match node.children[i] {
            child if child.count() == 0 => leftmost(tree, child.index()),
            child => child.index(),
        });
        first.min().expect("no node is empty")
    }

    fn check_all<const WIDTH: usize>(faces: &[Face], vertices: &[Vector3<f64>]) {
        let tree = Bvh::<WIDTH>::build(faces, vertices);
        let everywhere = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];
        let (end, deepest) = check(&tree, 0, 0, Triangles { faces, vertices }, &everywhere);
        assert_eq!(end, faces.len());
        assert!(deepest < STACK, "{deepest}");
        assert!(tree.size_bytes() < 60 * faces.len().max(256), "{}", tree.size_bytes());
    }

    #[test]
    fn every_face_is_in_one_run_and_all_boxes_hold_what_is_below_them() {
        for soup in
            [make::bumpy_sphere(100, 50, 0.1), make::cuboid([0.1, 0.2, 0.3]), make::uv_sphere(3, 2, 1e3)]
        {
            let (mesh, _) = Mesh::build(soup).unwrap();
            check_all::<2>(mesh.faces(), mesh.vertices());
            check_all::<4>(mesh.faces(), mesh.vertices());
            check_all::<8>(mesh.faces(), mesh.vertices());
        }
    }

    #[test]
    fn faces_that_nothing_tells_apart_do_not_make_the_tree_deep() {
        let (mesh, _) = Mesh::build(make::cuboid([0.1, 0.2, 0.3])).unwrap();
        let copies = vec![mesh.faces()[0]; 1_000_000];
        check_all::<4>(&copies, mesh.vertices());
        // Ever larger by a constant factor: an unbounded heuristic would cut off one after the other.
        let growing: Vec<_> =
            (0..600).map(|i| Vector3::new(1.0, f64::from(i % 3), 2.0) * 1.25f64.powi(i / 3 - 100)).collect();
        let faces: Vec<_> =
            (0..200).map(|i| Face { vertices: [3 * i, 3 * i + 1, 3 * i + 2], ..mesh.faces()[0] }).collect();
        let many: Vec<_> = faces.iter().flat_map(|face| [*face; 50]).collect();
        check_all::<4>(&many, &growing);
        check_all::<8>(&many, &growing);
    }

    #[test]
    fn numbers_are_rounded_outward() {
        for number in [0.1, -0.1, 1e-50, -1e-50, 1e300, -1e300, 0.5, 0.0] {
            assert!(f64::from(below(number)) <= number && number <= f64::from(above(number)));
            assert!(above(number) <= below(number).next_up());
        }
    }
}
