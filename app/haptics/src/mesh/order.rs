//! Puts faces and vertices into an order in which neighbours in space are neighbours in memory.
//!
//! Model: faces along a Morton curve through their centroids, vertices in the order of their first use. Faces in
//! the same cell of the curve are ordered by their coordinates, and every face begins with its smallest corner. So
//! the order depends on the geometry alone: the same mesh with its faces and vertices shuffled gives the same order.

use super::repair::Triangle;
use super::report::Finding;
use nalgebra::Vector3;
use std::cmp::Ordering;

/// Sorts along the curve; of faces with the same three vertices only the first of the input stays.
pub(super) fn sort_spatially(
    mut triangles: Vec<Triangle>,
    vertices: &[Vector3<f64>],
    duplicate: &mut Finding,
) -> Vec<Triangle> {
    triangles.iter_mut().for_each(|triangle| begin_with_smallest(&mut triangle.corners, vertices));
    let curve = Curve::through(vertices);
    let mut keys: Vec<(u64, u32)> = (0..triangles.len())
        .map(|i| (curve.key(&triangles[i].corners.map(|v| vertices[v as usize])), i as u32))
        .collect();
    keys.sort_unstable();
    let mut sorted: Vec<Triangle> = Vec::with_capacity(triangles.len());
    for cell in keys.chunk_by(|a, b| a.0 == b.0) {
        let first = sorted.len();
        sorted.extend(cell.iter().map(|&(_, i)| triangles[i as usize]));
        if cell.len() > 1 {
            order_cell(&mut sorted, first, vertices, duplicate);
        }
    }
    sorted
}

/// The vertices in order of first use, to which the corners then refer. Unused ones are left out, -0 becomes 0.
pub(super) fn renumber(triangles: &mut [Triangle], vertices: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    const UNSEEN: u32 = u32::MAX;
    let mut number = vec![UNSEEN; vertices.len()];
    let mut used = Vec::with_capacity(vertices.len().min(triangles.len()));
    for corner in triangles.iter_mut().flat_map(|triangle| &mut triangle.corners) {
        let old = *corner as usize;
        if number[old] == UNSEEN {
            number[old] = used.len() as u32;
            used.push(vertices[old].add_scalar(0.0));
        }
        *corner = number[old];
    }
    used
}

fn begin_with_smallest(corners: &mut [u32; 3], vertices: &[Vector3<f64>]) {
    let smaller = |i: usize, j: usize| compare(corners[i], corners[j], vertices) == Ordering::Less;
    let smallest = match (smaller(1, 0), smaller(2, 0)) {
        (false, false) => 0,
        (_, true) if smaller(2, 1) => 2,
        _ => 1,
    };
    corners.rotate_left(smallest);
}

fn compare(a: u32, b: u32, vertices: &[Vector3<f64>]) -> Ordering {
    let [a, b] = [a, b].map(|v| vertices[v as usize]);
    let axis = |i: usize| a[i].partial_cmp(&b[i]).unwrap_or(Ordering::Equal);
    axis(0).then_with(|| axis(1)).then_with(|| axis(2))
}

/// Orders the faces from `first` on, which have the same place on the curve, and leaves out repeated ones: equal
/// faces have equal centroids, so they are all in one cell.
fn order_cell(sorted: &mut Vec<Triangle>, first: usize, vertices: &[Vector3<f64>], duplicate: &mut Finding) {
    // A face begins with its smallest corner, so this sorts its corners.
    let ascending = |&Triangle { corners: [a, b, c], .. }: &Triangle| {
        if compare(b, c, vertices) == Ordering::Greater { [a, c, b] } else { [a, b, c] }
    };
    sorted[first..].sort_unstable_by(|s, t| {
        let pairs = ascending(s).into_iter().zip(ascending(t));
        let geometry = pairs.map(|(a, b)| compare(a, b, vertices)).find(|order| order.is_ne());
        geometry.unwrap_or_else(|| s.origin.cmp(&t.origin))
    });
    let mut kept = first;
    for i in first..sorted.len() {
        let triangle = sorted[i];
        if kept > first && ascending(&sorted[kept - 1]) == ascending(&triangle) {
            duplicate.note(triangle.origin as usize);
        } else {
            sorted[kept] = triangle;
            kept += 1;
        }
    }
    sorted.truncate(kept);
}

/// A Morton curve of 2^63 cubic cells around a set of points.
struct Curve {
    from: Vector3<f64>,
    cells_per_m: f64,
}

const CELLS: f64 = (1_u64 << 21) as f64;

impl Curve {
    fn through(points: &[Vector3<f64>]) -> Self {
        let from = points.iter().fold(points[0], |low, p| low.inf(p));
        let to = points.iter().fold(points[0], |high, p| high.sup(p));
        let side_m = (to - from).max();
        Self { from, cells_per_m: if side_m > 0.0 { CELLS / side_m } else { 0.0 } }
    }

    fn key(&self, corners: &[Vector3<f64>; 3]) -> u64 {
        let cell =
            ((centroid(corners) - self.from) * self.cells_per_m).map(|x| x.clamp(0.0, CELLS - 1.0) as u64);
        spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
    }
}

/// The sum runs from the smallest coordinate to the largest, so that it is the same whichever corner comes first.
fn centroid([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let (low, high) = (a.inf(b), a.sup(b));
    let middle = high.inf(c).sup(&low);
    (low.inf(c) + middle + high.sup(c)) / 3.0
}

/// Puts two zeros between the 21 lowest bits.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001F_0000_0000_FFFF;
    let x = (x | x << 16) & 0x001F_0000_FF00_00FF;
    let x = (x | x << 8) & 0x100F_00F0_0F00_F00F;
    let x = (x | x << 4) & 0x10C3_0C30_C30C_30C3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreading_keeps_every_bit_and_leaves_room_for_two_others() {
        for bit in 0..21 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << 21) - 1), 0x1249_2492_4924_9249);
    }

    #[test]
    fn the_centroid_is_the_same_to_the_bit_for_every_order_of_the_corners() {
        let [a, b, c] =
            [Vector3::new(0.1, 1e9, -0.7), Vector3::new(1.0 / 3.0, 0.1, 0.2), Vector3::new(-1e-9, 0.3, 1e-3)];
        let expected = centroid(&[a, b, c]);
        for corners in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
            assert_eq!(centroid(&corners), expected);
        }
    }
}
