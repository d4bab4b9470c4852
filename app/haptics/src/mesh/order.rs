//! Puts faces and vertices into an order in which neighbours in space are neighbours in memory.
//!
//! Model: faces along a Morton curve through their centroids, vertices in the order of their first use. Faces in
//! the same cell of the curve are ordered by their coordinates, and every face begins with its smallest corner. So
//! the order depends on the geometry alone: the same mesh with its faces and vertices shuffled gives the same order.

use super::report::Finding;
use nalgebra::Vector3;
use std::cmp::Ordering;

/// A face on its way into a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Triangle {
    /// How far along the curve its centroid lies.
    place: u64,
    /// The smallest one first.
    pub(super) corners: [u32; 3],
    /// Its index in the input; of a lid that of a face beside the hole, with [`LID`].
    origin: u32,
}

/// Indices of faces are smaller.
const LID: u32 = 1 << 31;
const _: () = assert!(super::Link::MAX_FACES < LID as usize);

impl Triangle {
    pub(super) fn new(mut corners: [u32; 3], points: &[Vector3<f64>; 3], origin: u32, curve: &Curve) -> Self {
        corners.rotate_left(smallest(points));
        Self { place: curve.place(&centroid(points)), corners, origin }
    }

    /// The same as a part of a lid.
    pub(super) fn of_lid(self) -> Self {
        Self { origin: self.origin | LID, ..self }
    }

    pub(super) fn is_lid(&self) -> bool {
        self.origin & LID != 0
    }

    /// Its index in the input; of a lid that of a face beside the hole.
    pub(super) fn origin(&self) -> u32 {
        self.origin & !LID
    }
}

/// Sorts along the curve; of faces with the same three vertices only the first of the input stays.
pub(super) fn sort_spatially(
    triangles: &mut Vec<Triangle>,
    vertices: &[Vector3<f64>],
    duplicate: &mut Finding,
) {
    triangles.sort_unstable_by_key(|triangle| triangle.place);
    let (mut done, mut kept) = (0, 0);
    while done < triangles.len() {
        let place = triangles[done].place;
        let cell = triangles[done..].iter().take_while(|triangle| triangle.place == place).count();
        let end = kept + cell;
        triangles.copy_within(done..done + cell, kept);
        if cell > 1 {
            kept += order_cell(&mut triangles[kept..end], vertices, duplicate);
        } else {
            kept = end;
        }
        done += cell;
    }
    triangles.truncate(kept);
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

fn smallest(points: &[Vector3<f64>; 3]) -> usize {
    let is_less = |i: usize, j: usize| compare(&points[i], &points[j]).is_lt();
    match (is_less(1, 0), is_less(2, 0)) {
        (false, false) => 0,
        (_, true) if is_less(2, 1) => 2,
        _ => 1,
    }
}

fn compare(a: &Vector3<f64>, b: &Vector3<f64>) -> Ordering {
    let axis = |i: usize| a[i].partial_cmp(&b[i]).unwrap_or(Ordering::Equal);
    axis(0).then_with(|| axis(1)).then_with(|| axis(2))
}

/// Orders the faces in one cell of the curve and moves the unrepeated ones to the front. Gives their number.
///
/// Equal faces have equal centroids, so they are all in one cell.
fn order_cell(cell: &mut [Triangle], vertices: &[Vector3<f64>], duplicate: &mut Finding) -> usize {
    let at = |corner: u32| &vertices[corner as usize];
    // A face begins with its smallest corner, so this sorts its corners.
    let ascending = |&Triangle { corners: [a, b, c], .. }: &Triangle| {
        if compare(at(b), at(c)).is_gt() { [a, c, b] } else { [a, b, c] }
    };
    cell.sort_unstable_by(|s, t| {
        let pairs = ascending(s).into_iter().zip(ascending(t));
        let geometry = pairs.map(|(a, b)| compare(at(a), at(b))).find(|order| order.is_ne());
        geometry.unwrap_or_else(|| s.origin.cmp(&t.origin))
    });
    let mut kept = 0;
    for i in 0..cell.len() {
        let triangle = cell[i];
        if kept > 0 && ascending(&cell[kept - 1]) == ascending(&triangle) {
            duplicate.note(triangle.origin() as usize);
        } else {
            cell[kept] = triangle;
            kept += 1;
        }
    }
    kept
}

/// A Morton curve of 2^63 cubic cells around a set of points.
pub(super) struct Curve {
    from: Vector3<f64>,
    cells_per_m: f64,
}

const CELLS: f64 = (1_u64 << 21) as f64;

impl Curve {
    pub(super) fn through(points: &[Vector3<f64>]) -> Self {
        let from = points.iter().fold(points[0], |low, p| low.inf(p));
        let to = points.iter().fold(points[0], |high, p| high.sup(p));
        let side_m = (to - from).max();
        Self { from, cells_per_m: if side_m > 0.0 { CELLS / side_m } else { 0.0 } }
    }

    fn place(&self, point: &Vector3<f64>) -> u64 {
        let cell = ((point - self.from) * self.cells_per_m).map(|x| x.clamp(0.0, CELLS - 1.0) as u64);
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
        // The small ones are lost one by one beside 1, and count if they are added first.
        let tiny = 0.5 * f64::EPSILON;
        let [a, b, c] =
            [Vector3::new(1.0, tiny, 1e9), Vector3::new(tiny, 1.0, 0.1), Vector3::new(tiny, tiny, 0.3)];
        let expected = centroid(&[a, b, c]);
        for corners in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
            assert_eq!(centroid(&corners), expected);
        }
    }
}
